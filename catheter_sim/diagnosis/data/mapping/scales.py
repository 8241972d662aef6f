"""Units that a file may be in, and the factor from each to the unit of a channel."""

from __future__ import annotations

import math
from collections.abc import Mapping

from catheter_sim.errors import InputError, unknown

COUNTS = "counts"  # of an encoder; `counts_per_turn` says how many make a turn
# Of a channel's unit: units of files, and what a file's number is multiplied by.
UNITS: Mapping[str, Mapping[str, float]] = {
    "mm": {"mm": 1.0, "m": 1e3, "cm": 10.0, "um": 1e-3, "in": 25.4},
    "deg": {"deg": 1.0, "rad": 180.0 / math.pi, "turn": 360.0},
    "rad": {"deg": math.pi / 180.0, "rad": 1.0, "turn": 2.0 * math.pi},
    "m": {"mm": 1e-3, "m": 1.0, "cm": 1e-2, "um": 1e-6, "in": 25.4e-3},
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "gf": 9.80665e-3, "kgf": 9.80665, "lbf": 4.4482216152605},
    "Nm": {"Nm": 1.0, "Nmm": 1e-3, "mNm": 1e-3},
    "1": {"1": 1.0},
}
SECONDS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
DATE = "date"  # texts such as 2026-05-11T18:30:02.5
ANGLES = (*UNITS["deg"], COUNTS)  # of a motor; a spool's radius turns its angle into a way


def channel_unit(channel: str) -> str:
    """Return the unit of a channel, the end of its name; "1" for parts of a quaternion."""
    unit = channel.rsplit("_", 1)[-1]
    return unit if unit in ("mm", "deg", "N", "Nm") else "1"


def factor_to(
    own: str,
    unit: str,
    where: str,
    spool_radius_mm: float | None = None,
    counts_per_turn: float | None = None,
) -> float:
    """Return what a number in `unit` is multiplied by to be a channel's.

    Args:
        own: the channel's unit.
        unit: the file's.
        where: file and key, for errors.
        spool_radius_mm: of the spool on a motor whose angle the file has; None: none is stated.
        counts_per_turn: of an encoder whose counts the file has; None: none is stated.

    Raises:
        InputError: a unit that the channel cannot have, the message names the choices; or counts without
            `counts_per_turn`, or the other way round.
    """
    units = UNITS[own] if spool_radius_mm is None else UNITS["rad"]
    choices = [*units, *([COUNTS] if "turn" in units else [])]
    if unit not in choices:
        if spool_radius_mm is not None:
            raise unknown("unit", unit, choices, f"{where}: with spool_radius_mm")
        choices += [f"{name} with spool_radius_mm" for name in ANGLES if own == "mm"]
        raise unknown("unit", unit, choices, f"{where}: unit")
    if (unit == COUNTS) != (counts_per_turn is not None):
        raise InputError(f'{where}: counts_per_turn goes with unit = "{COUNTS}", and with no other')
    factor = units[unit] if counts_per_turn is None else units["turn"] / counts_per_turn
    return factor if spool_radius_mm is None else factor * spool_radius_mm
