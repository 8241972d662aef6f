"""Equilibria of a Cosserat rod with tendons, compiled: balance, Newton's method, continuation, friction."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled, inlined
from catheter_sim.mechanics.eight import (
    LANES,
    all_less,
    all_zero,
    eights,
    exponential,
    floats_in_line,
    floats_of_eights,
    lane,
    larger,
    room,
    select_less,
    solve_columns_of_any,
    take_lane,
)
from catheter_sim.mechanics.vectors import copy_all, dot3, fill, turned, turned_back
from catheter_sim.robots.continuum.rod_sections import (
    CONTINUOUS,
    LENGTH,
    LUMENS,
    MOMENT,
    PER_TENDON,
    TENDONS,
    TIP_FORCE,
    SectionEnds,
    add_path_forces,
    path_direction,
    sections,
    sections_of_eights,
    start_laws,
    strain_of,
)


class TendonRod(NamedTuple):
    """A rod of n sections and t tendons as the loops take it.

    Attributes:
        path: CONTINUOUS, PROJECTED, EYELETS, LUMENS, MOMENT or TIP_FORCE.
        rough, fine: sections' data with few and many integration steps, shape (n, 8); the first serves on the
            way and for the derivatives.
        hole: of the tendons along a continuous path, alike in all disks, shape (t, 2) [m].
        holes: in each disk, shape (t, n + 1, 2) [m].
        last: number of the disk where each tendon ends, shape (t,).
        mu: capstan coefficient.
    """

    path: int
    rough: Array
    fine: Array
    hole: Array
    holes: Array
    last: NDArray[np.intp]
    mu: float


class RodState(NamedTuple):
    """A posture of a rod, balanced or on the way there.

    Attributes:
        wrench: at the sections' starts, in their frames, shape (n, 6).
        span: tension of every tendon along every section, zero beyond its end, shape (t, n) [N].
        turn, shift: the sections' poses, shapes (n, 3, 3) and (n, 3) [m].
        R_w: orientations of disks 0 to n, shape (n + 1, 3, 3); the first one is given.
        residual: unbalanced moment and force at the disks, in their frames, shape (n, 6).
    """

    wrench: Array
    span: Array
    turn: Array
    shift: Array
    R_w: Array
    residual: Array


class RodRows(NamedTuple):
    """Postures of a rod, each array with a row for each; attributes as of `RodState`."""

    wrench: Array
    span: Array
    shift: Array
    R_w: Array
    residual: Array


# ----------------------------------------------------------------------------------------------------
# What each disk lacks to balance, compiled.
#
# The unknowns are the wrenches at the sections' starts, each in the frame of its start, so that a section's
# pose does not depend on those before it. What is left over at disk j, in the disk's frame, is
#
# wrench at the start of section j + 1 - wrench at the end of section j + tendons + loads,
#
# (Rao 2021, Eqs 40-41) and depends on the two sections next to the disk and, through loads that keep their
# direction in space, on the disk's orientation.


@compiled
def left_over(
    path: int,
    rod: Array,
    hole: Array,
    span: Array,
    applied: Array,
    wrench: Array,
    derive: bool,
    R_w: Array,
    residual: Array,
    load: Array,
    ends: SectionEnds,
) -> None:
    """Set the residual at the disks, (n, 6), and their orientations; with `derive` the derivatives, too.

    The sections' ends are as `sections` left them. Their `here` and `low_slope` become the residual's
    derivatives by the wrench of the section below and above, and `load`, shape (n, 6, 3), is that by the
    disk's turn. `R_w`: orientations of disks 0 to n.
    """
    turn, _, _, end, here, low, above = ends
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
        if path in (MOMENT, TIP_FORCE):
            for k in range(tendons):
                if j + 1 == n or all_zero(span[k, j + 1]):
                    residual[j, 0] -= span[k, j] * hole[k, 1]
                    residual[j, 1] += span[k, j] * hole[k, 0]
                    if path == TIP_FORCE:
                        residual[j, 5] -= span[k, j]
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


# ----------------------------------------------------------------------------------------------------
# Newton's method for the sections' wrenches, compiled.
#
# One sweep from the tip solves the linear system: every correction is linear in the tip's small turn, which
# the fixed base then gives. The derivative is taken with few integration steps. Once a correction is small,
# the residual is taken with many steps, without a derivative, and corrected by the last derivative until
# nothing changes.

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
    rod: TendonRod, applied: Array, state: RodState, to_the_end: bool, farthest: float, w: Array
) -> tuple[int, int, float]:
    """Balance a robot at given tensions, starting from the wrenches in `state`, which is the result too.

    Args:
        rod: the robot.
        applied: moment and force on disks 1 to n, base frame, shape (n, 6).
        state: its tensions are given.
        to_the_end: whether to balance the fine residual, instead of the rough one by and large.
        farthest: what a correction may turn the sections by, summed [rad].
        w: workspace.

    Returns:
        How it ended, the number of corrections, and what the first one turned the sections by [rad].
    """
    path, rough, fine, hole, holes, _, _ = rod
    wrench, span, turn, shift, R_w, residual = state
    n = span.shape[1]
    turn_slope = room((n, 3, 6), wrench)
    here, above, load = room((n, 6, 6), wrench), room((n, 6, 6), wrench), room((n, 6, 3), wrench)
    by_tip, last = room((n, 6, 3), wrench), room((3, 3), wrench)
    step, end, low = room((n, 6), wrench), room((n, 6), wrench), room((n, 6), wrench)
    strain, inverse = room((n, 6), wrench), room((n, 6, 6), wrench)
    if path in (CONTINUOUS, LUMENS):
        start_laws(rough, hole, span, wrench, strain, inverse)
    start, ends = (strain, inverse), SectionEnds(turn, shift, turn_slope, end, here, low, above)
    largest = math.inf
    rounds = 0
    first = 0.0
    finishing, derive, slopes = False, True, rough
    while True:
        here_rod = fine if finishing and not derive else slopes
        sections(path, here_rod, hole, holes, span, wrench, start, derive, w, ends)
        left_over(path, here_rod, hole, span, applied, wrench, derive, R_w, residual, load, ends)
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


# ----------------------------------------------------------------------------------------------------
# Dry friction of tendons at the disks' holes, compiled: tensions and posture, found in turns.
#
# The tensions are those of tendons that were pulled from rest to where they are: at each hole, the base's
# included and the last one's not, they fall toward the tip by exp(-mu phi), phi the angle that the tendon
# turns by (capstan). They follow from the posture and the posture from them.

_MOST_ROUNDS = 100
_TOLERANCE = 1e-11  # change of the tensions, over the largest one


@compiled
def _angle_between(a: Array, b: Array) -> float:
    """Angle between two directions [rad]."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    return math.atan2(math.sqrt(x * x + y * y + z * z), a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@compiled
def _tendon_turns(
    path: int,
    rod: Array,
    hole: Array,
    holes: Array,
    span: Array,
    wrench: Array,
    turn: Array,
    shift: Array,
    angle: Array,
) -> None:
    """Angles that the tendons turn by at the holes of disks 0 to n - 1, shape (t, n) [rad].

    A continuous path turns all along a section; half of that is counted at either end.
    """
    tendons, n = span.shape
    strain, at_end, end, stiffness = np.zeros(6), np.zeros(6), np.empty(6), np.empty((6, 6))
    before, after, moved, along = np.empty(3), np.empty(3), np.empty(3), np.empty(tendons)
    for k in range(tendons):
        for j in range(n):
            angle[k, j] = 0.0
    if path in (CONTINUOUS, LUMENS):
        for j in range(n):
            p, m0, n0 = shift[j], wrench[j, :3], wrench[j, 3:]
            moved[0] = m0[0] - (p[1] * n0[2] - p[2] * n0[1])
            moved[1] = m0[1] - (p[2] * n0[0] - p[0] * n0[2])
            moved[2] = m0[2] - (p[0] * n0[1] - p[1] * n0[0])
            turned_back(turn[j], moved, end[:3])
            turned_back(turn[j], n0, end[3:])
            for k in range(tendons):
                along[k] = span[k, j]
            strain_of(rod[j], hole, along, end, at_end, stiffness)
            strain_of(rod[j], hole, along, wrench[j], strain, stiffness)
            for k in range(tendons):
                if along[k] == 0.0:
                    continue
                path_direction(strain, hole[k], before)
                path_direction(at_end, hole[k], after)
                turned(turn[j], after, moved)
                half = 0.5 * _angle_between(before, moved)
                angle[k, j] += half
                if j + 1 < n and span[k, j + 1] > 0.0:
                    angle[k, j + 1] += half
        return
    for k in range(tendons):
        before[0] = before[1] = 0.0
        before[2] = 1.0
        for j in range(n):
            if span[k, j] == 0.0:
                break
            R = turn[j]
            for i in range(3):
                after[i] = R[i, 0] * holes[k, j + 1, 0] + R[i, 1] * holes[k, j + 1, 1] + shift[j, i]
            after[0] -= holes[k, j, 0]
            after[1] -= holes[k, j, 1]
            angle[k, j] = _angle_between(before, after)
            turned_back(R, after, before)


@inlined
def balanced(
    rod: TendonRod, tension: Array, applied: Array, state: RodState, angle: Array,
    to_the_end: bool, farthest: float, w: Array,
) -> tuple[int, int, float]:  # fmt: skip
    """Balance posture and tensions, which are start and result in `state`; as `newton` otherwise."""
    path, rough, _, hole, holes, last, mu = rod
    wrench, span, turn, shift, _, _ = state
    tendons, n = span.shape
    for k in range(tendons):
        for j in range(n):
            span[k, j] = tension[k] * math.exp(-mu * angle[k, j]) if j < last[k] else 0.0
    rounds = 0
    first = 0.0
    largest = 1e-300
    for k in range(tendons):
        largest = max(largest, tension[k])
    for trial in range(_MOST_ROUNDS):
        status, count, far = newton(rod, applied, state, to_the_end, farthest, w)
        rounds += count
        if trial == 0:
            first = far
        if status != CONVERGED or mu == 0.0:
            return status, rounds, first
        _tendon_turns(path, rough, hole, holes, span, wrench, turn, shift, angle)
        change = 0.0
        for k in range(tendons):
            total = 0.0
            for j in range(last[k]):
                total += angle[k, j]
                angle[k, j] = total
                new = tension[k] * math.exp(-mu * total)
                change = max(change, abs(new - span[k, j]))
                span[k, j] = new
        if change < (_TOLERANCE if to_the_end else 0.1 * ON_THE_WAY_RAD) * largest:
            return status, rounds, first
    return TOO_FAR, rounds, first


# ----------------------------------------------------------------------------------------------------
# An equilibrium followed from one load to another, from rest or from a neighbour, compiled.
#
# A step begins where the wrenches would be if the posture did not change (from rest: the statics of the
# straight robot), later ones where the last two steps point to. A step that turns the robot far from there,
# fails, or is taken with slow convergence, is shortened.

# What one correction may turn the sections by, summed: beyond it Newton's method may find another equilibrium
# than the one that the load leads to, or none.
FARTHEST_RAD = 0.1
NEAR_RAD = 0.2  # from a row to the next one
_SHORTEST_STEP = 1.0 / 1024.0  # of the way from load to load


@compiled
def unbent_wrenches(
    path: int, holes: Array, last: NDArray[np.intp], mu: float, angle: Array, tension: Array,
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
        for k in range(len(holes)):
            if j >= last[k] or all_zero(tension[k]):
                continue
            x, y = holes[k, j + 1, 0], holes[k, j + 1, 1]
            for i in range(3):
                across[i] = turn[j, i, 0] * x + turn[j, i, 1] * y + shift[j, i]
            x, y = holes[k, j, 0], holes[k, j, 1]
            across[0] -= x
            across[1] -= y
            pull = tension[k] * exponential(-mu * angle[k, j]) / math.sqrt(dot3(across, across))
            fx, fy, fz = -pull * across[0], -pull * across[1], -pull * across[2]
            slope[j, 0] += y * fz
            slope[j, 1] -= x * fz
            slope[j, 2] += x * fy - y * fx
            if path == MOMENT:
                continue
            slope[j, 3] += fx
            slope[j, 4] += fy
            slope[j, 5] += fz


@inlined
def _advance(
    rod: TendonRod, tension0: Array, applied0: Array, tension1: Array, applied1: Array,
    state: RodState, angle: Array, one_step: bool, longest: float, w: Array,
) -> tuple[float, int]:  # fmt: skip
    """Follow the equilibrium from one load to another; `state` and `angle` are changed.

    Args:
        rod: the robot.
        tension0, applied0: at the start of the way: tensions at the base, shape (t,) [N], moment and
            force on disks 1 to n, base frame, shape (n, 6) [N m], [N].
        tension1, applied1: at its end.
        state: where it begins and ends.
        angle: what each tendon has turned by from the base to each section, shape (t, n) [rad].
        one_step: whether to give up where a single step of little turn does not lead there.
        longest: share of the way that one step may take.
        w: workspace.

    Returns:
        The share of the way that was reached (1.0: all), and the number of Newton's corrections.
    """
    path, _, fine, _, holes, last, mu = rod
    wrench, span, turn, shift, R_w, _ = state
    tendons, n = span.shape
    tension, applied = room((tendons,), wrench), room((n, 6), wrench)
    for k in range(tendons):
        tension[k] = tension1[k] - tension0[k]
    for j in range(n):
        for i in range(6):
            applied[j, i] = applied1[j, i] - applied0[j, i]
    slope, old_wrench, old_angle = room((n, 6), wrench), room((n, 6), wrench), room((tendons, n), wrench)
    unbent_wrenches(path, holes, last, mu, angle, tension, applied, turn, shift, R_w, slope)
    if one_step:
        turned = 0.0
        for j in range(n):
            square = 0.0
            for i in range(3):
                square += (fine[j, i] * slope[j, i]) ** 2
            turned += fine[j, LENGTH] * math.sqrt(square)
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
        status, rounds, far = balanced(rod, tension, applied, state, angle, share == 1.0, farthest, w)
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
    rod: TendonRod, tension: Array, applied: Array, found: RodRows,
    reached: Array, corrections: NDArray[np.intp], longest: float,
) -> None:  # fmt: skip
    """Find the equilibria of r rows of loads; arguments as of `_advance` with rows in front.

    A row is reached from the one before where that is near, else from rest. Then, if that way ends, from
    the row before at any distance, and from rest with the tensions or the other loads first.

    Args:
        reached: result, share of the way from rest that was reached, shape (r,); 1: some way led there.
            Rows that have 1 already, `follow_together` found them without friction, are left as they are.
        corrections: result, of Newton's method, shape (r,).
    """
    wrench, span, shift, R_w, residual = found
    rows, tendons = tension.shape
    n = len(rod.fine)
    turn, angle, angle_before = (
        room((n, 3, 3), wrench),
        room((tendons, n), wrench),
        room((tendons, n), wrench),
    )
    fill(angle, 0.0)
    fill(angle_before, 0.0)
    w = floats_in_line((TENDONS + PER_TENDON * tendons) * LANES)
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
                set_straight(rod.fine, wrench[row], angle, turn, shift[row], R_w[row])
            if way == 3:
                copy_all(tension[row], pulls[1])
            if way == 4:
                copy_all(applied[row], loads[1])
            copy_all(tension[row], pulls[stops - 1])
            copy_all(applied[row], loads[stops - 1])
            share = 1.0
            for leg in range(stops - 1):
                state = RodState(wrench[row], span[row], turn, shift[row], R_w[row], residual[row])
                share, count = _advance(
                    rod, pulls[leg], loads[leg], pulls[leg + 1], loads[leg + 1], state, angle,
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


# ----------------------------------------------------------------------------------------------------
# Eight rows of loads balanced together from rest, in one step and without friction, compiled.
#
# The same residuals and derivatives as in `newton`, with eight robots side by side, and the same conditions
# on its corrections. A row that breaks one is left to `follow`.


@compiled
def follow_together(
    rod: TendonRod, chosen: NDArray[np.intp], tension: Array, applied: Array, found: RodRows,
    reached: Array, corrections: NDArray[np.intp],
) -> None:  # fmt: skip
    """Find the equilibria of some rows without friction; arguments as of `follow`.

    Args:
        chosen: numbers of the rows, a multiple of LANES of them.
        reached: result, 1 where a row is balanced; the other rows are left as they were.
    """
    path, rough, fine, hole, holes, last, _ = rod
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
    turned, v = room((3,), x), room((TENDONS + PER_TENDON * tendons,), x)
    start, ends = (strain, inverse), SectionEnds(turn, p, turn_slope, end, here, low, above)
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
        unbent_wrenches(path, holes, last, 0.0, angle, t, f, turn, p, R, x)
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
            here_rod = fine if finishing and not derive else slopes
            sections_of_eights(path, here_rod, hole, holes, s, x, start, derive, v, ends)
            left_over(path, here_rod, hole, s, f, x, derive, R, r, load, ends)
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
            take_lane(wrenches, i, found.wrench[row])
            take_lane(spans, i, found.span[row])
            take_lane(shifts, i, found.shift[row])
            take_lane(turns, i, found.R_w[row])
            take_lane(lefts, i, found.residual[row])
