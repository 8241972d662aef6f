"""Robots by id or by path: the one way from what a user writes to a `ContinuumRobot`."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import tomli_w

from catheter_sim.errors import InputError, unknown
from catheter_sim.robots import neuroendoscope as _neuroendoscope
from catheter_sim.robots import spacer_disk as _spacer_disk
from catheter_sim.robots.checks import check_robot
from catheter_sim.robots.document import from_document, override, parse_override, to_document
from catheter_sim.robots.specification import ContinuumRobot

ROBOTS: Mapping[str, Callable[[], ContinuumRobot]] = {
    "neuroendoscope": _neuroendoscope.neuroendoscope,
    "neuroendoscope_section": _neuroendoscope.neuroendoscope_section,
    "spacer_disk": _spacer_disk.spacer_disk,
}


def load_robot(reference: str | os.PathLike[str], settings: Sequence[str] = ()) -> ContinuumRobot:
    """Return the robot that `reference` names, with `settings` applied, checked.

    Args:
        reference: a robot id, or the path of a robot `.toml`.
        settings: texts `KEY=VALUE` with the keys of the robot's `.toml` form.

    Raises:
        InputError: unknown robot or key, unreadable file, impossible robot.
    """
    text = os.fspath(reference)
    if text.endswith(".toml"):
        document = read_toml(Path(text))
        # Through the dataclass and back, so that --set reaches the keys that the file leaves out.
        document = to_document(from_document(ContinuumRobot, document, text))
    elif text in ROBOTS:
        document = to_document(ROBOTS[text]())
    else:
        raise unknown("robot", text, [*ROBOTS, "a path to a .toml"])
    for setting in settings:
        override(document, *parse_override(setting))
    robot: ContinuumRobot = from_document(ContinuumRobot, document, text)
    check_robot(robot, text)
    return robot


def read_toml(path: Path) -> dict[str, Any]:
    """Return the document in the TOML file `path`.

    Raises:
        InputError: the file cannot be read or is not TOML.
    """
    try:
        with path.open("rb") as file:
            return tomllib.load(file)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML: {error}") from None


def robot_toml(robot: ContinuumRobot) -> str:
    """Return `robot` as the text of a `.toml` that `load_robot` reads back to the same value."""
    return tomli_w.dumps(to_document(robot))
