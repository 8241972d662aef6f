"""The same rods by collocation, in plain NumPy and SciPy: the slow second solver of `rods.equilibria`.

The equations as Rao et al. 2021 write them (doi 10.3389/frobt.2020.630245, Eqs 2-3, 24-41, 58), for the
wrench of the backbone alone, in the base frame; the tendons' distributed force with p'' where Eq. 28
prints p', acting on the rod and not on the tendon. Frictionless; every stiffness finite.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_bvp

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.rods import RodProblem

# State of a piece, stacked: position, quaternion (w first), force and moment in the base frame.
_SIZE = 13
_P, _Q, _N, _M = slice(0, 3), slice(3, 7), slice(7, 10), slice(10, 13)


@dataclass(frozen=True)
class Ends:
    """Poses and wrenches of a rod at the disks 0 to n.

    Attributes:
        p_w: shape (n + 1, 3) [m].
        R_w: shape (n + 1, 3, 3).
        residual: largest relative residual of the differential equations.
    """

    p_w: Array
    R_w: Array
    residual: float


def collocate(
    rod: RodProblem,
    tension_N: Array,
    force_N: Array,
    moment_N_m: Array,
    path: str,
    load_steps: int = 5,
    tolerance: float = 1e-9,
) -> Ends:
    """Return the equilibrium of `rod` under one load, the load growing in equal steps from zero.

    Args:
        rod: the robot, without friction, every stiffness finite.
        tension_N: shape (t,) [N].
        force_N, moment_N_m: on disks 1 to n, base frame, shape (n, 3).
        path: "continuous", "projected" or "eyelets", as in `rods.equilibria`.
        load_steps: number of steps.
        tolerance: of the differential equations' relative residual.

    Raises:
        InputError: the rod is locked or planar somewhere or has friction, or SciPy does not converge.
    """
    stiffness = [rod.bending_N_m2, rod.torsion_N_m2, rod.axial_N, rod.shear_N]
    if not np.isfinite(stiffness).all() or rod.planar.any() or rod.mu != 0.0:
        raise InputError(f"{rod.name}: collocation takes frictionless robots with finite stiffnesses only")
    n = len(rod.length_m)
    place = np.linspace(0.0, 1.0, 5)
    straight = np.zeros((n, _SIZE, len(place)))
    straight[:, 3] = 1.0
    straight[:, 2] = rod.disk_z_m[:-1, None] + rod.length_m[:, None] * place
    state = straight.reshape(n * _SIZE, -1)
    for step in range(1, load_steps + 1):
        share = step / load_steps
        tension = share * np.asarray(tension_N, dtype=float)
        found = solve_bvp(
            lambda _, y, tension=tension: _rates(rod, tension, path, y),
            lambda a, b, share=share, tension=tension: _conditions(
                rod, tension, share * force_N, share * moment_N_m, path, a, b
            ),
            place,
            state,
            tol=tolerance if step == load_steps else 1e-4,
            max_nodes=2000,
        )
        if found.status != 0:
            raise InputError(f"{rod.name}: collocation fails at {share:.0%} of the load: {found.message}")
        place, state = found.x, found.y
    first, last = state[:, 0].reshape(n, _SIZE), state[:, -1].reshape(n, _SIZE)
    p_w = np.concatenate([first[:1, _P], last[:, _P]])
    R_w = _matrices(np.concatenate([first[:1, _Q], last[:, _Q]]))
    return Ends(p_w, R_w, float(found.rms_residuals.max()))


def _matrices(q: Array) -> Array:
    """Return the rotations of quaternions, shape (..., 4) to (..., 3, 3), normalised."""
    w, x, y, z = np.moveaxis(q / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0)
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=-1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=-1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=-1),
        ],
        axis=-2,
    )


def _cross_matrix(a: Array) -> Array:
    """Return [a]x, shape (..., 3) to (..., 3, 3)."""
    x, y, z = np.moveaxis(a, -1, 0)
    zero = np.zeros_like(x)
    return np.stack(
        [
            np.stack([zero, -z, y], axis=-1),
            np.stack([z, zero, -x], axis=-1),
            np.stack([-y, x, zero], axis=-1),
        ],
        axis=-2,
    )


def _strains(rod: RodProblem, y: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Return R, v, u and the wrench (n, m) in the body's frame at `y`, shape (pieces, points, 13)."""
    R = _matrices(y[..., _Q])
    n = np.einsum("...ji,...j->...i", R, y[..., _N])
    m = np.einsum("...ji,...j->...i", R, y[..., _M])
    soft_shear = np.stack([rod.shear_N, rod.shear_N, rod.axial_N], axis=-1)[:, None]
    soft_bend = np.stack([rod.bending_N_m2, rod.bending_N_m2, rod.torsion_N_m2], axis=-1)[:, None]
    return R, n / soft_shear + np.array([0.0, 0.0, 1.0]), m / soft_bend, n, m


def _rates(rod: RodProblem, tension: Array, path: str, y: Array) -> Array:
    """Return the derivative of the stacked state by the share of each piece's length."""
    pieces = len(rod.length_m)
    y = np.moveaxis(y.reshape(pieces, _SIZE, -1), 1, 2)
    R, v, u, n, m = _strains(rod, y)
    rate = np.empty_like(y)
    rate[..., _P] = np.einsum("...ij,...j->...i", R, v)
    w, x, yy, z = np.moveaxis(y[..., _Q], -1, 0)
    ux, uy, uz = np.moveaxis(u, -1, 0)
    rate[..., _Q] = 0.5 * np.stack(
        [
            -x * ux - yy * uy - z * uz,
            w * ux + yy * uz - z * uy,
            w * uy + z * ux - x * uz,
            w * uz + x * uy - yy * ux,
        ],
        axis=-1,
    )
    force = np.zeros_like(n)  # of the tendons, per length, in the body's frame
    couple = np.zeros_like(n)
    if path == "continuous":
        force, couple = _tendons_along(rod, tension, v, u, n, m)
    rate[..., _N] = -np.einsum("...ij,...j->...i", R, force)
    rate[..., _M] = -np.cross(rate[..., _P], y[..., _N]) - np.einsum("...ij,...j->...i", R, couple)
    rate *= rod.length_m[:, None, None]
    return np.moveaxis(rate, 2, 1).reshape(pieces * _SIZE, -1)


def _tendons_along(
    rod: RodProblem, tension: Array, v: Array, u: Array, n: Array, m: Array
) -> tuple[Array, Array]:
    """Return the force and the moment per length of continuous tendons on the rod, in the body's frame.

    Eqs 28-29 with p_k'' = u x p_k' + v' + u' x r_k; the strains' derivatives are those of the wrench
    that the tendons change: six linear equations at each point.
    """
    shape = v.shape[:-1]
    by_v, by_u = np.zeros((*shape, 3, 3)), np.zeros((*shape, 3, 3))  # force per v' and u'
    turn_v, turn_u = np.zeros((*shape, 3, 3)), np.zeros((*shape, 3, 3))  # moment per v' and u'
    constant, turn = np.zeros((*shape, 3)), np.zeros((*shape, 3))
    runs = np.arange(len(rod.length_m)) < rod.last_disk[:, None]
    for k, pull in enumerate(tension):
        r = np.array([*rod.hole_m[k, 0], 0.0])
        arm = _cross_matrix(r)
        a = v + np.cross(u, r)
        length = np.linalg.norm(a, axis=-1)
        across = -_cross_matrix(a) @ _cross_matrix(a)
        each = (pull * runs[k])[:, None, None, None] * across / length[..., None, None] ** 3
        begun = np.einsum("...ij,...j->...i", each, np.cross(u, a))
        by_v += each
        by_u -= each @ arm
        constant += begun
        turn_v += arm @ each
        turn_u -= arm @ each @ arm
        turn += np.cross(r, begun)
    soft_shear = np.stack([rod.shear_N, rod.shear_N, rod.axial_N], axis=-1)[:, None]
    soft_bend = np.stack([rod.bending_N_m2, rod.bending_N_m2, rod.torsion_N_m2], axis=-1)[:, None]
    matrix = np.empty((*shape, 6, 6))
    matrix[..., :3, :3] = by_v + np.eye(3) * soft_shear[..., None]
    matrix[..., :3, 3:] = by_u
    matrix[..., 3:, :3] = turn_v
    matrix[..., 3:, 3:] = turn_u + np.eye(3) * soft_bend[..., None]
    right = np.concatenate([-np.cross(u, n) - constant, -np.cross(u, m) - np.cross(v, n) - turn], axis=-1)
    change = np.linalg.solve(matrix, right[..., None])[..., 0]
    dv, du = change[..., :3], change[..., 3:]
    force = constant + np.einsum("...ij,...j->...i", by_v, dv) + np.einsum("...ij,...j->...i", by_u, du)
    moment = turn + np.einsum("...ij,...j->...i", turn_v, dv) + np.einsum("...ij,...j->...i", turn_u, du)
    return force, moment


def _conditions(
    rod: RodProblem, tension: Array, force: Array, moment: Array, path: str, start: Array, end: Array
) -> Array:
    """Return what the pieces' ends miss of the base, of one another and of the disks' balance."""
    n = len(rod.length_m)
    start, end = start.reshape(n, _SIZE), end.reshape(n, _SIZE)
    misses = [start[0, _P], start[0, _Q] - np.array([1.0, 0.0, 0.0, 0.0])]
    R_start, R_end = _matrices(start[:, _Q]), _matrices(end[:, _Q])
    for j in range(n):
        above = start[j + 1, 7:] if j + 1 < n else np.zeros(6)
        pull, couple = force[j].copy(), moment[j].copy()
        for k, size in enumerate(tension):
            if rod.last_disk[k] < j + 1:
                continue
            arm = R_end[j] @ [*rod.hole_m[k, 0], 0.0]
            one = _tendon_at_disk(rod, k, j, path, start, end, R_start, R_end)
            pull += size * one
            couple += np.cross(arm, size * one)
        misses += [above[:3] + pull - end[j, _N], above[3:] + couple - end[j, _M]]
        if j + 1 < n:
            misses.append(start[j + 1, :7] - end[j, :7])
    return np.concatenate(misses)


def _tendon_at_disk(
    rod: RodProblem, k: int, j: int, path: str, start: Array, end: Array, R_start: Array, R_end: Array
) -> Array:
    """Return the force on disk j + 1 per tension of tendon k, in the base frame (Eqs 24, 30, 32, 58)."""
    r = np.array([*rod.hole_m[k, 0], 0.0])
    last = rod.last_disk[k] == j + 1
    if path == "continuous":
        if not last:
            return np.zeros(3)
        strained = np.repeat(end[None, j : j + 1], len(rod.length_m), axis=0)
        _, v, u, _, _ = _strains(rod, strained)
        along = v[j, 0] + np.cross(u[j, 0], r)
        return -R_end[j] @ along / np.linalg.norm(along)
    here = end[j, _P] + R_end[j] @ r
    below = start[j, _P] + R_start[j] @ r - here
    result = below / np.linalg.norm(below)
    if not last:
        above = end[j + 1, _P] + R_end[j + 1] @ r - here
        result = result + above / np.linalg.norm(above)
        if path == "projected":
            axis = R_end[j][:, 2]
            result = result - axis * (result @ axis)
    return result
