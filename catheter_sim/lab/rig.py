"""What a bench is: a robot that starts at rest, plays inputs within its limits, and is read afterwards."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import ROBOTS, load_robot
from catheter_sim.channels import drives_of, input_channels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, unknown
from catheter_sim.tables import Table, time_text
from catheter_sim.units import si_factor

Ranges = dict[str, tuple[float, float]]  # least and most by input column, in its unit
_ROOM = 1e-6  # of a range, by which rounding may go beyond it


@dataclass(frozen=True)
class Limits:
    """What a bench can do.

    Attributes:
        inputs: least and most of each input column that it drives, in the column's unit: tension [N],
            travel [mm], and a known force on the tip [N] where one can be hung there. A column that is
            missing cannot be driven.
        duration_s: longest time that one play may take [s].
    """

    inputs: Mapping[str, tuple[float, float]]
    duration_s: float = 3600.0

    def check(self, inputs: Table) -> None:
        """Raise `InputError` where inputs go beyond the limits; the line names row, column and range."""
        for name, values in inputs.columns.items():
            least, most = self.inputs.get(name, (0.0, 0.0))
            room = _ROOM * max(abs(least), abs(most), 1e-9)
            outside = ~((values >= least - room) & (values <= most + room))
            if not outside.any():
                continue
            row = int(np.argmax(outside))
            if name not in self.inputs:
                raise unknown("input of this bench", name, self.inputs, inputs.row(row))
            raise InputError(
                f"{inputs.row(row)}: {name} = {values[row]:g}: the bench gives {least:g} to {most:g}"
            )
        inputs.require_increasing_time()
        length_s = float(inputs.time_s[-1] - inputs.time_s[0])
        if length_s > self.duration_s * (1.0 + _ROOM):
            raise InputError(
                f"{inputs.where}: takes {time_text(length_s)} s; a play may take {self.duration_s:g} s"
            )


@dataclass(frozen=True)
class Said:
    """What errors call what a bench is made of; default: as on the command line.

    `hide` stands for the hidden causes, `limits` for the ranges of its inputs, `columns` for what it
    measures.
    """

    hide: str = "--hide"
    limits: str = "--limit"
    columns: str = "--columns"


AS_ARGUMENTS = Said("hide", "limits", "columns")  # from Python


class Rig(Protocol):
    """A robot on a bench. Held: each row of inputs is held until the robot rests, then it is read.

    The order of calls: `reset`, `play`, then `read` until it returns a table. A name stands for one play:
    what was read under it is read again under it, the same.

    Attributes:
        robot: as specified, without what may be wrong with it.
        reference: how a data set names it: an id, or the path of a `.toml`.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        columns: the output columns that it measures.
        limits: what it can do.
    """

    @property
    def robot(self) -> RobotSpec: ...
    @property
    def reference(self) -> str: ...
    @property
    def gravity_mps2(self) -> Array: ...
    @property
    def columns(self) -> tuple[str, ...]: ...
    @property
    def limits(self) -> Limits: ...

    def reset(self) -> None:
        """Bring the robot to rest at zero input, without history; a play that was not read is forgotten."""

    def play(self, inputs: Table, name: str) -> None:
        """Play inputs in file units from rest.

        Raises:
            InputError: unknown input, or beyond the limits; one line names row, column and range.
        """

    def read(self, columns: Sequence[str] | None = None) -> Table | None:
        """Return what was commanded and measured in the last play, inputs first, in file units.

        `columns` are of the rig's (None: all). None is returned where the recording has not arrived yet
        (`waiting` says what is missing).

        Raises:
            InputError: nothing was played, no such column, or a recording that is not of this play.
        """

    def waiting(self) -> str:
        """Return what the bench waits for, in words; "" for nothing."""


def drive_limits(robot: RobotSpec, reach: Mapping[str, float] | Sequence[float]) -> Ranges:
    """Return least and most of each input column, in its unit, from how far it may go, SI.

    `reach`: of each column by name or in their order, shape (c,) [N, or m]; a displacement may go as far the
    other way, unless its drive takes no values below zero.
    """
    found = {}
    for index, drive in enumerate(drives_of(robot)):
        most = reach[drive.column] if isinstance(reach, Mapping) else reach[index]
        unit = si_factor(drive.column)
        least = max(-most, drive.least) if math.isfinite(drive.least) else -most
        found[drive.column] = (float(least / unit), float(min(most, drive.most) / unit))
    return found


def named_robot(robot: RobotSpec | str) -> tuple[RobotSpec, str]:
    """Return a robot, and how a data set names it: by its id, or as a `.toml` where it is none of a paper's.

    Raises:
        InputError: unknown robot.
    """
    if isinstance(robot, str):
        return load_robot(robot), robot
    published = robot.name in ROBOTS and load_robot(robot.name) == robot
    return robot, robot.name if published else f"{robot.name}.toml"


def completed(robot: RobotSpec, given: Mapping[str, tuple[float, float]], where: str) -> Ranges:
    """Return limits as given, checked: every input column of the robot that is driven, 0 within.

    Raises:
        InputError: no such input, a range that is none, or not a single one.
    """
    known = [*input_channels(robot), "force_tip_x_N", "force_tip_y_N", "force_tip_z_N"]
    for name, (least, most) in given.items():
        if name not in known:
            raise unknown("input", name, known, where)
        if not (math.isfinite(least) and math.isfinite(most) and least <= 0.0 <= most and least < most):
            raise InputError(f"{where} {name}={least:g},{most:g}: a range with 0 within is needed")
        for drive in drives_of(robot):
            unit = si_factor(name)
            if drive.column == name and (least * unit < drive.least or most * unit > drive.most):
                low, high = drive.least / unit, drive.most / unit
                raise InputError(f"{where} {name}={least:g},{most:g}: the robot takes {low:g} to {high:g}")
    if not any(name in given for name in input_channels(robot)):
        raise InputError(f"{where}: a range of at least one input is needed; choices: {', '.join(known)}")
    return dict(given)


def asked_columns(columns: Sequence[str] | None, own: Sequence[str]) -> tuple[str, ...]:
    """Return the columns that are asked of a bench: all of its `own` where none is named.

    Raises:
        InputError: it has no such column.
    """
    wanted = tuple(own) if columns is None else tuple(columns)
    for column in wanted:
        if column not in own:
            raise unknown("column", column, own, "lab")
    return wanted
