"""Columns swapped, turned in sign or in another unit: mistakes without which the model fits far better."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.channels import drives_of
from catheter_sim.core.drive import Quantity
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.trials import Trial, measured_of
from catheter_sim.diagnosis.data_faults.model_error import relative_error
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
) -> Mistake | None:
    """Return the mistake in the data without which a model agrees with them far better; None: there is none.

    Args:
        trials: where to look.
        columns: outputs.
        robot: as specified.
        predict: the model's outputs along inputs, shape (r, o).
        shifted: the tracker's origin is unknown: errors are counted about their means.
    """
    models = [predict(trial.inputs) for trial in trials]
    measured = [measured_of(trial, columns) for trial in trials]
    before = relative_error(models, measured, columns, shifted)
    if before <= GROSS_SHARE:
        return None
    most = min(MISTAKE_CONVINCING * before, MISTAKE_SOLVED_SHARE)
    look = _Look(trials, columns, robot, predict, shifted, models, measured)
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


def _output_mistakes(look: _Look) -> Iterator[Mistake]:
    columns = look.columns

    def tried(change: dict[int, tuple[int, float]], words: str) -> Mistake:
        # column `to` of the truth is column `of` as measured, times a factor
        right = [np.array(values) for values in look.measured]
        for values, given in zip(right, look.measured, strict=True):
            for to, (of, factor) in change.items():
                values[:, to] = factor * given[:, of]
        return Mistake(words, relative_error(look.models, right, columns, look.shifted))

    for i, j in itertools.combinations(range(len(columns)), 2):
        if unit_of(columns[i]) == unit_of(columns[j]):
            yield tried({i: (j, 1.0), j: (i, 1.0)}, f"the columns {columns[i]} and {columns[j]} look swapped")
    for i, name in enumerate(columns):
        yield tried({i: (i, -1.0)}, f"the column {name} looks turned in sign")
    for unit in dict.fromkeys(unit_of(name) for name in columns):
        mine = [i for i, name in enumerate(columns) if unit_of(name) == unit]
        for factor, what in OUTPUT_FACTORS.items():
            if what.endswith(f" {unit}"):
                whole = [] if factor == METRES else [mine]  # `base_frame.register` has put these right
                for group in [*whole, *([i] for i in mine if len(mine) > 1)]:
                    names = ", ".join(columns[i] for i in group)
                    yield tried({i: (i, factor) for i in group}, f"{names}: {what}, it seems")


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
            error = relative_error(supposed, look.measured, look.columns, look.shifted)
            if error > most:
                return Mistake(words, math.inf)
        return Mistake(words, error)

    if len(names) == count:
        for i, j in itertools.combinations(range(count), 2):
            swap = np.eye(count)
            swap[[i, j]] = swap[[j, i]]
            yield tried(swap, f"the columns {names[i]} and {names[j]} look swapped")
        for i in range(0 if drives[0].quantity is Quantity.TENSION else count):
            turned = np.eye(count)
            turned[i, i] = -1.0
            yield tried(turned, f"the column {names[i]} looks turned in sign")
    for factor, what in INPUT_FACTORS[drives[0].quantity].items():
        yield tried(factor * np.eye(count), f"the inputs look given in another unit ({what})")
