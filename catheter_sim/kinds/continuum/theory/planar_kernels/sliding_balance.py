"""What the balance of each cell lacks where tendons slide through all eyelets, compiled.

Arrays. `cell`: see `columns`. `offset`, shape (t,), of tendons in the order of their ends, the one that
ends at the tip first; `passing`, shape (n,): how many of them pass each cell. `slip`, `pulled`, shape (n,
t): as in `sliding`, and tensions [N]. `drive`, shape (t + 3,): tensions at the actuators, force along x and
z on the tip, moment about y there.
"""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.planar_kernels.columns import (
    LENGTH,
    PRE_SLIDING_RAD,
    REST,
    STIFFNESS,
)
from catheter_sim.kinds.continuum.theory.planar_kernels.elastic import hardening
from catheter_sim.kinds.continuum.theory.planar_kernels.loads import find_load_moments
from catheter_sim.mechanics.compiled import compiled


@compiled
def evaluate(
    cell: Array,
    offset: Array,
    passing: np.ndarray,
    mu: float,
    weight: Array,
    drive: Array,
    loaded: bool,
    drag: float,
    start: Array,
    start_half: Array,
    start_slip: Array,
    angles: Array,
    slip: Array,
    pulled: Array,
    half: Array,
    lack: Array,
    outer: Array,
) -> float:
    """Fill slip, tensions, `half` (cosine and sine of half the angles) and what each cell's balance lacks.

    `start`, `start_half` and `start_slip` are where the step began. Returns the norm of `lack` [N m].
    """
    n, t = slip.shape
    drawn_in, tension = np.zeros(t), np.empty(t)
    arm = 1e-9
    for j in range(t):
        arm = max(arm, abs(offset[j]))
        tension[j] = drive[j]
    pre_sliding = PRE_SLIDING_RAD * arm
    for k in range(n - 1, -1, -1):
        cosine, sine = math.cos(0.5 * angles[k]), math.sin(0.5 * angles[k])
        half[k, 0], half[k, 1] = cosine, sine
        shorter = cell[k, LENGTH] * (start_half[k, 0] - cosine)
        turned = 2.0 * (sine - start_half[k, 1])
        for j in range(passing[k]):
            drawn_in[j] += shorter + offset[j] * turned
            slip[k, j] = min(max(start_slip[k, j] + drawn_in[j] / pre_sliding, -1.0), 1.0)
    if loaded:
        find_load_moments(cell, weight, drive[t:], angles, lack, outer)
    angle_before, squares = 0.0, 0.0
    for k in range(n):
        angle = angles[k]
        lost = 0.5 * mu * abs(angle_before + angle)
        angle_before = angle
        drop = math.exp(-lost)
        rise = 1.0 / drop
        across, along = 0.0, 0.0
        for j in range(passing[k]):
            state = slip[k, j]
            if state == 1.0:
                tension[j] *= drop
            elif state == -1.0:
                tension[j] *= rise
            else:
                tension[j] *= math.exp(-state * lost)
            pulled[k, j] = tension[j]
            across += tension[j] * offset[j]
            along += tension[j]
        bent = angle / cell[k, LENGTH] - cell[k, REST]
        value = across * half[k, 0] + 0.5 * cell[k, LENGTH] * along * half[k, 1]
        value -= cell[k, STIFFNESS] * bent * hardening(cell, k, bent) + drag * (angle - start[k])
        lack[k] = lack[k] + value if loaded else value
        squares += lack[k] * lack[k]
    return math.sqrt(squares)
