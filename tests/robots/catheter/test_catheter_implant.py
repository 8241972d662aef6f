"""Claims about the implant that opens."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots.catheter.picture import (
    ACTUATOR,
    ARMS,
    COUPLING_N_M_PER_RAD,
    OPEN_RAD,
    SERVO_N_M_PER_RAD,
    arm_mesh,
)
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.simulator import Simulator

ROBOTS = ("mitral_transseptal", "mitral_4dof")


def simulator(name: str) -> Simulator:
    robot = load_robot(name)
    assert isinstance(robot, CatheterRobot)
    return Simulator(robot, inertia=False)


def arms_rad(simulation: Simulator) -> list[float]:
    return [float(simulation.data.joint(name).qpos[0]) for name in ARMS]


@pytest.mark.parametrize("name", ROBOTS)
def test_implant_opens_to_its_angle_holds_it_and_closes(name: str) -> None:
    """Both arms at the stated angle after two seconds, the same after three more, and back at zero."""
    simulation = simulator(name)
    simulation.data.actuator(ACTUATOR).ctrl = 1.0
    for count in (400, 600):
        simulation.step(count)
        assert arms_rad(simulation) == pytest.approx([OPEN_RAD] * 2, abs=1e-6)
    simulation.data.actuator(ACTUATOR).ctrl = 0.0
    simulation.step(400)
    assert arms_rad(simulation) == pytest.approx([0.0, 0.0], abs=1e-6)


@pytest.mark.parametrize("name", ROBOTS)
def test_arms_open_away_from_the_post_and_backward(name: str) -> None:
    """The free ends move outward along the tool's x, symmetrically, and stay behind the hinges."""
    model = mujoco.MjModel.from_xml_string(build_mjcf(load_robot(name)))
    data = mujoco.MjData(model)
    ends = []
    for angle in (0.0, OPEN_RAD):
        for arm in ARMS:
            data.qpos[model.joint(arm).qposadr[0]] = angle
        mujoco.mj_forward(model, data)
        ends.append([data.body(arm).xmat.reshape(3, 3) @ (0.0, 0.0, -7e-3) for arm in ARMS])
    (closed_pos, closed_neg), (pos, neg) = ends
    assert closed_pos == pytest.approx(closed_neg, abs=1e-12)
    assert pos == pytest.approx((-neg[0], neg[1], neg[2]), abs=1e-12)
    assert pos[0] == pytest.approx(7e-3 * np.sin(OPEN_RAD), abs=1e-9)
    assert pos[2] < 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_opening_moves_nothing_else(name: str) -> None:
    """Step by step the same tip to 0.1 nm, and tensions to 0.01 mN, whether it opens or not."""
    closed, opened = simulator(name), simulator(name)
    opened.data.actuator(ACTUATOR).ctrl = 1.0
    for _ in range(100):
        for simulation in (closed, opened):
            simulation.set_inputs(np.array([2.0, 1.0, -1.0, 25.0]) * 1e-3)
            simulation.step(2)
    assert arms_rad(opened)[0] > 0.9 * OPEN_RAD
    assert opened.posture().p_w == pytest.approx(closed.posture().p_w, abs=1e-10)
    assert opened.actuator_tension() == pytest.approx(closed.actuator_tension(), abs=1e-5)


@pytest.mark.parametrize("name", ROBOTS)
def test_actuator_is_the_last_and_pinches_as_stated(name: str) -> None:
    """Appended after the drives; an arm held open by moments on both needs the servo's stiffness."""
    simulation = simulator(name)
    model, data = simulation.model, simulation.data
    assert model.actuator(model.nu - 1).name == ACTUATOR
    assert model.actuator(ACTUATOR).ctrlrange == pytest.approx((0.0, 1.0))
    moment = 0.1 * SERVO_N_M_PER_RAD  # in all; the second arm's passes through the spring to the first
    first, second = (model.joint(name).dofadr[0] for name in ARMS)
    for _ in range(800):
        mujoco.mj_step1(model, data)
        data.qfrc_applied[[first, second]] = 0.5 * moment
        mujoco.mj_step2(model, data)
    found = arms_rad(simulation)
    assert found == pytest.approx([0.1, 0.1 + 0.5 * moment / COUPLING_N_M_PER_RAD], abs=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_arms_are_solids(side: float) -> None:
    """Watertight and facing outward on both sides."""
    mesh = arm_mesh(2.85e-3, side)
    assert mesh.is_watertight
    assert mesh.volume > 0.0
    assert (side * mesh.centroid[0]) > 0.0
