"""What each disk lacks to balance, compiled.

The unknowns are the wrenches at the sections' starts, each in the frame of its start, so that a section's
pose does not depend on those before it. What is left over at disk j, in the disk's frame, is

    wrench at the start of section j + 1 - wrench at the end of section j + tendons + loads,

(Rao 2021, Eqs 40-41) and depends on the two sections next to the disk and, through loads that keep their
direction in space, on the disk's orientation.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.columns import (
    CONTINUOUS,
    LENGTH,
    LUMENS,
    PROJECTED,
    STEPS,
)
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.lanes import (
    BODY,
    COLUMNS,
    COMPLIANCE,
    INVERSE,
    LOW,
    LOW_SLOPE,
    STEP,
    STIFFNESS,
    STRAIN,
    TENDONS,
    TRIAL,
    TURN,
    WRENCH,
)
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.section import integrate, set_body_wrenches
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.tendon_forces import add_path_forces, add_span_pulls
from catheter_sim.mechanics.arrays import Array
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.eight import LANES, eights
from catheter_sim.mechanics.vectors import turned_back


@compiled
def sections(
    path: int,
    rod: Array,
    hole: Array,
    span: Array,
    wrench: Array,
    strain: Array,
    inverse: Array,
    derive: bool,
    w: Array,
    turn: Array,
    shift: Array,
    turn_slope: Array,
    end: Array,
    here: Array,
    low: Array,
    low_slope: Array,
) -> None:
    """Set the sections' poses, wrenches at their ends, `end` (n, 6), and pulls on their lower disks.

    `end` holds the pulls on the upper disks, too: what it leaves over there has the sign reversed. With
    `derive` also their derivatives by the wrenches at the starts: `turn_slope` (n, 3, 6), `here`, that
    of -end, and `low_slope`, (n, 6, 6). `strain` and `inverse` are those of `start_laws`.
    """
    tendons, n = span.shape
    along = path in (CONTINUOUS, LUMENS)
    columns = 6 if derive else 0
    side_by_side = eights(w.reshape(-1, LANES))
    for first in range(0, n, LANES):
        steps = 1
        for i in range(LANES):
            steps = max(steps, int(rod[min(first + i, n - 1), STEPS]))
        for i in range(LANES):
            j = min(first + i, n - 1)
            for q in range(6):
                w[(WRENCH + q) * LANES + i] = wrench[j, q]
                w[(COMPLIANCE + q) * LANES + i] = rod[j, q]
            w[STEP * LANES + i] = rod[j, LENGTH] / steps
            for k in range(tendons):
                w[(TENDONS + 3 * k) * LANES + i] = span[k, j]
            if along:
                for q in range(6):
                    w[(STIFFNESS + q) * LANES + i] = 1.0 / rod[j, q] if rod[j, q] > 0.0 else 0.0
                    w[(STRAIN + q) * LANES + i] = strain[j, q]
                    for c in range(6):
                        w[(INVERSE + 6 * q + c) * LANES + i] = inverse[j, q, c]
            else:
                for k in range(tendons):
                    both = below = 0.0
                    if path == PROJECTED and span[k, j] > 0.0:
                        if j > 0:
                            below = 0.5 * (span[k, j - 1] + span[k, j])
                        if j + 1 < n and span[k, j + 1] > 0.0:
                            both = 0.5 * (span[k, j] + span[k, j + 1])
                    w[(TENDONS + 3 * k + 1) * LANES + i] = span[k, j] - below
                    w[(TENDONS + 3 * k + 2) * LANES + i] = span[k, j] - both
        integrate(side_by_side, hole, steps, along, columns)
        set_body_wrenches(side_by_side, columns)
        if not along:
            add_span_pulls(side_by_side, hole, columns)
        for i in range(min(LANES, n - first)):
            j = first + i
            for q in range(3):
                shift[j, q] = w[(TRIAL + 4 + q) * LANES + i]
                for c in range(3):
                    turn[j, q, c] = w[(TURN + 3 * q + c) * LANES + i]
            for q in range(6):
                end[j, q] = w[(BODY + q) * LANES + i]
                low[j, q] = w[(LOW + q) * LANES + i] if not along else 0.0
            if not derive:
                continue
            for q in range(3):
                for c in range(6):
                    turn_slope[j, q, c] = w[(TRIAL + 7 + 6 * q + c) * LANES + i]
            for q in range(6):
                for c in range(6):
                    here[j, q, c] = -w[(COLUMNS + 6 * q + c) * LANES + i]
                    low_slope[j, q, c] = w[(LOW_SLOPE + 6 * q + c) * LANES + i] if not along else 0.0


@compiled
def left_over(
    path: int,
    rod: Array,
    hole: Array,
    span: Array,
    applied: Array,
    wrench: Array,
    strain: Array,
    inverse: Array,
    derive: bool,
    w: Array,
    turn: Array,
    shift: Array,
    turn_slope: Array,
    R_w: Array,
    residual: Array,
    here: Array,
    above: Array,
    load: Array,
    end: Array,
    low: Array,
) -> None:
    """Set the residual at the disks, (n, 6), and the sections' poses; with `derive` the derivatives, too.

    `here`, `above`, shapes (n, 6, 6), and `load`, shape (n, 6, 3), are the residual's derivatives by the
    wrench of the section below and above and by the disk's turn. `R_w`: orientations of disks 0 to n.
    """
    tendons, n = span.shape
    sections(
        path, rod, hole, span, wrench, strain, inverse, derive, w,
        turn, shift, turn_slope, end, here, low, above,
    )  # fmt: skip
    body, column = np.empty(6), np.empty(6)
    kinks = path == CONTINUOUS
    along, pull, against = np.empty(tendons), np.empty(tendons), np.empty(tendons)
    by_end, by_start = np.empty((6, 6)), np.empty((6, 6))
    for j in range(n):
        for i in range(3):
            for k in range(3):
                R_w[j + 1, i, k] = (
                    R_w[j, i, 0] * turn[j, 0, k] + R_w[j, i, 1] * turn[j, 1, k] + R_w[j, i, 2] * turn[j, 2, k]
                )
        # Loads that keep their direction: R^T F turns by F_body x (turn of the disk).
        turned_back(R_w[j + 1], applied[j, :3], body[:3])
        turned_back(R_w[j + 1], applied[j, 3:], body[3:])
        for i in range(6):
            residual[j, i] = body[i] - end[j, i]
        if j + 1 < n:
            for i in range(6):
                residual[j, i] += wrench[j + 1, i] + low[j + 1, i]
        if derive:
            for half in (0, 3):
                load[j, half, 0] = load[j, half + 1, 1] = load[j, half + 2, 2] = 0.0
                load[j, half, 1], load[j, half, 2] = -body[half + 2], body[half + 1]
                load[j, half + 1, 0], load[j, half + 1, 2] = body[half + 2], -body[half]
                load[j, half + 2, 0], load[j, half + 2, 1] = -body[half + 1], body[half]
            for i in range(6):  # `above` so far: the pulls of section j on its lower disk
                for c in range(6):
                    above[j, i, c] = above[j + 1, i, c] if j + 1 < n else 0.0
                if j + 1 < n:
                    above[j, i, i] += 1.0
        if kinks and j + 1 < n:
            kinked = False
            for k in range(tendons):
                kinked = kinked or (span[k, j] > 0.0 and span[k, j + 1] == 0.0)
            for i in range(6):
                kinked = kinked or rod[j, i] != rod[j + 1, i] or applied[j, i] != 0.0
            if kinked:
                for k in range(tendons):
                    along[k], pull[k], against[k] = span[k, j], span[k, j + 1], -span[k, j + 1]
                add_path_forces(rod[j], hole, along, pull, end[j], residual[j], by_end, derive)
                add_path_forces(rod[j + 1], hole, pull, against, wrench[j + 1], residual[j], by_start, derive)
                if derive:  # so far `here` holds what the end's wrench changes by, with its sign reversed
                    for c in range(6):
                        for i in range(6):
                            total = 0.0
                            for k in range(6):
                                total += by_end[i, k] * here[j, k, c]
                            column[i] = total
                        for i in range(6):
                            here[j, i, c] -= column[i]
                            above[j, i, c] += by_start[i, c]
