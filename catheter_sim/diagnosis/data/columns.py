"""What the names of output columns say: unit, point, axis."""

from __future__ import annotations

import re
from collections.abc import Sequence

POINT = re.compile(r"(tip|body_\d+|marker_\w+)_([xyz])_mm")
QUATERNION = ("tip_qw", "tip_qx", "tip_qy", "tip_qz")
TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")


def unit_of(column: str) -> str:
    """Return the unit of an output column: "mm", "deg", "N", or "1" for parts of a quaternion."""
    unit = column.rsplit("_", 1)[-1]
    return unit if unit in ("mm", "deg", "N") else "1"


def points_of(columns: Sequence[str]) -> dict[str, dict[str, int]]:
    """Return the index of every measured coordinate by point ("tip", "body_3", "marker_a") and axis."""
    found: dict[str, dict[str, int]] = {}
    for index, name in enumerate(columns):
        match = POINT.fullmatch(name)
        if match:
            found.setdefault(match[1], {})[match[2]] = index
    return found
