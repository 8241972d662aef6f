"""Trials given twice, mixed up, of another robot; and files that are written wrongly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catheter_sim.blind_bench.spoiled.kind import Kind, Spoil, unchanged
from catheter_sim.blind_bench.spoiled.recording import (
    Recording,
    Trial,
    a_trial,
    in_trial,
    of_rows,
    with_outputs,
)


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


KINDS = (
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
