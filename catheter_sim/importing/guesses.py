"""What a proposal says, and how sure it is of it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Guess:
    """One thing that a proposal settles.

    Attributes:
        key: what of the data set it settles, as `map.tip.unit`.
        said: what was taken, in words.
        why: what it is taken from.
        sure: whether the file itself says so, or only makes it likely.
    """

    key: str
    said: str
    why: str
    sure: bool

    def __str__(self) -> str:
        """The guess in one line."""
        said = " ".join(
            f"{self.key}: {self.said} ({self.why})".split()
        )  # a column's name may hold a line's end
        return f"{'sure  ' if self.sure else 'UNSURE'}  {said}"
