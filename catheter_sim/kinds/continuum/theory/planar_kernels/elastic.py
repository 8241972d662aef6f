"""The elastic law of a planar cell, compiled."""

from __future__ import annotations

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.planar_kernels.columns import CUBIC, LENGTH, QUINTIC, REST, STIFFNESS
from catheter_sim.mechanics.compiled import compiled_in_place


@compiled_in_place
def hardening(cell: Array, k: int, bent: float) -> float:
    """Return by which factor cell k is stiffer, bent by the curvature `bent` [1/m], than at rest."""
    square = bent * bent
    return 1.0 + square * (cell[k, CUBIC] + square * cell[k, QUINTIC])


@compiled_in_place
def elastic_slope(cell: Array, k: int, angle: float) -> float:
    """Return the slope of the elastic moment of cell k at an angle [N m/rad]."""
    bent = angle / cell[k, LENGTH] - cell[k, REST]
    square = bent * bent
    law = 1.0 + square * (3.0 * cell[k, CUBIC] + 5.0 * square * cell[k, QUINTIC])
    return cell[k, STIFFNESS] / cell[k, LENGTH] * law
