"""Columns swapped, turned in sign, in another unit, clipped or counted coarsely."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.blind_bench.spoiled.kind import Kind, Spoil
from catheter_sim.blind_bench.spoiled.recording import (
    OnTrial,
    Recording,
    Trial,
    in_all,
    in_trial,
    with_outputs,
)

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


KINDS = (
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
