"""Compare four answers to the chest-tube section's tension: printed, complete, PCC and simulated.

A short program to read and copy from: it pulls the active rod to 50 N and back, asks three static
models and the simulation, and writes tension, tip and joints of each as CSV, and pictures of the tip
and of the joints. The printed balance and PCC know no unloading. The full set of checks is
`catheter-sim validate chest_tube_section`.

    python scripts/validate_chest_tube_section.py [OUTPUT_FOLDER]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import output_table
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table, write_table
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.validation.lines import NO_GRAVITY, history, largest_distance, tips_mm

STATICS = ("printed", "complete", "pcc")
STYLES = {"printed": "C1-", "complete": "C0-", "pcc": "C7:", "simulation": "C0o"}


def main() -> int:
    """Compare one loop; write tables and pictures."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "results/chest_tube_section")
    folder.mkdir(parents=True, exist_ok=True)
    robot = load_robot("chest_tube_section")
    inputs = history([(0,), (50,), (0,)], step=2.5)  # tension of the active rod [N]
    answers = {name: STATIC_MODELS[name].solve(robot, inputs, NO_GRAVITY).postures for name in STATICS}
    answers["simulation"] = simulate(robot, inputs, NO_GRAVITY, progress=True).postures
    tension = inputs.tendon[:, 0]
    for name, postures in answers.items():
        outputs = output_table(robot, inputs.time_s, postures)
        chosen = {key: column for key, column in outputs.columns.items() if key.startswith(("tip", "joint"))}
        table = Table(outputs.time_s, {"tension_active_N": tension, **chosen})
        write_table(table, folder / f"chest_tube_section_{name}.csv")
    for name in STATICS:
        far = largest_distance(tips_mm(answers[name]), tips_mm(answers["simulation"]))
        print(f"0 to 50 N and back, {name}: tip at most {far:.3f} mm from the simulation's")
    figure = Figure(figsize=(10, 4), layout="constrained")
    tip, joints = figure.subplots(1, 2)
    for name, postures in answers.items():
        even = np.degrees([np.median(posture.joint_angles[1::2]) for posture in postures])
        tip.plot(*tips_mm(postures)[:, [0, 2]].T, STYLES[name], ms=3, label=name)
        joints.plot(tension, even, STYLES[name], ms=3)
    tip.set(xlabel="tip x [mm]", ylabel="tip z [mm]", aspect="equal")
    joints.set(xlabel="tension of the active rod [N]", ylabel="bend of the even joints, median [deg]")
    tip.legend(frameon=False)
    figure.savefig(folder / "chest_tube_section_comparison.png", dpi=130)
    return 0


if __name__ == "__main__":
    sys.exit(main())
