"""Compile the numerical kernels once, so that what runs next, in several processes, finds them on disk.

    python scripts/compile_kernels.py

One short series of inputs goes through the static models, the twins and the simulation that use them; copies
of three robots and a robot in tissue take a few steps.
"""

from __future__ import annotations

import sys

import gymnasium
import numpy as np

import catheter_sim  # noqa: F401 - registers the environments
from catheter_sim.diagnosis.twin import twin_for
from catheter_sim.robots.catalogue import load_robot
from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.kinds import Robot
from catheter_sim.simulation.replay import simulate
from catheter_sim.statics.models import STATIC_MODELS

STATICS = {
    "spacer_disk": ("CC", "CC_sub", "PRB", "VC", "VC_ref"),
    "neuroendoscope_section": ("fkm_exact_arm", "fkm_sliding"),
    "chest_tube_section": ("complete",),
    "mitral_transseptal": ("pk", "balance"),
}
COPIES = ("NeuroendoscopeSectionReach", "ChestTubeSectionReach", "Mitral4dofReach")
IN_TISSUE = "NeuroendoscopeTumour"
TISSUE_STEPS = 5  # until the robot touches
GRAVITY = np.zeros(3)


def short(robot: Robot) -> Inputs:
    """Return two rows: rest, and a small pull of the first channel."""
    tendon = np.zeros((2, len(robot.tendons)))
    tendon[1, 0] = 0.05 if robot.actuation == "tension" else 1e-4
    return Inputs(np.array([0.0, 1.0]), robot.actuation, tendon, np.zeros((2, 3)), np.zeros((2, 3)))


def main() -> int:
    """Compile; return the exit status."""
    for name, models in STATICS.items():
        robot = load_robot(name)
        for model in models:
            STATIC_MODELS[model].solve(robot, short(robot), GRAVITY)
        twin_for(robot, robot.actuation, ["tip_x_mm", "tip_z_mm"], GRAVITY)([robot], short(robot), 1)
        simulate(robot, short(robot), GRAVITY)
    for name in COPIES:
        envs = gymnasium.make_vec(f"catheter_sim/{name}-v0", 2, vectorization_mode="vector_entry_point")
        envs.reset(seed=0)
        envs.step(np.zeros(envs.action_space.shape, np.float32))
        envs.close()
    env = gymnasium.make(f"catheter_sim/{IN_TISSUE}-v0")
    env.reset(seed=0)
    for _ in range(TISSUE_STEPS):
        env.step(np.ones(env.action_space.shape, np.float32))
    env.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
