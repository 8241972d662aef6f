"""What looks wrong with the data themselves, before anything is blamed on the robot.

A column in other units, two columns swapped, a sensor that froze, a trial of another robot: each makes the
model err grossly, and each can be imitated by a cause of error, wrongly. They are looked for first, and
where one is found no cause is named.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.hypothesis import Problem, measured_of, robot_with
from catheter_sim.diagnosis.trials import Dataset, Trial, unit_of
from catheter_sim.robots.channels import Inputs, input_channels
from catheter_sim.robots.posture import Array

FEWEST_VALUES = 60  # measured values in the training trials, below which nothing is concluded
GROSS = 0.3  # model's error over the measurements' spread, from which mistakes in the data are looked for
CONVINCING = 0.35  # error left with a mistake put right, over the error with it
SOLVED = 0.2  # the same over the spread: what is left must be small too
OUTLYING = 4.0  # a trial's error over the median of the other trials'
NEAR_NOISE = 2.0  # the other trials' error over the noise: without that trial there would be no discrepancy
FROZEN_SHARE = 0.15  # of a trial's rows with one and the same value, while the robot is driven
FROZEN_ROWS = 8  # at least
_DRIVEN = 0.3  # share of the inputs' range that is passed through meanwhile
_OUTPUT_FACTORS = {1e3: "m for mm", 25.4: "inches for mm", 10.0: "cm for mm", 180.0 / math.pi: "rad for deg"}
_INPUT_FACTORS = {
    "tension": {1e-3: "mN for N", 1e3: "kN for N", 9.80665: "kgf for N", 4.44822: "lbf for N"},
    "displacement": {1e-3: "um for mm", 1e3: "m for mm", 25.4: "inches for mm", 10.0: "cm for mm"},
}


@dataclass(frozen=True)
class Mistake:
    """A mistake in the data, how much better the model fits without it.

    Attributes:
        words: what it would be.
        error: of the model over the spread of the measurements, with the mistake put right.
    """

    words: str
    error: float


def thawed(dataset: Dataset) -> tuple[Dataset, tuple[str, ...]]:
    """Return the data set without the stretches in which a sensor repeats itself, and what was left out.

    A stretch counts where one column holds exactly one value over many rows while the inputs move; the
    repeats become missing values.
    """
    notes: list[str] = []
    trials = []
    for trial in dataset.trials:
        columns = {}
        for name, values in trial.outputs.columns.items():
            kept = np.array(values)
            for start, end in _frozen(values, trial.inputs):
                kept[start + 1 : end] = np.nan
                notes.append(
                    f"{trial.file}: {name} repeats {values[start]:g} from row {start + 1} to {end} while the "
                    "robot is driven: a frozen sensor? Taken as missing there."
                )
            columns[name] = kept
        trials.append(replace(trial, outputs=replace(trial.outputs, columns=columns)))
    return (replace(dataset, trials=tuple(trials)) if notes else dataset), tuple(notes)


def suspicions(
    problem: Problem, before: Fit, heldout: Sequence[Trial], noise: Mapping[str, float]
) -> tuple[str, ...]:
    """Return what looks wrong with the data, in words; nothing where they look sound.

    Args:
        problem: the training trials.
        before: the calibrated model without causes.
        heldout: the other trials, of which only is asked whether one of all does not belong here.
        noise: of each unit.
    """
    values = sum(int(np.isfinite(measured_of(trial, problem.columns)).sum()) for trial in problem.trials)
    if values < FEWEST_VALUES:
        return (f"only {values} measured values to learn from: fewer than {FEWEST_VALUES} prove nothing.",)
    if not any(np.ptp(_all(trial.inputs), axis=0).any() for trial in problem.trials):
        return ("the inputs never change: nothing that depends on them can be told.",)
    models = _models(problem, before, problem.trials)
    measured = [measured_of(trial, problem.columns) for trial in problem.trials]
    as_they_are = _relative_error(models, measured)
    if as_they_are > GROSS:
        most = min(CONVINCING * as_they_are, SOLVED)
        found = [
            *_output_mistakes(problem, models, measured),
            *_input_mistakes(problem, before, measured, most),
        ]
        best = min(found, key=lambda item: item.error, default=None)
        if best is not None and best.error < most:
            return (
                f"{best.words}: put right, the calibrated model's error falls from {100 * as_they_are:.0f} "
                f"to {100 * best.error:.0f} % of the measurements' spread.",
            )
    return _odd_trial(problem, before, heldout, noise)


def _frozen(values: Array, inputs: Inputs) -> Iterator[tuple[int, int]]:
    """Yield stretches of one value, (first row, one past the last), in which the inputs move."""
    drive = _all(inputs)
    span = np.maximum(np.ptp(drive, axis=0), 1e-300)
    longest = max(FROZEN_ROWS, round(FROZEN_SHARE * len(values)))
    start = 0
    for row in range(1, len(values) + 1):
        if row < len(values) and values[row] == values[start]:
            continue
        if row - start >= longest and (np.ptp(drive[start:row], axis=0) / span).max() > _DRIVEN:
            yield start, row
        start = row


def _output_mistakes(
    problem: Problem, models: Sequence[Array], measured: Sequence[Array]
) -> Iterator[Mistake]:
    columns = problem.columns

    def tried(change: dict[int, tuple[int, float]], words: str) -> Mistake:
        # column `to` of the truth is column `of` as measured, times a factor
        right = [np.array(values) for values in measured]
        for values, given in zip(right, measured, strict=True):
            for to, (of, factor) in change.items():
                values[:, to] = factor * given[:, of]
        return Mistake(words, _relative_error(models, right))

    for i, j in itertools.combinations(range(len(columns)), 2):
        if unit_of(columns[i]) == unit_of(columns[j]):
            yield tried({i: (j, 1.0), j: (i, 1.0)}, f"the columns {columns[i]} and {columns[j]} look swapped")
    for i, name in enumerate(columns):
        yield tried({i: (i, -1.0)}, f"the column {name} looks turned in sign")
    for unit in dict.fromkeys(unit_of(name) for name in columns):
        mine = [i for i, name in enumerate(columns) if unit_of(name) == unit]
        for factor, what in _OUTPUT_FACTORS.items():
            if what.endswith(f" {unit}"):
                for group in [mine, *([i] for i in mine if len(mine) > 1)]:
                    names = ", ".join(columns[i] for i in group)
                    yield tried({i: (i, factor) for i in group}, f"{names}: {what}, it seems")


def _input_mistakes(
    problem: Problem, before: Fit, measured: Sequence[Array], most: float
) -> Iterator[Mistake]:
    """Yield them with their errors; inf where the first trials alone make one larger than `most`."""
    actuation = problem.trials[0].inputs.actuation
    names = input_channels(problem.robot, actuation)
    count = problem.trials[0].inputs.tendon.shape[1]

    def tried(change: Array, words: str) -> Mistake:
        models: list[Array] = []
        for trial in problem.trials:
            inputs = replace(trial.inputs, tendon=trial.inputs.tendon @ change)
            models += _models(problem, before, [replace(trial, inputs=inputs)])
            # As if the other trials were met exactly.
            error = _relative_error([*models, *measured[len(models) :]], measured)
            if error > most:
                return Mistake(words, math.inf)
        return Mistake(words, error)

    if len(names) == count:
        for i, j in itertools.combinations(range(count), 2):
            swap = np.eye(count)
            swap[[i, j]] = swap[[j, i]]
            yield tried(swap, f"the columns {names[i]} and {names[j]} look swapped")
        for i in range(count if actuation == "displacement" else 0):
            turned = np.eye(count)
            turned[i, i] = -1.0
            yield tried(turned, f"the column {names[i]} looks turned in sign")
    for factor, what in _INPUT_FACTORS[actuation].items():
        yield tried(factor * np.eye(count), f"the inputs look given in another unit ({what})")


def _odd_trial(
    problem: Problem, before: Fit, heldout: Sequence[Trial], noise: Mapping[str, float]
) -> tuple[str, ...]:
    """Return what to say of one trial that errs where all others agree with a model calibrated to them."""
    trials = (*problem.trials, *heldout)
    if len(trials) < 3:
        return ()
    errors = _in_noise(problem, before, trials, noise)
    odd = int(np.argmax(errors))
    others = [trial for index, trial in enumerate(trials) if index != odd]
    if errors[odd] <= OUTLYING:
        return ()
    if odd < len(problem.trials):
        rest = replace(problem, trials=tuple(item for item in problem.trials if item is not trials[odd]))
        if not rest.trials:
            return ()
        before = fit(rest, (), cross_validate=False)
    most = _in_noise(problem, before, others, noise).max()
    alone = float(_in_noise(problem, before, [trials[odd]], noise)[0])
    if alone <= OUTLYING * max(most, 1.0) or most > NEAR_NOISE:
        return ()
    return (
        f"{trials[odd].file}: the calibrated model errs there by {alone:.0f} times the noise and agrees with "
        f"all other trials (at most {most:.1f} times): another robot or set-up in that trial?",
    )


def _in_noise(problem: Problem, result: Fit, trials: Sequence[Trial], noise: Mapping[str, float]) -> Array:
    """Return each trial's error, root mean square in units of the noise, shape (k,)."""
    scale = np.array([max(noise[unit_of(name)], 1e-12) for name in problem.columns])
    return np.array(
        [
            np.sqrt(np.nanmean(((model - measured_of(trial, problem.columns)) / scale) ** 2))
            for trial, model in zip(trials, _models(problem, result, trials), strict=True)
        ]
    )


def _models(problem: Problem, before: Fit, trials: Sequence[Trial]) -> list[Array]:
    robot = robot_with(problem, before.frees, before.x)
    return [problem.twin([robot], trial.inputs, 1)[0] for trial in trials]


def _relative_error(models: Sequence[Array], measured: Sequence[Array]) -> float:
    """Return the error over the measurements' spread, root mean square over columns; inf: no posture."""
    model, values = np.concatenate(models), np.concatenate(measured)
    spread = np.nanstd(values, axis=0)
    spread = np.maximum(spread, 0.05 * spread.max(initial=1e-12))
    error = (model - values) / spread
    counted = error[np.isfinite(values)]
    return float(np.sqrt(np.mean(counted**2))) if np.isfinite(counted).all() else math.inf


def _all(inputs: Inputs) -> Array:
    return np.hstack([inputs.tendon, inputs.force_tip, inputs.moment_tip])
