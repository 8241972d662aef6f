"""How much of the residuals each view explains: means of groups of rows along its coordinate.

A view is judged on cycles that took no part in the means, so that a view of noise explains nothing. Rows of
one cycle err together; uncertainties therefore come from the spread between cycles, not rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.trials import Dataset
from catheter_sim.diagnosis.report.result import TrialFit
from catheter_sim.diagnosis.residuals.coordinates import STAGES, VIEWS, stack
from catheter_sim.diagnosis.residuals.groups import groups_of
from catheter_sim.diagnosis.thresholds import BINS


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


def _half_width(values: Array, blocks: np.ndarray) -> float:
    """Return half the 95 % interval of the mean of `values`, whose blocks are the independent draws."""
    labels = np.unique(blocks)
    if len(labels) < 2:
        return float("nan")
    deviation = values - values.mean()
    sums = np.array([deviation[blocks == label].sum() for label in labels])
    count = len(labels)
    variance = count / (count - 1) * float((sums**2).sum()) / len(values) ** 2
    return float(stdtrit(count - 1, 0.975)) * variance**0.5


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
