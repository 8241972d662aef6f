"""Problems whose twin is one line of algebra: what is fitted and what is left are known beforehand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from planted import as_inputs, small_robot

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.tables import Table

LOOPS, ROWS = 8, 24


def pulls(loops: int = LOOPS, rows: int = ROWS, seed: int = 0) -> Array:
    """Return loops out and home of several sizes, shape (loops * rows,)."""
    size = np.random.default_rng(seed).uniform(0.5, 1.0, loops)
    return np.concatenate([item * np.sin(np.pi * np.arange(rows) / rows) for item in size])


def trial_of(pull: Array, outputs: dict[str, Array], file: str = "a.csv", role: str = "train") -> Trial:
    """Return a trial in which the first of three tendons is pulled."""
    inputs = as_inputs(np.stack([pull, 0 * pull, 0 * pull], axis=1), "displacement")
    return Trial(file, role, inputs, Table(inputs.time_s, outputs, "made"))


def gain_problem(trials: tuple[Trial, ...], weight: float, columns: tuple[str, ...]) -> Problem:
    """Return a problem whose twin gives the pull times `actuation_gain.scale` for every column."""

    def twin(robots, inputs, every):
        gains = [item.effects.get("actuation_gain", {}).get("scale", 1.0) for item in robots]
        rows = np.array(gains)[:, None] * inputs.tendon[:, 0][None]
        return np.repeat(rows[:, ::every, None], len(columns), axis=2)

    return Problem(small_robot(), (), trials, columns, np.full(len(columns), weight), twin)


def noisy(values: Array, seed: int, size: float = 0.01) -> Array:
    """Return values with white noise."""
    return values + size * np.random.default_rng(seed).normal(size=values.shape)


Shape = Callable[[Array], Array]
