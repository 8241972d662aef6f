"""What a reader of a diagnosis must know, as values that the stages return; also which part of it failed."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from catheter_sim.errors import TRACEBACK_VARIABLE, InputError, SimulationDiverged

T = TypeVar("T")


@dataclass(frozen=True)
class Note:
    """A doubt or a fact.

    `code` says which kind of note it is, in words that a program may ask for ("frozen_sensor"); `text`, in a
    sentence or two, is for a person.
    """

    code: str
    text: str

    def __str__(self) -> str:
        return self.text


class Attempts:
    """Calls the late parts of a diagnosis: where one fails, the others still run, and a note says so.

    A long search is never lost to a defect in what comes after it. What the user can mend (`InputError`), a
    lack of memory and an interruption are raised; so is everything where `TRACEBACK_VARIABLE` is set. `notes`
    has one of each part that failed, in order.
    """

    def __init__(self) -> None:
        self.notes: list[Note] = []

    def __call__(self, part: str, call: Callable[[], T], instead: Callable[[], T]) -> T:
        """Return what `call` returns, or `instead` where it fails; `part` names it, as a noun."""
        try:
            return call()
        except Exception as error:
            refused = isinstance(error, InputError) and not isinstance(error, SimulationDiverged)
            if refused or isinstance(error, MemoryError) or os.environ.get(TRACEBACK_VARIABLE):
                raise
            fault = " ".join(f"{type(error).__name__}: {error}".split())
            said = f"{part} is missing: the program failed there ({fault}). Please report this defect."
            if said not in [note.text for note in self.notes]:
                self.notes.append(Note("part_failed", said))
            return instead()
