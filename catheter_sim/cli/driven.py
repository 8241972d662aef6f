"""From command line arguments to a robot with its effects and the inputs that arrive at it."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from catheter_sim.cli import arguments
from catheter_sim.effects.apply import built_in, in_force
from catheter_sim.errors import InputError
from catheter_sim.robots.catalogue import load_robot
from catheter_sim.robots.channels import Inputs, check_output_channels, output_table, read_inputs
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array, Posture
from catheter_sim.tables import Table, read_table, write_table


@dataclass(frozen=True)
class Drive:
    """What a verb drives.

    Attributes:
        specified: the robot as the user wrote it, effects named: what `simulate` and static models take.
        robot: the same with the effects built in.
        table: the file of inputs.
        commanded: the inputs in it: what `simulate` and static models take.
        arriving: what reaches the robot of them, through the effects.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        columns: the output columns that are wanted; None: all.
    """

    specified: Robot
    robot: Robot
    table: Table
    commanded: Inputs
    arriving: Inputs
    gravity_mps2: Array
    columns: Sequence[str] | None


def load(reference: str, settings: Sequence[str]) -> tuple[Robot, Robot]:
    """Return the robot as specified, and with its effects built in; both checked.

    Raises:
        InputError: unknown robot, key or effect, or an impossible robot.
    """
    specified = load_robot(reference, settings, "--set")
    return specified, built_in(specified, reference)


def drive(options: argparse.Namespace) -> Drive:
    """Return what the arguments ROBOT, --set, --inputs, --gravity and --columns name.

    Raises:
        InputError: any of them is wrong.
    """
    specified = load_robot(options.robot, options.settings)
    gravity_mps2 = np.array(arguments.gravity(options.gravity))
    names = arguments.columns(getattr(options, "columns", None))
    if names is not None:
        check_output_channels(specified, names, "--columns")
    table = read_table(options.inputs)
    commanded = read_inputs(specified, table)
    acting = in_force(specified, commanded, options.robot)
    return Drive(
        specified=acting.specified,
        robot=acting.robot,
        table=table,
        commanded=commanded,
        arriving=acting.inputs,
        gravity_mps2=gravity_mps2,
        columns=names,
    )


@contextmanager
def file_named(path: str, kind: type[InputError] = InputError) -> Iterator[None]:
    """Put the file of inputs before an error of `kind`, one that tells of one of its rows."""
    try:
        yield
    except kind as error:
        raise InputError(f"{path}: {error}") from None


def outputs(driven: Drive, postures: Sequence[Posture]) -> Table:
    """Return the output columns of `postures`, the first rows of the drive as they are observed."""
    return output_table(driven.specified, driven.commanded.time_s, postures, driven.columns)


def write_outputs(driven: Drive, postures: Sequence[Posture], path: str) -> None:
    """Write the output columns of `postures` to the CSV file `path`."""
    write_table(outputs(driven, postures), path)
