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

from catheter_sim.errors import InputError, unknown
from catheter_sim.robots import chest_tube as _chest_tube
from catheter_sim.robots import mitral as _mitral
from catheter_sim.robots import neuroendoscope as _neuroendoscope
from catheter_sim.robots import spacer_disk as _spacer_disk
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.checks import check_robot
from catheter_sim.robots.document import check_plain, to_document
from catheter_sim.robots.kinds import Robot, complete_document, robot_from_document
from catheter_sim.robots.links import with_enough_links
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.settings import SAID, Settings, set_all, settings_table
from catheter_sim.robots.specification import ContinuumRobot

CONTINUUM_ROBOTS: Mapping[str, Callable[[], ContinuumRobot]] = {
    "neuroendoscope": _neuroendoscope.neuroendoscope,
    "neuroendoscope_section": _neuroendoscope.neuroendoscope_section,
    "spacer_disk": _spacer_disk.spacer_disk,
}
ROLLING_ROBOTS: Mapping[str, Callable[[], RollingRobot]] = {
    "chest_tube": _chest_tube.chest_tube,
    "chest_tube_section": _chest_tube.chest_tube_section,
    "chest_tube_section@table2": _chest_tube.chest_tube_section,
    "chest_tube_section@prototype": _chest_tube.chest_tube_section_prototype,
}
CATHETER_ROBOTS: Mapping[str, Callable[[], CatheterRobot]] = {
    "mitral_transseptal": _mitral.mitral_transseptal,
    "mitral_transseptal@tube": _mitral.mitral_transseptal_tube,
    "mitral_4dof": _mitral.mitral_4dof,
    "mitral_4dof@elongation": _mitral.mitral_4dof_elongation,
}
ROBOTS: Mapping[str, Callable[[], Robot]] = {**CONTINUUM_ROBOTS, **ROLLING_ROBOTS, **CATHETER_ROBOTS}

_LINKS = "links_per_subsegment"
_LARGEST_FILE = 10_000_000  # bytes
_ENDLESS_KEY = re.compile(r"""(?<![\w"'.-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){100}""")


def load_robot(reference: str | os.PathLike[str], settings: Settings = (), said: str = SAID) -> Robot:
    """Return the robot that `reference` names, with `settings` applied, checked.

    A continuum robot whose file does not say `links_per_subsegment` gets enough of them
    (`links.with_enough_links`).

    Args:
        reference: a robot id, or the path of a robot `.toml`.
        settings: a text `KEY=VALUE` with a key of the robot's `.toml` form, several, or a mapping of keys
            to values.
        said: what errors call the settings.

    Raises:
        InputError: unknown robot or key, unreadable file, impossible robot.
    """
    text = os.fspath(reference)
    says_links = True
    if text.endswith(".toml"):
        given = read_toml(Path(text))
        says_links = _LINKS in given
        document = complete_document(given, text)
    elif text in ROBOTS:
        document = to_document(ROBOTS[text]())
    else:
        raise unknown("robot", text, [*ROBOTS, "a path to a .toml"])
    set_all(document, settings, said)
    says_links |= _LINKS in settings_table(settings, said)
    robot = robot_from_document(document, text)
    check_robot(robot, text)
    if isinstance(robot, ContinuumRobot) and not says_links:
        return with_enough_links(robot)
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


def robot_toml(robot: Robot) -> str:
    """Return `robot` as the text of a `.toml` that `load_robot` reads back to the same value."""
    return tomli_w.dumps(to_document(robot))
