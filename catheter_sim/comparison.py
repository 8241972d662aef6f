"""Two time series side by side: rows matched by time, how far apart they are, a picture of both."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError, unknown
from catheter_sim.tables import Table, own_clock

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SAME_TIME = 1e-6  # of the median step: rows nearer than that are of one moment
_MOST_PANELS = 12  # of a picture


@dataclass(frozen=True)
class Apart:
    """How far two series of one column are apart, in the column's unit.

    Attributes:
        column: its name.
        rms: root mean square of the difference.
        largest: its largest size.
        at_s: when that is, by the first file's clock [s].
        mean: of the second minus the first.
        range_: of the first series, largest minus smallest.
    """

    column: str
    rms: float
    largest: float
    at_s: float
    mean: float
    range_: float


@dataclass(frozen=True)
class Comparison:
    """Two tables at the same moments.

    Attributes:
        first, second: their columns in common, rows matched; both on the first one's clock.
        matched: rows of the first whose moment the second has too; the others lie between two of its rows.
        left_out: rows of the first at which the second has nothing.
        apart: by column.
    """

    first: Table
    second: Table
    matched: int
    left_out: int
    apart: tuple[Apart, ...]

    def text(self) -> str:
        """The comparison as lines of text."""
        rows = len(self.first.time_s)
        between = f" ({rows - self.matched} between two rows of the second)" if rows > self.matched else ""
        lines = [f"{rows} rows matched by time{between}; {self.left_out} rows of the first left out"]
        lines.append(
            f"{'column':28} {'rms':>10} {'largest':>10} {'at time_s':>12} {'mean':>10} {'range':>10}"
        )
        for item in self.apart:
            sizes = f"{item.rms:10.4g} {item.largest:10.4g} {item.at_s:12.6g}"
            lines.append(f"{item.column:28} {sizes} {item.mean:10.3g} {item.range_:10.4g}")
        distance = self.tip_distance_mm()
        if distance is not None:
            rms = float(np.sqrt(np.nanmean(distance**2)))
            lines.append(f"tip, distance in space: rms {rms:.4g} mm, largest {np.nanmax(distance):.4g} mm")
        return "\n".join(lines)

    def tip_distance_mm(self) -> Array | None:
        """The tip's distance between the two, shape (r,) [mm]; None where not both have it."""
        names = [f"tip_{axis}_mm" for axis in "xyz"]
        if not all(name in self.first.columns for name in names):
            return None
        apart = [self.second.columns[name] - self.first.columns[name] for name in names]
        return np.asarray(np.sqrt(sum(item**2 for item in apart)))

    def figure(self) -> Figure:
        """Both series of each column over time, at most 12 columns."""
        from matplotlib.figure import Figure

        shown = [item.column for item in self.apart][:_MOST_PANELS]
        figure = Figure(figsize=(9.0, 1.2 + 1.9 * len(shown)), layout="constrained")
        for panel, name in zip(np.ravel(figure.subplots(len(shown), 1, sharex=True)), shown, strict=True):
            panel.plot(self.first.time_s, self.first.columns[name], color="#222222", label=self.first.where)
            panel.plot(self.first.time_s, self.second.columns[name], color="#1f5f8b", label=self.second.where)
            panel.set_ylabel(name, fontsize=8)
            panel.tick_params(labelsize=8)
            panel.grid(color="0.92", linewidth=0.7)
            panel.spines[["top", "right"]].set_visible(False)
        figure.axes[0].legend(fontsize=9, frameon=False)
        figure.axes[-1].set_xlabel("time since the first row [s]", fontsize=9)
        return figure


def compare_tables(first: Table, second: Table, columns: Sequence[str] | None = None) -> Comparison:
    """Return two tables at the moments of the first's rows; each clock starts at its own first row.

    Args:
        first, second: columns of one name are compared; the second is taken linearly between its rows.
        columns: which; None: all that both have.

    Raises:
        InputError: no column or no moment in common, or time that does not increase.
    """
    common = [name for name in first.columns if name in second.columns]
    if not common:
        raise InputError(f"{first.where} and {second.where}: no column in common but time_s")
    for name in columns or ():
        if name not in common:
            raise unknown("column", name, common, "--columns")
    names = list(columns or common)
    for table in (first, second):
        table.require_increasing_time()
    a, b = own_clock(first.time_s), own_clock(second.time_s)
    step = float(np.median(np.diff(b))) if len(b) > 1 else 1.0
    inside = (a >= b[0] - _SAME_TIME * step) & (a <= b[-1] + _SAME_TIME * step)
    times = a[inside]
    if not len(times):
        raise InputError(f"{first.where} and {second.where}: no moment in common")
    nearest = np.abs(
        times[:, np.newaxis] - b[np.clip(np.searchsorted(b, times)[:, np.newaxis] + [-1, 0], 0, len(b) - 1)]
    )
    matched = int((nearest.min(axis=1) <= _SAME_TIME * step).sum())
    one = {name: first.columns[name][inside] for name in names}
    other = {name: np.interp(times, b, second.columns[name]) for name in names}
    apart = tuple(_apart(name, first.time_s[inside], one[name], other[name]) for name in names)
    return Comparison(
        Table(times, one, first.where),
        Table(times, other, second.where),
        matched,
        int((~inside).sum()),
        apart,
    )


def compare_files(
    first: str | os.PathLike[str], second: str | os.PathLike[str], columns: Sequence[str] | None = None
) -> Comparison:
    """Return two CSV files at the same moments, as `compare_tables` does."""
    from catheter_sim.tables import read_table

    return compare_tables(read_table(first), read_table(second), columns)


def _apart(name: str, time_s: Array, one: Array, other: Array) -> Apart:
    difference = other - one
    known = np.isfinite(difference)
    if not known.any():
        return Apart(name, np.nan, np.nan, np.nan, np.nan, np.nan)
    sizes = np.where(known, np.abs(difference), -1.0)
    row = int(np.argmax(sizes))
    return Apart(
        column=name,
        rms=float(np.sqrt((difference[known] ** 2).mean())),
        largest=float(sizes[row]),
        at_s=float(time_s[row]),
        mean=float(difference[known].mean()),
        range_=float(np.ptp(one[known])),
    )
