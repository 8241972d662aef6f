"""Claims about robots of rolling joints as data: layout, files, channels, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot, robot_toml, robots_of
from catheter_sim.channels import body_count, input_channels, joint_names, output_channels, read_inputs
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.robots.rolling.description import hole_position, last_joint, rods, rolling_joints
from catheter_sim.robots.rolling.spec import RollingRobot
from catheter_sim.tables import Table


def rolling(reference: str, *settings: str) -> RollingRobot:
    """Return a robot of rolling joints."""
    robot = load_robot(reference, settings)
    assert isinstance(robot, RollingRobot)
    return robot


def test_section_is_that_of_table_2() -> None:
    """15 links of 15 mm; odd joints roll on R1 toward +x and have A1 there, even joints the reverse."""
    robot = rolling("chest_tube_section")
    joints = rolling_joints(robot)
    assert [joint.name for joint in joints] == [f"x{k}" for k in range(1, 16)]
    assert [joint.face_z_m for joint in joints] == pytest.approx([0.015 * k for k in range(1, 16)])
    active, passive = rods(robot)
    for joint in joints:
        arm, other = (3.0, 1.0) if joint.index % 2 else (1.0, 3.0)
        radii = (6.7e-3, 2.275e-3) if joint.index % 2 else (2.275e-3, 6.7e-3)
        assert (joint.radius_positive_m, joint.radius_negative_m) == radii
        for rod, expected in ((active, arm), (passive, -other)):
            x, y = hole_position(rod, joint.segment)
            assert x - joint.line_m == pytest.approx(expected * 1e-3)
            assert y == 0.0
    assert joints[0].line_m == pytest.approx(-1e-3)


def test_sets_are_those_published() -> None:
    """`@table2` is the default; `@prototype` has the calibration: rods of 0.3 mm and 7.79 GPa, profile."""
    assert rolling("chest_tube_section") == rolling("chest_tube_section@table2")
    prototype = rolling("chest_tube_section@prototype")
    assert prototype.tendons[0].bending_stiffness_N_m2 == pytest.approx(7.79e9 * math.pi / 4 * 0.3e-3**4)
    segment = prototype.segments[0]
    profile = (segment.larger_radius_m, segment.smaller_radius_m, segment.larger_arm_m, segment.smaller_arm_m)
    assert profile == pytest.approx((6.37e-3, 3.80e-3, 3.98e-3, 1.33e-3))
    assert (prototype.friction.mu, prototype.clearance_m) == pytest.approx((0.0703, 0.6e-3))
    assert segment.link_modulus_Pa == 25e6
    assert prototype.name == "chest_tube_section"


def test_full_robot_meets_table_1_where_geometry_lets_it() -> None:
    """375 mm, 6.2 mm; base asymmetric, middle and tip symmetric; the tip bends toward +x and +y in turn."""
    robot = rolling("chest_tube")
    joints = rolling_joints(robot)
    assert joints[-1].face_z_m == pytest.approx(0.375)
    assert {segment.outer_radius_m for segment in robot.segments} == {3.1e-3}
    tip = [joint for joint in joints if joint.segment.name == "tip"]
    assert [joint.name[0] for joint in tip] == list("xyxyxyx")
    assert all(joint.line_m == 0.0 for joint in joints[15:])
    # No two holes touch, none leaves the link or reaches the lumen.
    hole_m = robot.tendons[0].rod_radius_m + robot.clearance_m
    for segment in robot.segments:
        passing = [rod for rod in rods(robot) if last_joint(robot, rod) >= 15]
        places = np.array([hole_position(rod, segment) for rod in passing])
        gaps = np.linalg.norm(places[:, None] - places[None, :], axis=2) + np.eye(len(places))
        assert gaps.min() > 2 * hole_m
        assert np.linalg.norm(places, axis=1).max() + hole_m < segment.outer_radius_m
        assert np.linalg.norm(places, axis=1).min() - hole_m > robot.channel_radius_m


def test_channel_names_are_those_promised() -> None:
    """The section has one input; the full robot a pair a segment, and one for the tip's other plane."""
    assert input_channels(load_robot("chest_tube_section")) == ["tension_active_N"]
    names = input_channels(load_robot("chest_tube"))
    assert names[:6] == [
        f"tension_{part}_{side}_N" for part in ("base", "middle", "tip") for side in ("right", "left")
    ]
    assert names[6:] == ["tension_tip_front_N", "tension_tip_back_N"]
    columns = output_channels(load_robot("chest_tube_section"))
    assert columns[-1] == "tension_active_N"
    assert "joint_x15_deg" in columns
    assert "body_15_x_mm" in columns
    assert "tension_passive_N" not in columns
    assert body_count(load_robot("chest_tube")) == len(joint_names(load_robot("chest_tube"))) == 25


def test_rods_are_driven_by_tension_only() -> None:
    """A displacement column is no channel of these robots; the choices say so."""
    robot = load_robot("chest_tube_section")
    assert input_channels(robot, "displacement") == []
    table = Table(np.zeros(1), {"displacement_active_mm": np.zeros(1)})
    with pytest.raises(
        InputError, match="unknown input channel 'displacement_active_mm'; choices: tension_ac"
    ):
        read_inputs(robot, table)


def test_kind_of_a_file_decides(tmp_path: Path) -> None:
    """`kind` tells the kinds apart; without it a file is a continuum robot's, and may say so."""
    path = tmp_path / "robot.toml"
    path.write_text(robot_toml(rolling("chest_tube")))
    assert 'kind = "rolling"' in path.read_text()
    assert isinstance(load_robot(path), RollingRobot)
    text = robot_toml(load_robot("spacer_disk"))
    assert "kind" not in text.split("[")[0]
    path.write_text('kind = "continuum"\n' + text)
    assert isinstance(load_robot(path), ContinuumRobot)
    path.write_text('kind = "origami"\n' + text)
    with pytest.raises(InputError, match=r"unknown kind 'origami'; choices: continuum, rolling"):
        load_robot(path)
    path.write_text("kind = 3\n" + text)
    with pytest.raises(InputError, match="unknown kind '3'"):
        load_robot(path)


def test_robot_without_passive_rods_survives_its_file(tmp_path: Path) -> None:
    """An empty list of passive rods is written and read; an empty list of segments is still refused."""
    path = tmp_path / "robot.toml"
    robot = replace(rolling("chest_tube_section"), passive_rods=())
    path.write_text(robot_toml(robot))
    again = load_robot(path)
    assert isinstance(again, RollingRobot)
    assert again.passive_rods == ()
    assert [rod.name for rod in again.tendons] == ["active"]
    path.write_text(robot_toml(replace(robot, tendons=())))
    with pytest.raises(InputError, match="tendons: a list with at least one entry is needed"):
        load_robot(path)


@pytest.mark.parametrize("reference", robots_of("rolling"))
def test_kind_cannot_be_set(reference: str) -> None:
    """--set reaches every key but the one that says what the robot is."""
    with pytest.raises(InputError):
        load_robot(reference, ["kind=continuum"])


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("segments.section.length_mm=0", "segments.section.length_mm = 0: must be above zero"),
        ("segments.section.joints=0", "segments.section.joints = 0: must be 1 or more"),
        ("segments.section.joints=1000", "joints = 1000 in all: more than 400"),
        ("segments.section.mass_g=-1", "segments.section.mass_g = -1: must be above zero"),
        ("segments.section.centre_of_mass_depth_mm=16", "depth_mm = 16: must lie in 0 to the links' length"),
        ("segments.section.larger_arm_mm=7", "larger_arm_mm = 7: must be below its arc's radius, 6.7 mm"),
        ("segments.section.smaller_radius_mm=0.9", "smaller_arm_mm = 1: must be below its arc's radius, 0.9"),
        ("segments.section.larger_arm_side=left", "unknown larger_arm_side 'left'; choices: alternate"),
        ("segments.section.bending_axes=y", "unknown bending_axes 'y'; choices: x, xy"),
        ("segments.section.link_modulus_Pa=0", "link_modulus_Pa = 0: must be above zero"),
        ("segments.section.rest_curvature_x_per_m=40", "rest_curvature_x_per_m = 40: would close the joint"),
        ("segments.section.rest_curvature_y_per_m=1", "rest_curvature_y_per_m = 1: must be 0 where bending"),
        ("segments.section.stiffness_cubic_mm2=inf", "stiffness_cubic_mm2 = inf: must be finite"),
        ("tendons.active.side=left", "tendons.active.side: unknown side 'left'; choices: +x, -x, +y, -y"),
        ("tendons.active.ends_at=tip", "tendons.active.ends_at: unknown segment 'tip'; choices: section"),
        ("tendons.active.rod_radius_mm=1.2", "rod_radius_mm = 1.2: leaves the links of segment"),
        ("tendons.active.rod_radius_mm=0", "rod_radius_mm = 0: must be above zero"),
        ("tendons.active.bending_stiffness_N_mm2=-1", "bending_stiffness_N_mm2 = -1: must not be negative"),
        ("tendons.active.countersink_mm=8", "countersink_mm = 8: must lie in 0 to half a link"),
        ("tendons.active.channel=a-b", "tendons.active.channel 'a-b': a name needs letters"),
        ("passive_rods.passive.channel=x", "passive_rods.passive.channel = 'x': nothing pulls it"),
        ("passive_rods.passive.name=active", "rod 'active' stands twice"),
        ("channel_radius_mm=1.8", "rod_radius_mm = 0.3: reaches into the free channel of segment section"),
        ("channel_radius_mm=4", "channel_radius_mm = 4: must lie in 0 to the smallest outer radius, 3.1 mm"),
        ("clearance_mm=-1", "clearance_mm = -1: must lie in 0 to the smallest outer radius"),
        ("friction.mu=-1", "friction.mu = -1: must lie in 0 to 10"),
        ("stiffness_scale=0", "stiffness_scale = 0: must be above zero"),
        ("sleeve.bending_stiffness_N_mm2=-1", "sleeve.bending_stiffness_N_mm2 = -1: must not be negative"),
        ("mount.axial_stiffness_N_per_mm=0", "mount.axial_stiffness_N_per_mm = 0: must be above zero"),
        ("dynamics.timestep_s=0", "dynamics.timestep_s = 0: must be above zero"),
        ("actuation=displacement", "unknown actuation 'displacement'; choices: tension"),
    ],
)  # fmt: skip
def test_impossible_number_is_named(setting: str, message: str) -> None:
    """The line names the robot, the key in the file's unit and the value as it was written."""
    with pytest.raises(InputError) as caught:
        load_robot("chest_tube_section", [setting])
    assert str(caught.value).startswith("chest_tube_section: ")
    assert message in str(caught.value)


def test_a_hole_off_its_arc_is_named() -> None:
    """A rod that crosses a joint beside its arc is refused, with the joint and the arc."""
    profile = ("larger_arm_mm=2.5", "smaller_arm_mm=0.5", "smaller_radius_mm=0.9")
    beside = ("passive_rods.passive.side=+y", "passive_rods.passive.lateral_mm=2")
    with pytest.raises(
        InputError, match=r"its hole lies 1 mm from the line of joint 2, off the arc of 0\.9 mm"
    ):
        load_robot("chest_tube_section", [*(f"segments.section.{text}" for text in profile), *beside])
