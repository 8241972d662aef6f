"""Displacement of a pair to its joint's angle and back, the antagonist's slack, and pure kinematics."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot, robots_of
from catheter_sim.channels import input_channels, posture_columns
from catheter_sim.core.inputs import Inputs
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter import kinematics
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.theory.static_models import STATIC_MODELS

ROBOTS = {name: make() for name, make in robots_of("catheter").items()}
JOINTS = {
    f"{name} {segment.name}": segment
    for name, robot in ROBOTS.items()
    for segment in robot.segments
    if segment.joint in ("bending", "torsion")
}


def drive(robot: CatheterRobot, *rows: tuple[float, ...]) -> Inputs:
    """Return rows of inputs in mm, in the order of the robot's channels."""
    zeros = np.zeros((len(rows), 3))
    return Inputs(np.arange(len(rows), dtype=float), "displacement", np.array(rows) * 1e-3, zeros, zeros)


def solve(robot: CatheterRobot, *rows: tuple[float, ...]) -> dict[str, np.ndarray]:
    """Return every output column of pure kinematics."""
    run = STATIC_MODELS["pk"].solve(robot, drive(robot, *rows), np.zeros(3))
    assert run.residual.max() < 1e-15
    return posture_columns(robot, run.postures)


def gap_lengths_m(segment: CatheterSegment, bend: float) -> tuple[float, float]:
    """Return the tendons' lengths in one gap, pulled and released, from points on hinged rings [m]."""
    turn = bend / (segment.rings + 1)
    t, a = segment.half_gap_m, segment.arm_m
    rotation = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    lengths = []
    for side in (1.0, -1.0):
        below, above = np.array([side * a, -t]), rotation @ np.array([side * a, t])
        lengths.append(float(np.linalg.norm(above - below)))
    return lengths[0], lengths[1]


@pytest.mark.parametrize("name", [name for name in JOINTS if "bending" in name])
def test_bending_lengths_are_those_of_hinged_rings(name: str) -> None:
    """Nayar 2022, Eqs 3-4: pull and release are the straight tendon's changes between turned rings."""
    segment = JOINTS[name]
    for bend in np.linspace(0.0, kinematics.largest_angle_rad(segment), 9):
        pulled, released = gap_lengths_m(segment, bend)
        gaps = segment.rings + 1
        rest = 2.0 * segment.half_gap_m
        assert kinematics.pulled_m(segment, bend) == pytest.approx(gaps * (rest - pulled), abs=1e-15)
        assert kinematics.released_m(segment, bend) == pytest.approx(gaps * (released - rest), abs=1e-15)


@pytest.mark.parametrize("name", JOINTS)
def test_angle_of_displacement_of_angle_is_the_angle(name: str) -> None:
    """Over the whole range, both ways, to 1e-12 rad; beyond the range there is no angle."""
    segment = JOINTS[name]
    largest = kinematics.largest_angle_rad(segment)
    angles = np.linspace(-largest, largest, 401)
    back = kinematics.angle_rad(segment, kinematics.pulled_m(segment, angles))
    # the last tenth of a torsion joint's range is a square root's end
    inner = np.abs(angles) < (0.999 * largest)
    np.testing.assert_allclose(back[inner], angles[inner], atol=1e-12)
    np.testing.assert_allclose(back, angles, atol=1e-7)
    most = float(kinematics.pulled_m(segment, largest))
    assert np.isnan(kinematics.angle_rad(segment, [1.0001 * most, -1.0001 * most])).all()
    assert kinematics.angle_rad(segment, 0.0) == 0.0


def test_bending_inverse_is_equation_5() -> None:
    """Nayar 2022, Eq. 5 with its exponents: C = t^2 + a^2, B = t - l / (2 (n + 1)), D = 2 B t,
    E = B^2 - a^2, cos = (D + sqrt(D^2 - 4 C E)) / (2 C)."""
    segment = ROBOTS["mitral_transseptal"].segments[1]
    t, a, n = segment.half_gap_m, segment.arm_m, segment.rings
    for displacement in np.linspace(0.2e-3, 6e-3, 20):
        B = t - displacement / (2 * (n + 1))
        C, D, E = t**2 + a**2, 2.0 * B * t, B**2 - a**2
        printed = 2 * (n + 1) * math.acos((D + math.sqrt(D * D - 4.0 * C * E)) / (2.0 * C))
        assert kinematics.angle_rad(segment, displacement) == pytest.approx(printed, abs=1e-10)


def test_torsion_inverse_is_equation_7() -> None:
    """Nayar 2022, Eq. 7 with its exponents, by its own formula; on a drum l = r theta (2023, Eq. 13)."""
    segment = ROBOTS["mitral_transseptal"].segments[0]
    r, a, h = segment.tendon_radius_m, segment.wrap_rad, segment.wrap_height_m
    for displacement in np.linspace(0.0, 3.5e-3, 20):
        printed = a - math.sqrt((math.hypot(r * a, h) - displacement) ** 2 - h * h) / r
        assert kinematics.angle_rad(segment, displacement) == pytest.approx(printed, abs=1e-12)
    drum = ROBOTS["mitral_4dof"].segments[-1]
    assert kinematics.pulled_m(drum, 0.7) == pytest.approx(2.1e-3 * 0.7)
    assert kinematics.released_m(drum, 0.7) == pytest.approx(2.1e-3 * 0.7)


@pytest.mark.parametrize("name", JOINTS)
def test_arm_is_the_slope(name: str) -> None:
    """The moment arm is the derivative of the pulled length; at rest a bending joint's is a_b."""
    segment = JOINTS[name]
    angles = np.linspace(0.0, 0.95 * kinematics.largest_angle_rad(segment), 20)
    step = 1e-6
    slope = (kinematics.pulled_m(segment, angles + step) - kinematics.pulled_m(segment, angles - step)) / (
        2 * step
    )
    np.testing.assert_allclose(kinematics.arm_m(segment, angles), slope, atol=1e-11)
    if segment.joint == "bending":
        assert kinematics.arm_m(segment, 0.0) == segment.arm_m


def test_arm_changes_little_within_the_limits() -> None:
    """Within 120 deg the pulled tendon's arm is at most 2.5 % above a_b (2022 robot)."""
    segment = ROBOTS["mitral_transseptal"].segments[1]
    ratio = kinematics.arm_m(segment, segment.limit_rad) / segment.arm_m
    assert 1.0 < ratio < 1.025


@pytest.mark.parametrize("name", JOINTS)
def test_the_antagonist(name: str) -> None:
    """A bending joint leaves slack, 4 (n + 1) t (1 - cos phi); a wrapped one must stretch its tendon."""
    segment = JOINTS[name]
    slack = kinematics.slack_m(segment, segment.limit_rad)
    if segment.joint == "bending":
        phi = segment.limit_rad / (2 * (segment.rings + 1))
        assert slack == pytest.approx(4 * (segment.rings + 1) * segment.half_gap_m * (1.0 - math.cos(phi)))
        assert slack > 0.0
    elif segment.wrap_height_m > 0.0:
        assert slack < -0.2e-3
    else:
        assert slack == pytest.approx(0.0, abs=1e-18)
    assert kinematics.slack_m(segment, 0.0) == pytest.approx(0.0, abs=1e-18)


def test_the_antagonists_spring_takes_up_what_the_pulley_lets_go() -> None:
    """Of the four-joint catheter at 90 deg: 0.21 mm of the proximal joint, 0.12 mm of the distal one."""
    for name, wanted_mm in (("bending_proximal", 0.21), ("bending_distal", 0.12)):
        (segment,) = (item for item in ROBOTS["mitral_4dof"].segments if item.name == name)
        slack = kinematics.slack_m(segment, math.radians(90.0))
        assert 1e3 * slack == pytest.approx(wanted_mm, abs=0.006)


def test_rims_meet_at_the_printed_bend() -> None:
    """The 2022 robot's gaps close at 264 deg (Section II-A), and displacement ends there."""
    segment = ROBOTS["mitral_transseptal"].segments[1]
    assert math.degrees(kinematics.largest_angle_rad(segment)) == pytest.approx(264.0)


def test_nominal_table() -> None:
    """The reference table of the nominal specification, to 0.001 mm and deg."""
    robot = ROBOTS["mitral_transseptal"]
    assert input_channels(robot)[0] == "displacement_bending_mm"
    rows = [(0, 0, 0, 0), (1, 1, -1, 20), (3, 0, 2, 0), (-2, 1.5, 0, 50)]
    columns = solve(robot, *rows)
    expected = {
        "angle_bending_deg": [0.0, 31.719, 94.558, -63.230],
        "angle_torsion_proximal_deg": [0.0, 22.157, 0.0, 33.612],
        "angle_torsion_distal_deg": [0.0, -21.432, 43.583, 0.0],
        "tip_x_mm": [0.0, 22.807, 31.293, -58.190],
        "tip_y_mm": [0.0, 9.288, 0.0, -38.679],
        "tip_z_mm": [57.340, 71.183, 33.398, 68.009],
    }
    for name, values in expected.items():
        np.testing.assert_allclose(columns[name], values, atol=5.1e-4)
    np.testing.assert_allclose(
        columns["tension_bending_N"], 5.6 / 1.8 * np.abs(np.radians(columns["angle_bending_deg"]))
    )
    assert not columns["tension_torsion_distal_N"].any()


def test_hinges_share_the_bend() -> None:
    """A bending joint's hinges bend alike and sum to its angle; a torsion joint is its own hinge."""
    columns = solve(ROBOTS["mitral_transseptal"], (3, 1, 2, 0))
    gaps = [columns[f"joint_bending_{gap}_deg"][0] for gap in range(1, 12)]
    np.testing.assert_allclose(gaps, columns["angle_bending_deg"][0] / 11.0)
    assert columns["joint_torsion_distal_deg"] == columns["angle_torsion_distal_deg"]


def test_four_dof_robot_bends_in_two_planes() -> None:
    """Each bending channel of the 4-DoF robot moves its own joint, the advance the tip along the tool."""
    robot = ROBOTS["mitral_4dof"]
    columns = solve(robot, (0, 0, 0, 0), (2, 0, 0, 0), (0, 2, 0, 0), (0, 0, 1, 30))
    assert columns["tip_x_mm"][1] > 5.0
    assert columns["tip_y_mm"][2] > 5.0
    np.testing.assert_allclose(columns["tip_z_mm"][[0, 3]], [48.18, 78.18])
    assert columns["angle_torsion_deg"][3] == pytest.approx(math.degrees(1.0 / 2.1))
    assert columns["angle_bending_distal_deg"][1] == 0.0


def test_elastic_tendons_take_their_share() -> None:
    """With tendons of 10 N/mm the displacement is Eq. 3 of the angle plus the tension over 10 N/mm."""
    plain = load_robot("mitral_transseptal")
    soft = load_robot("mitral_transseptal", ["tendons.bending.stiffness_N_per_mm=10"])
    for displacement in (0.3, 3.0, -5.0):
        columns = solve(soft, (displacement, 0, 0, 0))
        angle = np.radians(columns["angle_bending_deg"])
        stretched = np.sign(displacement) * columns["tension_bending_N"] / 10.0
        taken = 1e3 * kinematics.pulled_m(soft.segments[1], angle) + stretched
        assert taken == pytest.approx(displacement, abs=1e-12)
        assert abs(angle[0]) < abs(np.radians(solve(plain, (displacement, 0, 0, 0))["angle_bending_deg"][0]))


@pytest.mark.parametrize(
    ("row", "message"),
    [
        (
            (9, 0, 0, 0),
            r"row 2 \(time_s = 1\): static model 'pk': displacement_bending_mm = 9: .* ends at 264 deg",
        ),
        (
            (0, -4, 0, 0),
            "torsion_proximal_mm = -4: beyond the range of its joint, which ends at 120 deg",
        ),
    ],
)
def test_displacements_beyond_the_range_are_refused(row: tuple[float, ...], message: str) -> None:
    """One line names the row, the column, the value and the range."""
    with pytest.raises(InputError, match=message) as caught:
        solve(ROBOTS["mitral_transseptal"], (0, 0, 0, 0), row)
    assert "\n" not in str(caught.value)


def test_loads_are_refused() -> None:
    """A tip force is refused; gravity only where the robot has a mass for it to act on."""
    robot = ROBOTS["mitral_transseptal"]
    pk = STATIC_MODELS["pk"].solve
    inputs = drive(robot, (0, 0, 0, 0))
    with pytest.raises(InputError, match="has no tip force"):
        pk(robot, replace(inputs, force_tip=np.array([[0.1, 0.0, 0.0]])), np.zeros(3))
    down = np.array([0.0, 0.0, -9.81])
    assert len(pk(robot, inputs, down).postures) == 1
    heavy = load_robot("mitral_transseptal", ["segments.bending.mass_g=1"])
    with pytest.raises(InputError, match="has no weight"):
        pk(heavy, inputs, down)
