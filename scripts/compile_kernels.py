"""Compile the numerical kernels once, so that what runs next, in several processes, finds them on disk.

    python scripts/compile_kernels.py

One short series of inputs goes through the static models, the twins and the simulation, held and moving;
copies of three robots and a robot in tissue take a few steps.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import gymnasium
import numpy as np

import catheter_sim  # noqa: F401 - registers the environments
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.mechanics.eight import LANES
from catheter_sim.simulation.replay import simulate
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.twins import twin_for

STATICS = {
    "spacer_disk": ("CC", "CC_sub", "PRB", "polynomial", "VC", "VC_ref"),
    "neuroendoscope_section": ("fkm_exact_arm", "fkm_sliding"),
    "chest_tube_section": ("complete",),
    "mitral_transseptal": ("pk", "balance"),
}
DISPLACED = ("spacer_disk",)  # whose static models take displacements too
TWINS = ("neuroendoscope",)  # two sections: friction by another kernel than a single one's
SIMULATED = (
    ("chest_tube_section@prototype", ()),  # links that are compressed
    ("mitral_4dof@elongation", ()),  # the printed laws of joints
    ("spacer_disk", ("friction.mu=0.1",)),  # friction in space
)
NESTED = "neuroendoscope_section"  # by the reference of friction
MOVING = ("neuroendoscope_section", "chest_tube_section")  # friction and rolling contacts in motion
COPIES = ("NeuroendoscopeSectionReach", "ChestTubeSectionReach", "Mitral4dofReach")
IN_TISSUE = "NeuroendoscopeTumour"
STRAIGHT_ON = (0.0, 0.0, 0.0, 0.0, 1.0, 0.0)  # slack tendons, the base pushed on
TISSUE_STEPS = 40  # at most; before these the robot touches
GRAVITY = np.zeros(3)


def far_apart(robot: RobotSpec) -> Inputs:
    """Return so many rows, far from one another, that static models solve them eight at once."""
    tendon = np.zeros((2 * LANES, len(robot.tendons)))
    tendon[1::2, 0] = 5.0
    rows = len(tendon)
    return Inputs(np.arange(float(rows)), "tension", tendon, np.zeros((rows, 3)), np.zeros((rows, 3)))


def short(robot: RobotSpec, actuation: str | None = None) -> Inputs:
    """Return two rows: rest, and a small pull of the first channel."""
    actuation = actuation or robot.actuation
    tendon = np.zeros((2, len(robot.tendons)))
    tendon[1, 0] = 0.05 if actuation == "tension" else 1e-4
    return Inputs(np.array([0.0, 1.0]), actuation, tendon, np.zeros((2, 3)), np.zeros((2, 3)))


def follow(robot: RobotSpec) -> None:
    """Run the robot's twin over two rows."""
    twin_for(robot, robot.actuation, ["tip_x_mm", "tip_z_mm"], GRAVITY)([robot], short(robot), 1)


def touch() -> None:
    """Push a robot on until it touches tissue."""
    env = gymnasium.make(f"catheter_sim/{IN_TISSUE}-v0")
    env.reset(seed=0)
    for _ in range(TISSUE_STEPS):
        _, _, _, _, info = env.step(np.array(STRAIGHT_ON, np.float32))
        if any(info["peak_force_N"].values()):
            break
    env.close()


def main() -> int:
    """Compile; return the exit status."""
    for name, models in STATICS.items():
        robot = load_robot(name)
        for model in models:
            STATIC_MODELS[model].solve(robot, short(robot), GRAVITY)
            if name in DISPLACED:
                STATIC_MODELS[model].solve(robot, far_apart(robot), GRAVITY)
                STATIC_MODELS[model].solve(robot, short(robot, "displacement"), GRAVITY)
        follow(robot)
        simulate(robot, short(robot), GRAVITY)
    for name in TWINS:
        follow(load_robot(name))
    for name, settings in SIMULATED:
        robot = load_robot(name, settings)
        simulate(robot, short(robot), GRAVITY)
    for name in MOVING:
        robot = load_robot(name)
        moving = short(robot)
        simulate(robot, replace(moving, time_s=0.01 * moving.time_s), GRAVITY, dynamic=True)
    robot = load_robot(NESTED)
    simulate(robot, short(robot), GRAVITY, friction="nested")
    for name in COPIES:
        envs = gymnasium.make_vec(f"catheter_sim/{name}-v0", 2, vectorization_mode="vector_entry_point")
        envs.reset(seed=0)
        envs.step(np.zeros(envs.action_space.shape, np.float32))
        envs.close()
    touch()
    return 0


if __name__ == "__main__":
    sys.exit(main())
