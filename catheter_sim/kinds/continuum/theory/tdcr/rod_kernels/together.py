"""Eight rows of loads balanced together from rest, in one step and without friction, compiled.

The same residuals and derivatives as in `newton`, with eight robots side by side, and the same conditions on
its corrections. A row that breaks one is left to `continuation`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.balance import left_over
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.columns import CONTINUOUS, LUMENS
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.continuation import (
    FARTHEST_RAD,
    set_straight,
    unbent_wrenches,
)
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.lanes import TENDONS
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.newton import (
    AT_THE_END_RAD,
    CONTRACTION,
    FRESH_CONTRACTION,
    MOST_ROUNDS,
    ON_THE_WAY_RAD,
    SMALL_TURN_RAD,
    correction,
    factorized,
)
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.sections import sections_of_eights
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.strain import start_laws
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.eight import (
    LANES,
    all_less,
    eights,
    floats_of_eights,
    lane,
    larger,
    room,
    select_less,
    take_lane,
)
from catheter_sim.mechanics.vectors import fill


@compiled
def follow_together(
    path: int, rough: Array, fine: Array, hole: Array, last: NDArray[np.intp], chosen: NDArray[np.intp],
    tension: Array, applied: Array, wrench: Array, span: Array, shift: Array, R_w: Array, residual: Array,
    reached: Array, corrections: NDArray[np.intp],
) -> None:  # fmt: skip
    """Find the equilibria of some rows; arguments as of `continuation.follow`.

    Args:
        chosen: numbers of the rows, a multiple of LANES of them.
        reached: result, 1 where a row is balanced; the other rows are left as they were.
    """
    tendons, n = len(hole), len(rough)
    wrenches, spans = floats_of_eights((n, 6)), floats_of_eights((tendons, n))
    shifts, turns, lefts = floats_of_eights((n, 3)), floats_of_eights((n + 1, 3, 3)), floats_of_eights((n, 6))
    loads, pulls = floats_of_eights((n, 6)), floats_of_eights((tendons,))
    x, s, p, R = eights(wrenches), eights(spans), eights(shifts), eights(turns)
    r, f, t = eights(lefts), eights(loads), eights(pulls)
    turn, angle, turn_slope = room((n, 3, 3), x), room((tendons, n), x), room((n, 3, 6), x)
    here, above, load = room((n, 6, 6), x), room((n, 6, 6), x), room((n, 6, 3), x)
    by_tip, last_turn, step = room((n, 6, 3), x), room((3, 3), x), room((n, 6), x)
    end, low, strain, inverse = room((n, 6), x), room((n, 6), x), room((n, 6), x), room((n, 6, 6), x)
    turned, v = room((3,), x), room((TENDONS + 3 * tendons,), x)
    fill(v, 0.0)
    for first in range(0, len(chosen), LANES):
        for i in range(LANES):
            row = chosen[first + i]
            for k in range(tendons):
                pulls[k, i] = tension[row, k]
            for j in range(n):
                for c in range(6):
                    loads[j, c, i] = applied[row, j, c]
        fill(turns, 0.0)
        for c in range(3):
            R[0, c, c] = 1.0
        set_straight(rough, x, angle, turn, p, R)
        unbent_wrenches(path, hole, last, 0.0, angle, t, f, turn, p, R, x)
        for k in range(tendons):
            for j in range(n):
                s[k, j] = t[k] if j < last[k] else 0.0 * t[k]
        if path in (CONTINUOUS, LUMENS):
            start_laws(rough, hole, s, x, strain, inverse)
        finishing, derive, slopes = False, True, rough
        failed = 0.0 * t[0]  # above zero: this row has broken a condition
        largest = failed + 1e300
        rounds = 0
        while True:
            rod = fine if finishing and not derive else slopes
            sections_of_eights(
                path, rod, hole, s, x, strain, inverse, derive, v, turn, p, turn_slope, end, here, low, above,
            )  # fmt: skip
            left_over(path, rod, hole, s, f, x, derive, turn, R, r, here, above, load, end, low)
            # Only rows that have not failed are waited for.
            open_turn = select_less(0.0, failed, 0.0, largest)
            if finishing and not derive and all_less(open_turn, AT_THE_END_RAD):
                break
            if rounds >= MOST_ROUNDS:
                break
            if derive:
                factorized(turn, turn_slope, here, above, load, by_tip, last_turn)
                derive = not finishing
            correction(turn, turn_slope, r, here, above, load, by_tip, last_turn, step)
            rounds += 1
            before = largest
            largest = 0.0 * before
            for j in range(n):
                for i in range(3):
                    turned[i] = 0.0
                    for c in range(6):
                        turned[i] += turn_slope[j, i, c] * step[j, c]
                largest += math.sqrt(turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2])
            # Not a number is not below anything.
            failed = select_less(largest, FARTHEST_RAD, failed, 1.0)
            limit = larger(CONTRACTION * before, SMALL_TURN_RAD)
            failed = select_less(limit, largest, 1.0, failed)
            for j in range(n):
                for i in range(6):
                    x[j, i] += select_less(0.0, failed, 0.0, step[j, i])
            open_turn = select_less(0.0, failed, 0.0, largest)
            if finishing:
                slow = select_less(AT_THE_END_RAD, open_turn, open_turn - FRESH_CONTRACTION * before, -1.0)
                if not all_less(slow, 0.0):
                    derive, slopes = True, fine
            elif all_less(open_turn, ON_THE_WAY_RAD):
                finishing, derive, largest = True, False, 0.0 * largest + 1e300
        for i in range(LANES):
            row = chosen[first + i]
            if lane(failed, i) > 0.0 or not lane(largest, i) < AT_THE_END_RAD:
                continue
            reached[row], corrections[row] = 1.0, rounds
            take_lane(wrenches, i, wrench[row])
            take_lane(spans, i, span[row])
            take_lane(shifts, i, shift[row])
            take_lane(turns, i, R_w[row])
            take_lane(lefts, i, residual[row])
