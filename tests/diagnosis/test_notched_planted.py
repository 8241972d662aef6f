"""Causes planted in a notched tube are found, and nothing planted gives nothing.

The data are those of the kinetostatic model in steps a tenth as long as the twin's, of a tube whose own
numbers are a little off the published ones.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from planted import NO_GRAVITY, Effects, as_inputs

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import input_channels
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.result import DiagnosisResult
from catheter_sim.diagnosis.trials import Dataset, Trial
from catheter_sim.effects.apply import arriving_inputs, with_built_in_effects, with_effects
from catheter_sim.robots.notched_tube.spec import NotchedTubeRobot
from catheter_sim.robots.notched_tube.statics import solve_rows
from catheter_sim.tables import Table

pytestmark = pytest.mark.slow
NOISE_MM = 0.05
FINE_RAD = 0.02


def loops(seed: int, actuation: str = "tension", cycles: int = 3) -> Inputs:
    """Return inputs of the tendon: in, partly out, in again, home; in newtons or as a share of 1.2 mm."""
    generator = np.random.default_rng(seed)
    unit = 1.0 if actuation == "tension" else 0.38e-3
    rows = [0.0]
    for _ in range(cycles):
        top, valley = generator.uniform(1.6, 3.0), generator.uniform(0.3, 1.2)
        for a, b, count in ((0.0, top, 7), (top, valley, 5), (valley, 0.9 * top, 5), (0.9 * top, 0.0, 6)):
            rows += list(np.linspace(a, b, count)[1:])
    return as_inputs(unit * np.array(rows)[:, np.newaxis], actuation)


def wrist_data(effects: Effects, actuation: str = "tension") -> Dataset:
    """Return three trials of tip and third notch, in the plane, the last one held out."""
    specified = load_robot("notched_wrist")
    assert isinstance(specified, NotchedTubeRobot)
    specified = replace(specified, actuation=actuation)
    built = replace(specified, stiffness_scale=1.01, friction=Friction(0.95 * specified.friction.mu))
    hidden = with_effects(built, effects)
    generator = np.random.default_rng(3)
    trials = []
    for index in range(3):
        inputs = loops(index + 1, actuation)
        arriving = arriving_inputs(hidden, inputs)
        states = solve_rows([with_built_in_effects(hidden)], [arriving], NO_GRAVITY, step_bend_rad=FINE_RAD)
        p_mm = 1e3 * states.faces()[0][0]
        columns = {
            f"{place}_{axis}_mm": p_mm[:, element, k] + NOISE_MM * generator.normal(size=len(inputs))
            for place, element in (("tip", -1), ("body_3", 2))
            for axis, k in (("x", 0), ("z", 2))
        }
        file = f"trial_{index}.csv"
        role = "heldout" if index == 2 else "train"
        trials.append(Trial(file, role, inputs, Table(inputs.time_s, columns, file)))
    return Dataset(
        folder=Path("planted"),
        name="planted",
        robot=specified,
        robot_reference="notched_wrist",
        source="simulation",
        licence="none",
        gravity_mps2=NO_GRAVITY,
        input_channels=tuple(input_channels(specified, actuation)),
        output_channels=tuple(trials[0].outputs.columns),
        trials=tuple(trials),
    )


def assert_found(found: DiagnosisResult, effect: str, values: Mapping[str, float]) -> None:
    """Assert that one cause is named, its numbers in their intervals, and noise is left."""
    assert found.verdict == "cause_found"
    assert [cause.name for cause in found.causes] == [effect]
    for name, value in values.items():
        low, high = found.causes[0].parameters[name].ci95
        slack = 0.05 * abs(value)
        assert low - slack <= value <= high + slack, name
    assert found.headline.rmse_after < 1.3 * found.headline.noise_floor


def test_nothing_planted_in_the_wrist() -> None:
    """Small errors of calibration are found, and no cause is named."""
    found = diagnose_dataset(wrist_data({}), simulation=False)
    assert found.verdict == "no_discrepancy"
    assert found.causes == ()
    assert found.calibrated["elastic_constant"].value == pytest.approx(1.01, abs=0.01)
    assert found.headline.noise_floor == pytest.approx(NOISE_MM, rel=0.2)


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        pytest.param("stiffness", {"scale": 0.8}, marks=pytest.mark.long),
        ("tendon_friction", {"mu": 0.35}),
        pytest.param("nonlinear_stiffness", {"cubic_mm2": 3.0}, marks=pytest.mark.long),
    ],
)
def test_cause_in_the_wrist_is_found(effect: str, values: Mapping[str, float]) -> None:
    """A planted cause is named alone, its numbers in or next to their intervals."""
    assert_found(diagnose_dataset(wrist_data({effect: values}), simulation=False), effect, values)


@pytest.mark.long
def test_offset_of_the_wrists_drive_is_found() -> None:
    """A drive that stands off its zero by a tenth of a millimetre."""
    values = {"offset_mm": 0.1}
    data = wrist_data({"actuation_offset": values}, "displacement")
    assert_found(diagnose_dataset(data, simulation=False), "actuation_offset", values)
