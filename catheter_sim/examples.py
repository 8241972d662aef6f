"""The examples that come with the package, and first versions of a user's own files."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from catheter_sim.channels import input_channels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, unknown
from catheter_sim.resources import assets_folder
from catheter_sim.robots import KINDS
from catheter_sim.tables import Table

# ----------------------------------------------------------------------------------------------------
# The examples that come with the package: their names, what each is, and what to try with it.
#
# Inputs lie in a folder named after their robot; `*_robot.toml` are robots of each kind to start from.

# Folders that are no data set and hold no robot's inputs: what they are, and what to do with them.
RAW: Mapping[str, tuple[str, str]] = {
    "worn_catheter": (
        "a tracker's files of a catheter with a hidden fault (made up by simulation)",
        "catheter-sim import {}/take_1.csv {}/take_2.csv {}/take_3.csv --robot mitral_transseptal "
        "--spool-radius 10 -o my_data",
    ),
    "catheter_log": (
        "a tracker's export and a motors' log of a catheter with a hidden fault (made up by simulation)",
        "catheter-sim import {}/tracker.csv --inputs {}/motors.csv --robot mitral_4dof --unit counts "
        "--counts-per-turn 4096 --spool-radius 8 -o my_data",
    ),
    "trunk": (
        "a real hanging trunk, recorded with nothing, 100 g and 300 g at its end",
        "catheter-sim diagnose {}/settled_300g --since {}/settled_000g -o report --jobs 2",
    ),
}


@dataclass(frozen=True)
class Example:
    """One example.

    Attributes:
        name: of its file or folder.
        path: where it lies in the installed package.
        says: what it is, in a line.
        next_command: what to try with a copy, "{}" being the copy's path.
    """

    name: str
    path: Path
    says: str
    next_command: str


def examples() -> Mapping[str, Example]:
    """Return the examples by name."""
    folder = assets_folder() / "examples"
    found: dict[str, Example] = {}
    for path in sorted(folder.iterdir()):
        if path.suffix == ".toml":
            kind = path.stem.removesuffix("_robot")
            says, command = f"a robot of kind {kind}, every key explained", "catheter-sim list {}"
        elif (path / "dataset.toml").is_file():
            says, command = "measured data of a real robot", "catheter-sim diagnose {} -o report --jobs 2"
        elif path.name in RAW:
            says, command = RAW[path.name]
        else:
            file = min(item.name for item in path.glob("*.csv"))
            says = f"inputs of {path.name}"
            command = f"catheter-sim simulate {path.name} --inputs {{}}/{file} -o simulated.csv"
        found[path.name] = Example(path.name, path, says, command)
    return found


def copy_example(name: str, target: Path) -> Example:
    """Copy an example to `target`, which is not there yet, and return it.

    Raises:
        InputError: no such example, something lies at `target`, or it cannot be written.
    """
    found = examples()
    if name not in found:
        raise unknown("example", name, found)
    if target.exists():
        raise InputError(f"{target}: is there already; choose another name with -o")
    example = found[name]
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if example.path.is_dir():
            shutil.copytree(example.path, target)
        else:
            shutil.copyfile(example.path, target)
    except OSError as error:
        raise InputError(f"{target}: cannot be written: {error.strerror or error}") from None
    return example


# ----------------------------------------------------------------------------------------------------
# First versions of a user's own files, with a comment at each key: a robot, a data set.

ROWS = 9  # of the trial that is to be filled in, for each input
_NAME = re.compile(r'^name = "\w+"', re.MULTILINE)


def robot_skeleton(name: str, kind: str) -> str:
    """Return the text of a robot's `.toml` of a kind, called `name`, with every key explained.

    Raises:
        InputError: no such kind, or one without an example.
    """
    if kind not in KINDS:
        raise unknown("kind", kind, KINDS)
    path = assets_folder() / "examples" / f"{kind}_robot.toml"
    if not path.is_file():
        raise InputError(f"kind {kind}: has no example to start from")
    text = path.read_text(encoding="utf-8")
    text = text.replace(f"assets/examples/{kind}_robot.toml", f"{name}.toml").replace(
        f"{name}.toml   ", f"{name}.toml "
    )
    return _NAME.sub(f'name = "{name}"', text, count=1)


def dataset_skeleton(name: str, robot: RobotSpec, reference: str) -> str:
    """Return the text of a `dataset.toml` for a robot's data, with every key explained."""
    inputs = input_channels(robot)
    return f"""\
# A data set: this file, and a CSV for each trial. Units are in the names; an empty cell is a missing value.
#     catheter-sim diagnose {name} -o {name}_report

[dataset]
name = {json.dumps(name)}
robot = {json.dumps(reference)}   # an id (`catheter-sim list`), or the path of a robot .toml from here
source = "where it was measured, and by whom"
licence = "not stated"

[conditions]
gravity_mps2 = [0.0, 0.0, 0.0]       # in the base frame, +z along the straight robot: [0, 0, -9.81] upright
motion = "held"                      # each row was held until at rest; or "dynamic": as time_s says

[channels]                           # columns of the CSVs; others are ignored, with a note
inputs = {_listed(inputs)}
outputs = ["tip_x_mm", "tip_y_mm", "tip_z_mm"]   # also body_<k>_x_mm, marker_<name>_x_mm; `list` has all

[[trials]]                           # one such entry for each CSV
file = "trial_01.csv"
# role = "train"                     # or "heldout"; left out: the tool holds some back by itself

# [calibration]                      # numbers of the robot that are not well known: fitted within bounds
# friction.mu = [0.0, 0.5]           # before anything is called wrong

# [map]                              # where the CSVs are a tracker's or a logger's own: column -> channel
# axes = ["x", "-z", "y"]            # the base's x, y, z in the tracker's axes: here its y points up
# every = 4                          # take every fourth row
# time_s = {{ column = "stamp", unit = "ms", origin = "first row" }}   # s, ms, us, ns, min, h, frame, date
# tip = {{ columns = ["X", "Y", "Z"], unit = "m" }}                    # mm, m, cm, um, in
# {inputs[0] if inputs else "force_tip_x_N"} = {{ column = "cell_1", scale = 1.0, sign = 1, zero = 0.0 }}
# of a motor that winds a tendon: {{ column = "motor_1", unit = "deg", spool_radius_mm = 10.0 }}
"""


def trial_skeleton(robot: RobotSpec) -> Table:
    """Return a trial to be filled in: each input goes out and back alone, nothing is measured yet.

    The size of the inputs is 1 in their unit; it is the user's to choose.
    """
    inputs = input_channels(robot)
    up = np.concatenate([np.linspace(0.0, 1.0, ROWS // 2 + 1), np.linspace(1.0, 0.0, ROWS // 2 + 1)[1:]])
    columns = {
        name: np.concatenate([up if other == name else np.zeros(len(up)) for other in inputs])
        for name in inputs
    }
    rows = len(up) * max(len(inputs), 1)
    columns |= {f"tip_{axis}_mm": np.full(rows, np.nan) for axis in "xyz"}
    return Table(np.arange(float(rows)), columns)


def _listed(names: Sequence[str]) -> str:
    if len(names) <= 2:
        return json.dumps(list(names))
    return "[\n" + "".join(f"  {json.dumps(name)},\n" for name in names) + "]"
