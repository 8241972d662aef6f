"""What the residuals show: against input, direction of motion, time, position and history.

A residual is measured minus computed. Each view groups the rows of one output by a coordinate that
a cause of error would act through, and takes the mean of each group. How much a view explains is
judged on cycles that took no part in the means, so that a view of noise explains nothing. Rows of
one cycle err together; uncertainties therefore come from the spread between cycles, not rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student_t

from catheter_sim.diagnosis.result import TrialFit
from catheter_sim.diagnosis.trials import Dataset, Trial, cycles, unit_of
from catheter_sim.robots.channels import channel_of
from catheter_sim.tables import Array

VIEWS: Mapping[str, str] = {
    "input": "the input",
    "direction": "the direction of motion",
    "time": "the time in the trial",
    "position": "the position",
    "history": "the way since the last turning point",
}
STAGES = ("before", "after")
BINS = 8
MIN_ROWS = 5  # in a bin
MIN_BLOCKS = 4  # below it, cycles are too few and equal stretches of rows stand in
REVERSAL = 0.02  # share of an output's range; smaller moves back are no turning point


@dataclass(frozen=True)
class Residuals:
    """Residuals of one output over several trials, with what they may depend on.

    Attributes:
        column: the output, unit included.
        stage: "before" or "after".
        values: measured minus computed, shape (n,), no NaN.
        blocks: number of the cycle that each row belongs to, shape (n,).
        coordinates: per view, the coordinates by name (unit included), each of shape (n,).
    """

    column: str
    stage: str
    values: Array
    blocks: np.ndarray
    coordinates: Mapping[str, Mapping[str, Array]]


@dataclass(frozen=True)
class BinnedMean:
    """Means of a residual in groups of rows.

    Attributes:
        centre: mean coordinate of each group, shape (b,).
        mean: mean residual, shape (b,).
        half_width: of the mean's 95 % interval, from the spread between cycles, shape (b,); NaN
            where a group has rows of one cycle only.
        rows: how many rows, shape (b,).
    """

    centre: Array
    mean: Array
    half_width: Array
    rows: np.ndarray


@dataclass(frozen=True)
class ViewScore:
    """How much of the residuals' variance one view explains in cycles left out of its means.

    Attributes:
        view: one of `VIEWS`.
        coordinate: the coordinate that explains most ("own" is that of each output itself).
        before_percent, after_percent: share of the variance about the mean [%]; zero or below is
            none; NaN where there is nothing to judge by.
    """

    view: str
    coordinate: str
    before_percent: float
    after_percent: float


def stack(dataset: Dataset, fits: Sequence[TrialFit], column: str, stage: str) -> Residuals:
    """Return the residuals of one output over `fits`, rows without a measurement left out.

    Args:
        dataset: where the trials' inputs are.
        fits: trials to take, one below the other.
        column: an output.
        stage: "before" or "after".
    """
    values: list[Array] = []
    blocks: list[np.ndarray] = []
    parts: dict[str, dict[str, list[Array]]] = {view: {} for view in VIEWS}
    offset = 0
    for fit in fits:
        trial = next(item for item in dataset.trials if item.file == fit.file)
        computed = (fit.before if stage == "before" else fit.after).columns[column]
        residual = fit.measured.columns[column] - computed
        keep = np.isfinite(residual)
        numbers = _blocks(trial, keep)
        values.append(residual[keep])
        blocks.append(numbers[keep] + offset)
        offset += int(numbers.max(initial=0)) + 1
        for view, coordinates in _coordinates(dataset, trial, fit, column).items():
            for name, coordinate in coordinates.items():
                parts[view].setdefault(name, []).append(coordinate[keep])
    return Residuals(
        column=column,
        stage=stage,
        values=np.concatenate(values) if values else np.zeros(0),
        blocks=np.concatenate(blocks) if blocks else np.zeros(0, dtype=int),
        coordinates={
            view: {name: np.concatenate(pieces) for name, pieces in coordinates.items()}
            for view, coordinates in parts.items()
        },
    )


def binned_mean(coordinate: Array, values: Array, blocks: np.ndarray, bins: int = BINS) -> BinnedMean:
    """Return the means of `values` in groups of equally many rows along `coordinate`."""
    groups = groups_of(coordinate, bins)
    centre, mean, half_width, rows = [], [], [], []
    for group in np.unique(groups):
        chosen = groups == group
        centre.append(coordinate[chosen].mean())
        mean.append(values[chosen].mean())
        half_width.append(_half_width(values[chosen], blocks[chosen]))
        rows.append(int(chosen.sum()))
    return BinnedMean(np.array(centre), np.array(mean), np.array(half_width), np.array(rows))


def explained(
    coordinate: Array, values: Array, blocks: np.ndarray, line: bool = False
) -> tuple[float, float]:
    """Return the squares left by the binned means, and by the plain mean, in blocks left out of both.

    1 - first / second is the share of the variance that the coordinate explains.

    Args:
        coordinate: shape (n,).
        values: residuals, shape (n,).
        blocks: number of each row's block, shape (n,).
        line: predict by a straight line instead of binned means; for a coordinate of which every
            block has a stretch to itself, such as time.
    """
    groups = groups_of(coordinate, BINS)
    left, total = 0.0, 0.0
    for block in np.unique(blocks):
        test = blocks == block
        train = ~test
        if test.all():
            return float("nan"), float("nan")
        plain = values[train].mean()
        predicted = np.full(int(test.sum()), plain)
        if line:
            from_mean = coordinate[train] - coordinate[train].mean()
            spread = float((from_mean**2).sum())
            slope = float((from_mean * values[train]).sum()) / spread if spread > 0.0 else 0.0
            predicted += slope * (coordinate[test] - coordinate[train].mean())
        else:
            for group in np.unique(groups[train]):
                predicted[groups[test] == group] = values[train & (groups == group)].mean()
        left += float(((values[test] - predicted) ** 2).sum())
        total += float(((values[test] - plain) ** 2).sum())
    return left, total


def score_views(dataset: Dataset, fits: Sequence[TrialFit], unit: str) -> tuple[ViewScore, ...]:
    """Return for each view how much it explains, over all outputs of `unit`, before and after."""
    columns = [name for name in dataset.output_channels if unit_of(name) == unit]
    sums: dict[tuple[str, str, str], tuple[float, float]] = {}
    for stage in STAGES:
        for column in columns:
            residuals = stack(dataset, fits, column, stage)
            if not len(residuals.values):
                continue
            for view, coordinates in residuals.coordinates.items():
                for name, coordinate in coordinates.items():
                    left, total = explained(
                        coordinate, residuals.values, residuals.blocks, line=view == "time"
                    )
                    key = (stage, view, _own(name, column))
                    past = sums.get(key, (0.0, 0.0))
                    sums[key] = (past[0] + left, past[1] + total)
    return tuple(_best_score(view, sums) for view in VIEWS)


def fits_to_judge(dataset: Dataset, fits: Sequence[TrialFit]) -> tuple[TrialFit, ...]:
    """Return the held-out trials if they hold enough cycles to judge by, otherwise all trials."""
    heldout = tuple(fit for fit in fits if fit.role == "heldout")
    count = 0
    for fit in heldout:
        trial = next(item for item in dataset.trials if item.file == fit.file)
        measured = np.any([np.isfinite(values) for values in fit.measured.columns.values()], axis=0)
        count += sum(bool(measured[part].any()) for part in cycles(trial))
    return heldout if count >= MIN_BLOCKS else tuple(fits)


def turning_points(values: Array) -> tuple[Array, Array]:
    """Return the direction of motion (-1, 1) and the signed way since the last turning point.

    Moves back by less than 2 % of the range are no turning point. Both have the shape of `values`;
    the way has its unit. At the very start the direction is that of the first true move.
    """
    least = REVERSAL * float(np.ptp(values)) if len(values) else 0.0
    direction = np.zeros(len(values))
    way = np.zeros(len(values))
    sign, turn, extreme = 0.0, 0, 0
    for row, value in enumerate(values):
        if sign == 0.0:
            if abs(value - values[0]) > least:
                sign = float(np.sign(value - values[0]))
                direction[:row] = sign
                extreme = row
        elif sign * (value - values[extreme]) >= 0.0:
            extreme = row
        elif sign * (values[extreme] - value) > least:
            turn, sign = extreme, -sign
            direction[turn + 1 : row] = sign
            way[turn + 1 : row] = values[turn + 1 : row] - values[turn]
            extreme = row
        direction[row] = sign
        way[row] = value - values[turn]
    return direction, way


def _coordinates(dataset: Dataset, trial: Trial, fit: TrialFit, column: str) -> dict[str, dict[str, Array]]:
    rows = len(fit.time_s)
    # The model before tells where the robot is and goes, for both stages: it has no noise, and the
    # same rows stay in the same groups.
    computed = fit.before.columns[column]
    direction, way = turning_points(computed)
    words, _, unit = column.rpartition("_")
    inputs = input_columns(dataset, trial)
    return {
        "input": {name: values[:rows] for name, values in inputs.items()},
        "direction": {f"computed {words}, falling or rising": direction},
        "time": {"time in the trial_s": fit.time_s - fit.time_s[0] if rows else fit.time_s},
        "position": {f"computed {words}_{unit}": computed},
        "history": {f"computed {words} since it turned_{unit}": way},
    }


def input_columns(dataset: Dataset, trial: Trial) -> dict[str, Array]:
    """Return the commanded channels that vary, by name, in file units."""
    inputs = trial.inputs
    unit, factor = ("N", 1.0) if inputs.actuation == "tension" else ("mm", 1e3)
    columns: dict[str, Array] = {}
    channels = channel_of(dataset.robot)
    for index, channel in enumerate(channels):
        shared = channels.count(channel) if inputs.actuation == "tension" else 1
        columns.setdefault(f"{inputs.actuation}_{channel}_{unit}", inputs.tendon[:, index] * factor * shared)
    for kind, values, unit in (
        ("force", inputs.force_tip, "N"),
        ("moment", inputs.moment_tip, "Nm"),
    ):
        columns |= {f"{kind}_tip_{axis}_{unit}": values[:, i] for i, axis in enumerate("xyz")}
    return {name: values for name, values in columns.items() if name in dataset.input_channels}


def _blocks(trial: Trial, keep: np.ndarray) -> np.ndarray:
    """Return the number of the block that each row is in: its cycle, or one of eight equal stretches."""
    rows = len(keep)
    numbers = np.zeros(rows, dtype=int)
    for number, part in enumerate(cycles(trial)):
        numbers[part.start : part.stop] = number
    if len(np.unique(numbers[keep])) < MIN_BLOCKS and keep.any():
        numbers = np.zeros(rows, dtype=int)
        for number, indices in enumerate(np.array_split(np.flatnonzero(keep), 2 * MIN_BLOCKS)):
            numbers[indices] = number
    return numbers


def groups_of(coordinate: Array, bins: int) -> np.ndarray:
    """Return the number of each row's group: equal values together, groups about equally full."""
    distinct = np.unique(coordinate)
    if len(distinct) <= 3:
        return np.searchsorted(distinct, coordinate)
    count = max(1, min(bins, len(coordinate) // MIN_ROWS))
    edges = np.unique(np.quantile(coordinate, np.linspace(0.0, 1.0, count + 1)[1:-1]))
    return np.unique(np.searchsorted(edges, coordinate, side="right"), return_inverse=True)[1]


def _half_width(values: Array, blocks: np.ndarray) -> float:
    """Return half the 95 % interval of the mean of `values`, whose blocks are the independent draws."""
    labels = np.unique(blocks)
    if len(labels) < 2:
        return float("nan")
    deviation = values - values.mean()
    sums = np.array([deviation[blocks == label].sum() for label in labels])
    count = len(labels)
    variance = count / (count - 1) * float((sums**2).sum()) / len(values) ** 2
    return float(student_t.ppf(0.975, count - 1)) * variance**0.5


def _own(name: str, column: str) -> str:
    """Return the coordinate's name; those made from the output itself are one over all outputs."""
    return "own" if name.startswith("computed ") else name


def _best_score(view: str, sums: Mapping[tuple[str, str, str], tuple[float, float]]) -> ViewScore:
    def share(stage: str, name: str) -> float:
        left, total = sums.get((stage, view, name), (float("nan"), float("nan")))
        return 100.0 * (1.0 - left / total) if total > 0.0 else float("nan")

    names = [name for stage, item, name in sums if item == view and stage == "before"]
    if not names:
        return ViewScore(view, "", float("nan"), float("nan"))
    best = max(names, key=lambda name: np.nan_to_num(share("before", name), nan=-np.inf))
    return ViewScore(view, best, share("before", best), share("after", best))
