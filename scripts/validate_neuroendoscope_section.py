"""Check the simulated neuroendoscope section against theory and print what was found.

A short program to read and copy from: it drives the robot through one loop, asks the simulation and
two static models, and compares. The full set of checks is `catheter-sim validate`.

    python scripts/validate_neuroendoscope_section.py OUTPUT_FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from catheter_sim.catalogue import load_robot
from catheter_sim.simulation.replay import simulate
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.validation.lines import history, largest_distance, tips_mm
from catheter_sim.validation.report import validate


def main() -> int:
    """Compare one loop by hand, then run all checks of the robot."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "results/validation")
    robot = load_robot("neuroendoscope_section")
    no_gravity = np.zeros(3)
    inputs = history([(0, 0), (0.4, 0), (0, 0)], step=0.1)  # right, left tension [N]
    simulated = tips_mm(simulate(robot, inputs, no_gravity).postures)
    for name in ("fkm", "fkm_sliding"):
        analytic = tips_mm(STATIC_MODELS[name].solve(robot, inputs, no_gravity).postures)
        print(f"single tendon, 0 to 0.4 N and back, {name}: {largest_distance(simulated, analytic):.3f} mm")
    validation = validate([robot.name], folder)
    print(validation.table_text())
    return 0 if validation.passed else 1


if __name__ == "__main__":
    sys.exit(main())
