"""Intervals: as wide as the noise says, and along a valley where numbers trade against one another."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import as_inputs, small_robot
from scipy.stats import t as student

from catheter_sim.core.effect import Parameter
from catheter_sim.diagnosis.fit import blocks_of, fit
from catheter_sim.diagnosis.intervals import intervals, model_margin, profile_interval, shift_by_model
from catheter_sim.diagnosis.nuisance import calibration_numbers
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.thresholds import TRUSTED_SHARE
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.tables import Table

ROWS = 120
DRAWS = 100
X = np.linspace(0.0, 1.0, ROWS)


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a curve in which a and b trade against one another: nearly a function of a b alone."""
    return (a * b)[:, None] * X + 0.02 * b[:, None] * X**2


def problem_of(measured: np.ndarray, model=product) -> Problem:
    """Return the fit of stiffness_scale a and friction b, read from the robot, to a measured column."""
    robot = replace(small_robot(), friction=replace(small_robot().friction, mu=1.5))
    numbers = calibration_numbers({"stiffness_scale": [0.2, 8.0], "friction.mu": [0.2, 8.0]}, robot, "test")

    def twin(robots, inputs, every):
        a = np.array([item.stiffness_scale for item in robots])
        b = np.array([item.friction.mu for item in robots])
        return model(a, b)[:, ::every, None]

    inputs = as_inputs(np.zeros((ROWS, 3)), "displacement")
    table = Table(inputs.time_s, {"tip_x_mm": measured}, "made")
    return Problem(
        robot, numbers, (Trial("a.csv", "train", inputs, table),), ("tip_x_mm",), np.full(1, 0.05), twin
    )


def noisy(
    generator: np.random.Generator, a: float, b: float, model=product, size: float = 0.05
) -> np.ndarray:
    return model(np.array([a]), np.array([b]))[0] + size * generator.normal(size=ROWS)


def line(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, None] + b[:, None] * X


def test_white_noise_gives_the_interval_of_a_straight_line():
    """For a line under white noise the interval is no narrower than the textbook's, and of its size."""
    generator = np.random.default_rng(1)
    measured = noisy(generator, 2.0, 3.0, line)
    found = fit(problem_of(measured, line), (), cross_validate=False, thorough=True)
    design = np.stack([np.ones(ROWS), X], axis=1)
    best, squares, *_ = np.linalg.lstsq(design, measured, rcond=None)
    error = np.sqrt(squares[0] / (ROWS - 2) * np.diag(np.linalg.inv(design.T @ design)))
    half = error * student.ppf(0.975, ROWS - 2)
    for name, value, width in zip(("stiffness_scale", "friction.mu"), best, half, strict=True):
        low, high = intervals(found)["", name]
        assert found.values["", name] == pytest.approx(value, abs=0.02 * width)
        assert low <= value - 0.98 * width
        assert high >= value + 0.98 * width
        assert high - low < 3.2 * width


def test_profile_of_a_straight_line_is_its_parabola():
    """Where the model is linear both intervals are the same."""
    generator = np.random.default_rng(2)
    problem = problem_of(noisy(generator, 2.0, 3.0, line), line)
    found = fit(problem, (), cross_validate=False, thorough=True)
    for name in ("stiffness_scale", "friction.mu"):
        straight, along = intervals(found)["", name], profile_interval(problem, found, name)
        assert along == pytest.approx(straight, abs=0.03 * (straight[1] - straight[0]))


def test_profile_of_rows_that_hang_together_is_as_wide_as_their_blocks_say():
    """Errors common to stretches of rows: the linear model's profile is its interval by blocks, which is far
    wider than that of white residuals."""
    generator = np.random.default_rng(7)
    problem = problem_of(noisy(generator, 2.0, 3.0, line), line)
    block = blocks_of(problem)
    common = 0.3 * generator.normal(size=block.max() + 1)[block]
    problem = problem_of(noisy(generator, 2.0, 3.0, line) + common, line)
    found = fit(problem, (), cross_validate=False, thorough=True)
    error = np.sqrt(np.mean(found.residual**2) * np.diag(np.linalg.inv(found.jacobian.T @ found.jacobian)))
    for index, name in enumerate(("stiffness_scale", "friction.mu")):
        straight, along = intervals(found)["", name], profile_interval(problem, found, name)
        assert along == pytest.approx(straight, abs=0.03 * (straight[1] - straight[0]))
        white = 2.0 * 1.98 * error[index] * found.numbers[index].parameter.scale
        assert along[1] - along[0] > 1.5 * white


@pytest.mark.long
def test_profile_covers_in_a_valley():
    """Where two numbers nearly only act as a product, the profile covers both in 90 of 100 draws at least.

    The parabola at the fit does not follow the valley's bend; the data leave a factor of two open.
    """
    generator = np.random.default_rng(3)
    covered = {"stiffness_scale": 0, "friction.mu": 0}
    truth = {"stiffness_scale": 1.2, "friction.mu": 2.0}
    widths = []
    for _ in range(DRAWS):
        problem = problem_of(noisy(generator, 1.2, 2.0, size=0.03))
        found = fit(problem, (), cross_validate=False, thorough=True)
        for name in covered:
            low, high = profile_interval(problem, found, name)
            covered[name] += low <= truth[name] <= high
            widths.append(high / low)
    assert min(covered.values()) >= 90, covered
    assert np.median(widths) > 2.0


def test_a_number_known_beforehand_keeps_its_own_width():
    """A nuisance that the data hardly see has the interval of what is known of it, not a point."""
    generator = np.random.default_rng(4)
    problem = problem_of(
        noisy(generator, 2.0, 3.0, lambda a, b: line(b * 0.0 + 2.0 + 1e-3 * a, b)),
        lambda a, b: line(b * 0.0 + 2.0 + 1e-3 * a, b),
    )
    spread = 0.05 / math.sqrt(3.0)
    first = problem.nuisances[0]
    known = replace(
        first,
        parameter=Parameter("stiffness_scale", 1.0, 0.95, 1.05, 0.0125, 1.0),
        spread=spread,
    )
    problem = replace(problem, nuisances=(known, problem.nuisances[1]))
    found = fit(problem, (), cross_validate=False)
    low, high = intervals(found)["", "stiffness_scale"]
    assert high - low > 2.0 * spread


def test_margin_bounds_what_an_error_of_the_model_does():
    """An error of a tenth of the residuals moves no number further than the margin; one gets there."""
    generator = np.random.default_rng(5)
    problem = problem_of(noisy(generator, 2.0, 3.0, line), line)
    found = fit(problem, (), cross_validate=False)
    margin = model_margin(found, np.zeros(2))
    size = TRUSTED_SHARE * np.sqrt(np.mean(found.residual**2))
    inverse = np.linalg.inv(found.jacobian.T @ found.jacobian)
    for index in range(2):
        worst = found.jacobian @ inverse[:, index]
        worst *= size / np.sqrt(np.mean(worst**2))
        moved = inverse @ found.jacobian.T @ worst
        assert abs(moved[index]) == pytest.approx(margin[index], rel=1e-6)
        for _ in range(20):
            error = generator.normal(size=len(found.residual))
            error *= size / np.sqrt(np.mean(error**2))
            assert abs(inverse @ found.jacobian.T @ error)[index] < margin[index]


def test_other_model_moves_the_numbers_by_what_it_differs():
    """Where another model of the same numbers is a line steeper by 0.1, a fit by it is less steep by 0.1."""
    generator = np.random.default_rng(6)
    problem = problem_of(noisy(generator, 2.0, 3.0, line), line)
    found = fit(problem, (), cross_validate=False)
    values = line(
        np.array([found.values["", "stiffness_scale"]]), np.array([found.values["", "friction.mu"]])
    )[0]
    shift = shift_by_model(problem, found, [(values + 0.1 * X)[:, None]])
    scale = [free.parameter.scale for free in found.numbers]
    assert shift * scale == pytest.approx([0.0, -0.1], abs=1e-6)
    assert shift_by_model(problem, found, [np.full((ROWS, 1), np.nan)]).tolist() == [0.0, 0.0]
