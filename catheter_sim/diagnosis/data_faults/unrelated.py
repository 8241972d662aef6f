"""Outputs that do not follow the inputs: noise, or a tracker that nobody attached."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.columns import points_of, unit_of
from catheter_sim.diagnosis.data.trials import all_inputs, measured_of
from catheter_sim.diagnosis.fitting.noise import white_noise
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import (
    FEWEST_VALUES,
    FOLLOWS_OF_EXPECTED,
    FOLLOWS_SHARE,
    LATE_ROWS,
    MOVES_SHARE,
    STILL_FOLLOWS_SHARE,
    STILL_SHARE,
    TELLING_SHARE,
    TELLING_SPREADS,
)


def outputs_that_do_not_follow(problem: Problem, models: Sequence[Array]) -> tuple[DataFault, ...]:
    """Return the points, or other outputs, that do not follow the inputs although the computed ones do.

    Such an output is hardly a function of the inputs, of their squares, and of what the model says now and
    some rows before: these explain less than `FOLLOWS_SHARE` of its variance (adjusted for their number). It
    is noise, or a tracker that nobody attached. Where noise would hide the expected motion nothing is said,
    unless it does so in every output.

    Args:
        problem: the training trials.
        models: what the calibrated model says of them, shape (r, o) each.
    """
    measured = [measured_of(trial, problem.columns) for trial in problem.trials]
    groups = {point: list(axes.values()) for point, axes in points_of(problem.columns).items()}
    in_points = {index for group in groups.values() for index in group}
    groups |= {name: [index] for index, name in enumerate(problem.columns) if index not in in_points}
    spread = {
        index: float(np.nanstd(np.concatenate([item[:, index] for item in models])))
        for index in range(len(problem.columns))
    }
    largest: dict[str, float] = {}
    for index, name in enumerate(problem.columns):
        largest[unit_of(name)] = max(largest.get(unit_of(name), 0.0), spread[index])
    answers: dict[str, tuple[Following, list[int]]] = {}
    for name, group in groups.items():
        moving = [k for k in group if spread[k] > MOVES_SHARE * largest[unit_of(problem.columns[k])] > 0.0]
        if moving:
            answers[name] = _following(problem, models, measured, moving), moving
    if answers and all(answer is Following.HIDDEN for answer, _ in answers.values()):
        return (DataFault("The noise hides the motion that the model expects."),)
    idle = [problem.columns[k] for answer, group in answers.values() if answer is Following.NO for k in group]
    if not idle:
        return ()
    return (
        DataFault(
            "The outputs do not follow the inputs, though the robot should move. Is the tracker attached and "
            "the robot driven?",
            ", ".join(idle),
        ),
    )


class Following(Enum):
    """Whether outputs follow the inputs."""

    YES = "they do, or too little is known"
    NO = "they do not"
    HIDDEN = "noise would hide it"


def _following(
    problem: Problem, models: Sequence[Array], measured: Sequence[Array], columns: Sequence[int]
) -> Following:
    """Return whether outputs of one unit, a point's coordinates say, together follow the inputs."""
    drive = np.concatenate([all_inputs(trial.inputs) for trial in problem.trials])
    drive = drive[:, np.ptp(drive, axis=0) > 0.0]
    left = total = motion = white = 0.0
    count = numbers = 0
    for column in columns:
        name = problem.columns[column]
        series = [values[:, column] for values in measured]
        shown, computed = np.concatenate(series), np.concatenate([values[:, column] for values in models])
        late = [np.concatenate([delayed(values[:, column], rows) for values in models]) for rows in LATE_ROWS]
        features = np.column_stack([np.ones(len(drive)), drive, drive**2, computed, *late])
        known = np.isfinite(shown) & np.isfinite(features).all(axis=1)
        if known.sum() < max(FEWEST_VALUES // 2, 2 * features.shape[1]):
            return Following.YES
        features = features[known] / np.maximum(np.abs(features[known]).max(axis=0), 1e-300)
        rest = shown[known] - features @ np.linalg.lstsq(features, shown[known], rcond=None)[0]
        size = len(rest)
        left += float(rest @ rest)
        total += size * float(np.var(shown[known]))
        motion += size * float(np.var(computed[known]))
        noise = white_noise({name: series}, problem.trials, problem.resolution)
        white += size * noise.get(unit_of(name), 0.0) ** 2
        count, numbers = count + size, numbers + features.shape[1]
    if total == 0.0:
        return Following.NO
    expected = motion / (motion + white)  # share of the variance that would follow if the model were right
    if expected < max(TELLING_SHARE, TELLING_SPREADS * math.sqrt(2.0 * numbers) / count):
        return Following.HIDDEN
    followed = 1.0 - left / (count - numbers) * count / total
    least = (
        STILL_FOLLOWS_SHARE
        if total < STILL_SHARE**2 * motion
        else min(FOLLOWS_SHARE, FOLLOWS_OF_EXPECTED * expected)
    )
    return Following.NO if followed < least else Following.YES


def delayed(values: Array, rows: int) -> Array:
    """Return a series as it would come so many rows later, its first value until then, shape (r,)."""
    return np.concatenate([np.full(min(rows, len(values)), values[0]), values[:-rows]])
