"""Planted causes are found and nothing planted gives nothing: the diagnosis from end to end.

The data come from the simulation, the fit from the analytic twin, so that the two share no code
that solves for equilibrium.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from planted import catheter_data, chest_data, section_data, small_data

from catheter_sim.diagnosis.next_experiment import TELLS_APART_NOISE
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.result import DiagnosisResult

pytestmark = pytest.mark.slow


def assert_named_alone(
    found: DiagnosisResult, effect: str, values: Mapping[str, float], slack: float
) -> None:
    """Assert that one cause is named, its numbers in their widened intervals, and noise is left."""
    assert found.verdict == "cause_found"
    assert [cause.name for cause in found.causes] == [effect]
    for name, value in values.items():
        low, high = found.causes[0].parameters[name].ci95
        assert low - slack * abs(value) <= value <= high + slack * abs(value), name
    assert found.headline.rmse_after < 1.3 * found.headline.noise_floor


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
        pytest.param("stiffness", "scale", 0.8, 0.03, marks=pytest.mark.long),
        pytest.param("tendon_friction", "mu", 0.5, 0.05, marks=pytest.mark.long),
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


def test_nothing_planted_in_the_chest_tube():
    """A chest-tube section with small errors of calibration: they are found, and no cause is named."""
    found = diagnose_dataset(chest_data({}, solver="simulation"), simulation=False)
    assert found.verdict == "no_discrepancy"
    assert found.causes == ()
    assert found.headline.rmse_before < 0.13
    for name, value in (("elastic_constant", 1.02), ("friction_coefficient", 0.29 / 0.316)):
        low, high = found.calibrated[name].ci95
        assert low - 0.01 <= value <= high + 0.01


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("tendon_friction", {"mu": 0.5}),
        pytest.param("backlash", {"width_N": 2.0}, marks=pytest.mark.long),
        pytest.param("precurvature", {"curvature_x_per_m": 0.3}, marks=pytest.mark.long),
        pytest.param("nonlinear_stiffness", {"cubic_mm2": 1000.0}, marks=pytest.mark.long),
    ],
)
def test_cause_in_the_chest_tube_is_found(effect, values):
    """A planted cause is named alone, its numbers within their intervals, and the error is the noise's."""
    found = diagnose_dataset(chest_data({effect: values}), simulation=False)
    assert_named_alone(found, effect, values, slack=0.02)


@pytest.mark.long
def test_gain_and_stiffness_of_the_chest_tube_are_not_told_apart():
    """Without weight only tension over stiffness counts: both names are given as one group."""
    found = diagnose_dataset(chest_data({"stiffness": {"scale": 0.8}}), simulation=False)
    assert found.verdict == "cause_found"
    assert {"stiffness", "actuation_gain"} in [set(group) for group in found.indistinguishable]


@pytest.mark.long
def test_proposed_experiment_tells_stiffness_from_gain_in_the_simulation_too():
    """A known force across the tip bends a softer robot further, whatever the scale of its tensions."""
    found = diagnose_dataset(section_data({"stiffness": {"scale": 0.8}}))
    assert found.indistinguishable == (("stiffness", "actuation_gain"),)
    proposal = found.next_experiment
    assert "known force" in proposal.words
    apart = proposal.apart["actuation_gain for stiffness"]
    assert apart.twin > TELLS_APART_NOISE
    assert apart.simulation == pytest.approx(apart.twin, rel=0.1)


def test_nothing_planted_in_the_catheter():
    """A transseptal catheter with small errors of calibration: they are found, and no cause is named."""
    found = diagnose_dataset(catheter_data({}), simulation=False)
    assert found.verdict == "no_discrepancy"
    assert found.causes == ()
    assert found.calibrated["arm_bending"].value == pytest.approx(1.006, abs=0.001)


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        pytest.param("backlash", {"width_bending_mm": 0.6}, marks=pytest.mark.long),
        pytest.param("actuation_gain", {"scale_bending": 1.08}, marks=pytest.mark.long),
        ("tendon_elongation", {"stiffness_N_per_mm": 8.0}),
        ("measurement_frame", {"rotation_y_deg": 2.0, "translation_x_mm": 1.0}),
    ],
)
def test_cause_in_the_catheter_is_found(effect, values):
    """A planted cause is named alone, its numbers within their intervals, and the error is the noise's."""
    found = diagnose_dataset(catheter_data({effect: values}), simulation=False)
    assert_named_alone(found, effect, values, slack=0.01)


def test_nothing_planted_in_a_small_robot():
    """A robot from a file, measured from a finer chain than the model's: no discrepancy."""
    found = diagnose_dataset(small_data({}), simulation=False)
    assert found.verdict == "no_discrepancy"
    assert found.causes == ()


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        pytest.param("backlash", {"width_mm": 0.5}, marks=pytest.mark.long),
        ("measurement_frame", {"rotation_x_deg": 4.0, "translation_z_mm": 2.0}),
        pytest.param("axial_compression", {"stiffness_N_per_mm": 12.0}, marks=pytest.mark.long),
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
    """With the held-out measurements spoilt, the calibration and the chosen hypothesis stay the same.

    Spoilt by so much that the file looks like another robot's, they end the diagnosis: no cause is chosen.
    """
    data = small_data({"measurement_frame": {"rotation_x_deg": 4.0}})

    def spoilt(size_mm):
        trials = []
        for trial in data.trials:
            if trial.role == "heldout":
                shown = trial.outputs.columns.items()
                columns = {name: values + size_mm * np.sin(values) for name, values in shown}
                trial = replace(trial, outputs=replace(trial.outputs, columns=columns))
            trials.append(trial)
        return replace(data, trials=tuple(trials))

    first = diagnose_dataset(data, simulation=False)
    second = diagnose_dataset(spoilt(3.0), simulation=False)
    assert second.headline.rmse_after > 5.0 * first.headline.rmse_after
    tried = [{item.causes: item.cross_validated_rmse for item in found.ranking} for found in (first, second)]
    assert tried[0] == tried[1]
    third = diagnose_dataset(spoilt(20.0), simulation=False)
    assert (third.verdict, third.causes) == ("data_suspect", ())
