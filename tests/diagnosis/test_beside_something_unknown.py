"""A cause beside something that no form describes: named where it is sure, with what is left said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted import small_data

from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.result import DiagnosisResult
from catheter_sim.diagnosis.trials import Dataset

WIDTH_MM = 0.8


def rippled(data: Dataset) -> Dataset:
    """Return the data as a lens with rings would see them: 0.6 mm beside each place, over the first pull."""
    trials = []
    for trial in data.trials:
        columns, pull_mm = dict(trial.outputs.columns), 1e3 * trial.inputs.tendon[:, 0]
        for phase, name in enumerate(("tip_x_mm", "tip_y_mm", "tip_z_mm")):
            columns[name] = columns[name] + 0.6 * np.sin(1.2 * pull_mm + phase)
        trials.append(replace(trial, outputs=replace(trial.outputs, columns=columns)))
    return replace(data, trials=tuple(trials))


def found(effects: dict[str, dict[str, float]]) -> DiagnosisResult:
    return diagnose_dataset(rippled(small_data(effects)), simulation=False)


@pytest.mark.slow
def test_a_dead_band_is_named_beside_a_lens_with_rings() -> None:
    """With its width inside its interval; and that something else is wrong is said."""
    diagnosis = found({"backlash": {"width_mm": WIDTH_MM}})
    assert diagnosis.verdict == "cause_found"
    (cause,) = diagnosis.causes
    assert cause.name == "backlash"
    assert cause.probability >= 0.5
    low, high = cause.parameters["width_mm"].ci95
    assert low < WIDTH_MM < high
    assert high - low > 0.2  # what is left could move it by as much
    (said,) = (note.text for note in diagnosis.notes if note.code == "something_else_too")
    assert "omething else is wrong too" in said
    assert diagnosis.probabilities["outside"] > 0.5


@pytest.mark.slow
def test_the_lens_alone_makes_no_cause() -> None:
    """Without the dead-band nothing is named."""
    diagnosis = found({})
    assert diagnosis.verdict in ("unexplained", "improved")
    assert diagnosis.causes == ()
