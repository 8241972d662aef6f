"""Arcs of constant curvature: published poses, closed forms, energy, friction, and the simulated chain."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import posture_columns
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction, Mount
from catheter_sim.mechanics.arcs import arc_end, arc_functions, points_on_arcs, segment_frames
from catheter_sim.robots.continuum.arcs import solve_rows
from catheter_sim.robots.continuum.constant_curvature import arc_robots, constant_curvature, postures
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.robots.continuum.twin import arcs_of
from catheter_sim.simulation.replay import simulate
from catheter_sim.theory.twins import twin_for

PUBLISHED = Path(__file__).resolve().parents[2] / "data" / "spacer_disk_cc_tip_poses.csv"
NO_GRAVITY = np.zeros(3)
LENGTH, EI, ARM = 0.1, 2e-3, 4e-3


def one_segment(angles_deg=(0.0,), mu=0.0, axes="xy", segments=1, **tendon) -> ContinuumRobot:
    """Return a robot of equal segments, tendons at the given angles ending at each segment's end."""
    names = [f"s{k}" for k in range(segments)]
    return ContinuumRobot(
        name="arc",
        description="",
        segments=tuple(Segment(name, LENGTH, 10, 5e-3, EI, 0.01, bending_axes=axes) for name in names),
        tendons=tuple(
            Tendon(f"{name}_{k}", ARM, math.radians(angle), name, **tendon)
            for name in names
            for k, angle in enumerate(angles_deg)
        ),
        friction=Friction(mu),
    )


def drive(rows, actuation="tension", force=None, moment=None) -> Inputs:
    """Return inputs a second apart; `force` and `moment` act on the tip in every row."""
    values = np.array(rows, dtype=float)
    count = len(values)
    return Inputs(
        np.arange(count, dtype=float),
        actuation,
        values,
        np.tile(force if force is not None else np.zeros(3), (count, 1)),
        np.tile(moment if moment is not None else np.zeros(3), (count, 1)),
    )


def bends(run) -> np.ndarray:
    """Return the tip's direction as a bend vector (toward +x, toward +y), shape (rows, 2) [rad]."""
    vectors = Rotation.from_matrix([posture.R_w[-1] for posture in run.postures]).as_rotvec()
    return np.stack([vectors[:, 1], -vectors[:, 0]], axis=1)


def test_published_poses_of_the_spacer_disk_robot():
    """Frictionless, tension-driven CC is Rao 2021's: 14 of 16 published poses to 1e-6 of the length.

    The other two mirror each other, and the published figures differ between them by 2.3e-4 of the
    length: each is met to that, and the better one to 1e-4 and 0.01 deg.
    """
    with PUBLISHED.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    pulls = [[float(row[f"T{k}_N"]) for k in (1, 2, 3, 4)] for row in rows]
    run = constant_curvature(load_robot("spacer_disk"), drive(pulls), NO_GRAVITY)
    assert len(rows) == 16
    for row, posture in zip(rows, run.postures, strict=True):
        p_w = np.array([float(row[f"p{axis}_m"]) for axis in "xyz"])
        R_w = np.array([float(row[f"R{i}{j}"]) for i in "123" for j in "123"]).reshape(3, 3)
        off = np.linalg.norm(posture.p_w[-1] - p_w) / 0.1
        turned = np.degrees(Rotation.from_matrix(posture.R_w[-1].T @ R_w).magnitude())
        limits = {"5": (3e-4, 0.04), "10": (1e-4, 0.01)}.get(row["config"], (1e-6, 1e-3))
        assert off < limits[0], row["config"]
        assert turned < limits[1], row["config"]


def test_arc_has_no_seam_at_straight():
    """Position and orientation of an arc are smooth through zero bend, where the series takes over."""
    sizes = np.array([0.0, 1e-9, 0.999e-3, 1.001e-3, 0.1])
    sine, versine = arc_functions(sizes**2)
    np.testing.assert_allclose(sine, np.sinc(sizes / np.pi), rtol=1e-14)
    np.testing.assert_allclose(versine[2:], (1.0 - np.cos(sizes[2:])) / sizes[2:] ** 2, rtol=1e-9)
    bend = np.stack([0.6 * sizes, 0.8 * sizes], axis=1)
    _, R_w = arc_end(bend, np.ones(len(sizes)))
    np.testing.assert_allclose(R_w @ np.swapaxes(R_w, 1, 2), np.tile(np.eye(3), (5, 1, 1)), atol=1e-15)
    np.testing.assert_allclose(
        R_w,
        Rotation.from_rotvec(np.stack([-bend[:, 1], bend[:, 0], 0 * sizes], axis=1)).as_matrix(),
        atol=1e-9,
    )


def test_displacement_against_a_stretching_tendon():
    """One tendon of stiffness k pulled by u carries T = u / (r^2 L / EI + 1 / k), whatever its angle."""
    stiffness, pull = 5e3, 3e-3
    for angle in (0.0, 77.0):
        robot = one_segment((angle,), stiffness_N_per_m=stiffness)
        run = constant_curvature(robot, drive([[pull]], "displacement"), NO_GRAVITY)
        tension = pull / (ARM**2 * LENGTH / EI + 1.0 / stiffness)
        assert run.postures[0].actuator_tension[0] == pytest.approx(tension, rel=1e-6)
        expected = (
            tension * ARM * LENGTH / EI * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        )
        np.testing.assert_allclose(bends(run)[0], expected, rtol=1e-6, atol=1e-9)


def test_tendons_cannot_push():
    """Tendons let out leave the robot straight and slack; of three, the one pulled bends it alone."""
    robot = one_segment((0.0, 120.0, 240.0), stiffness_N_per_m=5e3)
    run = constant_curvature(robot, drive([[-0.01] * 3, [2e-3, -0.01, -0.01]], "displacement"), NO_GRAVITY)
    np.testing.assert_allclose(run.postures[0].p_w[-1], [0.0, 0.0, LENGTH], atol=1e-12)
    assert not run.postures[0].actuator_tension.any()
    assert run.postures[1].actuator_tension[1:].max() == 0.0
    alone = constant_curvature(
        one_segment((0.0,), stiffness_N_per_m=5e3), drive([[2e-3]], "displacement"), NO_GRAVITY
    )
    np.testing.assert_allclose(run.postures[1].p_w[-1], alone.postures[0].p_w[-1], atol=1e-10)


def test_a_soft_mount_shares_the_pretension():
    """Three tendons of pretension p on a mount of stiffness K carry p / (1 + 3 k / K) and sink the tip."""
    stiffness, mount, pretension = 5e3, 4e4, 2.0
    robot = replace(
        one_segment((0.0, 120.0, 240.0), stiffness_N_per_m=stiffness, pretension_N=pretension),
        mount=Mount(mount),
    )
    posture = constant_curvature(robot, drive([[0.0] * 3], "displacement"), NO_GRAVITY).postures[0]
    tension = pretension / (1.0 + 3.0 * stiffness / mount)
    np.testing.assert_allclose(posture.actuator_tension, tension, rtol=1e-6)
    np.testing.assert_allclose(posture.p_w[-1], [0.0, 0.0, LENGTH - 3.0 * tension / mount], atol=1e-9)


def test_tendons_are_let_in_where_the_unloaded_robot_is():
    """A robot bent at rest stays so at zero displacement, in the twin and simulated; both go on alike."""
    straight = one_segment((0.0, 120.0, 240.0), stiffness_N_per_m=8e3)
    bent = replace(straight.segments[0], rest_curvature_x_per_m=4.0, rest_curvature_y_per_m=-3.0)
    robot = replace(straight, segments=(bent,))
    rows = drive([[0.0] * 3, [2e-3, 0.0, 0.0], [1e-3, 1.5e-3, -0.5e-3], [0.0, -1e-3, 2.5e-3]], "displacement")
    columns = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
    rest = arc_end(np.array([4.0, -3.0]) * LENGTH, np.array(LENGTH))[0]
    by_twin = twin_for(robot, "displacement", columns, NO_GRAVITY)([robot], rows, 1)[0]
    run = simulate(robot, rows, NO_GRAVITY)
    seen = posture_columns(robot, run.postures, columns)
    simulated = np.stack([seen[name] for name in columns], axis=1)
    np.testing.assert_allclose(by_twin[0], 1e3 * rest, atol=0.01)
    np.testing.assert_allclose(simulated[0], 1e3 * rest, atol=0.1)
    assert np.linalg.norm(np.diff(by_twin, axis=0), axis=1).min() > 5.0
    np.testing.assert_allclose(simulated, by_twin, atol=0.1)


def test_segments_under_a_load_are_several_arcs():
    """A force on the tip of a robot whose tendons are held: as the simulated chain, not as a single arc."""
    straight = one_segment((0.0, 120.0, 240.0), stiffness_N_per_m=8e3, pretension_N=1.0)
    robot = replace(straight, segments=(replace(straight.segments[0], disks=12),))
    rows = drive([[0.0] * 3, [1e-3, 0.0, -1e-3]], "displacement")
    pushed = replace(rows, force_tip=np.tile([0.1, 0.2, 0.0], (2, 1)))
    columns = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
    twin = twin_for(robot, "displacement", columns, NO_GRAVITY)
    free, loaded = twin([robot], rows, 1)[0], twin([robot], pushed, 1)[0]
    seen = posture_columns(robot, simulate(robot, pushed, NO_GRAVITY).postures, columns)
    simulated = np.stack([seen[name] for name in columns], axis=1)
    single = constant_curvature(robot, pushed, NO_GRAVITY).postures
    by_one_arc = np.array([1e3 * posture.p_w[-1] for posture in single])
    effect = np.linalg.norm(simulated - free, axis=1)
    assert arcs_of(robot) == 4
    assert effect.min() > 2.0
    assert (np.linalg.norm(loaded - simulated, axis=1) < 0.06 * effect).all()
    assert (np.linalg.norm(by_one_arc - simulated, axis=1) > 0.3 * effect).all()


def test_equilibrium_is_a_minimum_of_energy():
    """No small change of bends or base lowers the energy of backbone, tendons and mount."""
    robot = replace(
        one_segment((10.0, 130.0, 250.0), segments=2, stiffness_N_per_m=6e3, pretension_N=0.5),
        mount=Mount(5e4),
    )
    segment = replace(robot.segments[0], stiffness_cubic_m2=2e-4, rest_curvature_x_per_m=1.5)
    robot = replace(robot, segments=(segment, robot.segments[1]))
    pull = np.array([3e-3, -1e-3, 0.5e-3, -2e-3, 4e-3, 0.0])
    arcs = arc_robots([robot])
    states = solve_rows(arcs, pull[None, None], driven_by_tension=False)

    def energy(bend: np.ndarray, shift: float) -> float:
        total = 0.5 * 5e4 * shift**2
        for index, item in enumerate(robot.segments):
            k = np.hypot(bend[index, 0] / LENGTH - item.rest_curvature_x_per_m, bend[index, 1] / LENGTH)
            total += EI * LENGTH * (k**2 / 2 + item.stiffness_cubic_m2 * k**4 / 4)
        for t, tendon in enumerate(robot.tendons):
            reach = 1 if tendon.ends_at == "s0" else 2
            hole = ARM * np.array([np.cos(tendon.angle_rad), np.sin(tendon.angle_rad)])
            moved = bend - [[1.5 * LENGTH, 0.0], [0.0, 0.0]]  # since the robot was unloaded
            stretch = pull[t] + 0.5 / 6e3 - sum(float(hole @ moved[s]) for s in range(reach)) - shift
            total += 0.5 * 6e3 * max(stretch, 0.0) ** 2
        return total

    bend, shift = states.bend[0, 0], float(states.shift[0, 0])
    least = energy(bend, shift)
    generator = np.random.default_rng(3)
    for _ in range(50):
        assert energy(bend + 1e-3 * generator.normal(size=(2, 2)), shift) > least
        assert energy(bend, shift + 1e-6 * generator.normal()) > least
    assert states.residual[0, 0] < 1e-8


@pytest.mark.parametrize("mu", [0.1, 0.4])
def test_friction_follows_the_capstan_out_and_back(mu):
    """Pulled through, half a segment's turn costs e^(-mu b / 2); let back, e^(+mu b / 2); between, it sticks.

    One tendon, one segment: EI b / L = T r e^(-+mu b / 2), the turn to its middle being b / 2.
    """
    robot = one_segment((0.0,), mu=mu)
    pull = [1.0, 2.0, 4.0, 6.0, 5.9, 2.0, 1.0]
    bend = bends(constant_curvature(robot, drive([[t] for t in pull]), NO_GRAVITY))[:, 0]

    def left_over(row: int, sign: float) -> float:
        return EI * bend[row] / LENGTH - pull[row] * ARM * math.exp(sign * mu * bend[row] / 2.0)

    for row in (0, 1, 2, 3):
        assert abs(left_over(row, -1.0)) < 1e-6 * pull[row]
    for row in (5, 6):
        assert abs(left_over(row, +1.0)) < 1e-6 * pull[row]
    # Pre-sliding lets a stuck tendon move by 10 um of path, here 0.0025 rad.
    assert abs(bend[4] - bend[3]) < 0.0026


def test_friction_vanishes_with_mu():
    """A friction coefficient of 1e-6 gives the frictionless postures, by the other way of solving."""
    rows = [[3e-3, 0.0, -2e-3], [5e-3, 1e-3, -3e-3], [1e-3, 2e-3, 0.0], [0.0, 0.0, 0.0]]
    smooth = one_segment((0.0, 120.0, 240.0), stiffness_N_per_m=5e3, pretension_N=1.0)
    rough = replace(smooth, friction=Friction(1e-6))
    tips = [
        np.array(
            [
                item.p_w[-1]
                for item in constant_curvature(robot, drive(rows, "displacement"), NO_GRAVITY).postures
            ]
        )
        for robot in (smooth, rough)
    ]
    np.testing.assert_allclose(tips[0], tips[1], atol=1e-7)


def test_tip_loads_by_virtual_work():
    """A tip moment M bends an arc by M L / EI; a small side force F by F L^2 / (2 EI)."""
    robot = one_segment((0.0,))
    turned = constant_curvature(robot, drive([[0.0]], moment=[0.0, 8e-3, 0.0]), NO_GRAVITY)
    np.testing.assert_allclose(bends(turned)[0], [8e-3 * LENGTH / EI, 0.0], atol=1e-8)
    pushed = constant_curvature(robot, drive([[0.0]], force=[0.0, 1e-3, 0.0]), NO_GRAVITY)
    np.testing.assert_allclose(bends(pushed)[0], [0.0, 1e-3 * LENGTH**2 / (2 * EI)], rtol=1e-5, atol=1e-12)


def test_weight_is_that_of_the_disks():
    """Small gravity g along x: disk k moves by z_k^2 b / (2 L), so b EI / L = sum m_k g z_k^2 / (2 L).

    Of masses along the segment the sum is an integral, m g L / 6, to 1 / (4 n^2) for n disks.
    """
    robot = one_segment((0.0,))
    run = constant_curvature(robot, drive([[0.0]]), np.array([1e-3, 0.0, 0.0]))
    assert bends(run)[0, 0] == pytest.approx(0.01 * 1e-3 * LENGTH / 6.0 * LENGTH / EI, rel=2.6e-3)
    assert bends(run)[0, 0] != pytest.approx(0.01 * 1e-3 * LENGTH / 6.0 * LENGTH / EI, rel=2.4e-3)
    robot = replace(robot, masses="faces")
    gravity = 1e-3
    run = constant_curvature(robot, drive([[0.0]]), np.array([gravity, 0.0, 0.0]))
    heights = LENGTH * np.arange(1, 11) / 10.0
    expected = (0.01 / 10 * gravity * heights**2 / (2 * LENGTH)).sum() * LENGTH / EI
    assert bends(run)[0, 0] == pytest.approx(expected, rel=1e-5)


def test_holes_that_turn_make_a_helix_of_known_radius_and_pitch():
    """Moment T r turns with the holes: curvature k = T r / EI and torsion w, a helix.

    Its radius is k / (k^2 + w^2), and it climbs by w / sqrt(k^2 + w^2) of its length (Frenet and Serret).
    """
    tension_N, rate = 5.0, 2.0 * math.pi / LENGTH
    robot = one_segment((30.0,))
    turned = replace(robot, segments=(replace(robot.segments[0], rest_twist_rad_per_m=rate),))
    run = constant_curvature(turned, drive([[tension_N]]), NO_GRAVITY)
    p_w = np.concatenate([np.zeros((1, 3)), run.postures[0].p_w])
    curvature = tension_N * ARM / EI
    both = math.hypot(curvature, rate)
    # Axis: the Darboux vector k b + w t at the base, where t is +z and n points at the first hole.
    normal = np.array([math.cos(math.radians(30.0)), math.sin(math.radians(30.0)), 0.0])
    axis = (curvature * np.cross([0.0, 0.0, 1.0], normal) + rate * np.array([0.0, 0.0, 1.0])) / both
    centre = curvature / both**2 * normal
    beside = p_w - centre
    away = beside - np.outer(beside @ axis, axis)
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), curvature / both**2, atol=1e-9)
    steps = LENGTH / 10.0 * np.arange(11)
    np.testing.assert_allclose(p_w @ axis, rate / both * steps, atol=1e-9)


def test_a_helix_is_what_many_short_arcs_make():
    """Arcs of a thousandth, each toward where the holes are in its middle, end where the helix does."""
    bend, turn, count = np.array([0.7, -0.4]), 1.9, 1000
    whole = (np.array([LENGTH]), np.array([0]), np.array([1.0]))
    (position,), (turned,) = points_on_arcs(bend[None], *whole, np.array([turn]))
    angle = ((np.arange(count) + 0.5) / count - 0.5) * turn
    shares = np.stack(
        [
            bend[0] * np.cos(angle) - bend[1] * np.sin(angle),
            bend[0] * np.sin(angle) + bend[1] * np.cos(angle),
        ],
        1,
    )
    p_w, R_w = segment_frames(shares / count, np.full(count, LENGTH / count))
    np.testing.assert_allclose(position, p_w[-1], atol=1e-6 * LENGTH)
    np.testing.assert_allclose(turned, R_w[-1], atol=1e-6)
    for nearly in (np.array([1e-9]), np.array([0.0]), None):
        (straight,), (frame,) = points_on_arcs(bend[None], *whole, nearly)
        np.testing.assert_allclose(straight, arc_end(bend, np.array(LENGTH))[0], atol=1e-9)
        np.testing.assert_allclose(frame, arc_end(bend, np.array(LENGTH))[1], atol=1e-8)


@pytest.mark.parametrize("size", [1e-6, 1e-2, 0.2, 2.0])
def test_places_along_arcs_and_helices_are_exponentials_of_their_rates(size):
    """Frames anywhere on three segments, against SciPy's exponential of the constant rate of each."""
    generator = np.random.default_rng(5)
    bend, turn = size * generator.normal(size=(4, 3, 2)), size * generator.normal(size=3)
    length = generator.uniform(0.02, 0.1, size=3)
    segment, fraction = np.array([0, 0, 1, 2, 2]), np.array([0.5, 1.0, 0.3, 0.7, 1.0])

    def end(of: np.ndarray, long: float, turned: float, share: float) -> np.ndarray:
        rate = np.zeros((4, 4))
        rate[:3, :3] = [[0.0, -turned, of[0]], [turned, 0.0, of[1]], [-of[0], -of[1], 0.0]]
        rate[2, 3] = long
        return _about_z(-0.5 * turned) @ expm(share * rate) @ _about_z(0.5 * turned - share * turned)

    for turns in (None, turn):
        p_w, R_w = points_on_arcs(bend, length, segment, fraction, turns)
        for row in range(len(bend)):
            for place, (last, share) in enumerate(zip(segment, fraction, strict=True)):
                frame = np.eye(4)
                for s in range(last + 1):
                    turned = 0.0 if turns is None else turns[s]
                    frame = frame @ end(bend[row, s], length[s], turned, share if s == last else 1.0)
                np.testing.assert_allclose(p_w[row, place], frame[:3, 3], atol=1e-13)
                np.testing.assert_allclose(R_w[row, place], frame[:3, :3], atol=1e-12)


def _about_z(angle: float) -> np.ndarray:
    turn = np.eye(4)
    turn[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    return turn


@pytest.mark.slow
def test_the_simulated_chain_with_turned_holes_is_the_helix():
    """Holes that turn by 60 deg move the tip by 6 mm; simulation and twin differ by 0.05 mm."""
    base = one_segment((0.0, 120.0, 240.0), stiffness_N_per_m=8e3, pretension_N=1.0)
    rows = drive([[2e-3, 0.0, 0.0], [1e-3, 1.5e-3, -0.5e-3], [0.0, -1e-3, 2.5e-3]], "displacement")
    columns = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
    tips = []
    for turn_deg in (0.0, 60.0):
        turned = replace(base.segments[0], rest_twist_rad_per_m=math.radians(turn_deg) / LENGTH)
        robot = replace(base, segments=(turned,), actuation="displacement")
        simulated = posture_columns(robot, simulate(robot, rows, NO_GRAVITY).postures, columns)
        tips.append(np.stack([simulated[name] for name in columns], axis=1))
        twin = twin_for(robot, "displacement", columns, NO_GRAVITY)
        assert np.abs(twin([robot], rows, 1)[0] - tips[-1]).max() < 0.06
    assert np.abs(tips[1] - tips[0]).max() > 6.0


def test_a_full_turn_of_the_holes_takes_a_plane_s_moment_away():
    """Where a segment bends in one plane, holes that turn once around give a tendon no mean arm: no bend."""
    robot = one_segment((30.0,), axes="x")
    turned = replace(robot, segments=(replace(robot.segments[0], rest_twist_rad_per_m=2 * math.pi / LENGTH),))
    run = constant_curvature(turned, drive([[5.0]]), NO_GRAVITY)
    np.testing.assert_allclose(run.postures[0].p_w[-1], [0.0, 0.0, LENGTH], atol=1e-12)


def test_planar_segments_keep_their_plane():
    """A segment that bends in xz only does not follow a tendon at its side."""
    run = constant_curvature(one_segment((60.0,), axes="x"), drive([[5.0]]), NO_GRAVITY)
    np.testing.assert_allclose(bends(run)[0], [5.0 * ARM * 0.5 * LENGTH / EI, 0.0], atol=1e-9)


def test_a_batch_is_its_robots_one_by_one():
    """Robots solved together, with and without friction, are the same as alone."""
    base = one_segment((0.0, 120.0, 240.0), segments=2, stiffness_N_per_m=5e3, pretension_N=1.0)
    rows = np.random.default_rng(5).uniform(-2e-3, 4e-3, size=(6, 6))
    for mus in ((0.0, 0.0, 0.0), (0.1, 0.2, 0.3)):
        robots = [
            replace(base, friction=Friction(mu), stiffness_scale=scale)
            for mu, scale in zip(mus, (0.8, 1.0, 1.3), strict=True)
        ]
        together = solve_rows(arc_robots(robots), np.tile(rows, (3, 1, 1)), False)
        for index, robot in enumerate(robots):
            alone = solve_rows(arc_robots([robot]), rows[None], False)
            np.testing.assert_allclose(together.bend[index], alone.bend[0], atol=1e-6)


@pytest.mark.slow
def test_twin_is_the_simulated_chain():
    """With tendons straight between disks the arcs meet the simulated chain, bent out of one plane.

    Cells of 6 mm bent by up to 6 deg: a hinge at mid-cell instead of an arc is 0.1 % of the length.
    """
    robot = one_segment((0.0, 120.0, 240.0), segments=3, stiffness_N_per_m=7e3)
    robot = replace(robot, segments=tuple(replace(item, length_m=0.06) for item in robot.segments))
    pull = drive([[2e-3, -2e-3, -2e-3, -4e-3, 2.5e-3, -4e-3, -5e-3, -5e-3, 4e-3]], "displacement")
    simulated = simulate(robot, pull, NO_GRAVITY).postures[0]
    arcs = arc_robots([robot], straight_between_disks=True)
    twin = postures(robot, arcs, solve_rows(arcs, pull.tendon[None], False))[0]
    assert np.linalg.norm(simulated.p_w[-1] - twin.p_w[-1]) < 0.5e-3
    np.testing.assert_allclose(simulated.actuator_tension, twin.actuator_tension, rtol=0.02, atol=0.05)
