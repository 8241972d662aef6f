"""A fixed set of the bench's draws, each hidden, diagnosed and scored: what is hidden is found."""

from __future__ import annotations

from pathlib import Path

import pytest

from catheter_sim.diagnosis.pipeline import diagnose
from hidden_effects import first_draws
from hidden_effects.first_bench import miss_text, run_draw

SEED, DRAWS = 7, 20  # as many of each story as in any twenty draws in a row
WITH_EVERY_CHANGE = (0, 3)  # of them: one effect, none; one that is not on the list and pairs run apart
QUICK = ("mitral_transseptal", "mitral_4dof", "file_displacement")
TRIALS = {"TRAINING": 3, "HELDOUT": 1, "ASIDE": 1}  # fewer than the bench's, for speed


def _diagnose(dataset: Path, output: Path, limit_s: float) -> str:
    diagnose(dataset, output)
    return ""


@pytest.mark.parametrize(
    "index",
    [
        pytest.param(index, marks=pytest.mark.slow if index in WITH_EVERY_CHANGE else pytest.mark.long)
        for index in range(DRAWS)
    ],
)
def test_what_is_hidden_is_found(index, tmp_path, monkeypatch):
    """The effect is named first, both of a pair; nothing for nothing, nor for what is not in the list."""
    for name, count in TRIALS.items():
        monkeypatch.setattr(first_draws, name, count)
    monkeypatch.setattr(first_draws, "TRAINING", TRIALS["TRAINING"])
    score = run_draw(SEED, index, tmp_path, QUICK, diagnose=_diagnose)
    assert score["right"], miss_text(score)
