"""Differences of numbers between two recordings, beside what both recordings share."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.choose import Choice, choose_causes, without_explained_faults
from catheter_sim.diagnosis.fit import blocks_of, residuals, robot_with, trial_of
from catheter_sim.diagnosis.frame import Registration, registered, unmoved
from catheter_sim.diagnosis.noise import times_noise
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.prepare import (
    DiagnosisRun,
    Faults,
    Prepared,
    calibrate,
    find_data_faults,
    lacking_in,
    prepare,
    readings_of,
    split_problem,
)
from catheter_sim.diagnosis.probabilities import explained
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.readings import resolution_of, rounding_of, without_frozen_readings
from catheter_sim.diagnosis.residuals import turning_points
from catheter_sim.diagnosis.result import Cause, FittedParameter
from catheter_sim.diagnosis.thresholds import EARLIER_CAUSES, NEAR_NOISE
from catheter_sim.diagnosis.trials import (
    Dataset,
    Trial,
    all_inputs,
    measured_of,
    split_trials,
    too_little_to_learn,
    unit_of,
)
from catheter_sim.diagnosis.words import listed
from catheter_sim.errors import InputError
from catheter_sim.tables import Table
from catheter_sim.theory.twins import Prediction

PAIR_SHARE = 0.005
"""[share of an input's range] The inputs of two paired rows may differ by at most this. Why: assumed. A
servo's command comes back within a few thousandths, and half a percent of the reach moves a tip by about its
noise."""
SAME_WAY_SHARE = 0.15
"""[share of an input's range] When a moving robot plays one programme twice, its inputs may differ by at most
this at any row. Why: a real trunk's motors were measured with other weights and came within 0.14. The model
knows this difference, and errs by little more because of it."""
STRETCH_SHARE = 0.1
"""[share of an input's range] Errors are taken to be linear between two rows that lie at most this far apart.
Why: assumed. A side of a loop in ten steps is nearly straight in each step. A longer step may hide a turn."""
MODEL_SHARE = 0.35
"""[share of the error before] A model that does not explain the earlier recording either may leave this much
of a change, beside the noise. Why: such a model is also wrong about how much a change does. On a real trunk
with known weights it was wrong by 0.21 and 0.28. More causes would only mend the model."""
MOST_MODEL_SHARE = 0.8
"""[share of the change] The same, at most, for a robot in motion, where the commands do not explain the rest.
Why: learned from a real trunk, whose swings differ by as much as 100 g move it (0.79 left). A third of the
squares must be explained. Wrong names that this lets through have not been counted."""
BASELINE_BUDGET = 0.4
"""[share of the budget] This much of the time goes to explaining the earlier recording. Why: assumed. The
later recording takes the longer search where the earlier robot fits."""
COURSE_SURER = 3.84
"""[chi squared] One course of a number over the recordings is named only if it misses by this much less than
another. Why: 5 % of the squares of one normal deviate lie beyond it."""
COURSE_MISSED = 0.01
"""[probability] If a miss as large as that of the best course is less probable than this, the number went in
another way. Why: one in a hundred right courses is called irregular."""
COMMON_SHARE = 0.5
"""[share of a variance] This much of the variance of a change since the first recording is that recording's
own, and common to all changes. Why: assumed. It scatters as the others do."""

# ----------------------------------------------------------------------------------------------------
# Which rows of two recordings pair: the same command, come to on the same way.
#
# Differences of paired rows cancel whatever both recordings share, named or not. Where a trial begins as
# one of the other recording did, the whole way was the same. Elsewhere rows pair by their inputs and by the
# directions in which these were going: the way since the last turn stands for the history. A row that the
# other recording has not, but passed between two of its rows, pairs with the stretch between them: errors
# are taken to be linear there. A robot that was measured while it moved has a state that no command tells:
# there a row pairs with the same row of a trial that went the same way so far, within what motors do that
# follow one programme twice; errors are those of the model under each one's own inputs.


@dataclass(frozen=True)
class Pairs:
    """What the rows of a trial pair with.

    Attributes:
        error: mean error of the other recording's paired rows, shape (r, o); NaN where there are none.
        spread: mean square of these rows' errors about their mean, of single rows, shape (r, o); NaN with
            fewer than two.
        count: how many rows each pairs with, shape (r,).
    """

    error: Array
    spread: Array
    count: np.ndarray


@dataclass(frozen=True)
class _Partners:
    """What one row pairs with.

    `error` of each partner, shape (p, o), NaN where missing; `share` of one row's variance that each one's
    has, shape (p,): less between two rows.
    """

    error: Array
    share: Array


@dataclass(frozen=True)
class _Other:
    """The other recording, inputs over their ranges.

    Attributes:
        rows: inputs, shape (r, c).
        heading: direction of motion of each, shape (r, c).
        error: shape (r, o).
        ends: the rows at which a stretch from the row before ends, short enough to interpolate, shape (s,).
    """

    rows: Array
    heading: Array
    error: Array
    ends: np.ndarray

    def at(self, row: Array, heading: Array) -> _Partners:
        """Return the rows with the same inputs, come to in the same directions; else the stretches."""
        near = (np.abs(self.rows - row) <= PAIR_SHARE).all(axis=1)
        same = np.flatnonzero(near & (self.heading * heading >= 0.0).all(axis=1))
        if len(same):
            return _Partners(self.error[same], np.ones(len(same)))
        start, end = self.rows[self.ends - 1], self.rows[self.ends]
        way = end - start
        length = np.maximum((way**2).sum(axis=1), 1e-300)
        part = np.clip(((row - start) * way).sum(axis=1) / length, 0.0, 1.0)
        near = (np.abs(start + part[:, np.newaxis] * way - row) <= PAIR_SHARE).all(axis=1)
        onward = (self.heading[self.ends] * heading >= 0.0).all(axis=1)
        found = np.flatnonzero(near & onward & (part > 0.0) & (part < 1.0))
        part, ends = part[found], self.ends[found]
        error = self.error[ends - 1] * (1.0 - part)[:, np.newaxis] + self.error[ends] * part[:, np.newaxis]
        return _Partners(error, (1.0 - part) ** 2 + part**2)


def paired(inputs: Inputs, others: Sequence[Inputs], errors: Sequence[Array], moving: bool = False) -> Pairs:
    """Return what the rows of one trial pair with in another recording.

    `errors` of the others, shape (r, o) each; NaN where missing.
    """
    rows, outputs = len(inputs), errors[0].shape[1]
    unknown = np.full((rows, outputs), np.nan)
    found = Pairs(unknown, unknown.copy(), np.zeros(rows, dtype=int))
    everything = np.concatenate([all_inputs(item) for item in (inputs, *others)])
    scale = np.maximum(np.ptp(everything, axis=0), 1e-300)
    mine = all_inputs(inputs) / scale
    theirs = [all_inputs(item) / scale for item in others]
    common = [_same_beginning(mine, item, SAME_WAY_SHARE if moving else PAIR_SHARE) for item in theirs]
    heading = _headings(mine)
    other = _joined(theirs, errors)
    for row in range(rows):
        whole = [item[row] for item, length in zip(errors, common, strict=True) if row < length]
        if whole:
            _note(found, row, _Partners(np.array(whole), np.ones(len(whole))))
        elif not moving:
            _note(found, row, other.at(mine[row], heading[row]))
    return found


def _note(found: Pairs, row: int, partners: _Partners) -> None:
    """Write down what a row pairs with."""
    values = partners.error
    known = np.isfinite(values)
    if not known.any():
        return
    number = known.sum(axis=0)
    mean = np.where(known, values, 0.0).sum(axis=0) / np.maximum(number, 1)
    found.error[row] = np.where(number > 0, mean, np.nan)
    about = np.where(known, values - mean, 0.0)
    square = (about**2 / partners.share[:, np.newaxis]).sum(axis=0) / np.maximum(number - 1, 1)
    found.spread[row] = np.where(number > 1, square, np.nan)
    found.count[row] = len(values)


def _joined(rows: Sequence[Array], errors: Sequence[Array]) -> _Other:
    """Return the trials of the other recording, one after the other."""
    ends, start = [], 0
    for item in rows:
        steps = np.abs(np.diff(item, axis=0)).max(axis=1, initial=0.0)
        ends.append(start + 1 + np.flatnonzero((steps > 0.0) & (steps <= STRETCH_SHARE)))
        start += len(item)
    heading = np.concatenate([_headings(item) for item in rows])
    return _Other(np.concatenate(rows), heading, np.concatenate(list(errors)), np.concatenate(ends))


def share_paired(later: Dataset, earlier: Dataset) -> float:
    """Return the share of the later recording's rows that pair with rows of the earlier one."""
    rows = [len(trial.inputs) for trial in later.trials]
    return float(np.average(shares_paired(later, earlier), weights=rows))


def shares_paired(later: Dataset, earlier: Dataset) -> list[float]:
    """Return the same of each of the later recording's trials."""
    others = [trial.inputs for trial in earlier.trials]
    errors = [np.zeros((len(item), 1)) for item in others]
    moving = later.motion.moving
    counts = [paired(trial.inputs, others, errors, moving).count for trial in later.trials]
    return [float(np.mean(item > 0)) for item in counts]


def _same_beginning(first: Array, second: Array, within: float) -> int:
    """Return how many rows from the start have the same inputs, `within` a share of their ranges."""
    length = min(len(first), len(second))
    apart = (np.abs(first[:length] - second[:length]) > within).any(axis=1)
    return int(np.argmax(apart)) if apart.any() else length


def _headings(rows: Array) -> Array:
    """Return the direction of motion of each input at each row, shape (r, c); 0 where it never moves."""
    return np.stack([turning_points(values)[0] for values in rows.T], axis=1)


# ----------------------------------------------------------------------------------------------------
# A force that came or went, told as a mass, where weight acts and the force points along it.

HOLDS_IF = (
    "grams are as right as the measured tensions, or as the stiffness in the robot's file; masses of several "
    "recordings can be compared without that"
)


@dataclass(frozen=True)
class Mass:
    """A force as a mass.

    `mass_g` is added, or below zero taken away; `sideways_N` is the part of the force across the weight.
    """

    mass_g: FittedParameter
    sideways_N: float


def mass_of(change: Cause, gravity_mps2: Array) -> Mass | None:
    """Return the mass whose weight a change's force is; None where it is no weight.

    That is where no weight acts, the change is no force, or the force has a part across the weight that its
    interval does not leave open. The interval's half is the sum of the components' halves, each by its share
    in the weight's direction, so that it holds however they go together.

    `gravity_mps2`: in the base frame, shape (3,).
    """
    strength = float(np.linalg.norm(gravity_mps2))
    given = [change.parameters.get(f"force_{axis}_N") for axis in "xyz"]
    if strength == 0.0 or all(item is None for item in given):
        return None
    down = gravity_mps2 / strength
    force = np.array([0.0 if item is None else item.value for item in given])
    half = np.array([0.0 if item is None else 0.5 * (item.ci95[1] - item.ci95[0]) for item in given])
    along = float(force @ down)
    across = force - along * down
    if (np.abs(across) > half + 1e-12 * strength).any():
        return None
    grams = 1e3 / strength
    reach = float(np.abs(down) @ half)
    mass = FittedParameter(grams * along, (grams * (along - reach), grams * (along + reach)), 0.0)
    return Mass(mass, float(np.linalg.norm(across)))


# ----------------------------------------------------------------------------------------------------
# How a number went over several recordings: it stayed, stepped once, or drifted.
#
# Three simple courses are laid through its changes since the first recording, taken to be equally far apart
# in the order given: none, one step to another level, and a straight line from the first recording. Of a
# step and a line each has one number, so that the better one is the one that misses by less.

STEADY, STEP, DRIFT, OPEN, IRREGULAR = "steady", "step", "drift", "step or drift", "irregular"


@dataclass(frozen=True)
class NumberCourse:
    """How a number went over recordings.

    `kind` is `STEADY`, `STEP`, `DRIFT`, `OPEN`: either, or `IRREGULAR`: it changed in another way; `after`,
    of a step, the number from 0 of the recording after which it came.
    """

    kind: str
    after: int | None = None


def course_of(change: Array, deviation: Array) -> NumberCourse:
    """Return how a number went.

    Half of each variance is taken to be the first recording's, which all changes share (`COMMON_SHARE`).

    `change` of each later recording since the first, and its standard deviation, shape (n,) each.
    """
    if not (np.isfinite(change).all() and np.isfinite(deviation).all()):
        return NumberCourse(OPEN)
    rounding = 1e-12 * float(np.abs(change).max())
    spread = np.maximum(deviation, max(rounding, 1e-300))
    own = (1.0 - COMMON_SHARE) * np.diag(spread**2)
    precision = np.asarray(np.linalg.inv(own + COMMON_SHARE * np.outer(spread, spread)), dtype=float)
    count = len(change)
    steps = [_missed(change, (np.arange(count) >= k).astype(float), precision) for k in range(count)]
    line = _missed(change, np.arange(1.0, count + 1.0), precision)
    still = float(change @ precision @ change)
    if still - min(*steps, line) < COURSE_SURER:
        return NumberCourse(STEADY)
    if min(*steps, line) > float(chi2.ppf(1.0 - COURSE_MISSED, max(count - 1, 1))):
        return NumberCourse(IRREGULAR)
    if abs(min(steps) - line) < COURSE_SURER:
        return NumberCourse(OPEN)
    return NumberCourse(STEP, int(np.argmin(steps))) if min(steps) < line else NumberCourse(DRIFT)


def _missed(change: Array, shape: Array, precision: Array) -> float:
    """Return the weighed square by which a course of a given shape, of the best size, misses."""
    size = float(shape @ precision @ change) / float(shape @ precision @ shape)
    left = change - size * shape
    return float(left @ precision @ left)


# ----------------------------------------------------------------------------------------------------
# How much of a change nothing that follows from the commands can tell.
#
# A robot that moves is never twice where it was: it swings, by what no command says. What is left of a
# change by a smooth function of the commands, learned on other trials, is more than that; no cause need do
# better.


def unpredicted_share(problem: Problem, robot: RobotSpec) -> float:
    """Return the share of a change that a smooth function of the commands leaves of trials left out.

    `problem`: the training trials without what both share; `robot`: the earlier recording's. A root mean
    square over another, at most `MOST_MODEL_SHARE`; 0 where a single trial trains.
    """
    if len(problem.trials) < 2:
        return 0.0
    change = residuals(replace(problem, robot=robot), (), np.zeros((1, 0)))[0]
    left = _left(problem, change)
    return min(MOST_MODEL_SHARE, float(np.sqrt(left @ left / max(float(change @ change), 1e-300))))


def _left(problem: Problem, change: Array) -> Array:
    """Return what is left of a change in every trial, by what the others say, shape (n,)."""
    trial, block = trial_of(problem), blocks_of(problem)
    left = change.copy()
    for index, away in enumerate(problem.trials):
        mine = trial == index
        others = replace(problem, trials=tuple(item for item in problem.trials if item is not away))
        there = replace(problem, trials=(away,))
        left[mine] -= explained(others, change[~mine], block[~mine], there)
    return left


# ----------------------------------------------------------------------------------------------------
# What an earlier recording says of a robot: its best model, and what that model gets wrong, row by row.

LEFT_OUT = "earlier_trials_left_out"


@dataclass(frozen=True)
class Baseline:
    """An earlier recording, explained as well as causes can.

    Attributes:
        dataset: it, in the robot's base frame.
        robot: calibrated, with the causes that explain it, believed or not.
        errors: measured minus computed, of each trial, shape (r, o), in file units; NaN where missing.
        columns: the outputs, shape (o,).
        problem: its trials.
        registration: how its positions were moved into the base frame.
        twin: what fits go by.
        misfit: its largest error over the noise, of any unit.
        relative_error: its largest error over the spread of what was measured, of any unit.
        notes: on trials that were left out.
        choice: of its causes; None: none were looked for.
    """

    dataset: Dataset
    robot: RobotSpec
    errors: tuple[Array, ...]
    columns: tuple[str, ...]
    problem: Problem
    registration: Registration
    twin: Prediction
    misfit: float
    relative_error: float
    notes: tuple[Note, ...] = ()
    choice: Choice | None = None

    @property
    def name(self) -> str:
        """Return the name of its data set."""
        return self.dataset.name

    @property
    def inputs(self) -> tuple[Inputs, ...]:
        """Return the inputs of each of its trials."""
        return tuple(trial.inputs for trial in self.dataset.trials)


def baseline(run: DiagnosisRun, dataset: Dataset, is_paired: bool) -> Baseline:
    """Return what an earlier recording says of the robot.

    Its best hypothesis is taken whether or not its causes would be named: whatever it soaks up, both
    recordings share. Trials that look wrong are left out, if most do not. Where the later one's rows pair
    with its rows (`is_paired`), what both share cancels: no causes are looked for, and the specimen's numbers
    alone are calibrated.

    Raises:
        InputError: the recording looks wrong by itself, or has too little to learn from.
    """
    run.say("explaining the earlier recording")
    read = readings_of(dataset)
    lacking = too_little_to_learn(read.train, dataset.output_channels)
    if lacking:
        raise InputError(f"{dataset.folder}: nothing can be compared with it: {lacking[0]}")
    prepared = prepare(dataset, read)
    split = split_problem(prepared)
    before = calibrate(split)
    faults = without_explained_faults(run, split, before, find_data_faults(split, before))
    if faults.found:
        return baseline(run, _without_wrong_trials(dataset, faults), is_paired)
    choice, chosen = None, before.fit
    if not is_paired:
        left_s = run.deadline - time.monotonic()
        hurried = replace(run, deadline=time.monotonic() + BASELINE_BUDGET * left_s)
        choice = choose_causes(hurried, split, faults, EARLIER_CAUSES)
        chosen = choice.fit
    robot = robot_with(split.train, chosen.numbers, chosen.x)
    trials = split.dataset.trials
    errors = errors_with(split.train, robot, trials)
    sizes = by_unit(split.train.columns, np.concatenate(errors))
    measured = np.concatenate([measured_of(trial, split.train.columns) for trial in trials])
    spread = by_unit(split.train.columns, measured - np.nanmean(measured, axis=0))
    return Baseline(
        dataset=split.dataset,
        robot=robot,
        errors=errors,
        columns=split.train.columns,
        problem=replace(split.train, trials=trials),
        registration=split.registration,
        twin=prepared.twin,
        misfit=max(times_noise(size, before.noise.get(unit, 0.0)) for unit, size in sizes.items()),
        relative_error=max(size / max(spread[unit], 1e-12) for unit, size in sizes.items()),
        notes=tuple(note for note in dataset.notes if note.code == LEFT_OUT),
        choice=choice,
    )


def errors_with(problem: Problem, robot: RobotSpec, trials: Sequence[Trial]) -> tuple[Array, ...]:
    """Return measured minus computed of each trial, shape (r, o), in file units; NaN where missing."""
    return tuple(
        measured_of(trial, problem.columns) - problem.twin([robot], trial.inputs, 1)[0] for trial in trials
    )


def _without_wrong_trials(dataset: Dataset, faults: Faults) -> Dataset:
    """Return an earlier recording without the trials that look wrong, with a note.

    Raises:
        InputError: it looks wrong as a whole, or fewer than two trials, or half of them, would be left.
    """
    wrong = {item.where for item in faults.found}
    kept = tuple(replace(trial, role="") for trial in dataset.trials if trial.file not in wrong)
    left_out = len(dataset.trials) - len(kept)
    if left_out < len(wrong) or len(kept) < 2 or left_out >= len(kept):
        raise InputError(f"{dataset.folder}: nothing can be compared with it: {faults.found[0].words}")
    note = Note(
        LEFT_OUT,
        f"Of the earlier recording {listed(sorted(wrong))} was left out. {faults.found[0].words}",
    )
    return replace(dataset, trials=kept, notes=(*dataset.notes, note))


def left_by_unit(base: Baseline, later: Sequence[Trial], robot: RobotSpec) -> Mapping[str, float]:
    """Return what is left of both recordings, root mean square by unit.

    `later`: the later trials without what both share; `robot`: theirs.
    """
    errors = (*base.errors, *errors_with(base.problem, robot, later))
    return by_unit(base.columns, np.concatenate(errors))


def smooth_errors(base: Baseline, there: Problem) -> tuple[Array, ...]:
    """Return what a smooth error of unknown cause, learned from the earlier recording, is elsewhere.

    Measured minus computed, of each trial, shape (r, o), in file units; no output of `there` is missing.
    """
    residual = np.concatenate(
        [
            (-error / base.problem.weight)[np.isfinite(error)]
            for error in (item[:: base.problem.every] for item in base.errors)
        ]
    )
    flat = explained(base.problem, residual, blocks_of(base.problem), there)
    found, start = [], 0
    for trial in there.trials:
        shape = (len(trial.inputs), len(base.columns))
        part = flat[start : start + shape[0] * shape[1]].reshape(shape)
        found.append(-part * base.problem.weight)
        start += shape[0] * shape[1]
    return tuple(found)


def by_unit(columns: tuple[str, ...], errors: Array) -> Mapping[str, float]:
    """Return the root mean square of errors (r, o) by unit; NaN is left out."""
    units = np.array([unit_of(name) for name in columns])
    return {
        str(unit): float(np.sqrt(np.nanmean(errors[:, units == unit] ** 2)))
        for unit in dict.fromkeys(units.tolist())
        if np.isfinite(errors[:, units == unit]).any()
    }


# ----------------------------------------------------------------------------------------------------
# A later recording without what it shares with an earlier one.


@dataclass(frozen=True)
class Differences:
    """A later recording without what both share.

    It is `prepared` to be fitted; its robot is the earlier recording's. Of its `rows` with a measured value
    `paired_rows` pair with rows of the earlier one.
    """

    prepared: Prepared
    rows: int
    paired_rows: int


def differences(dataset: Dataset, base: Baseline) -> Differences:
    """Return a later recording without what it shares with an earlier one.

    From each measured value the error that the earlier recording's model had at the paired rows is taken; at
    rows without a pair, the smooth error that it had in general. What is left can be explained by the earlier
    robot, and by what changed. One recording's scatter stays in it, since no one row tells it from a change.
    """
    rounded = replace(dataset, resolution=resolution_of(dataset))
    readings, frozen = without_frozen_readings(registered(rounded, base.registration))
    moving = readings.motion.moving
    pairs = [paired(trial.inputs, base.inputs, base.errors, moving) for trial in readings.trials]
    smooth = smooth_errors(
        base, replace(base.problem, trials=_filled(readings.trials, readings.output_channels), every=1)
    )
    trials = tuple(
        _without(trial, base.columns, np.where(np.isfinite(item.error), item.error, other))
        for trial, item, other in zip(readings.trials, pairs, smooth, strict=True)
    )
    difference = replace(
        readings,
        robot=base.robot,
        trials=trials,
        calibration=(),
        repeatability=_repeatability(base, pairs, smooth, readings),
        model_share=MODEL_SHARE if base.misfit > NEAR_NOISE else 0.0,
    )
    train, heldout = split_trials(difference)
    if moving and difference.model_share:
        change = replace(base.problem, trials=train, every=1)
        share = max(difference.model_share, unpredicted_share(change, base.robot))
        difference = replace(difference, model_share=share)
    prepared = Prepared(
        difference,
        train,
        heldout,
        (*readings.notes, *base.notes, *frozen),
        lacking=lacking_in(difference, train, heldout),
        registration=unmoved(base.registration),
        twin=base.twin,
    )
    rows = _measured_rows(readings)
    with_pair = [mine & (item.count > 0) for mine, item in zip(rows, pairs, strict=True)]
    return Differences(prepared, _number(rows), _number(with_pair))


def _number(rows: Sequence[np.ndarray]) -> int:
    return sum(int(mine.sum()) for mine in rows)


def _measured_rows(dataset: Dataset) -> list[np.ndarray]:
    """Return which rows of each trial have a measured value, shape (r,)."""
    columns = dataset.output_channels
    return [np.isfinite(measured_of(trial, columns)).sum(axis=1) > 0 for trial in dataset.trials]


def _repeatability(
    base: Baseline, pairs: Sequence[Pairs], smooth: Sequence[Array], readings: Dataset
) -> dict[str, float]:
    """Return by how much the later recording would differ where nothing changed, by unit.

    Of rows that pair with several, the scatter of these; else what the smooth error leaves of the earlier
    recording, at least its noise. No less than what rounding leaves of both.
    """
    measured = _measured_rows(readings)
    spread = np.concatenate([item.spread for item in pairs])
    scatter = by_unit(base.columns, np.sqrt(spread))
    own = smooth_errors(
        base, replace(base.problem, trials=_filled(base.problem.trials, base.columns), every=1)
    )
    left = by_unit(
        base.columns, np.concatenate([error - part for error, part in zip(base.errors, own, strict=True)])
    )
    whole = np.concatenate(
        [np.isfinite(item.error[mine]).all(axis=1) for item, mine in zip(pairs, measured, strict=True)]
    )
    found = dict(scatter)
    if not whole.all():
        share = float(whole.mean())
        found = {
            unit: float(np.sqrt(share * scatter.get(unit, 0.0) ** 2 + (1.0 - share) * value**2))
            for unit, value in left.items()
        }
    first, second = (rounding_of(base.columns, resolution_of(item)) for item in (base.dataset, readings))
    return {unit: max(size, float(np.hypot(first[unit], second[unit]))) for unit, size in found.items()}


def _without(trial: Trial, columns: Sequence[str], error: Array) -> Trial:
    values = measured_of(trial, columns) - error
    outputs = {name: values[:, index] for index, name in enumerate(columns)}
    return replace(trial, outputs=replace(trial.outputs, columns=outputs))


def _filled(trials: Sequence[Trial], columns: Sequence[str]) -> tuple[Trial, ...]:
    """Return trials in which every output has a value, so that every row is predicted."""
    found = []
    for trial in trials:
        zeros = {name: np.zeros(len(trial.inputs)) for name in columns}
        outputs = Table(trial.inputs.time_s, zeros, trial.outputs.where)
        found.append(replace(trial, outputs=outputs))
    return tuple(found)
