"""Arguments that several verbs share: robots, inputs, how their texts are read."""

from __future__ import annotations

import argparse
import math
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.channels import check_output_channels, output_table, read_inputs
from catheter_sim.core.inputs import Inputs, slice_inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import built_in, in_force
from catheter_sim.errors import InputError, cut
from catheter_sim.files import check_output_file
from catheter_sim.tables import Table, read_table, time_text, write_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# ----------------------------------------------------------------------------------------------------
# Arguments that several verbs share, and how their texts are read.


class Drawn(Protocol):
    """A result that can be drawn."""

    def plot(self) -> Figure:
        """Return its figure."""


_SETTING = re.compile(r"[A-Za-z_][\w.]*=")


def split_settings(argv: Sequence[str]) -> list[str]:
    """Return `argv` with `--set A=1 B=2` as `--set=A=1 --set=B=2`, and `--gravity -9,0,0` as one word.

    argparse would take a robot that follows `--set A=1` for another setting, and a vector that starts
    with a minus sign for an option.
    """
    words: list[str] = []
    waiting = list(argv)
    while waiting:
        word = waiting.pop(0)
        if word == "--set" and waiting and not waiting[0].startswith("-"):
            words.append(f"--set={waiting.pop(0)}")
            while waiting and _SETTING.match(waiting[0]):
                words.append(f"--set={waiting.pop(0)}")
        elif word == "--gravity" and waiting and not waiting[0].startswith("--"):
            words.append(f"--gravity={waiting.pop(0)}")
        else:
            words.append(word)
    return words


def add_robot(parser: argparse.ArgumentParser) -> None:
    """Add ROBOT and --set."""
    parser.add_argument("robot", metavar="ROBOT", help="robot id (see `list`) or path of a robot .toml")
    parser.add_argument(
        "--set",
        metavar="KEY=VALUE",
        dest="settings",
        action="append",
        default=[],
        help="change a parameter of the robot or of an effect; may be repeated",
    )


def add_inputs(parser: argparse.ArgumentParser) -> None:
    """Add --inputs and --gravity."""
    parser.add_argument("--inputs", metavar="IN.csv", required=True, help="inputs over time")
    add_gravity(parser)


def add_gravity(parser: argparse.ArgumentParser) -> None:
    """Add --gravity."""
    parser.add_argument(
        "--gravity",
        metavar="GX,GY,GZ",
        default="0,0,0",
        help="in the base frame [m/s^2]; default 0,0,0: weight does not act",
    )


def add_columns(parser: argparse.ArgumentParser) -> None:
    """Add --columns."""
    parser.add_argument(
        "--columns",
        metavar="A,B,...",
        help="output columns to write, as tip_x_mm,tip_z_mm,body_15_x_mm; default: all",
    )


def add_output(parser: argparse.ArgumentParser, metavar: str, text: str) -> None:
    """Add -o."""
    parser.add_argument("-o", "--output", metavar=metavar, required=True, help=text)


def add_jobs(parser: argparse.ArgumentParser) -> None:
    """Add --jobs N."""
    parser.add_argument(
        "--jobs",
        metavar="N",
        type=whole_number(1, 256),
        default=1,
        help="processes to fit with; default 1",
    )


def add_limits(parser: argparse.ArgumentParser) -> None:
    """Add --limit."""
    parser.add_argument(
        "--limit",
        metavar="INPUT=LEAST,MOST",
        dest="limits",
        action="append",
        default=[],
        help="range of an input in the unit of its column, 0 within; may be repeated",
    )


def add_plot(parser: argparse.ArgumentParser) -> None:
    """Add --plot."""
    parser.add_argument("--plot", metavar="OUT.png", help="picture to draw besides")


def limits(texts: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Return what `--limit` states: least and most by input.

    Raises:
        InputError: one is not of the form INPUT=LEAST,MOST.
    """
    found = {}
    for text in texts:
        name, _, ends = text.partition("=")
        try:
            low, high = (float(part) for part in ends.split(","))
        except ValueError:
            raise InputError(f"--limit {cut(text, 100)}: INPUT=LEAST,MOST is needed") from None
        found[name.strip()] = (low, high)
    return found


def check_plot(path: str | None) -> None:
    """Raise `InputError` where no picture can be written at `path`; None: none is wanted."""
    if path is None:
        return
    if not path.lower().endswith(".png"):
        raise InputError(f"--plot {path}: a picture's ending is needed; choices: .png")
    check_output_file(path)


def write_plot(drawn: Drawn, path: str | None) -> None:
    """Write the figure of `drawn` to `path`, if there is one, and say so."""
    if path is None:
        return
    from catheter_sim.tables import replaced_when_whole

    with replaced_when_whole(path, binary=True) as file:
        drawn.plot().savefig(file, format="png", dpi=130)
    print(f"wrote {path}")


def gravity(text: str) -> tuple[float, float, float]:
    """Return the vector [m/s^2] that `--gravity` states.

    Raises:
        InputError: not three finite numbers.
    """
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--gravity {text}: three numbers gx,gy,gz in m/s^2 are needed") from None
    if not all(math.isfinite(part) for part in (x, y, z)):
        raise InputError(f"--gravity {text}: three finite numbers in m/s^2 are needed")
    return x, y, z


def columns(text: str | None) -> list[str] | None:
    """Return the names in `--columns`, each once, without `time_s`, which is always written."""
    if text is None:
        return None
    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise InputError(f"--columns {text}: a name is empty")
    return [name for name in dict.fromkeys(names) if name != "time_s"]


def whole_number(lower: int, upper: int) -> Callable[[str], int]:
    """Return an argparse type: a whole number from `lower` to `upper`."""

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = lower - 1
        if not lower <= value <= upper:
            raise argparse.ArgumentTypeError(
                f"{cut(text, 60)!r}: a whole number from {lower} to {upper} is needed"
            )
        return value

    return read


def whole_numbers(text: str) -> list[int]:
    """Return the whole numbers from 0 that `text` states, comma-separated; an argparse type."""
    parts = text.split(",")
    if not all(part.strip().isdigit() for part in parts):
        raise argparse.ArgumentTypeError(f"{cut(text, 60)!r}: whole numbers, comma-separated, are needed")
    return [int(part) for part in parts]


def positive(text: str) -> float:
    """Return the number above zero that `text` states; an argparse type."""
    value = number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"{cut(text, 60)!r}: a number above zero is needed")
    return value


def not_negative(text: str) -> float:
    """Return the number, zero or above, that `text` states; an argparse type."""
    value = number(text)
    if value < 0.0:
        raise argparse.ArgumentTypeError(f"{cut(text, 60)!r}: a number not below zero is needed")
    return value


def number(text: str) -> float:
    """Return the finite number that `text` states; an argparse type."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{cut(text, 60)!r}: a finite number is needed")
    return value


# ----------------------------------------------------------------------------------------------------
# From command line arguments to a robot with its effects and the inputs that arrive at it.

_ROW = re.compile(r"row (\d+) \(time_s = [^)]*\)")  # as models and the simulation name a row of inputs


@dataclass(frozen=True)
class DrivenRobot:
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

    specified: RobotSpec
    robot: RobotSpec
    table: Table
    commanded: Inputs
    arriving: Inputs
    gravity_mps2: Array
    columns: Sequence[str] | None


def load(reference: str, settings: Sequence[str]) -> tuple[RobotSpec, RobotSpec]:
    """Return the robot as specified, and with its effects built in; both checked.

    Raises:
        InputError: unknown robot, key or effect, or an impossible robot.
    """
    specified = load_robot(reference, settings, "--set")
    return specified, built_in(specified, reference)


def drive(options: argparse.Namespace) -> DrivenRobot:
    """Return what the arguments ROBOT, --set, --inputs, --gravity and --columns name.

    Raises:
        InputError: any of them is wrong.
    """
    specified = load_robot(options.robot, options.settings, "--set")
    gravity_mps2 = np.array(gravity(options.gravity))
    names = columns(getattr(options, "columns", None))
    if names is not None:
        check_output_channels(specified, names, "--columns")
    table = read_table(options.inputs)
    commanded = read_inputs(specified, table)
    acting = in_force(specified, commanded, options.robot)
    return DrivenRobot(
        specified=acting.specified,
        robot=acting.robot,
        table=table,
        commanded=commanded,
        arriving=acting.inputs,
        gravity_mps2=gravity_mps2,
        columns=names,
    )


def inputs_until(driven: DrivenRobot, row: int | None, time_s: float | None) -> Inputs:
    """Return what arrives at the robot up to a row of the file, or up to a time of its clock.

    Args:
        driven: what a verb drives.
        row: the last row, 1 for the first; None: as `time_s` says.
        time_s: where the inputs end, on the line between two rows [s]; None: at the last row.

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

    Args:
        table: the file of inputs.
        always: put the file before every other error too.
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
    """Say on standard error which inputs are beyond what the robot can follow, a line for each column."""
    from catheter_sim.planning.bounded import beyond_limits

    for line in beyond_limits(driven.specified, driven.commanded):
        print(f"catheter-sim: warning: {with_lines(line, driven.table)}", file=sys.stderr)


def outputs(driven: DrivenRobot, postures: Sequence[Posture]) -> Table:
    """Return the output columns of `postures`, the first rows of the drive as they are observed."""
    return output_table(driven.specified, driven.table.time_s, postures, driven.columns)


def write_outputs(driven: DrivenRobot, postures: Sequence[Posture], path: str) -> None:
    """Write the output columns of `postures` to the CSV file `path`."""
    write_table(outputs(driven, postures), path)
