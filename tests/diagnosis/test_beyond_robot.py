"""Claims about commands and motions that no such robot can have: each is said, and no cause is looked for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from planted import small_robot

import catheter_sim as cs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.faults_of_columns import Beyond, beyond_robot
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.prepare import BEYOND, prepare
from catheter_sim.diagnosis.trials import Dataset

ROBOT = small_robot()
(SEGMENT,) = ROBOT.segments
RADIUS_MM, LENGTH_MM = 1e3 * ROBOT.tendons[0].radius_m, 1e3 * SEGMENT.length_m
TIME_S = 0.5 * np.arange(80.0)
WAVE = np.sin(0.4 * TIME_S)


def data(
    pull_mm: float, moves_mm: float, robot: RobotSpec | str = ROBOT, column: str = "displacement_t0_mm"
) -> Dataset:
    """Return one trial in which a tendon is pulled, and the tip moves, by so much to either side."""
    measured = {"tip_x_mm": moves_mm * WAVE, "tip_y_mm": 0.3 * WAVE**2, "tip_z_mm": 50.0 - 4.0 * WAVE**2}
    table: Mapping[str, np.ndarray] = {"time_s": TIME_S, column: pull_mm * WAVE, **measured}
    return cs.dataset(robot, table)


def beyond(found: Dataset) -> tuple[Beyond, ...]:
    return beyond_robot(found.robot, found.trials)


def test_a_pull_is_held_against_what_bends_a_segment_by_90_deg() -> None:
    """An arc of 90 deg at a radius r asks a tendon for r pi / 2, however long the robot is."""
    full_mm = RADIUS_MM * math.pi / 2.0
    # a tendon may have to bend both ways at once, to its side and across
    assert beyond(data(1.9 * full_mm, 0.3 * LENGTH_MM)) == ()
    (far,) = beyond(data(50.0 * full_mm, 0.3 * LENGTH_MM))
    assert far.column == "displacement_t0_mm"
    assert 50.0 / 1.5 < far.times < 50.1
    assert far.impossible
    (near,) = beyond(data(7.0 * full_mm, 0.3 * LENGTH_MM))
    assert not near.impossible
    assert "um read as mm" in far.words()
    spool = far.words("deg", 25.0)
    assert "an encoder's counts read as an angle" in spool
    assert f"a spool of {25.0 / far.times:.2g} mm for one of 25" in spool


def test_a_motion_is_held_against_the_robots_length() -> None:
    """A tip that turns all round moves by two lengths; ten are another unit's."""
    assert beyond(data(1.0, 0.99 * LENGTH_MM)) == ()
    (far,) = beyond(data(1.0, 5.0 * LENGTH_MM))
    assert (far.column, far.impossible) == ("tip_x_mm", True)
    assert far.times == pytest.approx(10.0, rel=0.05)
    assert far.words().endswith("its unit or scale is wrong; perhaps mm read as cm, or mm read as in")
    (near,) = beyond(data(1.0, 1.5 * LENGTH_MM))
    assert not near.impossible


def test_a_few_wrong_rows_are_another_fault() -> None:
    """One glitch of a tracker is no unit."""
    sound = data(1.0, 10.0)
    (trial,) = sound.trials
    columns = dict(trial.outputs.columns)
    columns["tip_x_mm"] = columns["tip_x_mm"].copy()
    columns["tip_x_mm"][7] = 1e6
    glitch = replace(sound, trials=(replace(trial, outputs=replace(trial.outputs, columns=columns)),))
    assert beyond(glitch) == ()


@pytest.mark.slow
def test_much_too_large_commands_are_a_note() -> None:
    """Five times what bends the robot is strange, and no reason to stop."""
    found = prepare(data(6.0 * RADIUS_MM * math.pi / 2.0, 0.3 * LENGTH_MM))
    assert found.faults == ()
    assert [item.code for item in found.notes].count(BEYOND) == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "column"),
    [(ROBOT, "displacement_t0_mm"), ("mitral_transseptal", "displacement_bending_mm")],
)
def test_impossible_data_are_suspect_whatever_a_model_makes_of_them(
    robot: RobotSpec | str, column: str
) -> None:
    """Pulls of 400 mm: there is no posture at all for a catheter's joint."""
    found = diagnose_dataset(data(400.0, 10.0, robot, column), simulation=False)
    assert found.verdict == "data_suspect"
    assert found.causes == ()
    assert found.data_faults[0].what.startswith(f"{column} reaches 39")
