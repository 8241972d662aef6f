"""Make the example `worn_catheter`: a catheter with play in its drive, as a motion capture system saw it.

    python scripts/make_worn_catheter.py [-o assets/examples/worn_catheter]

The robot is simulated with a dead-band of 0.4 mm; what is written is what a tracker and a motor log would
hold: epoch stamps, motors in degrees on spools of 10 mm, positions in metres in a frame whose y axis points
up, with noise of 0.05 mm. The draw of the noise is seeded.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import numpy as np

import catheter_sim as cs
from catheter_sim.tables import replaced_when_whole

ROBOT = "mitral_transseptal"
WIDTH_MM = 0.4  # of the dead-band, hidden
SPOOL_MM = 10.0
NOISE_MM = 0.05
SEED = 5
ROWS = 40
ORIGIN_MM = np.array([412.0, -87.0, 950.0])  # of the base in the tracker's frame
TRIALS = ((1.6, 0.5), (2.0, 0.8), (2.4, 0.3))  # most bending and most torsion [mm]
HEADER = ("timestamp", "motor_bending_deg", "motor_torsion_proximal_deg", "tool_x", "tool_y", "tool_z")
TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
README = """\
# worn_catheter

Three takes of a mitral-valve catheter whose drive is worn, as a tracker and its motors' log would write them:
epoch stamps in seconds, motors in degrees (spools of 10 mm), the tool's position in metres, y up.
**Made up**: simulated by `scripts/make_worn_catheter.py` with one hidden fault and noise of 0.05 mm. No real
robot was measured. Which fault it is, `catheter-sim diagnose` is to say. Licence: MIT, as the package.
"""


def main() -> int:
    """Write the example's folder."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, default=Path("assets/examples/worn_catheter"))
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    noise = np.random.default_rng(SEED)
    worn = cs.load_robot(ROBOT, {"effects.backlash.width_mm": WIDTH_MM})
    clock = np.arange(float(ROWS))
    for number, (bending, torsion) in enumerate(TRIALS, start=1):
        pulls = {
            "displacement_bending_mm": bending * np.sin(0.42 * clock),
            "displacement_torsion_proximal_mm": torsion * np.sin(0.23 * clock),
        }
        seen = cs.simulate(worn, {"time_s": clock, **pulls}).to_table(TIP).columns
        x, y, z = (seen[name] + noise.normal(0.0, NOISE_MM, ROWS) for name in TIP)
        tool = (np.stack([x, z, -y], axis=1) + ORIGIN_MM) / 1e3
        motors = [np.degrees(pull / SPOOL_MM) for pull in pulls.values()]
        with replaced_when_whole(folder / f"take_{number}.csv") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(HEADER)
            for row in range(ROWS):
                stamp = f"{1731000000.25 + 100.0 * number + 0.5 * clock[row]:.3f}"
                angles = (f"{motor[row]:.4f}" for motor in motors)
                writer.writerow([stamp, *angles, *(f"{value:.7f}" for value in tool[row])])
    with replaced_when_whole(folder / "README.md") as file:
        file.write(README)
    print(f"wrote {folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
