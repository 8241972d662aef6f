"""Planted lags, delays, drifts and couplings are found: data simulated in MuJoCo, diagnosis by the twin.

Rows follow one another at random intervals, as a person or an uneven drive would play them: at a constant
speed a delay is a dead-band.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import (
    Effects,
    as_inputs,
    data_set,
    displacement_history,
    joint_history,
    pair_history,
    small_robot,
)

from catheter_sim.catalogue import load_robot
from catheter_sim.core.document import with_number
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.result import DiagnosisResult
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon

pytestmark = pytest.mark.slow

TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")


def paced(inputs: Inputs, seed: int) -> Inputs:
    """Return the same rows at random intervals of 0.4 to 3 s."""
    steps = np.random.default_rng(seed).uniform(0.4, 3.0, len(inputs) - 1)
    return replace(inputs, time_s=np.concatenate([[0.0], np.cumsum(steps)]))


def section_data(effects: Effects) -> Dataset:
    """Return three trials of the neuroendoscope's section, one a repeat of another."""
    histories = [paced(pair_history(seed, 3), seed) for seed in (1, 1, 2)]
    columns = ("tip_x_mm", "tip_z_mm", "body_15_x_mm", "body_15_z_mm")
    name = "neuroendoscope_section"
    return data_set(load_robot(name), name, effects, histories, columns)


def small_data(effects: Effects) -> Dataset:
    """Return three trials of the small robot, from a chain with twice its hinges."""
    histories = [paced(displacement_history(seed), seed) for seed in (1, 2, 3)]
    return data_set(small_robot(), "small.toml", effects, histories, TIP, links=2)


def catheter_data(effects: Effects) -> Dataset:
    """Return three trials of the transseptal catheter, whose arm is 0.6 % off."""
    specified = load_robot("mitral_transseptal")
    built = with_number(specified, "segments.bending.arm_mm", 1.8 * 1.006)
    histories = [paced(joint_history(seed, 2), seed) for seed in (1, 1, 2)]
    columns = (*TIP, *(f"body_11_{axis}_mm" for axis in "xyz"))
    found = data_set(built, "mitral_transseptal", effects, histories, columns)
    return replace(found, robot=specified)


def sections_data(effects: Effects) -> Dataset:
    """Return three trials of a robot of two sections, from a chain with twice its hinges."""
    histories = [paced(both_sections(seed), seed) for seed in (1, 2, 3)]
    columns = (*TIP, *(f"body_12_{axis}_mm" for axis in "xyz"))
    return data_set(two_sections(), "two.toml", effects, histories, columns, links=2)


def two_sections() -> ContinuumRobot:
    """Return a robot as of a `.toml`: two segments of 50 mm, three elastic tendons each, 40 deg apart."""
    return replace(
        small_robot(),
        name="two",
        # Twelve disks each: of six, arcs and chain would be three quarters of the noise apart.
        segments=tuple(Segment(name, 0.05, 12, 5e-3, 2.5e-3, 3e-3) for name in ("near", "far")),
        tendons=tuple(
            Tendon(
                f"{name}_{k}",
                4.5e-3,
                math.radians(120.0 * k + turn),
                name,
                stiffness_N_per_m=8e3,
                pretension_N=1.0,
            )
            for name, turn in (("near", 20.0), ("far", 60.0))
            for k in range(3)
        ),
        friction=Friction(0.0),
    )


def both_sections(seed: int) -> Inputs:
    """Return displacements of two sections that bend in directions of their own, one after the other."""
    near, far = (displacement_history(number).tendon for number in (seed, seed + 100))
    return as_inputs(0.6 * np.hstack([near, np.roll(far, 5, axis=0)]), "displacement")


def assert_found(found: DiagnosisResult, effects: Effects, slack: float) -> None:
    """Assert that the cause leads, its numbers lie in their widened intervals, and the noise is left."""
    ((effect, values),) = effects.items()
    assert found.verdict == "cause_found"
    assert found.causes[0].name == effect
    assert set(values) <= set(found.causes[0].parameters)
    for name, value in values.items():
        low, high = found.causes[0].parameters[name].ci95
        assert low - slack * abs(value) <= value <= high + slack * abs(value), name
    assert all(effect not in group for group in found.indistinguishable)
    assert found.headline.rmse_after < 1.3 * found.headline.noise_floor


@pytest.mark.parametrize(
    "make",
    [
        pytest.param(small_data, marks=pytest.mark.long),
        catheter_data,
        pytest.param(sections_data, marks=pytest.mark.long),
    ],
)
def test_nothing_planted_at_an_uneven_pace(make) -> None:
    """Without a cause none is named: neither time nor coupling is read into the noise."""
    found = diagnose_dataset(make({}), simulation=False)
    assert found.verdict == "no_discrepancy"
    assert found.causes == ()


def test_lag_of_the_section_is_found() -> None:
    """A lag of 0.8 s beside dry friction is named alone: within 2 %, by which its history is simulated."""
    effects = {"rate": {"lag_s": 0.8}}
    found = diagnose_dataset(section_data(effects), simulation=False)
    assert_found(found, effects, slack=0.02)
    assert len(found.causes) == 1


@pytest.mark.long
def test_delay_of_a_small_robot_is_found() -> None:
    """A delay is told from a lag, though a lag alone takes most of the error."""
    effects = {"rate": {"delay_s": 0.8}}
    found = diagnose_dataset(small_data(effects), simulation=False)
    assert_found(found, effects, slack=0.01)
    assert set(found.causes[0].parameters) == {"delay_s"}


@pytest.mark.parametrize(
    ("make", "values"),
    [
        pytest.param(catheter_data, {"zero_bending_mm_per_min": 0.3}, marks=pytest.mark.long),
        (small_data, {"creep": 0.15, "creep_time_s": 40.0}),
    ],
)
def test_drift_is_found(make, values) -> None:
    """A zero that wanders is told from one that is off, creep from a softer robot."""
    effects = {"drift": values}
    assert_found(diagnose_dataset(make(effects), simulation=False), effects, slack=0.01)


@pytest.mark.parametrize(
    ("make", "values"),
    [
        (catheter_data, {"bending_to_torsion_proximal": 0.1}),
        pytest.param(sections_data, {"far_to_near": 0.1}, marks=pytest.mark.long),
    ],
)
def test_coupling_is_found(make, values) -> None:
    """Which joint or section moves which is named, and by how much; a chain's few hinges make up the rest."""
    effects = {"coupling": values}
    found = diagnose_dataset(make(effects), simulation=False)
    assert_found(found, effects, slack=0.02)
    assert sum(cause.gain_percent for cause in found.causes[1:]) < 5.0
