"""Claims about the bench of foreign models: its draws, and a table that can fail on both sides."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catheter_sim.foreign.model import SUMMARIES, ForeignModel, ForeignTrial, Runner, variants_of
from hidden_effects.foreign_models import (
    NOTHING_EVERY,
    SUBJECTS,
    Hidden,
    as_text,
    hidden_of,
    met,
    outcome,
    recordings,
    summary,
)

MODELS = Path(__file__).parents[3] / "assets" / "foreign"


def draw(hidden: str | None, *named: str, alike: tuple[str, ...] = ()) -> dict[str, Any]:
    return {
        "index": 0,
        "model": "arm26",
        "hidden": None if hidden is None else {"cause": hidden, "size": 1.0},
        "named": list(named),
        "verdict": "cause_found" if named else "unexplained",
        "indistinguishable": [list(alike)] if alike else [],
        "times_noise": [9.0, 1.0],
    }


def test_outcomes_are_told_apart() -> None:
    assert outcome(draw("delay", "delay")) == "named"
    assert outcome(draw("delay", "damping", alike=("delay", "damping"))) == "named"
    assert outcome(draw("delay", "damping", alike=("payload", "damping"))) == "false"
    assert outcome(draw("delay", "delay", "payload")) == "in part"
    assert outcome(draw("delay")) == "missed"
    assert outcome(draw(None)) == "quiet"
    assert outcome(draw(None, "delay")) == "false"


def test_eight_of_ten_are_asked_and_quiet_where_nothing_is_hidden() -> None:
    right, wrong = draw("delay", "delay"), draw("delay", "payload")
    assert met(summary([right] * 8 + [wrong] * 2))
    assert not met(summary([right] * 7 + [wrong] * 3))
    assert not met(summary([right] * 10 + [draw(None, "delay")]))
    assert not met(summary([draw(None)]))
    assert "MISSED" in as_text(summary([wrong]), [wrong])


def test_draws_hide_what_the_models_may_have_and_sometimes_nothing() -> None:
    for index in range(2 * NOTHING_EVERY):
        subject, hidden, _ = hidden_of(3, index)
        assert (hidden is None) == (index % NOTHING_EVERY == NOTHING_EVERY - 1)
        if hidden is not None:
            assert hidden.cause in SUMMARIES
            model = ForeignModel(MODELS / subject.name / f"{subject.name}.xml").measured(
                subject.columns, "test"
            )
            assert hidden.cause in {item.cause for item in variants_of(model)}


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(SUBJECTS))
def test_nature_without_causes_is_the_file_with_a_finer_step(name: str) -> None:
    subject = SUBJECTS[name]
    path = MODELS / name / f"{name}.xml"
    time_s, controls, readings = recordings(MODELS / name, subject, None, np.random.default_rng(1), 1)[0]
    model = ForeignModel(path, (0.0, 0.0, -9.81), timestep_s=0.00025).measured(subject.columns, "test")
    trial = ForeignTrial("a", "train", time_s, controls, readings)
    errors = Runner(model, 1.0).outputs([{}], [trial])[0][0] - readings
    noise = [0.05] * len(subject.joints) + [0.3] * 3
    assert np.sqrt(np.mean((errors / noise) ** 2)) == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_every_hidden_cause_shows() -> None:
    subject = SUBJECTS["ur5e"]
    sizes = {
        "actuation_gain": 0.2,
        "actuation_offset": 0.2,
        "backlash": 0.04,
        "delay": 0.06,
        "damping": 1.0,
        "friction_loss": 0.3,
        "stiffness": 0.4,
        "payload": 0.3,
        "measurement_frame": 0.05,
    }
    assert set(sizes) == set(subject.causes)
    clean = recordings(MODELS / "ur5e", subject, None, np.random.default_rng(1), 1)[0][2]
    for cause, size in sizes.items():
        hidden = Hidden(cause, "0", size)
        seen = recordings(MODELS / "ur5e", subject, hidden, np.random.default_rng(1), 1)[0][2]
        assert np.sqrt(np.mean((seen - clean)[:, -3:] ** 2)) > 3.0, cause  # of the flange [mm]
