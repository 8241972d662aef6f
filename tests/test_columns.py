"""States to output columns: units, the tip's quaternion, and rows that are missing."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catheter_sim.catalogue import ROBOTS, load_robot
from catheter_sim.channels import (
    StateRows,
    body_count,
    joint_names,
    output_channels,
    output_table,
    shown_by,
    write_columns,
)
from catheter_sim.core.posture import Posture
from catheter_sim.robots.continuum.spec import ContinuumRobot


def posture(robot: ContinuumRobot, seed: int = 0) -> Posture:
    """Return a posture with a different number everywhere."""
    draw = np.random.default_rng(seed)
    n, t = body_count(robot), len(robot.tendons)
    return Posture(
        p_w=draw.normal(size=(n, 3)),
        R_w=Rotation.random(n, random_state=draw).as_matrix(),
        joint_angles=draw.normal(size=len(joint_names(robot))),
        actuator_tension=draw.uniform(size=t),
        tendon_tension=draw.uniform(size=(t, n)),
    )


@pytest.mark.parametrize("reference", ROBOTS)
def test_columns_are_the_posture_in_file_units(reference: str) -> None:
    """Every promised column is there, in mm and deg, and the tip is the last body."""
    robot = load_robot(reference)
    postures = [posture(robot, seed) for seed in range(3)]
    columns = output_table(robot, np.arange(3.0), postures).columns
    assert list(columns) == output_channels(robot)
    n = body_count(robot)
    for row, now in enumerate(postures):
        for axis, letter in enumerate("xyz"):
            assert columns[f"tip_{letter}_mm"][row] == columns[f"body_{n}_{letter}_mm"][row]
            assert columns[f"body_1_{letter}_mm"][row] == pytest.approx(now.p_w[0, axis] * 1e3)
        quaternion = [columns[f"tip_q{letter}"][row] for letter in "wxyz"]
        again = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
        np.testing.assert_allclose(again, now.R_w[-1], atol=1e-12)
        assert quaternion[0] >= 0
        for index, name in enumerate(joint_names(robot)):
            assert columns[f"joint_{name}_deg"][row] == pytest.approx(np.degrees(now.joint_angles[index]))
        for index, tendon in enumerate(robot.tendons):
            if tendon.name != "advance":  # a tube that is pushed
                assert columns[f"tension_{tendon.name}_N"][row] == now.actuator_tension[index]


def test_quaternion_of_a_known_turn() -> None:
    """A tip turned by 90 deg toward +x (about +y) has the quaternion (0.7071, 0, 0.7071, 0)."""
    robot = load_robot("neuroendoscope_section")
    turned = dataclasses.replace(
        posture(robot), R_w=np.tile(Rotation.from_euler("y", 90, degrees=True).as_matrix(), (30, 1, 1))
    )
    columns = output_table(robot, np.zeros(1), [turned]).columns
    half = np.sqrt(0.5)
    np.testing.assert_allclose([columns[f"tip_q{c}"][0] for c in "wxyz"], [half, 0, half, 0], atol=1e-12)


def test_a_run_that_stopped_early_gives_the_rows_it_has() -> None:
    """Fewer postures than times give a shorter table, none give an empty one with its header."""
    robot = load_robot("neuroendoscope_section")
    short = output_table(robot, np.arange(9.0), [posture(robot)], ["tip_z_mm"])
    np.testing.assert_array_equal(short.time_s, [0.0])
    assert list(short.columns) == ["tip_z_mm"]
    empty = output_table(robot, np.arange(9.0), [])
    assert empty.time_s.shape == (0,)
    assert list(empty.columns) == output_channels(robot)
    assert all(values.shape == (0,) for values in empty.columns.values())


def test_only_what_is_shown_is_asked_for() -> None:
    """Columns in any order and of any shape of rows; no joint's angle is worked out where none is shown."""
    robot = load_robot("neuroendoscope_section")
    shown = shown_by(robot, ("tension_left_N", "body_3_z_mm", "tip_x_mm", "body_3_x_mm"))
    assert shown.elements == (2, 29)
    assert shown.tip is None
    p_w = np.arange(12.0).reshape(1, 2, 2, 3)

    def never() -> np.ndarray:
        raise AssertionError

    values = write_columns(shown, StateRows(p_w, None, never, np.array([[[1.0, 2.0], [3.0, 4.0]]])))
    assert values.tolist() == [[[2.0, 2000.0, 3000.0, 0.0], [4.0, 8000.0, 9000.0, 6000.0]]]


def test_an_orientation_that_is_missing_has_no_quaternion() -> None:
    """Alone: the other rows have theirs."""
    robot = load_robot("neuroendoscope_section")
    shown = shown_by(robot, ("tip_qw",))
    R_w = np.array([np.eye(3), np.full((3, 3), np.nan), np.eye(3)])
    rows = StateRows(np.zeros((3, 1, 3)), R_w, lambda: np.zeros((3, 0)), np.zeros((3, 2)))
    values = write_columns(shown, rows)
    assert values[[0, 2], 0].tolist() == [1.0, 1.0]
    assert np.isnan(values[1, 0])


def test_a_column_that_nothing_fills_is_refused() -> None:
    """An orientation that was not worked out, and a name that no part of the robot has."""
    robot = load_robot("neuroendoscope_section")
    for columns, missing in (
        (("tip_x_mm", "tip_qx"), "tip_qx"),
        (("tip_x_mm", "tip_roll_deg"), "tip_roll_deg"),
    ):
        shown = shown_by(robot, columns)
        with pytest.raises(ValueError, match=f"nothing fills the columns {missing}$"):
            write_columns(
                shown, StateRows(np.zeros((3, 1, 3)), None, lambda: np.zeros((3, 30)), np.zeros((3, 2)))
            )
