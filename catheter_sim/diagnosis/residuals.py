"""What errors depend on: inputs, position, direction, history and time, as tests show it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from catheter_sim.arrays import Array
from catheter_sim.channels import drives_of
from catheter_sim.core.inputs import Drive, Quantity
from catheter_sim.diagnosis.result import StructureTest, TrialFit
from catheter_sim.diagnosis.trials import Dataset, Trial, cycles, unit_of

BINS = 8
"""[groups of rows] There are this many along a coordinate. Why: assumed. A loop or a wave shows in eight."""
FINE_BINS = 24
"""[groups of rows] There are this many along an input in fine steps. Why: of waves over an input, eight
groups would each hold one."""
ROWS_IN_BIN = 5
"""[rows] A group holds at least this many. Why: assumed. A mean of fewer is noise."""
FEWEST_BLOCKS = 4
"""[cycles] With fewer, equal stretches of rows take their place. Why: signs of three cycles can be turned in
eight ways only, which allows no small p-value."""
REVERSAL_SHARE = 0.02
"""[share of a series' range] A smaller move back is no turning point. Why: it may be noise, of inputs or of
what was computed from them."""
STRUCTURE_DRAWS = 999
"""[draws] The cycles' signs are drawn this many times. Why: it gives p-values down to a thousandth, a tenth
of `SIGNIFICANT_P`."""
NEAR_AXIS_SHARE = 0.1
"""[share of the largest distance from the axis] Within it there is no bending plane. Why: noise turns the
plane about there."""

# ----------------------------------------------------------------------------------------------------
# Where a series turns round, and how far it has gone since.


def turning_points(values: Array) -> tuple[Array, Array]:
    """Return the direction of motion (-1, 1) and the signed way since the last turning point.

    Moves back by less than 2 % of the range are no turning point. Both have the shape of `values`;
    the way has its unit. At the very start the direction is that of the first true move.
    """
    least = REVERSAL_SHARE * float(np.ptp(values)) if len(values) else 0.0
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


# ----------------------------------------------------------------------------------------------------
# Residuals of one output over trials, and what they may depend on, row by row.
#
# A residual is measured minus computed. Each view has coordinates that a cause of error would act through.

STAGES = ("before", "after")


VIEWS: Mapping[str, str] = {
    "input": "the input",
    "direction": "the direction of motion",
    "time": "the time in the trial",
    "position": "the position",
    "history": "the way since the last turning point",
}


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


def stack(dataset: Dataset, fits: Sequence[TrialFit], column: str, stage: str) -> Residuals:
    """Return the residuals of one output over `fits`, rows without a measurement left out."""
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


def fits_to_judge(dataset: Dataset, fits: Sequence[TrialFit]) -> tuple[TrialFit, ...]:
    """Return the held-out trials if they hold enough cycles to judge by, otherwise all trials."""
    heldout = tuple(fit for fit in fits if fit.role == "heldout")
    count = 0
    for fit in heldout:
        trial = next(item for item in dataset.trials if item.file == fit.file)
        measured = np.any([np.isfinite(values) for values in fit.measured.columns.values()], axis=0)
        count += sum(bool(measured[part].any()) for part in cycles(trial))
    return heldout if count >= FEWEST_BLOCKS else tuple(fits)


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
    """Return the commanded channels of the data set by name, in file units; an advance is not among them."""
    inputs = trial.inputs
    columns = {
        drive.column: inputs.tendon[:, drive.tendons[0]] * _in_file_units(drive)
        for drive in drives_of(dataset.robot, inputs.actuation)
        if drive.quantity is not Quantity.ADVANCE
    }
    for kind, values, unit in (
        ("force", inputs.force_tip, "N"),
        ("moment", inputs.moment_tip, "Nm"),
    ):
        columns |= {f"{kind}_tip_{axis}_{unit}": values[:, i] for i, axis in enumerate("xyz")}
    return {name: values for name, values in columns.items() if name in dataset.input_channels}


def _in_file_units(drive: Drive) -> float:
    """Return by what the input of a drive's first tendon, SI, is multiplied to give the drive's column."""
    per_si = 1.0 if drive.quantity is Quantity.TENSION else 1e3
    return per_si * (1.0 / drive.parts[0])


def _blocks(trial: Trial, keep: np.ndarray) -> np.ndarray:
    """Return the number of the block that each row is in: its cycle, or one of eight equal stretches."""
    rows = len(keep)
    numbers = np.zeros(rows, dtype=int)
    for number, part in enumerate(cycles(trial)):
        numbers[part.start : part.stop] = number
    if len(np.unique(numbers[keep])) < FEWEST_BLOCKS and keep.any():
        numbers = np.zeros(rows, dtype=int)
        for number, indices in enumerate(np.array_split(np.flatnonzero(keep), 2 * FEWEST_BLOCKS)):
            numbers[indices] = number
    return numbers


# ----------------------------------------------------------------------------------------------------
# Groups of rows along a coordinate.


def groups_of(coordinate: Array, bins: int) -> np.ndarray:
    """Return the number of each row's group: equal values together, groups about equally full."""
    distinct = np.unique(coordinate)
    if len(distinct) <= 3:
        return np.searchsorted(distinct, coordinate)
    count = max(1, min(bins, len(coordinate) // ROWS_IN_BIN))
    edges = np.unique(np.quantile(coordinate, np.linspace(0.0, 1.0, count + 1)[1:-1]))
    return np.unique(np.searchsorted(edges, coordinate, side="right"), return_inverse=True)[1]


# ----------------------------------------------------------------------------------------------------
# Whether residuals depend on something: tests that know no candidate cause.
#
# Each test asks whether the mean residual depends on one thing: an input, the direction of motion, the
# time, the position, the way since the last turn, the place along the robot, the side out of the bending
# plane. Rows of one cycle err together, so that whole cycles are the independent draws: their residuals'
# signs are turned at random, all rows and outputs of a cycle at once, and the p-value is the share of such
# draws in which the dependence is as strong as in the data. It holds however the rows of a cycle depend on
# one another.
#
# Many small groups explain some of any residuals by chance. The share of the input in fine steps is
# therefore what exceeds the draws' mean, over what is left without that mean.

FINE_INPUT = "fine input"


TESTS: Mapping[str, str] = {
    **VIEWS,
    FINE_INPUT: "the input, in fine steps",
    "arc length": "the place along the robot",
    "out of plane": "the side out of the bending plane",
}


_POINT = re.compile(r"(tip|body_(\d+))_([xyz])_mm")


def structure_tests(
    dataset: Dataset, fits: Sequence[TrialFit], unit: str, stage: str, seed: int = 0
) -> tuple[StructureTest, ...]:
    """Return every test that the data allow, in the order of `TESTS`.

    Outputs of this `unit` count; `stage`: "before" or "after"; `seed`: of the draws.
    """
    columns = [name for name in dataset.output_channels if unit_of(name) == unit]
    residuals = {name: stack(dataset, fits, name, stage) for name in columns}
    residuals = {name: item for name, item in residuals.items() if len(item.values)}
    labels = np.unique(np.concatenate([np.zeros(0, int), *(item.blocks for item in residuals.values())]))
    if len(labels) < 2:
        return ()
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(len(labels), STRUCTURE_DRAWS))
    square = sum(float((item.values**2).sum()) for item in residuals.values())
    found = []
    groupings = {view: (view, BINS) for view in VIEWS} | {FINE_INPUT: ("input", FINE_BINS)}
    for test, (view, bins) in groupings.items():
        sums: dict[str, list[tuple[Array, Array]]] = {}
        for item in residuals.values():
            centred = item.values - item.values.mean()
            blocks = np.searchsorted(labels, item.blocks)
            for name, coordinate in item.coordinates[view].items():
                own = "each output's own" if name.startswith("computed ") else name
                part = (
                    _line_sums(coordinate, centred, blocks, len(labels))
                    if view == "time"  # every cycle has a stretch of it to itself: no group holds two
                    else _group_sums(groups_of(coordinate, bins), centred, blocks, len(labels))
                )
                sums.setdefault(own, []).append(part)
        found.append(_tested(test, sums, signs, square, beyond_chance=test == FINE_INPUT))
    found.append(_tested("arc length", _along(residuals, labels), signs, square))
    found.append(_tested("out of plane", _out_of_plane(fits, residuals, labels), signs, square))
    return tuple(item for item in found if item is not None)


def _tested(
    name: str,
    sums: Mapping[str, list[tuple[Array, Array]]],
    signs: Array,
    square: float,
    beyond_chance: bool = False,
) -> StructureTest | None:
    """Return the test of the strongest of several coordinates.

    `sums`: by coordinate, for each output the residuals' sums by group and block, shape (g, b), and what each
    group's squared sum is divided by, shape (g,); `signs`: of the blocks in each draw, shape (b, d);
    `square`: sum of all squared residuals; `beyond_chance`: take the draws' mean out of the share.
    """
    if not sums or square <= 0.0:
        return None
    measured, drawn = {}, {}
    for coordinate, parts in sums.items():
        measured[coordinate] = sum(float((part.sum(axis=1) ** 2 / size).sum()) for part, size in parts)
        drawn[coordinate] = sum(((part @ signs) ** 2 / size[:, None]).sum(axis=0) for part, size in parts)
    best = max(measured, key=lambda coordinate: measured[coordinate])
    as_strong = int((np.max(list(drawn.values()), axis=0) >= measured[best] * (1.0 - 1e-9)).sum())
    chance = float(np.mean(drawn[best])) if beyond_chance else 0.0
    share = max(measured[best] - chance, 0.0) / max(square - chance, 1e-300)
    return StructureTest(name, best, 100.0 * share, (1 + as_strong) / (STRUCTURE_DRAWS + 1))


def _group_sums(groups: np.ndarray, values: Array, blocks: np.ndarray, count: int) -> tuple[Array, Array]:
    """Return the sums by group and block, shape (g, b), and the rows of each group, shape (g,)."""
    number = int(groups.max(initial=0)) + 1
    sums = np.zeros((number, count))
    np.add.at(sums, (groups, blocks), values)
    return sums, np.maximum(np.bincount(groups, minlength=number), 1.0)


def _line_sums(coordinate: Array, values: Array, blocks: np.ndarray, count: int) -> tuple[Array, Array]:
    """Return the same for a straight line instead of groups: sums of values times the coordinate."""
    from_mean = coordinate - coordinate.mean()
    sums = np.zeros((1, count))
    np.add.at(sums[0], blocks, from_mean * values)
    return sums, np.array([max(float((from_mean**2).sum()), 1e-300)])


def _along(residuals: Mapping[str, Residuals], labels: Array) -> dict[str, list[tuple[Array, Array]]]:
    """Return the sums of residuals times the place along the robot, per axis; {} where there are too few."""
    by_axis: dict[str, list[tuple[float, Residuals]]] = {}
    most = max((int(m[2]) for m in map(_POINT.fullmatch, residuals) if m and m[2]), default=0)
    for column, item in residuals.items():
        match = _POINT.fullmatch(column)
        if match:
            place = float(match[2]) if match[2] else most + 1.0
            by_axis.setdefault(match[3], []).append((place, item))
    sums = []
    for points in by_axis.values():
        if len(points) < 3:
            continue
        middle = float(np.mean([place for place, _ in points]))
        total, size = np.zeros((1, len(labels))), 0.0
        for place, item in points:
            blocks = np.searchsorted(labels, item.blocks)
            np.add.at(total[0], blocks, (place - middle) * item.values)
            size += (place - middle) ** 2 * len(blocks)
        sums.append((total, np.array([size])))
    return {"number of the element": sums} if sums else {}


def _out_of_plane(
    fits: Sequence[TrialFit], residuals: Mapping[str, Residuals], labels: Array
) -> dict[str, list[tuple[Array, Array]]]:
    """Return the sums of the residuals' part across the plane in which the computed robot bends."""
    sums = []
    points = [match[1] for match in map(_POINT.fullmatch, residuals) if match and match[3] == "x"]
    for point in points:
        x, y = residuals[f"{point}_x_mm"], residuals.get(f"{point}_y_mm")
        if y is None or len(x.values) != len(y.values):
            continue  # where one of the two is missing there is no plane
        computed = [_computed(fits, f"{point}_{axis}_mm") for axis in "xy"]
        distance = np.hypot(*computed)
        seen = distance > NEAR_AXIS_SHARE * distance.max(initial=1e-12)
        if not seen.any():
            continue
        across = (computed[0] * y.values - computed[1] * x.values)[seen] / distance[seen]
        blocks = np.searchsorted(labels, x.blocks[seen])
        sums.append(_group_sums(groups_of(distance[seen], BINS), across, blocks, len(labels)))
    return {"distance from the axis_mm": sums} if sums else {}


def _computed(fits: Iterable[TrialFit], column: str) -> Array:
    parts = []
    for item in fits:
        keep = np.isfinite(item.measured.columns[column] - item.before.columns[column])
        parts.append(item.before.columns[column][keep])
    return np.concatenate(parts)


# ----------------------------------------------------------------------------------------------------
# How much of the residuals each view explains: means of groups of rows along its coordinate.
#
# A view is judged on cycles that took no part in the means, so that a view of noise explains nothing. Rows
# of one cycle err together; uncertainties therefore come from the spread between cycles, not rows.


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

    1 - first / second is the share of the variance that the coordinate explains. All have the shape (n,).
    `line`: predict by a straight line instead of binned means; for a coordinate of which every block has a
    stretch to itself, such as time.
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
                    own = "own" if name.startswith("computed ") else name  # one over all outputs
                    key = (stage, view, own)
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


def _best_score(view: str, sums: Mapping[tuple[str, str, str], tuple[float, float]]) -> ViewScore:
    def share(stage: str, name: str) -> float:
        left, total = sums.get((stage, view, name), (float("nan"), float("nan")))
        return 100.0 * (1.0 - left / total) if total > 0.0 else float("nan")

    names = [name for stage, item, name in sums if item == view and stage == "before"]
    if not names:
        return ViewScore(view, "", float("nan"), float("nan"))
    best = max(names, key=lambda name: np.nan_to_num(share("before", name), nan=-np.inf))
    return ViewScore(view, best, share("before", best), share("after", best))
