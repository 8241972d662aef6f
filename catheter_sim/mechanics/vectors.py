"""Vectors, turns and small linear equations in compiled loops."""

from __future__ import annotations

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled_in_place, inlined

# ----------------------------------------------------------------------------------------------------
# Vectors in compiled loops: none of these makes an array, and all write into the last one that they are
# given.
#
# NumPy's own expressions would be shorter, make an array each, and take LLVM ten times as long.


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


# ----------------------------------------------------------------------------------------------------
# Small dense linear systems in compiled loops, solved in place by Gauss's elimination.


@inlined
def _exchange_rows(matrix: Array, column: int) -> int:
    """Bring the row with the largest number in `column` up to row `column`; return where it was."""
    size = matrix.shape[0]
    best = column
    for k in range(column + 1, size):
        if abs(matrix[k, column]) > abs(matrix[best, column]):
            best = k
    if best != column:
        for j in range(size):
            matrix[column, j], matrix[best, j] = matrix[best, j], matrix[column, j]
    return best


@compiled_in_place
def solve_columns(matrix: Array, right: Array) -> bool:
    """Solve matrix @ x = right with exchange of rows; x replaces `right`, shape (m, c).

    Returns:
        False where `matrix`, shape (m, m), is singular; both are used up either way.
    """
    size, columns = right.shape
    for i in range(size):
        best = _exchange_rows(matrix, i)
        if not abs(matrix[i, i]) > 0.0:
            return False
        if best != i:
            for j in range(columns):
                right[i, j], right[best, j] = right[best, j], right[i, j]
        for k in range(i + 1, size):
            factor = matrix[k, i] / matrix[i, i]
            if factor != 0.0:
                for j in range(i + 1, size):
                    matrix[k, j] -= factor * matrix[i, j]
                for j in range(columns):
                    right[k, j] -= factor * right[i, j]
    for i in range(size - 1, -1, -1):
        for j in range(columns):
            total = right[i, j]
            for k in range(i + 1, size):
                total -= matrix[i, k] * right[k, j]
            right[i, j] = total / matrix[i, i]
    return True


@compiled_in_place
def solve_vector(matrix: Array, right: Array, smallest_pivot: float) -> bool:
    """Solve matrix @ x = right with exchange of rows; x replaces `right`, (m,); `matrix`, (m, m), is used up.

    A pivot below `smallest_pivot` is replaced by it, so that x is always something. Returns False where that
    is 0.0 and `matrix` singular: then `right` is of no use.
    """
    size = right.shape[0]
    for i in range(size):
        best = _exchange_rows(matrix, i)
        if abs(matrix[i, i]) < smallest_pivot:
            matrix[i, i] = smallest_pivot
        if smallest_pivot == 0.0 and not abs(matrix[i, i]) > 0.0:
            return False
        if best != i:
            right[i], right[best] = right[best], right[i]
        for k in range(i + 1, size):
            if matrix[k, i] != 0.0:
                factor = matrix[k, i] / matrix[i, i]
                for j in range(i + 1, size):
                    matrix[k, j] -= factor * matrix[i, j]
                right[k] -= factor * right[i]
    _substitute_back(matrix, right)
    return True


@compiled_in_place
def factorise(matrix: Array, exchanged: Index) -> bool:
    """Split `matrix` (m, m) for `solve_factorised`, in place; `exchanged` (m,) is set to the rows exchanged.

    Returns:
        False where `matrix` is singular: then it is of no use.
    """
    size = matrix.shape[0]
    for i in range(size):
        exchanged[i] = _exchange_rows(matrix, i)
        if not abs(matrix[i, i]) > 0.0:
            return False
        for k in range(i + 1, size):
            if matrix[k, i] != 0.0:
                matrix[k, i] /= matrix[i, i]
                for j in range(i + 1, size):
                    matrix[k, j] -= matrix[k, i] * matrix[i, j]
    return True


@compiled_in_place
def solve_factorised(matrix: Array, exchanged: Index, right: Array) -> None:
    """Solve for x what `factorise` was given, whose result is `matrix`; x replaces `right`, shape (m,)."""
    size = right.shape[0]
    for i in range(size):
        right[i], right[exchanged[i]] = right[exchanged[i]], right[i]
    for k in range(size):
        for j in range(k):
            right[k] -= matrix[k, j] * right[j]
    _substitute_back(matrix, right)


@compiled_in_place
def solve_lower(matrix: Array, right: Array) -> bool:
    """Solve matrix @ x = right, nothing above the diagonal being read; x replaces `right`, shape (m,).

    Returns:
        False where `matrix`, shape (m, m), is singular.
    """
    for k in range(right.shape[0]):
        if not abs(matrix[k, k]) > 0.0:
            return False
        for j in range(k):
            right[k] -= matrix[k, j] * right[j]
        right[k] /= matrix[k, k]
    return True


@compiled_in_place
def solve_definite(matrix: Array, right: Array) -> None:
    """Solve matrix @ x = right without exchange of rows; x replaces `right`, shape (m,).

    So it is done where `matrix`, shape (m, m), is positive definite, or has rows of the unit matrix besides.
    """
    size = right.shape[0]
    for i in range(size):
        for k in range(i + 1, size):
            factor = matrix[k, i] / matrix[i, i]
            if factor != 0.0:
                for j in range(i + 1, size):
                    matrix[k, j] -= factor * matrix[i, j]
                right[k] -= factor * right[i]
    _substitute_back(matrix, right)


@inlined
def _substitute_back(matrix: Array, right: Array) -> None:
    """Solve the system that elimination has left above the diagonal."""
    for i in range(right.shape[0] - 1, -1, -1):
        for j in range(i + 1, right.shape[0]):
            right[i] -= matrix[i, j] * right[j]
        right[i] /= matrix[i, i]
