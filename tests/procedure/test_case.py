"""Claims about what a delivery meets: the flow's force, and cases drawn for either catheter."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.core.robot import Friction
from catheter_sim.errors import InputError
from catheter_sim.procedure.heart import (
    DOWN,
    EXPOSED_M,
    FLOW_N,
    PRINTED_FLOW_N,
    TILT_RAD,
    Flow,
    coaptation_axes,
    free_edge_z_m,
    median_anatomy,
    pose_error,
    random_anatomy,
    random_flow,
)
from catheter_sim.procedure.plan import (
    CROSSED_ROLL_RAD,
    REACHED,
    displacements_m,
    plan,
    plan_way,
    random_case,
    ranges,
    target_frame,
)
from catheter_sim.robots.catheter.kinematics import tool_frame, within_limits
from catheter_sim.robots.catheter.picture import hinge_place_m
from catheter_sim.robots.catheter.published import mitral_4dof, mitral_transseptal, mitral_transseptal_tube
from catheter_sim.simulation.simulator import Simulator

ROBOTS = [mitral_transseptal(), mitral_4dof()]


def test_force_has_seventy_beats_a_minute_and_its_amplitude() -> None:
    """Over 60 s: 70 rises through zero, extremes of the amplitude along the direction, no mean."""
    flow = random_flow(np.random.default_rng(3))
    times = np.linspace(0.0, 60.0, 60001)[:-1]
    force = np.array([flow.force_N(time, 1.0) for time in times])
    along = force @ flow.direction
    assert np.abs(force - along[:, np.newaxis] * flow.direction).max() < 1e-15
    assert np.count_nonzero((along[:-1] < 0.0) & (along[1:] >= 0.0)) == 70
    assert along.max() == pytest.approx(flow.amplitude_N, rel=1e-4)
    assert along.min() == pytest.approx(-flow.amplitude_N, rel=1e-4)
    assert abs(along.mean()) < 1e-6 * flow.amplitude_N
    spectrum = np.abs(np.fft.rfft(along))
    assert int(spectrum.argmax()) == 70


def test_septum_shields_the_tip() -> None:
    """Nothing before it, all of it a centimetre beyond, half in between."""
    flow = Flow(1e-2, DOWN, 0.5 * math.pi)
    assert not flow.force_N(0.0, -1e-3).any()
    assert flow.force_N(0.0, 0.5 * EXPOSED_M) == pytest.approx(0.5e-2 * DOWN)
    assert flow.force_N(0.0, 5.0 * EXPOSED_M) == pytest.approx(1e-2 * DOWN)


def test_random_flows_fill_their_ranges() -> None:
    """Amplitude and tilt within their bounds, both halves met; into the ventricle; the same from a seed."""
    flows = [random_flow(np.random.default_rng(seed)) for seed in range(60)]
    sizes = np.array([flow.amplitude_N for flow in flows])
    tilts = np.arccos([flow.direction @ DOWN for flow in flows])
    for values, (low, high) in ((sizes, FLOW_N), (tilts, (0.0, TILT_RAD))):
        assert low <= values.min() < 0.5 * (low + high) < values.max() <= high
    again = random_flow(np.random.default_rng(7))
    assert (again.amplitude_N, again.phase_rad) == (flows[7].amplitude_N, flows[7].phase_rad)


def test_printed_flow_swings_the_tip_as_far_as_measured() -> None:
    """Nayar 2022, Section IV-F: 0.13 mm at a bend of 90 deg; the robot of that section, no friction."""
    robot = replace(mitral_transseptal_tube(), friction=Friction(0.0))
    simulator = Simulator(robot, inertia=False)
    row = displacements_m(robot, np.array([0.0, 0.5 * math.pi, 0.0, 0.0]), np.ones(4))
    row[1:] = 0.0
    for step in range(1, 201):
        simulator.set_inputs(row * step / 200)
        simulator.step()
    simulator.settle()
    rest = simulator.posture()
    assert math.degrees(rest.joint_angles[1:12].sum()) == pytest.approx(90.0, abs=1.0)
    across = rest.R_w[-1][:, 0]
    for sign in (1.0, -1.0):
        simulator.set_inputs(row, sign * PRINTED_FLOW_N * across)
        simulator.settle()
        way = (simulator.posture().p_w[-1] - rest.p_w[-1]) @ across
        assert sign * way == pytest.approx(0.13e-3, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_cases_lie_in_their_ranges_and_have_a_way(robot) -> None:
    """Three cases: numbers within bounds, the planned joints reach the target and keep their limits."""
    for seed in range(3):
        case = random_case(robot, np.random.default_rng(seed))
        anatomy = case.plan.anatomy
        for name, (low, high) in ranges(robot).items():
            assert low <= getattr(anatomy, name) <= high, name
        reached = case.plan.base(case.plan.insertion_m) @ tool_frame(robot, case.plan.q)
        assert np.abs(pose_error(case.plan.target, reached)).max() < REACHED
        deep = case.plan.q + np.array([0.0, 0.0, case.plan.below_m, 0.0])
        assert within_limits(robot, deep)


def test_implant_stands_across_the_line_in_both_robots() -> None:
    """The arms' hinges lie on both sides of the coaptation line, just below the free edges."""
    anatomy = median_anatomy()
    _, across = coaptation_axes(anatomy)
    for robot, axis in zip(ROBOTS, (0, 1), strict=True):
        target = target_frame(robot, anatomy)
        assert target[:3, axis] == pytest.approx(across)
        assert target[:3, 2] == pytest.approx(DOWN)
        assert np.linalg.det(target[:3, :3]) == pytest.approx(1.0)
        hinges = hinge_place_m(robot, 1.0)[2] - robot.segments[-1].length_m
        assert target[2, 3] - hinges == pytest.approx(free_edge_z_m(anatomy) - 1.5e-3)


@pytest.mark.slow
def test_the_way_of_the_transseptal_robot_is_the_procedures() -> None:
    """The same plan, to the last bit."""
    robot, anatomy = mitral_transseptal(), median_anatomy()
    assert (plan_way(robot, anatomy).q == plan(robot, anatomy).q).all()


def test_given_numbers_are_kept() -> None:
    """The given one as given, the others drawn as without it."""
    free = random_anatomy(np.random.default_rng(2), ranges(ROBOTS[0]))
    fixed = random_case(ROBOTS[0], np.random.default_rng(2), {"fossa_y_m": 1e-3}).plan.anatomy
    assert fixed == replace(free, fossa_y_m=1e-3)
    assert ranges(ROBOTS[1])["roll_rad"] == CROSSED_ROLL_RAD


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"fossa": 1.0}, "unknown number of the anatomy 'fossa'; choices: atrium_x_m"),
        ({"fossa_y_m": 1.0}, "anatomy: fossa_y_m = 1.0: must be a number in -0.004 to 0.004"),
        ({"fossa_y_m": math.nan}, "fossa_y_m = nan: must be a number"),
        ({"fossa_y_m": "left"}, "fossa_y_m = 'left': must be a number"),
    ],
)
def test_impossible_numbers_are_told_in_a_line(given, told: str) -> None:
    """The name, the value and the range or the choices."""
    with pytest.raises(InputError, match=told):
        random_case(ROBOTS[0], np.random.default_rng(0), given)


def test_no_way_is_planned_for_other_robots() -> None:
    """One line that names those that can."""
    with pytest.raises(InputError, match="joints of mitral_transseptal, mitral_4dof only"):
        plan_way(replace(ROBOTS[0], segments=ROBOTS[0].segments[:3]), median_anatomy())
