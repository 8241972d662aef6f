"""Linear systems of eights: eight small dense systems solved side by side."""

from __future__ import annotations

from typing import Any

from numba.extending import overload

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled_in_place
from catheter_sim.mechanics.eight import eight, select_less
from catheter_sim.mechanics.linear import solve_columns


@compiled_in_place
def _solve_columns_of_eights(matrix: Array, right: Array) -> bool:
    """Solve as `solve_columns` does; each of the eight systems has its own exchange of rows.

    A singular one gives numbers that are not finite. Returns True.
    """
    size, columns = right.shape
    for i in range(size):
        for k in range(i + 1, size):  # the largest pivot comes up to row i
            own, other = abs(matrix[i, i]), abs(matrix[k, i])
            for j in range(i, size):
                upper, lower = matrix[i, j], matrix[k, j]
                matrix[i, j] = select_less(own, other, lower, upper)
                matrix[k, j] = select_less(own, other, upper, lower)
            for j in range(columns):
                upper, lower = right[i, j], right[k, j]
                right[i, j] = select_less(own, other, lower, upper)
                right[k, j] = select_less(own, other, upper, lower)
        inverse = 1.0 / matrix[i, i]
        for k in range(i + 1, size):
            factor = matrix[k, i] * inverse
            for j in range(i + 1, size):
                matrix[k, j] -= factor * matrix[i, j]
            for j in range(columns):
                right[k, j] -= factor * right[i, j]
        matrix[i, i] = inverse
    for i in range(size - 1, -1, -1):
        for j in range(columns):
            total = right[i, j]
            for k in range(i + 1, size):
                total -= matrix[i, k] * right[k, j]
            right[i, j] = total * matrix[i, i]
    return True


def solve_columns_of_any(matrix: Any, right: Any) -> bool:
    """Solve matrix @ x = right for floats or eights; x replaces `right`; see `linear.solve_columns`."""
    return bool(solve_columns(matrix, right))


@overload(solve_columns_of_any, strict=False)
def _overload_solve_columns(matrix: Any, right: Any) -> Any:
    if matrix.dtype == eight:
        return lambda matrix, right: _solve_columns_of_eights(matrix, right)
    return lambda matrix, right: solve_columns(matrix, right)
