"""Whether enough was measured to name any cause, as far as the files alone say: no model runs for it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.cycles import stretch_of
from catheter_sim.diagnosis.data.trials import Trial, all_inputs, measured_from, measured_of
from catheter_sim.diagnosis.thresholds import (
    FEWEST_VALUES,
    GAIN_CHANCE,
    LEAST_BLOCK_S,
    NOISE_ROWS,
    PAYS_CHANCE,
    STILL_SHARE,
)


def too_little(
    train: Sequence[Trial], heldout: Sequence[Trial], columns: Sequence[str], moving: bool
) -> tuple[str, ...]:
    """Return what was measured too little to name any cause: a few sentences each; (): nothing.

    Of n stretches, all gain by chance with a probability of 2^-n (`fitting.evidence.chance_of_gain`). So
    many stretches are needed that this can be as small as a cause needs it.

    Args:
        train, heldout: the trials.
        columns: the outputs.
        moving: the robot moved while it was measured.
    """
    proving = max(
        sum(_stretches((trial,), mine, moving) for trial in heldout) for mine in _by_unit(columns).values()
    )
    learnt = too_little_to_learn(train, columns)
    teaching, least = _stretches(train, columns, moving), _needed(PAYS_CHANCE)
    if not learnt and teaching < least:
        learnt = (_too_short("Training", "Record", train, columns, moving, teaching, least),)
    least = _needed(GAIN_CHANCE)
    if proving < least:
        said = "Held-out", "Record or hold out"
        return (*learnt, _too_short(*said, heldout, columns, moving, proving, least))
    if _still(train, heldout, columns):
        return (
            *learnt,
            "The robot does not move in the held-out trials. Naming a cause needs held-out data that move. "
            "Hold out a trial in which the inputs change.",
        )
    unmeasured = [unit for unit, mine in _by_unit(columns).items() if not _measured(heldout, mine)]
    if unmeasured:
        return (
            *learnt,
            f"Held-out data have no value in {_said(unmeasured)}, training data have. "
            "Hold out a trial in which it was measured.",
        )
    return learnt


def can_be_fitted(train: Sequence[Trial], heldout: Sequence[Trial], columns: Sequence[str]) -> bool:
    """Return whether there is enough to fit anything: to see the noise of every unit, and to test it."""
    driven = not too_little_to_learn(train, columns, fewest=0)
    return driven and all(_measured(heldout, mine) for mine in _by_unit(columns).values())


def too_little_to_learn(
    train: Sequence[Trial], columns: Sequence[str], fewest: int = FEWEST_VALUES
) -> tuple[str, ...]:
    """Return what the training trials hold too little of, to fit any cause; `fewest`: values needed."""
    values = sum(int(np.isfinite(measured_of(trial, columns)).sum()) for trial in train)
    if values < fewest:
        return (
            f"Only {values} measured values to learn from: fewer than {fewest} prove nothing. "
            "Record longer trials, or more of them.",
        )
    unseen = [
        unit
        for unit, mine in _by_unit(columns).items()
        if not any((np.isfinite(measured_of(trial, mine)).sum(axis=0) >= NOISE_ROWS).any() for trial in train)
    ]
    if unseen:
        return (
            f"No training trial has {NOISE_ROWS} values of one output in {_said(unseen)}: their noise "
            "cannot be estimated. Record longer trials.",
        )
    if not any(np.ptp(all_inputs(trial.inputs), axis=0).any() for trial in train):
        return (
            "The inputs never change: nothing that depends on them shows. "
            "Record trials in which you drive the robot.",
        )
    return ()


def _by_unit(columns: Sequence[str]) -> dict[str, list[str]]:
    """Return the columns of each unit."""
    units = dict.fromkeys(unit_of(name) for name in columns)
    return {unit: [name for name in columns if unit_of(name) == unit] for unit in units}


def _said(units: Sequence[str]) -> str:
    """Return units in words."""
    return " and ".join("quaternions" if unit == "1" else unit for unit in units)


def _measured(trials: Sequence[Trial], columns: Sequence[str]) -> bool:
    return any(_measured_rows(trial, columns).any() for trial in trials)


def _needed(chance: float) -> int:
    """Return how many stretches make a gain in all of them less probable by chance than that."""
    return math.ceil(-math.log2(chance))


def _stretches(trials: Sequence[Trial], columns: Sequence[str], moving: bool) -> int:
    """Return how many stretches of rows have a measured value."""
    labels = stretch_of(trials, moving)
    found = [mine[_measured_rows(trial, columns)] for trial, mine in zip(trials, labels, strict=True)]
    return len(np.unique(np.concatenate(found)))


def _measured_rows(trial: Trial, columns: Sequence[str]) -> np.ndarray:
    """Return which rows of a trial have a measured value, shape (r,)."""
    return np.asarray(np.isfinite(measured_of(trial, columns)).any(axis=1))


def _too_short(
    which: str,
    advice: str,
    trials: Sequence[Trial],
    columns: Sequence[str],
    moving: bool,
    found: int,
    needed: int,
) -> str:
    """Return what to say of trials that hold too few stretches, and what to do about it."""
    rows = [int(_measured_rows(trial, columns).sum()) for trial in trials]
    if not moving:
        number = f"{sum(rows)} measured row{'' if sum(rows) == 1 else 's'}"
        if found < sum(rows):
            number += f" in {found} stretch{'' if found == 1 else 'es'}"
        return (
            f"{which} data are {number}. Naming a cause needs at least {needed} stretches of rows. "
            f"{advice} longer trials, or more of them."
        )
    times = [trial.inputs.time_s for trial in trials]
    seconds = sum(
        float(time_s[-1] - time_s[measured_from(trial)])
        for trial, time_s, number in zip(trials, times, rows, strict=True)
        if number
    )
    among = f" in {len(trials)} trials" if len(trials) > 1 else ""
    return (
        f"{which} data are {seconds:.4g} s of motion{among}. Naming a cause needs at least {needed} "
        f"stretches of {LEAST_BLOCK_S:g} s. {advice} at least {needed * LEAST_BLOCK_S:g} s."
    )


def _still(train: Sequence[Trial], heldout: Sequence[Trial], columns: Sequence[str]) -> bool:
    """Return whether no input changes in the held-out trials, and no output by much beside training."""
    if np.ptp(np.concatenate([all_inputs(trial.inputs) for trial in heldout]), axis=0).any():
        return False
    return bool((_spread(heldout, columns) <= STILL_SHARE * _spread(train, columns)).all())


def _spread(trials: Sequence[Trial], columns: Sequence[str]) -> Array:
    """Return the standard deviation of each output, shape (o,); 0 where it has no value."""
    values = np.ma.masked_invalid(np.concatenate([measured_of(trial, columns) for trial in trials]))
    return np.asarray(values.std(axis=0).filled(0.0))
