"""Cosserat rods with tendons: the static models VC, VC_moment, VC_tip_force, VC_ref and VC_ref_noproj."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.posture import Posture
from catheter_sim.core.statics import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.mechanics.eight import LANES
from catheter_sim.robots.continuum import rod_sections
from catheter_sim.robots.continuum.constant_curvature import drive_stiffness
from catheter_sim.robots.continuum.description import (
    disk_masses,
    disks,
    hole_xy_m,
    last_disk,
    winds_or_converges,
)
from catheter_sim.robots.continuum.rod_balance import NEAR_RAD, RodRows, TendonRod, follow, follow_together
from catheter_sim.robots.continuum.rod_sections import measure_paths
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment

# ----------------------------------------------------------------------------------------------------
# Rows of a batch shared out to threads; compiled code runs side by side there.


def share_out(solve: Callable[[slice], None], rows: int, threads: int) -> None:
    """Call `solve` with slices of the rows, at most one for each thread, and wait for all.

    Raises:
        ValueError: fewer than one thread.
    """
    if threads < 1:
        raise ValueError(f"threads = {threads}: must be at least 1")
    size = -(-rows // threads) or 1
    parts = [slice(start, min(start + size, rows)) for start in range(0, rows, size)]
    if len(parts) <= 1:
        solve(slice(0, rows))
        return
    with ThreadPoolExecutor(len(parts)) as pool:
        list(pool.map(solve, parts))


# ----------------------------------------------------------------------------------------------------
# What the rod models of a tendon-driven robot need, as arrays: the robot and the loads of each row.
#
# Everything is in the base frame of the straight robot, SI units. Subsegment j (0 at the base) lies between
# the disks j and j + 1; the fixed disk at z = 0 is disk 0. Weight and whatever else is distributed acts at
# the disks.


@dataclass(frozen=True)
class RodProblem:
    """A robot of n subsegments and t tendons; `stiffness_scale` is already in the stiffnesses.

    Attributes:
        name: of the robot, for messages.
        length_m: of each subsegment, shape (n,) [m].
        bending_N_m2: EI, shape (n,) [N m^2].
        torsion_N_m2: GJ, shape (n,) [N m^2]; inf: cannot twist.
        axial_N: EA, shape (n,) [N]; inf: cannot stretch.
        shear_N: GA, shape (n,) [N]; inf: cannot shear.
        planar: whether a subsegment bends in the xz plane only, shape (n,).
        segment: index of the segment that it belongs to, shape (n,).
        disk_z_m: heights of the disks in the straight robot, disk 0 first, shape (n + 1,) [m].
        disk_mass_kg: of disks 1 to n, shape (n,) [kg].
        hole_m: (x, y) of each tendon's hole in each disk, in its frame, shape (t, n + 1, 2) [m].
        last_disk: number of the disk in which each tendon ends, 1 to n, shape (t,).
        mu: capstan coefficient at every hole, the base's included.
    """

    name: str
    length_m: Array
    bending_N_m2: Array
    torsion_N_m2: Array
    axial_N: Array
    shear_N: Array
    planar: NDArray[np.bool_]
    segment: NDArray[np.intp]
    disk_z_m: Array
    disk_mass_kg: Array
    hole_m: Array
    last_disk: NDArray[np.intp]
    mu: float


@dataclass(frozen=True)
class RodLoad:
    """What acts on a robot at each of r rows, in the base frame; the loads keep their direction.

    Attributes:
        tension_N: of each tendon at the base, shape (r, t) [N].
        force_N: on the centres of disks 1 to n, shape (r, n, 3) [N].
        moment_N_m: on the same disks, shape (r, n, 3) [N m].
    """

    tension_N: Array
    force_N: Array
    moment_N_m: Array

    def __len__(self) -> int:
        return len(self.tension_N)


def problem(robot: ContinuumRobot) -> RodProblem:
    """Return `robot` as arrays; its `effects`, `dynamics` and `links_per_subsegment` are not read.

    `stiffness_scale` multiplies all four stiffnesses, as a change of Young's modulus does.

    Raises:
        InputError: it has what no rod model carries (`unsupported`).
    """
    reason = unsupported(robot)
    if reason:
        raise InputError(f"{robot.name}: {reason}: the rod models do not carry it; 'CC' does")
    parts = [segment for segment in robot.segments for _ in range(disks(robot, segment))]
    length = np.array([segment.length_m / disks(robot, segment) for segment in parts])
    heights = np.concatenate([[0.0], np.cumsum(length)])

    def scaled(name: str) -> Array:
        return robot.stiffness_scale * np.array([float(getattr(segment, name)) for segment in parts])

    return RodProblem(
        name=robot.name,
        length_m=length,
        bending_N_m2=scaled("bending_stiffness_N_m2"),
        torsion_N_m2=scaled("torsion_stiffness_N_m2"),
        axial_N=scaled("axial_stiffness_N"),
        shear_N=scaled("shear_stiffness_N"),
        planar=np.array([segment.bending_axes == "x" for segment in parts]),
        segment=np.repeat(
            np.arange(len(robot.segments)), [disks(robot, segment) for segment in robot.segments]
        ),
        disk_z_m=heights,
        disk_mass_kg=disk_masses(robot),
        hole_m=np.array([[hole_xy_m(robot, item, z) for z in heights] for item in robot.tendons]).reshape(
            -1, len(heights), 2
        ),
        last_disk=np.array([last_disk(robot, item) for item in robot.tendons], dtype=np.intp),
        mu=robot.friction.mu,
    )


def unsupported(robot: ContinuumRobot) -> str:
    """Return what of `robot` no rod model carries, in words; empty where they carry it."""
    for segment in robot.segments:
        reason = _unsupported_segment(segment)
        if reason:
            return f"segments.{segment.name}: {reason}"
    if math.isfinite(robot.mount.axial_stiffness_N_per_m):
        return "mount: a mount that gives way"
    return ""


def _unsupported_segment(segment: Segment) -> str:
    if segment.bending_axes in ("y", "none"):
        return f"bending_axes = {segment.bending_axes}"
    if segment.hinge_share != 0.5:
        return "hinges off the middles"
    if segment.stiffness_cubic_m2 or segment.stiffness_quintic_m4:
        return "an elastic law that is not linear"
    if segment.plastic_share:
        return "a plastic part of the stiffness"
    if segment.rest_curvature_x_per_m or segment.rest_curvature_y_per_m:
        return "rest curvature"
    if segment.rest_twist_rad_per_m:
        return "rest twist"
    return ""


def unsupported_along(robot: ContinuumRobot) -> str:
    """Return the same of models whose tendons run beside the backbone, alike in all disks."""
    return unsupported(robot) or ("tendons that wind or converge" if winds_or_converges(robot) else "")


def is_rod(robot: ContinuumRobot) -> bool:
    """Return whether the rod models carry `robot`: linear, straight at rest, on a mount that holds."""
    return not unsupported(robot)


def load(rod: RodProblem, inputs: Inputs, gravity_mps2: Array) -> RodLoad:
    """Return the tensions, weights and tip loads of every row of `inputs`.

    Displacement inputs leave the tensions at zero: see `displacement.driven`.
    """
    rows, count = len(inputs), len(rod.length_m)
    force = np.zeros((rows, count, 3))
    moment = np.zeros((rows, count, 3))
    force += rod.disk_mass_kg[:, None] * np.asarray(gravity_mps2, dtype=float)
    force[:, -1] += inputs.force_tip
    moment[:, -1] += inputs.moment_tip
    tension = np.array(inputs.tendon, dtype=float)
    if inputs.actuation != "tension":
        tension[:] = 0.0
    return RodLoad(tension_N=tension, force_N=force, moment_N_m=moment)


def middles(rod: RodProblem) -> Array:
    """Return where straight tendons pass the middles of the straight robot's subsegments, (t, n, 2) [m]."""
    return np.asarray(0.5 * (rod.hole_m[:, 1:] + rod.hole_m[:, :-1]))


def _radii(rod: RodProblem) -> Array:
    """Return the largest distance of each tendon's holes from the backbone, shape (t,) [m]."""
    return np.asarray(np.hypot(rod.hole_m[..., 0], rod.hole_m[..., 1]).max(axis=1))


def linear_bends(rod: RodProblem, loads: RodLoad) -> Array:
    """Return the bends toward +x and +y that the straight robot's moments give, shape (r, n, 2) [rad]."""
    runs = np.arange(len(rod.length_m)) < rod.last_disk[:, None]  # (t, n)
    by_tendon = loads.tension_N @ (middles(rod) * runs[:, :, None]).transpose(2, 0, 1)  # (2, r, n)

    def beyond(value: Array) -> Array:
        return np.cumsum(value[:, ::-1], axis=1)[:, ::-1]

    force = loads.force_N[:, :, :2]
    moment = beyond(force * rod.disk_z_m[1:, None]) - beyond(force) * rod.disk_z_m[:-1, None]
    moment += np.moveaxis(by_tendon, 0, 2)
    twist = beyond(loads.moment_N_m)
    moment[:, :, 0] += twist[:, :, 1]
    moment[:, :, 1] -= twist[:, :, 0]
    return moment * (rod.length_m / rod.bending_N_m2)[:, None]


# ----------------------------------------------------------------------------------------------------
# The disks' poses of a rod model as postures and as a run.


class SolvedRods(Protocol):
    """What the solvers of all models return, row by row."""

    @property
    def load(self) -> RodLoad:
        """What was balanced."""

    @property
    def p_w(self) -> Array:
        """Of disks 0 to n, shape (r, n + 1, 3) [m]."""

    @property
    def R_w(self) -> Array:
        """Of the same disks, shape (r, n + 1, 3, 3)."""

    @property
    def span_tension(self) -> Array:
        """Of every tendon in every subsegment, shape (r, t, n) [N]."""

    @property
    def reached(self) -> Array:
        """Share of the load that is balanced, 1 where all of it is, shape (r,)."""


def require_reached(model: str, robot: ContinuumRobot, inputs: Inputs, reached: Array) -> None:
    """Raise `InputError` where a row's load was not reached; arguments as of `run_of`."""
    lost = reached < 1.0
    if lost.any():
        row = int(np.argmax(lost))
        raise InputError(
            f"{robot.name}: {model} finds no equilibrium at {row_name(inputs, row)}: from rest it gets to "
            f"{100.0 * reached[row]:.3g} % of the load"
        )


def run_of(
    model: str,
    robot: ContinuumRobot,
    rod: RodProblem,
    inputs: Inputs,
    gravity_mps2: Array,
    found: SolvedRods,
    residual: Array,
) -> StaticRun:
    """Return what a solver found as a run.

    Args:
        model: its name.
        robot, rod: the robot, and the same as arrays.
        inputs, gravity_mps2: as they were given.
        found: of all rows.
        residual: largest unbalanced moment, shape (r,) [N m].

    Raises:
        InputError: a row whose load was not reached.
    """
    require_reached(model, robot, inputs, found.reached)
    shapes = postures(robot, rod, found.p_w, found.R_w, found.load.tension_N, found.span_tension)
    return StaticRun(model, inputs, gravity_mps2, shapes, residual)


def postures(
    robot: ContinuumRobot,
    rod: RodProblem,
    p_w: Array,
    R_w: Array,
    actuator_tension: Array,
    span_tension: Array,
) -> tuple[Posture, ...]:
    """Return r postures of `robot`.

    Args:
        robot: the robot.
        rod: the same robot as arrays.
        p_w, R_w: of disks 0 to n, shapes (r, n + 1, 3) [m] and (r, n + 1, 3, 3).
        actuator_tension: shape (r, t) [N].
        span_tension: in every subsegment, shape (r, t, n) [N]; NaN is put in beyond a tendon's end.
    """
    angles = hinge_angles(robot, rod, R_w)
    runs = np.arange(len(rod.length_m)) < rod.last_disk[:, None]
    spans = np.where(runs, span_tension, np.nan)
    return tuple(
        Posture(p_w[row, 1:], R_w[row, 1:], angles[row], actuator_tension[row], spans[row])
        for row in range(len(p_w))
    )


def hinge_angles(robot: ContinuumRobot, rod: RodProblem, R_w: Array) -> Array:
    """Return the hinges' angles in the order of `joint_names`, shape (r, m) [rad].

    The turn from disk to disk, as a rotation vector, is shared equally by the hinges between them.

    Args:
        robot: the robot.
        rod: the same robot as arrays.
        R_w: orientations of disks 0 to n, shape (r, n + 1, 3, 3).
    """
    columns, signs = [], []
    for j in range(len(rod.length_m)):
        segment = robot.segments[rod.segment[j]]
        hinge = [(3 * j + 1, 1.0)]  # bending toward +x turns about +y, toward +y about -x
        if segment.bending_axes == "xy":
            hinge.append((3 * j, -1.0))
        if math.isfinite(segment.torsion_stiffness_N_m2):
            hinge.append((3 * j + 2, 1.0))
        for column, sign in hinge * robot.links_per_subsegment:
            columns.append(column)
            signs.append(sign / robot.links_per_subsegment)
    relative = np.swapaxes(R_w[:, :-1], -1, -2) @ R_w[:, 1:]
    return _rotation_vectors(relative).reshape(len(R_w), -1)[:, columns] * np.array(signs)


def _rotation_vectors(R: Array) -> Array:
    """Return rotations as vectors, shape (..., 3) [rad]; those near half a turn by way of quaternions."""
    twice = np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1
    )
    sine = 0.5 * np.sqrt((twice**2).sum(axis=-1))
    cosine = 0.5 * (R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2] - 1.0)
    straight = sine < 1e-8
    angle = np.arctan2(sine, cosine)
    vectors = twice * (0.5 * np.where(straight, 1.0, angle / np.where(straight, 1.0, sine)))[..., None]
    flipped = angle > 3.0
    if flipped.any():
        vectors[flipped] = Rotation.from_matrix(R[flipped]).as_rotvec()
    return vectors


# ----------------------------------------------------------------------------------------------------
# Tensions of a rod whose tendons are driven by displacement at the base.
#
# A tendon is a spring to its drive: T = max(0, p + k (u - d)), with the pretension p, the stiffness k of
# tendon and drive (of an inextensible one that of `constant_curvature.drive_stiffness`, as in CC and the
# simulation), the drive's displacement u and the shortening d of its path from rest. It pulls or is slack:
#
# 0 <= T, 0 <= T / k + d - u - p / k, one of the two zero.
#
# The path is the model's own: straight from hole to hole, or along the rod. The posture under given
# tensions is the one to which they lead in proportion from rest, so that a displacement has the posture of
# its tensions. Newton's method on the two conditions: the shortenings' derivative by the tensions is taken
# by differences, and the linear problem of which tendons are taut is solved at every step. Where it fails,
# it is begun with softer tendons, which are stiffened step by step: of stiff antagonists the straight robot
# knows the sum of tensions only by far too much, since chords shorten with the square of the bend.

_DIFFERENCE = 1e-4  # of a tension, over the one that bends the robot by 1 rad
_TOLERANCE = 1e-9  # last change of a tension, over the same
_MOST_ROUNDS = 20
_FARTHEST = 10.0  # change of a tension, over the same: beyond it the linear problem says nothing
# Compliances added to the tendons', over that of the bending robot: with the tendons' own alone, and,
# where that fails, from soft tendons to their own.
_AT_ONCE = (0.0,)
_SOFTENING = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0)
_MOST_SWAPS = 50

Found = TypeVar("Found", bound=SolvedRods)


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
    rod: RodProblem,
    inputs: Inputs,
    loads: RodLoad,
    solve: Callable[[RodLoad], Found],
    lengths: Callable[[Found], Array],
) -> RodLoad:
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
    rod: RodProblem,
    drive: DisplacementDrive,
    loads: RodLoad,
    solve: Callable[[RodLoad], Found],
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
    bending = _radii(rod) / typical  # compliance at the tendon, [m/N]
    tension, good = np.zeros(target.shape), np.zeros(len(target), dtype=bool)
    for softening in (_AT_ONCE, _SOFTENING):
        left = np.flatnonzero(~good)
        tension[left] = 0.0
        for softer in softening:
            part = RodLoad(tension[left], loads.force_N[left], loads.moment_N_m[left])
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
    loads: RodLoad,
    rod: RodProblem,
    solve: Callable[[RodLoad], Found],
    lengths: Callable[[Found], Array],
) -> tuple[Array, NDArray[np.bool_]]:
    """Return tensions where compliance T + d meets `target` or T is zero, and the rows that balance.

    `loads` holds the tensions to start from, `typical` what bends the robot by 1 rad, shape (t,) [N].
    """
    rows, tendons = target.shape
    tension, good = loads.tension_N.copy(), np.zeros(rows, dtype=bool)
    straight = lengths_at_rest(rod)
    shift = np.concatenate([np.zeros((1, tendons)), np.diag(_DIFFERENCE * typical)])
    left = np.arange(rows)
    for _ in range(_MOST_ROUNDS):
        # Each row and, next to it, the same with each tension a little higher.
        tries = (tension[left, None] + shift).reshape(-1, tendons)
        around = np.repeat(left, tendons + 1)
        found = solve(RodLoad(tries, loads.force_N[around], loads.moment_N_m[around]))
        short = (straight - lengths(found)).reshape(-1, tendons + 1, tendons)
        slope = np.swapaxes(short[:, 1:] - short[:, :1], 1, 2) / (_DIFFERENCE * typical)
        slope += np.diag(compliance)
        here = tension[left] * compliance + short[:, 0] - target[left]
        constant = here - np.einsum("rij,rj->ri", slope, tension[left])
        kept = (found.reached == 1.0).reshape(-1, tendons + 1).all(axis=1)
        new = np.zeros((len(left), tendons))
        for row in np.flatnonzero(kept):
            new[row] = taut(slope[row], constant[row])
        change = (np.abs(new - tension[left]) / typical).max(axis=1)
        kept &= change < _FARTHEST
        tension[left[kept]] = new[kept]
        good[left[kept & (change < _TOLERANCE)]] = True
        left = left[kept & (change >= _TOLERANCE)]
        if not left.size:
            break
    return tension, good


def _bending_tensions(rod: RodProblem) -> Array:
    """Return the tension of each tendon that would bend the robot by 1 rad, shape (t,) [N]."""
    radius = np.maximum(_radii(rod), 1e-3 * rod.disk_z_m[-1])
    compliance = np.cumsum(rod.length_m / rod.bending_N_m2)[rod.last_disk - 1]
    return np.asarray(1.0 / (radius * compliance))


def taut(matrix: Array, constant: Array) -> Array:
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


def lengths_at_rest(rod: RodProblem) -> Array:
    """Return the lengths of the tendons' paths in the straight robot, shape (t,) [m]."""
    aside = np.linalg.norm(np.diff(rod.hole_m, axis=1), axis=2)
    runs = np.arange(len(rod.length_m)) < rod.last_disk[:, None]
    return np.asarray((np.hypot(rod.length_m, aside) * runs).sum(axis=1))


def straight_lengths(found: SolvedRods, rod: RodProblem) -> Array:
    """Return the lengths of tendons that are straight from disk to disk, shape (r, t) [m]."""
    at = found.p_w[:, :, None] + np.einsum("rjab,tjb->rjta", found.R_w[..., :2], rod.hole_m)
    spans = np.linalg.norm(np.diff(at, axis=1), axis=-1)  # (r, n, t)
    runs = np.arange(spans.shape[1])[:, None] < rod.last_disk
    return np.asarray((spans * runs).sum(axis=1))


# ----------------------------------------------------------------------------------------------------
# Equilibria of a tendon-driven Cosserat rod: rows of loads in, postures and their evidence out.
#
# A row's equilibrium is the one that its loads lead to when they grow in proportion from rest, so that it
# does not depend on the rows around it. Only a row so near to the one before that one step of little turn
# leads there starts from that, as the robot would. Where the way from rest ends (the robot would snap), the
# other ways are tried: from the row before, and with the tensions or the other loads first. Without
# friction, rows far from the one before are solved eight at once, where one step from rest leads there.

PATHS = {
    "continuous": rod_sections.CONTINUOUS,
    "projected": rod_sections.PROJECTED,
    "eyelets": rod_sections.EYELETS,
    "lumens": rod_sections.LUMENS,
    "moment": rod_sections.MOMENT,
    "tip_force": rod_sections.TIP_FORCE,
}
# Steps of the integration along the whole robot: the tip is then within 2e-7 of the length.
STEPS = {"continuous": 40, "projected": 80, "eyelets": 80, "lumens": 40, "moment": 80, "tip_force": 80}
_ROUGHER = 4  # steps of the balance, over those of its derivative


@dataclass(frozen=True)
class Equilibria:
    """Equilibria of a rod under r rows of loads, and the evidence.

    Attributes:
        rod, load: what was asked.
        path: of the tendons: a key of `PATHS`.
        p_w: centres of disks 0 to n, shape (r, n + 1, 3) [m].
        R_w: their orientations, shape (r, n + 1, 3, 3).
        span_tension: of every tendon in every subsegment, zero beyond its end, shape (r, t, n) [N].
        wrench: moment [N m] and force [N] in the backbone at each subsegment's start, in the frame
            there; on a continuous path of the backbone and its tendons together; shape (r, n, 6).
        unbalanced: moment [N m] and force [N] left at disks 1 to n, in their frames, shape (r, n, 6).
        reached: share of the way from rest to the row's load, shape (r,); below 1 no way led there and
            the row's posture is none.
        corrections: of Newton's method, shape (r,).
    """

    rod: RodProblem
    load: RodLoad
    path: str
    p_w: Array
    R_w: Array
    span_tension: Array
    wrench: Array
    unbalanced: Array
    reached: Array
    corrections: NDArray[np.intp]


def equilibria(
    rod: RodProblem,
    loads: RodLoad,
    path: str,
    steps: int = 0,
    longest_step: float = 1.0,
    threads: int = 1,
) -> Equilibria:
    """Return the equilibria of `rod` under `loads`: see the module's text.

    Args:
        rod: the robot.
        loads: tensions, forces and moments, r rows.
        path: "continuous" (VC), "projected" (VC_ref), "eyelets" (VC_ref_noproj), "moment" (VC_moment),
            "tip_force" (VC_tip_force), or "lumens": as "continuous" with the forces of passing tendons
            where another one ends, which VC leaves out.
        steps: of the integration along the whole robot, at least; 0: as in `STEPS`.
        longest_step: share of the load that one step of a way may take.
        threads: among which the rows are shared out.
    """
    rows, n, tendons = len(loads), len(rod.length_m), len(rod.hole_m)
    result = Equilibria(
        rod=rod,
        load=loads,
        path=path,
        p_w=np.zeros((rows, n + 1, 3)),
        R_w=np.tile(np.eye(3), (rows, n + 1, 1, 1)),
        span_tension=np.zeros((rows, tendons, n)),
        wrench=np.zeros((rows, n, 6)),
        unbalanced=np.zeros((rows, n, 6)),
        reached=np.zeros(rows),
        corrections=np.zeros(rows, dtype=np.intp),
    )
    rough, fine = sections(rod, (steps or STEPS[path]) // _ROUGHER), sections(rod, steps or STEPS[path])
    shift = np.zeros((rows, n, 3))
    holes, tension = np.ascontiguousarray(rod.hole_m), np.ascontiguousarray(loads.tension_N)
    hole = np.ascontiguousarray(holes[:, 0])
    applied = np.concatenate([loads.moment_N_m, loads.force_N], axis=2)

    robot = TendonRod(PATHS[path], rough, fine, hole, holes, rod.last_disk, float(rod.mu))
    together = rows >= LANES and rod.mu == 0.0 and longest_step >= 1.0
    far = far_from_before(rod, loads) if together else np.zeros(rows, dtype=bool)

    def solve(part: slice) -> None:
        given = tension[part], applied[part]
        states = result.wrench, result.span_tension, shift, result.R_w, result.unbalanced
        found = RodRows(*(array[part] for array in states))
        ended = result.reached[part], result.corrections[part]
        chosen = np.flatnonzero(far[part])
        chosen = chosen[: len(chosen) // LANES * LANES]
        if len(chosen):
            follow_together(robot, chosen, *given, found, *ended)
        follow(robot, *given, found, *ended, longest_step)

    share_out(solve, rows, threads)
    moved = (result.R_w[:, :-1] @ shift[..., None])[..., 0]
    np.cumsum(moved, axis=1, out=result.p_w[:, 1:])
    return result


def far_from_before(rod: RodProblem, loads: RodLoad) -> NDArray[np.bool_]:
    """Return which rows do not start from the row before, by the turn of the straight robot, shape (r,)."""
    change = np.diff(linear_bends(rod, loads), axis=0)
    turn = np.hypot(change[:, :, 0], change[:, :, 1]).sum(axis=1)
    return np.concatenate([[True], turn > NEAR_RAD])


def path_lengths(found: Equilibria) -> Array:
    """Return the lengths of the tendons' paths from the base to their ends, shape (r, t) [m]."""
    rod = found.rod
    if found.path in ("projected", "eyelets"):
        return straight_lengths(found, rod)
    length = np.zeros(found.load.tension_N.shape)
    # Where tendons act at their ends alone, the wrench is the backbone's: none of it is theirs.
    along = found.span_tension * (found.path in ("continuous", "lumens"))
    measure_paths(
        sections(rod, 1), np.ascontiguousarray(rod.hole_m[:, 0]), rod.last_disk, along, found.wrench,
        found.p_w, found.R_w, length,
    )  # fmt: skip
    return length


def sections(rod: RodProblem, steps: int) -> Array:
    """Return the subsegments as the compiled code takes them, shape (n, 8).

    `steps`: of the integration along the whole robot, at least.
    """
    bending = 1.0 / rod.bending_N_m2
    shear = 1.0 / rod.shear_N
    step = rod.disk_z_m[-1] / steps
    columns = [
        np.where(rod.planar, 0.0, bending),
        bending,
        1.0 / rod.torsion_N_m2,
        shear,
        np.where(rod.planar, 0.0, shear),
        1.0 / rod.axial_N,
        rod.length_m,
        np.ceil(rod.length_m / step - 1e-6),
    ]
    return np.ascontiguousarray(np.stack(columns, axis=1))


def static_run(
    model: str, path: str, robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array
) -> StaticRun:
    """Return the postures of `robot` under `inputs` for one kind of tendon path.

    Raises:
        InputError: what no rod model carries, displacements that no posture follows, or a row without
            an equilibrium that continuation from the row before or from rest would reach.
    """
    rod = problem(robot)
    gravity = np.asarray(gravity_mps2, dtype=float)
    loads = load(rod, inputs, gravity)
    if inputs.actuation == "displacement":
        loads = driven(
            model, robot, rod, inputs, loads, lambda rows: equilibria(rod, rows, path), path_lengths
        )
    found = equilibria(rod, loads, path)
    return run_of(
        model, robot, rod, inputs, gravity, found, np.abs(found.unbalanced[:, :, :3]).max(axis=(1, 2))
    )


# ----------------------------------------------------------------------------------------------------
# The static model VC: a Cosserat rod whose tendons are held to its shape everywhere.
#
# Rao et al. 2021 (doi 10.3389/frobt.2020.630245, Eqs 24-41; after Rucker and Webster 2011). Torsion, shear
# and extension included; exact for tendons in lumens, for spacer disks an approximation that improves with
# their number.


def vc(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` under `inputs`, row after row.

    Args:
        robot: any linear robot, straight at rest; its `effects` are not read.
        inputs: tensions or displacements, and loads on the tip.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: the robot or the inputs are not for this model, or a row has no equilibrium.
    """
    return static_run("VC", "continuous", robot, inputs, gravity_mps2)


# ----------------------------------------------------------------------------------------------------
# The static models VC_moment and VC_tip_force: a Cosserat rod that tendons load at their ends alone.
#
# Rao et al. 2021 (doi 10.3389/frobt.2020.630245, Section 5.1.1, Eqs 24-25). The force is along the last
# disk's normal, toward the base; what the tendons do on their way is left out. Of an arc the moment alone is
# right (Camarillo 2008b); force and moment together miss what holds the tendon to the backbone, and bend too
# little.


def vc_moment(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` whose tendons are moments at their ends (Eq. 25); see `vc`."""
    return static_run("VC_moment", "moment", robot, inputs, gravity_mps2)


def vc_tip_force(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` whose tendons are forces at their ends (Eqs 24-25); see `vc`."""
    return static_run("VC_tip_force", "tip_force", robot, inputs, gravity_mps2)


# ----------------------------------------------------------------------------------------------------
# The static models VC_ref and VC_ref_noproj: a Cosserat rod, its tendons straight from disk to disk.
#
# Rao et al. 2021 (doi 10.3389/frobt.2020.630245, Eqs 30-41). VC_ref leaves out what the two spans of a
# tendon together push a disk by along its own axis (Eq. 58): the benchmark's reference. That force is not
# zero in an eyelet without friction, where the tension is the same on both sides; VC_ref_noproj keeps it
# and is what MuJoCo's spatial tendons do.


def vc_ref(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` with the disks' forces of Eq. 58; see `vc.vc`."""
    return static_run("VC_ref", "projected", robot, inputs, gravity_mps2)


def vc_ref_noproj(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` with tendons through eyelets; see `vc.vc`."""
    return static_run("VC_ref_noproj", "eyelets", robot, inputs, gravity_mps2)
