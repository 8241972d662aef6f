"""The noise of a measurement is found to a few percent, from repeats and from what is white in residuals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted import as_inputs

from catheter_sim.diagnosis.data.parting import is_repeat
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.fitting.noise import is_white, noise_floor, repeat_noise, white_noise
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
