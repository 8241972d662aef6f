"""Small dense linear systems in compiled loops, solved in place by Gauss's elimination."""

from __future__ import annotations

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled_in_place, inlined


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
    """Solve matrix @ x = right with exchange of rows; x replaces `right`, shape (m,).

    Args:
        matrix: shape (m, m), used up.
        right: shape (m,).
        smallest_pivot: a smaller pivot is replaced by it, so that x is always something; with 0.0 none is.

    Returns:
        False where no pivot is replaced and `matrix` is singular: then `right` is of no use.
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
