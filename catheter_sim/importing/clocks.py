"""A file's clock: the unit of its stamps, by name and by size."""

from __future__ import annotations

import numpy as np

from catheter_sim.diagnosis.mapping import DATE, FIRST_ROW, SECONDS, RawFile, file_map, seconds_of
from catheter_sim.importing.guesses import Guess
from catheter_sim.importing.heads import Heads, numbers_of

_EPOCHS = (
    (1e17, "ns"),
    (1e14, "us"),
    (1e11, "ms"),
    (1e8, "s"),
)  # stamps above it count since 1970, in this unit
_LONG_STEP = 5.0  # whole numbers that step by more are taken for ms


def clock_of(raw: RawFile, heads: Heads, rate_Hz: float | None) -> tuple[dict[str, object], list[Guess]]:
    """Return the entry `time_s` of a map, and how sure it is.

    Args:
        raw, heads: the file and what its head says.
        rate_Hz: of the frames, where the user states it.
    """
    entry: dict[str, object] = {"column": heads.clock}
    named = "its name" if heads.clock_named else "the first column that only rises"
    guesses = [Guess("map.time_s", f"column {heads.clock!r}", named, heads.clock_named)]
    numbers = numbers_of(raw, heads.clock)
    if numbers is None:
        return entry | {"unit": DATE}, [*guesses, Guess("map.time_s.unit", "dates", "its cells", True)]
    if heads.units[heads.clock] in SECONDS:
        unit, why, sure = heads.units[heads.clock], "the head", True
    elif "frame" in heads.clock.lower():
        entry |= {"unit": "frame", "rate_Hz": rate_Hz or 100.0}
        why = "as stated" if rate_Hz else "assumed: the file does not say it; --rate does"
        return entry, [*guesses, Guess("map.time_s.rate_Hz", f"{rate_Hz or 100.0:g}", why, bool(rate_Hz))]
    else:
        unit, why, sure = _by_size(numbers)
    guesses.append(Guess("map.time_s.unit", unit, why, sure))
    return entry | {"unit": unit}, guesses


def meeting(table: dict[str, dict[str, object]], raw: RawFile, log: RawFile) -> list[Guess]:
    """Let two files' clocks both count from their first rows, where they never meet; return what was guessed.

    Args:
        table: the map's clocks, `time_s` of the first file and `inputs_time_s` of the second; changed here.
        raw, log: the files.
    """
    mapping = file_map(table, (), (), raw.where)
    assert mapping is not None
    first = seconds_of(raw, mapping.time, raw.where)
    second = seconds_of(log, mapping.inputs_time, log.where)
    if first.max() >= second.min() and second.max() >= first.min():
        return []
    for entry in table.values():
        entry["origin"] = FIRST_ROW
    why = "the two files' clocks never meet; shift_s moves one"
    return [Guess(f"map.{name}.origin", FIRST_ROW, why, False) for name in table]


def _by_size(stamps: np.ndarray) -> tuple[str, str, bool]:
    """Return the unit of stamps, why, and whether it is sure."""
    first = float(np.nanmin(stamps))
    for least, unit in _EPOCHS:
        if first > least:
            return unit, f"stamps since 1970, {first:.4g}", True
    step = float(np.nanmedian(np.diff(stamps))) if len(stamps) > 1 else 1.0
    if step > _LONG_STEP and bool((stamps == np.round(stamps)).all()):
        return "ms", f"whole numbers that step by {step:g}", False
    return "s", f"a step of {step:.3g}", False
