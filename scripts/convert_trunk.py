"""Turn the published measurements of a hanging trunk robot into data sets that `diagnose` reads.

    python scripts/convert_trunk.py SOURCE_FOLDER [-o assets/examples/trunk]

SOURCE_FOLDER holds, from github.com/StanfordASL/trunk-stack (MIT), `settled_000g.csv`, `settled_100g.csv`,
`settled_300g.csv` (commits d360438 and 225d335), `moving_000g.csv`, `moving_100g.csv`, `moving_300g.csv`
(commit 8b4b923) and `LICENSE`. Written are the robot, two folders for each of the three masses, LICENSE and
README.md. Of the moving recordings five stretches are taken, every fourth row; motors' angles, logged anew at
every fifth row or so, are means over nine rows.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from catheter_sim.catalogue import load_robot
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.errors import InputError
from catheter_sim.tables import Table, replaced_when_whole, write_table

SOURCE = "StanfordASL/trunk-stack, commits {commits}, Stanford Autonomous Systems Lab"
DEFAULT_OUTPUT = Path(__file__).resolve().parent.parent / "assets" / "examples" / "trunk"
MASSES = ("000g", "100g", "300g")
SEGMENTS = ("base", "middle", "tip")
# Each motor pulls one tendon in and lets its opposite out: where the pulled one ends, and its angle. The
# linear response of 15,001 moving rows without a weight has -46, -107, -175, 163, 111 and 43 deg; the disks
# have twelve channels, so that angles 30 deg apart are taken.
PULLS = {
    1: ("middle", -47),
    2: ("tip", -107),
    3: ("base", -167),
    4: ("tip", 163),
    5: ("base", 103),
    6: ("middle", 43),
}
SPOOL_MM = 36.0
AXIS_MM = (100.7, 104.6)  # of the straight robot in the tracker's frame: x and z; y points up
MIDDLE_MARKERS_MM = (0.9, 5.4, -14.2)  # from the middle disk's centre, in the robot's base frame
ROWS = 40  # of a settled trial
STRETCHES = range(2, 142, 28)  # where the moving trials begin [s]
STRETCH_S, WARM_UP_S = 14, 2  # of which the first is played and not judged
RATE_HZ, STEP_ROWS, SMOOTHED_ROWS = 100, 4, 9
DAMPING_S = 0.02
DISKS = 4
LENGTH_MM = 105.0
PLACES = {"base": f"body_{DISKS}", "middle": f"body_{2 * DISKS}", "tip": "tip"}
BENDING_N_mm2 = {"base": 0.25e6, "middle": 0.13e6, "tip": 0.06e6}


def tendons() -> list[tuple[str, str, float]]:
    """Return the twelve tendons: name, where each ends, angle [deg]."""
    return [
        (f"motor_{motor}_{side}", end, (angle + turn) % 360.0)
        for motor, (end, angle) in PULLS.items()
        for side, turn in (("in", 0.0), ("out", 180.0))
    ]


def robot_text() -> str:
    """Return the robot's `.toml`."""
    lines = [
        "# A hanging trunk robot: three soft segments, three disks, six motors, twelve tendons.",
        "# Made by scripts/convert_trunk.py; change the script, not this file. z points down.",
        "",
        'name = "trunk"',
        'description = "hanging trunk of three soft segments, 315 mm, six motors on antagonistic tendons"',
        'actuation = "displacement"',
        'appearance = "spacer_disks"',
        "channel_radius_mm = 0.0",
        "tip_mass_g = 130.0",
        "stiffness_scale = 1.0",
        "links_per_subsegment = 1",
        "disks_per_segment = 0      # as each segment says",
    ]
    sources = {
        "tip_mass_g": "fitted to the data without a weight, beside the bending stiffness: these data show "
        "their ratio alone",
        "channel_radius_mm": "not described",
        "stiffness_scale": "1: as specified",
        "links_per_subsegment": "assumed: a joint pair per disk",
        "disks_per_segment": "0: as each segment says",
        "tendons": "radius 22 mm from a picture; angles from the linear response, rounded to twelve even "
        "channels; spring 0.56 N/mm fitted, pretension assumed so large that none goes slack",
        "friction.mu": "assumed none: what the same command does again differs by 0.7 to 1.8 mm",
        "mount": "assumed rigid",
        "dynamics.damping_time_s": "the best of 0, 0.01, 0.02 and 0.04 s along the moving recording without "
        "a weight: the tip is then off by 16.6, 12.1, 12.0 and 12.3 mm",
        "dynamics": "assumed: chosen so that the robot comes to rest without overshoot",
    }
    for name in SEGMENTS:
        key = f"segments.{name}"
        lines += [
            "",
            "[[segments]]",
            f'name = "{name}"',
            f"length_mm = {LENGTH_MM:g}",
            f"disks = {DISKS}",
            "outer_radius_mm = 30",
            f"bending_stiffness_N_mm2 = {BENDING_N_mm2[name]:g}",
            "mass_g = 80",
            'bending_axes = "xy"',
            "torsion_stiffness_N_mm2 = inf",
        ]
        sources |= {
            f"{key}.length_mm": "about 105 mm, from where the tracked disks hang",
            f"{key}.disks": "assumed: one printed disk ends each segment, the others stand for even bending",
            f"{key}.outer_radius_mm": "from a picture",
            f"{key}.bending_stiffness_N_mm2": "fitted to data without a weight, with a guessed own weight",
            f"{key}.mass_g": "guessed",
            f"{key}.torsion_stiffness_N_mm2": "assumed: no twist",
            f"{key}.axial_stiffness_N": "assumed: it does not stretch",
            f"{key}.shear_stiffness_N": "assumed: it does not shear",
            f"{key}.stiffness_cubic_mm2": "assumed linear",
            f"{key}.stiffness_quintic_mm4": "assumed linear",
            f"{key}.plastic_share": "assumed linear",
            f"{key}.yield_curvature_per_m": "assumed linear",
            f"{key}.rest_curvature_x_per_m": "assumed straight",
            f"{key}.rest_curvature_y_per_m": "assumed straight",
            f"{key}.rest_twist_deg_per_m": "assumed straight",
        }
    for name, end, angle in tendons():
        lines += [
            "",
            "[[tendons]]",
            f'name = "{name}"',
            "radius_mm = 22",
            f"angle_deg = {angle:g}",
            f'ends_at = "{end}"',
            "stiffness_N_per_mm = 0.56",
            "pretension_N = 60",
        ]
    lines += ["", "[dynamics]", f"damping_time_s = {DAMPING_S:g}   # of the material, in motion"]
    lines += ["", "[friction]", "mu = 0.0", "", "[sources]"]
    lines += [f'"{key}" = "{text}"' for key, text in sources.items()]
    return "\n".join(lines) + "\n"


def dataset_text(mass: str, files: list[str], moving: bool) -> str:
    """Return the `dataset.toml` of one mass."""
    commits, how = ("8b4b923", "moving") if moving else ("d360438 and 225d335", "settled")
    motion = ['motion = "dynamic"', f"warm_up_s = {WARM_UP_S}"] if moving else []
    inputs = [f'  "displacement_{name}_mm",' for name, _, _ in tendons()]
    outputs = [f'  "{place}_{axis}_mm",' for place in PLACES.values() for axis in "xyz"]
    trials = [line for file in files for line in ("", "[[trials]]", f'file = "{file}"')]
    return "\n".join(
        [
            "# Measurements of a real robot; ../README.md says what is known of them.",
            "",
            "[dataset]",
            f'name = "Hanging trunk, {int(mass[:3])} g at its end, {how}"',
            'robot = "../trunk.toml"',
            f'source = "{SOURCE.format(commits=commits)}"',
            'licence = "MIT, Copyright (c) 2024 Stanford Autonomous Systems Lab (see ../LICENSE)"',
            "",
            "[conditions]",
            "gravity_mps2 = [0.0, 0.0, 9.81]",
            *motion,
            "",
            "[channels]",
            "inputs = [",
            *inputs,
            "]",
            "outputs = [",
            *outputs,
            "]",
            *trials,
            "",
        ]
    )


def convert(source: Path, folder: Path, mass: str, moving: bool) -> int:
    """Write the data set of one mass; return its number of rows."""
    try:
        rows = np.genfromtxt(source, delimiter=",", names=True)
    except (OSError, ValueError) as error:
        raise InputError(f"{source}: cannot be read: {error}") from None
    angles = {motor: rows[f"motor_{motor}_deg"] for motor in PULLS}
    digits = 4
    if moving:
        window = np.ones(SMOOTHED_ROWS) / SMOOTHED_ROWS
        padded = {motor: np.pad(values, SMOOTHED_ROWS // 2, mode="edge") for motor, values in angles.items()}
        angles = {motor: np.convolve(values, window, "valid") for motor, values in padded.items()}
        digits = 2
    columns = {}
    for motor, angle_deg in angles.items():
        pulled = np.round(SPOOL_MM * np.radians(angle_deg), digits)
        columns |= {
            f"displacement_motor_{motor}_in_mm": pulled,
            f"displacement_motor_{motor}_out_mm": -pulled,
        }
    for name, place in PLACES.items():
        # The tracker's y points up, the base frame's z down; both are right-handed.
        point = [rows[f"{name}_x_mm"] - AXIS_MM[0], rows[f"{name}_z_mm"] - AXIS_MM[1], -rows[f"{name}_y_mm"]]
        beside = MIDDLE_MARKERS_MM if name == "middle" else (0.0, 0.0, 0.0)
        columns |= {
            f"{place}_{axis}_mm": np.round(values - shift, 3)
            for axis, values, shift in zip("xyz", point, beside, strict=True)
        }
    folder.mkdir(parents=True, exist_ok=True)
    files, count = [], 0
    for file, part, step_s in _trials(len(rows), moving):
        values = {name: column[part] for name, column in columns.items()}
        length = len(next(iter(values.values())))
        time_s = np.round(step_s * np.arange(length), 3)
        write_table(Table(time_s, values), folder / file)
        files.append(file)
        count += length
    with replaced_when_whole(folder / "dataset.toml") as text:
        text.write(dataset_text(mass, files, moving))
    return count


def _trials(rows: int, moving: bool) -> Iterator[tuple[str, slice, float]]:
    """Yield each trial's file, its rows and the time from row to row [s]."""
    if not moving:
        for first in range(0, rows, ROWS):
            yield f"commands_{first + 1:03d}.csv", slice(first, first + ROWS), 1.0
        return
    for start_s in STRETCHES:
        part = slice(RATE_HZ * start_s, RATE_HZ * (start_s + STRETCH_S), STEP_ROWS)
        yield f"from_{start_s:03d}_s.csv", part, STEP_ROWS / RATE_HZ


README = """\
# A hanging trunk with a known change

Three soft segments hang one below the other and end at printed disks; six motors each pull one tendon and let
out its opposite over springs. Three bodies were tracked. The same 200 commands (nine different ones, in one
random order) were held until all markers rested: with nothing, 100 g and 300 g hung at the end.

They were also recorded in motion, 100 rows a second: random commands below 1 Hz, the same for every weight.

**Source.** github.com/StanfordASL/trunk-stack, commits d360438 and 225d335 (settled) and 8b4b923 (moving).
**Licence:** MIT, in `LICENSE`.
`scripts/convert_trunk.py` makes every file here from the published ones.

| folder | hung at its end |
|---|---|
| `settled_000g`, `moving_000g` | nothing |
| `settled_100g`, `moving_100g` | 100 g |
| `settled_300g`, `moving_300g` | 300 g |

Positions are in the robot's base frame, z down, from the tracker's frame by the straight axis at x 100.7,
z 104.6 mm; of the middle body's markers their published place beside the disk, (0.9, 5.4, -14.2) mm, is
taken out.
Motor angles are commands, as travel over a spool of 36 mm (a radius that fits; it is not documented).
Every settled trial is a stretch of 40 commands. Every moving one is a stretch of 14 s, every fourth row, of
which the first 2 s are played and not judged: the trunk does not begin at rest. Motors' angles, logged anew
at every fifth row or so, are means over nine rows.

## Known of the data

- **Repeats.** One command gives the same point again within 0.7 to 1.0 mm rms a column, the tip within 1.4 to
  1.8 mm: hysteresis.
- **No scale of force.** Stiffness and own weight are guesses of which these data show the ratio alone: grams
  are told relative to the guessed own weight of 80 g a segment and 130 g at the end.
- **Swings.** In motion 300 g move the tip by 18 mm (its mean taken out). A filter of one second of commands,
  their squares and products, fitted to one half of the recording, leaves 11 mm of that on the other half: no
  command tells them.
- **Not documented:** spool radius, tendon radius, stiffness, where the weight hangs (about 60 mm below the
  last disk).
"""


def main(arguments: list[str] | None = None) -> int:
    """Run the conversion; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("source", type=Path, metavar="SOURCE_FOLDER")
    parser.add_argument("-o", "--output", type=Path, default=DEFAULT_OUTPUT, metavar="DIR")
    options = parser.parse_args(arguments)
    output: Path = options.output
    try:
        output.mkdir(parents=True, exist_ok=True)
        (output / "trunk.toml").write_text(robot_text(), encoding="utf-8")
        load_robot(output / "trunk.toml")
        for mass in MASSES:
            for how in ("settled", "moving"):
                folder = output / f"{how}_{mass}"
                count = convert(options.source / f"{how}_{mass}.csv", folder, mass, how == "moving")
                load_dataset(folder)
                print(f"{folder}: {count} rows")
        shutil.copy(options.source / "LICENSE", output / "LICENSE")
        (output / "README.md").write_text(README, encoding="utf-8")
    except (InputError, OSError) as error:
        print(f"convert_trunk: error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
