"""Small linear systems in compiled loops against NumPy's own, and where there is no solution."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.mechanics.vectors import (
    factorise,
    solve_columns,
    solve_definite,
    solve_factorised,
    solve_lower,
    solve_vector,
)

SIZES = (1, 2, 5, 12)


def system(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a regular matrix with zeros on its diagonal, and right sides, shape (m, 3)."""
    generator = np.random.default_rng(size)
    matrix = generator.normal(size=(size, size))
    if size > 1:
        np.fill_diagonal(matrix, 0.0)
    return matrix, generator.normal(size=(size, 3))


@pytest.mark.parametrize("size", SIZES)
def test_rows_are_exchanged_where_the_diagonal_is_zero(size: int) -> None:
    matrix, right = system(size)
    expected = np.linalg.solve(matrix, right)
    many, one = right.copy(), right[:, 0].copy()
    assert solve_columns(matrix.copy(), many)
    assert solve_vector(matrix.copy(), one, 0.0)
    np.testing.assert_allclose(many, expected, rtol=1e-10)
    np.testing.assert_allclose(one, expected[:, 0], rtol=1e-10)


@pytest.mark.parametrize("size", SIZES)
def test_a_matrix_split_once_serves_any_right_side(size: int) -> None:
    matrix, right = system(size)
    split, exchanged = matrix.copy(), np.empty(size, np.int64)
    assert factorise(split, exchanged)
    for column in right.T:
        found = column.copy()
        solve_factorised(split, exchanged, found)
        np.testing.assert_allclose(found, np.linalg.solve(matrix, column), rtol=1e-10)
    assert not factorise(np.zeros((size, size)), exchanged)


@pytest.mark.parametrize("size", SIZES)
def test_triangular_and_definite_systems_need_no_exchange(size: int) -> None:
    """Nothing above the diagonal of a triangular matrix is read; rows of the unit matrix may be held."""
    matrix, right = system(size)
    lower = np.tril(matrix, -1) + 2.0 * np.eye(size)
    found = right[:, 0].copy()
    assert solve_lower(lower + np.triu(np.full_like(matrix, np.nan), 1), found)
    np.testing.assert_allclose(lower @ found, right[:, 0], atol=1e-12)
    definite = matrix @ matrix.T + np.eye(size)
    definite[size // 2] = np.eye(size)[size // 2]
    found = right[:, 1].copy()
    solve_definite(definite.copy(), found)
    np.testing.assert_allclose(found, np.linalg.solve(definite, right[:, 1]), rtol=1e-9)
    assert found[size // 2] == right[size // 2, 1]


@pytest.mark.parametrize("bad", [0.0, np.nan])
def test_singular_systems_are_told(bad: float) -> None:
    matrix = np.array([[1.0, 2.0, 0.0], [2.0, 4.0, 0.0], [0.0, 0.0, 1.0]])
    matrix[1] = bad
    assert not solve_columns(matrix.copy(), np.ones((3, 2)))
    assert not solve_vector(matrix.copy(), np.ones(3), 0.0)
    lower = np.eye(3)
    lower[1, 1] = bad
    assert not solve_lower(lower, np.ones(3))


def test_a_smallest_pivot_makes_something_of_a_singular_system() -> None:
    """What the matrix leaves open comes out as large as the pivot is small; the rest is exact."""
    matrix, right = np.diag([2.0, 0.0, 4.0]), np.array([2.0, 3.0, 2.0])
    assert solve_vector(matrix, right, 1e-6)
    np.testing.assert_allclose(right, [1.0, 3e6, 0.5])
