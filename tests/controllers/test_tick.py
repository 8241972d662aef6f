"""Claims about what a control loop is made of, without running one: ways, shares, the motor's load."""

from __future__ import annotations

import math

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.controllers import loop, motors
from catheter_sim.controllers.loop import through, ticks_s
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.simulator import Simulator


def test_a_leg_is_half_a_wave_from_corner_to_corner() -> None:
    """0 to 3 in 2 s, on to -1 in 5 s: halfway in the middle of each leg, at rest at its ends."""
    ticks = ticks_s(10.0, 100.0)
    values = through((0.0, 3.0, -1.0), (2.0, 5.0), ticks)
    assert values[[0, 100, 200, 450, 700, 1000]] == pytest.approx([0.0, 1.5, 3.0, 1.0, -1.0, -1.0])
    quarter = 3.0 * 0.5 * (1.0 - math.cos(math.pi / 4.0))
    assert values[50] == pytest.approx(quarter)
    speed = np.diff(values)
    assert np.abs(speed[[0, 199, 200, 699]]).max() < 1e-3


def test_errors_and_shares_of_a_made_up_run() -> None:
    """Errors of 3 and 4 deg: sqrt(12.5) deg; the controller's 1 mm beside the model's 3 mm: a quarter."""
    desired = np.radians([[3.0, 0.0], [-4.0, 0.0]])
    model_m, controller_m = np.array([[3e-3, 0.0], [-3e-3, 0.0]]), np.array([[-1e-3, 0.0], [1e-3, 0.0]])
    run = loop.ControlRun(
        "made", ("bending", "prismatic"), np.arange(2) / 40.0, desired, np.zeros((2, 2)), model_m,
        controller_m, model_m + controller_m,
    )  # fmt: skip
    assert run.rmse_deg()[0] == pytest.approx(math.sqrt(12.5))
    assert math.isnan(run.rmse_deg()[1])
    assert run.controller_share()[0] == pytest.approx(0.25)
    assert math.isnan(run.controller_share()[1])


@pytest.mark.parametrize("bend_deg", [10.0, 25.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_motor_feels_the_tension_of_where_the_joint_is_now(bend_deg: float, side: float) -> None:
    """Pulley radius times k (d - Eq. 3 at the present bend), whatever the last step found."""
    robot = load_robot("mitral_transseptal", ("tendons.bending.stiffness_N_per_mm=20",))
    assert isinstance(robot, CatheterRobot)
    simulator = Simulator(robot)
    segment = robot.segments[1]
    gaps = segment.rings + 1
    way = side * 2e-3
    simulator.set_inputs(np.array([way, 0.0, 0.0, 0.0]))
    simulator.step(2)
    for gap in range(1, gaps + 1):
        joint = simulator.model.joint(f"{segment.name}_{gap}")
        simulator.data.qpos[joint.qposadr[0]] = side * math.radians(bend_deg) / gaps
    phi = math.radians(bend_deg) / (2 * gaps)
    drawn = 2 * gaps * (segment.half_gap_m * (1.0 - math.cos(phi)) + segment.arm_m * math.sin(phi))
    expected = side * motors.PULLEY_RADIUS_M * 20e3 * (2e-3 - drawn)
    assert loop._load_Nm(simulator, 0, way) == pytest.approx(expected, rel=1e-3)
