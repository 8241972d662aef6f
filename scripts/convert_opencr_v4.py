"""Turn the published measurements of the OpenCR v4 robot into a data set that `diagnose` reads.

    python scripts/convert_opencr_v4.py SOURCE_FOLDER [-o assets/examples/opencr_v4]

SOURCE_FOLDER holds, from github.com/ContinuumRoboticsLab/opencr-mujoco (MIT), commit 17fff8b:
`tdcr_sysid_20260511-183002_train.csv`, `..._val.csv` (from data/sysid/ftdcr_v4),
`params_ftdcr_v4_sysid.json` (configs/generation/ftdcr_v4_sysid.json) and `LICENSE`. Written are
dataset.toml, train.csv, val.csv, opencr_v4.toml, LICENSE and README.md. Numbers are copied as text,
so that none changes in its last digit.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import sys
from decimal import Decimal
from pathlib import Path
from typing import Any

from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.errors import InputError
from catheter_sim.tables import replaced_when_whole

RECORDING = "tdcr_sysid_20260511-183002"
PARAMETERS = "params_ftdcr_v4_sysid.json"
SEGMENTS = ("base", "middle", "tip")
SERVOS = ((4, 3, 9), (5, 2, 8), (6, 1, 7))  # per segment; the pull labels "tendon<k>_id<servo>"
SOURCE = "ContinuumRoboticsLab/opencr-mujoco, commit 17fff8b"
DEFAULT_OUTPUT = Path(__file__).resolve().parent.parent / "assets" / "examples" / "opencr_v4"


def tendon_names() -> list[str]:
    """Return the nine tendons' names in the order of the published columns."""
    return [f"{segment}_{k}" for segment in SEGMENTS for k in (1, 2, 3)]


def convert_series(source: Path, target: Path) -> int:
    """Write the published series `source` as `target`; return its number of rows."""
    servos = [f"servo_{servo}_mm" for triple in SERVOS for servo in triple]
    expected = ["timestamp", "pattern_label", *servos, "tip_x", "tip_y", "tip_z"]
    try:
        with source.open(newline="", encoding="utf-8") as file:
            header, *rows = list(csv.reader(file))
    except (OSError, ValueError) as error:
        raise InputError(f"{source}: cannot be read: {error}") from None
    if header != expected:
        raise InputError(f"{source}: line 1: the columns must be {', '.join(expected)}")
    start = Decimal(rows[0][0])
    with replaced_when_whole(target) as file:
        writer = csv.writer(file, lineterminator="\n")
        inputs = [f"displacement_{name}_mm" for name in tendon_names()]
        writer.writerow(["time_s", *inputs, "tip_x_mm", "tip_y_mm", "tip_z_mm"])
        for timestamp, _, *values in rows:
            writer.writerow([str(Decimal(timestamp) - start), *values])
    return len(rows)


def robot_text(parameters: dict[str, Any]) -> str:
    """Return the robot's `.toml` from the authors' generation settings."""
    material = parameters["material_properties"]
    radius_m = material["outer_radius"]
    bending = material["youngs_modulus"] * math.pi / 4.0 * radius_m**4 * 1e6  # N mm^2
    actuator = parameters["actuator_properties"]
    lines = [
        "# The OpenCR v4 robot, three segments and nine tendons, from its authors' generation settings.",
        f"# Made by scripts/convert_opencr_v4.py from {PARAMETERS}",
        f"# ({SOURCE}, MIT). Change the script, not this file.",
        "# Units are in the names. Positive displacement pulls a tendon.",
        "",
        'name = "opencr_v4"',
        'description = "three-segment, nine-tendon continuum robot, 186.5 mm (OpenCR v4, measured)"',
        'actuation = "displacement"',
        'appearance = "spacer_disks"',
        "channel_radius_mm = 0.0",
        "stiffness_scale = 1.0",
        "links_per_subsegment = 1",
        "disks_per_segment = 0      # as each segment says",
    ]
    sources = {
        "channel_radius_mm": "none is described",
        "tip_mass_g": "by definition 0",
        "stiffness_scale": "1: as specified",
        "links_per_subsegment": "authors' settings: one joint pair per link",
        "disks_per_segment": "0: as each segment says",
    }
    for index, name in enumerate(SEGMENTS):
        length_m = parameters["segment_lengths"][str(index + 1)]
        mass_g = material["density"] * math.pi * radius_m**2 * length_m * 1e3
        lines += [
            "",
            "[[segments]]",
            f'name = "{name}"',
            f"length_mm = {length_m * 1e3:g}",
            f"disks = {parameters['links_per_segment'][str(index + 1)]}",
            f"outer_radius_mm = {parameters['radius'] * 1e3:g}",
            f"bending_stiffness_N_mm2 = {bending:.6g}   # EI = 50 GPa * pi/4 * (0.5 mm)^4",
            f"mass_g = {mass_g:.4g}   # 37708 kg/m^3 in a rod of 0.5 mm radius",
            'bending_axes = "xy"',
            "torsion_stiffness_N_mm2 = inf",
        ]
        key = f"segments.{name}"
        sources |= {
            f"{key}.length_mm": f"authors' settings: segment_lengths.{index + 1}",
            f"{key}.disks": "authors' settings: links_per_segment; the real disks are not described",
            f"{key}.outer_radius_mm": "authors' settings: radius (theirs serves the looks alone)",
            f"{key}.bending_stiffness_N_mm2": "authors' settings: rod radius 0.5 mm, Young's modulus 50 GPa, "
            "an effective value",
            f"{key}.mass_g": "authors' settings: density 37708 kg/m^3 of the rod's volume, an "
            "effective value that stands for the disks too; without effect, since gravity is off",
            f"{key}.torsion_stiffness_N_mm2": "authors' settings: two joints per link, so no twist",
            f"{key}.axial_stiffness_N": "authors' settings: no joint that stretches",
            f"{key}.shear_stiffness_N": "authors' settings: no joint that shears",
            f"{key}.stiffness_cubic_mm2": "authors' settings: linear",
            f"{key}.stiffness_quintic_mm4": "authors' settings: linear",
            f"{key}.plastic_share": "authors' settings: linear",
            f"{key}.yield_curvature_per_m": "authors' settings: linear",
            f"{key}.rest_curvature_x_per_m": "authors' settings: straight",
            f"{key}.rest_curvature_y_per_m": "authors' settings: straight",
            f"{key}.rest_twist_deg_per_m": "authors' settings: straight",
        }
    for index, name in enumerate(tendon_names()):
        segment, k = divmod(index, 3)
        radius_mm = parameters["actuation_details"]["segments"][segment]["distance_to_backbone"] * 1e3
        angle = parameters["seg_offsets"][segment] + k * 2.0 * math.pi / 3.0
        lines += [
            "",
            "[[tendons]]",
            f'name = "{name}"   # servo {SERVOS[segment][k]}',
            f"radius_mm = {radius_mm:g}",
            f"angle_deg = {math.degrees(angle) % 360.0:.3f}",
            f'ends_at = "{SEGMENTS[segment]}"',
            f"stiffness_N_per_mm = {actuator['tendon_kp'] * 1e-3:g}",
            "pretension_N = 0",
        ]
    sources |= {
        "tendons": "authors' settings: radius distance_to_backbone; angle seg_offsets + k 120 deg; stiffness "
        "tendon_kp (uniform, since its scale factor is 1). Their tendon_angle_deltas and tendon_pretension, "
        "fitted by them to these measurements, are left out: even spacing and no pretension assumed",
        "friction.mu": "authors' settings: no friction",
        "mount": "authors' settings: rigid",
        "dynamics": "assumed: chosen so that the robot comes to rest without overshoot",
    }
    lines += ["", "[friction]", "mu = 0.0", "", "[sources]"]
    lines += [f"{json.dumps(key)} = {json.dumps(text)}" for key, text in sources.items()]
    return "\n".join(lines) + "\n"


DATASET = f"""\
# Measurements of a real robot; README.md beside this file says what is known of them.

[dataset]
name = "OpenCR v4, tip by motion capture"
robot = "opencr_v4.toml"
source = "{SOURCE}: {RECORDING}, Continuum Robotics Lab, University of Toronto"
licence = "MIT, Copyright (c) 2026 Continuum Robotics Lab (see LICENSE)"

[conditions]
gravity_mps2 = [0.0, 0.0, 0.0]   # as in the authors' settings; the mounting is not described

[channels]
inputs = [
{{inputs}}
]
outputs = ["tip_x_mm", "tip_y_mm", "tip_z_mm"]

[[trials]]
file = "train.csv"
role = "train"

[[trials]]
file = "val.csv"
role = "heldout"
"""

README = """\
# OpenCR v4: a real robot, measured

A tendon-driven robot with three segments of 60, 62.5 and 64 mm and nine tendons, each on its own
servo. Its tip was tracked by motion capture while the servos moved it slowly, out and back.

**Source.** github.com/ContinuumRoboticsLab/opencr-mujoco, commit 17fff8b, recording
`tdcr_sysid_20260511-183002`; the robot from the same project's `ftdcr_v4_sysid.json`. **Licence:** MIT,
in `LICENSE`. `scripts/convert_opencr_v4.py` makes every file here from the published ones.

## Files

- `train.csv` (1,620 rows, 24 minutes): single-tendon pulls, then one segment at a time in six directions
  and in a circle, then two segments together, bent the same way or against each other.
- `val.csv` (443 rows, 6 minutes): all three segments together. The split is the authors'. It was recorded
  23 s after the end of `train.csv` in the same session.
- `opencr_v4.toml`: the robot, every number with its source.

| column | what it is |
|---|---|
| `time_s` | published time stamp minus that of the file's first row |
| `displacement_<tendon>_mm` | servo travel in steps of 0.0153 mm; positive pulls. \
`base_1..3` are servos 4, 3, 9 and end at the first segment's end, \
`middle_1..3` servos 5, 2, 8, `tip_1..3` servos 6, 1, 7 |
| `tip_x_mm`, `tip_y_mm`, `tip_z_mm` | tip marker; z along the straight robot |

The published pattern labels are left out: they say what was meant, not what was done.
Each tendon bends the robot toward its own angle in `opencr_v4.toml`: over the nine single-tendon pulls
the direction of the tip's motion and that angle differ by -4 to +9 deg, +2 deg in the mean. So the
tracker's frame is neither mirrored nor turned by more than a few degrees. The authors' settings also
hold angle corrections of up to 8 deg and a pretension for each tendon, which they fitted to
these measurements with their simulator. They are left out: the holes are taken as evenly spaced. (The
corrections suit the single pulls better, all of `train.csv` worse: 7.9 instead of 7.2 mm, aligned.)

Gravity is zero, as in the authors' settings: neither the robot's weight nor how it hung is stated. What
weight does to this robot is therefore part of what a diagnosis must explain, or leave unexplained.

## Yardstick

All figures are distances of the tip in space. *RMSE* is the root of the mean square, *mean* the plain
average, always the smaller of the two. *Aligned* means that the mean offset between measured and
computed tip has been taken out first.

| figure | what it is |
|---|---|
| 9.38 mm | RMSE, aligned, on `val.csv`, of the authors' simulator with its settings \
`ftdcr_v4_sysid.json`, corrections included: the number to compare with |
| 12.11 mm | the same with their calibration `ftdcr_v4_sysid_0326.json` |
| 9.68 mm | RMSE, aligned, of that calibration on `train.csv`, on which it was made |
| 7.7 mm | the *mean* error, aligned, of that calibration on `train.csv`: \
the number that their project publishes (4.1 % of the length) |

## Known of the data

- **Slack.** Near zero travel the response has a knee: some tendons are slack, others hold pretension.
- **History.** The same command does not give the same tip. Pairs of rows more than five rows apart, whose
  nine commands agree within 0.5 mm, lie 8.4 mm apart in the median; loops are 3 to 8 mm wide.
- **No clean zero.** With every servo within 0.5 mm of zero (141 rows) the tip scatters by 5.3 mm in x and
  6.0 mm in y (standard deviation) about (-0.3, 11.1, 187.6) mm. Never zero the data on one row.
- **Coupling.** Distal tendons run through the proximal segments and bend them; the distal servos also
  move to make up for that.
- **Hidden commands.** Rows come every 0.6 s, but 39 % of the time lies in 156 gaps longer than 1.2 s, in
  which the servos moved unseen. Some patterns begin while the motion before still runs.
- **Released tendons.** In the single-tendon pulls the other eight tendons are let out to -10 mm.
- **One repetition** of every pattern, so repeats cannot tell the noise.
- **Extrapolation.** `val.csv` pulls up to 12.4 mm, `train.csv` up to 9.6 mm.
- **The tip alone** was measured. A tilted frame, a curved backbone and wrong zeros of the tendons cannot
  be told apart by it, and neither can several places where the robot might give way.
"""


def main(arguments: list[str] | None = None) -> int:
    """Run the conversion; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("source", type=Path, metavar="SOURCE_FOLDER", help="folder of the published files")
    parser.add_argument("-o", "--output", type=Path, default=DEFAULT_OUTPUT, help="folder to write into")
    options = parser.parse_args(arguments)
    try:
        convert(options.source, options.output)
    except InputError as error:
        print(f"convert_opencr_v4: {error}", file=sys.stderr)
        return 2
    return 0


def convert(source: Path, output: Path) -> None:
    """Write the data set from the published files in `source` to `output`, and check it by reading it.

    Raises:
        InputError: a published file is missing or not what is expected, or `output` cannot be written.
    """
    try:
        parameters = json.loads((source / PARAMETERS).read_text(encoding="utf-8"))
        licence = (source / "LICENSE").read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise InputError(f"{source}: {error}") from None
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{output}: cannot be made: {error.strerror or error}") from None
    for kind in ("train", "val"):
        rows = convert_series(source / f"{RECORDING}_{kind}.csv", output / f"{kind}.csv")
        print(f"{output / kind}.csv: {rows} rows")
    inputs = "\n".join(f'  "displacement_{name}_mm",' for name in tendon_names())
    for name, text in (
        ("opencr_v4.toml", robot_text(parameters)),
        ("dataset.toml", DATASET.format(inputs=inputs)),
        ("LICENSE", licence),
        ("README.md", README),
    ):
        with replaced_when_whole(output / name) as file:
            file.write(text)
    dataset = load_dataset(output)
    print(f"{output}: {dataset.name}, {len(dataset.trials)} trials, reads back")


if __name__ == "__main__":
    sys.exit(main())
