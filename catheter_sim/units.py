"""Units at the edge: files and the command line use mm, deg and g; everything inside is SI.

A name ends in its unit. `SI_TO_FILE` pairs the unit suffix of an SI field with the suffix that the
same quantity carries in files, and the factor from the SI value to the file value.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import Any

# SI suffix -> (file suffix, file value = SI value * factor). Longest suffix wins.
SI_TO_FILE: dict[str, tuple[str, float]] = {
    "_N_m_per_rad": ("_N_mm_per_rad", 1e3),
    "_N_per_m": ("_N_per_mm", 1e-3),
    "_N_s_per_m": ("_N_s_per_m", 1.0),
    "_N_m2": ("_N_mm2", 1e6),
    "_rad_per_m": ("_deg_per_m", 180.0 / math.pi),
    "_m_per_s": ("_mm_per_s", 1e3),
    "_per_m": ("_per_m", 1.0),
    "_m2": ("_mm2", 1e6),
    "_m4": ("_mm4", 1e12),
    "_kg": ("_g", 1e3),
    "_rad": ("_deg", 180.0 / math.pi),
    "_Nm": ("_Nm", 1.0),
    "_m": ("_mm", 1e3),
    "_N": ("_N", 1.0),
    "_s": ("_s", 1.0),
}
_LONGEST_FIRST = sorted(SI_TO_FILE, key=len, reverse=True)


@cache
def file_name(si_name: str) -> tuple[str, float]:
    """Return the file's name for the SI field `si_name` and the factor from SI to the file's unit."""
    for suffix in _LONGEST_FIRST:
        if si_name.endswith(suffix):
            file_suffix, factor = SI_TO_FILE[suffix]
            return si_name.removesuffix(suffix) + file_suffix, factor
    return si_name, 1.0


def in_file_units(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return numbers or arrays by SI names (`tip_m`) under the names and in the units of files (`tip_mm`).

    What has no unit in its name, and what is in its file's unit already, stays as it is.
    """
    converted = {}
    for si_name, value in values.items():
        name, factor = file_name(si_name)
        converted[name] = value if factor == 1.0 else factor * value
    return converted


def si_factor(file_column: str) -> float:
    """Return the factor from the value of a file column (unit in its name) to SI.

    Only the units that channels have: mm, deg, N, Nm, s; quaternion parts have none.
    """
    unit = file_column.rsplit("_", 1)[-1]
    return {"mm": 1e-3, "deg": math.pi / 180.0}.get(unit, 1.0)
