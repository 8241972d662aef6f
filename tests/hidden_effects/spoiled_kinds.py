"""How people spoil sound measurements, kind by kind."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.lab.robots import BenchRobot

# ----------------------------------------------------------------------------------------------------
# Measurements as they lie in a folder's files, so that they can be spoiled: trials of numbers by column.


@dataclass(frozen=True)
class Trial:
    """One file.

    Attributes:
        role: "train", "heldout" or "".
        time_s: shape (r,).
        inputs: in file units, shape (r, c).
        outputs: in file units, shape (r, o); NaN: missing.
    """

    role: str
    time_s: Array
    inputs: Array
    outputs: Array

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True)
class Recording:
    """A data set.

    Attributes:
        bench: the robot as specified.
        inputs, outputs: names of the columns.
        gravity_mps2: as stated, shape (3,).
        noise: standard deviation of each output, shape (o,), in file units.
        trials: in the order in which they were measured.
    """

    bench: BenchRobot
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    gravity_mps2: Array
    noise: Array
    trials: tuple[Trial, ...]

    @property
    def places(self) -> np.ndarray:
        """Indices of the outputs that are positions."""
        return np.array([k for k, name in enumerate(self.outputs) if name.endswith("_mm")])

    @property
    def points(self) -> dict[str, list[int]]:
        """Indices of the outputs of each measured point, the tip first, in the order of its axes."""
        found: dict[str, list[int]] = {}
        for index in self.places.tolist():
            found.setdefault(self.outputs[index].rsplit("_", 2)[0], []).append(index)
        return found

    @property
    def axes(self) -> str:
        """In which axes positions are measured."""
        return "".join(self.outputs[index].rsplit("_", 2)[1] for index in self.points["tip"])

    @property
    def moved(self) -> list[int]:
        """Indices of the inputs that change."""
        values = np.concatenate([trial.inputs for trial in self.trials])
        return [int(index) for index in np.flatnonzero(np.ptp(values, axis=0) > 0.0)]

    @property
    def moving(self) -> list[int]:
        """Indices of the outputs that move by a fifth of the largest motion of their unit, widest first."""
        values = np.concatenate([trial.outputs for trial in self.trials])
        spread = np.nanstd(values, axis=0)
        units = [name.rsplit("_", 1)[1] for name in self.outputs]
        most = {unit: max(s for s, u in zip(spread, units, strict=True) if u == unit) for unit in units}
        found = [k for k, unit in enumerate(units) if spread[k] > 0.2 * most[unit]]
        return sorted(found, key=lambda k: -spread[k])


OnTrial = Callable[[Trial], Trial]


def in_trial(recording: Recording, number: int, change: OnTrial) -> Recording:
    """Return a recording with one trial changed."""
    return in_trials(recording, [number], change)


def in_trials(recording: Recording, numbers: Sequence[int], change: OnTrial) -> Recording:
    """Return a recording with some trials changed."""
    trials = tuple(
        change(trial) if index in numbers else trial for index, trial in enumerate(recording.trials)
    )
    return replace(recording, trials=trials)


def in_all(recording: Recording, change: OnTrial) -> Recording:
    """Return a recording with every trial changed."""
    return in_trials(recording, range(len(recording.trials)), change)


def with_outputs(
    trial: Trial, columns: Sequence[int], values: Array, rows: np.ndarray | None = None
) -> Trial:
    """Return a trial with some outputs replaced, at some rows (a mask) or at all."""
    outputs = np.array(trial.outputs)
    chosen = np.ones(len(trial), dtype=bool) if rows is None else rows
    outputs[np.ix_(chosen, np.asarray(columns, dtype=int))] = (
        values if rows is None else np.broadcast_to(values, (len(trial), len(columns)))[chosen]
    )
    return replace(trial, outputs=outputs)


def of_rows(trial: Trial, rows: np.ndarray) -> Trial:
    """Return some rows of a trial, by index or mask."""
    return Trial(trial.role, trial.time_s[rows], trial.inputs[rows], trial.outputs[rows])


def a_trial(recording: Recording, generator: np.random.Generator) -> int:
    """Return one of the trials."""
    return int(generator.integers(len(recording.trials)))


def a_stretch(trial: Trial, share: float, generator: np.random.Generator) -> np.ndarray:
    """Return a stretch of a trial's rows as a mask, not at its first or last rows."""
    rows = len(trial)
    length = max(3, round(share * rows))
    start = int(generator.integers(2, max(3, rows - length - 1)))
    index = np.arange(rows)
    return np.asarray((index >= start) & (index < start + length))


# ----------------------------------------------------------------------------------------------------
# What a kind of spoiled data is.

Spoil = Callable[[Recording, np.random.Generator], Recording]
# The lines of one file, its header first.
Respell = Callable[[list[str], np.random.Generator], list[str]]


def unchanged(recording: Recording, generator: np.random.Generator) -> Recording:
    """Return a recording as it is."""
    return recording


def any_recording(recording: Recording) -> bool:
    """Every recording can be spoiled so."""
    return True


@dataclass(frozen=True)
class Kind:
    """One way to spoil a recording.

    Attributes:
        name: of the kind.
        words: what happened, in one line.
        spoil: what it does to the numbers.
        fits: whether it does anything to a recording.
        alike: causes that say the very same; to name one of them is right.
        respell: what it does to the last file as a text.
        sound: nothing is wrong: data that look suspect are a mistake of the diagnosis.
    """

    name: str
    words: str
    spoil: Spoil = unchanged
    fits: Callable[[Recording], bool] = any_recording
    alike: tuple[str, ...] = ()
    respell: Respell | None = None
    sound: bool = False


# ----------------------------------------------------------------------------------------------------
# Columns swapped, turned in sign, in another unit, clipped or counted coarsely.

Where = Callable[[Recording, np.random.Generator, OnTrial], Recording]


def _everywhere(recording: Recording, generator: np.random.Generator, change: OnTrial) -> Recording:
    return in_all(recording, change)


def _in_one(recording: Recording, generator: np.random.Generator, change: OnTrial) -> Recording:
    """Change one trial, of those in which the robot moves most."""
    largest = sorted(
        range(len(recording.trials)), key=lambda k: -np.abs(recording.trials[k].inputs).sum(axis=1).max()
    )
    return in_trial(recording, int(generator.choice(largest[:4])), change)


def _outputs_swapped(where: Where = _everywhere) -> Spoil:
    def spoil(recording: Recording, generator: np.random.Generator) -> Recording:
        first, last = recording.points["tip"][0], recording.points["tip"][-1]
        return where(
            recording, generator, lambda t: with_outputs(t, [first, last], t.outputs[:, [last, first]])
        )

    return spoil


def _axes_exchanged(recording: Recording, generator: np.random.Generator) -> Recording:
    """The first and the last axis of every point change places: left-handed axes."""

    def change(trial: Trial) -> Trial:
        for point in recording.points.values():
            trial = with_outputs(trial, point, trial.outputs[:, point[::-1]])
        return trial

    return in_all(recording, change)


def _mirrored(where: Where = _everywhere) -> Spoil:
    def spoil(recording: Recording, generator: np.random.Generator) -> Recording:
        axis = _moving_axis(recording)
        columns = [point[axis] for point in recording.points.values()]
        return where(recording, generator, lambda t: with_outputs(t, columns, -t.outputs[:, columns]))

    return spoil


def _inputs_swapped(where: Where = _everywhere) -> Spoil:
    def spoil(recording: Recording, generator: np.random.Generator) -> Recording:
        pair = _two_inputs(recording)
        return where(recording, generator, lambda t: _with_inputs(t, pair, t.inputs[:, pair[::-1]]))

    return spoil


def _input_turned(recording: Recording, generator: np.random.Generator) -> Recording:
    column = [int(generator.choice(_signed(recording)))]
    return in_all(recording, lambda t: _with_inputs(t, column, -t.inputs[:, column]))


def _input_not_logged(recording: Recording, generator: np.random.Generator) -> Recording:
    column = [int(generator.choice(recording.moved))]
    return in_all(recording, lambda t: _with_inputs(t, column, 0.0 * t.inputs[:, column]))


def _inputs_constant(recording: Recording, generator: np.random.Generator) -> Recording:
    columns = recording.moved
    middle = 0.5 * np.concatenate([trial.inputs for trial in recording.trials])[:, columns].max(axis=0)
    return in_all(recording, lambda t: _with_inputs(t, columns, np.tile(middle, (len(t), 1))))


def _input_times(factor: float, where: Where = _everywhere) -> Spoil:
    def spoil(recording: Recording, generator: np.random.Generator) -> Recording:
        columns = recording.moved
        return where(recording, generator, lambda t: _with_inputs(t, columns, factor * t.inputs[:, columns]))

    return spoil


def _output_times(factor: float, columns: str, where: Where = _everywhere) -> Spoil:
    def spoil(recording: Recording, generator: np.random.Generator) -> Recording:
        places = recording.places.tolist()
        chosen = {"one": [k for k in recording.moving if k in places][:1], "all": places}[columns]
        return where(recording, generator, lambda t: with_outputs(t, chosen, factor * t.outputs[:, chosen]))

    return spoil


def _tare(where: Where) -> Spoil:
    """The inputs' zeros are off by 12 to 20 % of the reach."""

    def spoil(recording: Recording, generator: np.random.Generator) -> Recording:
        columns = recording.moved
        values = np.concatenate([trial.inputs for trial in recording.trials])[:, columns]
        offset = generator.uniform(0.12, 0.2) * np.abs(values).max(axis=0)
        return where(recording, generator, lambda t: _with_inputs(t, columns, t.inputs[:, columns] + offset))

    return spoil


def _outputs_clipped(recording: Recording, generator: np.random.Generator) -> Recording:
    """The output that moves most ends at 60 % of its way, on the side where it is more rarely."""
    column = recording.moving[:1]
    values = np.concatenate([trial.outputs for trial in recording.trials])[:, column[0]]
    low, high, middle = np.nanmin(values), np.nanmax(values), np.nanmedian(values)
    upper = high - middle > middle - low
    end = middle + 0.6 * (high - middle) if upper else middle - 0.6 * (middle - low)
    limits = (-np.inf, end) if upper else (end, np.inf)
    return in_all(recording, lambda t: with_outputs(t, column, np.clip(t.outputs[:, column], *limits)))


def _inputs_clipped(recording: Recording, generator: np.random.Generator) -> Recording:
    """The sensors of the inputs end at 55 % of the largest value."""
    columns = recording.moved
    most = 0.55 * np.abs(np.concatenate([t.inputs for t in recording.trials])[:, columns]).max(axis=0)
    return in_all(recording, lambda t: _with_inputs(t, columns, np.clip(t.inputs[:, columns], -most, most)))


def _rounded(recording: Recording, generator: np.random.Generator) -> Recording:
    """Outputs come in steps of a twelfth of their range."""
    values = np.concatenate([trial.outputs for trial in recording.trials])
    step = (np.nanmax(values, axis=0) - np.nanmin(values, axis=0)) / 12.0
    return in_all(recording, lambda t: replace(t, outputs=np.round(t.outputs / step) * step))


def _inputs_rounded(recording: Recording, generator: np.random.Generator) -> Recording:
    """Inputs come in steps of a sixth of their range."""
    columns = recording.moved
    values = np.concatenate([trial.inputs for trial in recording.trials])[:, columns]
    step = np.ptp(values, axis=0) / 6.0
    return in_all(recording, lambda t: _with_inputs(t, columns, np.round(t.inputs[:, columns] / step) * step))


def _with_inputs(trial: Trial, columns: Sequence[int], values: np.ndarray) -> Trial:
    inputs = np.array(trial.inputs)
    inputs[:, columns] = values
    return replace(trial, inputs=inputs)


def _moving_axis(recording: Recording) -> int:
    """Return the place, in a point's axes, of that across the robot in which the tip moves most."""
    across = [place for place, axis in enumerate(recording.axes) if axis != "z"]
    tip = recording.points["tip"]
    values = np.concatenate([trial.outputs for trial in recording.trials])
    return max(across, key=lambda place: float(np.nanstd(values[:, tip[place]])))


def _signed(recording: Recording) -> list[int]:
    """Return the inputs that take both signs: displacements of a pair."""
    values = np.concatenate([trial.inputs for trial in recording.trials])
    return [k for k in recording.moved if values[:, k].min() < 0.0 < values[:, k].max()]


def _two_inputs(recording: Recording) -> list[int]:
    """Return two inputs of one unit that move."""
    alike = [k for k in recording.moved if recording.inputs[k].partition("_")[0] != "advance"]
    return alike[:2]


def _has_two_inputs(recording: Recording) -> bool:
    return len(_two_inputs(recording)) == 2


def _has_signed(recording: Recording) -> bool:
    return bool(_signed(recording))


def _pulled_by_force(recording: Recording) -> bool:
    return recording.inputs[0].endswith("_N")


def _drawn(recording: Recording) -> bool:
    return recording.inputs[0].endswith("_mm")


COLUMN_KINDS = (
    Kind("outputs_swapped", "two coordinates of the tip are swapped", _outputs_swapped()),
    Kind("outputs_swapped_once", "the same in one trial", _outputs_swapped(_in_one)),
    Kind("axes_exchanged", "two axes of all points are exchanged: left-handed axes", _axes_exchanged),
    Kind("mirrored", "one axis of all points points the other way: a mirror image", _mirrored()),
    Kind("mirrored_once", "the same in one trial", _mirrored(_in_one)),
    Kind("inputs_swapped", "two inputs are swapped", _inputs_swapped(), _has_two_inputs),
    Kind("inputs_swapped_once", "the same in one trial", _inputs_swapped(_in_one), _has_two_inputs),
    Kind("input_turned", "one input has the other sign", _input_turned, _has_signed),
    Kind("input_not_logged", "one input is written as 0 throughout", _input_not_logged),
    Kind("inputs_constant", "the inputs stand still in the file", _inputs_constant),
    Kind("grams_for_newtons", "inputs are in grams", _input_times(1e3 / 9.80665), _pulled_by_force),
    Kind("grams_once", "the same in one trial", _input_times(1e3 / 9.80665, _in_one), _pulled_by_force),
    Kind("metres_drawn", "inputs are in m, not mm", _input_times(1e-3), _drawn),
    Kind("metres_drawn_once", "the same in one trial", _input_times(1e-3, _in_one), _drawn),
    Kind("metres_in_a_column", "one position is in m, not mm", _output_times(1e-3, "one")),
    Kind("metres_once", "all positions of one trial are in m", _output_times(1e-3, "all", _in_one)),
    Kind("inches_once", "all positions of one trial are in inches", _output_times(1 / 25.4, "all", _in_one)),
    Kind("tare_missing", "the inputs were never zeroed", _tare(_everywhere), alike=("actuation_offset",)),
    Kind("tare_missing_once", "the same in one trial", _tare(_in_one)),
    Kind("outputs_clipped", "the output that moves most ends at 60 % of its way", _outputs_clipped),
    Kind("inputs_clipped", "the inputs' sensors end at 55 % of what is reached", _inputs_clipped),
    Kind("outputs_rounded", "outputs come in twelve steps", _rounded),
    Kind("inputs_rounded", "inputs come in six steps", _inputs_rounded),
)


# ----------------------------------------------------------------------------------------------------
# Rows that are late, early, in another order, thinned out or filled in.

_ROWS = (4, 8)  # of a shift


def _late(values: Array, rows: int) -> Array:
    """Return a series so many rows later, or earlier (rows < 0); its end value stands in."""
    index = np.clip(np.arange(len(values)) - rows, 0, len(values) - 1)
    return np.asarray(values[index])


def _outputs_late(sign: int, once: bool) -> Spoil:
    def spoil(recording: Recording, generator: np.random.Generator) -> Recording:
        rows = sign * int(generator.integers(*_ROWS, endpoint=True))

        def change(trial: Trial) -> Trial:
            return replace(trial, outputs=_late(trial.outputs, rows))

        if once:
            return in_trial(recording, a_trial(recording, generator), change)
        return in_all(recording, change)

    return spoil


def _an_input_late(recording: Recording, generator: np.random.Generator) -> Recording:
    """One input's log is early by some rows: what is measured comes late against it."""
    rows = int(generator.integers(*_ROWS, endpoint=True))
    column = int(generator.choice(recording.moved))

    def change(trial: Trial) -> Trial:
        inputs = np.array(trial.inputs)
        inputs[:, column] = _late(inputs[:, column], rows)
        inputs[:, column] = np.where(np.arange(len(inputs)) < rows, 0.0, inputs[:, column])
        return replace(trial, inputs=inputs)

    return in_all(recording, change)


def _rows_lost(recording: Recording, generator: np.random.Generator) -> Recording:
    """Five to ten rows of the outputs' log are lost in each of three trials; what follows moves up."""
    numbers = generator.choice(len(recording.trials), 3, replace=False).tolist()

    def change(trial: Trial) -> Trial:
        count = int(generator.integers(5, 11))
        start = int(generator.integers(3, max(4, len(trial) // 2)))
        index = np.arange(len(trial))
        index[start:] += count
        return replace(trial, outputs=trial.outputs[np.minimum(index, len(trial) - 1)])

    trials = [change(trial) if k in numbers else trial for k, trial in enumerate(recording.trials)]
    return replace(recording, trials=tuple(trials))


def _outputs_shuffled(recording: Recording, generator: np.random.Generator) -> Recording:
    return in_all(
        recording, lambda trial: replace(trial, outputs=generator.permutation(trial.outputs, axis=0))
    )


def _outputs_shuffled_once(recording: Recording, generator: np.random.Generator) -> Recording:
    return in_trial(
        recording,
        a_trial(recording, generator),
        lambda trial: replace(trial, outputs=generator.permutation(trial.outputs, axis=0)),
    )


def _rows_shuffled(recording: Recording, generator: np.random.Generator) -> Recording:
    """Whole rows in another order, under the old clock."""

    def change(trial: Trial) -> Trial:
        mixed = of_rows(trial, generator.permutation(len(trial)))
        return replace(mixed, time_s=trial.time_s)

    return in_all(recording, change)


def _outputs_backward(recording: Recording, generator: np.random.Generator) -> Recording:
    """The outputs of two trials were written last row first; the sensors' noise is as it was."""
    numbers = generator.choice(len(recording.trials), 2, replace=False).tolist()
    trials = [
        replace(trial, outputs=trial.outputs[::-1]) if k in numbers else trial
        for k, trial in enumerate(recording.trials)
    ]
    return replace(recording, trials=tuple(trials))


def _clock(change: Callable[[Array], Array]) -> Spoil:
    def spoil(recording: Recording, generator: np.random.Generator) -> Recording:
        return in_all(recording, lambda trial: replace(trial, time_s=change(trial.time_s)))

    return spoil


def _rows_dropped(recording: Recording, generator: np.random.Generator) -> Recording:
    """A third of the rows is missing, with all that stands in them; the first rows stay."""

    def change(trial: Trial) -> Trial:
        kept = generator.random(len(trial)) > 1 / 3
        kept[:2] = True
        return of_rows(trial, kept)

    return in_all(recording, change)


def _interpolated(recording: Recording, generator: np.random.Generator) -> Recording:
    """Each sixth row was measured; between them outputs were interpolated."""

    def change(trial: Trial) -> Trial:
        rows = np.arange(len(trial))
        filled = np.nan_to_num(trial.outputs, nan=0.0)
        known = np.isfinite(trial.outputs)
        columns = []
        for k in range(trial.outputs.shape[1]):
            at = rows[(rows % 6 == 0) & known[:, k]]
            columns.append(np.interp(rows, at, filled[at, k]))
        return replace(trial, outputs=np.stack(columns, axis=1))

    return in_all(recording, change)


def _held(recording: Recording, generator: np.random.Generator) -> Recording:
    """The tracker gives a new value with each fifth row only; the file repeats the last."""

    def change(trial: Trial) -> Trial:
        rows = np.arange(len(trial))
        return replace(trial, outputs=trial.outputs[rows - rows % 5])

    return in_all(recording, change)


def _smoothed(recording: Recording, generator: np.random.Generator) -> Recording:
    """Outputs are means over eleven rows."""

    def change(trial: Trial) -> Trial:
        rows = np.arange(len(trial))
        near = np.abs(rows[:, np.newaxis] - rows) <= 5
        return replace(trial, outputs=np.stack([np.nanmean(trial.outputs[mask], axis=0) for mask in near]))

    return in_all(recording, change)


def _several_inputs(recording: Recording) -> bool:
    return len(recording.moved) > 1


TIMING_KINDS = (
    Kind(
        "outputs_late", "all outputs come four to eight rows late", _outputs_late(1, False), alike=("rate",)
    ),
    Kind("outputs_late_once", "the same in one trial", _outputs_late(1, True)),
    Kind(
        "outputs_early", "all outputs come four to eight rows before their inputs", _outputs_late(-1, False)
    ),
    Kind("outputs_early_once", "the same in one trial", _outputs_late(-1, True)),
    Kind(
        "an_input_late",
        "one input stands four to eight rows late in the file",
        _an_input_late,
        _several_inputs,
        alike=("rate",),
    ),
    Kind("output_rows_lost", "rows of the outputs are lost in three trials, the rest moves up", _rows_lost),
    Kind("outputs_shuffled", "the outputs' rows are in another order than the inputs'", _outputs_shuffled),
    Kind("outputs_shuffled_once", "the same in one trial", _outputs_shuffled_once),
    Kind("outputs_backward", "the outputs of two trials run backward", _outputs_backward),
    Kind("rows_shuffled", "whole rows are in another order", _rows_shuffled),
    Kind("clock_backward", "the clock runs backward", _clock(lambda time_s: time_s[::-1])),
    Kind("clock_in_ms", "the clock counts milliseconds", _clock(lambda time_s: 1e3 * time_s)),
    Kind("rows_dropped", "a third of the rows is missing", _rows_dropped),
    Kind("interpolated", "five of six rows are interpolated", _interpolated),
    Kind("held", "four of five rows repeat the last measured one", _held),
    Kind("smoothed", "outputs are means over eleven rows", _smoothed),
)


# ----------------------------------------------------------------------------------------------------
# A tracker that loses the robot, is bumped, or wanders.

_BUMP_MM = (6.0, 15.0)


def _frozen(recording: Recording, generator: np.random.Generator) -> Recording:
    number = a_trial(recording, generator)
    rows = a_stretch(recording.trials[number], 0.4, generator)
    first = int(np.argmax(rows))
    columns = list(range(len(recording.outputs)))
    return in_trial(recording, number, lambda trial: with_outputs(trial, columns, trial.outputs[first], rows))


def _lost(value: float, share: float) -> Spoil:
    """Return a kind's change: the tip's columns hold one value over a stretch of three trials."""

    def spoil(recording: Recording, generator: np.random.Generator) -> Recording:
        numbers = generator.choice(len(recording.trials), 3, replace=False).tolist()
        tip = recording.points["tip"]
        return in_trials(
            recording,
            numbers,
            lambda trial: with_outputs(trial, tip, np.array(value), a_stretch(trial, share, generator)),
        )

    return spoil


def _sees_another_thing(recording: Recording, generator: np.random.Generator) -> Recording:
    """Bursts of two to five rows at which the tip's marker is taken for something 40 to 120 mm away."""
    tip = recording.points["tip"]
    away = _direction(len(tip), generator) * generator.uniform(40.0, 120.0)

    def change(trial: Trial) -> Trial:
        rows = np.zeros(len(trial), dtype=bool)
        for _ in range(max(1, len(trial) // 20)):
            start = int(generator.integers(2, len(trial) - 5))
            rows[start : start + int(generator.integers(2, 6))] = True
        return with_outputs(trial, tip, trial.outputs[:, tip] + away, rows)

    return in_all(recording, change)


def _outlier_bursts(recording: Recording, generator: np.random.Generator) -> Recording:
    """Bursts of three to six rows, in two of three trials, at which all positions scatter by 30 mm."""
    places = recording.places.tolist()

    def change(trial: Trial) -> Trial:
        if generator.random() < 1 / 3:
            return trial
        rows = a_stretch(trial, generator.integers(3, 7) / len(trial), generator)
        scatter = 30.0 * generator.normal(size=(len(trial), len(places)))
        return with_outputs(trial, places, trial.outputs[:, places] + scatter, rows)

    return in_all(recording, change)


def _noise_alone(recording: Recording, generator: np.random.Generator) -> Recording:
    middle = np.nanmean(np.concatenate([trial.outputs for trial in recording.trials]), axis=0)

    def change(trial: Trial) -> Trial:
        scatter = 10.0 * recording.noise * generator.normal(size=trial.outputs.shape)
        return replace(trial, outputs=middle + scatter)

    return in_all(recording, change)


def _on_the_table(recording: Recording, generator: np.random.Generator) -> Recording:
    """Every sensor lies still, with its noise and a slow wander of its zero."""
    middle = np.nanmean(np.concatenate([trial.outputs for trial in recording.trials]), axis=0)

    def change(trial: Trial) -> Trial:
        walk = 0.2 * np.cumsum(generator.normal(size=trial.outputs.shape), axis=0)
        scatter = generator.normal(size=trial.outputs.shape)
        return replace(trial, outputs=middle + recording.noise * (walk + scatter))

    return in_all(recording, change)


def _one_trial_of_noise(recording: Recording, generator: np.random.Generator) -> Recording:
    middle = np.nanmean(np.concatenate([trial.outputs for trial in recording.trials]), axis=0)
    return in_trial(
        recording,
        a_trial(recording, generator),
        lambda trial: replace(
            trial, outputs=middle + 3.0 * recording.noise * generator.normal(size=trial.outputs.shape)
        ),
    )


def _bumped_between(recording: Recording, generator: np.random.Generator) -> Recording:
    """From one trial on all positions are shifted."""
    first = int(generator.integers(2, len(recording.trials) - 1))
    shift = _shift(recording, generator)
    later = range(first, len(recording.trials))
    return in_trials(recording, later, lambda trial: replace(trial, outputs=trial.outputs + shift))


def _bumped_midway(recording: Recording, generator: np.random.Generator) -> Recording:
    """From the middle of one trial on, the later trials included."""
    number = int(generator.integers(1, len(recording.trials) - 1))
    shift = _shift(recording, generator)
    row = round(generator.uniform(0.35, 0.65) * len(recording.trials[number]))
    here = in_trial(
        recording,
        number,
        lambda trial: replace(
            trial, outputs=trial.outputs + shift * (np.arange(len(trial)) >= row)[:, np.newaxis]
        ),
    )
    later = range(number + 1, len(recording.trials))
    return in_trials(here, later, lambda trial: replace(trial, outputs=trial.outputs + shift))


def _bumped_and_put_back(recording: Recording, generator: np.random.Generator) -> Recording:
    number = a_trial(recording, generator)
    rows = a_stretch(recording.trials[number], 0.4, generator)
    shift = _shift(recording, generator)
    return in_trial(
        recording,
        number,
        lambda trial: replace(trial, outputs=trial.outputs + shift * rows[:, np.newaxis]),
    )


def _turned_between(recording: Recording, generator: np.random.Generator) -> Recording:
    """From one trial on the tracker is turned by 12 to 25 deg about its own origin, the base."""
    first = int(generator.integers(2, len(recording.trials) - 1))
    angle = math.radians(generator.uniform(12.0, 25.0)) * generator.choice([-1.0, 1.0])
    cosine, sine = math.cos(angle), math.sin(angle)

    def change(trial: Trial) -> Trial:
        outputs = np.array(trial.outputs)
        for point in recording.points.values():
            a, b = outputs[:, point[0]], outputs[:, point[-1]]
            outputs[:, point[0]], outputs[:, point[-1]] = cosine * a - sine * b, sine * a + cosine * b
        return replace(trial, outputs=outputs)

    return in_trials(recording, range(first, len(recording.trials)), change)


def _wanders(recording: Recording, generator: np.random.Generator) -> Recording:
    """The tracker sags by 10 to 20 mm from the first row of the first trial to the last row of the last."""
    total = _shift(recording, generator, (10.0, 20.0))
    rows = sum(len(trial) for trial in recording.trials)
    found, done = [], 0
    for trial in recording.trials:
        way = (done + np.arange(len(trial))) / rows
        found.append(replace(trial, outputs=trial.outputs + total * way[:, np.newaxis]))
        done += len(trial)
    return replace(recording, trials=tuple(found))


def _markers_exchanged(recording: Recording, generator: np.random.Generator) -> Recording:
    """The labels of the tip's marker and another are exchanged over a third of two trials."""
    names = list(recording.points)
    one, other = recording.points["tip"], recording.points[names[1]]
    numbers = generator.choice(len(recording.trials), 2, replace=False).tolist()

    def change(trial: Trial) -> Trial:
        rows = a_stretch(trial, 0.35, generator)
        values = trial.outputs[:, [*other, *one]]
        return with_outputs(trial, [*one, *other], values, rows)

    return in_trials(recording, numbers, change)


def _direction(axes: int, generator: np.random.Generator) -> Array:
    found = generator.normal(size=axes)
    return np.asarray(found / np.linalg.norm(found))


def _shift(
    recording: Recording, generator: np.random.Generator, size_mm: tuple[float, float] = _BUMP_MM
) -> Array:
    """Return one motion of all points, by output, shape (o,)."""
    way = _direction(len(recording.axes), generator) * generator.uniform(*size_mm)
    found = np.zeros(len(recording.outputs))
    for point in recording.points.values():
        found[point] = way
    return found


def _several_points(recording: Recording) -> bool:
    return len(recording.points) > 1


TRACKER_KINDS = (
    Kind("frozen", "all outputs repeat one row over two fifths of a trial", _frozen),
    Kind("lost_as_zero", "the lost tip is written as 0 over a quarter of three trials", _lost(0.0, 0.25)),
    Kind(
        "lost_as_9999",
        "the lost tip is written as -9999 over a quarter of three trials",
        _lost(-9999.0, 0.25),
    ),
    Kind("lost_as_empty", "the lost tip's cells are empty over half of three trials", _lost(math.nan, 0.5)),
    Kind(
        "sees_another_thing", "in bursts the tip's marker is taken for a thing elsewhere", _sees_another_thing
    ),
    Kind("outlier_bursts", "bursts of three to six rows with a scatter of 30 mm", _outlier_bursts),
    Kind("noise_alone", "every output is noise", _noise_alone),
    Kind("on_the_table", "the sensors lie on the table", _on_the_table),
    Kind("one_trial_of_noise", "the outputs of one trial are noise", _one_trial_of_noise),
    Kind("bumped_between", "the tracker is bumped between two trials", _bumped_between),
    Kind("bumped_midway", "the tracker is bumped in the middle of a trial", _bumped_midway),
    Kind(
        "bumped_and_put_back", "the tracker is bumped, and put back in the same trial", _bumped_and_put_back
    ),
    Kind("turned_between", "the tracker is turned between two trials", _turned_between),
    Kind(
        "wanders", "the tracker sags slowly over all trials", _wanders, alike=("drift", "measurement_frame")
    ),
    Kind(
        "markers_exchanged",
        "two markers are exchanged over a third of two trials",
        _markers_exchanged,
        _several_points,
    ),
)


# ----------------------------------------------------------------------------------------------------
# Trials given twice, mixed up, of another robot; and files that are written wrongly.


def _copied(role: str, decimals: int | None, share: float = 1.0) -> Spoil:
    """Return a kind's change: a training trial stands in the data once more, rounded, or a part of it."""

    def spoil(recording: Recording, generator: np.random.Generator) -> Recording:
        trials = tuple(replace(t, role=t.role or _role(recording, k)) for k, t in enumerate(recording.trials))
        number = int(generator.choice([k for k, trial in enumerate(trials) if trial.role == "train"]))
        copy = replace(trials[number], role=role)
        if decimals is not None:
            copy = replace(copy, outputs=np.round(copy.outputs, decimals))
        if share < 1.0:
            rows = np.arange(len(copy))
            start = int(generator.integers(1, round((1.0 - share) * len(copy))))
            copy = of_rows(copy, (rows >= start) & (rows < start + share * len(copy)))
            copy = replace(copy, time_s=copy.time_s - copy.time_s[0])
        return replace(recording, trials=(*trials, copy))

    return spoil


def _role(recording: Recording, number: int) -> str:
    return "heldout" if number >= len(recording.trials) - 2 else "train"


def _files_mixed_up(recording: Recording, generator: np.random.Generator) -> Recording:
    """The outputs of two trials change places; the longer one is cut. The first, which is repeated, stays."""
    one, other = generator.choice(range(1, len(recording.trials)), 2, replace=False).tolist()
    a, b = recording.trials[one], recording.trials[other]
    rows = min(len(a), len(b))
    first, second = of_rows(a, np.arange(rows)), of_rows(b, np.arange(rows))
    trials = list(recording.trials)
    trials[one] = replace(first, outputs=second.outputs)
    trials[other] = replace(second, outputs=first.outputs)
    return replace(recording, trials=tuple(trials))


def _another_robot(recording: Recording, generator: np.random.Generator) -> Recording:
    """One trial is of a robot of the same kind that is 0.6 times as large, and moves so."""
    return in_trial(
        recording, a_trial(recording, generator), lambda trial: replace(trial, outputs=0.6 * trial.outputs)
    )


def _another_weight(recording: Recording, generator: np.random.Generator) -> Recording:
    """In one trial a weight hangs on the robot: points sag sideways, the tip by 8 to 15 mm.

    The sag of a straight cantilever under an end load, s (3 - s) s / 2 of the tip's at the share s of its
    length (Euler and Bernoulli), less where the robot is bent up or down.
    """
    across = [k for k, axis in enumerate(recording.axes) if axis != "z"]
    axis = int(generator.choice(across))
    sag = generator.uniform(8.0, 15.0)
    tip = recording.points["tip"]
    values = np.concatenate([trial.outputs[:, tip] for trial in recording.trials])
    length = max(float(np.nanmax(np.abs(values[:, -1]))), 1e-6)

    def change(trial: Trial) -> Trial:
        for point in recording.points.values():
            share = np.clip(trial.outputs[:, point[-1]] / length, 0.0, 1.0)
            fallen = trial.outputs[:, point[axis]] - sag * share**2 * (3.0 - share) / 2.0
            trial = with_outputs(trial, [point[axis]], fallen[:, np.newaxis])
        return trial

    return in_trial(recording, a_trial(recording, generator), change)


def _other_spelling(lines: list[str], generator: np.random.Generator) -> list[str]:
    """Numbers with an exponent: the same values, other bytes."""
    found = [lines[0]]
    for line in lines[1:]:
        found.append(",".join(f"{float(cell):.12e}" if cell else "" for cell in line.split(",")))
    return found


def _header_again(lines: list[str], generator: np.random.Generator) -> list[str]:
    row = int(generator.integers(3, len(lines) - 2))
    return [*lines[:row], lines[0], *lines[row:]]


def _decimal_commas(lines: list[str], generator: np.random.Generator) -> list[str]:
    return [lines[0], *(line.replace(".", ",") for line in lines[1:])]


def _cut_off(lines: list[str], generator: np.random.Generator) -> list[str]:
    """The file ends in the middle of a row."""
    return [*lines[: len(lines) // 2], lines[len(lines) // 2][: len(lines[-1]) // 2]]


def _rows_again(lines: list[str], generator: np.random.Generator) -> list[str]:
    """Ten rows stand twice."""
    row = int(generator.integers(1, max(2, len(lines) - 11)))
    return [*lines[: row + 10], *lines[row:]]


TRIAL_KINDS = (
    Kind(
        "copy_respelled",
        "a training trial is held out too, numbers spelled otherwise",
        _copied("heldout", None),
        respell=_other_spelling,
    ),
    Kind("copy_rounded", "a training trial is held out too, rounded to 0.01", _copied("heldout", 2)),
    Kind("copy_in_part", "half of a training trial is held out too", _copied("heldout", None, 0.5)),
    Kind(
        "copy_in_training",
        "a training trial trains twice, numbers spelled otherwise",
        _copied("train", None),
        respell=_other_spelling,
    ),
    Kind("files_mixed_up", "the outputs of two trials change places", _files_mixed_up),
    Kind("another_robot", "one trial is of a robot 0.6 times as large", _another_robot),
    Kind("another_weight", "in one trial a weight hangs on the robot", _another_weight, alike=("payload",)),
    Kind("header_again", "the header stands once more in a file", unchanged, respell=_header_again),
    Kind("decimal_commas", "a file has decimal commas", unchanged, respell=_decimal_commas),
    Kind("cut_off", "a file ends in the middle of a row", unchanged, respell=_cut_off),
    Kind("rows_again", "ten rows stand twice in a file", unchanged, respell=_rows_again),
)


# ----------------------------------------------------------------------------------------------------
# All kinds of spoiled data, and data with nothing wrong.

SOUND = Kind("sound", "nothing is wrong", sound=True)
KINDS: tuple[Kind, ...] = (SOUND, *TRACKER_KINDS, *COLUMN_KINDS, *TIMING_KINDS, *TRIAL_KINDS)
BY_NAME: Mapping[str, Kind] = {kind.name: kind for kind in KINDS}
