"""Claims about forces at points of a simulated robot's elements."""

from __future__ import annotations

import numpy as np
import pytest
from drive import rows_to_inputs, tips_mm

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import LinkForce
from catheter_sim.errors import InputError
from catheter_sim.robots.rolling.complete import complete
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.validation.chest_tube_full import LINK_FORCES

pytestmark = pytest.mark.slow

NO_GRAVITY = np.zeros(3)


def differences(robot, inputs, forces):
    """Return the largest tip distance [mm] and joint angle difference [deg] from the complete statics."""
    ours = simulate(robot, inputs, NO_GRAVITY, others=forces)
    theirs = complete(robot, inputs, NO_GRAVITY, forces)
    assert ours.at_rest.all()
    far = np.linalg.norm(tips_mm(ours) - tips_mm(theirs), axis=1).max()
    angles = [np.degrees([posture.joint_angles for posture in run.postures]) for run in (ours, theirs)]
    return far, np.abs(angles[0] - angles[1]).max()


@pytest.mark.parametrize("name", LINK_FORCES)
def test_steady_forces_on_links_give_the_complete_balance(name):
    """Off-axis forces in the plane and across it, mu 0: tip within 0.25 mm, joints 0.05 deg."""
    robot = load_robot("chest_tube_section", ("friction.mu=0",))
    far, turned = differences(robot, rows_to_inputs([(0,), (5,), (50,)]), LINK_FORCES[name])
    assert far < 0.25
    assert turned < 0.05
    free = tips_mm(simulate(robot, rows_to_inputs([(5,)]), NO_GRAVITY))
    pushed = tips_mm(simulate(robot, rows_to_inputs([(5,)]), NO_GRAVITY, others=LINK_FORCES[name]))
    assert np.linalg.norm(free - pushed) > 5.0  # they do move the robot


@pytest.mark.parametrize("name", LINK_FORCES)
def test_with_friction_forces_on_links_stay_near_the_history_rule(name):
    """There and back with friction: tip within 1 mm, joints 0.2 deg."""
    rows = rows_to_inputs([(5,), (50,), (20,), (5,)])
    far, turned = differences(load_robot("chest_tube_section"), rows, LINK_FORCES[name])
    assert far < 1.0
    assert turned < 0.2


def test_soft_links_are_stretched_by_forces_beyond_them():
    """Drawn along the axis half way up, the links below lengthen by force over stiffness, none above."""
    robot = load_robot("chest_tube_section@prototype", ("friction.mu=0",))
    rigid = load_robot(
        "chest_tube_section@prototype", ("friction.mu=0", "segments.section.link_modulus_Pa=inf")
    )
    forces = (LinkForce(8, (0.0, 0.0, 7e-3), (0.0, 0.0, 2.0)), LinkForce(8, (0, 0, 1e-3), (0, 0, 1.0)))
    inputs = rows_to_inputs([(0,)])
    tip = tips_mm(simulate(robot, inputs, NO_GRAVITY, others=forces))[0]
    assert tip == pytest.approx(tips_mm(complete(robot, inputs, NO_GRAVITY, forces))[0], abs=1e-3)
    section = np.pi * (3.1**2 - 1.2**2)  # mm^2
    longer = tip[2] - tips_mm(simulate(rigid, inputs, NO_GRAVITY, others=forces))[0, 2]
    assert longer == pytest.approx(8 * 3.0 * 15.0 / (25.0 * section), rel=0.01)


@pytest.mark.parametrize("name", ["chest_tube_section", "neuroendoscope_section"])
def test_a_force_on_the_last_face_is_the_tip_force(name):
    """Whatever the robot, given in the last body's frame: the same posture to 1e-6 mm."""
    robot = load_robot(name)
    tension = np.full(len(robot.tendons), 0.1)
    force = (0.01, 0.0, 0.005)
    plain = Simulator(robot, inertia=False)
    tip = tuple(plain.model.site("tip").pos)
    count = len(plain.posture().p_w)
    tips = []
    for arguments in ({"force_tip": force}, {"others": [LinkForce(count, tip, force)]}):
        simulator = Simulator(robot, inertia=False)
        simulator.set_inputs(tension, **arguments)
        simulator.step(200)
        tips.append(simulator.posture().p_w[-1] * 1e3)
    assert tips[0] == pytest.approx(tips[1], abs=1e-6)
    plain.set_inputs(tension)
    plain.step(200)
    assert np.linalg.norm(plain.posture().p_w[-1] * 1e3 - tips[0]) > 0.1


def test_forces_act_until_the_next_inputs_or_a_reset():
    """Inputs without forces end them; so does a reset, also of tip force and tension."""
    robot = load_robot("chest_tube_section", ("friction.mu=0",))
    simulator = Simulator(robot, inertia=False)
    force = [LinkForce(10, (0.0, 0.0, 0.0), (0.1, 0.0, 0.0))]
    simulator.set_inputs(np.array([0.0]), others=force)
    simulator.settle()
    assert simulator.posture().joint_angles[0] > 0.01
    simulator.set_inputs(np.array([0.0]))
    simulator.settle()
    assert np.abs(simulator.posture().joint_angles).max() < 1e-4
    simulator.set_inputs(np.array([5.0]), force_tip=(0.1, 0, 0), others=force)
    simulator.step(10)
    simulator.reset()
    simulator.step(50)
    assert np.abs(simulator.posture().joint_angles).max() < 1e-9


@pytest.mark.parametrize("link", [0, 16, -1])
def test_unknown_link_ends_in_one_line(link):
    """Simulation and statics name the links that there are."""
    robot, inputs = load_robot("chest_tube_section"), rows_to_inputs([(1,)])
    forces = [LinkForce(link, (0.0, 0.0, 0.0), (0.1, 0.0, 0.0))]
    for solve in (complete, lambda *given: simulate(*given[:3], others=given[3])):
        with pytest.raises(InputError, match=rf"link {link}: the robot's links are 1 to 15"):
            solve(robot, inputs, NO_GRAVITY, forces)
