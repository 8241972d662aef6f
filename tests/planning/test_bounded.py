"""Bounded least squares: exact where the answer is known, and honest at bounds."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.planning.bounded import binding, least_squares

LEAST, MOST = np.full(2, -1.0), np.ones(2)
MATRIX = np.array([[2.0, 1.0], [0.0, 1.0], [1.0, 0.0]])


def linear(goal: Array) -> object:
    """Return the misses of a linear map from a goal, for points (B, 2)."""
    return lambda points: points @ MATRIX.T - goal


def test_a_linear_problem_within_bounds_is_solved_exactly() -> None:
    """The normal equations' answer, to rounding of the differences."""
    goal = np.array([0.5, -0.2, 0.4])
    expected = np.linalg.lstsq(MATRIX, goal, rcond=None)[0]
    found = least_squares(linear(goal), np.array([0.9, 0.9]), LEAST, MOST, 0.0)
    np.testing.assert_allclose(found.point, expected, atol=1e-7)
    assert binding(found, LEAST, MOST) == []


def test_a_bound_that_holds_back_is_named() -> None:
    """Beyond the upper bound of one coordinate the other one still takes its best value."""
    goal = MATRIX @ np.array([3.0, 0.2])
    found = least_squares(linear(goal), np.zeros(2), LEAST, MOST, 0.0)
    assert found.point[0] == 1.0
    rest = goal - MATRIX[:, 0]
    np.testing.assert_allclose(found.point[1], np.clip(MATRIX[:, 1] @ rest / 2.0, -1.0, 1.0), atol=1e-7)
    assert (0, True) in binding(found, LEAST, MOST)


def test_a_coordinate_that_sticks_is_moved_by_longer_differences() -> None:
    """A dead-band of ten short differences around the start does not end the search."""

    def sticking(points: Array) -> Array:
        moved = np.sign(points[:, :1]) * np.maximum(np.abs(points[:, :1]) - 0.02, 0.0)
        return moved - 0.5

    found = least_squares(sticking, np.zeros(1), np.full(1, -1.0), np.ones(1), 1e-9)
    np.testing.assert_allclose(found.point, [0.52], atol=1e-6)


def test_points_without_an_answer_are_turned_back_from() -> None:
    """Where the function has no value beyond 0.3, the search ends before it, at the least it can have."""

    def broken(points: Array) -> Array:
        return np.where(points[:, :1] > 0.3, np.nan, points[:, :1] - 1.0)

    found = least_squares(broken, np.zeros(1), np.full(1, -1.0), np.ones(1), 1e-9)
    assert 0.2 < found.point[0] <= 0.3
