"""Outputs that come before their inputs, or late in one trial alone: rows that were lost or put off."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data_faults.beside_model import BesideModel
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import (
    DRIVEN_SHARE,
    LATE_NOISE,
    LATE_OTHERS,
    STEP_LEFT_SHARE,
    STEP_ONE_WAY_ROWS,
    STEP_ROWS,
    STEP_STRETCH_ROWS,
    STEP_USUAL_TIMES,
)


def outputs_out_of_step(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return where outputs run ahead of their inputs, or lag behind them in one trial alone.

    What is measured before it is caused was put there: rows of one log are missing. A lag may be the robot's,
    but then other trials have it too, by as many seconds.
    """
    return _ahead(seen) or _late_alone(seen)


def _ahead(seen: BesideModel) -> tuple[DataFault, ...]:
    faults = []
    for number in range(len(seen.trials)):
        rows = len(seen.models[number])
        parts = [slice(0, rows)]
        if rows >= 2 * STEP_STRETCH_ROWS:
            parts += [slice(0, rows // 2), slice(rows // 2, rows)]
        for part in parts:
            shift = min(_best_shift(seen, models, number, part) for models in _models(seen))
            if shift < 0:
                faults.append(
                    DataFault(
                        f"The outputs come {-shift} rows before the inputs that cause them. Are rows of "
                        "the outputs lost, or are the two logs shifted against each other?",
                        seen.trials[number].file,
                        (part.start + 1, part.stop),
                    )
                )
                break
    return tuple(faults)


def _late_alone(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return the trials that lag by rows although the others would show as many seconds, and do not.

    Of the others only those count that drive the same inputs, as a channel may have a lag, or a dead-band,
    alone; and that are explained in time as well as the late one is put right.
    """
    models = seen.scaled_models
    whole = [slice(0, len(model)) for model in models]
    shifts = [_best_shift(seen, models, number, part) for number, part in enumerate(whole)]
    late = [number for number, shift in enumerate(shifts) if shift > 0]
    in_time = [number for number in range(len(seen.trials)) if number not in late]
    if not late or len(late) > max(1, len(in_time) // 2):
        return ()
    for number in late:
        put_right = _unexplained(seen, models, number, whole[number], shifts[number])
        others = [
            k
            for k in in_time
            if _drives_as_much(seen, k, number)
            and _unexplained(seen, models, k, whole[k]) <= STEP_USUAL_TIMES * put_right
        ]
        time_s = seen.trials[number].inputs.time_s
        seconds = float(np.median(time_s[shifts[number] :] - time_s[: -shifts[number]]))
        telling = [
            _unexplained(seen, models, k, whole[k], seconds=seconds)
            > LATE_OTHERS * _unexplained(seen, models, k, whole[k])
            for k in others
        ]
        if 2 * sum(telling) <= len(others):  # also where there is none
            return ()
    return tuple(
        DataFault(
            f"The outputs come {shifts[number]} rows late, and in the other trials they do not. Are the two "
            "logs of this trial shifted against each other?",
            seen.trials[number].file,
        )
        for number in late
    )


def _drives_as_much(seen: BesideModel, number: int, late: int) -> bool:
    """Return whether a trial drives each input that a late one drives, by a fair share of that."""
    mine, other = (np.ptp(seen.drives[k], axis=0) for k in (number, late))
    return bool((mine >= DRIVEN_SHARE * other).all())


def _models(seen: BesideModel) -> tuple[Sequence[Array], ...]:
    """Return the models as they are, and scaled: where all trials are out of step a scale fits to nothing."""
    return seen.models, seen.scaled_models


def _best_shift(seen: BesideModel, models: Sequence[Array], number: int, part: slice) -> int:
    """Return by how many rows outputs lag (ahead: below zero); 0 where no shift does far better."""
    length = part.stop - part.start
    if length < STEP_STRETCH_ROWS:
        return 0
    most = min(STEP_ROWS, length // 3)
    left = {shift: _unexplained(seen, models, number, part, shift) for shift in range(-most, most + 1)}
    best = min(left, key=lambda shift: left[shift])
    # At the end of what is looked at there is no least error.
    if left[0] < LATE_NOISE**2 or abs(best) < 2 or abs(best) == most:
        return 0
    # Put right, the trial must be as well explained as others are.
    others = [_unexplained(seen, models, k, slice(0, len(model))) for k, model in enumerate(models)]
    if left[best] > min(STEP_LEFT_SHARE * left[0], STEP_USUAL_TIMES * float(np.median(others))):
        return 0
    if best < 0 and not _either_way(seen, models, number, part, best):
        return 0
    rest = min(value for shift, value in left.items() if shift >= -1)
    return best if best > 0 or left[best] <= STEP_LEFT_SHARE * rest else 0


def _either_way(seen: BesideModel, models: Sequence[Array], number: int, part: slice, shift: int) -> bool:
    """Return whether a shift puts right what is measured on the ways out and on the ways home.

    Where the robot goes one way only, a bend that stays back by a constant looks as if it came earlier.
    """
    most = max(seen.moves, key=lambda column: float(np.nanstd(models[number][part, column])))
    step = np.gradient(models[number][:, most])
    for way in (step > 0.0, step < 0.0):
        left = _unexplained(seen, models, number, part, shift, only=way)
        before = _unexplained(seen, models, number, part, only=way)
        if not np.isfinite(left) or left > STEP_LEFT_SHARE * before:
            return False
    return True


def _unexplained(
    seen: BesideModel,
    models: Sequence[Array],
    number: int,
    part: slice,
    shift: int = 0,
    seconds: float = 0.0,
    only: np.ndarray | None = None,
) -> float:
    """Return the mean squared error, over the noise's, of what a model says so many rows and seconds earlier.

    `only`: the trial's rows that count. Rows for which the shifted model says nothing are left out. inf: too
    few rows.
    """
    rows = np.arange(part.start, part.stop)
    least = STEP_STRETCH_ROWS
    if only is not None:
        rows, least = rows[only[rows]], STEP_ONE_WAY_ROWS
    model, time_s = models[number], seen.trials[number].inputs.time_s
    rows = rows[(rows - shift >= 0) & (rows - shift < len(model))]
    moved = model[rows - shift]
    if seconds:
        rows = rows[time_s[rows] - seconds >= time_s[0]]
        moved = np.stack(
            [np.interp(time_s[rows] - seconds, time_s, model[:, k]) for k in range(model.shape[1])], axis=1
        )
    left, count = 0.0, 0
    for column in seen.moves:
        shown, computed = seen.measured[number][rows, column], moved[:, column]
        known = np.isfinite(shown) & np.isfinite(computed)
        if known.sum() < least:
            continue
        error = (shown[known] - computed[known]) / seen.noise_of(column)
        left, count = left + float(error @ error), count + len(error)
    return max(left / count, 1.0) if count else float("inf")
