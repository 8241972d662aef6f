"""Vectors in compiled loops: none of these makes an array, and all write into the last one that they are
given.

NumPy's own expressions would be shorter, make an array each, and take LLVM ten times as long.
"""

from __future__ import annotations

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled_in_place


@compiled_in_place
def copy(source: Array, out: Array) -> None:
    """Copy a vector, shape (n,); a slice assignment would compile its error messages with it."""
    for i in range(source.shape[0]):
        out[i] = source[i]


@compiled_in_place
def copy_all(source: Array, out: Array) -> None:
    """Copy a contiguous array of any shape."""
    flat, to = source.reshape(-1), out.reshape(-1)
    for i in range(flat.shape[0]):
        to[i] = flat[i]


@compiled_in_place
def fill(out: Array, value: float) -> None:
    """Set all of a contiguous array of any shape to `value`."""
    flat = out.reshape(-1)
    for i in range(flat.shape[0]):
        flat[i] = value


@compiled_in_place
def scale(out: Array, factor: float) -> None:
    """Multiply a vector, shape (n,), by `factor`."""
    for i in range(out.shape[0]):
        out[i] *= factor


@compiled_in_place
def blend(start: Array, end: Array, share: float, out: Array) -> None:
    """Write the vector at `share` of the way from `start` to `end`, shape (n,) each."""
    for i in range(start.shape[0]):
        out[i] = start[i] + share * (end[i] - start[i])


@compiled_in_place
def largest_size(values: Array) -> float:
    """Return the largest absolute value in a contiguous array of any shape; NaN where one is."""
    flat = values.reshape(-1)
    largest = 0.0
    for i in range(flat.shape[0]):
        if not abs(flat[i]) <= largest:
            largest = abs(flat[i])
    return largest


@compiled_in_place
def copy3(a: Array, out: Array) -> None:
    """Copy a vector of three numbers."""
    for i in range(3):
        out[i] = a[i]


@compiled_in_place
def add3(a: Array, out: Array) -> None:
    """Add a vector of three numbers to `out`."""
    for i in range(3):
        out[i] += a[i]


@compiled_in_place
def dot3(a: Array, b: Array) -> float:
    """Return a . b of two vectors of three numbers."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled_in_place
def cross3(a: Array, b: Array, out: Array) -> None:
    """Write a x b into `out`, which may be `a` or `b`."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    out[0] = x
    out[1] = y


@compiled_in_place
def add_cross3(a: Array, b: Array, out: Array) -> None:
    """Add a x b to `out`, which must be neither."""
    out[0] += a[1] * b[2] - a[2] * b[1]
    out[1] += a[2] * b[0] - a[0] * b[2]
    out[2] += a[0] * b[1] - a[1] * b[0]


@compiled_in_place
def turned(R: Array, a: Array, out: Array) -> None:
    """Write R a into `out`, which must not be `a`; `R` has shape (3, 3)."""
    for i in range(3):
        out[i] = R[i, 0] * a[0] + R[i, 1] * a[1] + R[i, 2] * a[2]


@compiled_in_place
def turned_back(R: Array, a: Array, out: Array) -> None:
    """Write R^T a into `out`, which must not be `a`; `R` has shape (3, 3)."""
    for i in range(3):
        out[i] = R[0, i] * a[0] + R[1, i] * a[1] + R[2, i] * a[2]


@compiled_in_place
def product3(R: Array, turn: Array, out: Array) -> None:
    """Write the product R turn of two matrices (3, 3) into `out`, which must be neither."""
    for i in range(3):
        for j in range(3):
            out[i, j] = R[i, 0] * turn[0, j] + R[i, 1] * turn[1, j] + R[i, 2] * turn[2, j]
