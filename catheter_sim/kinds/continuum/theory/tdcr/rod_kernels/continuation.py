"""An equilibrium followed from one load to another, from rest or from a neighbour, compiled.

A step begins where the wrenches would be if the posture did not change (from rest: the statics of the
straight robot), later ones where the last two steps point to. A step that turns the robot far from there,
fails, or is taken with slow convergence, is shortened.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.columns import CONTINUOUS, LENGTH, LUMENS
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.friction import balanced
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.lanes import TENDONS
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.newton import CONVERGED, TOO_FAR
from catheter_sim.mechanics.compiled import compiled, inlined
from catheter_sim.mechanics.eight import LANES, all_zero, exponential, floats_in_line, room
from catheter_sim.mechanics.vectors import copy_all, dot3, fill, turned, turned_back

# What one correction may turn the sections by, summed: beyond it Newton's method may find another equilibrium
# than the one that the load leads to, or none.
FARTHEST_RAD = 0.1
NEAR_RAD = 0.2  # from a row to the next one
_SHORTEST_STEP = 1.0 / 1024.0  # of the way from load to load


@compiled
def unbent_wrenches(
    path: int, hole: Array, last: NDArray[np.intp], mu: float, angle: Array, tension: Array,
    applied: Array, turn: Array, shift: Array, R_w: Array, slope: Array,
) -> None:  # fmt: skip
    """Set what tensions and loads add to the sections' wrenches while the posture stays, (n, 6).

    The tendons' share is that of eyelets; on continuous paths it is in the elastic law.
    """
    n = len(turn)
    moment, force = room((3,), turn), room((3,), turn)  # of the loads beyond, about the section's start
    fill(moment, 0.0)
    fill(force, 0.0)
    arm, across = room((3,), turn), room((3,), turn)
    for j in range(n - 1, -1, -1):
        for i in range(3):
            force[i] += applied[j, 3 + i]
            moment[i] += applied[j, i]
        turned(R_w[j], shift[j], arm)
        moment[0] += arm[1] * force[2] - arm[2] * force[1]
        moment[1] += arm[2] * force[0] - arm[0] * force[2]
        moment[2] += arm[0] * force[1] - arm[1] * force[0]
        turned_back(R_w[j], moment, slope[j, :3])
        turned_back(R_w[j], force, slope[j, 3:])
        if path in (CONTINUOUS, LUMENS):
            continue
        for k in range(len(hole)):
            if j >= last[k] or all_zero(tension[k]):
                continue
            x, y = hole[k, 0], hole[k, 1]
            for i in range(3):
                across[i] = turn[j, i, 0] * x + turn[j, i, 1] * y + shift[j, i]
            across[0] -= x
            across[1] -= y
            pull = tension[k] * exponential(-mu * angle[k, j]) / math.sqrt(dot3(across, across))
            fx, fy, fz = -pull * across[0], -pull * across[1], -pull * across[2]
            slope[j, 0] += y * fz
            slope[j, 1] -= x * fz
            slope[j, 2] += x * fy - y * fx
            slope[j, 3] += fx
            slope[j, 4] += fy
            slope[j, 5] += fz


@inlined
def _advance(
    path: int, rough: Array, rod: Array, hole: Array, last: NDArray[np.intp], mu: float,
    tension0: Array, applied0: Array, tension1: Array, applied1: Array,
    wrench: Array, span: Array, angle: Array, turn: Array, shift: Array, R_w: Array, residual: Array,
    one_step: bool, longest: float, w: Array,
) -> tuple[float, int]:  # fmt: skip
    """Follow the equilibrium from one load to another; the arrays from `wrench` on are changed.

    Args:
        path: CONTINUOUS, PROJECTED, EYELETS or LUMENS.
        rough: as `rod`, with fewer steps, for the way and the derivatives.
        rod: sections' data, shape (n, 8).
        hole: shape (t, 2) [m].
        last: number of the disk where each tendon ends, shape (t,).
        mu: capstan coefficient.
        tension0, applied0: at the start of the way: tensions at the base, shape (t,) [N], moment and
            force on disks 1 to n, base frame, shape (n, 6) [N m], [N].
        tension1, applied1: at its end.
        wrench: at the sections' starts, in their frames, shape (n, 6).
        span: tensions, shape (t, n) [N].
        angle: what each tendon has turned by from the base to each section, shape (t, n) [rad].
        turn, shift: the sections' poses, shapes (n, 3, 3) and (n, 3) [m].
        R_w: orientations of disks 0 to n, shape (n + 1, 3, 3); the first one is given.
        residual: unbalanced moment and force at the disks, in their frames, shape (n, 6).
        one_step: whether to give up where a single step of little turn does not lead there.
        longest: share of the way that one step may take.
        w: workspace.

    Returns:
        The share of the way that was reached (1.0: all), and the number of Newton's corrections.
    """
    tendons, n = span.shape
    tension, applied = room((tendons,), wrench), room((n, 6), wrench)
    for k in range(tendons):
        tension[k] = tension1[k] - tension0[k]
    for j in range(n):
        for i in range(6):
            applied[j, i] = applied1[j, i] - applied0[j, i]
    slope, old_wrench, old_angle = room((n, 6), wrench), room((n, 6), wrench), room((tendons, n), wrench)
    unbent_wrenches(path, hole, last, mu, angle, tension, applied, turn, shift, R_w, slope)
    if one_step:
        turned = 0.0
        for j in range(n):
            square = 0.0
            for i in range(3):
                square += (rod[j, i] * slope[j, i]) ** 2
            turned += rod[j, LENGTH] * math.sqrt(square)
        if not turned < NEAR_RAD:
            return 0.0, 0
    reached, step = 0.0, longest
    farthest = NEAR_RAD if one_step else FARTHEST_RAD
    count = 0
    while reached < 1.0:
        if step < _SHORTEST_STEP:
            return reached, count
        share = min(1.0, reached + step)
        if share > 1.0 - 0.1 * step:
            share = 1.0
        for k in range(tendons):
            tension[k] = tension0[k] + share * (tension1[k] - tension0[k])
            for j in range(n):
                old_angle[k, j] = angle[k, j]
        for j in range(n):
            for i in range(6):
                applied[j, i] = applied0[j, i] + share * (applied1[j, i] - applied0[j, i])
                old_wrench[j, i] = wrench[j, i]
                wrench[j, i] += (share - reached) * slope[j, i]
        status, rounds, far = balanced(
            path, rough, rod, hole, last, mu, tension, applied,
            span, wrench, turn, shift, R_w, share == 1.0, farthest, residual, angle, w,
        )  # fmt: skip
        count += rounds
        if status == CONVERGED:
            for j in range(n):
                for i in range(6):
                    slope[j, i] = (wrench[j, i] - old_wrench[j, i]) / (share - reached)
            reached = share
            step = min(longest, 2.0 * step)
            continue
        for j in range(n):
            for i in range(6):
                wrench[j, i] = old_wrench[j, i]
            for k in range(tendons):
                angle[k, j] = old_angle[k, j]
        if one_step:
            return 0.0, count
        if status == TOO_FAR and rounds == 1 and far < 1e3:
            step *= max(0.35, min(0.9, math.sqrt(0.8 * farthest / far)))
        else:
            step *= 0.5
    return 1.0, count


@compiled
def set_straight(rod: Array, wrench: Array, angle: Array, turn: Array, shift: Array, R_w: Array) -> None:
    """Set the robot at rest."""
    for j in range(len(rod)):
        for i in range(6):
            wrench[j, i] = 0.0
        for k in range(len(angle)):
            angle[k, j] = 0.0
        for i in range(3):
            shift[j, i] = rod[j, LENGTH] if i == 2 else 0.0
            for c in range(3):
                turn[j, i, c] = R_w[j + 1, i, c] = 1.0 if i == c else 0.0


@compiled
def follow(
    path: int, rough: Array, rod: Array, hole: Array, last: NDArray[np.intp], mu: float,
    tension: Array, applied: Array, wrench: Array, span: Array, shift: Array, R_w: Array, residual: Array,
    reached: Array, corrections: NDArray[np.intp], longest: float,
) -> None:  # fmt: skip
    """Find the equilibria of r rows of loads; arguments as of `_advance` with rows in front.

    A row is reached from the one before where that is near, else from rest; then, if that way ends, from
    the row before at any distance, and from rest with the tensions or the other loads first.

    Args:
        reached: result, share of the way from rest that was reached, shape (r,); 1: some way led there.
            Rows that have 1 already, `together` found them without friction, are left as they are.
        corrections: result, of Newton's method, shape (r,).
    """
    rows, tendons = tension.shape
    n = len(rod)
    turn, angle, angle_before = (
        room((n, 3, 3), wrench),
        room((tendons, n), wrench),
        room((tendons, n), wrench),
    )
    fill(angle, 0.0)
    fill(angle_before, 0.0)
    w = floats_in_line((TENDONS + 3 * tendons) * LANES)
    fill(w, 0.0)
    pulls, loads = room((3, tendons), wrench), room((3, n, 6), wrench)
    for row in range(rows):
        if reached[row] == 1.0:
            fill(angle_before, 0.0)
            continue
        before = row > 0 and reached[row - 1] == 1.0
        tensioned = loaded = False
        for k in range(tendons):
            tensioned = tensioned or tension[row, k] != 0.0
        for j in range(n):
            for i in range(6):
                loaded = loaded or applied[row, j, i] != 0.0
        for way in range(5):  # near, from rest, from before, tensions first, loads first
            if (way in (0, 2) and not before) or (way > 2 and not (tensioned and loaded)):
                continue
            stops = 2 if way < 3 else 3
            fill(pulls, 0.0)
            fill(loads, 0.0)
            if way in (0, 2):
                copy_all(tension[row - 1], pulls[0])
                copy_all(applied[row - 1], loads[0])
                copy_all(wrench[row - 1], wrench[row])
                copy_all(shift[row - 1], shift[row])
                copy_all(R_w[row - 1], R_w[row])
                copy_all(angle_before, angle)
                for j in range(n):
                    for i in range(3):
                        turned_back(R_w[row, j], R_w[row, j + 1, :, i], turn[j, :, i])
            else:
                set_straight(rod, wrench[row], angle, turn, shift[row], R_w[row])
            if way == 3:
                copy_all(tension[row], pulls[1])
            if way == 4:
                copy_all(applied[row], loads[1])
            copy_all(tension[row], pulls[stops - 1])
            copy_all(applied[row], loads[stops - 1])
            share = 1.0
            for leg in range(stops - 1):
                share, count = _advance(
                    path, rough, rod, hole, last, mu, pulls[leg], loads[leg], pulls[leg + 1], loads[leg + 1],
                    wrench[row], span[row], angle, turn, shift[row], R_w[row], residual[row],
                    way == 0, longest, w,
                )  # fmt: skip
                corrections[row] += count
                if share < 1.0:
                    break
            if share == 1.0 or way == 1:
                reached[row] = share
            if share == 1.0:
                copy_all(angle, angle_before)
                break
