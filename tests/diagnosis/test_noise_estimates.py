"""The noise of a measurement is found to a few percent, from repeats and from what is white in residuals."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from made_problem import gain_problem
from planted import as_inputs

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.noise import (
    is_white,
    noise_floor,
    noise_from_row_to_row,
    repeat_noise,
    residual_noise,
    times_noise,
    white_noise,
)
from catheter_sim.diagnosis.prepare import noise_beside
from catheter_sim.diagnosis.readings import steps_of
from catheter_sim.diagnosis.trials import Trial, is_repeat
from catheter_sim.tables import Table

ROWS = 20_000


def test_white_part_is_found_to_three_percent():
    """Of white noise on a slow wave, by two sizes; a jump in every hundredth row moves it little."""
    generator = np.random.default_rng(1)
    wave = 5.0 * np.sin(np.arange(ROWS) / 300.0)
    for size in (0.02, 0.4):
        noisy = wave + size * generator.normal(size=ROWS)
        assert white_noise({"tip_x_mm": [noisy]})["mm"] == pytest.approx(size, rel=0.03)
        jumps = noisy + np.where(generator.random(ROWS) < 0.01, 10.0, 0.0)
        assert white_noise({"tip_x_mm": [jumps]})["mm"] == pytest.approx(size, rel=0.06)


def test_white_part_of_each_unit_is_its_own():
    """Degrees do not count among millimetres, and a missing row spoils only its neighbours."""
    generator = np.random.default_rng(2)
    millimetres, degrees = 0.1 * generator.normal(size=ROWS), 2.0 * generator.normal(size=ROWS)
    millimetres[::500] = np.nan
    found = white_noise({"tip_x_mm": [millimetres], "joint_x1_deg": [degrees]})
    assert found == {"mm": pytest.approx(0.1, rel=0.03), "deg": pytest.approx(2.0, rel=0.03)}


def trial_of(values: np.ndarray, file: str) -> Trial:
    """Return a trial of slow loops with these measurements."""
    pull = np.abs(np.sin(np.arange(len(values)) / 50.0))
    inputs = as_inputs(np.stack([pull, 0.0 * pull], axis=1), "tension")
    return Trial(file, "train", inputs, Table(inputs.time_s, {"tip_x_mm": values}, file))


def test_noise_of_repeats_is_that_of_one_of_them():
    """Two and three repeats of one trial: the noise of each, not of their difference."""
    generator = np.random.default_rng(3)
    trials = [trial_of(7.0 + 0.25 * generator.normal(size=ROWS), f"{k}.csv") for k in range(3)]
    for some in (trials[:2], trials):
        assert repeat_noise(some, ("tip_x_mm",))["mm"] == pytest.approx(0.25, rel=0.03)


def test_faster_is_no_repeat():
    """The same inputs by the same clock repeat one another; at twice the speed, or a little larger, not."""
    first = trial_of(np.zeros(200), "a.csv")
    inputs = first.inputs
    assert is_repeat(first, replace(first, file="b.csv"))
    faster = replace(first, inputs=replace(inputs, time_s=0.5 * inputs.time_s))
    larger = replace(first, inputs=replace(inputs, tendon=1.001 * inputs.tendon))
    assert not is_repeat(first, faster)
    assert not is_repeat(first, larger)


def read_as(commands: Array, readings: Array, true: Array) -> tuple[float, float]:
    """Return the noise of readings from row to row alone, and with their repeats and resolution in mind."""
    inputs = as_inputs(np.stack([commands, 0.0 * commands], axis=1), "displacement")
    trial = Trial("a.csv", "train", inputs, Table(inputs.time_s, {"tip_x_mm": readings}))
    series = {"tip_x_mm": [true - readings]}
    known = white_noise(series, [trial], steps_of([trial], ("tip_x_mm",)))
    return white_noise(series)["mm"], known["mm"]


def bent(commands: Array) -> Array:
    return 30.0 * np.sin(commands)


def held(count: int, rows: int, seed: int = 5) -> Array:
    """Return commands in no order, each held for so many rows."""
    return np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, count), rows)


def rounded(values: Array, step: float) -> Array:
    return step * np.round(values / step)


@pytest.mark.parametrize("rows", [2, 3, 5, 10])
@pytest.mark.parametrize("step", [0.05, 0.1, 0.25])
def test_held_readings_without_noise_have_that_of_their_rounding(step: float, rows: int) -> None:
    """What rounding leaves is evenly distributed over a step: its root mean square is step / sqrt(12)."""
    true = bent(held(60, rows))
    alone, found = read_as(held(60, rows), rounded(true, step), true)
    assert found == pytest.approx(step / math.sqrt(12.0), rel=0.12)
    assert rows == 2 or alone < 0.6 * found  # most second differences are of one reading


@pytest.mark.parametrize("rows", [3, 5, 10])
@pytest.mark.parametrize(("step", "noise"), [(0.1, 0.03), (0.1, 0.05), (0.25, 0.08), (0.25, 0.25)])
def test_held_readings_that_flicker_have_noise_and_rounding(step: float, noise: float, rows: int) -> None:
    """The variances add up, whatever share of the rows repeats the one before."""
    true = bent(held(100, rows))
    noisy = true + noise * np.random.default_rng(6).normal(size=len(true))
    _, found = read_as(held(100, rows), rounded(noisy, step), true)
    assert found == pytest.approx(math.hypot(noise, step / math.sqrt(12.0)), rel=0.18)


@pytest.mark.parametrize("step", [0.0, 0.01, 0.1])
@pytest.mark.parametrize("rows", [2, 5, 10])
def test_a_reading_that_is_written_several_times_counts_once(step: float, rows: int) -> None:
    """A sensor slower than its log, its noise three steps and more: what is repeated is noise, too."""
    commands = held(600, 2 * rows)
    noise = 0.3 * np.repeat(np.random.default_rng(7).normal(size=1200), rows)
    readings = bent(commands) + noise
    _, found = read_as(commands, rounded(readings, step) if step else readings, bent(commands))
    assert found == pytest.approx(0.3, rel=0.2)


@pytest.mark.parametrize("rows", [600, 2000, 10_000])
@pytest.mark.parametrize(("step", "noise"), [(0.05, 0.0), (0.1, 0.0), (0.1, 0.03), (0.25, 0.0), (0.25, 0.1)])
def test_a_slow_sweep_that_is_read_coarsely(step: float, noise: float, rows: int) -> None:
    """Readings stay at one value for several rows of a motion, however densely it is logged."""
    commands = np.sin(3.0 * np.pi * np.arange(rows) / rows)
    noisy = bent(commands) + noise * np.random.default_rng(8).normal(size=rows)
    _, found = read_as(commands, rounded(noisy, step), bent(commands))
    assert found == pytest.approx(math.hypot(noise, step / math.sqrt(12.0)), rel=0.12)


def test_no_reading_is_surer_than_its_rounding() -> None:
    """Of a slow creep of two steps in 400 rows, from a leap: hardly any second difference is not zero."""
    commands = np.concatenate([[-1.0], np.linspace(0.2, 0.207, 400), [1.0]])
    inputs = as_inputs(np.stack([commands, 0.0 * commands], axis=1), "displacement")
    readings = rounded(bent(commands), 0.1)
    trial = Trial("a.csv", "train", inputs, Table(inputs.time_s, {"tip_x_mm": readings}))
    series = {"tip_x_mm": [bent(commands) - readings]}
    assert white_noise(series, [trial])["mm"] < 0.01
    assert white_noise(series, [trial], {"tip_x_mm": 0.1})["mm"] == pytest.approx(0.1 / math.sqrt(12.0))


@pytest.mark.parametrize("digits", [4, 12])
@pytest.mark.parametrize("commands", [held(300, 1), held(100, 5), np.sin(np.arange(3000) / 300.0)])
def test_nothing_changes_for_readings_that_are_fine(commands: Array, digits: int) -> None:
    """White noise of many steps, in levels held or not, or in a sweep: to the last digit as row by row."""
    readings = np.round(bent(commands) + np.random.default_rng(9).normal(0.0, 0.05, len(commands)), digits)
    alone, found = read_as(commands, readings, bent(commands))
    assert found == alone


def test_the_noise_of_a_filtered_sensor_is_read_from_rows_further_apart() -> None:
    """Means over eight rows of white noise, in a log in which the robot moves 30,000 rows from end to end.

    From row to row they hardly change; their size is that of white noise over sqrt(8).
    """
    rows = 60_000
    commands = np.sin(np.pi * np.arange(rows) / 30_000)
    white = np.random.default_rng(10).normal(0.0, 0.4, rows)
    smooth = np.convolve(white, np.full(8, 0.125), mode="same")
    alone, found = read_as(commands, bent(commands) + smooth, bent(commands))
    assert found == pytest.approx(0.4 / math.sqrt(8.0), rel=0.05)
    assert alone < 0.6 * found


def test_no_noise_is_zero() -> None:
    """Of readings computed without any, held, repeated and explained to the last digit."""
    commands = held(20, 5)
    trials = tuple(replace(trial_of(commands, file), inputs=held_inputs(commands)) for file in ("a", "b"))
    problem = gain_problem(trials, 0.1, ("tip_x_mm",))
    exact = fit(problem, (), cross_validate=False)
    assert 0.0 < residual_noise(problem, exact)["mm"] < 1e-5
    assert 0.0 < noise_beside(problem, exact)["mm"] < 1e-5
    stepped = replace(problem, resolution={"tip_x_mm": 0.1})
    assert noise_beside(stepped, exact)["mm"] == pytest.approx(0.1 / math.sqrt(12.0))


def held_inputs(commands: Array):
    return as_inputs(np.stack([commands, 0 * commands, 0 * commands], axis=1), "displacement")


def test_noise_from_row_to_row_is_no_less_than_rounding() -> None:
    """Of a column that stands still for most rows, and of one without a step."""
    values = np.stack([rounded(np.linspace(0.0, 1.0, 400), 0.1), np.linspace(0.0, 1.0, 400)], axis=1)
    found = noise_from_row_to_row([values], (0.1, 0.0))
    assert found[0] == pytest.approx(0.1 / math.sqrt(12.0))
    assert 0.0 < found[1] < 1e-5


@pytest.mark.parametrize(
    ("error", "noise", "times"),
    [
        (0.3, 0.1, 3.0),
        (0.0, 0.1, 0.0),
        (0.0, 0.0, 0.0),
        (0.3, 0.0, 1e6),
        (0.3, 1e-300, 1e6),
        (1e-310, 0.1, 0.0),
    ],
)
def test_an_error_is_a_finite_number_of_times_the_noise(error: float, noise: float, times: float) -> None:
    assert times_noise(error, noise) == pytest.approx(times)


def test_floor_is_the_smaller_bound():
    """Both estimates are upper bounds; where nothing repeats the other one stands."""
    white = {"mm": 0.3, "deg": 0.1}
    assert noise_floor(white, {"mm": 0.2}) == {"mm": 0.2, "deg": 0.1}
    assert noise_floor(white, {"mm": 0.4, "deg": 0.05}) == {"mm": 0.3, "deg": 0.05}


@pytest.mark.parametrize(("correlation", "white"), [(-0.5, True), (0.15, True), (0.45, False), (0.9, False)])
def test_neighbours_that_hang_together_are_not_white(correlation, white):
    """A first-order process: up to 0.3 its neighbours pass for independent."""
    generator = np.random.default_rng(4)
    values = [0.0]
    for step in generator.normal(size=4000):
        values.append(correlation * values[-1] + step)
    assert is_white([np.array(values)]) is white
