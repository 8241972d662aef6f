"""Claims about tissue's springs: forces that statics asks for, whatever the stiffness and the robot."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.envs.surroundings import let_touch
from catheter_sim.mjcf.document import read
from catheter_sim.modelling.attach import INSERTION, ROLL, carry, touched
from catheter_sim.modelling.build import remembered_mjcf
from catheter_sim.simulation.simulator import Simulator

TOWARD_M = 2e-3  # of the wall's surface from the straight robot's


def before_a_wall(name: str, stiffness: float, ahead: bool = False) -> Simulator:
    """Return a robot without friction beside a wall, at +x, or before one at its tip."""
    robot = load_robot(name, ["friction.mu=0"])
    root = read(remembered_mjcf(robot))
    carry(root, robot.dynamics, np.eye(4), roll=True)
    world = root.part("worldbody")
    let_touch(robot, world)
    length = sum(segment.length_m for segment in robot.segments)
    radius = robot.segments[-1].outer_radius_m
    place = f"0 0 {length + radius + TOWARD_M + 0.1}" if ahead else f"{radius + TOWARD_M + 0.1} 0 0"
    size = "0.5 0.5 0.1" if ahead else "0.1 0.5 0.5"
    touched(world, name="tissue_wall_0", type="box", size=size, pos=place, margin="5e-4")
    return Simulator(robot, inertia=False, model_text=root.text(), tissue_N_per_m={"wall": stiffness})


def pressed(simulator: Simulator, force: tuple[float, float, float]) -> Simulator:
    """Push the tip with a force, slowly, and wait."""
    for step in range(500):
        simulator.set_inputs(np.zeros(len(simulator.robot.tendons)), np.array(force) * min(1.0, step / 300.0))
        simulator.step()
    assert simulator.settle()
    return simulator


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "stiffness", "force_N"),
    [
        ("neuroendoscope", 25.0, 0.01),
        pytest.param("neuroendoscope", 1e4, 0.01, marks=pytest.mark.slow),
        ("chest_tube", 500.0, 0.5),
    ],
)
def test_wall_bears_what_the_tip_is_pushed_with(name: str, stiffness: float, force_N: float) -> None:
    """A soft robot's tip, pushed against a wall beside it: the wall's force is the tip's, less what bends the
    robot by the gap, and is stiffness times depth, from soft tissue to a wall 1e5 times as stiff as the
    robot. The bending share is measured by the same robot without the wall, one part in ten thousand of it.
    """
    alone, held = before_a_wall(name, stiffness), before_a_wall(name, stiffness)
    small = 1e-4 * force_N
    deflection = float(pressed(alone, (small, 0.0, 0.0)).data.site("tip").xpos[0])
    pressed(held, (force_N, 0.0, 0.0))
    assert held.tissue is not None
    felt = float(held.tissue.force_N[0])
    depth = max(-float(contact.dist) for contact in held.data.contact)
    moved = float(held.data.site("tip").xpos[0])
    assert alone.tissue is not None
    assert alone.tissue.force_N[0] == 0.0
    deepest: dict[int, float] = {}  # of each part of the robot: a capsule has two contacts with a face
    for contact in held.data.contact:
        touching = int(max(contact.geom))
        deepest[touching] = max(deepest.get(touching, 0.0), -float(contact.dist))
    assert felt == pytest.approx(stiffness * sum(deepest.values()), rel=1e-4)
    assert depth == pytest.approx(moved - TOWARD_M, rel=0.05, abs=2e-6)
    assert felt == pytest.approx(force_N - small * moved / deflection, rel=0.02)


@pytest.mark.slow
def test_wall_ahead_bears_what_the_insertion_pushes_with() -> None:
    """Pushed straight on: the force on the wall is the force of the insertion's drive, to 0.1 %."""
    simulator = before_a_wall("neuroendoscope", 25.0, ahead=True)
    simulator.data.actuator(INSERTION).ctrl = TOWARD_M + 0.1e-3
    simulator.step(300)
    assert simulator.tissue is not None
    felt = float(simulator.tissue.force_N[0])
    assert felt == pytest.approx(25.0 * 0.1e-3, rel=1e-2)
    assert felt == pytest.approx(float(simulator.data.actuator(INSERTION).force[0]), rel=1e-3)
    assert float(simulator.tissue.peak_N[0]) >= felt


@pytest.mark.slow
def test_without_contact_surroundings_change_nothing() -> None:
    """Far from the wall, rolled and pushed on, the robot stands in its base's frame as it does alone."""
    ours = before_a_wall("neuroendoscope", 25.0)
    alone = Simulator(load_robot("neuroendoscope", ["friction.mu=0"]), inertia=False)
    pull = np.zeros(len(alone.robot.tendons))
    pull[1] = 0.1  # away from the wall
    for simulator in (ours, alone):
        simulator.set_inputs(pull)
        simulator.step(400)
    assert ours.data.site("tip").xpos == pytest.approx(alone.data.site("tip").xpos, abs=1e-7)
    ours.data.actuator(INSERTION).ctrl, ours.data.actuator(ROLL).ctrl = 0.02, 0.5
    ours.step(400)
    x, _, z = alone.data.site("tip").xpos
    wanted = (x * np.cos(0.5), x * np.sin(0.5), z + 0.02)
    assert ours.data.site("tip").xpos == pytest.approx(wanted, abs=1e-5)


@pytest.mark.slow
def test_step_with_tissue_is_mujocos_own_where_nothing_presses() -> None:
    """A contact that is known but does not press yet leaves the step as MuJoCo makes it, to rounding."""
    ours, theirs = before_a_wall("neuroendoscope", 25.0), before_a_wall("neuroendoscope", 25.0)
    theirs.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    small = pressed(before_a_wall("neuroendoscope", 25.0), (1e-5, 0.0, 0.0)).data.site("tip").xpos[0]
    force = 1e-5 * (TOWARD_M - 0.2e-3) / small
    for simulator in (ours, theirs):
        pressed(simulator, (force, 0.0, 0.0))
    assert ours.data.ncon > 0
    assert theirs.data.ncon == 0
    assert ours.tissue is not None
    assert ours.tissue.peak_N[0] == 0.0
    assert ours.data.qpos == pytest.approx(theirs.data.qpos, abs=1e-9)
