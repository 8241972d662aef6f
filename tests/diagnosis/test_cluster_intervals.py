"""Intervals against textbooks: rows that hang together count by their blocks, rows that do not by themselves.

Where every block holds the same rows, least squares over all rows is the mean of what each block alone would
give. So the interval must be Student's t of these few numbers, worked out here without a fit.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import t as student

from catheter_sim.core.effect import Parameter
from catheter_sim.diagnosis.fit import Fit
from catheter_sim.diagnosis.intervals import half_widths, intervals
from catheter_sim.diagnosis.problem import FittedNumber, Term
from catheter_sim.diagnosis.residuals import binned_mean

ROWS = 10  # of a block


def fit_of(design: np.ndarray, measured: np.ndarray, block: np.ndarray) -> Fit:
    """Return the least-squares fit of a linear model, numbers far from their bounds."""
    x = np.linalg.lstsq(design, measured, rcond=None)[0]
    numbers = tuple(
        FittedNumber("made", Parameter(f"x{index}", null=0.0, lower=-1e6, upper=1e6, scale=1.0, start=0.0))
        for index in range(len(x))
    )
    error = design @ x - measured
    held = np.zeros(len(x), bool)
    return Fit(
        (Term("made", tuple(f.parameter.name for f in numbers)),),
        numbers,
        x,
        error,
        design,
        held,
        block,
        error,
    )


def width_of_mean(values: np.ndarray) -> np.ndarray:
    """Return half the 95 % interval of the mean of independent numbers along the first axis."""
    count = len(values)
    return student.ppf(0.975, count - 1) * values.std(axis=0, ddof=1) / np.sqrt(count)


@pytest.mark.parametrize("blocks", [2, 3, 4, 7, 25])
def test_interval_of_a_mean_is_that_of_the_blocks_means(blocks):
    """However many rows a block has: Student's t with one freedom less than there are blocks."""
    generator = np.random.default_rng(blocks)
    block = np.repeat(np.arange(blocks), ROWS)
    common = generator.normal(size=blocks)
    measured = 1.5 + common[block] + 0.1 * generator.normal(size=len(block))
    found = fit_of(np.ones((len(block), 1)), measured, block)
    expected = width_of_mean(measured.reshape(blocks, ROWS).mean(axis=1))
    assert half_widths(found)[0] == pytest.approx(expected, rel=1e-9)
    low, high = intervals(found)["made", "x0"]
    assert (low, high) == pytest.approx((measured.mean() - expected, measured.mean() + expected), rel=1e-9)


@pytest.mark.parametrize("blocks", [3, 5, 12])
def test_interval_of_a_slope_is_that_of_the_blocks_slopes(blocks):
    """Blocks that all hold the same places of a line, each with an offset and a slope of its own."""
    generator = np.random.default_rng(blocks)
    block = np.repeat(np.arange(blocks), ROWS)
    place = np.linspace(0.0, 1.0, ROWS)
    own = generator.normal(size=(blocks, 2))
    measured = (own[:, :1] + own[:, 1:] * place).ravel() + 0.05 * generator.normal(size=len(block))
    design = np.tile(np.stack([np.ones(ROWS), place], axis=1), (blocks, 1))
    each = np.array([np.polyfit(place, part, 1)[::-1] for part in measured.reshape(blocks, ROWS)])
    np.testing.assert_allclose(half_widths(fit_of(design, measured, block)), width_of_mean(each), rtol=1e-9)


def test_few_blocks_cover_the_truth_in_95_of_100_draws():
    """Errors common to whole blocks, three of them, drawn 400 times: neither less often nor more.

    With the freedoms of the rows it would be 81 of 100.
    """
    generator = np.random.default_rng(13)
    block = np.repeat(np.arange(3), ROWS)
    design = np.ones((len(block), 1))
    draws, inside = 400, 0
    for _ in range(draws):
        measured = generator.normal(size=3)[block] + 0.1 * generator.normal(size=len(block))
        found = fit_of(design, measured, block)
        inside += abs(found.x[0]) <= half_widths(found)[0]
    assert inside / draws == pytest.approx(0.95, abs=4.0 * np.sqrt(0.95 * 0.05 / draws))


def test_white_residuals_have_as_many_freedoms_as_rows_are_left():
    """Six rows, two numbers: s^2 is the squares over four, and Student's t has four freedoms.

    The residuals stand where the slope is not felt, so that blocks would give it no width at all.
    """
    place = np.array([-1.0, -1.0, 0.0, 0.0, 1.0, 1.0])
    error = np.array([0.0, 0.0, 0.3, -0.3, 0.0, 0.0])
    found = fit_of(np.stack([np.ones(6), place], axis=1), 2.0 + 3.0 * place + error, np.arange(6))
    variance = (error**2).sum() / 4
    expected = student.ppf(0.975, 4) * np.sqrt(variance / (place**2).sum())
    assert half_widths(found)[1] == pytest.approx(expected, rel=1e-9)


def test_one_block_says_nothing():
    """With a single block there is nothing to compare with: no width is known."""
    found = fit_of(np.ones((ROWS, 1)), np.arange(ROWS, dtype=float), np.zeros(ROWS, int))
    assert np.isinf(half_widths(found)).all()


def test_mean_of_a_view_over_few_cycles_has_students_width():
    """Three cycles of equal length: Student's t of their means with two freedoms, 4.3 and not 1.96."""
    generator = np.random.default_rng(3)
    cycles = generator.normal(size=(3, ROWS)) + generator.normal(size=(3, 1))
    found = binned_mean(np.zeros(3 * ROWS), cycles.ravel(), np.repeat(np.arange(3), ROWS))
    assert found.half_width[0] == pytest.approx(width_of_mean(cycles.mean(axis=1)), rel=1e-9)
