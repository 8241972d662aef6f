"""The one error class for everything a user can cause, and the line that it prints; and the class of notes.

A line stays readable whatever the input: a value, a list of choices and the whole message are cut to a
length that a terminal shows at a glance.
"""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Iterable
from typing import Any

LONGEST_MESSAGE = 500  # characters
TRACEBACK_VARIABLE = "CATHETER_SIM_TRACEBACK"  # set to anything: defects and warnings show in full
_LONGEST_CHOICES = 300  # characters; of more, the nearest names and their number
_LONGEST_NAME = 60
_NEAREST = 5


class InputError(ValueError):
    """Bad usage or bad input: one line that names the file, row or key, and the choices."""

    def __init__(self, message: str | BaseException) -> None:
        text = str(message)  # Gymnasium raises an error of another process with that error for its text
        lines = text.splitlines()  # a name may hold a line's end
        super().__init__(cut(text if len(lines) < 2 else " ".join(text.split()), LONGEST_MESSAGE))


class RobotNote(UserWarning):
    """One line about what was changed in a robot so that it can be built, or assumed as it was read."""


class SimulationDiverged(InputError):
    """The simulation left the finite numbers; the message says at which row and time."""


def cut(text: str, longest: int) -> str:
    """Return `text` in at most `longest` characters; what is too long loses its middle.

    The start of a message says where, its end what is needed.
    """
    if len(text) <= longest:
        return text
    end = longest // 3
    return f"{text[: longest - end - 5]} ... {text[-end:]}"


def shown(value: Any) -> str:
    """Return `value` as Python writes it, on one line, shortened where it is long or deeply nested."""
    writer = reprlib.Repr()
    writer.maxstring = writer.maxother = writer.maxlong = _LONGEST_NAME
    writer.maxlevel = 3
    try:
        return " ".join(writer.repr(value).split())
    except ValueError:  # Python writes no whole number of more than 4300 digits
        return "a whole number of thousands of digits"
    except Exception:  # whatever a user's own class raises
        return f"<{type(value).__name__}>"


def require_type(name: str, value: Any, wanted: type | tuple[type, ...], needed: str) -> None:
    """Raise `InputError` where the argument `name` is of no class `wanted`; `needed` says what would be."""
    if not isinstance(value, wanted):
        raise InputError(f"{name} = {shown(value)}: {needed} is needed")


def unknown(what: str, name: str, choices: Iterable[str], where: str = "") -> InputError:
    """Return the error for a name that is not among `choices`.

    Args:
        what: kind of thing, as a singular noun ("robot", "channel").
        name: what the user wrote.
        choices: the valid names; of many, the nearest to `name` are shown, and how many there are.
        where: file, row or key at which it stood, if any.
    """
    prefix = f"{where}: " if where else ""
    names = list(choices)
    listed = ", ".join(names) or "(none)"
    if len(listed) > _LONGEST_CHOICES:
        nearest = difflib.get_close_matches(name[:_LONGEST_NAME], names, _NEAREST, cutoff=0.4)
        names_first = dict.fromkeys([*nearest, *names])
        listed = f"{_beginning(names_first)}, ... ({len(names)} in all)"
    return InputError(f"{prefix}unknown {what} {shown(name)}; choices: {listed}")


def _beginning(names: Iterable[str]) -> str:
    """Return as many of `names` as have room, the first at least."""
    text = ""
    for name in names:
        longer = f"{text}, {name}" if text else name
        if text and len(longer) > _LONGEST_CHOICES // 2:
            break
        text = longer
    return cut(text, _LONGEST_CHOICES)
