"""Arguments that several verbs share, and how their texts are read."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

from catheter_sim.errors import InputError, cut
from catheter_sim.files import check_output_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Drawn(Protocol):
    """A result that can be drawn."""

    def plot(self) -> Figure:
        """Return its figure."""


_VECTORS = ("--gravity", "--look-at")
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
        elif word in _VECTORS and waiting and not waiting[0].startswith("--"):
            words.append(f"{word}={waiting.pop(0)}")
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


def add_inputs(parser: argparse.ArgumentParser, required: bool = True) -> None:
    """Add --inputs, --trial, --other-robot and --gravity."""
    parser.add_argument(
        "--inputs",
        metavar="IN.csv",
        required=required,
        help="inputs over time, a trial's own file, or a data set",
    )
    parser.add_argument("--trial", metavar="NAME", help="trial of a data set: its file without the ending")
    parser.add_argument("--other-robot", action="store_true", help="take a trial of another robot")
    parser.add_argument(
        "--gravity",
        metavar="GX,GY,GZ",
        help="in the base frame [m/s^2]; default that of the trial's data set, else 0,0,0",
    )


def add_gravity(parser: argparse.ArgumentParser) -> None:
    """Add --gravity."""
    parser.add_argument(
        "--gravity",
        metavar="GX,GY,GZ",
        default="0,0,0",
        help="in the base frame [m/s^2]; default 0,0,0 (weight does not act)",
    )


def add_columns(parser: argparse.ArgumentParser) -> None:
    """Add --columns."""
    parser.add_argument(
        "--columns",
        metavar="A,B,...",
        help="output columns to write, as tip_x_mm,tip_z_mm,body_15_x_mm; default all",
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
    """Return the vector [m/s^2] that `--gravity` states, as `vector`."""
    return vector(text, "--gravity", "m/s^2", "gx,gy,gz")


def vector(text: str, option: str, unit: str, names: str = "x,y,z") -> tuple[float, float, float]:
    """Return the vector that an option states.

    Raises:
        InputError: not three finite numbers.
    """
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"{option} {text}: three numbers {names} in {unit} are needed") from None
    if not all(math.isfinite(part) for part in (x, y, z)):
        raise InputError(f"{option} {text}: three finite numbers in {unit} are needed")
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
