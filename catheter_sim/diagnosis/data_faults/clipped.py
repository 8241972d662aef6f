"""Outputs that end at a limit of their sensor."""

from __future__ import annotations

import numpy as np

from catheter_sim.diagnosis.data_faults.beside_model import BesideModel
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import CLIPPED_BEYOND_SHARE, CLIPPED_ROWS, CLIPPED_TIMES


def clipped_outputs(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return the outputs that stand at exactly their largest or smallest value while the model moves on."""
    measured, models = np.concatenate(seen.measured), np.concatenate(list(seen.models))
    faults = []
    for column in seen.moves:
        values, computed = measured[:, column], models[:, column]
        known = np.isfinite(values)
        if not known.any():
            continue
        counts = np.unique(values[known], return_counts=True)[1]
        usual = int(np.sort(counts)[-3:][0])  # how often a value comes again that is no end
        for end, word in ((np.nanmax(values), "largest"), (np.nanmin(values), "smallest")):
            rows = known & (values == end)
            beyond = float(np.ptp(computed[rows])) if rows.any() else 0.0
            if rows.sum() < max(CLIPPED_ROWS, CLIPPED_TIMES * usual):
                continue
            if beyond > CLIPPED_BEYOND_SHARE * float(np.ptp(computed)):
                faults.append(
                    DataFault(
                        f"{int(rows.sum())} rows have exactly its {word} value, {end:g}, while the model "
                        f"moves by {beyond:.2g}. Does its sensor end there? Leave these cells empty.",
                        seen.columns[column],
                    )
                )
    return tuple(faults)
