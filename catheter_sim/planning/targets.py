"""What is asked of a robot's posture, row by row, and by how much a posture misses it.

A target is any output column in mm or deg, or the direction of the tip's axis as `tip_direction_x`, `_y`,
`_z`. Misses of all kinds become one vector without unit: a mm counts as its share of the robot's length, a
radian as one. So a degree weighs as much as 1.7 % of the length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import QUATERNION, check_output_channels, output_channels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, unknown
from catheter_sim.tables import Table

DIRECTION = ("tip_direction_x", "tip_direction_y", "tip_direction_z")
_SHORTEST = 1e-6  # a direction's length


@dataclass(frozen=True)
class Targets:
    """What is asked, row by row.

    Attributes:
        time_s: shape (r,) [s].
        names: columns in mm, then those in deg, then the direction's three if asked.
        asked: their values, shape (r, m); NaN: not asked in this row.
        millimetres, degrees: how many of the columns are in mm and in deg.
        length_mm: by which mm are measured.
    """

    time_s: Array
    names: tuple[str, ...]
    asked: Array
    millimetres: int
    degrees: int
    length_mm: float

    @property
    def observed(self) -> tuple[str, ...]:
        """The output columns that show what is asked: the tip's quaternion shows its direction."""
        plain = self.names[: self.millimetres + self.degrees]
        return (*plain, *QUATERNION) if len(self.names) > len(plain) else plain

    def seen(self, outputs: Array) -> Array:
        """Return the values of `names` in outputs of `observed`, shape (..., m)."""
        plain = self.millimetres + self.degrees
        if len(self.names) == plain:
            return outputs
        return np.concatenate([outputs[..., :plain], axis_of(outputs[..., plain:])], axis=-1)

    def misses(self, seen: Array, asked: Array) -> Array:
        """Return seen less asked without unit, shape (..., m); 0 where nothing is asked."""
        unit = np.ones(len(self.names))
        unit[: self.millimetres] = 1.0 / self.length_mm
        unit[self.millimetres : self.millimetres + self.degrees] = np.radians(1.0)
        missed = (seen - asked) * unit
        return np.where(np.isnan(np.broadcast_to(asked, missed.shape)), 0.0, missed)

    def error_mm(self, misses: Array) -> Array:
        """Return the distance that misses (..., m) are of what is asked in mm, shape (...) [mm]."""
        return np.asarray(np.linalg.norm(misses[..., : self.millimetres], axis=-1) * self.length_mm)

    def error_deg(self, misses: Array) -> Array:
        """Return the largest miss of what is asked in deg, the direction's included, shape (...) [deg]."""
        plain = self.millimetres + self.degrees
        turned = np.abs(misses[..., self.millimetres : plain]).max(axis=-1, initial=0.0)
        if len(self.names) > plain:
            chord = np.linalg.norm(misses[..., plain:], axis=-1)
            turned = np.maximum(turned, 2.0 * np.arcsin(np.clip(0.5 * chord, 0.0, 1.0)))
        return np.degrees(turned)


def axis_of(quaternions: Array) -> Array:
    """Return where the z axis of orientations (w, x, y, z), shape (..., 4), points, shape (..., 3)."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=-1)


def targets_of(robot: RobotSpec, table: Table, length_m: float) -> Targets:
    """Return what the columns of `table` ask of `robot`; an empty cell asks nothing.

    Raises:
        InputError: a column that is no target, a row that asks nothing, half a direction, or time that does
            not increase.
    """
    choices = [name for name in output_channels(robot) if name.endswith(("_mm", "_deg"))]
    for name in table.columns:
        if name not in choices and name not in DIRECTION:
            shown = [item for item in choices if item.startswith(("tip_", "angle_", "marker_"))]
            raise unknown("target", name, [*shown, *DIRECTION, "body_<k>_x_mm ..."], table.where)
    check_output_channels(robot, [name for name in table.columns if name not in DIRECTION], table.where)
    table.require_increasing_time()
    lengths = [name for name in table.columns if name.endswith("_mm")]
    angles = [name for name in table.columns if name.endswith("_deg")]
    direction = [name for name in DIRECTION if name in table.columns]
    if direction and len(direction) < len(DIRECTION):
        raise InputError(f"{table.where}: a direction has three columns: {', '.join(DIRECTION)}")
    names = (*lengths, *angles, *direction)
    if not names:
        raise InputError(f"{table.where}: no targets; choices: tip_x_mm, tip_y_mm, tip_z_mm and others")
    asked = np.stack([table.columns[name] for name in names], axis=1)
    empty = np.isnan(asked).all(axis=1)
    if empty.any():
        raise InputError(f"{table.row(int(np.argmax(empty)))}: no target")
    if direction:
        asked[:, -3:] = _unit_vectors(asked[:, -3:], table)
    return Targets(table.time_s, names, asked, len(lengths), len(angles), 1e3 * length_m)


def _unit_vectors(direction: Array, table: Table) -> Array:
    length = np.linalg.norm(direction, axis=1)
    whole = np.isnan(direction).sum(axis=1) % 3 == 0
    bad = ~whole | (length < _SHORTEST)
    if bad.any():
        raise InputError(
            f"{table.row(int(np.argmax(bad)))}: tip_direction: three numbers, not all 0, are needed"
        )
    return direction / length[:, np.newaxis]
