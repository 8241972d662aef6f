"""What a reader of a diagnosis must know, as values that the stages return."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Note:
    """A doubt or a fact.

    Attributes:
        code: which kind of note it is, in words that a program may ask for ("frozen_sensor").
        text: a sentence or two, for a person.
    """

    code: str
    text: str

    def __str__(self) -> str:
        return self.text
