"""A trial whose outputs do not follow its inputs, as those of the other trials do."""

from __future__ import annotations

import numpy as np

from catheter_sim.diagnosis.data_faults.beside_model import BesideModel
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import (
    LATE_NOISE,
    LATE_ROWS,
    LONE_FOLLOWS_SHARE,
    OTHERS_FOLLOW_SHARE,
    STEP_STRETCH_ROWS,
)


def trials_that_do_not_follow(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return the trials whose outputs are hardly what the model says, now or some rows before, in any size.

    In the other trials they are. So the outputs may be of another trial, or their rows in another order.
    """
    follow = {
        number: share for number in range(len(seen.trials)) if (share := _followed(seen, number)) is not None
    }
    loose = [number for number, share in follow.items() if share < LONE_FOLLOWS_SHARE]
    firm = [number for number, share in follow.items() if share > OTHERS_FOLLOW_SHARE]
    if not loose or len(firm) < max(2, len(loose)):
        return ()
    return tuple(
        DataFault(
            "what is measured does not follow the inputs, as it does in other trials: are these the outputs "
            "of this trial, with their rows in order?",
            seen.trials[number].file,
        )
        for number in loose
    )


def _followed(seen: BesideModel, number: int) -> float | None:
    """Return the share of the outputs' variance that follows; None where little would be seen of it."""
    measured, model = seen.measured[number], seen.models[number]
    left = total = 0.0
    count = numbers = 0
    for column in seen.moves:
        computed = model[:, column]
        noise = seen.noise_of(column)
        known = np.isfinite(measured[:, column])
        late = [
            np.concatenate([np.full(min(k, len(computed)), computed[0]), computed[:-k]]) for k in LATE_ROWS
        ]
        features = np.column_stack([np.ones(len(computed)), computed, *late])[known]
        if known.sum() < STEP_STRETCH_ROWS or float(np.std(computed[known])) < LATE_NOISE * noise:
            continue
        shown = measured[known, column]
        scaled = features / np.maximum(np.abs(features).max(axis=0), 1e-300)
        rest = shown - scaled @ np.linalg.lstsq(scaled, shown, rcond=None)[0]
        # what must have moved by the model, whether or not anything is seen to
        expected = max(float(np.var(shown)), float(np.var(computed[known])))
        left, total = left + float(rest @ rest), total + len(shown) * expected
        count, numbers = count + len(shown), numbers + features.shape[1]
    if not count or total == 0.0:
        return None
    return 1.0 - left / (count - numbers) * count / total
