"""What a diagnosis hands on about its trials."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis import verdict
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.tables import Table


def test_fitted_series_have_the_files_stamps(monkeypatch: pytest.MonkeyPatch) -> None:
    """The model runs on the trial's own clock; what is written can be laid beside the measured file."""
    stamps = 1778538602.521 + np.array([0.0, 0.5, 1.25])
    inputs = Inputs(
        np.array([0.0, 0.5, 1.25]), "tension", np.zeros((3, 2)), np.zeros((3, 3)), np.zeros((3, 3))
    )
    trial = Trial("a.csv", "train", inputs, Table(stamps, {"tip_x_mm": np.zeros(3)}, "a.csv"))
    computed = np.ones((3, 1)), np.ones((3, 1)), None
    monkeypatch.setattr(verdict, "computed_along", lambda *asked: computed)
    problem: Any = SimpleNamespace(columns=("tip_x_mm",))
    nothing: Any = None
    (fit,) = verdict.trial_fits(problem, [trial], nothing, nothing)
    for times in (fit.time_s, fit.before.time_s, fit.after.time_s):
        np.testing.assert_array_equal(times, stamps)
