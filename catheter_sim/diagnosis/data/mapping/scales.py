"""Units that a file may be in, and the factor from each to the unit of a channel."""

from __future__ import annotations

import math
from collections.abc import Mapping

from catheter_sim.errors import unknown

# Of a channel's unit: units of files, and what a file's number is multiplied by.
UNITS: Mapping[str, Mapping[str, float]] = {
    "mm": {"mm": 1.0, "m": 1e3, "cm": 10.0, "um": 1e-3, "in": 25.4},
    "deg": {"deg": 1.0, "rad": 180.0 / math.pi, "turn": 360.0},
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "gf": 9.80665e-3, "kgf": 9.80665, "lbf": 4.4482216152605},
    "Nm": {"Nm": 1.0, "Nmm": 1e-3, "mNm": 1e-3},
    "1": {"1": 1.0},
}
SECONDS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
DATE = "date"  # texts such as 2026-05-11T18:30:02.5
SPOOL = UNITS["deg"]  # of a motor that winds a tendon; a spool's radius turns its angle into a way


def channel_unit(channel: str) -> str:
    """Return the unit of a channel, the end of its name; "1" for parts of a quaternion."""
    unit = channel.rsplit("_", 1)[-1]
    return unit if unit in UNITS else "1"


def factor_to(channel: str, unit: str, spool_radius_mm: float | None, where: str) -> float:
    """Return what a number in `unit` is multiplied by to be the channel's.

    Args:
        channel: its name.
        unit: the file's.
        spool_radius_mm: of the spool on a motor whose angle the file has; None: none is stated.
        where: file and key, for errors.

    Raises:
        InputError: a unit that the channel cannot have; the message names the choices.
    """
    own = channel_unit(channel)
    if spool_radius_mm is not None:
        if unit not in SPOOL:
            raise unknown("unit", unit, SPOOL, f"{where}: with spool_radius_mm")
        return math.radians(SPOOL[unit]) * spool_radius_mm
    if unit not in UNITS[own]:
        choices = [*UNITS[own], *(f"{name} with spool_radius_mm" for name in SPOOL if own == "mm")]
        raise unknown("unit", unit, choices, f"{where}: unit")
    return UNITS[own][unit]
