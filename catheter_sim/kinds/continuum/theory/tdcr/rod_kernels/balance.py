"""What each disk lacks to balance, compiled.

The unknowns are the wrenches at the sections' starts, each in the frame of its start, so that a section's
pose does not depend on those before it. What is left over at disk j, in the disk's frame, is

    wrench at the start of section j + 1 - wrench at the end of section j + tendons + loads,

(Rao 2021, Eqs 40-41) and depends on the two sections next to the disk and, through loads that keep their
direction in space, on the disk's orientation.
"""

from __future__ import annotations

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.columns import CONTINUOUS
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.tendon_forces import add_path_forces
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.eight import all_zero, room
from catheter_sim.mechanics.vectors import turned_back


@compiled
def left_over(
    path: int,
    rod: Array,
    hole: Array,
    span: Array,
    applied: Array,
    wrench: Array,
    derive: bool,
    turn: Array,
    R_w: Array,
    residual: Array,
    here: Array,
    above: Array,
    load: Array,
    end: Array,
    low: Array,
) -> None:
    """Set the residual at the disks, (n, 6), and their orientations; with `derive` the derivatives, too.

    The sections are as `sections.sections` left them. `here`, `above`, shapes (n, 6, 6), and `load`, shape
    (n, 6, 3), are the residual's derivatives by the wrench of the section below and above and by the disk's
    turn. `R_w`: orientations of disks 0 to n.
    """
    tendons, n = span.shape
    body, column = room((6,), wrench), room((6,), wrench)
    kinks = path == CONTINUOUS
    along, pull, against = room((tendons,), wrench), room((tendons,), wrench), room((tendons,), wrench)
    by_end, by_start = room((6, 6), wrench), room((6, 6), wrench)
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
                kinked = kinked or (not all_zero(span[k, j]) and all_zero(span[k, j + 1]))
            for i in range(6):
                kinked = kinked or rod[j, i] != rod[j + 1, i] or not all_zero(applied[j, i])
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
