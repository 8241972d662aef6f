"""Faults of whole columns: swapped, turned in sign, in another unit, out of step, not driven."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import drives_of
from catheter_sim.core.inputs import Inputs, Quantity, sums
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.fit import Fit, predicted_along
from catheter_sim.diagnosis.mapping import UNITS
from catheter_sim.diagnosis.noise import white_noise
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.readings import steps_of
from catheter_sim.diagnosis.result import DataFault
from catheter_sim.diagnosis.thresholds import (
    FEWEST_VALUES,
    GROSS_SHARE,
    LATE_NOISE,
    LATE_ROWS,
    MISTAKE_SOLVED_SHARE,
    NO_EQUILIBRIUM_ERROR,
    PULL_BEYOND,
    STANDS_SHARE,
    STEP_STRETCH_ROWS,
    STILL_SHARE,
)
from catheter_sim.diagnosis.trials import Trial, all_inputs, measured_of, points_of, unit_of
from catheter_sim.errors import InputError
from catheter_sim.planning.models import plan_drives
from catheter_sim.robots import kind_of

MISTAKE_CONVINCING = 0.5
"""[error with a mistake put right over the error with it] Below this ratio the mistake is believed. Why:
nothing else halves an error. Causes turn no sign, exchange nothing, and scale by less than the factors
between units."""
TENSION_BEYOND = (10.0, 100.0)
"""[times the tension that bends the robot fully, without friction] A tension beyond the first number is
reported. Beyond the second, no such robot was pulled. Why: assumed. Friction asks for several times as much.
N instead of mN is a factor of 1000."""
MOTION_BEYOND = (2.2, 5.0)
"""[robot lengths] The same for a measured point's motion along an axis. Why: a tip that turns all round moves
by two lengths. Mistakes such as cm for mm are a factor of ten."""
TURN_BEYOND = (2.0, 5.0)
"""[turns] The same for a measured angle. Why: a joint turns by less than one."""
OUTER_SHARE = 0.05
"""[share of the values at either end] These checks leave out this much. Why: a few wrong rows are another
fault."""
FOLLOWS_SHARE = 0.2
"""[share of an output's variance] If the inputs and the model explain less, the output does not follow them.
Why: assumed. They explain nothing of noise alone, and causes of the list change an output without undoing
it."""
FOLLOWS_OF_EXPECTED = 0.4
"""[share of what a right model would explain] The same where noise is large. The smaller of the two limits
counts. Why: assumed."""
STILL_FOLLOWS_SHARE = 0.6
"""[share of an output's variance] The same for an output that hardly moves. Why: an output that moves by a
tenth of what is expected must at least move with the inputs."""
MOVES_SHARE = 0.2
"""[share of the largest computed motion of its unit] An output with less is not expected to move. Why: where
the model moves little, its error decides."""
TELLING_SHARE = 0.1
"""[share of the variance] The diagnosis says "no motion" only if this much would be motion with a right
model. Why: below it noise hides the motion."""
TELLING_SPREADS = 5.0
"""[standard deviations of what chance explains] The same for few rows. Why: five of them are no chance."""
UNDRIVEN_ROWS = 6
"""[rows] Inputs stand still over at least this many while outputs go out and come back. Why: assumed. With
fewer, an outlier or two look like that."""
UNDRIVEN_NOISE = 12.0
"""[times the noise] The outputs must go out this far. Why: that is far beyond what a median of three rows
lets pass."""
UNDRIVEN_BACK_SHARE = 0.5
"""[share of the way out] The outputs must end within this of where they started. Why: what lags or creeps
goes one way, and ends where it has gone."""
UNDRIVEN_STRETCHES = 2
"""[stretches] That must happen in at least this many. Why: once may be a hand that touched the robot."""
STEP_ROWS = 12
"""[rows] Two logs may be shifted against one another by this many. Why: assumed. A larger shift is another
trial."""
STEP_ONE_WAY_ROWS = 5
"""[rows] A shift must hold on at least this many on the way out, and on the way home. Why: in a stretch that
goes only one way, a bend that stays back by a constant looks shifted."""
STEP_LEFT_SHARE = 0.3
"""[share of the squared error] With the logs put right, at most this may be left. Why: assumed. A wrong model
errs at any shift."""
STEP_USUAL_TIMES = 3.0
"""[times the squared error of the middle trial] With the logs put right, at most this may be left. Why: the
trial is then about as well explained as the others are."""
LATE_OTHERS = 2.0
"""[times the squared error] With the delay of a late trial, other trials must err by this much more. Why: a
robot that is late is late in all trials."""
DRIVEN_SHARE = 0.5
"""[share of a late trial's drive of an input] Another trial must drive the input by at least this to show
that it is not late. Why: assumed. A lag, or a dead-band, of one channel shows only where that channel is
driven."""

# ----------------------------------------------------------------------------------------------------
# How far a model is off, beside how much the measurements vary.


def relative_error_of(
    trials: Sequence[Trial], columns: Sequence[str], predict: Callable[[Inputs], Array], shifted: bool
) -> float:
    """Return a model's error over the measurements' spread; arguments as of `most_likely_mistake`."""
    measured = [measured_of(trial, columns) for trial in trials]
    return relative_error([predict(trial.inputs) for trial in trials], measured, columns, shifted)


def relative_error(
    models: Sequence[Array],
    measured: Sequence[Array],
    columns: Sequence[str],
    shifted: bool,
    beside: Array | None = None,
) -> float:
    """Return the error over the measurements' spread, root mean square over units; inf: no posture.

    Of each unit all columns count together, so that those that move most count most. `models`, `measured`
    (NaN: missing) and `beside`, whose spread counts instead of the measured ones', have the shape (r, o)
    each. `shifted`: errors of positions are counted about their means.
    """
    model, values = np.concatenate(models), np.concatenate(measured)
    if not np.isfinite(model[np.isfinite(values)]).all():
        return math.inf
    spread = values if beside is None else beside
    shares = []
    for unit in dict.fromkeys(unit_of(name) for name in columns):
        mine = [k for k, name in enumerate(columns) if unit_of(name) == unit]
        mine = [k for k in mine if np.isfinite(values[:, k]).any()]
        error = model[:, mine] - values[:, mine]
        if shifted and unit == "mm" and mine:
            error = error - np.nanmean(error, axis=0)
        if mine:
            total = float(np.nanvar(spread[:, mine], axis=0).mean())
            shares.append(float(np.nanmean(error**2)) / max(total, 1e-24))
    return math.sqrt(sum(shares) / len(shares)) if shares else 0.0


def noise_share(trials: Sequence[Trial], columns: Sequence[str]) -> float:
    """Return what noise alone would make of `relative_error`; an upper bound, from row to row."""
    series = {name: [trial.outputs.columns[name] for trial in trials] for name in columns}
    noise = white_noise(series, trials, steps_of(trials, columns))
    values = np.concatenate([measured_of(trial, columns) for trial in trials])
    shares = []
    for unit, size in noise.items():
        mine = [k for k, name in enumerate(columns) if unit_of(name) == unit]
        mine = [k for k in mine if np.isfinite(values[:, k]).any()]
        shares.append(size**2 / max(float(np.nanvar(values[:, mine], axis=0).mean()), 1e-24))
    return math.sqrt(sum(shares) / len(shares)) if shares else 0.0


def computed_outputs(problem: Problem, before: Fit, trials: Sequence[Trial]) -> list[Array]:
    return predicted_along(problem, before.numbers, before.x, [trial.inputs for trial in trials])


def errors_in_noise(
    problem: Problem, result: Fit, trials: Sequence[Trial], noise: Mapping[str, float]
) -> Array:
    """Return each trial's error, root mean square in units of the noise, shape (k,)."""
    scale = np.array([noise[unit_of(name)] for name in problem.columns])
    return np.array(
        [
            np.sqrt(np.nanmean(((model - measured_of(trial, problem.columns)) / scale) ** 2))
            for trial, model in zip(trials, computed_outputs(problem, result, trials), strict=True)
        ]
    )


# ----------------------------------------------------------------------------------------------------
# Measurements beside what the calibrated model says of them: what checks of the data look at.


@dataclass(frozen=True)
class BesideModel:
    """All trials, the held-out ones too, measured and computed.

    `models` are what the calibrated model says, shape (r, o) each; `noise` is that of each unit. `moving`:
    the robot moved while it was measured.
    """

    trials: Sequence[Trial]
    columns: Sequence[str]
    models: Sequence[Array]
    noise: Mapping[str, float]
    moving: bool = False

    @cached_property
    def measured(self) -> tuple[Array, ...]:
        """Outputs, shape (r, o) each; NaN: missing."""
        return tuple(measured_of(trial, self.columns) for trial in self.trials)

    @cached_property
    def errors(self) -> tuple[Array, ...]:
        """Measured less computed, shape (r, o) each."""
        return tuple(a - b for a, b in zip(self.measured, self.models, strict=True))

    @cached_property
    def scaled_models(self) -> tuple[Array, ...]:
        """The models, each output scaled and shifted as it fits all trials best."""
        measured, models = np.concatenate(self.measured), np.concatenate(list(self.models))
        line = []
        for shown, computed in zip(measured.T, models.T, strict=True):
            known = np.isfinite(shown) & np.isfinite(computed)
            moves = known.any() and float(np.ptp(computed[known])) > 0.0
            line.append(np.polyfit(computed[known], shown[known], 1) if moves else np.array([1.0, 0.0]))
        scale, offset = np.array(line).T
        return tuple(model * scale + offset for model in self.models)

    @cached_property
    def drives(self) -> tuple[Array, ...]:
        """Inputs over their ranges in all trials, shape (r, i) each; those that never change are left out."""
        given = [all_inputs(trial.inputs) for trial in self.trials]
        span = np.ptp(np.concatenate(given), axis=0)
        return tuple(item[:, span > 0.0] / span[span > 0.0] for item in given)

    @cached_property
    def points(self) -> tuple[list[int], ...]:
        """Indices of each point's coordinates, all with the same axes as the first one."""
        found = list(points_of(self.columns).values())
        return tuple(list(axes.values()) for axes in found if found and list(axes) == list(found[0]))

    @cached_property
    def noise_mm(self) -> float:
        """Noise of positions."""
        return max(self.noise.get("mm", 0.0), 1e-9)

    @cached_property
    def moves(self) -> tuple[int, ...]:
        """Indices of the outputs that the model moves by a fair share of the largest motion of their unit."""
        spread = np.nanstd(np.concatenate(list(self.models)), axis=0)
        units = [unit_of(name) for name in self.columns]
        most = {unit: max(s for s, u in zip(spread, units, strict=True) if u == unit) for unit in set(units)}
        return tuple(
            k for k, unit in enumerate(units) if spread[k] > MOVES_SHARE * most[unit] and most[unit] > 0.0
        )

    @cached_property
    def error_shares(self) -> Array:
        """Each trial's error over the spread of what the model says of all trials, shape (t,)."""
        return np.array([self.error_share(number, model) for number, model in enumerate(self.models)])

    def error_share(self, number: int, model: Array) -> float:
        """Return the same of one trial, for another model of it (r, o); very large: no posture."""
        everything = np.concatenate(list(self.models))
        share = relative_error([model], [self.measured[number]], self.columns, False, beside=everything)
        return share if np.isfinite(share) else NO_EQUILIBRIUM_ERROR

    @cached_property
    def motions(self) -> Array:
        """How far the model moves in each trial, root mean square over noise, shape (t,)."""
        noise = np.array([self.noise_of(column) for column in self.moves])
        return np.array(
            [
                float(np.sqrt(np.mean((np.std(model[:, list(self.moves)], axis=0) / noise) ** 2)))
                if self.moves
                else 0.0
                for model in self.models
            ]
        )

    def noise_of(self, column: int) -> float:
        """Return the noise of an output."""
        return max(self.noise.get(unit_of(self.columns[column]), 0.0), 1e-9)


# ----------------------------------------------------------------------------------------------------
# Factors by which a column in a wrong unit is off.

METRES = 1e3
OUTPUT_FACTORS = {
    METRES: "m for mm",
    25.4: "inches for mm",
    10.0: "cm for mm",
    180.0 / math.pi: "rad for deg",
}


INPUT_FACTORS = {
    Quantity.TENSION: {
        1e-3: "mN for N",
        1e3: "kN for N",
        9.80665: "kgf for N",
        9.80665e-3: "gf for N",
        4.44822: "lbf for N",
    },
    Quantity.DISPLACEMENT: {1e-3: "um for mm", 1e3: "m for mm", 25.4: "inches for mm", 10.0: "cm for mm"},
}

# By what a number is too large where one unit was read as another: factor, as what it was read, what it is.
MISREAD = (
    (10.0, "cm", "mm"),
    (25.4, "in", "mm"),
    (180.0 / math.pi, "rad", "deg"),
    (360.0, "turn", "deg"),
    (1e3, "m", "mm"),
    (1e3, "mm", "um"),
    (4.44822, "lbf", "N"),
    (9.80665, "kgf", "N"),
    (1e3 / 9.80665, "N", "gf"),
    (1e3, "N", "mN"),
    (1e3, "kN", "N"),
)


# ----------------------------------------------------------------------------------------------------
# Outputs that go out and come back while every input stands still.


def moved_without_inputs(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return the trials whose outputs go out and come back while the inputs stand still.

    What lags or creeps goes one way. So an input is not in the file, or its sensor ends where it stands.
    Nothing is said of robots that swing.
    """
    if seen.moving:
        return ()
    found = [
        (number, rows)
        for number, drive in enumerate(seen.drives)
        for rows in _standing(drive)
        if _out_and_back(seen, number, rows)
    ]
    if len(found) < UNDRIVEN_STRETCHES:
        return ()
    return tuple(
        DataFault(
            "The outputs go out and come back while the inputs stand still. Is an input missing from the "
            "file, or does its sensor end there?",
            seen.trials[number].file,
            (rows.start + 1, rows.stop),
        )
        for number, rows in found
    )


def _standing(drive: Array) -> Iterator[slice]:
    """Yield the stretches of rows in which no input changes."""
    still = np.asarray((np.abs(np.diff(drive, axis=0)) <= STANDS_SHARE).all(axis=1))
    start = 0
    for row in range(len(still) + 1):
        if row < len(still) and still[row]:
            continue
        if row - start + 1 >= UNDRIVEN_ROWS:
            yield slice(start, row + 1)
        start = row + 1


def _out_and_back(seen: BesideModel, number: int, rows: slice) -> bool:
    """Return whether an output goes out by far more than the noise in a stretch, and comes back."""
    for column in range(len(seen.columns)):
        values = seen.measured[number][rows, column]
        values = values[np.isfinite(values)]
        if len(values) < UNDRIVEN_ROWS:
            continue
        padded = np.pad(values, 1, mode="edge")
        calm = np.median(np.stack([padded[:-2], padded[1:-1], padded[2:]]), axis=0)
        chord = np.linspace(calm[0], calm[-1], len(calm))
        out = float(np.abs(calm - chord).max())
        if (
            out > UNDRIVEN_NOISE * seen.noise_of(column)
            and abs(calm[-1] - calm[0]) < UNDRIVEN_BACK_SHARE * out
        ):
            return True
    return False


# ----------------------------------------------------------------------------------------------------
# Outputs that do not follow the inputs: noise, or a tracker that nobody attached.


def outputs_that_do_not_follow(problem: Problem, models: Sequence[Array]) -> tuple[DataFault, ...]:
    """Return the points, or other outputs, that do not follow the inputs although the computed ones do.

    Such an output is hardly a function of the inputs, of their squares, and of what the model says now and
    some rows before. These explain less than `FOLLOWS_SHARE` of its variance (adjusted for their number).
    It is noise, or a tracker that nobody attached. Where noise would hide the expected motion nothing is
    said, unless it does so in every output. `models`: what the calibrated model says of the training
    trials, shape (r, o) each.
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


# ----------------------------------------------------------------------------------------------------
# Outputs that come before their inputs, or late in one trial alone: rows that were lost or put off.


def outputs_out_of_step(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return where outputs run ahead of their inputs, or lag behind them in one trial alone.

    What is measured before it is caused was put there: rows of one log are missing. A lag may be the robot's,
    but then other trials have it too, by as many seconds.
    """
    return _ahead(seen) or _late_alone(seen)


def _ahead(seen: BesideModel) -> tuple[DataFault, ...]:
    faults = []
    for number in range(len(seen.trials)):
        rows = len(seen.models[number])
        parts = [slice(0, rows)]
        if rows >= 2 * STEP_STRETCH_ROWS:
            parts += [slice(0, rows // 2), slice(rows // 2, rows)]
        for part in parts:
            # Scaled too: where all trials are out of step a scale fits to nothing.
            both = (seen.models, seen.scaled_models)
            shift = min(_best_shift(seen, models, number, part) for models in both)
            if shift < 0:
                faults.append(
                    DataFault(
                        f"The outputs come {-shift} rows before the inputs that cause them. Are rows of "
                        "the outputs lost, or are the two logs shifted against each other?",
                        seen.trials[number].file,
                        (part.start + 1, part.stop),
                    )
                )
                break
    return tuple(faults)


def _late_alone(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return the trials that lag by rows although the others would show as many seconds, and do not.

    Of the others only those count that drive the same inputs, as a channel may have a lag, or a dead-band,
    alone; and that are explained in time as well as the late one is put right.
    """
    models = seen.scaled_models
    whole = [slice(0, len(model)) for model in models]
    shifts = [_best_shift(seen, models, number, part) for number, part in enumerate(whole)]
    late = [number for number, shift in enumerate(shifts) if shift > 0]
    in_time = [number for number in range(len(seen.trials)) if number not in late]
    if not late or len(late) > max(1, len(in_time) // 2):
        return ()
    for number in late:
        put_right = _unexplained(seen, models, number, whole[number], shifts[number])
        others = [
            k
            for k in in_time
            if _drives_as_much(seen, k, number)
            and _unexplained(seen, models, k, whole[k]) <= STEP_USUAL_TIMES * put_right
        ]
        time_s = seen.trials[number].inputs.time_s
        seconds = float(np.median(time_s[shifts[number] :] - time_s[: -shifts[number]]))
        telling = [
            _unexplained(seen, models, k, whole[k], seconds=seconds)
            > LATE_OTHERS * _unexplained(seen, models, k, whole[k])
            for k in others
        ]
        if 2 * sum(telling) <= len(others):  # also where there is none
            return ()
    return tuple(
        DataFault(
            f"The outputs come {shifts[number]} rows late, and in the other trials they do not. Are the two "
            "logs of this trial shifted against each other?",
            seen.trials[number].file,
        )
        for number in late
    )


def _drives_as_much(seen: BesideModel, number: int, late: int) -> bool:
    """Return whether a trial drives each input that a late one drives, by a fair share of that."""
    mine, other = (np.ptp(seen.drives[k], axis=0) for k in (number, late))
    return bool((mine >= DRIVEN_SHARE * other).all())


def _best_shift(seen: BesideModel, models: Sequence[Array], number: int, part: slice) -> int:
    """Return by how many rows outputs lag (ahead: below zero); 0 where no shift does far better."""
    length = part.stop - part.start
    if length < STEP_STRETCH_ROWS:
        return 0
    most = min(STEP_ROWS, length // 3)
    left = {shift: _unexplained(seen, models, number, part, shift) for shift in range(-most, most + 1)}
    best = min(left, key=lambda shift: left[shift])
    # At the end of what is looked at there is no least error.
    if left[0] < LATE_NOISE**2 or abs(best) < 2 or abs(best) == most:
        return 0
    # Put right, the trial must be as well explained as others are.
    others = [_unexplained(seen, models, k, slice(0, len(model))) for k, model in enumerate(models)]
    if left[best] > min(STEP_LEFT_SHARE * left[0], STEP_USUAL_TIMES * float(np.median(others))):
        return 0
    if best < 0 and not _either_way(seen, models, number, part, best):
        return 0
    rest = min(value for shift, value in left.items() if shift >= -1)
    return best if best > 0 or left[best] <= STEP_LEFT_SHARE * rest else 0


def _either_way(seen: BesideModel, models: Sequence[Array], number: int, part: slice, shift: int) -> bool:
    """Return whether a shift puts right what is measured on the ways out and on the ways home.

    Where the robot goes one way only, a bend that stays back by a constant looks as if it came earlier.
    """
    most = max(seen.moves, key=lambda column: float(np.nanstd(models[number][part, column])))
    step = np.gradient(models[number][:, most])
    for way in (step > 0.0, step < 0.0):
        left = _unexplained(seen, models, number, part, shift, only=way)
        before = _unexplained(seen, models, number, part, only=way)
        if not np.isfinite(left) or left > STEP_LEFT_SHARE * before:
            return False
    return True


def _unexplained(
    seen: BesideModel,
    models: Sequence[Array],
    number: int,
    part: slice,
    shift: int = 0,
    seconds: float = 0.0,
    only: np.ndarray | None = None,
) -> float:
    """Return the mean squared error, over the noise's, of what a model says so many rows and seconds earlier.

    `only`: the trial's rows that count. Rows for which the shifted model says nothing are left out. inf: too
    few rows.
    """
    rows = np.arange(part.start, part.stop)
    least = STEP_STRETCH_ROWS
    if only is not None:
        rows, least = rows[only[rows]], STEP_ONE_WAY_ROWS
    model, time_s = models[number], seen.trials[number].inputs.time_s
    rows = rows[(rows - shift >= 0) & (rows - shift < len(model))]
    moved = model[rows - shift]
    if seconds:
        rows = rows[time_s[rows] - seconds >= time_s[0]]
        moved = np.stack(
            [np.interp(time_s[rows] - seconds, time_s, model[:, k]) for k in range(model.shape[1])], axis=1
        )
    left, count = 0.0, 0
    for column in seen.moves:
        shown, computed = seen.measured[number][rows, column], moved[:, column]
        known = np.isfinite(shown) & np.isfinite(computed)
        if known.sum() < least:
            continue
        error = (shown[known] - computed[known]) / seen.noise_of(column)
        left, count = left + float(error @ error), count + len(error)
    return max(left / count, 1.0) if count else float("inf")


# ----------------------------------------------------------------------------------------------------
# Commands and motions far beyond what the robot can do: a wrong unit or spool, counts read as an angle.

_MOST = {Quantity.DISPLACEMENT: PULL_BEYOND, Quantity.TENSION: TENSION_BEYOND}
_COUNTS = "an encoder's counts read as an angle"
_READ = {
    "mm": ("cm", "in", "m", "mm"),
    "way": ("mm",),
    "deg": ("rad",),
    "N": ("lbf", "kgf", "N"),
}


@dataclass(frozen=True)
class Beyond:
    """A column whose numbers are far beyond the robot.

    `times` is how many times what the robot can do; `what` is beyond, a sentence without its end; `kind` is
    "way" of a tendon, "N", or "mm" and "deg" of a motion. `impossible`: by so much that no such robot was
    measured.
    """

    column: str
    times: float
    what: str
    kind: str
    impossible: bool

    def words(self, unit: str = "", spool_radius_mm: float = 0.0) -> str:
        """Return it as one line, with what is likely wrong.

        `unit`: as which the file was read, "" not known; `spool_radius_mm`: with which a motor's angle was
        read, 0 not known, or none.
        """
        read = (unit,) if unit else _READ[self.kind]
        fitting = [(by, f"{of} read as {own}") for by, own, of in MISREAD if own in read]
        likely = [said for _, said in sorted(item for item in fitting if item[0] >= 0.5 * self.times)[:2]]
        if self.kind == "way" and unit in ("", *UNITS["deg"]):
            likely.append(_COUNTS)
        if spool_radius_mm:
            likely.append(f"a spool of {spool_radius_mm / self.times:.2g} mm for one of {spool_radius_mm:g}")
        elif self.kind == "way" and not unit:
            likely.append(f"a spool whose radius is {_figure(self.times)} times too large")
        guess = f"; perhaps {', or '.join(likely)}" if likely else ""
        return f"{self.what}: its unit or scale is wrong{guess}"


def beyond_robot(robot: RobotSpec, trials: Sequence[Trial]) -> tuple[Beyond, ...]:
    """Return the columns of inputs, then of outputs, that are far beyond what a robot can do."""
    return (*_commands(robot, trials), *_motions(robot, trials))


def within_robot(robot: RobotSpec, inputs: Inputs) -> Inputs:
    """Return inputs with those of tendons cut off at what bends `robot` fully."""
    full = _full(replace(robot, actuation=inputs.actuation))
    return inputs if full is None else replace(inputs, tendon=np.clip(inputs.tendon, -full, full))


def _full(robot: RobotSpec) -> Array | None:
    """Return each tendon's input that bends `robot` fully, all drives together, shape (t,).

    Infinite for a tendon that bends nothing; None where none does.
    """
    try:
        plan = plan_drives(robot)
    except InputError:
        return None
    full = np.abs(plan.tendon) @ np.maximum(np.abs(plan.least), plan.most)
    return np.where(full > 0.0, full, np.inf)


def full_pulls(robot: RobotSpec) -> dict[str, float]:
    """Return by input column what bends `robot` fully, SI; a column that bends nothing is left out."""
    full = _full(robot)
    if full is None:
        return {}
    drives = [drive for drive in drives_of(robot) if drive.quantity in _MOST]
    found = {
        drive.column: min(full[i] / abs(part) for i, part in zip(drive.tendons, drive.parts, strict=True))
        for drive in drives
    }
    return {column: float(value) for column, value in found.items() if np.isfinite(value)}


def _commands(robot: RobotSpec, trials: Sequence[Trial]) -> Iterable[Beyond]:
    driven = replace(robot, actuation=trials[0].inputs.actuation)
    full, drives = full_pulls(driven), drives_of(driven)
    asked = [np.abs(trial.inputs.tendon @ sums(drives, trial.inputs.tendon.shape[1])) for trial in trials]
    for drive, values in zip(drives, np.concatenate(asked).T, strict=True):
        if drive.column not in full:
            continue
        reach, most = float(np.quantile(values, 1.0 - OUTER_SHARE)), full[drive.column]
        said, impossible = _MOST[drive.quantity]
        if reach > said * most:
            unit, size = drive.quantity.file_unit, drive.quantity.file_size
            what = (
                f"{drive.column} reaches {_figure(reach / size)} {unit}, {_figure(reach / most)} times the "
                f"{most / size:.2g} {unit} that bend the robot fully"
            )
            kind = "N" if drive.quantity is Quantity.TENSION else "way"
            yield Beyond(drive.column, reach / most, what, kind, reach > impossible * most)


def _motions(robot: RobotSpec, trials: Sequence[Trial]) -> Iterable[Beyond]:
    length_mm = 1e3 * kind_of(robot).model.length_m(robot)
    sizes = {
        "mm": (length_mm, MOTION_BEYOND, f"the robot's length of {length_mm:.3g} mm"),
        "deg": (360.0, TURN_BEYOND, "a full turn"),
    }
    for column in trials[0].outputs.columns:
        unit = column.rsplit("_", 1)[-1]
        if unit not in sizes:
            continue
        size, (said, impossible), name = sizes[unit]
        moves = max(_spread(trial.outputs.columns[column]) for trial in trials)
        if moves > said * size:
            what = f"{column} moves by {_figure(moves)} {unit}, {_figure(moves / size)} times {name}"
            yield Beyond(column, moves / size, what, unit, moves > impossible * size)


def _figure(value: float) -> str:
    """Return a number in two digits, or whole."""
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def _spread(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.subtract(*np.quantile(known, (1.0 - OUTER_SHARE, OUTER_SHARE)))) if len(known) else 0.0


# ----------------------------------------------------------------------------------------------------
# Columns swapped, turned in sign or in another unit: mistakes without which the model fits far better.


@dataclass(frozen=True)
class Mistake:
    """A mistake in the data, and how much better the model fits without it.

    The `error` of the model is that over the spread of the measurements, with the mistake put right;
    `before`, with the data as they are.
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

    `predict` gives the model's outputs along inputs, shape (r, o); the error `solved` is no mistake's.
    `shifted`: the tracker's origin is unknown; `beside`: outputs of all trials, where these are not all
    (`relative_error`).
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
                # In all trials `diagnosis.frame` has put metres right.
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
