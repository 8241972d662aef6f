"""Inverse kinematics: round trips through what shares nothing with the search, and limits that are named."""

from __future__ import annotations

import math

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.planning.bounded import BoundedFit
from catheter_sim.planning.inverse import Forward, InSimulation, targets_of
from catheter_sim.planning.models import plan_drives
from catheter_sim.resources import assets_folder
from catheter_sim.robots.catheter.kinematics import tool_frame
from catheter_sim.robots.catheter.published import mitral_transseptal
from catheter_sim.tables import Table


def one_row(**values: float) -> dict[str, list[float]]:
    """Return one row of columns."""
    return {name: [value] for name, value in values.items()}


def test_a_pose_of_the_closed_form_is_reached() -> None:
    """Nayar 2022's product of exponentials says where joints lead; inputs for that pose give these joints."""
    joints = np.array([0.3, 0.8, 0.02, 0.0])  # torsion, bending, advance, torsion
    frame = tool_frame(mitral_transseptal(), joints)
    tip = dict(zip(("tip_x_mm", "tip_y_mm", "tip_z_mm"), 1e3 * frame[:3, 3], strict=True))
    found = cs.inverse_kinematics("mitral_transseptal", one_row(**tip), corrections=None)
    assert found.reachable.all()
    again = cs.statics("mitral_transseptal", found.inputs, model="pk").to_table(list(tip)).columns
    for name, value in tip.items():
        assert again[name][0] == pytest.approx(value, abs=0.02)


def test_a_direction_and_an_angle_are_targets() -> None:
    """The tip's axis alone fixes proximal torsion and bending; an angle is met as it is asked."""
    bend, turn = 0.7, 0.4
    axis = np.array([math.sin(bend) * math.cos(turn), math.sin(bend) * math.sin(turn), math.cos(bend)])
    asked = {f"tip_direction_{letter}": [5.0 * value] for letter, value in zip("xyz", axis, strict=True)}
    found = cs.inverse_kinematics("mitral_transseptal", asked, corrections=None)
    assert found.reachable.all()
    posture = cs.statics("mitral_transseptal", found.inputs, model="pk").postures[0]
    np.testing.assert_allclose(posture.R_w[-1][:, 2], axis, atol=1e-3)
    found = cs.inverse_kinematics("mitral_transseptal", one_row(angle_bending_deg=-50.0), corrections=None)
    assert found.error_deg[0] < 0.01


def test_the_limit_that_binds_is_named() -> None:
    """Straight ahead and too far, the tube is all out; sideways of a planar robot's plane, nothing helps."""
    found = cs.inverse_kinematics(
        "mitral_4dof", one_row(tip_x_mm=0.0, tip_y_mm=0.0, tip_z_mm=140.0), corrections=None
    )
    assert not found.reachable[0]
    assert found.limits == ("advance_mm<=60",)
    straight = 1e3 * plan_drives(cs.load_robot("mitral_4dof")).length_m
    assert found.error_mm[0] == pytest.approx(140.0 - straight, abs=0.05)
    aside = one_row(tip_x_mm=0.0, tip_y_mm=20.0, tip_z_mm=225.0)
    found = cs.inverse_kinematics("chest_tube_section", aside, corrections=None)
    assert not found.reachable[0]
    assert found.limits[0] != ""
    assert found.error_mm[0] == pytest.approx(20.0, abs=0.1)


def test_a_users_limit_is_kept() -> None:
    """With half of the stroke, what lies beyond is out of reach, and the user's limit is the one named."""
    asked = one_row(tip_x_mm=0.0, tip_y_mm=0.0, tip_z_mm=100.0)
    found = cs.inverse_kinematics("mitral_4dof", asked, limits={"advance_mm": (0.0, 30.0)}, corrections=None)
    assert found.limits == ("advance_mm<=30",)
    assert cs.inverse_kinematics("mitral_4dof", asked, corrections=None).reachable.all()


def test_whether_the_way_counts_is_found_out() -> None:
    """Robots that rub remember; a nominal catheter, and a robot whose friction is off, do not."""
    for name, settings, remembers in (
        ("neuroendoscope_section", {}, True),
        ("chest_tube_section", {}, True),
        ("neuroendoscope_section", {"friction.mu": 0.0}, False),
        ("mitral_transseptal", {}, False),
        ("mitral_transseptal", {"effects.backlash.width_mm": 0.4}, True),
    ):
        robot = cs.load_robot(name, settings)
        drives = plan_drives(robot)
        targets = targets_of(robot, Table(np.zeros(1), {"tip_x_mm": np.zeros(1)}), drives.length_m)
        assert Forward(robot, drives, targets, np.zeros(3)).remembers is remembers, (name, settings)


@pytest.mark.slow
def test_hysteresis_is_compensated() -> None:
    """The same bend on the way up and on the way back takes other tensions, and the simulation meets both."""
    pull = {"time_s": [0.0, 1.0, 2.0], "tension_active_N": [15.0, 40.0, 12.0]}
    tips = cs.simulate("chest_tube_section", pull).to_table(["tip_x_mm", "tip_z_mm"]).columns
    back = {name: [values[2], values[1], values[2]] for name, values in tips.items()}
    found = cs.inverse_kinematics("chest_tube_section", back)
    tension = found.to_table().columns["tension_active_N"]
    assert tension[0] > tension[2] + 3.0
    seen = cs.simulate("chest_tube_section", found.inputs).to_table(["tip_z_mm"]).columns["tip_z_mm"]
    assert seen[2] == pytest.approx(tips["tip_z_mm"][2], abs=0.225)


@pytest.mark.slow
def test_corrections_take_away_what_the_twin_leaves_out() -> None:
    """Where the arcs of the twin miss the simulated chain, corrections bring the tip to its target."""
    pull = {"time_s": [0.0], "tension_1_N": [9.0], "tension_3_N": [14.0], "tension_4_N": [3.0]}
    tip = cs.simulate("spacer_disk", pull).to_table(["tip_x_mm", "tip_y_mm", "tip_z_mm"]).columns
    target = {name: [float(values[0])] for name, values in tip.items()}
    alone = cs.inverse_kinematics("spacer_disk", target, corrections=0)
    corrected = cs.inverse_kinematics("spacer_disk", target, tolerance_mm=0.01)
    assert corrected.error_mm[0] <= 0.01
    assert corrected.error_mm[0] < alone.error_mm[0]


@pytest.mark.slow
def test_what_a_twin_cannot_reach_is_searched_for_in_the_simulation() -> None:
    """The twin lets tendons stick by the history of their tensions, where both fall and the robot slides."""
    way = {
        "time_s": [0.0, 1.0],
        "tension_right_N": [0.0537, 0.0],
        "tension_left_N": [0.3184, 0.2604],
    }
    names = ["tip_x_mm", "tip_y_mm", "tip_z_mm"]
    asked = cs.simulate("neuroendoscope_section", way).to_table(names).columns
    uncorrected = cs.inverse_kinematics("neuroendoscope_section", asked, corrections=0)
    assert uncorrected.reachable.tolist() == [True, False]
    assert uncorrected.error_mm[1] > 0.5
    found = cs.inverse_kinematics("neuroendoscope_section", asked)
    assert found.reachable.all()
    again = cs.simulate("neuroendoscope_section", found.inputs).to_table(names).columns
    missed = np.linalg.norm([again[name] - asked[name] for name in names], axis=0)
    assert missed.max() < 0.06  # 0.1 % of the length


@pytest.mark.slow
def test_the_row_before_is_reached_another_way_where_the_next_is_out_of_reach_from_there() -> None:
    """A chest tube bent by a full front rod: from most ways of reaching the second tip it rubs too much."""
    tips = np.array([[273.02, 0.0, 55.74], [228.84, -3.01, 197.06], [209.89, 63.18, 221.76]])
    asked = {f"tip_{axis}_mm": tips[:, k] for k, axis in enumerate("xyz")}
    found = cs.inverse_kinematics("chest_tube", asked, corrections=None)
    assert found.reachable.all(), found.report()


def test_other_ways_of_the_twin_are_tried_in_the_simulation() -> None:
    """Where a search in the simulation leads nowhere it begins anew, where the simulation misses by least."""
    near, far, lost = (np.array([value]) for value in (0.3, 0.8, 0.5))
    tried: list[float] = []

    class Rows:
        spare = True

        def others(self, found: object, row: int) -> list[BoundedFit]:
            return [BoundedFit(point, point, np.zeros((1, 1))) for point in (far, lost, near)]

    class Simulated(InSimulation):
        def _misses(self, found: object, row: int, levels: np.ndarray) -> np.ndarray:
            return np.where(levels == lost, np.nan, levels)

        def _search(self, found: object, row: int, start: np.ndarray) -> BoundedFit | None:
            tried.append(float(start[0]))
            return BoundedFit(start, start, np.zeros((1, 1))) if start == far else None

    simulation = Simulated(Rows(), cs.load_robot("chest_tube"), np.zeros(3))  # type: ignore[arg-type]
    ways = [BoundedFit(np.array([1.0]), np.array([1.0]), np.zeros((1, 1)))]
    other = simulation.row(ways, 0)
    assert other is not None
    assert other.point == far
    assert tried == [1.0, 0.3, 0.8]


@pytest.mark.slow
def test_a_path_out_of_reach_is_not_searched_row_by_row(monkeypatch: pytest.MonkeyPatch) -> None:
    """After three rows for which the simulation has nothing better the others are left as they are."""
    asked_rows: list[int] = []

    def nothing_found(self: object, found: object, row: int) -> None:
        asked_rows.append(row)

    monkeypatch.setattr(InSimulation, "row", nothing_found)
    beside = {
        "tip_x_mm": [5.0, 8.0, 11.0, 14.0, 17.0],
        "tip_y_mm": [1.0] * 5,
        "tip_z_mm": [59.5, 59, 58, 57, 56],
    }
    found = cs.inverse_kinematics("neuroendoscope_section", beside, corrections=1)
    assert not found.reachable.any()
    assert asked_rows == [0, 1, 2]


@pytest.mark.slow
@pytest.mark.parametrize(
    "file", ["catheter_robot", "notched_tube_robot", "rolling_robot", "opencr_v4/opencr_v4"]
)
def test_a_robot_of_ones_own_of_every_kind(file: str) -> None:
    """A tip that random inputs reach is reached again, whatever the kind and whatever drives it."""
    robot = cs.load_robot(assets_folder() / "examples" / f"{file}.toml")
    tip = cs.workspace(robot, samples=4).tip_mm[3]
    asked = {f"tip_{axis}_mm": [float(value)] for axis, value in zip("xyz", tip, strict=True)}
    found = cs.inverse_kinematics(robot, asked, corrections=None)
    assert found.reachable.all(), found.report()
    assert cs.inputs(robot, {"time_s": [0.0], **found.to_table().columns}).tendon.shape[1] == len(
        robot.tendons
    )
