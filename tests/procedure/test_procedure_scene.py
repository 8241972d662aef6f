"""Claims about the robot in the anatomy: the model, the wall's springs, the frames."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from catheter_sim.modelling.attach import INSERTION
from catheter_sim.procedure.heart import depth_m, median_anatomy
from catheter_sim.procedure.operate import Contacts, Scene, build_scene
from catheter_sim.procedure.plan import plan
from catheter_sim.robots.catheter.picture import ACTUATOR
from catheter_sim.robots.catheter.published import mitral_transseptal
from catheter_sim.simulation.simulator import Simulator

ROBOT = mitral_transseptal()


@pytest.fixture(scope="module")
def scene() -> Scene:
    return build_scene(ROBOT, plan(ROBOT, median_anatomy()))


def simulated(scene: Scene) -> Simulator:
    return Simulator(ROBOT, inertia=False, model_text=scene.text)


@pytest.mark.slow
def test_robots_actuators_come_first_and_insertion_last(scene: Scene) -> None:
    """The order that the simulator relies on; one slide in front of the robot; robot's own joints kept."""
    model = mujoco.MjModel.from_xml_string(scene.text)
    alone = Simulator(ROBOT).model
    names = [model.actuator(k).name for k in range(model.nu)]
    assert names == [*(alone.actuator(k).name for k in range(alone.nu)), INSERTION]
    assert names[-2] == ACTUATOR
    joints = {model.joint(k).name for k in range(model.njnt)}
    assert {alone.joint(k).name for k in range(alone.njnt)} < joints


def test_robot_waits_outside_and_goes_in_where_it_is_planned(scene: Scene) -> None:
    """Outside the septum nothing touches; the base follows the sheath to the insertion that is asked."""
    simulation = simulated(scene)
    base = scene.plan.base(scene.waiting_m)
    tip = simulation.data.site("tip").xpos
    length = sum(segment.length_m for segment in ROBOT.segments)
    assert tip == pytest.approx(base[:3, 3] + length * base[:3, 2], abs=1e-9)
    assert simulation.data.ncon == 0
    assert depth_m(scene.plan.anatomy, tip) < 0.0
    for step in range(1, 301):
        simulation.data.actuator(INSERTION).ctrl = 0.03 * step / 300
        simulation.step()
    simulation.step(100)
    moved = simulation.data.site("tip").xpos - (base[:3, 3] + length * base[:3, 2])
    assert moved == pytest.approx(0.03 * base[:3, 2], abs=1e-6)
    assert simulation.data.ncon == 0  # the hole is wide enough


@pytest.mark.slow
def test_robot_moves_in_the_scene_as_alone(scene: Scene) -> None:
    """In the base's frame the tip lies where the robot by itself has it, to a nanometre."""
    ours, alone = simulated(scene), Simulator(ROBOT, inertia=False)
    row = np.array([1.0, 0.8, -0.5, 10.0]) * 1e-3
    for simulation in (ours, alone):
        simulation.set_inputs(row)
        simulation.step(400)
    base = scene.plan.base(scene.waiting_m)
    place = base[:3, :3].T @ (ours.data.site("tip").xpos - base[:3, 3])
    assert place == pytest.approx(alone.data.site("tip").xpos, abs=1e-9)


@pytest.mark.parametrize("stiffness", [100.0, 200.0])
def test_wall_presses_back_with_its_stiffness(scene: Scene, stiffness: float) -> None:
    """The straight robot, pushed against the opposite wall: depth times stiffness for each part of it, and
    in equilibrium just what the insertion's drive has to push with: two ways to one force, to 1 %.
    """
    simulation = simulated(scene)
    contacts = Contacts(simulation.model, simulation.data, stiffness)
    end = scene.plan.straight_m + 4.5e-3 - scene.waiting_m
    for step in range(700):
        simulation.data.actuator(INSERTION).ctrl = end * min(1.0, step / 500)
        felt = contacts.push_back()
        simulation.step()
    assert felt.wall_N > 0.01
    model, data = simulation.model, simulation.data
    depth = {}
    for contact in data.contact:
        names = [model.geom(geom).name for geom in contact.geom]
        part = next(name for name in names if name.startswith("touch_"))
        depth[part] = max(depth.get(part, 0.0), -float(contact.dist))
    assert felt.wall_N == pytest.approx(stiffness * sum(depth.values()), rel=1e-3)
    forces = data.xfrc_applied[:, :3].sum(axis=0)
    driven = float(data.actuator(INSERTION).force[0])
    assert driven == pytest.approx(-forces @ scene.plan.direction, rel=0.01)
    assert depth_m(scene.plan.anatomy, felt.place) == pytest.approx(0.0, abs=2e-3)
