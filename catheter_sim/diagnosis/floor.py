"""How much of what is left follows from the inputs at all: the error that a flexible model leaves.

A kernel ridge (Rasmussen and Williams 2006, sections 2.2 and 8.1: a sparse set of landmarks) learns what
the physics leaves in the training trials, as any smooth function of inputs, history and outputs. Its two
numbers are chosen by stretches left out of the training trials. What it then leaves of the held-out
trials is the floor: it decides words, never causes.

What the reported model leaves above the floor follows from the inputs, whether or not its cause is known.
What lies below the floor does not, or takes more data to learn.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.distance import cdist

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.noise import chance_of_gain
from catheter_sim.diagnosis.result import Floor, TrialFit
from catheter_sim.diagnosis.trials import TIP, Trial, all_inputs, unit_of
from catheter_sim.mechanics.hysteresis import lagged, play
from catheter_sim.tables import Table

WIDTHS = (0.05, 0.15, 0.4)
"""[share of an input's range] Dead-bands of the plays that describe a history. Why: they go from about the
least play that a diagnosis finds to the widest loops of real tendons (assumed)."""
LAGS = (1.0, 5.0, 25.0)
"""[rows] Lags that describe a history. Why: what lasts less than a row shows in no data, and what lasts
longer acts as a drift (assumed)."""
SCALES = (0.1, 0.3, 1.0, 3.0)
"""[1] Inverse squares of the kernel's length, in standard deviations. Why: they go from one arc over the
whole range to a wave of a fifth of it. Stretches left out decide which is best."""
RIDGES = (0.03, 0.3, 3.0, 30.0)
"""[variance of the noise over that of the function] These ratios are tried. Why: they are decades about equal
shares. Stretches left out decide here, too."""
LANDMARKS = 300
"""[points] The kernel stands on at most this many. Why: with 500 the floor of `opencr_v4` is the same to 0.1
% (4.756 and 4.754 mm)."""
MOST_ROWS = 4000
"""[rows] The floor is learned from at most this many, every k-th of the training rows. Why: it bounds the
time."""
STRETCHES = 6
"""[parts] The training rows are cut into this many, each left out once. Why: assumed, as for causes."""


def floor_of(trials: Sequence[Trial], fits: Sequence[TrialFit]) -> Floor:
    """Return what a flexible model leaves of the held-out trials, learned from the training trials.

    Without trials of both kinds, or where a trial was not computed at every row, nothing is known.

    Args:
        trials: measured.
        fits: of each what was measured and what the reported model computes.
    """
    parts = {role: [k for k, fit in enumerate(fits) if fit.role == role] for role in ("train", "heldout")}
    if not all(parts.values()):
        return Floor()
    columns = list(fits[0].after.columns)
    left = [_stack(fit.measured, columns) - _stack(fit.after, columns) for fit in fits]
    by_file = {trial.file: trial.inputs for trial in trials}
    inputs = [all_inputs(by_file[fit.file]) for fit in fits]
    if any(len(own) != len(fit.time_s) for own, fit in zip(inputs, fits, strict=True)):
        return Floor()
    span = np.ptp(np.concatenate([inputs[k] for k in parts["train"]]), axis=0)
    told = [
        _known_of_rows(fit.time_s, own[:, span > 0.0], span[span > 0.0], _stack(fit.after, columns))
        for own, fit in zip(inputs, fits, strict=True)
    ]
    known, asked = (
        [np.concatenate(group) for group in zip(*(told[k] for k in own), strict=True)]
        for own in parts.values()
    )
    units = np.array([unit_of(name) for name in columns])
    ahead = np.concatenate([left[k] for k in parts["heldout"]])
    learned = np.concatenate([_filled(left[k]) for k in parts["train"]])
    rest = ahead - _predicted(*_scaled(known, asked), learned, units)
    rmse, chance = {}, {}
    for unit in dict.fromkeys(units.tolist()):
        mine = units == unit
        if np.isfinite(rest[:, mine]).any():
            rmse[unit] = float(np.sqrt(np.nanmean(rest[:, mine] ** 2)))
            fall = np.nansum(ahead[:, mine] ** 2 - rest[:, mine] ** 2, axis=1)
            chance[unit] = chance_of_gain(
                np.array([part.sum() for part in np.array_split(fall, 2 * STRETCHES)])
            )
    return Floor(rmse, chance, _tip_mm(columns, rest))


def _known_of_rows(time_s: Array, inputs: Array, span: Array, computed: Array) -> list[Array]:
    """Return what the model knows of each row of a trial, in groups, shape (r, k) each.

    The inputs, how far plays and lags of them lie behind, and the computed outputs.
    """
    row_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 1.0
    behind = [inputs - play(inputs, share * span, inputs[0]) for share in WIDTHS]
    late = [inputs - lagged(time_s, inputs, rows * row_s, rest=inputs[0]) for rows in LAGS]
    return [inputs, np.hstack(behind), np.hstack(late), np.nan_to_num(computed)]


def _scaled(known: Sequence[Array], asked: Sequence[Array]) -> tuple[Array, Array]:
    """Return both in standard deviations of what is known, (r, k) each; every group weighs alike."""
    found: tuple[list[Array], list[Array]] = ([], [])
    for mine, theirs in zip(known, asked, strict=True):
        mean, size = mine.mean(axis=0), mine.std(axis=0)
        moves = size > 0.0
        weight = np.sqrt(len(known) * max(moves.sum(), 1))
        for values, kept in zip((mine, theirs), found, strict=True):
            kept.append((values[:, moves] - mean[moves]) / (size[moves] * weight))
    return np.hstack(found[0]), np.hstack(found[1])


def _predicted(known: Array, asked: Array, left: Array, units: np.ndarray) -> Array:
    """Return the part of what is left at rows `asked` that is learned from `known`, shape (r, o).

    Length and ridge are chosen by unit; where no function does better on stretches left out than none, 0.

    Args:
        known, asked: what is known of each row, shape (n, k) and (r, k).
        left: shape (n, o).
        units: of the outputs, shape (o,).
    """
    every = -(-len(known) // MOST_ROWS)
    known, left = known[::every], left[::every]
    points = known[np.linspace(0, len(known) - 1, min(LANDMARKS, len(known))).round().astype(int)]
    distances = [cdist(rows, points, "sqeuclidean") for rows in (points, known, asked)]
    parts = np.array_split(np.arange(len(known)), STRETCHES)
    result = np.zeros((len(asked), len(units)))
    least = {unit: float(np.sum(left[:, units == unit] ** 2)) for unit in dict.fromkeys(units.tolist())}
    for scale in SCALES:
        among, here, there = (np.exp(-scale * distance) for distance in distances)
        size, turn = np.linalg.eigh(among)
        kept = size > 1e-8 * size[-1]
        root = turn[:, kept] / np.sqrt(size[kept])
        here, there = here @ root, there @ root
        guess = [np.empty_like(left) for _ in RIDGES]
        for own in parts:
            others = np.delete(np.arange(len(known)), own)
            for at, values in zip(guess, _ridge(here[others], left[others], here[own]), strict=True):
                at[own] = values
        full = _ridge(here, left, there)
        for unit in least:
            mine = units == unit
            for at, values in zip(guess, full, strict=True):
                error = float(np.sum((left - at)[:, mine] ** 2))
                if error < least[unit]:
                    least[unit] = error
                    result[:, mine] = values[:, mine]
    return result


def _ridge(rows: Array, values: Array, asked: Array) -> list[Array]:
    """Return ridge regressions of (n, o) values at other rows, about their mean, one a ridge, (r, o) each."""
    mean = values.mean(axis=0)
    size, turn = np.linalg.eigh(rows.T @ rows)
    onto, there = turn.T @ (rows.T @ (values - mean)), asked @ turn
    return [mean + there @ (onto / (size + ridge)[:, np.newaxis]) for ridge in RIDGES]


def _filled(values: Array) -> Array:
    """Return values of a trial, shape (r, o), with missing ones between their neighbours; 0 where all are."""
    result, rows = np.zeros(values.shape), np.arange(len(values))
    for column, mine in enumerate(values.T):
        known = np.isfinite(mine)
        if known.any():
            result[:, column] = np.interp(rows, rows[known], mine[known])
    return result


def _stack(table: Table, columns: Sequence[str]) -> Array:
    return np.stack([table.columns[name] for name in columns], axis=1)


def _tip_mm(columns: Sequence[str], rest: Array) -> float | None:
    if not all(name in columns for name in TIP):
        return None
    squares = (rest[:, [columns.index(name) for name in TIP]] ** 2).sum(axis=1)
    return float(np.sqrt(np.nanmean(squares))) if np.isfinite(squares).any() else None
