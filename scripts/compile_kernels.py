"""Compile the numerical kernels once, so that what runs next, in several processes, finds them on disk.

    python scripts/compile_kernels.py

One short series of inputs goes through the static models, the twins and the simulation that use them.
"""

from __future__ import annotations

import sys

import numpy as np

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
    return 0


if __name__ == "__main__":
    sys.exit(main())
