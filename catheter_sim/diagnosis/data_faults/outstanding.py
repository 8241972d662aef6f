"""One trial, or two, that the model errs in far more than in any other."""

from __future__ import annotations

import numpy as np

from catheter_sim.diagnosis.data_faults.beside_model import BesideModel
from catheter_sim.diagnosis.data_faults.unrelated import delayed
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import (
    LATE_NOISE,
    LATE_ROWS,
    LONE_FOLLOWS_SHARE,
    LONE_MOTION_SHARE,
    NO_EQUILIBRIUM_ERROR,
    OTHERS_FOLLOW_SHARE,
    OUTSTANDING_SHARE,
    OUTSTANDING_TIMES,
    STEP_STRETCH_ROWS,
)


def outstanding_trials(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return the trials in which the model errs far more than in all others, at most a third of them.

    A cause of an error is at work in all trials, more in some and less in others; no gap lies between them.
    Nor does a trial follow its inputs no more where all others do.
    """
    return _far_worse(seen) or _following_nothing(seen)


def _far_worse(seen: BesideModel) -> tuple[DataFault, ...]:
    known = np.flatnonzero(seen.error_shares < NO_EQUILIBRIUM_ERROR)  # without a posture a model says nothing
    order = known[np.argsort(seen.error_shares[known])[::-1]].tolist()
    for count in range(1, len(order) // 3 + 1):
        odd, least = order[:count], seen.error_shares[order[count - 1]]
        next_one = seen.error_shares[order[count]]
        if least > max(OUTSTANDING_SHARE, OUTSTANDING_TIMES * next_one):
            return tuple(
                DataFault(
                    f"The model misses this trial by {100.0 * seen.error_shares[number]:.0f} % of the "
                    f"motion, every other trial by at most {100.0 * next_one:.0f} %. Are these the outputs "
                    "of this trial, of this robot, in the same set-up?",
                    seen.trials[number].file,
                )
                for number in sorted(odd)
            )
    return ()


def _following_nothing(seen: BesideModel) -> tuple[DataFault, ...]:
    shares = {number: _followed(seen, number) for number in range(len(seen.trials))}
    known = {number: share for number, share in shares.items() if share is not None}
    if len(known) < 3:
        return ()
    order = sorted(known, key=lambda number: known[number])
    if known[order[0]] > LONE_FOLLOWS_SHARE or known[order[1]] < OTHERS_FOLLOW_SHARE:
        return ()
    return (
        DataFault(
            "The outputs do not follow the inputs, as they do in every other trial. Are these the outputs of "
            "this trial, with their rows in order?",
            seen.trials[order[0]].file,
        ),
    )


def _followed(seen: BesideModel, number: int) -> float | None:
    """Return the share of the outputs' variance that is what the model says, now or some rows before.

    In any size; adjusted for the count of numbers fitted. None: the trial moves too little to tell.
    """
    if seen.motions[number] < LONE_MOTION_SHARE * float(np.median(seen.motions)):
        return None
    measured, model = seen.measured[number], seen.models[number]
    left = total = 0.0
    count = numbers = 0
    for column in seen.moves:
        computed = model[:, column]
        known = np.isfinite(measured[:, column])
        if known.sum() < STEP_STRETCH_ROWS:
            continue
        if float(np.std(computed[known])) < LATE_NOISE * seen.noise_of(column):
            continue
        late = [delayed(computed, rows) for rows in LATE_ROWS]
        features = np.column_stack([np.ones(len(computed)), computed, *late])[known]
        shown = measured[known, column]
        scaled = features / np.maximum(np.abs(features).max(axis=0), 1e-300)
        rest = shown - scaled @ np.linalg.lstsq(scaled, shown, rcond=None)[0]
        left, total = left + float(rest @ rest), total + len(shown) * float(np.var(shown))
        count, numbers = count + len(shown), numbers + features.shape[1]
    return 1.0 - left / (count - numbers) * count / total if total > 0.0 else None
