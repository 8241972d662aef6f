"""Whether residuals depend on something: tests that know no candidate cause.

Each test asks whether the mean residual depends on one thing: an input, the direction of motion, the time,
the position, the way since the last turn, the place along the robot, the side out of the bending plane.
Rows of one cycle err together, so that whole cycles are the independent draws: their residuals' signs are
turned at random, all rows and outputs of a cycle at once, and the p-value is the share of such draws in which
the dependence is as strong as in the data. It holds however the rows of a cycle depend on one another.

Many small groups explain some of any residuals by chance. The share of the input in fine steps is therefore
what exceeds the draws' mean, over what is left without that mean.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.trials import Dataset
from catheter_sim.diagnosis.report.result import StructureTest, TrialFit
from catheter_sim.diagnosis.residuals.coordinates import VIEWS, Residuals, stack
from catheter_sim.diagnosis.residuals.groups import groups_of
from catheter_sim.diagnosis.thresholds import BINS, FINE_BINS, NEAR_AXIS_SHARE, STRUCTURE_DRAWS

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

    Args:
        dataset: where the trials' inputs are.
        fits: trials to judge by.
        unit: outputs of this unit count.
        stage: "before" or "after".
        seed: of the draws.
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

    Args:
        name: of the test.
        sums: by coordinate, for each output the residuals' sums by group and block, shape (g, b), and
            what each group's squared sum is divided by, shape (g,).
        signs: of the blocks in each draw, shape (b, d).
        square: sum of all squared residuals.
        beyond_chance: take the draws' mean out of the share.
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
