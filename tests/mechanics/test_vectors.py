"""Vectors in compiled loops against NumPy's own."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catheter_sim.mechanics import vectors


def three(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=3)


def test_products_of_vectors_are_numpys() -> None:
    """Scalar and vector product; the latter may be written over one of its factors."""
    a, b = three(0), three(1)
    out = np.empty(3)
    vectors.cross3(a, b, out)
    np.testing.assert_allclose(out, np.cross(a, b), rtol=1e-14)
    assert vectors.dot3(a, b) == pytest.approx(a @ b, rel=1e-14)
    assert vectors.dot3(out, a) == pytest.approx(0.0, abs=1e-15)
    vectors.add_cross3(a, b, out)
    np.testing.assert_allclose(out, 2.0 * np.cross(a, b), rtol=1e-14)
    for place in (0, 1):
        factors = [a.copy(), b.copy()]
        vectors.cross3(*factors, factors[place])
        np.testing.assert_allclose(factors[place], np.cross(a, b), rtol=1e-14)


def test_a_turn_and_its_reverse_leave_a_vector_as_it_was() -> None:
    R, a = np.ascontiguousarray(Rotation.from_rotvec(three(2)).as_matrix()), three(3)
    there, back = np.empty(3), np.empty(3)
    vectors.turned(R, a, there)
    vectors.turned_back(R, there, back)
    np.testing.assert_allclose(there, R @ a, rtol=1e-14)
    np.testing.assert_allclose(back, a, rtol=1e-14)
    product = np.empty((3, 3))
    vectors.product3(R, R, product)
    np.testing.assert_allclose(product, R @ R, atol=1e-15)


def test_arrays_of_any_shape_are_copied_and_filled() -> None:
    """Whole arrays with several axes, and vectors with gaps between their numbers."""
    source = np.random.default_rng(4).normal(size=(2, 3, 4))
    out = np.empty_like(source)
    vectors.copy_all(source, out)
    np.testing.assert_array_equal(out, source)
    vectors.fill(out[1], 7.0)
    np.testing.assert_array_equal(out[1], 7.0)
    np.testing.assert_array_equal(out[0], source[0])
    vectors.copy(source[:, 1, 2], out[:, 0, 0])
    np.testing.assert_array_equal(out[:, 0, 0], source[:, 1, 2])
    short = np.zeros(3)
    vectors.copy3(source[0, 0, :3], short)
    vectors.add3(source[0, 0, :3], short)
    np.testing.assert_array_equal(short, 2.0 * source[0, 0, :3])


def test_between_two_vectors_the_ends_are_the_vectors() -> None:
    start, end, out = three(5), three(6), np.empty(3)
    vectors.blend(start, end, 0.0, out)
    np.testing.assert_array_equal(out, start)
    vectors.blend(start, end, 1.0, out)
    np.testing.assert_allclose(out, end, rtol=1e-14)
    vectors.scale(out, -2.0)
    np.testing.assert_allclose(out, -2.0 * end, rtol=1e-14)


def test_the_largest_size_counts_both_signs_and_tells_of_no_number() -> None:
    values = np.array([[1.0, -3.0], [2.0, 0.0]])
    assert vectors.largest_size(values) == 3.0
    assert vectors.largest_size(np.zeros((0, 2))) == 0.0
    values[1, 1] = np.nan
    assert np.isnan(vectors.largest_size(values))
    assert vectors.largest_size(np.array([1.0, -np.inf])) == np.inf
