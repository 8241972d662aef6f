"""Write a first version of your own file, with a comment at each key: a robot or a data set.

examples:
  catheter-sim new robot my_robot
  catheter-sim new robot my_wrist --kind notched_tube
  catheter-sim new dataset my_data --robot my_robot.toml

`new robot NAME` writes NAME.toml, a robot that builds and simulates as it stands. `new dataset NAME` writes a
folder with dataset.toml and a trial to fill in. Its inputs go out and back one by one, by 1 in their units,
and its columns for what is measured are empty. To read data that a tracker wrote, use `catheter-sim
import`.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from catheter_sim.errors import InputError, unknown

_KINDS = ("continuum", "rolling", "catheter", "notched_tube")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.add_argument("what", metavar="robot|dataset", help="what to write")
    parser.add_argument("name", metavar="NAME", help="letters, digits and _")
    parser.add_argument("--kind", choices=_KINDS, default=_KINDS[0], help="of the robot; default continuum")
    parser.add_argument("--robot", metavar="ROBOT", help="of the data: an id, or the path of a robot's file")


def run(options: argparse.Namespace) -> int:
    """Write the skeleton; say what to do with it."""
    if options.what not in ("robot", "dataset"):
        raise unknown("thing to write", options.what, ("robot", "dataset"))
    if not _NAME.fullmatch(options.name):
        raise InputError(f"{options.name}: a name of letters, digits and _ is needed")
    return _robot(options) if options.what == "robot" else _dataset(options)


def _robot(options: argparse.Namespace) -> int:
    from catheter_sim.examples import robot_skeleton
    from catheter_sim.tables import replaced_when_whole

    path = _free(Path(f"{options.name}.toml"))
    with replaced_when_whole(path) as file:
        file.write(robot_skeleton(options.name, options.kind))
    print(f"wrote {path}: a robot of kind {options.kind}; change its numbers to yours")
    print(f"next: catheter-sim list {path}")
    return 0


def _dataset(options: argparse.Namespace) -> int:
    import os

    from catheter_sim.catalogue import FILES, load_robot
    from catheter_sim.examples import dataset_skeleton, trial_skeleton
    from catheter_sim.tables import replaced_when_whole, write_table

    if options.robot is None:
        raise InputError("new dataset: --robot is needed, an id (see `list`) or the path of a robot's file")
    robot, folder = load_robot(options.robot), _free(Path(options.name))
    reference = options.robot
    if reference.endswith(FILES):
        reference = Path(os.path.relpath(reference, folder)).as_posix()
    folder.mkdir(parents=True)
    with replaced_when_whole(folder / "dataset.toml") as file:
        file.write(dataset_skeleton(options.name, robot, reference))
    write_table(trial_skeleton(robot), folder / "trial_01.csv")
    print(f"wrote {folder}: dataset.toml, and trial_01.csv to fill in")
    print(f"next: catheter-sim diagnose {folder} -o {folder}_report")
    return 0


def _free(path: Path) -> Path:
    if path.exists():
        raise InputError(f"{path}: is there already; choose another name")
    return path
