"""Jumps of the error that stay, and outputs that follow nothing: on series made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.faults_of_columns import outputs_that_do_not_follow
from catheter_sim.diagnosis.faults_of_readings import bumped_trackers
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.tables import Table

ROWS = 120
COLUMNS = ("tip_x_mm", "tip_z_mm")
PULL = 0.2 - 0.2 * np.cos(np.arange(ROWS) * 2.0 * np.pi / 30.0)  # four loops
MODEL = np.stack([80.0 * PULL, 60.0 - 40.0 * PULL**2], axis=1)
NOISE_MM = 0.1


def trial(measured: np.ndarray) -> Trial:
    zeros = np.zeros((ROWS, 3))
    time_s = np.arange(float(ROWS))
    inputs = Inputs(time_s, "tension", np.stack([PULL, 0.0 * PULL], axis=1), zeros, zeros)
    table = Table(time_s, {name: measured[:, k] for k, name in enumerate(COLUMNS)}, "a.csv")
    return Trial("a.csv", "train", inputs, table)


def noisy(seed: int = 1, size: float = NOISE_MM) -> np.ndarray:
    return size * np.random.default_rng(seed).normal(size=(ROWS, 2))


def found(measured: np.ndarray):
    return bumped_trackers([trial(measured)], COLUMNS, [MODEL], {"mm": NOISE_MM})


@pytest.mark.parametrize("row", [40, 57, 75])
def test_a_jump_that_stays_is_found_at_its_row(row):
    """2 mm and more, in one column or both, also beside a model that errs by a fifth."""
    late = (np.arange(ROWS) >= row)[:, None]
    for jump in ((2.0, 0.0), (-8.0, 8.0)):
        (doubt,) = found(MODEL + noisy() + late * jump)
        assert doubt.rows == (row + 1, ROWS)
    (doubt,) = found(MODEL * (1.2, 1.0) + noisy() + late * (15.0, 0.0))
    assert doubt.rows[0] == row + 1


def test_what_goes_back_or_comes_slowly_is_no_bump():
    """An outlier, a stretch that returns, a jump that dies away, a drift, a dead-band, a wrong model."""
    rows = np.arange(ROWS)[:, None]
    direction = np.sign(np.gradient(PULL))[:, None]
    for error in (
        5.0 * (rows == 60),
        5.0 * ((rows >= 50) & (rows < 56)),
        5.0 * np.exp(-np.maximum(rows - 60, 0) / 6.0) * (rows >= 60),
        0.05 * rows,
        1.5 * direction,
        0.3 * MODEL,
        0.0 * rows,
    ):
        assert found(MODEL + noisy() + error * np.ones(2)) == ()


def problem(measured: np.ndarray) -> Problem:
    robot = load_robot("neuroendoscope_section")
    return Problem(robot, (), (trial(measured),), COLUMNS, np.full(2, NOISE_MM), lambda *_: MODEL[None])


@pytest.mark.parametrize("seed", range(12))
def test_noise_follows_nothing(seed):
    """Whatever noise is drawn, of a tenth of a millimetre or of a few, it is seen to be noise."""
    for size in (0.1, 3.0):
        (doubt,) = outputs_that_do_not_follow(problem(np.array([0.0, 60.0]) + noisy(seed, size)), [MODEL])
        assert "do not follow the inputs" in doubt.what


@pytest.mark.parametrize("seed", range(6))
def test_what_follows_in_any_way_is_not_doubted(seed):
    """Half the motion, a late one, one with a dead-band, one that is turned in sign."""
    late = np.roll(MODEL, 5, axis=0)
    band = MODEL + 3.0 * np.sign(np.gradient(PULL))[:, None]
    for measured in (MODEL, 0.5 * MODEL, late, band, -MODEL):
        assert outputs_that_do_not_follow(problem(measured + noisy(seed)), [MODEL]) == ()


def test_noise_that_hides_the_motion_is_said():
    """A hundred millimetres of noise on a motion of thirty: nothing can be told."""
    (doubt,) = outputs_that_do_not_follow(problem(MODEL + noisy(2, 200.0)), [MODEL])
    assert "hides the motion" in doubt.what
