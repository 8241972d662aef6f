"""From command line arguments to a robot with its effects and the inputs that arrive at it."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.channels import check_output_channels, output_table
from catheter_sim.cli.arguments import columns, gravity
from catheter_sim.core.inputs import Inputs, slice_inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.recording import Recording, recording_of
from catheter_sim.effects.apply import built_in, in_force
from catheter_sim.errors import InputError
from catheter_sim.tables import Table, time_text, write_table

_ROW = re.compile(r"row (\d+) \(time_s = [^)]*\)")  # as models and the simulation name a row of inputs


@dataclass(frozen=True)
class DrivenRobot:
    """What a verb drives.

    Attributes:
        specified: the robot as the user wrote it, effects named: what `simulate` and static models take.
        robot: the same with the effects built in.
        recording: the file of inputs, with what it holds of measured outputs.
        commanded: the inputs in it: what `simulate` and static models take.
        arriving: what reaches the robot of them, through the effects.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        columns: the output columns that are wanted; None: all.
    """

    specified: RobotSpec
    robot: RobotSpec
    recording: Recording
    commanded: Inputs
    arriving: Inputs
    gravity_mps2: Array
    columns: Sequence[str] | None

    @property
    def table(self) -> Table:
        """The rows of the file of inputs."""
        return self.recording.measured

    @property
    def moved(self) -> bool:
        """Whether the file is a trial in which the robot moved."""
        return self.recording.conditions is not None and self.recording.conditions[1]


def load(reference: str, settings: Sequence[str]) -> tuple[RobotSpec, RobotSpec]:
    """Return the robot as specified, and with its effects built in; both checked.

    Raises:
        InputError: unknown robot, key or effect, or an impossible robot.
    """
    specified = load_robot(reference, settings, "--set")
    return specified, built_in(specified, reference)


def drive(options: argparse.Namespace) -> DrivenRobot:
    """Return what the arguments ROBOT, --set, --inputs, --trial, --gravity and --columns name.

    Raises:
        InputError: any of them is wrong.
    """
    specified = load_robot(options.robot, options.settings, "--set")
    names = columns(getattr(options, "columns", None))
    if names is not None:
        check_output_channels(specified, names, "--columns")
    recording = recording_of(specified, options.inputs, options.trial, options.other_robot)
    if options.gravity is not None:
        gravity_mps2 = np.array(gravity(options.gravity))
    else:
        gravity_mps2 = np.zeros(3) if recording.conditions is None else recording.conditions[0]
    if recording.said:
        print(recording.said)
    acting = in_force(specified, recording.inputs, options.robot)
    return DrivenRobot(
        specified=acting.specified,
        robot=acting.robot,
        recording=recording,
        commanded=recording.inputs,
        arriving=acting.inputs,
        gravity_mps2=gravity_mps2,
        columns=names,
    )


def inputs_until(driven: DrivenRobot, row: int | None, time_s: float | None) -> Inputs:
    """Return what arrives at the robot up to a row of the file, or up to a time of its clock.

    `row`, 1 for the first, counts before `time_s` [s], which lies on the line between two rows; neither: all.

    Raises:
        InputError: the file has no such row or time.
    """
    where, clock = driven.table.where, driven.table.time_s
    if row is not None:
        if row > len(clock):
            raise InputError(f"--row {row}: {where} has rows 1 to {len(clock)}")
        return slice_inputs(driven.arriving, slice(0, row))
    if time_s is None:
        return driven.arriving
    if not clock[0] <= time_s <= clock[-1]:
        first, last = time_text(clock[0]), time_text(clock[-1])
        raise InputError(f"--time {time_text(time_s)}: {where} runs from time_s = {first} to {last}")
    from catheter_sim.pictures.offscreen import resampled  # brings what draws

    own = driven.arriving.time_s
    end = min(time_s - clock[0], own[-1])
    return resampled(driven.arriving, np.append(own[own < end], end))


@contextmanager
def lines_named(table: Table, always: bool = False) -> Iterator[None]:
    """Put the file and its line into an error that tells of a row of the inputs in `table`.

    `always`: put the file before every other error too.
    """
    try:
        yield
    except InputError as error:
        message = with_lines(str(error), table)
        if always and message == str(error):
            message = f"{table.where}: {message}"
        raise type(error)(message) from None


def with_lines(message: str, table: Table) -> str:
    """Return `message` with the rows that it names as lines of the table's file, after the file's name.

    Time is the file's there; the robot's own clock starts at the first row.
    """

    def line(found: re.Match[str]) -> str:
        row = int(found[1]) - 1
        if row >= len(table.time_s):
            return found[0]
        name = table.row(row).removeprefix(f"{table.where}: ")
        return f"{name} (time_s = {time_text(table.time_s[row])})"

    changed, count = _ROW.subn(line, message)
    return f"{table.where}: {changed}" if count else message


def warn_of_limits(driven: DrivenRobot) -> None:
    """Say on standard error, in one line, which inputs are beyond what the robot can follow."""
    from catheter_sim.planning.bounded import beyond_limits

    if line := beyond_limits(driven.specified, driven.commanded):
        print(f"catheter-sim: warning: {with_lines(line, driven.table)}", file=sys.stderr)


def outputs(driven: DrivenRobot, postures: Sequence[Posture]) -> Table:
    """Return the output columns of `postures`, the first rows of the drive, beside what was measured."""
    found = output_table(driven.specified, driven.table.time_s, postures, driven.columns)
    return driven.recording.beside(found)


def write_outputs(driven: DrivenRobot, postures: Sequence[Posture], path: str) -> None:
    """Write the output columns of `postures` to the CSV file `path`."""
    write_table(outputs(driven, postures), path)
