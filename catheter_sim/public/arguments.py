"""Arguments that every public function takes in the same way, each bad one an error of one line."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from catheter_sim.errors import InputError, shown

if TYPE_CHECKING:
    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.tables import Array

AT_REST = (0.0, 0.0, 0.0)  # no gravity


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
        gravity = np.array(value, dtype=float)
    except (TypeError, ValueError):
        gravity = np.zeros(0)
    if gravity.shape != (3,) or not np.isfinite(gravity).all():
        raise InputError(f"gravity_mps2 = {shown(value)}: three finite numbers are needed")
    return gravity


def columns_of(names: Sequence[str] | str) -> list[str]:
    """Return names of columns as a list; one name will do.

    Raises:
        InputError: they are none.
    """
    if isinstance(names, str):
        return [names]
    try:
        listed = list(names)
    except TypeError:
        listed = []
    if not listed or not all(isinstance(name, str) for name in listed):
        raise InputError(f"columns = {shown(names)}: names of output columns are needed")
    return listed
