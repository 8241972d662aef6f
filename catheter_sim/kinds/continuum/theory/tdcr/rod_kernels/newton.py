"""Newton's method for the sections' wrenches, compiled.

One sweep from the tip solves the linear system: every correction is linear in the tip's small turn, which the
fixed base then gives. The derivative is taken with few integration steps. Once a correction is small, the
residual is taken with many steps, without a derivative, and corrected by the last derivative until nothing
changes.
"""

from __future__ import annotations

import math

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.balance import left_over
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.columns import CONTINUOUS, LUMENS
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.sections import sections
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.strain import start_laws
from catheter_sim.mechanics.compiled import compiled, inlined
from catheter_sim.mechanics.eight import room
from catheter_sim.mechanics.linear_eights import solve_columns_of_any
from catheter_sim.mechanics.vectors import fill, turned

CONVERGED, SINGULAR, DIVERGED, TOO_FAR = range(4)  # how it ended
ON_THE_WAY_RAD = 3e-3  # turn of the last correction before the end of the way
AT_THE_END_RAD = 1e-10
MOST_ROUNDS = 14
# A correction may be this share of the one before, unless both are small: otherwise the step was too long
# to be sure of the equilibrium that it finds.
CONTRACTION = 0.5
FRESH_CONTRACTION = 0.05  # a slower one asks for another derivative
SMALL_TURN_RAD = 1e-7


@compiled
def factorized(
    turn: Array, turn_slope: Array, here: Array, above: Array, load: Array, by_tip: Array, last: Array
) -> bool:
    """Prepare `correction`: here -> its inverse, above -> -inverse above, load -> -inverse load.

    `by_tip`, (n, 6, 3), becomes the corrections by the tip's small turn, and `last`, (3, 3), the inverse of
    what that turns the base by. Returns False where the system is singular.
    """
    n = len(here)
    matrix, unit = room((6, 6), here), room((6, 6), here)
    disk, below = room((3, 3), here), room((3, 3), here)
    fill(disk, 0.0)
    disk[0, 0] = disk[1, 1] = disk[2, 2] = 1.0
    for j in range(n - 1, -1, -1):
        for i in range(6):
            for c in range(6):
                matrix[i, c] = here[j, i, c]
                here[j, i, c] = 1.0 if i == c else 0.0
        if not solve_columns_of_any(matrix, here[j]):
            return False
        for i in range(6):
            for c in range(6):
                total = 0.0
                for k in range(6):
                    total -= here[j, i, k] * above[j, k, c]
                unit[i, c] = total
            for c in range(3):
                total = 0.0
                for k in range(6):
                    total -= here[j, i, k] * load[j, k, c]
                by_tip[j, i, c] = total
        for i in range(6):
            for c in range(6):
                above[j, i, c] = unit[i, c]
            for c in range(3):
                load[j, i, c] = by_tip[j, i, c]
        for i in range(6):
            for c in range(3):
                total = 0.0
                for k in range(3):
                    total += load[j, i, k] * disk[k, c]
                if j + 1 < n:
                    for k in range(6):
                        total += above[j, i, k] * by_tip[j + 1, k, c]
                by_tip[j, i, c] = total
        for i in range(3):
            for c in range(3):
                total = disk[i, c]
                for k in range(6):
                    total -= turn_slope[j, i, k] * by_tip[j, k, c]
                below[i, c] = total
        for c in range(3):
            for i in range(3):
                disk[i, c] = turn[j, i, 0] * below[0, c] + turn[j, i, 1] * below[1, c]
                disk[i, c] += turn[j, i, 2] * below[2, c]
    for i in range(3):
        for c in range(3):
            last[i, c] = 1.0 if i == c else 0.0
    return bool(solve_columns_of_any(disk, last))


@compiled
def correction(
    turn: Array, turn_slope: Array, residual: Array, inverse: Array, above: Array, load: Array,
    by_tip: Array, last: Array, step: Array,
) -> None:  # fmt: skip
    """Set Newton's correction of the wrenches, `step` (n, 6), by what `_factorized` left."""
    n = len(residual)
    disk, below, tip = room((3,), residual), room((3,), residual), room((3,), residual)
    fill(disk, 0.0)
    for j in range(n - 1, -1, -1):
        for i in range(6):
            total = 0.0
            for k in range(6):
                total -= inverse[j, i, k] * residual[j, k]
            for k in range(3):
                total += load[j, i, k] * disk[k]
            if j + 1 < n:
                for k in range(6):
                    total += above[j, i, k] * step[j + 1, k]
            step[j, i] = total
        for i in range(3):
            total = disk[i]
            for k in range(6):
                total -= turn_slope[j, i, k] * step[j, k]
            below[i] = total
        turned(turn[j], below, disk)
    for i in range(3):
        tip[i] = -(last[i, 0] * disk[0] + last[i, 1] * disk[1] + last[i, 2] * disk[2])
    for j in range(n):
        for i in range(6):
            for c in range(3):
                step[j, i] += by_tip[j, i, c] * tip[c]


@inlined
def newton(
    path: int,
    rough: Array,
    fine: Array,
    hole: Array,
    span: Array,
    applied: Array,
    wrench: Array,
    turn: Array,
    shift: Array,
    R_w: Array,
    to_the_end: bool,
    farthest: float,
    residual: Array,
    w: Array,
) -> tuple[int, int, float]:
    """Balance a robot at given tensions, starting from `wrench`, which is the result too.

    Args:
        path: CONTINUOUS, PROJECTED, EYELETS or LUMENS.
        rough, fine: sections' data with few and many integration steps, shape (n, 8).
        hole: shape (t, 2) [m].
        span: tension of every tendon along every section, zero beyond its end, shape (t, n) [N].
        applied: moment and force on disks 1 to n, base frame, shape (n, 6).
        wrench: at the sections' starts, in their frames, shape (n, 6).
        turn, shift: result, the sections' poses, shapes (n, 3, 3) and (n, 3).
        R_w: result, orientations of disks 0 to n, shape (n + 1, 3, 3); the first one is given.
        to_the_end: whether to balance the fine residual, instead of the rough one by and large.
        farthest: what a correction may turn the sections by, summed [rad].
        residual: result, unbalanced wrench at disks 1 to n, shape (n, 6).
        w: workspace.

    Returns:
        How it ended, the number of corrections, and what the first one turned the sections by [rad].
    """
    n = span.shape[1]
    turn_slope = room((n, 3, 6), wrench)
    here, above, load = room((n, 6, 6), wrench), room((n, 6, 6), wrench), room((n, 6, 3), wrench)
    by_tip, last = room((n, 6, 3), wrench), room((3, 3), wrench)
    step, end, low = room((n, 6), wrench), room((n, 6), wrench), room((n, 6), wrench)
    strain, inverse = room((n, 6), wrench), room((n, 6, 6), wrench)
    if path in (CONTINUOUS, LUMENS):
        start_laws(rough, hole, span, wrench, strain, inverse)
    largest = math.inf
    rounds = 0
    first = 0.0
    finishing, derive, slopes = False, True, rough
    while True:
        here_rod = fine if finishing and not derive else slopes
        sections(
            path, here_rod, hole, span, wrench, strain, inverse, derive, w,
            turn, shift, turn_slope, end, here, low, above,
        )  # fmt: skip
        left_over(
            path, here_rod, hole, span, applied, wrench, derive, turn, R_w, residual, here, above, load,
            end, low,
        )  # fmt: skip
        now = 0.0
        for j in range(n):
            for i in range(6):
                now += abs(residual[j, i])
        if not math.isfinite(now):
            return DIVERGED, rounds, first
        if not derive and (largest < AT_THE_END_RAD or now == 0.0):
            return CONVERGED, rounds, first
        if rounds >= MOST_ROUNDS:
            return DIVERGED, rounds, first
        if derive:
            if not factorized(turn, turn_slope, here, above, load, by_tip, last):
                return SINGULAR, rounds, first
            derive = not finishing
        correction(turn, turn_slope, residual, here, above, load, by_tip, last, step)
        rounds += 1
        before = largest
        largest = 0.0
        for j in range(n):
            square = 0.0
            for i in range(3):
                turned = 0.0
                for c in range(6):
                    turned += turn_slope[j, i, c] * step[j, c]
                square += turned * turned
            largest += math.sqrt(square)
        if rounds == 1:
            first = largest
        if not largest < farthest:
            return TOO_FAR, rounds, first
        if largest > SMALL_TURN_RAD and largest > CONTRACTION * before:
            return DIVERGED, rounds, first
        for j in range(n):
            for i in range(6):
                wrench[j, i] += step[j, i]
        if finishing:
            if largest > AT_THE_END_RAD and largest > FRESH_CONTRACTION * before:
                derive, slopes = True, fine
        elif largest < ON_THE_WAY_RAD:
            if not to_the_end:
                return CONVERGED, rounds, first
            finishing, derive, largest = True, False, math.inf
