"""The one error class for everything a user can cause, and the line that it prints."""

from __future__ import annotations

from collections.abc import Iterable


class InputError(ValueError):
    """Bad usage or bad input: one line that names the file, row or key, and the choices."""


class SimulationDiverged(InputError):
    """The simulation left the finite numbers; the message says at which row and time."""


def unknown(what: str, name: str, choices: Iterable[str], where: str = "") -> InputError:
    """Return the error for a name that is not among `choices`.

    Args:
        what: kind of thing, as a singular noun ("robot", "channel").
        name: what the user wrote.
        choices: the valid names.
        where: file, row or key at which it stood, if any.
    """
    prefix = f"{where}: " if where else ""
    return InputError(f"{prefix}unknown {what} {name!r}; choices: {', '.join(choices) or '(none)'}")
