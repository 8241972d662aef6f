"""Cosserat rods with tendons: an independent solver's poses, closed forms, symmetry, virtual work, limits."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum import lumped
from catheter_sim.robots.continuum.lumped_kernels import LINKS
from catheter_sim.robots.continuum.published import spacer_disk
from catheter_sim.robots.continuum.rods import Equilibria, RodLoad, RodProblem, equilibria, load, problem
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.theory.static_models import STATIC_MODELS

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("tdcr")]  # compiled once, half a minute

PUBLISHED = Path(__file__).resolve().parents[2] / "data" / "spacer_disk_vc_tip_poses.csv"
PATHS = {"VC": "continuous", "VC_ref": "projected", "VC_ref_noproj": "eyelets"}
LENGTH_M, EI, GJ, EA, GA, ARM_M = 0.1, 4e-3, 3e-3, 1e5, 4e4, 8e-3
FULL_N = 5.55329741  # Rao 2021, Eq. 55


def rod(disks: int = 10, mu: float = 0.0, turned: float = 0.0, stiff: bool = False) -> RodProblem:
    """Return a rod of one segment, three tendons 120 deg apart, the first one at +x turned by `turned`."""
    segment = Segment(
        "s", LENGTH_M, disks, 0.01, EI, 2e-3, torsion_stiffness_N_m2=GJ,
        axial_stiffness_N=math.inf if stiff else EA, shear_stiffness_N=math.inf if stiff else GA,
    )  # fmt: skip
    angles = [turned + k * 2.0 * math.pi / 3.0 for k in range(3)]
    tendons = tuple(Tendon(f"t{k}", ARM_M, angle, "s") for k, angle in enumerate(angles))
    return problem(
        ContinuumRobot(
            name="rod", description="", segments=(segment,), tendons=tendons, friction=Friction(mu)
        )
    )


def benchmark(disks: int = 10, **changes) -> RodProblem:
    """Return the benchmark robot."""
    return problem(replace(spacer_disk(), disks_per_segment=disks, **changes))


def loads(robot: RodProblem, tensions, force=(0.0, 0.0, 0.0), moment=(0.0, 0.0, 0.0)) -> RodLoad:
    """Return rows of tensions with the same force and moment on the tip."""
    rows = np.atleast_2d(np.array(tensions, dtype=float))
    forces = np.zeros((len(rows), len(robot.length_m), 3))
    moments = np.zeros_like(forces)
    forces[:, -1], moments[:, -1] = force, moment
    return RodLoad(rows, forces, moments)


def tendon_lengths(found: Equilibria) -> np.ndarray:
    """Return the lengths of straight tendons between the disks, shape (r, t) [m]."""
    points = found.p_w[:, :, None] + np.einsum("rjab,tjb->rjta", found.R_w[..., :2], found.rod.hole_m)
    spans = np.linalg.norm(np.diff(points, axis=1), axis=-1)  # (r, n, t)
    runs = np.arange(spans.shape[1])[:, None] < found.rod.last_disk
    return (spans * runs).sum(axis=1)


@pytest.mark.parametrize("model", PATHS)
@pytest.mark.parametrize(("disks", "case"), [(3, "none"), (10, "none"), (10, "planar_y")])
def test_poses_are_those_of_an_independent_solver(model: str, disks: int, case: str) -> None:
    """All sixteen load cases, from a straight start, to 1e-6 of the length and 1e-4 deg."""
    with PUBLISHED.open(encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    rows = [
        row
        for row in csv.DictReader(lines)
        if (row["model"], row["n"], row["load_case"]) == (model, str(disks), case)
    ]
    assert len(rows) == 16
    tensions = [[float(row[f"T{k}_N"]) for k in range(1, 5)] for row in rows]
    robot = replace(spacer_disk(), disks_per_segment=disks)
    inputs = Inputs(
        np.arange(16.0), "tension", np.array(tensions),
        np.tile([0.0, 0.5 if case == "planar_y" else 0.0, 0.0], (16, 1)), np.zeros((16, 3)),
    )  # fmt: skip
    run = STATIC_MODELS[model].solve(robot, inputs, np.zeros(3))
    for row, posture in zip(rows, run.postures, strict=True):
        position = [float(row[f"p{axis}_m"]) for axis in "xyz"]
        turn = np.array([[float(row[f"R{i}{j}"]) for j in (1, 2, 3)] for i in (1, 2, 3)])
        assert np.linalg.norm(posture.p_w[-1] - position) < 1e-6 * 0.1
        off = Rotation.from_matrix(posture.R_w[-1] @ turn.T).magnitude()
        assert math.degrees(off) < 1e-4
    assert run.residual.max() < 1e-9


@pytest.mark.parametrize("path", PATHS.values())
def test_tip_moment_bends_an_arc_and_twists(path: str) -> None:
    """Without tendons a moment m on the tip gives an arc of curvature m / EI, a torque the twist / GJ."""
    robot = rod()
    found = equilibria(robot, loads(robot, [0, 0, 0], moment=(0.0, 0.06, 0.0)), path)
    bend = 0.06 * LENGTH_M / EI
    exact = [(1.0 - math.cos(bend)) * LENGTH_M / bend, 0.0, math.sin(bend) * LENGTH_M / bend]
    np.testing.assert_allclose(found.p_w[0, -1], exact, atol=1e-9)
    found = equilibria(robot, loads(robot, [0, 0, 0], moment=(0.0, 0.0, 0.02)), path)
    twist = Rotation.from_matrix(found.R_w[0, -1]).as_rotvec()
    np.testing.assert_allclose(twist, [0.0, 0.0, 0.02 * LENGTH_M / GJ], atol=1e-9)


def test_small_tip_force_bends_a_cantilever_with_shear() -> None:
    """The tip goes F L^3 / 3 EI + F L / GA aside, and F L / EA along the axis."""
    robot = rod()
    force = 1e-5
    found = equilibria(robot, loads(robot, [0, 0, 0], force=(force, 0.0, 0.0)), "eyelets")
    exact = force * (LENGTH_M**3 / (3.0 * EI) + LENGTH_M / GA)
    assert found.p_w[0, -1, 0] == pytest.approx(exact, rel=1e-7)
    found = equilibria(robot, loads(robot, [0, 0, 0], force=(0.0, 0.0, 1.0)), "eyelets")
    assert found.p_w[0, -1, 2] - LENGTH_M == pytest.approx(LENGTH_M / EA, rel=1e-6)


def test_compression_softens_a_column() -> None:
    """Under axial P a side force's deflection is F (tan kL - kL) / kP, k^2 = P / EI, up to Euler's load."""
    robot = rod(stiff=True)
    euler = math.pi**2 * EI / (4.0 * LENGTH_M**2)
    for share in (0.3, 0.9, 0.99):
        axial, side = share * euler, 1e-7
        found = equilibria(robot, loads(robot, [0, 0, 0], force=(side, 0.0, -axial)), "eyelets")
        k = math.sqrt(axial / EI)
        exact = side * (math.tan(k * LENGTH_M) - k * LENGTH_M) / (k * axial)
        assert found.p_w[0, -1, 0] == pytest.approx(exact, rel=1e-5)


def test_one_continuous_tendon_bends_an_arc() -> None:
    """EI u = T r along the whole rod, whose length is L (1 - T / EA)."""
    robot = rod()
    tension = 4.0
    found = equilibria(robot, loads(robot, [tension, 0, 0]), "continuous")
    bend = tension * ARM_M / EI * LENGTH_M
    length = LENGTH_M * (1.0 - tension / EA)
    exact = np.array([1.0 - math.cos(bend), 0.0, math.sin(bend)]) * length / bend
    np.testing.assert_allclose(found.p_w[0, -1], exact, atol=1e-9)


@pytest.mark.parametrize("path", PATHS.values())
def test_turning_the_problem_turns_the_answer(path: str) -> None:
    """Tendons and loads turned about z by any angle: the same robot, turned, to 1e-9."""
    angle = 0.7
    turn = Rotation.from_rotvec([0.0, 0.0, angle])
    force, moment, tensions = (0.3, -0.2, 0.1), (0.004, 0.0, 0.01), [3.0, 1.0, 0.0]
    straight, turned = rod(), rod(turned=angle)
    first = equilibria(straight, loads(straight, tensions, force, moment), path)
    second = equilibria(turned, loads(turned, tensions, turn.apply(force), turn.apply(moment)), path)
    np.testing.assert_allclose(second.p_w[0], turn.apply(first.p_w[0]), atol=1e-9)
    matrix = turn.as_matrix()
    np.testing.assert_allclose(second.R_w[0], matrix @ first.R_w[0] @ matrix.T, atol=1e-9)


def test_eyelets_come_from_a_potential_and_the_projection_does_not() -> None:
    """Tensions and tip force through eyelets come from one potential: d tip_x / d T = - d length / d F_x.

    Eq. 58 takes a force away that is not zero; what is left comes from no potential.
    """
    robot = benchmark(2)
    tension, force, h = np.array([3.0, 0.5, 2.0, 1.0]), np.array([0.4, 0.3, 0.0]), 1e-3
    for path, limit in (("eyelets", 1e-5), ("projected", math.inf)):
        tips, lengths = [], []
        for k in range(4):
            pull = np.array([tension + h * np.eye(4)[k], tension - h * np.eye(4)[k]])
            tip = equilibria(robot, loads(robot, pull, force), path).p_w[:, -1, 1]
            tips.append((tip[0] - tip[1]) / (2.0 * h))
        for sign in (1.0, -1.0):
            found = equilibria(robot, loads(robot, tension, force + sign * h * np.eye(3)[1]), path)
            lengths.append(tendon_lengths(found)[0])
        change = -(lengths[0] - lengths[1]) / (2.0 * h)
        asymmetry = np.abs(np.array(tips) - change).max() / np.abs(change).max()
        assert asymmetry < limit
    assert asymmetry > 1e-3


def test_many_disks_hold_a_tendon_like_a_lumen() -> None:
    """Straight paths come to the continuous one with the square of the disks' spacing.

    Under a tip force that is the path whose passing tendons, where another one ends and the strain
    jumps, push with their own kink; Eqs 40-41 leave this force out, so that VC stays off by a little.
    """
    pulls, force = [4.0, 0.0, 3.0, 1.0], (0.5, 0.0, 0.0)
    tips = {}
    for disks in (10, 20, 40):
        robot = benchmark(disks)
        found = equilibria(robot, loads(robot, pulls, force), "eyelets", 160)
        tips[disks] = found.p_w[0, -1]
    lumens = equilibria(robot, loads(robot, pulls, force), "lumens").p_w[0, -1]
    errors = [np.linalg.norm(tip - lumens) / 0.1 for tip in tips.values()]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.05)
    limit = (4.0 * tips[40] - tips[20]) / 3.0
    assert np.linalg.norm(limit - lumens) < 2e-7
    printed = equilibria(robot, loads(robot, pulls, force), "continuous").p_w[0, -1]
    assert 2e-6 < np.linalg.norm(limit - printed) < 1e-4  # [m]


def test_no_twist_no_load_no_kink() -> None:
    """Where the tendons bend the rod in one plane without tip force, VC and the lumens are the same."""
    robot = benchmark()
    case = loads(robot, [FULL_N, 0.0, 0.0, FULL_N])
    printed, lumens = (equilibria(robot, case, path).p_w for path in ("continuous", "lumens"))
    np.testing.assert_allclose(printed, lumens, atol=1e-12)


def test_friction_on_a_continuous_path_is_the_capstan_law() -> None:
    """One tendon: each hole takes exp(-mu phi), phi half the bends of the subsegments next to it."""
    mu, tension, disks = 0.3, 5.0, 6
    robot = rod(disks, mu)
    found = equilibria(robot, loads(robot, [tension, 0, 0]), "continuous")
    h = LENGTH_M / disks

    def below(above: float, pull_before: float | None) -> float:
        bend = 0.5 * pull_before * ARM_M / EI * h if pull_before else 0.0
        return above * math.exp(-mu * bend)

    pulls: list[float] = []
    for j in range(disks):
        before = pulls[-1] if j else None
        start = below(before if before else tension, before)
        pulls.append(
            brentq(
                lambda x, s=start: x - s * math.exp(-mu * 0.5 * x * ARM_M / EI * h), 0.0, start, xtol=1e-14
            )
        )
    np.testing.assert_allclose(found.span_tension[0, 0], pulls, rtol=1e-9)


@pytest.mark.parametrize("path", ["projected", "eyelets"])
def test_friction_between_disks_follows_the_spans_angles(path: str) -> None:
    """The ratio of a tendon's tensions at a hole is exp(-mu times the angle between its two spans)."""
    mu = 0.25
    robot = rod(5, mu)
    found = equilibria(robot, loads(robot, [4.0, 1.0, 0.0], force=(0.0, 0.3, 0.0)), path)
    hole = [*robot.hole_m[0, 0], 0.0]
    points = found.p_w[0] + found.R_w[0] @ hole
    spans = np.diff(points, axis=0)
    spans /= np.linalg.norm(spans, axis=1, keepdims=True)
    spans = np.concatenate([[[0.0, 0.0, 1.0]], spans])
    angles = np.arccos(np.clip((spans[1:] * spans[:-1]).sum(axis=1), -1.0, 1.0))
    expected = 4.0 * np.exp(-mu * np.cumsum(angles))
    np.testing.assert_allclose(found.span_tension[0, 0], expected, rtol=1e-7)
    assert np.abs(found.unbalanced).max() < 1e-9


def test_locked_bending_stays_in_its_plane() -> None:
    """A planar robot, which cannot twist, shear or stretch, keeps in the xz plane under a side force."""
    robot = load_robot("neuroendoscope")
    inputs = Inputs(
        np.array([1.0]), "tension", np.full((1, len(robot.tendons)), 0.2),
        np.array([[0.01, 0.02, 0.0]]), np.zeros((1, 3)),
    )  # fmt: skip
    for model in PATHS:
        (posture,) = STATIC_MODELS[model].solve(robot, inputs, np.zeros(3)).postures
        np.testing.assert_allclose(posture.p_w[:, 1], 0.0, atol=1e-15)
        assert posture.p_w[-1, 0] > 1e-3
        steps = np.linalg.norm(np.diff(np.concatenate([[np.zeros(3)], posture.p_w]), axis=0), axis=1)
        assert (steps <= 0.12 / 60 + 1e-12).all()


@pytest.mark.parametrize("path", PATHS.values())
def test_rows_are_the_same_alone_and_together(path: str) -> None:
    """A row's posture does not depend on the rows around it, near or far."""
    robot = benchmark(4)
    rng = np.random.default_rng(5)
    rows = np.concatenate([rng.uniform(0.0, FULL_N, (4, 4)), np.linspace(2.0, 2.2, 4)[:, None] * np.ones(4)])
    together = equilibria(robot, loads(robot, rows, (0.2, 0.1, -0.1)), path)
    assert (together.reached == 1.0).all()
    for row, pulls in enumerate(rows):
        alone = equilibria(robot, loads(robot, pulls, (0.2, 0.1, -0.1)), path)
        np.testing.assert_allclose(together.p_w[row], alone.p_w[0], atol=1e-10)
    assert together.corrections[-1] < alone.corrections[0]  # a near row starts from the one before


@pytest.mark.parametrize("path", PATHS.values())
@pytest.mark.parametrize("disks", [1, 6])
def test_long_steps_lead_where_short_ones_do(path: str, disks: int) -> None:
    """A fifth of the stiffness, random tensions, forces, moments: the equilibrium of 100 steps from rest."""
    robot = benchmark(disks, stiffness_scale=0.2)
    rng = np.random.default_rng(8)
    for force in np.concatenate([np.zeros((10, 3)), rng.uniform(-0.15, 0.15, (30, 3))]):
        case = loads(robot, rng.uniform(0.0, 0.4 * FULL_N, 4), force, 0.03 * force[[1, 2, 0]])
        usual, patient = equilibria(robot, case, path), equilibria(robot, case, path, longest_step=0.01)
        assert (usual.reached == 1.0) == (patient.reached == 1.0)
        if usual.reached == 1.0:
            np.testing.assert_allclose(usual.p_w, patient.p_w, atol=1e-10)
            assert disks == 1 or usual.corrections[0] < 0.3 * patient.corrections[0]


def test_threads_share_the_rows() -> None:
    """Two threads find what one does: rods and lumped models."""
    robot = benchmark(3)
    case = loads(robot, np.random.default_rng(1).uniform(0.0, FULL_N, (7, 4)), (0.2, 0.1, 0.0))
    one, two = (equilibria(robot, case, "projected", threads=count) for count in (1, 2))
    np.testing.assert_allclose(two.p_w, one.p_w, atol=1e-10)
    one, two = (lumped.equilibria(robot, case, LINKS, threads=count) for count in (1, 2))
    np.testing.assert_array_equal(two.p_w, one.p_w)


def test_weight_acts_at_the_disks() -> None:
    """Gravity gives each disk half of either neighbouring subsegment, of 0.2 g each; the last has one."""
    robot = spacer_disk()
    inputs = Inputs(np.array([1.0]), "tension", np.zeros((1, 4)), np.zeros((1, 3)), np.zeros((1, 3)))
    case = load(problem(robot), inputs, np.array([9.81, 0.0, 0.0]))
    np.testing.assert_allclose(case.force_N[0].sum(axis=0), [3.9e-3 * 9.81, 0.0, 0.0], rtol=1e-12)
    own = [[2e-4 * 9.81, 0.0, 0.0]] * 19 + [[1e-4 * 9.81, 0.0, 0.0]]
    np.testing.assert_allclose(case.force_N[0], own, rtol=1e-12)


def test_joint_angles_bend_the_chain_like_the_rod() -> None:
    """The hinges' bends toward +y add up to the tip's, the four links of a subsegment alike."""
    inputs = Inputs(
        np.array([1.0]), "tension", np.array([[2.0, 0, 2.0, 0]]), np.zeros((1, 3)), np.zeros((1, 3))
    )
    (posture,) = STATIC_MODELS["VC_ref"].solve(spacer_disk(), inputs, np.zeros(3)).postures
    bends = posture.joint_angles.reshape(-1, 3)  # x, y, twist of each of 80 hinges
    tip = Rotation.from_matrix(posture.R_w[-1]).as_rotvec()
    assert bends[:, 1].sum() == pytest.approx(-tip[0], rel=1e-9)
    np.testing.assert_allclose(bends[:, [0, 2]], 0.0, atol=1e-12)
    assert np.isnan(posture.tendon_tension[0, 10:]).all()


def test_what_the_rods_do_not_carry_is_refused() -> None:
    """One line says what it is: a curved law, rest shapes."""
    robot = spacer_disk()
    first = robot.segments[0]
    for change, words in (
        ({"stiffness_cubic_m2": 1e-6}, "an elastic law"),
        ({"rest_curvature_x_per_m": 1.0}, "rest curvature"),
        ({"rest_twist_rad_per_m": 1.0}, "rest twist"),
    ):
        other = replace(robot, segments=(replace(first, **change), robot.segments[1]))
        with pytest.raises(InputError, match=f"segments.first: {words}"):
            problem(other)
        assert not STATIC_MODELS["VC"].applies_to(other)


def test_a_row_without_equilibrium_is_named() -> None:
    """Full tension on one disk a segment at a tenth of the stiffness folds the robot: row 2, not row 1."""
    robot = replace(spacer_disk(), disks_per_segment=1, stiffness_scale=0.1)
    inputs = Inputs(
        np.array([1.0, 2.5]), "tension", np.array([[0.1, 0.0, 0.0, 0.1], [FULL_N, 0.0, 0.0, FULL_N]]),
        np.tile([0.5, 0.0, 0.0], (2, 1)), np.zeros((2, 3)),
    )  # fmt: skip
    with pytest.raises(InputError, match=r"VC_ref finds no equilibrium at row 2 \(time_s = 2.5\)"):
        STATIC_MODELS["VC_ref"].solve(robot, inputs, np.zeros(3))
