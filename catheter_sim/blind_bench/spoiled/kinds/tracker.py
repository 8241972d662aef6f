"""A tracker that loses the robot, is bumped, or wanders."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.spoiled.kind import Kind, Spoil
from catheter_sim.blind_bench.spoiled.recording import (
    Recording,
    Trial,
    a_stretch,
    a_trial,
    in_all,
    in_trial,
    in_trials,
    with_outputs,
)

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


KINDS = (
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
