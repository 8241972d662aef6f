"""Trials of an arc of 100 mm, measured at its middle and its end, written by its formula.

A pull k bends it to a circle of curvature k: a point at the arc length s lies at x = (1 - cos(k s)) / k,
z = sin(k s) / k. Pulls go out and home in loops of several sizes, other ones in every trial.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.faults_of_columns import BesideModel
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.tables import Table

COLUMNS = ("tip_x_mm", "tip_z_mm", "body_5_x_mm", "body_5_z_mm")
NOISE_MM = 0.2
LENGTHS_MM = (100.0, 50.0)
TRIALS = 6


def pull_of(number: int, rows: int = 60) -> Array:
    """Return a trial's pull, a curvature from 0 to 0.012 per mm, shape (r,): loops that start at rest."""
    generator = np.random.default_rng((7, number))
    corners = [0.0]
    while len(corners) < 9:
        corners += [generator.uniform(0.4, 1.0), generator.uniform(0.0, 0.3)]
    at = np.linspace(0.0, len(corners) - 1.0, rows)
    return np.asarray(0.012 * np.interp(at, np.arange(len(corners)), corners))


def arc(pull: Array) -> Array:
    """Return the four columns along a pull, shape (r, 4) [mm]."""
    k = np.maximum(np.abs(pull), 1e-9)
    parts = [(np.sign(pull) * (1.0 - np.cos(k * s)) / k, np.sin(k * s) / k) for s in LENGTHS_MM]
    return np.stack([column for part in parts for column in part], axis=1)


def noisy(values: Array, seed: int = 1, size: float = NOISE_MM) -> Array:
    """Return values with white noise."""
    return values + size * np.random.default_rng(seed).normal(size=values.shape)


def trial_of(number: int, measured: Array, step_s: float = 1.0, role: str = "train") -> Trial:
    """Return a trial of a pull with what was measured."""
    pull = pull_of(number, len(measured))
    zeros = np.zeros((len(pull), 3))
    time_s = step_s * np.arange(float(len(pull)))
    inputs = Inputs(time_s, "tension", np.stack([pull, 0.0 * pull], axis=1), zeros, zeros)
    file = f"trial_{number}.csv"
    table = Table(time_s, {name: measured[:, k] for k, name in enumerate(COLUMNS)}, file)
    return Trial(file, role, inputs, table)


def truth(rows: int = 60) -> list[Array]:
    """Return what the model says of every trial, and what a sound recording without noise is."""
    return [arc(pull_of(number, rows)) for number in range(TRIALS)]


def seen(
    measured: Sequence[Array], models: Sequence[Array] | None = None, steps_s: Sequence[float] | None = None
) -> BesideModel:
    """Return measurements, shape (r, 4) each, beside the model."""
    steps_s = steps_s or [1.0] * len(measured)
    trials = [
        trial_of(k, values, step) for k, (values, step) in enumerate(zip(measured, steps_s, strict=True))
    ]
    return BesideModel(trials, COLUMNS, models or truth(len(measured[0])), {"mm": NOISE_MM})


def changed(change: Callable[[int, Array], Array], seed: int = 1) -> list[Array]:
    """Return a noisy recording in which `change` (trial's number, values) was done to each trial."""
    return [noisy(change(number, values), seed + number) for number, values in enumerate(truth())]


def causes() -> dict[str, list[Array]]:
    """Return sound recordings in which a cause is at work, far above the noise, by its name."""
    pulls = [pull_of(number) for number in range(TRIALS)]

    def played(pull: Array, width: float) -> Array:
        found, now = [], 0.0
        for value in pull:
            now = float(np.clip(now, value - width, value + width))
            found.append(now)
        return np.array(found)

    def lagged(pull: Array, rows: float) -> Array:
        found, now = [], 0.0
        for value in pull:
            now += (value - now) / (1.0 + rows)
            found.append(now)
        return np.array(found)

    def late(pull: Array, rows: int) -> Array:
        return np.concatenate([np.zeros(rows), pull[:-rows]])

    made = {
        "nothing": [arc(pull) for pull in pulls],
        "soft": [arc(1.5 * pull) for pull in pulls],
        "play": [arc(played(pull, 0.0015)) for pull in pulls],
        "lag": [arc(lagged(pull, 3.0)) for pull in pulls],
        "delay": [arc(late(pull, 4)) for pull in pulls],
        "offset": [arc(pull + 0.002) for pull in pulls],
        "creep": [arc(pull + 0.3 * lagged(pull, 20.0)) for pull in pulls],
        "set": [arc(pull - 0.25 * np.maximum.accumulate(pull)) for pull in pulls],
        "load": [arc(pull) + np.array([6.0, 0.5, 2.0, 0.2]) for pull in pulls],
        "zero by trial": [
            arc(pull + 0.001 * way)
            for pull, way in zip(pulls, (0.3, -1.0, 0.6, -0.2, 1.0, -0.7), strict=True)
        ],
    }
    return {name: [noisy(v, k) for k, v in enumerate(values)] for name, values in made.items()}
