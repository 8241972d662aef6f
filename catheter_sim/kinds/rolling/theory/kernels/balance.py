"""The moments left at the joints, and their derivative, compiled."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.theory.kernels.columns import (
    AXIS,
    COMPLIANCE,
    LENGTH,
    LINE,
    OFFSET,
    RADIUS_NEGATIVE,
    RADIUS_POSITIVE,
    SINK,
    X,
    Y,
)
from catheter_sim.kinds.rolling.theory.kernels.links import roll_on
from catheter_sim.kinds.rolling.theory.kernels.rods import pull_and_bend_rods
from catheter_sim.kinds.rolling.theory.kernels.sliding import ABOVE, slide_and_bend_rods
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.vectors import cross3, dot3


@compiled
def workspace(n: int, pulled: int) -> tuple[Array, ...]:
    """Return the arrays that `evaluate` works in, of n joints: made once for a whole history."""
    return (
        np.empty((pulled, n, 3)), np.empty(n), np.empty(n), np.empty(n), np.empty((3, n)),
        np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)),
        np.empty((n, 3, 3)), np.empty((n + 1, 3)), np.empty((n + 1, 3)), np.empty((n, 3)), np.empty((n, 3)),
        np.empty((n, 3)), np.empty((n, 3)), np.empty((n + 1, 3, 3)), np.empty((3, 3)), np.empty((8, 3)),
        np.empty((3, pulled, n)),
    )  # fmt: skip


@compiled
def evaluate(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    pre_sliding_m: float,
    drive: Array,
    memory: Array,
    theta: Array,
    length: Array,
    load_link: np.ndarray,
    load_point: Array,
    load_force: Array,
    tip_moment: Array,
    at_joint: Array,
    renewed: Array,
    value: Array,
    jacobian: Array,
    work: tuple[Array, ...],
) -> bool:
    """Fill tensions, the moment left at every joint and its derivative; renew the links' lengths.

    Link by link from the tip: all wrenches on a link, about the base's origin, give the reaction of its
    joint; what that would have to carry about the joint's own axis is left over. `renewed` is what `memory`
    becomes, see `sliding`. Returned is whether joints feel those above them, so that the derivative has
    entries above its diagonal: where a load acts, or rods stick that others move.
    """
    n, loads = joint.shape[0], load_link.shape[0]
    wrench, elastic, sines, cosines, grows, along, axis, contact, up, origin, turned = work[:11]
    pull, pull_moment, push, push_moment, moved, beyond, outer, R, small, rods = work[11:]
    face, chord, lower, product = small[0], small[1], small[2], small[3]
    point, react, react_moment = small[4], small[5], small[6]
    if pre_sliding_m > 0.0:
        slide_and_bend_rods(
            joint, rod, stiffness, pulled, mu, drive, memory, theta, at_joint, renewed,
            wrench, elastic, sines, cosines, pre_sliding_m, rods, grows, jacobian,
        )  # fmt: skip
    else:
        pull_and_bend_rods(
            joint, rod, stiffness, pulled, mu, drive, memory[ABOVE], theta, at_joint, renewed[ABOVE],
            wrench, elastic, sines, cosines, grows[0], jacobian,
        )  # fmt: skip
    pull[:] = 0.0
    pull_moment[:] = 0.0
    face[:] = 0.0
    for i in range(3):
        for j in range(3):
            R[i, j] = 1.0 if i == j else 0.0
    for k in range(n):
        t, a, line = theta[k], int(joint[k, AXIS]), joint[k, LINE]
        radius = joint[k, RADIUS_POSITIVE] if t >= 0.0 else joint[k, RADIUS_NEGATIVE]
        for r in range(pulled):
            if math.isnan(rod[r, k, OFFSET]):
                continue
            for i in range(3):
                lower[i] = (
                    face[i] + rod[r, k, X] * R[i, 0] + rod[r, k, Y] * R[i, 1] - rod[r, k, SINK] * R[i, 2]
                )
                chord[i] = wrench[r, k, 2] * (wrench[r, k, 0] * R[i, a] + wrench[r, k, 1] * R[i, 2])
            cross3(lower, chord, product)
            for i in range(3):
                pull[k, i] += chord[i]
                pull_moment[k, i] += product[i]
        for i in range(3):
            e = R[i, a]
            along[k, i] = e
            axis[k, i] = R[i, 1] if a == 0 else -R[i, 0]
            contact[k, i] = face[i] + (line + radius * t) * e
        roll_on(joint, k, t, length[k], face, R, origin[k])
        for i in range(3):
            up[k, i] = R[i, 2]
            for j in range(3):
                turned[k, i, j] = R[i, j]
    # Loads: where they act, what they do about the base's origin, link by link.
    push[:] = 0.0
    push_moment[:] = 0.0
    beyond[:] = 0.0
    outer[:] = 0.0  # of points and forces, summed over each link and those beyond it
    loaded = False
    for p in range(loads):
        force = load_force[p]
        if force[0] == 0.0 and force[1] == 0.0 and force[2] == 0.0:
            continue
        loaded = True
        link = load_link[p]
        for i in range(3):
            point[i] = origin[link, i]
            for j in range(3):
                point[i] += turned[link, i, j] * load_point[p, j]
            push[link, i] += force[i]
        cross3(point, force, product)
        for i in range(3):
            push_moment[link, i] += product[i]
            for j in range(3):
                outer[link, i, j] += point[i] * force[j]
    if loaded:
        # How the moments of all forces beyond a joint change as it turns: (axis x arm) x force, expanded.
        for k in range(n - 1, -1, -1):
            for i in range(3):
                beyond[k, i] = push[k, i] + (beyond[k + 1, i] if k + 1 < n else 0.0)
                for j in range(3):
                    outer[k, i, j] += outer[k + 1, i, j]
            a_f = dot3(axis[k], beyond[k])
            p_f = outer[k, 0, 0] + outer[k, 1, 1] + outer[k, 2, 2] - dot3(contact[k], beyond[k])
            for i in range(3):
                moved[k, i] = dot3(outer[k, i], axis[k]) - contact[k, i] * a_f - axis[k, i] * p_f
    for i in range(3):
        react[i], react_moment[i] = 0.0, -tip_moment[i]
    for k in range(n - 1, -1, -1):
        above_elastic = elastic[k + 1] if k + 1 < n else 0.0
        for i in range(3):
            react[i] += pull[k, i] - pull[k + 1, i] - push[k, i]
            react_moment[i] += pull_moment[k, i] - pull_moment[k + 1, i] - push_moment[k, i]
            react_moment[i] += elastic[k] * axis[k, i]
            if k + 1 < n:
                react_moment[i] -= above_elastic * axis[k + 1, i]
        cross3(contact[k], react, product)
        value[k] = -(dot3(axis[k], react_moment) - dot3(axis[k], product))
    # Loads' part of the derivative: symmetric, as they have a potential; the tip's moment has none.
    if loaded:
        for k in range(n):
            radius = joint[k, RADIUS_POSITIVE] if theta[k] >= 0.0 else joint[k, RADIUS_NEGATIVE]
            cross3(along[k], beyond[k], product)
            jacobian[k, k] += dot3(axis[k], moved[k]) - radius * dot3(axis[k], product)
            for j in range(k + 1, n):
                slope = dot3(axis[k], moved[j])
                jacobian[k, j] += slope
                jacobian[j, k] += slope
    if tip_moment[0] != 0.0 or tip_moment[1] != 0.0 or tip_moment[2] != 0.0:
        for k in range(n):
            for j in range(k):
                cross3(axis[j], axis[k], product)
                jacobian[k, j] += dot3(product, tip_moment)
    for k in range(n):
        if joint[k, COMPLIANCE] == 0.0:
            length[k] = joint[k, LENGTH]
            continue
        inside = -dot3(up[k], beyond[k])
        for r in range(pulled):
            if not math.isnan(rod[r, k, OFFSET]):
                inside += 0.5 * (at_joint[r, k] + renewed[ABOVE, r, k])
        length[k] = joint[k, LENGTH] - inside * joint[k, COMPLIANCE]
    return loaded or pre_sliding_m > 0.0
