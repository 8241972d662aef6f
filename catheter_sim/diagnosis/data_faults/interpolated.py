"""Outputs that were not measured in every row, but filled in between rows that were."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data_faults.beside_model import BesideModel
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import (
    FILLED_KINKS,
    FILLED_SHARE,
    FILLED_SLOPES_SHARE,
    ROUNDING_SHARE,
    STANDS_SHARE,
)


def interpolated_outputs(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return whether most rows lie on straight lines between few others, where nothing of the inputs turns.

    Measured values have noise in every row. What lies between them then moves at its own speed, whatever the
    robot did meanwhile, and a lag or a play is read into it.
    """
    if not seen.moves:
        return ()
    shares = [_filled_share(seen, column) for column in seen.moves]
    if float(np.median(shares)) < FILLED_SHARE:
        return ()
    return (
        DataFault(
            f"{100.0 * float(np.median(shares)):.0f} % of the rows lie on straight lines between the others. "
            "Were they filled in? Leave cells empty where nothing was measured.",
            ", ".join(seen.columns[column] for column in seen.moves),
        ),
    )


def _filled_share(seen: BesideModel, column: int) -> float:
    """Return the share of the rows that lie on straight lines, 0 where the inputs make these lines."""
    spread = max(float(np.nanstd(np.concatenate(seen.measured)[:, column])), 1e-12)
    straight = bends = rows = 0
    slopes: list[float] = []
    for measured, drive in zip(seen.measured, seen.drives, strict=True):
        step = np.diff(measured[:, column])
        bend = np.abs(np.diff(step))
        known = np.isfinite(bend)
        on_line = known & (bend < ROUNDING_SHARE * spread) & (np.abs(step[1:]) > ROUNDING_SHARE * spread)
        even = (np.abs(np.diff(drive, 2, axis=0)) <= STANDS_SHARE).all(axis=1)
        straight, rows = straight + int(on_line.sum()), rows + int(known.sum())
        bends += int((known & ~on_line & even).sum())
        slopes += step[1:][on_line].tolist()
    if not rows or bends < FILLED_KINKS:
        return 0.0
    kinds = len(_distinct(np.array(slopes), ROUNDING_SHARE * spread))
    # A sensor that counts coarsely has few slopes, each many times.
    return straight / rows if kinds >= FILLED_SLOPES_SHARE * bends else 0.0


def _distinct(values: Array, apart: float) -> Array:
    """Return values that differ from one another by more than rounding."""
    ordered = np.sort(values)
    return ordered[np.concatenate([[True], np.diff(ordered) > 4.0 * apart])] if len(ordered) else ordered
