"""How trials are parted into those that train and those that are held out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.core.inputs import slice_inputs
from catheter_sim.diagnosis.data.cycles import cycles
from catheter_sim.diagnosis.data.enough import too_little
from catheter_sim.diagnosis.data.trials import Dataset, Trial, all_inputs
from catheter_sim.diagnosis.thresholds import HELDOUT_SHARE, MOST_HELDOUT_SHARE
from catheter_sim.errors import InputError


def split(dataset: Dataset) -> tuple[tuple[Trial, ...], tuple[Trial, ...]]:
    """Return the training trials and the held-out trials of `dataset`, each with its role set.

    Roles that the data set gives are kept. If it holds no trial out, the last trials without a role
    are held out, about 30 % of the rows; trials that repeat one another are not held out, as far as possible,
    since a repeat of a training trial tests nothing. A single trial is cut between two of its cycles
    (`cycles`), or, if it has but one, at 70 % of its rows. The held-out part of a cut trial keeps all inputs,
    so that the history is right, and has NaN where the training part was measured. Where 30 % are too little
    to prove anything and half of the rows are not (`enough.too_little`), half of them are held out.

    Raises:
        InputError: every trial has the role "train", so that nothing is left to test on.
    """
    trials = dataset.trials
    if any(trial.role == "heldout" for trial in trials):
        chosen = {index for index, trial in enumerate(trials) if trial.role == "heldout"}
        return _with_roles(trials, chosen)
    open_ones = [index for index, trial in enumerate(trials) if not trial.role]
    if not open_ones:
        raise InputError(
            f"{dataset.folder / 'dataset.toml'}: every trial has the role train; "
            "give one the role heldout, or leave the roles out"
        )
    usual, more = (_parted(trials, open_ones, share) for share in (HELDOUT_SHARE, MOST_HELDOUT_SHARE))
    columns, moving = tuple(trials[0].outputs.columns), dataset.motion.moving
    return more if too_little(*usual, columns, moving) and not too_little(*more, columns, moving) else usual


def _parted(
    trials: Sequence[Trial], open_ones: Sequence[int], share: float
) -> tuple[tuple[Trial, ...], tuple[Trial, ...]]:
    """Return the trials parted so that about `share` of the rows are held out."""
    if len(trials) == 1:
        return _cut(trials[0], share)
    return _with_roles(trials, _last_trials(trials, open_ones, share))


def is_repeat(first: Trial, second: Trial) -> bool:
    """Return whether two trials were given the same inputs (to a millionth of their range) and clock."""
    a, b = all_inputs(first.inputs), all_inputs(second.inputs)
    if a.shape != b.shape:
        return False
    tolerance = 1e-6 * max(float(np.abs(a).max()), 1e-12)
    span = max(float(np.ptp(first.inputs.time_s)), 1e-12)
    same_clock = np.abs(first.inputs.time_s - second.inputs.time_s).max() <= 1e-6 * span
    return bool(np.abs(a - b).max() <= tolerance and same_clock)


def _with_roles(
    trials: Sequence[Trial], heldout: Iterable[int]
) -> tuple[tuple[Trial, ...], tuple[Trial, ...]]:
    chosen = set(heldout)
    return (
        tuple(replace(trial, role="train") for i, trial in enumerate(trials) if i not in chosen),
        tuple(replace(trial, role="heldout") for i, trial in enumerate(trials) if i in chosen),
    )


def _last_trials(trials: Sequence[Trial], open_ones: Sequence[int], share: float) -> set[int]:
    """Return the last trials without a role, without repeats, that hold about `share` of the rows."""
    repeated = {
        i
        for i in range(len(trials))
        if any(i != j and is_repeat(trials[i], trials[j]) for j in range(len(trials)))
    }
    candidates = [i for i in open_ones if i not in repeated] or list(open_ones)
    return last_trials([len(trial.inputs) for trial in trials], candidates, share)


def last_trials(counts: Sequence[int], candidates: Sequence[int], share: float = HELDOUT_SHARE) -> set[int]:
    """Return the last of the candidates that hold a share of all rows, one at least, never all trials.

    Args:
        counts: rows of each trial.
        candidates: numbers of those that may be held out, rising.
        share: about how much of the rows they hold.
    """
    rows = sum(counts)
    chosen: set[int] = set()
    for index in reversed(candidates):
        taken = sum(counts[i] for i in chosen)
        here = counts[index]
        left = len(counts) - len(chosen)
        # Nearer to the wanted share with this trial than without it; one at least, never all.
        nearer = abs(taken + here - share * rows) <= abs(taken - share * rows)
        if left > 1 and (nearer or not chosen):
            chosen.add(index)
    return chosen


def _cut(trial: Trial, share: float) -> tuple[tuple[Trial, ...], tuple[Trial, ...]]:
    rows = len(trial.inputs)
    wanted = (1.0 - share) * rows
    starts = [part.start for part in cycles(trial)[1:]]
    row = min(starts, key=lambda start: abs(start - wanted)) if starts else max(round(wanted), 1)
    columns = trial.outputs.columns
    train = Trial(
        trial.file,
        "train",
        slice_inputs(trial.inputs, slice(0, row)),
        replace(
            trial.outputs,
            time_s=trial.outputs.time_s[:row],
            columns={name: values[:row] for name, values in columns.items()},
        ),
    )
    later = np.arange(rows) >= row
    hidden = {name: np.where(later, values, np.nan) for name, values in columns.items()}
    heldout = replace(trial, role="heldout", outputs=replace(trial.outputs, columns=hidden))
    return (train,), (heldout,)
