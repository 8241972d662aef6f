"""What a kind of spoiled data is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from catheter_sim.blind_bench.spoiled.recording import Recording

Spoil = Callable[[Recording, np.random.Generator], Recording]
# The lines of one file, its header first.
Respell = Callable[[list[str], np.random.Generator], list[str]]


def unchanged(recording: Recording, generator: np.random.Generator) -> Recording:
    """Return a recording as it is."""
    return recording


def any_recording(recording: Recording) -> bool:
    """Every recording can be spoiled so."""
    return True


@dataclass(frozen=True)
class Kind:
    """One way to spoil a recording.

    Attributes:
        name: of the kind.
        words: what happened, in one line.
        spoil: what it does to the numbers.
        fits: whether it does anything to a recording.
        alike: causes that say the very same; to name one of them is right.
        respell: what it does to the last file as a text.
        sound: nothing is wrong: data that look suspect are a mistake of the diagnosis.
    """

    name: str
    words: str
    spoil: Spoil = unchanged
    fits: Callable[[Recording], bool] = any_recording
    alike: tuple[str, ...] = ()
    respell: Respell | None = None
    sound: bool = False
