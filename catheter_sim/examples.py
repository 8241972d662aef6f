"""The examples that come with the package: their names, what each is, and what to try with it.

Inputs lie in a folder named after their robot; `*_robot.toml` are robots of each kind to start from.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from catheter_sim.errors import InputError, unknown
from catheter_sim.resources import assets_folder

# Folders that are no data set and hold no robot's inputs: what they are, and what to do with them.
RAW: Mapping[str, tuple[str, str]] = {
    "worn_catheter": (
        "a tracker's files of a catheter with a hidden fault (made up by simulation)",
        "catheter-sim import {}/take_1.csv {}/take_2.csv {}/take_3.csv --robot mitral_transseptal "
        "--spool-radius 10 -o my_data",
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
