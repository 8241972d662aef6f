"""Claims about simulated exposed tubes: unloaded arcs, beams under loads, and rest bends."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from drive import rows_to_inputs
from scipy.integrate import solve_bvp

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.posture import Posture
from catheter_sim.robots.catheter import kinematics
from catheter_sim.robots.catheter.kinematics import pk
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator

pytestmark = pytest.mark.slow

ROBOTS = ("mitral_transseptal", "mitral_4dof")
EI_N_M2 = 1e-4
BEYOND_M = 10.5e-3  # from the tube's end to the tip of the transseptal robot
NO_GRAVITY = np.zeros(3)


def catheter(name: str, *settings: str) -> CatheterRobot:
    robot = load_robot(name, settings)
    assert isinstance(robot, CatheterRobot)
    return robot


def tube(curvature_per_m: float = 0.0, *settings: str) -> CatheterRobot:
    """Return the transseptal robot from its prismatic segment on: a tube from a fixed guide."""
    keys = f"tube_stiffness_N_mm2={EI_N_M2 * 1e6}", f"tube_curvature_x_per_m={curvature_per_m}"
    whole = catheter("mitral_transseptal", *(f"segments.advance.{key}" for key in keys), *settings)
    return replace(whole, segments=whole.segments[2:], tendons=whole.tendons[2:])


def loaded(robot: CatheterRobot, advance_m: float, force_N: Array, moment_N_m: float = 0.0) -> Posture:
    """Return the posture at rest under a force on the tip and a moment about +y, ramped up."""
    simulator = Simulator(robot, inertia=False)
    row = np.zeros(len(robot.tendons))
    for step in range(1, 101):
        row[-1] = advance_m * step / 100
        simulator.set_inputs(row)
        simulator.step()
    for step in range(1, 101):
        share = step / 100
        simulator.set_inputs(row, share * np.asarray(force_N), (0.0, share * moment_N_m, 0.0))
        simulator.step()
    assert simulator.settle(20.0)
    return simulator.posture()


def elastica(s: float, across_N: float, along_N: float, curvature_per_m: float) -> Array:
    """Return the tip (x, z) [m] and its slope [rad] of the planar elastica with the rigid end beyond it."""

    def slopes(share: float, _: Array, y: Array) -> Array:
        turn = y[3] / EI_N_M2 + curvature_per_m
        bent = share * (along_N * np.sin(y[2]) - across_N * np.cos(y[2]))
        return s * np.array([np.sin(y[2]), np.cos(y[2]), turn, bent])

    def ends(share: float, near: Array, far: Array) -> Array:
        lever = across_N * np.cos(far[2]) - along_N * np.sin(far[2])
        return np.array([near[0], near[1], near[2], far[3] - share * BEYOND_M * lever])

    t = np.linspace(0.0, 1.0, 40)
    y = np.stack([0 * t, s * t, 0 * t, 0 * t])
    for share in (0.25, 0.5, 0.75, 1.0):  # the load step by step, each from the last
        solved = solve_bvp(partial(slopes, share), partial(ends, share), t, y, tol=1e-8)
        assert solved.success
        t, y = solved.x, solved.y
    x, z, slope, _ = y[:, -1]
    return np.array([x + BEYOND_M * math.sin(slope), z + BEYOND_M * math.cos(slope), slope])


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("stiffness", ["inf", "60"])
def test_unloaded_tube_is_its_arc(name: str, stiffness: str) -> None:
    """At every advance and bend of the rest of the robot the tip is on the kinematics' arc, and the
    advance is the tube's length: 0.01 mm asked of the tube; the chain of hinges before it has 0.05 mm.
    """
    keys = f"tube_stiffness_N_mm2={stiffness}", "tube_curvature_x_per_m=20", "tube_curvature_y_per_m=-11"
    robot = catheter(name, *(f"segments.advance.{key}" for key in keys))
    rows = np.array([(0, 0, 0, 0), (0, 0, 0, 5), (0, 0, 0, 60), (1, 1, -1, 25), (-2, 1, 1, 50)]) * 1e-3
    inputs = rows_to_inputs(rows, "displacement")
    run = simulate(robot, inputs, NO_GRAVITY)
    assert run.at_rest.all()
    twin = pk(robot, inputs, NO_GRAVITY)
    for row, (ours, theirs) in enumerate(zip(run.postures, twin.postures, strict=True)):
        far = np.linalg.norm(ours.p_w[-1] - theirs.p_w[-1])
        assert far < (1e-5 if row < 3 else 5e-5), row


@pytest.mark.parametrize("advance_mm", [20.0, 40.0, 60.0])
def test_small_force_bends_the_tube_as_a_cantilever(advance_mm: float) -> None:
    """Pure force at the tube's end (a moment takes the lever of what is beyond away): F s^3 / (3 EI) and
    F s^2 / (2 EI) to 0.2 % (1 % asked); in a plane between x and y the same, toward the force.
    """
    s = advance_mm * 1e-3
    force = 0.02 * EI_N_M2 / s**2
    posture = loaded(tube(), s, np.array([force, 0.0, 0.0]), -force * BEYOND_M)
    slope = math.atan2(posture.R_w[-1, 0, 2], posture.R_w[-1, 2, 2])
    assert slope == pytest.approx(force * s**2 / (2 * EI_N_M2), rel=2e-3)
    across = posture.p_w[-1, 0] - BEYOND_M * math.sin(slope)
    assert across == pytest.approx(force * s**3 / (3 * EI_N_M2), rel=2e-3)
    straight = loaded(tube(), s, np.array([force, 0.0, 0.0])).p_w[-1]
    turned = loaded(tube(), s, force * np.array([0.6, 0.8, 0.0])).p_w[-1]
    assert turned == pytest.approx([0.6 * straight[0], 0.8 * straight[0], straight[2]], rel=2e-3)


@pytest.mark.parametrize(
    ("advance_mm", "across", "along", "curvature", "share"),
    [
        (40.0, 1.0, 0.0, 0.0, 4e-3),
        (60.0, 3.0, 0.0, 0.0, 0.015),
        (60.0, 5.0, 0.0, 0.0, 0.02),
        (40.0, 0.1, -1.5, 0.0, 0.02),
        (40.0, 0.1, 3.0, 0.0, 0.005),
        (40.0, 0.5, 0.0, 20.0, 0.01),
        (40.0, -0.5, 0.0, 20.0, 1e-3),
    ],
)
def test_large_loads_bend_the_tube_as_an_elastica(
    advance_mm: float, across: float, along: float, curvature: float, share: float
) -> None:
    """Loads in EI / s^2, across and along the guide: the tip is within a share of its way from the unloaded
    place, 2 % up to a load of 5 (the tip then goes as far as the tube is long) and up to a push of 1.5.
    """
    s = advance_mm * 1e-3
    unit = EI_N_M2 / s**2
    posture = loaded(tube(curvature), s, unit * np.array([across, 0.0, along]))
    exact = elastica(s, unit * across, unit * along, curvature)
    way = np.linalg.norm((exact - elastica(s, 0.0, 0.0, curvature))[:2])
    assert np.linalg.norm(posture.p_w[-1, [0, 2]] - exact[:2]) < share * way


def test_tube_bends_alike_in_every_plane() -> None:
    """A load of 2 EI / s^2 at 35 deg between x and y bends the tube in its own plane, without twist."""
    s = 0.05
    force = 2.0 * EI_N_M2 / s**2
    plain = loaded(tube(), s, np.array([force, 0.0, 0.0]))
    toward = math.radians(35.0)
    other = loaded(tube(), s, force * np.array([math.cos(toward), math.sin(toward), 0.0]))
    across = plain.p_w[-1, 0]
    expected = [across * math.cos(toward), across * math.sin(toward), plain.p_w[-1, 2]]
    assert other.p_w[-1] == pytest.approx(expected, abs=1e-7)
    about = np.array(
        [[math.cos(toward), -math.sin(toward), 0], [math.sin(toward), math.cos(toward), 0], [0, 0, 1]]
    )
    assert other.R_w[-1] == pytest.approx(about @ plain.R_w[-1] @ about.T, abs=1e-6)


def test_retracted_tube_holds_its_module() -> None:
    """At no advance 1 N mm turns the module by less than 0.01 deg (a tube of 0.01 mm is left)."""
    posture = loaded(tube(), 0.0, np.zeros(3), 1e-3)
    assert math.degrees(math.atan2(posture.R_w[-1, 0, 2], posture.R_w[-1, 2, 2])) < 0.01


def test_tube_stands_a_strong_pull() -> None:
    """Pulled along by a hundred EI / s^2 it comes to rest, straighter than the small-force cantilever."""
    s = 0.04
    unit = EI_N_M2 / s**2
    posture = loaded(tube(), s, unit * np.array([1.0, 0.0, 100.0]))
    assert 0.0 < posture.p_w[-1, 0] < 0.03 * s


def test_tube_that_is_bent_with_the_joint_adds_to_its_tension() -> None:
    """Tension = (wires' stiffness + EI / length) bend / arm, to 0.1 %."""
    robot = catheter("mitral_transseptal", "segments.advance.tube_stiffness_N_mm2=100")
    run = simulate(
        robot, rows_to_inputs(np.array([(2.0, 0.0, 0.0, 20.0)]) * 1e-3, "displacement"), NO_GRAVITY
    )
    posture, joint = run.postures[0], robot.segments[1]
    bend = float(posture.joint_angles[1:12].sum())
    expected = (5.6e-3 + EI_N_M2 / joint.length_m) * bend / float(kinematics.arm_m(joint, bend))
    assert posture.actuator_tension[0] == pytest.approx(expected, rel=1e-3)


def test_posture_does_not_depend_on_the_step_or_on_what_was_before() -> None:
    """Steps of 1 and 10 ms end within 1 um under a load; a reset straightens all, and then they end alike."""
    row, force = np.array([1.5, 1.0, -1.0, 45.0]) * 1e-3, (0.01, 0.02, 0.0)
    ends = []
    for step in (0.001, 0.01):
        keys = "tube_stiffness_N_mm2=100", "tube_curvature_x_per_m=15", "tube_curvature_y_per_m=8"
        settings = [f"segments.advance.{key}" for key in keys]
        robot = catheter("mitral_transseptal", *settings, f"dynamics.timestep_s={step}")
        simulator = Simulator(robot, inertia=False)
        for _ in range(2):
            simulator.reset()
            assert not simulator.data.qpos.any()
            simulator.set_inputs(row, force)
            assert simulator.settle(20.0)
            ends.append(simulator.posture().p_w)
    assert np.abs(np.array(ends) - ends[0]).max() < 1e-6


@pytest.mark.parametrize(
    ("name", "settings", "within"),
    [
        ("mitral_transseptal", ("segments.bending.rest_deg=12",), 5e-5),
        (
            "mitral_4dof",
            ("segments.bending_proximal.rest_deg=-8", "segments.bending_distal.rest_deg=15"),
            5e-5,
        ),
    ],
)
def test_rest_bend_is_the_zero_of_the_displacement(
    name: str, settings: tuple[str, ...], within: float
) -> None:
    """From rest bends on, to both sides: the tip is where pure kinematics has it (0.3 mm asked), and at
    zero input no tendon pulls.
    """
    robot = catheter(name, *settings)
    rows = np.array([(0, 0, 0, 0), (1, -0.5, 1, 10), (-0.3, 0.2, 0, 20), (-2, 1, 0, 0)]) * 1e-3
    inputs = rows_to_inputs(rows, "displacement")
    run = simulate(robot, inputs, NO_GRAVITY)
    twin = pk(robot, inputs, NO_GRAVITY)
    assert abs(run.postures[0].p_w[-1, 0]) > 3e-3
    assert run.postures[0].actuator_tension == pytest.approx(np.zeros(4), abs=1e-3)
    for ours, theirs in zip(run.postures, twin.postures, strict=True):
        assert np.linalg.norm(ours.p_w[-1] - theirs.p_w[-1]) < within
