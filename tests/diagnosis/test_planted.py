"""Planted causes are found and nothing planted gives nothing: the diagnosis from end to end.

The data come from the simulation, the fit from the analytic twin, so that the two share no code
that solves for equilibrium.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted import section_data, small_data

from catheter_sim.diagnosis.pipeline import diagnose_dataset

pytestmark = pytest.mark.slow


def test_nothing_planted_in_the_section():
    """Without a cause the calibrated section agrees with its data: no discrepancy, at the noise."""
    found = diagnose_dataset(section_data({}), simulation=False)
    assert found.verdict == "no_discrepancy"
    assert found.causes == ()
    assert found.headline.noise_floor == pytest.approx(0.1, rel=0.2)
    assert found.headline.rmse_before < 0.13


@pytest.mark.parametrize(
    ("effect", "parameter", "value", "tolerance"),
    [
        ("backlash", "width_N", 0.06, 0.05),
        ("stiffness", "scale", 0.8, 0.03),
        ("tendon_friction", "mu", 0.5, 0.05),
    ],
)
def test_cause_in_the_section_is_found(effect, parameter, value, tolerance):
    """A planted cause is named alone, its size within a few percent, and most of the error is gone."""
    found = diagnose_dataset(section_data({effect: {parameter: value}}), simulation=False)
    assert found.verdict == "cause_found"
    assert [cause.name for cause in found.causes] == [effect]
    assert found.causes[0].parameters[parameter].value == pytest.approx(value, rel=tolerance)
    assert found.headline.gain_percent > 50.0
    assert found.headline.gain_percent_ci95[0] > 0.0
    assert found.headline.rmse_after < 2.0 * found.headline.noise_floor


def test_nothing_planted_in_a_small_robot():
    """A robot from a file, measured from a finer chain than the model's: no discrepancy."""
    found = diagnose_dataset(small_data({}), simulation=False)
    assert found.verdict == "no_discrepancy"
    assert found.causes == ()


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("backlash", {"width_mm": 0.5}),
        ("measurement_frame", {"rotation_x_deg": 4.0, "translation_z_mm": 2.0}),
        ("axial_compression", {"stiffness_N_per_mm": 12.0}),
    ],
)
def test_cause_in_a_small_robot_is_found(effect, values):
    """A planted cause leads the list, its parameters in or next to their intervals."""
    found = diagnose_dataset(small_data({effect: values}), simulation=False)
    assert found.verdict == "cause_found"
    assert found.causes[0].name == effect
    for name, value in values.items():
        low, high = found.causes[0].parameters[name].ci95
        slack = 0.05 * abs(value)
        assert low - slack <= value <= high + slack, name
    assert found.headline.rmse_after < 1.5 * found.headline.noise_floor


def test_heldout_measurements_do_not_steer_the_choice():
    """With the held-out measurements spoilt, the calibration and the chosen hypothesis stay the same."""
    data = small_data({"measurement_frame": {"rotation_x_deg": 4.0}})
    spoilt = []
    for trial in data.trials:
        if trial.role == "heldout":
            columns = {name: values + 20.0 * np.sin(values) for name, values in trial.outputs.columns.items()}
            trial = replace(trial, outputs=replace(trial.outputs, columns=columns))
        spoilt.append(trial)
    first = diagnose_dataset(data, simulation=False)
    second = diagnose_dataset(replace(data, trials=tuple(spoilt)), simulation=False)
    tried = [{item.causes: item.cross_validated_rmse for item in found.ranking} for found in (first, second)]
    assert tried[0] == tried[1]
