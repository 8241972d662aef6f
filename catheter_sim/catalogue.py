"""Robots by id or by path: the one way from what a user writes to a robot.

A robot with several published parameter sets has an id for each, its name and the set's after an
`@`; the name alone is the default set.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import tomli_w

from catheter_sim.core.document import (
    ALL_DIGITS,
    SAID,
    Settings,
    check_plain,
    set_all,
    settings_table,
    to_document,
)
from catheter_sim.core.published import Published
from catheter_sim.core.robot import RobotSpec
from catheter_sim.core.variation import read_tables, tables_of
from catheter_sim.errors import InputError, shown, unknown
from catheter_sim.robots import KINDS, check_robot, kind_of
from catheter_sim.robots.documents import complete_document, robot_from_document

PUBLISHED: Mapping[str, Published] = {
    item.id: item for kind in KINDS.values() for item in kind.robots.PUBLISHED
}
ROBOTS: Mapping[str, Callable[[], RobotSpec]] = {name: item.build for name, item in PUBLISHED.items()}


def robots_of(kind: str) -> Mapping[str, Callable[[], Any]]:
    """Return the published robots of a kind, and their parameter sets, by id."""
    return {item.id: item.build for item in KINDS[kind].robots.PUBLISHED}


FILES = (".toml", ".xml")  # a robot's reference that ends so is a path: its file, or a chain in MJCF
_LARGEST_FILE = 10_000_000  # bytes
_ENDLESS_KEY = re.compile(r"""(?<![\w"'.-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){100}""")


def robot_of(robot: RobotSpec | str | os.PathLike[str]) -> RobotSpec:
    """Return `robot` itself, or the one that it names.

    Raises:
        InputError: unknown robot, or neither a robot nor a name.
    """
    return robot if isinstance(robot, RobotSpec) else load_robot(robot)


def load_robot(
    reference: RobotSpec | str | os.PathLike[str], settings: Settings = (), said: str = SAID
) -> RobotSpec:
    """Return the robot that `reference` names, with `settings` applied, checked.

    What its file leaves out and follows from the rest, its kind adds (`defaults.py`).

    Args:
        reference: a robot id, the path of a robot `.toml`, or of an MJCF `.xml` of a chain of hinges
            (`robots/<kind>/from_mjcf`), or a robot.
        settings: a text `KEY=VALUE` with a key of the robot's `.toml` form, several, or a mapping of keys
            to values.
        said: what errors call the settings.

    Raises:
        InputError: unknown robot or key, unreadable file, impossible robot.
    """
    names_one = isinstance(reference, str | os.PathLike) and "\0" not in str(reference)
    if not (names_one or isinstance(reference, RobotSpec)):
        raise InputError(f"robot = {shown(reference)}: a robot, its id or the path of its .toml is needed")
    text = reference.name if isinstance(reference, RobotSpec) else os.fspath(reference)
    given: set[str] | None = None  # the keys of a file that may leave some out
    if isinstance(reference, RobotSpec):
        document = to_document(reference)
    elif text.endswith(".toml"):
        table = read_tables(read_toml(Path(text)), text)
        given = set(table)
        document = complete_document(table, text)
    elif text.endswith(".xml"):
        document = to_document(_from_mjcf(text))
    elif text in ROBOTS:
        document = to_document(ROBOTS[text]())
    else:
        named = text.partition("@")[0]  # parameter sets are told of a robot that is known
        known = [name for name in ROBOTS if "@" not in name or name.startswith(f"{named}@")]
        raise unknown("robot", text, [*known, "a path to a .toml", "a path to an MJCF .xml"])
    set_all(document, settings, said)
    robot = robot_from_document(document, text)
    check_robot(robot, text)
    kind = kind_of(robot)
    if given is None or not kind.has("defaults"):
        return robot
    completed: RobotSpec = kind.face("defaults", "defaults").complete(
        robot, given | set(settings_table(settings, said))
    )
    return completed


def _from_mjcf(text: str) -> RobotSpec:
    """Return the robot of the kind that reads chains of hinges; what is assumed its description says."""
    kind = next(kind for kind in KINDS.values() if kind.has("from_mjcf"))
    robot: RobotSpec = kind.face("from_mjcf", "MJCF").read_chain(text).robot
    return robot


def read_toml(path: Path) -> dict[str, Any]:
    """Return the document in the TOML file `path`.

    Raises:
        InputError: the file cannot be read or is not TOML.
    """
    text = _text_of(path)
    if _ENDLESS_KEY.search(text):  # tomllib's time grows with the square of a key's parts
        raise InputError(f"{path}: not valid TOML: a key has more than 100 parts")
    try:
        document = tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{path}: not valid TOML: nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML: {error}") from None
    except ValueError:  # Python's, of a whole number beyond 4300 digits
        raise InputError(f"{path}: not valid TOML: a whole number has thousands of digits") from None
    check_plain(document, str(path))
    return document


def _text_of(path: Path) -> str:
    if "\0" in str(path):
        raise InputError(f"{path}: no such file")
    try:
        with path.open("rb") as file:
            data = file.read(_LARGEST_FILE + 1)
        text = data.decode("utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    if len(data) > _LARGEST_FILE:
        raise InputError(f"{path}: larger than {_LARGEST_FILE / 1e6:g} MB, so neither a robot nor a data set")
    return text


def robot_toml(robot: RobotSpec) -> str:
    """Return `robot` as the text of a `.toml` that `load_robot` reads back to the same value."""
    document = to_document(robot, ALL_DIGITS)
    document["effects"] = {name: tables_of(values) for name, values in document["effects"].items()}
    return tomli_w.dumps(document)
