"""Claims about residuals: they are small at a solution, and large where a solution is spoiled.

The planar models' are in `test_planar_balance`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rolling_cases import HANGING, NO_GRAVITY, pulls

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter import kinematics
from catheter_sim.robots.catheter.kinematics import arm_m
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.robots.continuum import arcs, lumped
from catheter_sim.robots.continuum import rods as rod_models
from catheter_sim.robots.continuum.constant_curvature import arc_robots
from catheter_sim.robots.continuum.lumped_kernels import ARC, LINKS, LINKS_MIDDLE
from catheter_sim.robots.continuum.rods import load, problem
from catheter_sim.robots.rolling import complete, printed
from catheter_sim.robots.rolling.complete import solve_history, solve_loaded
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.robots.rolling.spec import RollingRobot
from catheter_sim.theory.static_models import STATIC_MODELS


def section(*settings: str) -> RollingRobot:
    robot = load_robot("chest_tube_section", settings)
    assert isinstance(robot, RollingRobot)
    return robot


# --- rolling joints ---


@pytest.mark.parametrize("model", ["complete", "virtual_work"])
def test_residual_of_rolling_joints_is_the_largest_moment_left(
    model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Row by row, of either sign, at any joint: what the solver leaves over is what the run says."""
    name = {"complete": "solve_history", "virtual_work": "solve_history_by_virtual_work"}[model]
    solve = getattr(complete, name)
    inputs = pulls([5.0, 20.0])
    clean = STATIC_MODELS[model].solve(section(), inputs, HANGING)
    assert clean.residual.max() < 1e-12

    def short_of_it(*arguments: object, pre_sliding_m: tuple[float, ...] = ()) -> object:
        assert not pre_sliding_m
        solved = solve(*arguments)
        left = solved.unbalanced.copy()
        left[0, 3], left[1, 14] = 2e-4, -7e-4
        return replace(solved, unbalanced=left)

    monkeypatch.setattr(complete, name, short_of_it)
    assert STATIC_MODELS[model].solve(section(), inputs, HANGING).residual == pytest.approx([2e-4, 7e-4])


def test_solved_moments_are_those_at_the_solution() -> None:
    """Weightless under one rod: elastic moment and tension times the span's slope, by the rods' geometry."""
    chain = rolling_chain(section("friction.mu=0"))
    solved = solve_history(chain, pulls([20.0]), NO_GRAVITY)
    theta = solved.theta

    def left(angles: np.ndarray) -> np.ndarray:
        spans = complete.spans(chain, angles)
        elastic, _ = complete.elastic_moments(chain, angles, spans)
        return -elastic - 20.0 * spans.slope[..., 0, :]

    assert np.abs(left(theta)).max() < 1e-10
    assert np.abs(left(theta + 1e-3)).max() > 1e-5
    assert np.abs(solved.unbalanced).max() < 1e-12


def test_printed_residual_is_the_largest_moment_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bend angles that are off by 1 mrad leave what the elastic moments' slope says, and no less."""
    balanced = printed.balanced
    clean = STATIC_MODELS["printed"].solve(section(), pulls([5.0]), NO_GRAVITY)
    assert clean.residual.max() < 1e-10
    monkeypatch.setattr(printed, "balanced", lambda *arguments: balanced(*arguments) + 1e-3)
    spoiled = STATIC_MODELS["printed"].solve(section(), pulls([5.0]), NO_GRAVITY)
    slope = float(rolling_chain(section()).rest_stiffness.min())
    assert spoiled.residual[0] > 0.2e-3 * slope


@pytest.mark.parametrize("place", [0, 1, 2])
def test_unsolvable_tension_of_a_batch_is_named(place: int) -> None:
    """Under a push of 1 N along the axis 100 N has no posture close by, 5 and 1000 N have one."""
    batch = np.insert(np.array([[1000.0], [5.0]]), place, 100.0, axis=0)
    with pytest.raises(InputError, match=r"no posture balances the tensions \[100.0\] N"):
        solve_loaded(rolling_chain(section()), batch, HANGING, np.array([0.0, 0.0, -1.0]))


@pytest.mark.slow
def test_unsolvable_row_of_the_printed_balance_is_named() -> None:
    """10 kN has no posture close by; 10 and 20 N have one."""
    robot = section("segments.section.joints=3", "segments.section.length_mm=45")
    with pytest.raises(InputError, match=r"^row 3 \(time_s = 2\): static model 'printed'"):
        STATIC_MODELS["printed"].solve(robot, pulls([10.0, 20.0, 1e4]), NO_GRAVITY)


# --- robots of tendons and disks ---


def bench(disks: int = 2) -> object:
    return load_robot("spacer_disk", (f"disks_per_segment={disks}",))


def four(*rows: tuple[float, ...]) -> Inputs:
    count = len(rows)
    zeros = np.zeros((count, 3))
    return Inputs(np.arange(float(count)), "tension", np.array(rows, float), zeros, zeros)


def test_residual_of_arcs_is_in_newton_meters_row_by_row(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the solver leaves over, in radians of the stiffest segment, times that segment's EI / L."""
    robots = arc_robots([load_robot("spacer_disk")])
    commands = np.zeros((1, 2, 4))
    solve = arcs.solve_histories

    def short_of_it(*arguments: object) -> None:
        solve(*arguments)
        arguments[-1][3][:] = [[1e-3, 4e-3]]  # type: ignore[index]

    assert arcs.solve_rows(robots, commands, True).residual.max() < 1e-9
    monkeypatch.setattr(arcs, "solve_histories", short_of_it)
    left = arcs.solve_rows(robots, commands, True).residual
    stiffness = 211e9 * np.pi * 0.4e-3**4 / 4.0 / 0.05
    assert left == pytest.approx(stiffness * np.array([[1e-3, 4e-3]]), rel=1e-9)


@pytest.mark.parametrize("model", ["CC_sub", "PRB", "PRB_middle"])
def test_residual_of_lumped_models_is_the_largest_moment_left(
    model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the solver leaves over is what the run says, none of it lost on the way."""
    robot = bench()
    clean = STATIC_MODELS[model].solve(robot, four((1.0, 0.0, 0.0, 0.0)), NO_GRAVITY)
    assert clean.residual.max() < 1e-9
    rod = problem(robot)
    loads = load(rod, four((1.0, 0.0, 0.0, 0.0)), NO_GRAVITY)
    kind = {
        "CC_sub": ARC,
        "PRB": LINKS,
        "PRB_middle": LINKS_MIDDLE,
    }[model]
    solve = lumped.solve_rows

    def short_of_it(*arguments: object) -> None:
        solve(*arguments)
        arguments[5][:] += 3e-4  # type: ignore[index]

    monkeypatch.setattr(lumped, "solve_rows", short_of_it)
    assert lumped.equilibria(rod, loads, kind).residual == pytest.approx([3e-4], abs=1e-8)
    spoiled = STATIC_MODELS[model].solve(robot, four((1.0, 0.0, 0.0, 0.0)), NO_GRAVITY)
    assert spoiled.residual == pytest.approx([3e-4], abs=1e-8)


@pytest.mark.parametrize("model", ["VC", "VC_ref", "VC_ref_noproj"])
def test_residual_of_rod_models_is_the_largest_moment_left(
    model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Moments of either sign count, at any disk: what the solver leaves over is what the run says."""
    robot, inputs = bench(), four((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 2.0, 0.0))
    assert STATIC_MODELS[model].solve(robot, inputs, NO_GRAVITY).residual.max() < 1e-9
    solve = rod_models.equilibria

    def short_of_it(*arguments: object, **named: object) -> object:
        found = solve(*arguments, **named)  # type: ignore[arg-type]
        found.unbalanced[0, 1, 2], found.unbalanced[1, 3, 0] = 3e-4, -5e-4
        return found

    monkeypatch.setattr(rod_models, "equilibria", short_of_it)
    spoiled = STATIC_MODELS[model].solve(robot, inputs, NO_GRAVITY)
    assert spoiled.residual == pytest.approx([3e-4, 5e-4], abs=1e-8)


# --- catheters ---


def test_residual_of_pure_kinematics_is_the_displacement_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bends that are 1 mrad too large differ by the tendon's arm times that."""
    robot = load_robot("mitral_transseptal")
    assert isinstance(robot, CatheterRobot)
    rows = np.array([(1e-3, 0.0, 0.0, 0.0), (-2e-3, 0.0, 0.0, 0.0)])
    inputs = Inputs(np.arange(2.0), "displacement", rows, np.zeros((2, 3)), np.zeros((2, 3)))
    run = kinematics.pk(robot, inputs, np.zeros(3))
    assert run.residual.max() < 1e-15
    invert = kinematics.elastic_angle_rad

    def too_large(segment: object, *arguments: object) -> np.ndarray:
        angle = invert(segment, *arguments)  # type: ignore[arg-type]
        return angle + 1e-3 * np.sign(angle) if segment.joint == "bending" else angle  # type: ignore[attr-defined]

    monkeypatch.setattr(kinematics, "elastic_angle_rad", too_large)
    bend = np.array([posture.joint_angles[1:12].sum() for posture in run.postures])
    expected = 1e-3 * arm_m(robot.segments[1], bend)
    assert kinematics.pk(robot, inputs, np.zeros(3)).residual == pytest.approx(expected, rel=1e-3)
