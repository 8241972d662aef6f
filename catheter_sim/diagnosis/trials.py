"""What a measured data set is: trials of one robot, their cycles, which are held out."""

from __future__ import annotations

import difflib
import html
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import (
    FORCE_CHANNELS,
    MOMENT_CHANNELS,
    acts_on_body,
    actuations,
    input_channels,
    output_channels,
)
from catheter_sim.core.inputs import Inputs, slice_inputs
from catheter_sim.core.robot import RobotSpec, as_number
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.nuisance import Nuisance
from catheter_sim.diagnosis.thresholds import (
    FEWEST_VALUES,
    FOLDS,
    GAIN_CHANCE,
    HELDOUT_SHARE,
    PAYS_CHANCE,
    STILL_SHARE,
)
from catheter_sim.errors import InputError, cut, shown, unknown
from catheter_sim.tables import Table

MOST_HELDOUT_SHARE = 0.5
"""[share of the rows] At most this much is held out, where less would hold too few stretches to prove a gain.
Why: assumed. As much is left to fit."""
VALLEY_SHARE = 0.25
"""[share of the peaks on both sides] A valley of the pull below it ends a cycle. Why: assumed. Partial loops,
which end part of the way back, keep more pull than that."""
PEAK_SHARE = 0.1
"""[share of the trial's largest pull] A peak must reach it to count. Why: below it is noise about rest."""
MOST_PRETENSION_SHARE = 0.4
"""[share of the largest pull] What a tenth of the rows do not exceed is a standing pretension, up to this
size. Why: a robot whose lowest pull is higher never rests, so no row of it is rest."""
NOISE_ROWS = 3
"""[values of one series] With fewer, its noise is not estimated. Why: the estimate takes second differences
(`diagnosis.noise.white_noise`)."""
LEAST_BLOCK_S = 1.0
"""[s] In motion, stretches of rows that count as one last at least this long. Why: rows a hundredth of a
second apart are no independent values. A robot's swing lasts some tenths of a second."""
CLOCK_ROUNDING = 1e-6
"""[share of a stretch] A clock's digits may lack this much of it. Why: fifty steps of 0.1 s add up to 2e-15 s
less than 5 s. Epoch seconds have seven digits behind the point."""

# ----------------------------------------------------------------------------------------------------
# How the robot moved while data were taken.


@dataclass(frozen=True)
class Motion:
    """Whether rows were held.

    `name` is as `[conditions] motion` of a `dataset.toml`. `moving`: the robot moved while it was measured,
    from rest under a trial's first row; otherwise each row was held until it rested.
    """

    name: str
    moving: bool


HELD = Motion("held", False)
DYNAMIC = Motion("dynamic", True)
MOTIONS = {item.name: item for item in (HELD, DYNAMIC)}


def motion_named(name: object, where: str) -> Motion:
    """Return the motion of a name; raise `InputError` where there is none."""
    if not isinstance(name, str):
        raise unknown("motion", shown(name), MOTIONS, where)
    if name not in MOTIONS:
        raise unknown("motion", name, MOTIONS, where)
    return MOTIONS[name]


# ----------------------------------------------------------------------------------------------------
# What the names of output columns say: unit, point, axis.

POINT = re.compile(r"(tip|body_\d+|marker_\w+)_([xyz])_mm")
QUATERNION = ("tip_qw", "tip_qx", "tip_qy", "tip_qz")
TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")


def unit_of(column: str) -> str:
    """Return the unit of an output column: "mm", "deg", "N", or "1" for parts of a quaternion."""
    unit = column.rsplit("_", 1)[-1]
    return unit if unit in ("mm", "deg", "N") else "1"


def points_of(columns: Sequence[str]) -> dict[str, dict[str, int]]:
    """Return the index of every measured coordinate by point ("tip", "body_3", "marker_a") and axis."""
    found: dict[str, dict[str, int]] = {}
    for index, name in enumerate(columns):
        match = POINT.fullmatch(name)
        if match:
            found.setdefault(match[1], {})[match[2]] = index
    return found


def place_along(point: str) -> float:
    """Return a number that rises along the robot with bodies and the tip, and is 0 for markers."""
    if point == "tip":
        return np.inf
    return float(point.removeprefix("body_")) if point.startswith("body_") else 0.0


# ----------------------------------------------------------------------------------------------------
# What a measured data set is: trials of one robot.

_MOST_LISTED = 3  # names in a line of what a data set shows of itself


@dataclass(frozen=True)
class Trial:
    """One measured time series.

    Attributes:
        file: its name as `dataset.toml` gives it.
        role: "train", "heldout", or "" where the data set leaves it open.
        inputs: what the robot was commanded, SI units.
        outputs: what was measured, the data set's output columns in their units; NaN is missing.
    """

    file: str
    role: str
    inputs: Inputs
    outputs: Table


@dataclass(frozen=True, repr=False)
class Dataset:
    """A folder of measurements of one robot.

    Attributes:
        folder: where it lies.
        name, source, licence: as `dataset.toml` says.
        robot: the robot as specified, before anything is calibrated.
        robot_reference: how the data set names it (an id or a path).
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        input_channels, output_channels: the columns that the data set declares.
        trials: in the order of `dataset.toml`.
        motion: whether rows were held.
        calibration: numbers of the specimen that it wants calibrated; None: those that are known to vary.
        model_share: share of an error that a right cause may leave, beside the noise, of a model that is
            known to be wrong.
        repeatability: by how much a second recording of the same would differ, by unit, where that is known.
        resolution: step of the readings, by column that shows one (`resolution.steps_of`); None: not looked
            for yet.
        notes: what a reader of a diagnosis must know of the files.
    """

    folder: Path
    name: str
    robot: RobotSpec
    robot_reference: str
    source: str
    licence: str
    gravity_mps2: Array
    input_channels: tuple[str, ...]
    output_channels: tuple[str, ...]
    trials: tuple[Trial, ...]
    motion: Motion = HELD
    calibration: tuple[Nuisance, ...] | None = None
    notes: tuple[Note, ...] = ()
    repeatability: Mapping[str, float] = field(default_factory=dict)
    resolution: Mapping[str, float] | None = None
    model_share: float = 0.0

    def __repr__(self) -> str:
        rows = [len(trial.inputs) for trial in self.trials]
        said = [
            f"{trial.file} ({count} rows{', ' if trial.role else ''}{trial.role})"
            for trial, count in zip(self.trials, rows, strict=True)
        ]
        x, y, z = self.gravity_mps2
        parts = {
            "inputs": _listed(self.input_channels),
            "outputs": _listed(self.output_channels),
            "trials": _listed(said),
            "conditions": f"{self.motion.name}, gravity {x:g}, {y:g}, {z:g} m/s^2",
            "calibration": _listed([item.parameter.name for item in self.calibration or ()]),
            "notes": str(len(self.notes) or ""),
        }
        head = f"<Dataset {cut(self.name, 60)!r} of {self.robot.name}: {len(rows)} trials, {sum(rows)} rows"
        return "\n  ".join([head, *(f"{name}: {text}" for name, text in parts.items() if text)]) + ">"

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(repr(self)[1:-1])}</pre>"


def _listed(names: Sequence[str]) -> str:
    """Return names in one line, of many the first and how many more there are."""
    shown = [cut(name, 40) for name in names[:_MOST_LISTED]]
    more = len(names) - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more else "")


def measured_of(trial: Trial, columns: Sequence[str]) -> Array:
    """Return a trial's outputs, shape (r, o), NaN where missing."""
    return np.stack([trial.outputs.columns[name] for name in columns], axis=1)


def all_inputs(inputs: Inputs) -> Array:
    return np.hstack([inputs.tendon, inputs.force_tip, inputs.moment_tip])


def measured_from(trial: Trial) -> int:
    """Return the first row of a trial that has a measured value; 0 where none has."""
    if not trial.outputs.columns:
        return 0
    return int(np.argmax(np.isfinite(measured_of(trial, tuple(trial.outputs.columns))).any(axis=1)))


def beginnings(trials: Sequence[Trial], seconds: float) -> tuple[Trial, ...]:
    """Return the trials' beginnings, measured alike long: together `seconds`, or less."""
    each_s = seconds / max(len(trials), 1)
    return tuple(_until(trial, trial.inputs.time_s[measured_from(trial)] + each_s) for trial in trials)


def _until(trial: Trial, time_s: float) -> Trial:
    rows = slice(0, max(2, int(np.searchsorted(trial.inputs.time_s, time_s, side="right"))))
    columns = {name: values[rows] for name, values in trial.outputs.columns.items()}
    outputs = replace(trial.outputs, time_s=trial.outputs.time_s[rows], columns=columns)
    return replace(trial, inputs=slice_inputs(trial.inputs, rows), outputs=outputs)


# ----------------------------------------------------------------------------------------------------
# Where a trial returns to rest: its cycles; and the stretches of its rows that err together.


def cycles(trial: Trial) -> list[slice]:
    """Return the stretches of rows between returns to near rest, in order; together all rows.

    What counts is the pull: the largest tension, or positive displacement, of any tendon, or a load
    on the tip, as a share of the trial's largest. A tendon cannot push, so a displacement below zero
    is rest, unless the trial has hardly any other; a standing pretension is rest too. Rows are cut
    at the last row of a valley that lies below a quarter of the peaks before and after it.
    """
    pull = _pull(trial.inputs)
    starts = [0]
    peak, valley, low_row = 0.0, math.inf, 0
    for row, value in enumerate(pull):
        if peak >= PEAK_SHARE and value <= VALLEY_SHARE * peak and value <= valley:
            valley, low_row = value, row
        elif valley < math.inf and value >= max(valley / VALLEY_SHARE, PEAK_SHARE):
            starts.append(low_row)
            peak, valley = value, math.inf
        if valley == math.inf:
            peak = max(peak, value)
    return [slice(start, end) for start, end in zip(starts, [*starts[1:], len(pull)], strict=True)]


def stretch_of(trials: Sequence[Trial], moving: bool, fewest: int = 2 * FOLDS) -> list[np.ndarray]:
    """Return the stretch of each row of each trial, counted over all trials, shape (r,) each.

    Of held rows a stretch is a whole cycle. Where there are fewer cycles than `fewest`, they are cut into
    parts of equal length. Of a robot in motion stretches are equally long (`equal_stretches`).
    """
    stretches = [
        (index, part)
        for index, trial in enumerate(trials)
        for part in (equal_stretches(trial) if moving else cycles(trial))
    ]
    if moving:
        fewest = len(stretches)
    pieces = -(-fewest // max(len(stretches), 1))
    labels = [np.zeros(len(trial.inputs), dtype=int) for trial in trials]
    count = 0
    for index, part in stretches:
        rows = np.arange(part.start, part.stop)
        shortest = 4 if len(rows) >= fewest else 1
        for piece in np.array_split(rows, min(pieces, max(1, len(rows) // shortest))):
            labels[index][piece] = count
            count += 1
    return labels


def equal_stretches(trial: Trial) -> list[slice]:
    """Return stretches of a trial in motion, measured alike long, none shorter than `LEAST_BLOCK_S`.

    Rows before the first measured one belong to the first stretch.
    """
    time_s = trial.inputs.time_s
    begun_s = time_s[measured_from(trial)]
    count = max(1, int((time_s[-1] - begun_s) / LEAST_BLOCK_S + CLOCK_ROUNDING))
    ends = np.searchsorted(time_s, np.linspace(begun_s, time_s[-1], count + 1)[1:-1])
    return [slice(int(a), int(b)) for a, b in pairwise((0, *ends, len(time_s))) if b > a]


def _pull(inputs: Inputs) -> Array:
    """Return how far the robot is from rest, shape (r,), as a share of the trial's largest pull."""
    tendon = np.maximum(inputs.tendon, 0.0)
    if tendon.max(initial=0.0) < 0.1 * np.abs(inputs.tendon).max(initial=0.0):
        tendon = np.abs(inputs.tendon)
    total = np.zeros(len(inputs))
    for values in (tendon, np.abs(inputs.force_tip), np.abs(inputs.moment_tip)):
        largest = values.max(initial=0.0)
        if largest > 0.0:
            total = np.maximum(total, values.max(axis=1) / largest)
    rest = float(np.quantile(total, 0.1)) if len(total) else 0.0
    if rest > MOST_PRETENSION_SHARE:
        return total  # the robot never rests; what is low here is no rest
    return (total - rest) / (1.0 - rest)  # below zero where even the pretension is gone


# ----------------------------------------------------------------------------------------------------
# Whether enough was measured to name any cause, as far as the files alone say: no model runs for it.


def too_little(
    train: Sequence[Trial], heldout: Sequence[Trial], columns: Sequence[str], moving: bool
) -> tuple[str, ...]:
    """Return what was measured too little to name any cause: a few sentences each; (): nothing.

    Of n stretches, all gain by chance with a probability of 2^-n (`diagnosis.noise.chance_of_gain`). So
    many stretches are needed that this can be as small as a cause needs it.
    """
    proving = max(
        sum(_stretches((trial,), mine, moving) for trial in heldout) for mine in _by_unit(columns).values()
    )
    learnt = too_little_to_learn(train, columns)
    teaching, least = _stretches(train, columns, moving), _needed(PAYS_CHANCE)
    if not learnt and teaching < least:
        learnt = (_too_short("Training", "Record", train, columns, moving, teaching, least),)
    least = _needed(GAIN_CHANCE)
    if proving < least:
        said = "Held-out", "Record or hold out"
        return (*learnt, _too_short(*said, heldout, columns, moving, proving, least))
    if _still(train, heldout, columns):
        return (
            *learnt,
            "The robot does not move in the held-out trials. Naming a cause needs held-out data that move. "
            "Hold out a trial in which the inputs change.",
        )
    unmeasured = [unit for unit, mine in _by_unit(columns).items() if not _measured(heldout, mine)]
    if unmeasured:
        return (
            *learnt,
            f"Held-out data have no value in {_said(unmeasured)}, training data have. "
            "Hold out a trial in which it was measured.",
        )
    return learnt


def can_be_fitted(train: Sequence[Trial], heldout: Sequence[Trial], columns: Sequence[str]) -> bool:
    """Return whether there is enough to fit anything: to see the noise of every unit, and to test it."""
    driven = not too_little_to_learn(train, columns, fewest=0)
    return driven and all(_measured(heldout, mine) for mine in _by_unit(columns).values())


def too_little_to_learn(
    train: Sequence[Trial], columns: Sequence[str], fewest: int = FEWEST_VALUES
) -> tuple[str, ...]:
    """Return what the training trials hold too little of, to fit any cause; `fewest`: values needed."""
    values = sum(int(np.isfinite(measured_of(trial, columns)).sum()) for trial in train)
    if values < fewest:
        return (
            f"Only {values} measured values to learn from: fewer than {fewest} prove nothing. "
            "Record longer trials, or more of them.",
        )
    unseen = [
        unit
        for unit, mine in _by_unit(columns).items()
        if not any((np.isfinite(measured_of(trial, mine)).sum(axis=0) >= NOISE_ROWS).any() for trial in train)
    ]
    if unseen:
        return (
            f"No training trial has {NOISE_ROWS} values of one output in {_said(unseen)}: their noise "
            "cannot be estimated. Record longer trials.",
        )
    if not any(np.ptp(all_inputs(trial.inputs), axis=0).any() for trial in train):
        return (
            "The inputs never change: nothing that depends on them shows. "
            "Record trials in which you drive the robot.",
        )
    return ()


def _by_unit(columns: Sequence[str]) -> dict[str, list[str]]:
    """Return the columns of each unit."""
    units = dict.fromkeys(unit_of(name) for name in columns)
    return {unit: [name for name in columns if unit_of(name) == unit] for unit in units}


def _said(units: Sequence[str]) -> str:
    """Return units in words."""
    return " and ".join("quaternions" if unit == "1" else unit for unit in units)


def _measured(trials: Sequence[Trial], columns: Sequence[str]) -> bool:
    return any(_measured_rows(trial, columns).any() for trial in trials)


def _needed(chance: float) -> int:
    """Return how many stretches make a gain in all of them less probable by chance than that."""
    return math.ceil(-math.log2(chance))


def _stretches(trials: Sequence[Trial], columns: Sequence[str], moving: bool) -> int:
    """Return how many stretches of rows have a measured value."""
    labels = stretch_of(trials, moving)
    found = [mine[_measured_rows(trial, columns)] for trial, mine in zip(trials, labels, strict=True)]
    return len(np.unique(np.concatenate(found)))


def _measured_rows(trial: Trial, columns: Sequence[str]) -> np.ndarray:
    """Return which rows of a trial have a measured value, shape (r,)."""
    return np.asarray(np.isfinite(measured_of(trial, columns)).any(axis=1))


def _too_short(
    which: str,
    advice: str,
    trials: Sequence[Trial],
    columns: Sequence[str],
    moving: bool,
    found: int,
    needed: int,
) -> str:
    """Return what to say of trials that hold too few stretches, and what to do about it."""
    rows = [int(_measured_rows(trial, columns).sum()) for trial in trials]
    if not moving:
        number = f"{sum(rows)} measured row{'' if sum(rows) == 1 else 's'}"
        if found < sum(rows):
            number += f" in {found} stretch{'' if found == 1 else 'es'}"
        return (
            f"{which} data are {number}. Naming a cause needs at least {needed} stretches of rows. "
            f"{advice} longer trials, or more of them."
        )
    times = [trial.inputs.time_s for trial in trials]
    seconds = sum(
        float(time_s[-1] - time_s[measured_from(trial)])
        for trial, time_s, number in zip(trials, times, rows, strict=True)
        if number
    )
    among = f" in {len(trials)} trials" if len(trials) > 1 else ""
    return (
        f"{which} data are {seconds:.4g} s of motion{among}. Naming a cause needs at least {needed} "
        f"stretches of {LEAST_BLOCK_S:g} s. {advice} at least {needed * LEAST_BLOCK_S:g} s."
    )


def _still(train: Sequence[Trial], heldout: Sequence[Trial], columns: Sequence[str]) -> bool:
    """Return whether no input changes in the held-out trials, and no output by much beside training."""
    if np.ptp(np.concatenate([all_inputs(trial.inputs) for trial in heldout]), axis=0).any():
        return False
    return bool((_spread(heldout, columns) <= STILL_SHARE * _spread(train, columns)).all())


def _spread(trials: Sequence[Trial], columns: Sequence[str]) -> Array:
    """Return the standard deviation of each output, shape (o,); 0 where it has no value."""
    values = np.ma.masked_invalid(np.concatenate([measured_of(trial, columns) for trial in trials]))
    return np.asarray(values.std(axis=0).filled(0.0))


# ----------------------------------------------------------------------------------------------------
# How trials are parted into those that train and those that are held out.


def split_trials(dataset: Dataset) -> tuple[tuple[Trial, ...], tuple[Trial, ...]]:
    """Return the training trials and the held-out trials of `dataset`, each with its role set.

    Roles that the data set gives are kept. If it holds no trial out, the last trials without a role
    are held out, about 30 % of the rows. Trials that repeat one another are not held out, as far as possible,
    since a repeat of a training trial tests nothing. A single trial is cut between two of its cycles
    (`cycles`), or, if it has but one, at 70 % of its rows. The held-out part of a cut trial keeps all inputs,
    so that the history is right, and has NaN where the training part was measured. Where 30 % are too little
    to prove anything and half of the rows are not (`enough.too_little`), half of them are held out.

    Raises:
        InputError: every trial has the role "train", so that nothing is left to test on.
    """
    trials = dataset.trials
    if any(trial.role == "heldout" for trial in trials):
        chosen = {index for index, trial in enumerate(trials) if trial.role == "heldout"}
        return _with_roles(trials, chosen)
    open_ones = [index for index, trial in enumerate(trials) if not trial.role]
    if not open_ones:
        raise InputError(
            f"{dataset.folder / 'dataset.toml'}: every trial has the role train; "
            "give one the role heldout, or leave the roles out"
        )
    usual, more = (_parted(trials, open_ones, share) for share in (HELDOUT_SHARE, MOST_HELDOUT_SHARE))
    columns, moving = tuple(trials[0].outputs.columns), dataset.motion.moving
    return more if too_little(*usual, columns, moving) and not too_little(*more, columns, moving) else usual


def _parted(
    trials: Sequence[Trial], open_ones: Sequence[int], share: float
) -> tuple[tuple[Trial, ...], tuple[Trial, ...]]:
    """Return the trials parted so that about `share` of the rows are held out."""
    if len(trials) == 1:
        return _cut(trials[0], share)
    return _with_roles(trials, _last_trials(trials, open_ones, share))


def is_repeat(first: Trial, second: Trial) -> bool:
    """Return whether two trials were given the same inputs (to a millionth of their range) and clock."""
    a, b = all_inputs(first.inputs), all_inputs(second.inputs)
    if a.shape != b.shape:
        return False
    tolerance = 1e-6 * max(float(np.abs(a).max()), 1e-12)
    span = max(float(np.ptp(first.inputs.time_s)), 1e-12)
    same_clock = np.abs(first.inputs.time_s - second.inputs.time_s).max() <= 1e-6 * span
    return bool(np.abs(a - b).max() <= tolerance and same_clock)


def _with_roles(
    trials: Sequence[Trial], heldout: Iterable[int]
) -> tuple[tuple[Trial, ...], tuple[Trial, ...]]:
    chosen = set(heldout)
    return (
        tuple(replace(trial, role="train") for i, trial in enumerate(trials) if i not in chosen),
        tuple(replace(trial, role="heldout") for i, trial in enumerate(trials) if i in chosen),
    )


def _last_trials(trials: Sequence[Trial], open_ones: Sequence[int], share: float) -> set[int]:
    """Return the last trials without a role, without repeats, that hold about `share` of the rows."""
    repeated = {
        i
        for i in range(len(trials))
        if any(i != j and is_repeat(trials[i], trials[j]) for j in range(len(trials)))
    }
    candidates = [i for i in open_ones if i not in repeated] or list(open_ones)
    return last_trials([len(trial.inputs) for trial in trials], candidates, share)


def last_trials(counts: Sequence[int], candidates: Sequence[int], share: float = HELDOUT_SHARE) -> set[int]:
    """Return the last of the candidates that hold a share of all rows, one at least, never all trials.

    `counts`: rows of each trial; `candidates`: numbers of those that may be held out, rising.
    """
    rows = sum(counts)
    chosen: set[int] = set()
    for index in reversed(candidates):
        taken = sum(counts[i] for i in chosen)
        here = counts[index]
        left = len(counts) - len(chosen)
        # Nearer to the wanted share with this trial than without it; one at least, never all.
        nearer = abs(taken + here - share * rows) <= abs(taken - share * rows)
        if left > 1 and (nearer or not chosen):
            chosen.add(index)
    return chosen


def _cut(trial: Trial, share: float) -> tuple[tuple[Trial, ...], tuple[Trial, ...]]:
    rows = len(trial.inputs)
    wanted = (1.0 - share) * rows
    starts = [part.start for part in cycles(trial)[1:]]
    row = min(starts, key=lambda start: abs(start - wanted)) if starts else max(round(wanted), 1)
    columns = trial.outputs.columns
    train = Trial(
        trial.file,
        "train",
        slice_inputs(trial.inputs, slice(0, row)),
        replace(
            trial.outputs,
            time_s=trial.outputs.time_s[:row],
            columns={name: values[:row] for name, values in columns.items()},
        ),
    )
    later = np.arange(rows) >= row
    hidden = {name: np.where(later, values, np.nan) for name, values in columns.items()}
    heldout = replace(trial, role="heldout", outputs=replace(trial.outputs, columns=hidden))
    return (train,), (heldout,)


# ----------------------------------------------------------------------------------------------------
# The beginning of each trial that is played and not judged: a stretch cut out of a longer recording.
#
# A trial is simulated from rest under its first row's inputs. A stretch of a longer recording does not
# begin so: the robot was on its way, or had been bent before. With its inputs from a while earlier the
# simulation has forgotten its own beginning when the first measured row comes.


def judged_late(trials: Sequence[Trial], seconds: Any, where: str) -> tuple[Trial, ...]:
    """Return trials that are judged from `seconds` after their first row on, a value from a file or a caller.

    Raises:
        InputError: it is no time, or leaves no measured value of a trial.
    """
    checked = warm_up_time(seconds, where)
    return tuple(judged_after(trial, checked, where) for trial in trials)


def warm_up_time(value: Any, where: str) -> float:
    """Return the time [s] that a file or a caller states; raise `InputError` where it is none."""
    seconds = as_number(value)
    if seconds is None:
        raise InputError(f"{where}: a number of seconds is needed, not {shown(value)}")
    if not 0.0 <= seconds < math.inf:
        raise InputError(f"{where}: a finite number of seconds, 0 or more, is needed, not {shown(value)}")
    return seconds


def judged_after(trial: Trial, seconds: float, where: str) -> Trial:
    """Return a trial whose outputs are missing until `seconds` after its first row.

    Raises:
        InputError: no measured value is left.
    """
    if not seconds:
        return trial
    time_s = trial.outputs.time_s
    early = time_s - time_s[0] < seconds
    columns = {name: np.where(early, np.nan, values) for name, values in trial.outputs.columns.items()}
    if all(np.isnan(values).all() for values in columns.values()):
        raise InputError(
            f"{where}: {seconds:g} s leave no measured value of {trial.file}, "
            f"which lasts {time_s[-1] - time_s[0]:g} s"
        )
    return replace(trial, outputs=replace(trial.outputs, columns=columns))


# ----------------------------------------------------------------------------------------------------
# Columns of a file that a data set passes over: misspelled inputs are refused, the others are told.

IGNORED, UNKNOWN = "columns_ignored", "columns_unknown"  # codes of notes; the second wants to be seen
_ALIKE, _LOADS_ALIKE = 0.8, 0.9  # of two names, 1 for the same: one is a slip of the pen for the other
_MOST_NEAREST = 10  # columns of a note of which the nearest is told


def known_inputs(robot: RobotSpec) -> list[str]:
    """Return every input column of `robot`, whichever way it is driven, and the loads on its tip."""
    own = [name for kind in ("tension", "displacement") for name in input_channels(robot, kind)]
    return [*own, *FORCE_CHANNELS, *MOMENT_CHANNELS]


def refuse_misspelled(robot: RobotSpec, table: Table) -> None:
    """Raise `InputError` where a column that `table` has passed over was meant as an input of `robot`.

    It was where its name is nearly that of an input that the table lacks, or begins as the inputs do (as
    `tension_up_N`). What looks like another input of the same table, or like an output, is somebody's log.
    """
    by_kind = [input_channels(robot, kind) for kind in actuations(robot)]
    used = [names for names in by_kind if any(name in table.columns for name in names)] or by_kind
    own = [name for names in used for name in names]
    begins = {name.split("_")[0] for name in own}
    for name in table.ignored:
        if acts_on_body(name):
            raise InputError(
                f"{table.where}: {name}: a data set knows forces on the tip alone, force_tip_x_N ..."
            )
        first = name.lower().split("_")[0] in begins
        inputs = [(_likeness(name, item), item) for item in own]
        loads = [(_likeness(name, item), item) for item in (*FORCE_CHANNELS, *MOMENT_CHANNELS)]
        close = [(size, item) for size, item in inputs if first or size >= _ALIKE]
        close += [(size, item) for size, item in loads if size >= _LOADS_ALIKE]
        if not close:
            continue
        size, meant = max(close, key=lambda pair: pair[0])
        if meant in table.columns or any(_likeness(name, item) > size for item in output_channels(robot)):
            continue
        told = f"{table.where}: unknown input channel {shown(name)}; nearest: {meant}"
        raise InputError(f"{told}. Rename it; if it is no input, leave it out")


def _likeness(first: str, second: str) -> float:
    """Return how alike two names are, 1 for the same, whatever the case and the order of their words."""
    ones, others = (re.findall(r"[a-z]+|[0-9]+", name.lower()) for name in (first, second))
    ways = (("_".join(ones), "_".join(others)), ("_".join(sorted(ones)), "_".join(sorted(others))))
    return max(difflib.SequenceMatcher(None, one, other, False).ratio() for one, other in ways)


def _nearest(robot: RobotSpec, names: Iterable[str]) -> str:
    """Return the nearest column of `robot` to each of `names` that has one, as a sentence; "" for none."""
    choices = {name.lower(): name for name in (*known_inputs(robot), *output_channels(robot))}
    found: list[str] = []
    for name in list(names)[:_MOST_NEAREST]:
        near = difflib.get_close_matches(name.lower(), choices, 1, _ALIKE)
        found += [f"{choices[near[0]]} for {cut(name, 60)}"] if near else []
    return f" Nearest columns of the robot: {', '.join(found)}." if found else ""


def notes_on_ignored(
    robot: RobotSpec,
    ignored: Mapping[str, tuple[str, ...]],
    why: str = "not listed in dataset.toml",
    wanted: Collection[str] = (),
) -> tuple[Note, ...]:
    """Return a note for each set of columns that are passed over, with its files.

    `ignored`: columns by file, and `why` they are; `wanted`: outputs of the robot that nobody left out on
    purpose.
    """
    known, all_outputs = known_inputs(robot), output_channels(robot)
    outputs = set(all_outputs) - set(wanted)
    notes = []
    for columns in dict.fromkeys(ignored.values()):
        files = ", ".join(file for file, names in ignored.items() if names == columns)
        names = ", ".join(name or "(a column without a name)" for name in dict.fromkeys(columns))
        said = f"{cut(files, 150)}: {why} and ignored: {cut(names, 250)}."
        inputs = ", ".join(name for name in columns if name in known)
        if inputs:
            said += f" Of these the robot's own inputs are taken as zero: {cut(inputs, 250)}."
        said += _nearest(robot, (name for name in columns if name not in known and name not in all_outputs))
        notes.append(Note(IGNORED if outputs.issuperset(columns) else UNKNOWN, said))
    return tuple(notes)
