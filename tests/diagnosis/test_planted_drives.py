"""A slow drive and a tendon that gives way at first are named, by data that no form has made.

What arrives is worked out here, by many short steps; the forms' own code makes none of the data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from planted import as_inputs, data_set, displacement_history, small_robot

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.trials import Dataset

pytestmark = pytest.mark.slow
FINE = 400  # steps from row to row
Law = Callable[[Array, Array], Array]


def in_short_steps(time_s: Array, rows: Array, follow: Callable[[Array, Array, float], Array]) -> Array:
    """Return what follows rows (r, t) by `follow(now, input, dt)`, from the first row."""
    now, found = rows[0].copy(), [rows[0]]
    for k in range(1, len(rows)):
        dt_s = (time_s[k] - time_s[k - 1]) / FINE
        for share in np.arange(1, FINE + 1) / FINE:
            now = follow(now, rows[k - 1] + share * (rows[k] - rows[k - 1]), dt_s)
        found.append(now)
    return np.array(found)


def slow(time_s: Array, rows: Array) -> Array:
    """No drive goes faster than 0.5 mm/s."""
    return in_short_steps(time_s, rows, lambda y, u, dt: y + np.clip(u - y, -5e-4 * dt, 5e-4 * dt))


def braided(time_s: Array, rows: Array) -> Array:
    """A pulled tendon is longer by up to 0.8 mm, most of it within the first 0.5 mm."""
    return rows - 8e-4 * -np.expm1(-np.abs(rows) / 5e-4)


def data_by(law: Law) -> Dataset:
    """Return four trials in which `law` stands between what was commanded and what arrived."""
    robot = small_robot()
    commanded = []
    for seed in (1, 2, 3, 4):
        rows = displacement_history(seed, 4)
        steps = np.random.default_rng(seed).uniform(0.5, 4.0, len(rows) - 1)
        commanded.append(replace(rows, time_s=np.concatenate([[0.0], np.cumsum(steps)])))
    arrived = [
        replace(as_inputs(law(item.time_s, item.tendon), "displacement"), time_s=item.time_s)
        for item in commanded
    ]
    columns = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
    made = data_set(robot, "small.toml", {}, arrived, columns, noise_mm=0.03, solver="CC")
    trials = [replace(trial, inputs=own) for trial, own in zip(made.trials, commanded, strict=True)]
    return replace(made, trials=tuple(trials))


@pytest.mark.parametrize(
    ("law", "cause", "form", "number", "value"),
    [
        (slow, "rate", "servo", "servo_s_per_mm", 2.0),
        (braided, "tendon_elongation", "toe", "toe_mm", 0.8),
    ],
)
def test_a_drive_that_does_as_it_likes_is_named(
    law: Law, cause: str, form: str, number: str, value: float
) -> None:
    """The cause comes first; where its own form is chosen, with its number to a tenth."""
    found = diagnose_dataset(data_by(law), simulation=False)
    first = found.causes[0]
    assert cause in first.one_of
    assert first.probability >= 0.5
    if first.name == cause:
        assert form in (first.form, *first.forms_as_good)
        if first.form == form:
            assert first.parameters[number].value == pytest.approx(value, rel=0.1)
