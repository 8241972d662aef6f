"""Training rows that stand among the held-out ones once more."""

from __future__ import annotations

from collections.abc import Sequence

from catheter_sim.diagnosis.data.same_readings import Copy
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.report.result import DataFault


def copied_rows(trials: Sequence[Trial], copies: Sequence[Copy]) -> tuple[DataFault, ...]:
    """Return what to say of rows that train and are held out: a fit would be tested on what it was fitted to.

    Args:
        trials: as they stand in the data set.
        copies: of which one trains and the other is held out.
    """
    faults = []
    for copy in copies:
        first, second = trials[copy.first], trials[copy.second]
        one = "trains" if first.role == "train" else "is held out" if first.role else "has no role"
        faults.append(
            DataFault(
                f"Its readings are those of {first.file}, which {one}, to the last digit. It is a copy, not "
                "a repeated measurement. Leave one of them out.",
                second.file,
                copy.rows,
            )
        )
    return tuple(faults)
