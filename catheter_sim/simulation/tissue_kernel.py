"""Inner loop of tissue's springs, compiled: which contacts press, and their rows; see `simulation.tissue`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled

SAME = 0.99  # cosine: two contacts with normals nearer to each other than 8 deg press once
NOTHING = 1e-12  # in place of D: a contact that presses with nothing


@compiled
def press(
    rows: NDArray[np.int32],
    pair: NDArray[np.int32],
    distance: Array,
    frame: Array,
    is_robot: NDArray[np.bool_],
    region: Index,
    facing: Array,
    stiffness: Array,
    timestep: float,
    velocity: Array,
    strength: Array,
    resistance: Array,
    reference: Array,
    pressing: Index,
    pressed: Index,
) -> int:
    """Rewrite the contacts' rows; return how many press.

    Args:
        rows: of each contact, -1 where it has none, shape (n,).
        pair: geoms of each contact, shape (n, 2).
        distance: of the surfaces, below zero where they overlap, shape (n,) [m].
        frame: first the normal, from the first geom to the second, shape (n, 9).
        is_robot, region: of each geom; region -1 is no tissue, shape (g,).
        facing: of each geom the unit normal of its free face, or zeros where all of it is free, (g, 3).
        stiffness: of each region, shape (r,) [N/m].
        timestep: [s].
        velocity, strength, resistance, reference: of the rows: speed from each other [m/s], D, R, a_ref; the
            last three are written.
        pressing, pressed: written: the rows that press, and their regions, shape (n,).
    """
    count = 0
    order = np.argsort(distance)
    kept = np.zeros(len(order), dtype=np.int64)
    normal = np.zeros((len(order), 3))
    for contact in order:
        row = rows[contact]
        first, second = pair[contact, 0], pair[contact, 1]
        robot, tissue, sign = first, second, -1.0
        if not is_robot[first]:
            robot, tissue, sign = second, first, 1.0
        if row < 0 or region[tissue] < 0:
            continue
        for axis in range(3):
            normal[contact, axis] = sign * frame[contact, axis]
        presses, deepest = True, True
        for number in range(count):
            other = kept[number]
            touched = pair[other, 1] if is_robot[pair[other, 0]] else pair[other, 0]
            toucher = pair[other, 0] if is_robot[pair[other, 0]] else pair[other, 1]
            if toucher != robot or region[touched] != region[tissue]:
                continue
            deepest = False
            cosine = 0.0
            for axis in range(3):
                cosine += normal[contact, axis] * normal[other, axis]
            if cosine > SAME:
                presses = False
                break
        if presses and not deepest:  # besides the deepest, only faces press: seams between blocks do not
            free, cosine = 0.0, 0.0
            for axis in range(3):
                free += facing[tissue, axis] ** 2
                cosine += normal[contact, axis] * facing[tissue, axis]
            presses = free == 0.0 or cosine > SAME
        if not presses:
            strength[row], resistance[row], reference[row] = NOTHING, 1.0 / NOTHING, 0.0
            continue
        value = stiffness[region[tissue]] * timestep * timestep
        strength[row], resistance[row] = value, 1.0 / value
        reference[row] = (-distance[contact] - timestep * velocity[row]) / (timestep * timestep)
        kept[count] = contact
        pressing[count], pressed[count] = row, region[tissue]
        count += 1
    return count
