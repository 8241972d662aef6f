"""Tensions of a rod whose tendons are driven by displacement at the base.

A tendon is a spring to its drive: T = max(0, p + k (u - d)), with the pretension p, the stiffness k of
tendon and drive (of an inextensible one that of `constant_curvature.drive_stiffness`, as in CC and the
simulation), the drive's displacement u and the shortening d of its path from rest. It pulls or is slack:

    0 <= T,    0 <= T / k + d - u - p / k,    one of the two zero.

The path is the model's own: straight from hole to hole, or along the rod. The posture under given tensions
is the one to which they lead in proportion from rest, so that a displacement has the posture of its
tensions. Newton's method on the two conditions: the shortenings' derivative by the tensions is taken by
differences, and the linear problem of which tendons are taut is solved at every step. Where it fails,
it is begun with softer tendons, which are stiffened step by step: of stiff antagonists the straight robot
knows the sum of tensions only by far too much, since chords shorten with the square of the bend.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.errors import InputError
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.kinds.continuum.theory.constant_curvature import drive_stiffness
from catheter_sim.kinds.continuum.theory.tdcr.postures import Solved
from catheter_sim.kinds.continuum.theory.tdcr.problem import Load, Problem

_DIFFERENCE = 1e-4  # of a tension, over the one that bends the robot by 1 rad
_TOLERANCE = 1e-9  # last change of a tension, over the same
_MOST_ROUNDS = 20
_FARTHEST = 10.0  # change of a tension, over the same: beyond it the linear problem says nothing
# Compliances added to the tendons', over that of the bending robot: with the tendons' own alone, and,
# where that fails, from soft tendons to their own.
_AT_ONCE = (0.0,)
_SOFTENING = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0)
_MOST_SWAPS = 50

Found = TypeVar("Found", bound=Solved)


@dataclass(frozen=True)
class DisplacementDrive:
    """How the tendons are driven at each of r rows.

    Attributes:
        stiffness_N_per_m: of each tendon and its drive, finite, shape (t,) [N/m].
        pretension_N: shape (t,) [N].
        displacement_m: less each tendon's slack, shape (r, t) [m]; positive pulls.
    """

    stiffness_N_per_m: Array
    pretension_N: Array
    displacement_m: Array


def drive(robot: ContinuumRobot, displacement_m: Array) -> DisplacementDrive:
    """Return the drive of `robot` at the displacements of r rows, shape (r, t) [m]."""
    return DisplacementDrive(
        np.array([drive_stiffness(robot, tendon) for tendon in robot.tendons]),
        np.array([tendon.pretension_N for tendon in robot.tendons]),
        np.asarray(displacement_m, dtype=float) - [tendon.slack_m for tendon in robot.tendons],
    )


def driven(
    model: str,
    robot: ContinuumRobot,
    rod: Problem,
    inputs: Inputs,
    loads: Load,
    solve: Callable[[Load], Found],
    lengths: Callable[[Found], Array],
) -> Load:
    """Return `loads` with the tensions that the displacements of `inputs` bring about.

    Args:
        model: its name.
        robot, rod: the robot, and the same as arrays.
        inputs: displacements.
        loads: forces and moments; the tensions are not read.
        solve: loads to the model's equilibria.
        lengths: of the tendons' paths in equilibria, shape (r, t) [m].

    Raises:
        InputError: no posture follows a row's displacements.
    """
    tension, good = tensions(rod, drive(robot, inputs.tendon), loads, solve, lengths)
    if not good.all():
        row = int(np.argmin(good))
        raise InputError(
            f"{robot.name}: {model} finds no posture that follows the displacements of "
            f"{row_name(inputs, row)}"
        )
    return replace(loads, tension_N=tension)


def tensions(
    rod: Problem,
    drive: DisplacementDrive,
    loads: Load,
    solve: Callable[[Load], Found],
    lengths: Callable[[Found], Array],
) -> tuple[Array, NDArray[np.bool_]]:
    """Return tensions, shape (r, t) [N], and whether they were found, shape (r,).

    Args:
        rod: the robot.
        drive: displacements of r rows.
        loads, solve, lengths: as of `driven`.
    """
    target = drive.displacement_m + drive.pretension_N / drive.stiffness_N_per_m
    typical = _bending_tensions(rod)
    bending = np.hypot(rod.hole_m[:, 0], rod.hole_m[:, 1]) / typical  # compliance at the tendon, [m/N]
    tension, good = np.zeros(target.shape), np.zeros(len(target), dtype=bool)
    for softening in (_AT_ONCE, _SOFTENING):
        left = np.flatnonzero(~good)
        tension[left] = 0.0
        for softer in softening:
            part = Load(tension[left], loads.force_N[left], loads.moment_N_m[left])
            compliance = 1.0 / drive.stiffness_N_per_m + softer * bending
            found, balanced = _balanced(typical, compliance, target[left], part, rod, solve, lengths)
            tension[left[balanced]] = found[balanced]
            left = left[balanced]
        good[left] = True
    return tension, good


def _balanced(
    typical: Array,
    compliance: Array,
    target: Array,
    loads: Load,
    rod: Problem,
    solve: Callable[[Load], Found],
    lengths: Callable[[Found], Array],
) -> tuple[Array, NDArray[np.bool_]]:
    """Return tensions where compliance T + d meets `target` or T is zero, and the rows that balance.

    `loads` holds the tensions to start from, `typical` what bends the robot by 1 rad, shape (t,) [N].
    """
    rows, tendons = target.shape
    tension, good = loads.tension_N.copy(), np.zeros(rows, dtype=bool)
    straight = rod.disk_z_m[rod.last_disk]
    shift = np.concatenate([np.zeros((1, tendons)), np.diag(_DIFFERENCE * typical)])
    left = np.arange(rows)
    for _ in range(_MOST_ROUNDS):
        # Each row and, next to it, the same with each tension a little higher.
        tries = (tension[left, None] + shift).reshape(-1, tendons)
        around = np.repeat(left, tendons + 1)
        found = solve(Load(tries, loads.force_N[around], loads.moment_N_m[around]))
        short = (straight - lengths(found)).reshape(-1, tendons + 1, tendons)
        slope = np.swapaxes(short[:, 1:] - short[:, :1], 1, 2) / (_DIFFERENCE * typical)
        slope += np.diag(compliance)
        here = tension[left] * compliance + short[:, 0] - target[left]
        constant = here - np.einsum("rij,rj->ri", slope, tension[left])
        kept = (found.reached == 1.0).reshape(-1, tendons + 1).all(axis=1)
        new = np.zeros((len(left), tendons))
        for row in np.flatnonzero(kept):
            new[row] = _taut(slope[row], constant[row])
        change = (np.abs(new - tension[left]) / typical).max(axis=1)
        kept &= change < _FARTHEST
        tension[left[kept]] = new[kept]
        good[left[kept & (change < _TOLERANCE)]] = True
        left = left[kept & (change >= _TOLERANCE)]
        if not left.size:
            break
    return tension, good


def _bending_tensions(rod: Problem) -> Array:
    """Return the tension of each tendon that would bend the robot by 1 rad, shape (t,) [N]."""
    radius = np.maximum(np.hypot(rod.hole_m[:, 0], rod.hole_m[:, 1]), 1e-3 * rod.disk_z_m[-1])
    compliance = np.cumsum(rod.length_m / rod.bending_N_m2)[rod.last_disk - 1]
    return np.asarray(1.0 / (radius * compliance))


def _taut(matrix: Array, constant: Array) -> Array:
    """Return T >= 0 with w = matrix T + constant >= 0 and T w = 0, by exchange of taut and slack tendons."""
    size = len(constant)
    taut = constant < 0.0
    result = np.zeros(size)
    for swap in range(_MOST_SWAPS):
        result[:] = 0.0
        if taut.any():
            result[taut] = np.linalg.solve(matrix[np.ix_(taut, taut)], -constant[taut])
        gap = matrix @ result + constant
        wrong = np.where(taut, result < 0.0, gap < 0.0)
        if not wrong.any():
            break
        if swap < 10:
            taut ^= wrong
        else:  # one at a time cannot go round in circles
            last = np.flatnonzero(wrong)[-1]
            taut[last] = not taut[last]
    return np.maximum(result, 0.0)


def straight_lengths(found: Solved, rod: Problem) -> Array:
    """Return the lengths of tendons that are straight from disk to disk, shape (r, t) [m]."""
    at = found.p_w[:, :, None] + np.einsum("rjab,tb->rjta", found.R_w[..., :2], rod.hole_m)
    spans = np.linalg.norm(np.diff(at, axis=1), axis=-1)  # (r, n, t)
    runs = np.arange(spans.shape[1])[:, None] < rod.last_disk
    return np.asarray((spans * runs).sum(axis=1))
