"""What looks wrong with the data themselves, before anything is blamed on the robot.

A column in other units, two columns swapped, a sensor that froze, a trial of another robot: each makes the
model err grossly, and each can be imitated by a cause of error, wrongly. They are looked for first, and
where one is found no cause is named.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.hypothesis import Problem, measured_of, predicted
from catheter_sim.diagnosis.noise import white_noise
from catheter_sim.diagnosis.registration import SHIFTS, points_of
from catheter_sim.diagnosis.result import Suspicion
from catheter_sim.diagnosis.trials import Dataset, Trial, unit_of
from catheter_sim.robots.channels import Inputs, input_channels
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array

FEWEST_VALUES = 60  # measured values in the training trials, below which nothing is concluded
GROSS = 0.3  # model's error over the measurements' spread, from which mistakes in the data are looked for
CONVINCING = 0.35  # error left with a mistake put right, over the error with it
SOLVED = 0.2  # the same over the spread: what is left must be small too
SURER = 0.7  # error with a mistake put right over that with the tracker moved, from which it is taken
OUTLYING = 4.0  # a trial's error over the median of the other trials'
NEAR_NOISE = 2.0  # the other trials' error over the noise: without that trial there would be no discrepancy
FROZEN_SHARE = 0.15  # of a trial's rows with one and the same value, while the robot is driven
FROZEN_ROWS = 8  # at least
FOLLOWS = 0.2  # share of an output's variance in inputs and model, from which it follows them
_MOVES = 0.2  # of the largest motion computed of its unit, from which an output is expected to move
FOLLOWS_STILL = 0.6  # the same where it hardly moves
_STILL = 0.1  # of the motion computed, below which it hardly does
_TELLING = 0.1  # share of the variance that must be motion if the model is right, to say that none is
_SPREADS = 5.0  # and in standard deviations of what chance explains
_LATE_ROWS = (1, 2, 4, 8)  # by which an output may come late and still follow
_BUMP_ROWS = 5  # at least, before and after a bump, and so many pairs of rows with the same inputs
_BUMP_NOISE = 8.0  # times the noise, of a bump
_ALONE = 3.0  # times the next largest change of the error from row to row, in that trial
_BEYOND = 0.02  # of an input's range, beyond all earlier rows
_SAME_INPUTS = 0.1  # of the inputs' ranges, within which two rows are compared
_LIKE = 0.35  # of a bump, by which what is off afterwards may differ from it
_DRIVEN = 0.3  # share of the inputs' range that is passed through meanwhile
METRES = 1e3
_OUTPUT_FACTORS = {
    METRES: "m for mm",
    25.4: "inches for mm",
    10.0: "cm for mm",
    180.0 / math.pi: "rad for deg",
}
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
        before: the same with the data as they are.
    """

    words: str
    error: float
    before: float = math.inf


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
) -> tuple[Suspicion, ...]:
    """Return what looks wrong with the data; nothing where they look sound.

    Args:
        problem: the training trials.
        before: the calibrated model without causes.
        heldout: the other trials, of which only is asked whether one of all does not belong here.
        noise: of each unit.
    """
    values = sum(int(np.isfinite(measured_of(trial, problem.columns)).sum()) for trial in problem.trials)
    if values < FEWEST_VALUES:
        return (
            Suspicion(
                f"only {values} measured values to learn from: fewer than {FEWEST_VALUES} prove nothing."
            ),
        )
    if not any(np.ptp(_all(trial.inputs), axis=0).any() for trial in problem.trials):
        return (Suspicion("the inputs never change: nothing that depends on them can be told."),)
    models = _models(problem, before, problem.trials)
    idle = unrelated(problem, models)
    if idle:
        return idle
    shifted = any(name in SHIFTS for name in (item.name for item in problem.nuisances))
    found = mistake(
        problem.trials,
        problem.columns,
        problem.robot,
        lambda inputs: predicted(problem, before.frees, before.x, inputs),
        shifted,
    )
    if found is not None:
        return (
            Suspicion(
                f"{found.words}: put right, the calibrated model's error falls from "
                f"{100 * found.before:.0f} to {100 * found.error:.0f} % of the measurements' spread."
            ),
        )
    trials = (*problem.trials, *heldout)
    return bumps(trials, problem.columns, _models(problem, before, trials), noise) or _odd_trial(
        problem, before, heldout, noise
    )


def mistake(
    trials: Sequence[Trial],
    columns: Sequence[str],
    robot: Robot,
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
    before = _relative_error(models, measured, columns, shifted)
    if before <= GROSS:
        return None
    most = min(CONVINCING * before, SOLVED)
    look = _Look(trials, columns, robot, predict, shifted, models, measured)
    best = min((*_output_mistakes(look), *_input_mistakes(look, most)), key=lambda item: item.error)
    return replace(best, before=before) if best.error < most else None


def relative_error(
    trials: Sequence[Trial], columns: Sequence[str], predict: Callable[[Inputs], Array], shifted: bool
) -> float:
    """Return a model's error over the measurements' spread; arguments as of `mistake`."""
    measured = [measured_of(trial, columns) for trial in trials]
    return _relative_error([predict(trial.inputs) for trial in trials], measured, columns, shifted)


@dataclass(frozen=True)
class _Look:
    """Where a mistake is looked for; the fields as in `mistake`, and outputs by model and measured."""

    trials: Sequence[Trial]
    columns: Sequence[str]
    robot: Robot
    predict: Callable[[Inputs], Array]
    shifted: bool
    models: Sequence[Array]
    measured: Sequence[Array]


def unrelated(problem: Problem, models: Sequence[Array]) -> tuple[Suspicion, ...]:
    """Return the points, or other outputs, that do not follow the inputs though the model's do.

    What such a one does is hardly a function of the inputs, their squares and what the model says now and
    some rows before (`FOLLOWS`, its adjusted share of the variance): it is noise, or a tracker that hangs on
    nothing. Where noise would hide the motion that the model expects, that is said only if it does so in
    every output.

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
        moving = [k for k in group if spread[k] > _MOVES * largest[unit_of(problem.columns[k])] > 0.0]
        if moving:
            answers[name] = _following(problem, models, measured, moving), moving
    if answers and all(answer is Following.HIDDEN for answer, _ in answers.values()):
        return (Suspicion("the noise hides the motion that the model expects: nothing can be told."),)
    idle = [problem.columns[k] for answer, group in answers.values() if answer is Following.NO for k in group]
    if not idle:
        return ()
    return (
        Suspicion(
            "what is measured does not follow the inputs, though the robot should move: is the tracker "
            "attached and the robot driven?",
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
    drive = np.concatenate([_all(trial.inputs) for trial in problem.trials])
    drive = drive[:, np.ptp(drive, axis=0) > 0.0]
    left = total = motion = white = 0.0
    count = numbers = 0
    for column in columns:
        name = problem.columns[column]
        series = [values[:, column] for values in measured]
        shown, computed = np.concatenate(series), np.concatenate([values[:, column] for values in models])
        late = [np.concatenate([_later(values[:, column], rows) for values in models]) for rows in _LATE_ROWS]
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
        white += size * white_noise({name: series}).get(unit_of(name), 0.0) ** 2
        count, numbers = count + size, numbers + features.shape[1]
    if total == 0.0:
        return Following.NO
    expected = motion / (motion + white)  # share of the variance that would follow if the model were right
    if expected < max(_TELLING, _SPREADS * math.sqrt(2.0 * numbers) / count):
        return Following.HIDDEN
    followed = 1.0 - left / (count - numbers) * count / total
    least = FOLLOWS_STILL if total < _STILL**2 * motion else min(FOLLOWS, 0.4 * expected)
    return Following.NO if followed < least else Following.YES


def _later(values: Array, rows: int) -> Array:
    """Return a series as it would come so many rows later, its first value until then, shape (r,)."""
    return np.concatenate([np.full(min(rows, len(values)), values[0]), values[:-rows]])


def bumps(
    trials: Sequence[Trial], columns: Sequence[str], models: Sequence[Array], noise: Mapping[str, float]
) -> tuple[Suspicion, ...]:
    """Return where every position jumps from one row to the next and stays off: the tracker was moved.

    The error of a model that is wrong changes with the inputs and comes back with them. So a jump of the
    error counts where there is none like it in the trial (`_ALONE`), and where rows after it, beside rows
    before it of nearly the same inputs moving the same way, are off by that jump. A row with inputs that go
    beyond all earlier ones is none: what gives way there for good is the robot's.

    Args:
        trials: all.
        columns: outputs.
        models: what the calibrated model says, shape (r, o) each.
        noise: of each unit.
    """
    places = [index for index, name in enumerate(columns) if unit_of(name) == "mm"]
    found = []
    for trial, model in zip(trials, models, strict=True) if places else ():
        error = (measured_of(trial, columns) - model)[:, places]
        known = np.flatnonzero(np.isfinite(error).all(axis=1))
        row = _bump(error[known], _all(trial.inputs), known, max(noise.get("mm", 0.0), 1e-9))
        if row is not None:
            found.append(
                Suspicion(
                    "all positions jump here and stay off by as much, which the inputs do not say: was "
                    f"the tracker, or the robot's base, moved (before row {row + 1})?",
                    trial.file,
                    (row + 1, len(model)),
                )
            )
    return tuple(found)


def _bump(error: Array, drive: Array, known: np.ndarray, noise: float) -> int | None:
    """Return the first row after a bump, None where there is none.

    Args:
        error: of the rows without missing values, shape (k, o) [mm].
        drive: inputs, shape (r, i).
        known: those rows' indices, shape (k,).
        noise: [mm].
    """
    if len(known) < 4 * _BUMP_ROWS:
        return None
    steps = np.diff(error, axis=0)
    sizes = np.sqrt((steps**2).mean(axis=1))
    order = np.argsort(sizes)[::-1]
    at = int(order[0])  # the bump lies between the known rows `at` and `at + 1`
    if not _BUMP_ROWS <= at < len(known) - _BUMP_ROWS:
        return None
    if sizes[at] < _BUMP_NOISE * noise or sizes[at] < _ALONE * sizes[order[1]]:
        return None
    scaled = drive / np.maximum(np.ptp(drive, axis=0), 1e-300)
    row = known[at + 1]
    if (scaled[row] > scaled[:row].max(axis=0) + _BEYOND).any():
        return None
    moving = np.gradient(scaled, axis=0)[known]
    places = scaled[known]
    differences = []
    for after in range(at + 1, len(known)):
        same_way = (moving[: at + 1] * moving[after]).sum(axis=1) >= 0.0
        distance = np.where(same_way, np.abs(places[: at + 1] - places[after]).max(axis=1), np.inf)
        near = int(np.argmin(distance))
        if distance[near] < _SAME_INPUTS:
            differences.append(error[after] - error[near])
    if len(differences) < _BUMP_ROWS:
        return None
    middle = np.median(differences, axis=0)
    apart = np.median(np.sqrt(((np.array(differences) - middle) ** 2).mean(axis=1)))
    size = float(np.sqrt((middle**2).mean()))
    off = float(np.sqrt(((steps[at] - middle) ** 2).mean()))
    return int(row) if off < _LIKE * size and apart < _LIKE * size else None


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


def _output_mistakes(look: _Look) -> Iterator[Mistake]:
    columns = look.columns

    def tried(change: dict[int, tuple[int, float]], words: str) -> Mistake:
        # column `to` of the truth is column `of` as measured, times a factor
        right = [np.array(values) for values in look.measured]
        for values, given in zip(right, look.measured, strict=True):
            for to, (of, factor) in change.items():
                values[:, to] = factor * given[:, of]
        return Mistake(words, _relative_error(look.models, right, columns, look.shifted))

    for i, j in itertools.combinations(range(len(columns)), 2):
        if unit_of(columns[i]) == unit_of(columns[j]):
            yield tried({i: (j, 1.0), j: (i, 1.0)}, f"the columns {columns[i]} and {columns[j]} look swapped")
    for i, name in enumerate(columns):
        yield tried({i: (i, -1.0)}, f"the column {name} looks turned in sign")
    for unit in dict.fromkeys(unit_of(name) for name in columns):
        mine = [i for i, name in enumerate(columns) if unit_of(name) == unit]
        for factor, what in _OUTPUT_FACTORS.items():
            if what.endswith(f" {unit}"):
                whole = [] if factor == METRES else [mine]  # `registration` has put these right
                for group in [*whole, *([i] for i in mine if len(mine) > 1)]:
                    names = ", ".join(columns[i] for i in group)
                    yield tried({i: (i, factor) for i in group}, f"{names}: {what}, it seems")


def _input_mistakes(look: _Look, most: float) -> Iterator[Mistake]:
    """Yield them with their errors; inf where the first trials alone make one larger than `most`."""
    actuation = look.trials[0].inputs.actuation
    names = input_channels(look.robot, actuation)
    count = look.trials[0].inputs.tendon.shape[1]

    def tried(change: Array, words: str) -> Mistake:
        models: list[Array] = []
        for trial in look.trials:
            models.append(look.predict(replace(trial.inputs, tendon=trial.inputs.tendon @ change)))
            # As if the other trials were met exactly.
            supposed = [*models, *look.measured[len(models) :]]
            error = _relative_error(supposed, look.measured, look.columns, look.shifted)
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
) -> tuple[Suspicion, ...]:
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
        Suspicion(
            f"the calibrated model errs there by {alone:.0f} times the noise and agrees with all other "
            f"trials (at most {most:.1f} times): another robot or set-up in that trial?",
            trials[odd].file,
        ),
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
    return [predicted(problem, before.frees, before.x, trial.inputs) for trial in trials]


def _relative_error(
    models: Sequence[Array], measured: Sequence[Array], columns: Sequence[str], shifted: bool
) -> float:
    """Return the error over the measurements' spread, root mean square over columns; inf: no posture.

    Of positions about their mean where these are `shifted`.
    """
    model, values = np.concatenate(models), np.concatenate(measured)
    spread = np.nanstd(values, axis=0)
    spread = np.maximum(spread, 0.05 * spread.max(initial=1e-12))
    error = model - values
    places = np.array([shifted and unit_of(name) == "mm" for name in columns])
    error = (error - np.where(places, np.nanmean(error, axis=0), 0.0)) / spread
    counted = error[np.isfinite(values)]
    return float(np.sqrt(np.mean(counted**2))) if np.isfinite(counted).all() else math.inf


def _all(inputs: Inputs) -> Array:
    return np.hstack([inputs.tendon, inputs.force_tip, inputs.moment_tip])
