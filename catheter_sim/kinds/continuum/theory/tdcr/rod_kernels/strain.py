"""The elastic law of a rod with tendons along it, compiled: strains under a wrench."""

from __future__ import annotations

import math

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.eight import all_less, all_zero, larger, room
from catheter_sim.mechanics.linear_eights import solve_columns_of_any

_ROUNDS = 30
_TOLERANCE = 1e-8  # a correction below it is the last: what it leaves is smaller than its square


@compiled
def path_direction(strain: Array, hole: Array, out: Array) -> None:
    """Direction v + u x r of a tendon's path along the rod (Rao 2021, Eq. 27)."""
    out[0] = strain[3] - strain[2] * hole[1]
    out[1] = strain[4] + strain[2] * hole[0]
    out[2] = 1.0 + strain[5] + strain[0] * hole[1] - strain[1] * hole[0]


@compiled
def strain_of(
    compliance: Array, hole: Array, tension: Array, wrench: Array, strain: Array, stiffness: Array
) -> None:
    """Find the strain under a wrench, starting from `strain`, with its stiffness there.

    Args:
        compliance: shape (>= 6,); zero locks a strain.
        hole: of the tendons along the stretch, shape (t, 2) [m].
        tension: of each; zero where it does not run here, shape (t,) [N].
        wrench: of the rod and these tendons together, shape (6,).
        strain: start and result, shape (6,).
        stiffness: derivative of the wrench by the strain, shape (6, 6), result; a locked strain has 1
            on the diagonal and 0 elsewhere.
    """
    right, matrix = room((6, 1), wrench), room((6, 6), wrench)
    gradient, tangent = room((6,), wrench), room((3, 6), wrench)
    for _ in range(_ROUNDS):
        for i in range(6):
            for j in range(6):
                stiffness[i, j] = 0.0
            if compliance[i] > 0.0:
                stiffness[i, i] = 1.0 / compliance[i]
                gradient[i] = strain[i] / compliance[i] - wrench[i]
            else:
                strain[i] = 0.0
                gradient[i] = 0.0
        for k in range(len(tension)):
            if all_zero(tension[k]):
                continue
            x, y = hole[k, 0], hole[k, 1]
            gx = strain[3] - strain[2] * y
            gy = strain[4] + strain[2] * x
            gz = 1.0 + strain[5] + strain[0] * y - strain[1] * x
            length = math.sqrt(gx * gx + gy * gy + gz * gz)
            gx, gy, gz = gx / length, gy / length, gz / length
            # Rows of `tangent`: derivative of the path's direction by the strains, times its length.
            for i in range(3):
                for j in range(6):
                    tangent[i, j] = 0.0
                tangent[i, 3 + i] = 1.0
            tangent[0, 2], tangent[1, 2], tangent[2, 0], tangent[2, 1] = -y, x, y, -x
            for j in range(6):
                along = gx * tangent[0, j] + gy * tangent[1, j] + gz * tangent[2, j]
                if compliance[j] > 0.0:
                    gradient[j] += tension[k] * along
                    for i in range(6):
                        if compliance[i] > 0.0:
                            other = gx * tangent[0, i] + gy * tangent[1, i] + gz * tangent[2, i]
                            product = (
                                tangent[0, i] * tangent[0, j]
                                + tangent[1, i] * tangent[1, j]
                                + tangent[2, i] * tangent[2, j]
                            )
                            stiffness[i, j] += tension[k] / length * (product - other * along)
        for i in range(6):
            if compliance[i] == 0.0:
                stiffness[i, i] = 1.0
            right[i, 0] = -gradient[i]
            for j in range(6):
                matrix[i, j] = stiffness[i, j]
        if not solve_columns_of_any(matrix, right):
            return
        largest = abs(right[0, 0])
        for i in range(6):
            strain[i] += right[i, 0]
            largest = larger(largest, abs(right[i, 0]))
        if all_less(largest, _TOLERANCE):
            return


@compiled
def _inverse_of(stiffness: Array, compliance: Array, inverse: Array) -> None:
    """Set the inverse of a law's stiffness, (6, 6); rows and columns of locked strains are zero."""
    for i in range(6):
        for c in range(6):
            inverse[i, c] = 1.0 if i == c else 0.0
    solve_columns_of_any(stiffness, inverse)
    for i in range(6):
        if compliance[i] == 0.0:
            for c in range(6):
                inverse[i, c] = inverse[c, i] = 0.0


@compiled
def start_laws(rod: Array, hole: Array, span: Array, wrench: Array, strain: Array, inverse: Array) -> None:
    """Set each section's strain at its start, (n, 6), and the inverse of its stiffness there, (n, 6, 6).

    A section like the one before with the same tensions takes over that one's: they only have to be near.
    """
    tendons, n = span.shape
    along, stiffness = room((tendons,), wrench), room((6, 6), wrench)
    for j in range(n):
        same = j > 0
        for k in range(tendons):
            along[k] = span[k, j]
            same = same and all_zero(span[k, j] - span[k, j - 1])
        for i in range(6):
            same = same and rod[j, i] == rod[j - 1, i]
        for i in range(6):
            strain[j, i] = strain[j - 1, i] if same else 0.0
        if same:
            for i in range(6):
                for c in range(6):
                    inverse[j, i, c] = inverse[j - 1, i, c]
        else:
            strain_of(rod[j], hole, along, wrench[j], strain[j], stiffness)
            _inverse_of(stiffness, rod[j], inverse[j])
