"""The step of readings is read from them: a rounded log's, a counting sensor's; none where there is none."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from made_up import pulled_by
from planted import as_inputs

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.readings import (
    resolution_of,
    rounding_of,
    step_of,
    steps_of,
    without_old_readings,
)
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.tables import Table

COUNT_DEG = 360.0 / 4096.0  # of an encoder


def levels(count: int = 40, seed: int = 1) -> Array:
    """Return commands in no order."""
    return np.random.default_rng(seed).uniform(-1.0, 1.0, count)


def sweep(rows: int = 2000) -> Array:
    return np.sin(3.0 * np.pi * np.arange(rows) / rows)


def motion(commands: Array) -> Array:
    """Return readings of a range of 60 mm, on no grid."""
    return 30.0 * np.sin(0.9 * commands) + 0.0317


def rounded(values: Array, step: float) -> Array:
    return step * np.round(values / step)


@pytest.mark.parametrize(
    "commands", [levels(), np.repeat(levels(), 5), sweep()], ids=["once", "held", "dense"]
)
@pytest.mark.parametrize("step", [0.01, 0.05, 0.1, 0.25, 1.0, COUNT_DEG, 0.0371])
def test_the_step_of_rounded_readings_is_found(commands: Array, step: float) -> None:
    """Of decimals, of quarters and twentieths, of an encoder's counts and of pixels; in any order of rows."""
    assert step_of(rounded(motion(commands), step), commands[:, None]) == pytest.approx(step, rel=1e-4)


def test_counts_that_are_printed_with_four_decimals_keep_their_step() -> None:
    printed = np.round(rounded(motion(levels(80)), COUNT_DEG), 4)
    assert step_of(printed, levels(80)[:, None]) == pytest.approx(COUNT_DEG, rel=1e-4)


def test_missing_and_filled_in_cells_do_not_hide_the_step() -> None:
    """A cell in ten missing; three of a hundred filled in by hand, between the others."""
    commands = levels(100)
    values = rounded(motion(commands), 0.1)
    values[::10] = np.nan
    values[[3, 33, 63]] += 0.0421
    assert step_of(values, commands[:, None]) == pytest.approx(0.1)


@pytest.mark.parametrize("digits", [6, 7, 9, 12])
def test_numbers_printed_with_many_digits_show_no_step(digits: int) -> None:
    """From 60 to 90, so that six digits are four decimals."""
    values = np.array([float(f"{value:.{digits}g}") for value in 75.0 + 0.5 * motion(levels(200))])
    assert step_of(values, levels(200)[:, None]) == 0.0


@pytest.mark.parametrize(
    "values",
    [
        np.zeros(200),
        np.full(200, 57.3),
        np.full(200, np.nan),
        np.tile([0.0, 0.5], 100),
        np.tile([10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0], 20),
    ],
    ids=["zero", "constant", "missing", "a switch", "nine levels"],
)
def test_few_readings_show_no_step(values: Array) -> None:
    """Numbers at equal distances are no resolution where they are a handful."""
    assert step_of(values, levels(len(values))[:, None]) == 0.0


def test_a_model_without_noise_on_a_ramp_shows_no_step() -> None:
    """Commands at equal distances, answered in proportion, lie at equal distances, too."""
    ramp = np.linspace(0.0, 1.0, 101)
    there_and_back = np.concatenate([ramp, ramp[::-1]])
    assert step_of(17.3 / 7.0 * there_and_back, there_and_back[:, None]) == 0.0


def test_a_column_that_hardly_moves_has_the_step_of_the_others() -> None:
    """It flickers by a step or two, on their grid; one that stands still has none, nor has another unit."""
    commands = levels(60)
    inputs = as_inputs(np.stack([commands, 0.0 * commands], axis=1), "tension")
    columns = {
        "tip_x_mm": rounded(motion(commands), 0.1),
        "tip_y_mm": 0.1 * np.round(0.8 * levels(60, seed=2)),
        "tip_z_mm": np.full(60, 57.3),
        "joint_x1_deg": np.round(motion(commands), 9),
    }
    trial = Trial("a.csv", "train", inputs, Table(inputs.time_s, columns))
    steps = steps_of([trial], tuple(columns))
    assert steps == {"tip_x_mm": pytest.approx(0.1), "tip_y_mm": pytest.approx(0.1)}


def test_rounding_leaves_the_step_over_the_root_of_twelve() -> None:
    """The root mean square over a unit's columns, those without a step among them."""
    left = rounding_of(("tip_x_mm", "tip_z_mm", "joint_x1_deg"), {"tip_x_mm": 0.12})
    assert left == {"mm": pytest.approx(0.12 / math.sqrt(24.0)), "deg": 0.0}


def test_a_slow_sweep_read_coarsely_is_no_slow_sensor() -> None:
    """Readings that repeat while the robot is driven, and change by single steps, are not old ones.

    The same motion through a sensor that reads every fifth row leaves steps out: there they are.
    """
    pull = np.linspace(0.0, 1.0, 1200) ** 1.2
    true = 20.0 * pull
    coarse = pulled_by(pull, {"tip_x_mm": rounded(true, 0.1)})
    assert without_old_readings(coarse) == (coarse, ())
    slow = rounded(true[5 * (np.arange(1200) // 5)], 0.01)
    (note,) = without_old_readings(pulled_by(pull, {"tip_x_mm": slow}))[1]
    assert note.code == "old_readings"


def test_a_resolution_that_is_known_is_not_looked_for_again() -> None:
    """In another frame readings lie on no grid any more; they keep the step that they had."""
    data = pulled_by(0.5 + 0.5 * sweep(1200), {"tip_x_mm": np.zeros(1200)})
    assert resolution_of(data) == {}
    assert resolution_of(replace(data, resolution={"tip_x_mm": 0.1})) == {"tip_x_mm": 0.1}
