"""Forces and slopes of a section of superelastic fibres."""

from __future__ import annotations

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled_in_place


@compiled_in_place
def fibre_forces(fibre: Array, metal: Array, stretch: float, kx: float, ky: float, out: Array) -> None:
    """Fill the section's forces and slopes: N, Mx, My, then N by e, kx, ky, Mx by kx, ky and My by ky."""
    for i in range(9):
        out[i] = 0.0
    modulus, tension, compression, lost = metal[0], metal[1], metal[2], metal[3]
    for i in range(fibre.shape[0]):
        x, y, area = fibre[i, 0], fibre[i, 1], fibre[i, 2]
        strain = stretch - x * ky + y * kx
        force, slope = modulus * area * strain, modulus * area
        if strain > tension:
            force -= lost * slope * (strain - tension)
            slope *= 1.0 - lost
        elif strain < -compression:
            force -= lost * slope * (strain + compression)
            slope *= 1.0 - lost
        out[0] += force
        out[1] += y * force
        out[2] -= x * force
        out[3] += slope
        out[4] += y * slope
        out[5] -= x * slope
        out[6] += y * y * slope
        out[7] -= x * y * slope
        out[8] += x * x * slope
