"""A robot's posture from readings of its actuators, with the region that holds the truth."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from catheter_sim.core.requirements import number_of
from catheter_sim.errors import InputError, unknown
from catheter_sim.public.arguments import AT_REST, columns_of, gravity_of, mapping_of, path_of, robot_of
from catheter_sim.public.listing import data_frame, listing_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.planning.sensing import Cause, Sensed
    from catheter_sim.tables import Table


@dataclass(frozen=True, repr=False)
class Sensing:
    """Postures sensed, row by row: see `sense`, which returns it.

    Attributes:
        robot: as it was specified, effects named.
        sensed: values, regions and what each cause adds to them, in the columns' units.

    Examples:
        >>> import catheter_sim as cs
        >>> pulled = {"time_s": [0.0, 1.0], "tension_active_N": [0.0, 20.0]}
        >>> found = cs.sense("chest_tube_section", pulled, noise_tension_N=0.1, columns=["tip_x_mm"])
        >>> tip = found.to_table().columns
        >>> bool(tip["tip_x_mm_low"][1] < 169.54 < tip["tip_x_mm_high"][1])
        True
    """

    robot: RobotSpec
    sensed: Sensed

    def __len__(self) -> int:
        return len(self.sensed.time_s)

    def to_table(self) -> Table:
        """Return each column with the ends of its region, `tip_x_mm`, `tip_x_mm_low`, `tip_x_mm_high`."""
        from catheter_sim.tables import Table as Value

        columns: dict[str, Any] = {}
        for k, name in enumerate(self.sensed.columns):
            columns[name] = self.sensed.value[:, k]
            columns[f"{name}_low"], columns[f"{name}_high"] = self.sensed.low[:, k], self.sensed.high[:, k]
        return Value(self.sensed.time_s, columns)

    def to_dataframe(self) -> Any:
        """Return `to_table` with its `time_s` as a pandas `DataFrame`.

        Raises:
            InputError: pandas is not installed.
        """
        table = self.to_table()
        return data_frame({"time_s": table.time_s, **table.columns})

    def causes(self) -> dict[str, dict[str, float]]:
        """Return the largest standard deviation that each cause alone makes, by cause and column."""
        return {
            cause: dict(zip(self.sensed.columns, part.max(axis=0).tolist(), strict=True))
            for cause, part in self.sensed.deviations.items()
        }

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write `to_table` to a CSV file.

        Raises:
            InputError: the file cannot be written, or does not end in `.csv`.
        """
        from catheter_sim.tables import write_table

        file = path_of(path, "save")
        if not file.lower().endswith(".csv"):
            raise InputError(f"{file}: what is sensed is saved as a table; choices: .csv")
        write_table(self.to_table(), file)

    def plot(self, ax: Any = None) -> Figure:
        """Return a figure of every column over time with its region.

        Args:
            ax: axes of matplotlib to draw into, one a column; None: a new figure.

        Raises:
            InputError: `ax` holds something else.
        """
        from catheter_sim.public.planning_figures import sensing_figure

        return sensing_figure(self, ax)

    def __repr__(self) -> str:
        return f"<Sensing of {self.robot.name}: {len(self)} rows>"

    def _repr_html_(self) -> str:
        table = self.to_table()
        return listing_of(repr(self)[1:-1], {"time_s": table.time_s, **table.columns})._repr_html_()


def sense(
    robot: RobotSpec | str | os.PathLike[str],
    readings: Any,
    noise_tension_N: float = 0.0,
    noise_displacement_mm: float = 0.0,
    noise_position_mm: float = 0.0,
    noise_angle_deg: float = 0.0,
    uncertain: Mapping[str, float] | None = None,
    columns: Sequence[str] | None = None,
    gravity_mps2: Sequence[float] = AT_REST,
) -> Sensing:
    """Return the posture of `robot` from what its actuators measured, with regions of 95 %.

    Args:
        robot: a robot, its id or its file.
        readings: a mapping, a data frame or a CSV file: `time_s` and the robot's input columns as they were
            measured, and any output column in mm, deg or N that was measured besides (`tension_bending_N` of
            a catheter, `angle_bending_deg` of a tracker), NaN where it was not.
        noise_tension_N, noise_displacement_mm: standard deviation of the measured inputs in N and in mm.
        noise_position_mm, noise_angle_deg: of measured outputs in mm and in deg; tensions have the inputs'.
        uncertain: half of the even range of numbers by their dotted key, in the key's unit
            (`{"friction.mu": 0.05}`); default: what differs from one specimen of a published robot to the
            next. An empty mapping: the robot is as specified.
        columns: output columns wanted; default: the tip's place, and a catheter's angles.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: anything is not possible, or a row has no balance.

    Examples:
        >>> import catheter_sim as cs
        >>> pulled = {"time_s": [0.0], "displacement_bending_mm": [2.0]}
        >>> found = cs.sense("mitral_transseptal", pulled, noise_displacement_mm=0.01, uncertain={})
        >>> list(found.causes())
        ['noise of the inputs']
    """
    from catheter_sim.channels import check_output_channels
    from catheter_sim.planning.sensing import Noise, readings_of
    from catheter_sim.planning.sensing import sense as solve
    from catheter_sim.public.inverse import clocked_table

    value = robot_of(robot)
    sizes = {
        "noise_tension_N": noise_tension_N,
        "noise_displacement_mm": noise_displacement_mm,
        "noise_position_mm": noise_position_mm,
        "noise_angle_deg": noise_angle_deg,
    }
    needed = "a standard deviation, a finite number from 0,"
    noise = Noise(
        *(number_of(size, name, needed, lambda of: 0.0 <= of < float("inf")) for name, size in sizes.items())
    )
    names = sensed_columns(value) if columns is None else columns_of(columns)
    check_output_channels(value, names, "columns")
    asked = readings_of(value, clocked_table(readings, "readings"), noise)
    causes = causes_of(value, uncertain, "uncertain")
    return Sensing(value, solve(value, asked, noise, causes, names, gravity_of(gravity_mps2)))


def sensed_columns(robot: RobotSpec) -> list[str]:
    """Return the columns that are sensed unless others are asked for."""
    from catheter_sim.channels import output_channels

    return [
        name
        for name in output_channels(robot)
        if name in ("tip_x_mm", "tip_y_mm", "tip_z_mm") or name.startswith("angle_")
    ]


def causes_of(robot: RobotSpec, uncertain: Mapping[str, float] | None, where: str) -> list[Cause]:
    """Return what of a robot is known only within a range.

    Args:
        robot: as it is specified.
        uncertain: half of the range by dotted key; None: as published.
        where: what to call it in errors.

    Raises:
        InputError: no such number, or half a range that is none.
    """
    from catheter_sim.catalogue import PUBLISHED
    from catheter_sim.core.document import leaves, to_document
    from catheter_sim.core.drive import READ_WITH
    from catheter_sim.planning.sensing import Cause as Value
    from catheter_sim.planning.sensing import within_factor, within_half

    if uncertain is None:
        published = PUBLISHED.get(robot.name)
        ranges = published.uncertain if published else ()
        return [Value(item.name, within_factor(item.keys, item.half)) for item in ranges]
    choices = dict(leaves(to_document(robot)))
    found = []
    for key, half in mapping_of(uncertain, where, "numbers of the robot to half their range").items():
        if key not in choices:
            raise unknown("number", key, choices, where)
        if key.endswith(READ_WITH):
            raise InputError(f"{where}: {key}: inputs are read with it, it has no range")
        if not np.isfinite(choices[key]):
            raise InputError(f"{where}: {key}: is infinite as specified, it has no range")
        needed = "half a range, above zero,"
        size = number_of(half, f"{where}: {key}", needed, lambda of: 0.0 < of < float("inf"))
        found.append(Value(key, within_half(key, size)))
    return found
