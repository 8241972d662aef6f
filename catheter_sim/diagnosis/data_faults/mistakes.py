"""Columns swapped, turned in sign or in another unit: mistakes without which the model fits far better."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import drives_of
from catheter_sim.core.drive import Quantity
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.columns import points_of, unit_of
from catheter_sim.diagnosis.data.trials import Trial, measured_of
from catheter_sim.diagnosis.data_faults.model_error import noise_share, relative_error
from catheter_sim.diagnosis.data_faults.units import INPUT_FACTORS, METRES, OUTPUT_FACTORS
from catheter_sim.diagnosis.thresholds import GROSS_SHARE, MISTAKE_CONVINCING, MISTAKE_SOLVED_SHARE


@dataclass(frozen=True)
class Mistake:
    """A mistake in the data, and how much better the model fits without it.

    Attributes:
        words: what it would be.
        error: of the model over the spread of the measurements, with the mistake put right.
        before: the same with the data as they are.
    """

    words: str
    error: float
    before: float = math.inf


def most_likely_mistake(
    trials: Sequence[Trial],
    columns: Sequence[str],
    robot: RobotSpec,
    predict: Callable[[Inputs], Array],
    shifted: bool = False,
    beside: Array | None = None,
    solved: float = MISTAKE_SOLVED_SHARE,
) -> Mistake | None:
    """Return the mistake in the data without which a model agrees with them far better; None: there is none.

    Args:
        trials: where to look.
        columns: outputs.
        robot: as specified.
        predict: the model's outputs along inputs, shape (r, o).
        shifted: the tracker's origin is unknown: errors are counted about their means.
        beside: outputs of all trials, where these are not all: their spread counts, shape (r, o).
        solved: an error that is no mistake's.
    """
    models = [predict(trial.inputs) for trial in trials]
    measured = [measured_of(trial, columns) for trial in trials]
    before = relative_error(models, measured, columns, shifted, beside)
    if before <= GROSS_SHARE:
        return None
    # Noise alone leaves so much of outputs that hardly move.
    most = min(MISTAKE_CONVINCING * before, math.hypot(solved, noise_share(trials, columns)))
    look = _Look(trials, columns, robot, predict, shifted, models, measured, beside)
    best = min((*_output_mistakes(look), *_input_mistakes(look, most)), key=lambda item: item.error)
    return replace(best, before=before) if best.error < most else None


@dataclass(frozen=True)
class _Look:
    """Where a mistake is looked for: arguments of `most_likely_mistake`, computed and measured outputs."""

    trials: Sequence[Trial]
    columns: Sequence[str]
    robot: RobotSpec
    predict: Callable[[Inputs], Array]
    shifted: bool
    models: Sequence[Array]
    measured: Sequence[Array]
    beside: Array | None = None


def _output_mistakes(look: _Look) -> Iterator[Mistake]:
    columns = look.columns

    def tried(change: dict[int, tuple[int, float]], words: str) -> Mistake:
        # column `to` of the truth is column `of` as measured, times a factor
        right = [np.array(values) for values in look.measured]
        for values, given in zip(right, look.measured, strict=True):
            for to, (of, factor) in change.items():
                values[:, to] = factor * given[:, of]
        return Mistake(words, relative_error(look.models, right, columns, look.shifted, look.beside))

    for i, j in itertools.combinations(range(len(columns)), 2):
        if unit_of(columns[i]) == unit_of(columns[j]):
            yield tried({i: (j, 1.0), j: (i, 1.0)}, f"The columns {columns[i]} and {columns[j]} look swapped")
    for i, name in enumerate(columns):
        yield tried({i: (i, -1.0)}, f"The column {name} looks turned in sign")
    for change, words in _point_mistakes(columns):
        yield tried(change, words)
    for unit in dict.fromkeys(unit_of(name) for name in columns):
        mine = [i for i, name in enumerate(columns) if unit_of(name) == unit]
        for factor, what in OUTPUT_FACTORS.items():
            if what.endswith(f" {unit}"):
                # In all trials `base_frame.register` has put metres right.
                whole = [] if factor == METRES and look.beside is None else [mine]
                for group in [*whole, *([i] for i in mine if len(mine) > 1)]:
                    named = [columns[i] for i in group]
                    names = ", ".join(named) if len(named) < 4 else f"all columns in {unit}"
                    yield tried({i: (i, factor) for i in group}, f"The unit of {names} looks wrong: {what}")


def _point_mistakes(columns: Sequence[str]) -> Iterator[tuple[dict[int, tuple[int, float]], str]]:
    """Yield what may be wrong with all points at once: an axis turned, two exchanged; or with two of them."""
    points = points_of(columns)
    if len(points) < 2 or len({tuple(axes) for axes in points.values()}) > 1:
        return
    axes = list(next(iter(points.values())))
    for axis in axes:
        yield (
            {point[axis]: (point[axis], -1.0) for point in points.values()},
            f"The {axis} axis of all points looks turned: a mirror image",
        )
    for a, b in itertools.combinations(axes, 2):
        swap = {point[a]: (point[b], 1.0) for point in points.values()}
        swap |= {point[b]: (point[a], 1.0) for point in points.values()}
        yield swap, f"The axes {a} and {b} of all points look exchanged"
    for one, other in itertools.combinations(points, 2):
        exchange = {points[one][axis]: (points[other][axis], 1.0) for axis in axes}
        exchange |= {points[other][axis]: (points[one][axis], 1.0) for axis in axes}
        yield exchange, f"The points {one} and {other} look exchanged"


def _input_mistakes(look: _Look, most: float) -> Iterator[Mistake]:
    """Yield mistakes in the inputs with their errors; inf where the first trials alone exceed `most`."""
    drives = drives_of(look.robot, look.trials[0].inputs.actuation)
    names = [drive.column for drive in drives]
    count = look.trials[0].inputs.tendon.shape[1]

    def tried(change: Array, words: str) -> Mistake:
        models: list[Array] = []
        for trial in look.trials:
            models.append(look.predict(replace(trial.inputs, tendon=trial.inputs.tendon @ change)))
            # As if the other trials were met exactly.
            supposed = [*models, *look.measured[len(models) :]]
            error = relative_error(supposed, look.measured, look.columns, look.shifted, look.beside)
            if error > most:
                return Mistake(words, math.inf)
        return Mistake(words, error)

    if len(names) == count:
        for i, j in itertools.combinations(range(count), 2):
            swap = np.eye(count)
            swap[[i, j]] = swap[[j, i]]
            yield tried(swap, f"The columns {names[i]} and {names[j]} look swapped")
        for i in range(0 if drives[0].quantity is Quantity.TENSION else count):
            turned = np.eye(count)
            turned[i, i] = -1.0
            yield tried(turned, f"The column {names[i]} looks turned in sign")
    # With tiny inputs the model stands still, which is near to anything that hardly moves.
    still = [_at_middle(values) for values in look.measured]
    moves = relative_error(still, look.measured, look.columns, look.shifted, look.beside)
    for factor, what in INPUT_FACTORS[drives[0].quantity].items():
        mistake = tried(factor * np.eye(count), f"The inputs look given in another unit ({what})")
        if mistake.error < MISTAKE_CONVINCING * moves:
            yield mistake


def _at_middle(values: Array) -> Array:
    """Return outputs (r, o) that stand at the means of measured ones; 0 where nothing was measured."""
    known = np.isfinite(values)
    middle = np.where(known, values, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return np.asarray(np.broadcast_to(middle, values.shape))
