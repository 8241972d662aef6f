"""The chain of hinges as a rod in space."""

from __future__ import annotations

import math

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import LinkForce
from catheter_sim.errors import InputError
from catheter_sim.robots.rolling.complete import loads
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.validation.rod import LENGTH_M, POISSON, RADIUS_M, YOUNG_PA, rod_cases, tpu_rod

BENDING = YOUNG_PA * math.pi / 4.0 * RADIUS_M**4


def rested(simulator: Simulator, moment, others=()):
    simulator.reset()
    simulator.set_inputs(np.zeros(0), (0.0, 0.0, 0.0), moment, others)
    simulator.settle(60.0)
    return simulator.posture()


@pytest.fixture(scope="module")
def simulator() -> Simulator:
    return Simulator(tpu_rod(20), inertia=False)


@pytest.mark.parametrize("direction_deg", [0.0, 30.0, 45.0, 200.0])
def test_a_moment_across_bends_to_an_arc_without_twist(simulator: Simulator, direction_deg: float) -> None:
    """Bent by 90 deg in any direction the tip lies on the circle, and is turned about the moment alone.

    With hinges x before y in every link the tip would be twisted by 2 deg at 45 deg.
    """
    bend = math.pi / 2.0
    axis = np.array([math.cos(math.radians(direction_deg)), math.sin(math.radians(direction_deg)), 0.0])
    posture = rested(simulator, BENDING * bend / LENGTH_M * axis)
    toward = np.cross(axis, [0.0, 0.0, 1.0])
    arc = LENGTH_M / bend * ((1.0 - math.cos(bend)) * toward + math.sin(bend) * np.array([0.0, 0.0, 1.0]))
    assert np.linalg.norm(posture.p_w[-1] - arc) < 1e-3 * LENGTH_M
    K = np.array([[0.0, 0.0, axis[1]], [0.0, 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    expected = np.eye(3) + math.sin(bend) * K + (1.0 - math.cos(bend)) * (K @ K)
    left = expected.T @ posture.R_w[-1]
    turned = math.degrees(math.acos(min(1.0, 0.5 * (float(np.trace(left)) - 1.0))))
    assert turned < 0.2


def test_a_moment_along_twists_by_theory(simulator: Simulator) -> None:
    """A straight rod under a torque turns by M L / GJ and stays straight."""
    torque = 0.02
    posture = rested(simulator, (0.0, 0.0, torque))
    assert posture.p_w[-1] == pytest.approx((0.0, 0.0, LENGTH_M), abs=1e-9)
    turn = math.atan2(posture.R_w[-1][1, 0], posture.R_w[-1][0, 0])
    assert turn == pytest.approx(torque * LENGTH_M * (1.0 + POISSON) / BENDING, rel=1e-4)


def test_a_moment_on_the_last_element_is_one_on_the_tip(simulator: Simulator) -> None:
    """A moment given to the last element, or to the tip, bends the rod alike; on one halfway, only half."""
    moment = (0.03, -0.02, 0.01)
    tip = rested(simulator, moment).p_w
    zero = (0.0, 0.0, 0.0)
    assert rested(simulator, zero, [LinkForce(20, zero, zero, moment)]).p_w == pytest.approx(tip, abs=1e-7)
    half = rested(simulator, zero, [LinkForce(10, zero, zero, moment)])
    assert half.R_w[-1] == pytest.approx(half.R_w[9], abs=1e-6)
    assert half.p_w[:10] == pytest.approx(tip[:10], abs=1e-6)


def test_statics_of_rolling_joints_refuse_a_moment_on_a_link() -> None:
    """They carry moments at the tip only, and say so."""
    robot = load_robot("chest_tube_section")
    zero = (0.0, 0.0, 0.0)
    with pytest.raises(InputError, match="moment on link 3"):
        loads(rolling_chain(robot), np.zeros(3), others=[LinkForce(3, zero, zero, (0.1, 0.0, 0.0))])  # type: ignore[arg-type]


def test_cases_are_those_of_the_file() -> None:
    """500 shapes of 14 stations from the clamped end to 0.4 m, in the base frame: along +z at first."""
    cases = rod_cases(100)
    assert len(cases) == 5
    for case in cases:
        assert case.places[[0, -1]] == pytest.approx((0.0, LENGTH_M))
        assert case.points[0] == pytest.approx((0.0, 0.0, 0.0))
        assert case.points[1, 2] == pytest.approx(case.places[1], rel=0.02)
