"""Make the example `catheter_log`: a tracker's export and a motors' log of a catheter with a hidden fault.

    python scripts/make_catheter_log.py [-o assets/examples/catheter_log]

The robot is simulated with a coupling of 0.15 from its proximal to its distal bending. Two files are
written as two programs would write them: a take of OptiTrack Motive in metres, y up, from an origin of its
own, with noise of 0.08 mm; and the motors' encoders in counts, 4096 a turn, 2048 at rest, on spools of 8
mm. The noise is seeded.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

import catheter_sim as cs
from catheter_sim.tables import replaced_when_whole

ROBOT = "mitral_4dof"
HIDDEN = {"effects.coupling.bending_proximal_to_bending_distal": 0.15}
SPOOL_MM, COUNTS_PER_TURN, REST_COUNTS = 8.0, 4096, 2048
NOISE_MM = 0.08
SEED = 7
ROWS, STEP_S = 240, 0.25
ORIGIN_MM = np.array([-310.0, 1042.0, 265.0])  # of the base in the tracker's frame
HANDLE_M = "-0.310500,1.031200,0.321100"  # a marker that does not move
TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
HEAD = (
    "Format Version,1.23,Take Name,loops,Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global"
    "\n\n"
    + (",," + ",".join(["Marker"] * 6) + "\n,,Handle,Handle,Handle,Tip,Tip,Tip\n,,1,1,1,2,2,2\n")
    + (",," + ",".join(["Position"] * 6) + "\nFrame,Time (Seconds),X,Y,Z,X,Y,Z\n")
)
README = """\
# catheter_log

A tracker's export (`tracker.csv`, OptiTrack Motive, metres, y up) and a log of two motors (`motors.csv`,
encoders in counts) of a mitral-valve catheter with a fault. **Made up**: simulated by
`scripts/make_catheter_log.py` with one hidden fault and noise of 0.08 mm. No real robot was measured.
Which fault it is, `catheter-sim diagnose` is to say. Licence: MIT, as the package.
"""


def main() -> int:
    """Write the example's folder."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, default=Path("assets/examples/catheter_log"))
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    time_s = STEP_S * np.arange(ROWS)
    size = np.select([time_s < 20.0, time_s < 40.0], [0.6, 0.8], 1.0)
    asked = {
        "bending_proximal": 1.6 * size * np.sin(2.0 * np.pi * time_s / 20.0),  # mm
        "bending_distal": 2.4 * size * np.sin(2.0 * np.pi * time_s / 10.0),
    }
    per_mm = COUNTS_PER_TURN / (2.0 * np.pi * SPOOL_MM)
    counts = {name: np.round(REST_COUNTS + per_mm * way).astype(int) for name, way in asked.items()}
    pulls = {f"displacement_{name}_mm": (count - REST_COUNTS) / per_mm for name, count in counts.items()}
    seen = cs.simulate(cs.load_robot(ROBOT, HIDDEN), {"time_s": time_s, **pulls}).to_table(TIP).columns
    noise = np.random.default_rng(SEED)
    x, y, z = (seen[name] + noise.normal(0.0, NOISE_MM, ROWS) for name in TIP)
    tip = (np.stack([x, z, -y], axis=1) + ORIGIN_MM) / 1e3
    with replaced_when_whole(folder / "tracker.csv") as file:
        file.write(HEAD)
        for row, (clock, place) in enumerate(zip(time_s, tip, strict=True)):
            file.write(f"{row},{clock:.3f},{HANDLE_M},{','.join(f'{value:.6f}' for value in place)}\n")
    with replaced_when_whole(folder / "motors.csv") as file:
        file.write(f"time_s,{','.join(f'{name}_encoder' for name in counts)}\n")
        for clock, *turned in zip(time_s, *counts.values(), strict=True):
            file.write(f"{clock:.3f},{','.join(map(str, turned))}\n")
    with replaced_when_whole(folder / "README.md") as file:
        file.write(README)
    print(f"wrote {folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
