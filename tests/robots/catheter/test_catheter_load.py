"""Loads on a catheter: statics against the simulation, by hand, mirrored, in the twin, and refused."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Mount
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter.description import elements, sizes
from catheter_sim.robots.catheter.kinematics import angle_rad, pk
from catheter_sim.robots.catheter.loaded import (
    Load,
    at_values,
    guessed,
    held_by,
    hinges_of,
    moments,
    stand,
    unbalanced,
)
from catheter_sim.robots.catheter.measured import hybrid, mk, pi, te
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.robots.catheter.statics import balance
from catheter_sim.robots.catheter.twin import twin
from catheter_sim.simulation.replay import simulate
from catheter_sim.theory.static_models import STATIC_MODELS

NO_GRAVITY = np.zeros(3)
DOWN = np.array([0.0, 0.0, -9.81])
TUBE = ("mitral_transseptal@tube", "friction.mu=0")  # slack, tendons that stretch, a tube that bends
SOFT = (
    "mitral_4dof",
    "segments.advance.tube_stiffness_N_mm2=100",
    "segments.advance.tube_curvature_y_per_m=4",
    "segments.bending_distal.rest_deg=8",
    "tendons.bending_proximal.stiffness_N_per_mm=5",
    "tendons.torsion.stiffness_N_per_mm=2",
    "tendons.torsion.play_mm=0.4",
    "mount.axial_stiffness_N_per_mm=4",
)


def catheter(name: str, *settings: str) -> CatheterRobot:
    robot = load_robot(name, settings)
    assert isinstance(robot, CatheterRobot)
    return robot


def driven(rows: Sequence[Sequence[float]], force_N: Sequence[Sequence[float]]) -> Inputs:
    """Return each row of displacements [mm] with each of the forces on the tip."""
    ways = 1e-3 * np.repeat(np.array(rows, dtype=float), len(force_N), axis=0)
    forces = np.tile(np.array(force_N, dtype=float), (len(rows), 1))
    return Inputs(np.arange(float(len(ways))), "displacement", ways, forces, np.zeros_like(forces))


def faces(run) -> Array:
    """Return the distal faces of a run, shape (r, n, 3) [m]."""
    return np.array([posture.p_w for posture in run.postures])


def moved(places: Array, loads: int) -> Array:
    """Return by how much each row lies off the unloaded one, the first of every `loads`."""
    return places - np.repeat(places[::loads], loads, axis=0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "rows", "force_N", "error_mm"),
    [
        (
            ("mitral_transseptal",),
            [[0, 0, 0, 0], [2.5, 0, 0, 20], [1, 1, 1, 30], [-1.5, 1, 0, 40]],
            0.2,
            0.02,
        ),
        (("mitral_4dof",), [[0, 0, 0, 0], [2, 1, 0, 20], [1, 0.5, 0, 30], [-1, 2, 3, 40]], 0.3, 0.03),
        (TUBE, [[0, 0, 0, 0], [4.5, 0, 0, 20], [2, 1, 1, 30], [-3, 1, 0, 40]], 0.2, 0.05),
        (SOFT, [[0, 0, 0, 0], [2, 1, 0, 20], [1, 0.5, 1, 30], [-1, 2, 2, 40]], 0.05, 0.2),
    ],
    ids=["transseptal", "four_dof", "tube", "soft"],
)
def test_a_force_moves_the_tip_as_in_the_simulation(
    settings: tuple[str, ...], rows: list[list[float]], force_N: float, error_mm: float
) -> None:
    """Along loops and every axis, to an error a tenth of which each axis moves the tip by, or more."""
    robot = catheter(*settings)
    forces = force_N * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, -1], [-1, 0, 0]])
    inputs = driven(rows, forces.tolist())
    simulated = moved(1e3 * faces(simulate(robot, inputs, NO_GRAVITY))[:, -1], len(forces))
    static = moved(1e3 * faces(balance(robot, inputs, NO_GRAVITY))[:, -1], len(forces))
    error = np.linalg.norm(static - simulated, axis=1)
    own = np.linalg.norm(simulated, axis=1).reshape(len(rows), len(forces)).max(axis=0)
    print(settings[0], "error", error.max(), "moved by", own)
    assert error.max() < error_mm
    assert own[1:].min() > 10.0 * error_mm


@pytest.mark.slow
def test_weight_bends_as_in_the_simulation() -> None:
    """Masses of the segments and one at the tip, in gravity across the robot; 1 mm or more, to 0.03 mm."""
    robot = catheter(
        "mitral_transseptal", "segments.bending.mass_g=4", "segments.torsion_distal.mass_g=3", "tip_mass_g=5"
    )
    inputs = driven([[0, 0, 0, 0], [1.5, 1, 0, 30]], [[0, 0, 0]])
    across = np.array([9.81, 0.0, 0.0])
    simulated = 1e3 * faces(simulate(robot, inputs, across))[:, -1]
    static = 1e3 * faces(STATIC_MODELS["balance"].solve(robot, inputs, across))[:, -1]
    without = 1e3 * faces(balance(robot, inputs, NO_GRAVITY))[:, -1]
    assert np.linalg.norm(static - simulated, axis=1).max() < 0.03
    assert np.linalg.norm(static - without, axis=1).min() > 1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "percent"),
    [
        (("mitral_transseptal@tube",), 2.0),
        (
            (
                "mitral_4dof",
                "friction.mu=0.1",
                "tendons.bending_proximal.stiffness_N_per_mm=5",
                "tendons.bending_distal.stiffness_N_per_mm=3",
            ),
            5.0,
        ),
    ],
    ids=["tube", "four_dof"],
)
def test_a_constant_force_beside_friction(settings: tuple[str, ...], percent: float) -> None:
    """Along loops a constant force moves the tip as in the simulation, to a few per cent of what it moves."""
    robot = catheter(*settings)
    there = [0, 1.5, 3, 1.5, 0, -1.5, -3, -1.5, 0, 2, 1]
    rows = [[a, 0.4 * b, 0, 5 + 10 * abs(a)] for a, b in zip(there, [0, 0, 0, *there[:-3]], strict=True)]
    still, pushed = (driven(rows, [force]) for force in ([0, 0, 0], [0.03, 0.03, -0.03]))
    own, found = (
        1e3 * (faces(solve(robot, pushed, NO_GRAVITY)) - faces(solve(robot, still, NO_GRAVITY)))[:, -1]
        for solve in (simulate, balance)
    )
    error = np.linalg.norm(found - own) / np.linalg.norm(own)
    print(settings[0], "error [%]", 100 * error, "moved by [mm]", np.linalg.norm(own, axis=1))
    assert np.linalg.norm(own, axis=1).max() > 1.0
    assert error < 0.01 * percent


def test_tendons_that_stretch_and_gaps_that_share_a_tension() -> None:
    """A small force across the straight tip, by hand.

    The bend as a whole: F l^2 / (K + k a^2), l from the joint's middle to the tip; the gaps among
    themselves: F L^2 / (12 K), for evenly spread gaps.
    """
    robot = catheter("mitral_transseptal", "tendons.bending.stiffness_N_per_mm=8")
    segment, force = robot.segments[1], 1e-4
    beyond = sum(item.length_m for item in robot.segments[2:])
    lever, stiffness = beyond + 0.5 * segment.length_m, segment.bending_stiffness_N_m_per_rad
    whole = lever**2 / (stiffness + 8e3 * segment.arm_m**2)
    among = segment.length_m**2 / (12.0 * stiffness)
    places = faces(balance(robot, driven([[0, 0, 0, 0]], [[0, 0, 0], [force, 0, 0]]), NO_GRAVITY))[:, -1, 0]
    assert among > 0.2 * whole
    assert places[1] - places[0] == pytest.approx(force * (whole + among), rel=5e-3)


@pytest.mark.parametrize("advance_mm", [5.0, 30.0, 60.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_an_exposed_tube_is_a_cantilever(advance_mm: float, axis: int) -> None:
    """With joints of hard wires: F (s^3 / 3 + s^2 e + s e^2) / EI, the force e beyond the tube's end."""
    stiff = "segments.bending.bending_stiffness_N_mm_per_rad=1e9"
    robot = catheter("mitral_transseptal", stiff, "segments.advance.tube_stiffness_N_mm2=500")
    force, s = np.eye(3)[axis] * 1e-4, advance_mm * 1e-3
    e = sum(item.length_m for item in robot.segments[2:])
    found = faces(balance(robot, driven([[0, 0, 0, advance_mm]], [[0, 0, 0], force]), NO_GRAVITY))[:, -1]
    expected = 1e-4 * (s**3 / 3.0 + s**2 * e + s * e**2) / 500e-6
    assert (found[1] - found[0])[axis] == pytest.approx(expected, rel=1e-4)


def test_a_moment_turns_a_soft_torsion_drive() -> None:
    """About the straight robot's axis: M / (k r^2) of the drum, its tendon's tension M / r, the tip still."""
    robot = catheter("mitral_4dof", "tendons.torsion.stiffness_N_per_mm=2")
    radius, moment = robot.segments[-1].tendon_radius_m, 1e-3
    inputs = driven([[0, 0, 0, 10]], [[0, 0, 0]])
    run = balance(robot, replace(inputs, moment_tip=np.array([[0.0, 0.0, moment]])), NO_GRAVITY)
    posture, before = run.postures[0], balance(robot, inputs, NO_GRAVITY).postures[0]
    assert posture.joint_angles[-1] == pytest.approx(moment / (2e3 * radius**2), rel=1e-9)
    assert posture.actuator_tension[2] == pytest.approx(moment / radius, rel=1e-9)
    np.testing.assert_allclose(posture.p_w, before.p_w, atol=1e-12)


def test_a_pushed_joint_is_caught_by_its_slack_antagonist() -> None:
    """At rest between two slack tendons it goes to the angle of the slack, either way, and no further."""
    robot = catheter("mitral_transseptal", "tendons.bending.slack_mm=0.5")
    end = float(angle_rad(robot.segments[1], 0.5e-3))
    run = balance(robot, driven([[0, 0, 0, 0]], [[0.4, 0, 0], [-0.4, 0, 0], [0.5, 0, 0]]), NO_GRAVITY)
    bends = [posture.joint_angles[1:-1].sum() for posture in run.postures]
    assert bends == pytest.approx([end, -end, end], rel=0.03)
    assert all(posture.actuator_tension[0] > 1.0 for posture in run.postures)
    easy = balance(robot, driven([[0, 0, 0, 0]], [[0.005, 0, 0]]), NO_GRAVITY).postures[0]
    assert 0.0 < easy.joint_angles[1:-1].sum() < 0.5 * end
    assert easy.actuator_tension[0] == 0.0


def test_a_load_turned_over_is_mirrored() -> None:
    """In the xz plane: what moves to +x moves to -x, to rounding."""
    robot = catheter("mitral_4dof", "tendons.bending_proximal.stiffness_N_per_mm=5")
    here = faces(balance(robot, driven([[1.5, 1, 0.5, 20]], [[0.2, 0.1, -0.1]]), NO_GRAVITY))
    there = faces(balance(robot, driven([[-1.5, 1, -0.5, 20]], [[-0.2, 0.1, -0.1]]), NO_GRAVITY))
    np.testing.assert_allclose(here * [-1.0, 1.0, 1.0], there, atol=1e-11)


@pytest.mark.parametrize("settings", [("mitral_transseptal",), TUBE, SOFT])
def test_no_load_is_the_limit_of_a_small_one(settings: tuple[str, ...]) -> None:
    """1 nN moves nothing by more than a micrometre, and rows without load keep every bit."""
    robot = catheter(*settings)
    inputs = driven([[0, 0, 0, 0], [2, 1, 0.5, 20], [-2.5, 1, 0, 45]], [[0, 0, 0], [1e-9, 1e-9, -1e-9]])
    places = faces(balance(robot, inputs, NO_GRAVITY))
    alone = faces(balance(robot, replace(inputs, force_tip=np.zeros((6, 3))), NO_GRAVITY))
    np.testing.assert_array_equal(places[::2], alone[::2])
    np.testing.assert_allclose(places[1::2], alone[1::2], atol=1e-6)


def loaded_state(robot: CatheterRobot):
    """Return what balances `robot` at five random rows, the state from which it is looked for, and a load."""
    generator = np.random.default_rng(8)
    rows = generator.uniform([-1, -1, -1, 5], [1, 1, 1, 50], (5, 4))
    inputs = driven(rows.tolist(), [[0, 0, 0]])
    values = np.array(rows) * 1e-3 / [2e-3, 2e-3, 2e-3, 1.0]
    load = Load(generator.normal(size=(5, 3)), 0.01 * generator.normal(size=(5, 3)), DOWN)
    held = held_by(robot, inputs, np.arange(5), values, np.ones((5, 4)))
    state = guessed(held, at_values(held, values, np.full(5, 1e-4)), load)
    return held, state, load


@pytest.mark.parametrize("settings", [("mitral_transseptal", "segments.bending.mass_g=50"), TUBE, SOFT])
def test_slopes_are_those_of_what_is_unbalanced(settings: tuple[str, ...]) -> None:
    """Newton's matrix by central differences, of hinges and tensions, to 1e-6 of the largest."""
    held, state, load = loaded_state(catheter(*settings))
    hinges, count = state.angle.shape[1], state.tension.shape[1]
    _, slopes = unbalanced(held, state, load)
    step = 1e-6
    free = np.flatnonzero(held.free)
    for name, first, number in (("angle", 0, hinges), ("tension", len(held.free) - 1 - count, count)):
        for k in range(number):
            if not held.free[first + k]:
                continue
            there, back = (
                unbalanced(
                    held,
                    replace(state, **{name: getattr(state, name) + sign * step * (np.arange(number) == k)}),
                    load,
                )[0]
                for sign in (1.0, -1.0)
            )
            by_difference = (there - back)[:, free] / (2.0 * step)
            scale = np.abs(by_difference).max()
            np.testing.assert_allclose(slopes[:, free, first + k], by_difference, atol=1e-6 * scale)


def test_the_moment_about_a_hinge_is_the_work_of_turning_it() -> None:
    """F times the tip's way and weight times the masses', per angle (differences), at random angles."""
    robot = catheter(*SOFT, "segments.bending_proximal.mass_g=40", "segments.torsion.mass_g=30")
    _, state, load = loaded_state(robot)
    hinges = hinges_of(robot)
    load = replace(load, moment=np.zeros_like(load.moment))

    def work(angle: Array) -> Array:
        standing = stand(hinges, angle, state.advance)
        own = np.einsum("mi,mi->m", load.force, standing.place[:, -1])
        return own + np.einsum("n,mni,i->m", hinges.mass_kg, standing.centre, DOWN)

    torque, _ = moments(hinges, stand(hinges, state.angle, state.advance), load)
    for k in range(len(hinges.kind)):
        step = 1e-6 * (np.arange(len(hinges.kind)) == k)
        expected = (work(state.angle + step) - work(state.angle - step)) / 2e-6
        np.testing.assert_allclose(torque[:, k], expected, atol=1e-8)


@pytest.mark.parametrize("settings", [("mitral_transseptal",), TUBE, SOFT, ("mitral_transseptal@tube",)])
def test_the_twin_is_the_model(settings: tuple[str, ...]) -> None:
    """Many robots at once, each second row, some elements: each as `balance` alone has it."""
    robot = catheter(*settings)
    other = replace(robot, stiffness_scale=1.3)
    inputs = driven([[0, 0, 0, 0], [1, 1, 0.5, 20], [-1.5, 0.5, 0, 40]], [[0, 0, 0], [0.05, -0.02, 0.01]])
    still = replace(inputs, force_tip=np.zeros((6, 3)))
    last = len(elements(robot)) - 1
    wanted = [0, 3, last]
    made = twin(robot, "displacement")
    assert made.carries_load
    for every in (1, 3):
        states = made.solve([robot, other, robot], [inputs, inputs, still], NO_GRAVITY, wanted, every)
        angles = states.joint_angles()
        for place, (one, given) in enumerate(((robot, inputs), (other, inputs), (robot, still))):
            for row, posture in enumerate(balance(one, given, NO_GRAVITY).postures[::every]):
                np.testing.assert_allclose(states.p_w[place, row], posture.p_w[wanted], rtol=0, atol=1e-12)
                np.testing.assert_allclose(states.R_w[place, row], posture.R_w[wanted], atol=1e-12)
                np.testing.assert_allclose(angles[place, row], posture.joint_angles, atol=1e-12)
        if every == 1:
            by_load = states.tension[0] - states.tension[2]
            runs = (balance(robot, given, NO_GRAVITY).postures for given in (inputs, still))
            loaded, unloaded = ([posture.actuator_tension for posture in run] for run in runs)
            np.testing.assert_allclose(by_load, np.array(loaded) - np.array(unloaded), atol=1e-9)


def test_loads_up_to_the_bounds_of_a_fit_are_balanced() -> None:
    """12 times what bends a robot by a radian as soft as its joint: 99 of 100 rows find a balance."""
    generator = np.random.default_rng(3)
    for settings in (("mitral_transseptal",), ("mitral_4dof",), TUBE):
        robot = catheter(*settings)
        ways = generator.uniform([-2, -1.5, -1, 0], [2, 1.5, 1, 55], (100, 4)) * 1e-3
        force = generator.normal(size=(100, 3))
        force *= 12.0 * sizes(robot).tip_force_N / np.linalg.norm(force, axis=1, keepdims=True)
        inputs = Inputs(np.arange(100.0), "displacement", ways, force, np.zeros((100, 3)))
        tips = twin(robot, "displacement").solve([robot], [inputs], NO_GRAVITY, [12], 1).p_w[0, :, 0, 0]
        assert np.isnan(tips).sum() <= 1


def test_a_measured_law_refuses_a_load_and_so_do_printed_models() -> None:
    """One line each; the twin has no number for such a robot, and none says that it carries a load."""
    push = driven([[1, 0, 0, 0]], [[0.1, 0, 0]])
    measured = catheter("mitral_4dof@elongation")
    with pytest.raises(InputError, match=r"row 1 .*'balance' carries .*not beside tendons of a measured law"):
        balance(measured, push, NO_GRAVITY)
    made = twin(measured, "displacement")
    assert not made.carries_load
    assert np.isnan(made.solve([measured], [push], NO_GRAVITY, [12], 1).p_w).all()
    sprung = catheter("mitral_4dof", "segments.bending_distal.resistance=measured_distal")
    with pytest.raises(InputError, match=r"not beside a measured resistance"):
        balance(sprung, push, NO_GRAVITY)
    with pytest.raises(InputError, match=r"carries tip loads and weight .*not beside tendons of"):
        balance(catheter("mitral_4dof@measured"), driven([[0, 0, 0, 0]], [[0, 0, 0]]), DOWN)
    for model in (pk, mk, pi, hybrid):
        with pytest.raises(InputError, match=rf"'{model.__name__}': has no tip force or moment"):
            model(catheter("mitral_transseptal"), push, NO_GRAVITY)
    with pytest.raises(InputError, match=r"'te': has no tip force or moment"):
        te(catheter("mitral_4dof"), push, NO_GRAVITY)


def test_a_mount_gives_way_under_tendons_and_load_together() -> None:
    """A push along the axis at rest sinks the base by F / k; a pull is held by both tendons of the joint."""
    robot = replace(catheter("mitral_transseptal", "tendons.bending.stiffness_N_per_mm=8"), mount=Mount(2e3))
    inputs = driven([[0, 0, 0, 0]], [[0, 0, 0], [0, 0, -0.3], [0, 0, 0.3]])
    run = balance(robot, inputs, NO_GRAVITY)
    places = faces(run)
    lower = (places[:, :, 2] - places[0, :, 2])[1:].T
    np.testing.assert_allclose(lower, np.tile([-0.3 / 2e3, 0.3 / (2e3 + 16e3)], (13, 1)), rtol=1e-9)
    assert run.postures[2].actuator_tension[0] == pytest.approx(8e3 * 0.3 / 18e3)
