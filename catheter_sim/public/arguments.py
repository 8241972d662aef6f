"""Arguments that every public function takes in the same way, each bad one an error of one line."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from catheter_sim.core.requirements import flag_of, number_of, whole_of
from catheter_sim.errors import InputError, shown

if TYPE_CHECKING:
    from catheter_sim.arrays import Array
    from catheter_sim.core.robot import RobotSpec

AT_REST = (0.0, 0.0, 0.0)  # no gravity
_MOST_JOBS = 256


def path_of(value: str | os.PathLike[str], where: str) -> str:
    """Return a path, or an id, as a text.

    Raises:
        InputError: it is none.
    """
    if not isinstance(value, str | os.PathLike):
        raise InputError(f"{where}: a path is needed, not {shown(value)}")
    return os.fspath(value)


def robot_of(robot: RobotSpec | str | os.PathLike[str]) -> RobotSpec:
    """Return `robot` itself, or the one that it names.

    Raises:
        InputError: unknown robot, or neither a robot nor a name.
    """
    from catheter_sim.catalogue import robot_of as value_of

    return value_of(robot)


def gravity_of(value: Sequence[float]) -> Array:
    """Return gravity as an array, shape (3,) [m/s^2].

    Raises:
        InputError: not three finite numbers.
    """
    try:
        gravity = [number_of(part, "gravity_mps2") for part in value]
    except (TypeError, InputError):
        gravity = []
    if len(gravity) != 3:
        raise InputError(f"gravity_mps2 = {shown(value)}: three finite numbers are needed")
    return np.array(gravity)


def texts_of(value: Any, where: str, needed: str, least: int = 0) -> list[str]:
    """Return names as a list; one name will do.

    Args:
        value: what a user gave.
        where: what it is called.
        needed: what would be right, in the plural.
        least: how many there must be.

    Raises:
        InputError: they are none.
    """
    if isinstance(value, str):
        return [value]
    try:
        listed = list(value)
    except TypeError:
        listed = [None]
    if len(listed) < least or not all(isinstance(name, str) for name in listed):
        raise InputError(f"{where} = {shown(value)}: {needed} are needed")
    return listed


def columns_of(names: Sequence[str] | str) -> list[str]:
    """Return names of columns as a list; one name will do.

    Raises:
        InputError: they are none.
    """
    return texts_of(names, "columns", "names of output columns", 1)


def mapping_of(value: Any, where: str, needed: str) -> dict[str, Any]:
    """Return a mapping by its names; None is an empty one. The others as of `texts_of`.

    Raises:
        InputError: it is none.
    """
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise InputError(f"{where} = {shown(value)}: a mapping of {needed} is needed")
    return {str(name): item for name, item in value.items()}


def jobs_of(value: int) -> int:
    """Return how many processes to fit with.

    Raises:
        InputError: it is no whole number, or not one of 1 to 256.
    """
    return whole_of(value, "jobs", f"a whole number of 1 to {_MOST_JOBS}", 1, _MOST_JOBS)


def budget_of(value: float) -> float:
    """Return how long a search may take [s].

    Raises:
        InputError: it is no number above zero.
    """
    return number_of(value, "budget_s", "a number of seconds above 0", lambda seconds: seconds > 0.0)


def progress_of(value: bool | None) -> bool:
    """Return whether to show what is being done; None: on a terminal, and in a notebook.

    Raises:
        InputError: it is neither True, False nor None.
    """
    from catheter_sim.progress import bars_shown

    return bars_shown() if value is None else flag_of(value, "progress")
