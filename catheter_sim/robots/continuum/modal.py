"""Static models whose curvature is a sum of a few functions along each segment, solved by energy.

Rao et al. 2021 (doi 10.3389/frobt.2020.630245, Section 3.2.3, Eq. 13). A posture is in balance where

V = 1/2 integral of u K u ds + sum of T_k l_k - work of weights and tip loads

is stationary. The first part is the strain energy of the backbone: bending, and torsion where it twists. The
second is each tension times the length of its tendon, which runs straight from disk to disk and slides
without friction. The third are dead loads.
So all three come to `VC_ref_noproj` as the number of functions grows (without its stretch and shear). They
differ in what the bend may be:

- `polynomial`: curvature a polynomial in s along each segment (Della Santina and Rus 2020), of degree 2;
- `haar`: curvature by the Haar wavelets (Gravagne and Walker 2000), constant on each quarter of a segment;
- `taylor`: each segment's pose is the Taylor series of an arc's in its bend (Godage 2011), to sixth order:
  no singularity where the robot is straight, no twist, and a pose that is worse the farther it bends.

The survey names functions and no numbers of them: these are assumed. Curvature is taken for constant on
short pieces, a multiple of four between two disks, so that quarters of a segment end where pieces end.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.statics import StaticRun
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.eight import solve_columns_of_any
from catheter_sim.mechanics.vectors import largest_size
from catheter_sim.robots.continuum.rods import (
    RodLoad,
    RodProblem,
    driven,
    linear_bends,
    load,
    problem,
    run_of,
    share_out,
    straight_lengths,
    unsupported,
)
from catheter_sim.robots.continuum.spec import ContinuumRobot

# ----------------------------------------------------------------------------------------------------
# The bases: which functions, on which pieces of the robot.

_PIECES, _LEAST_PIECES = 4, 40  # between two disks or a multiple of it, of a segment at least
# Order of the pose's series in its turn. Beyond 14 the next term is below 1e-16 up to half a radian a piece.
_EXACT_ORDER, _TAYLOR_ORDER = 14, 6  # even; the second one is assumed


@dataclass(frozen=True)
class Basis:
    """Functions of one segment's curvature.

    Attributes:
        name: of the static model.
        values: places in a segment, shape (q,) of 0 to 1, to the functions there, shape (q, m).
        order: of the series of a piece's pose in its turn.
        from_segment: whether each disk's pose is one series from its segment's base, instead of piece after
            piece.
        twists: whether the backbone's twist is a sum of the same functions, instead of none.
    """

    name: str
    values: Any
    order: int = _EXACT_ORDER
    from_segment: bool = False
    twists: bool = True


def _legendre(at: Array) -> Array:
    """Return polynomials of degree 0 to 2, orthogonal on 0 to 1, shape (q, 3)."""
    x = 2.0 * at - 1.0
    return np.stack([np.ones_like(x), x, 1.5 * x**2 - 0.5], axis=1)


def _haar(at: Array) -> Array:
    """Return the box, its halves' difference and either half's, orthonormal on 0 to 1, shape (q, 4)."""

    def wavelet(x: Array) -> Array:
        return np.where((x > 0.0) & (x < 1.0), np.where(x < 0.5, 1.0, -1.0), 0.0)

    halves = [np.sqrt(2.0) * wavelet(2.0 * at - k) for k in (0, 1)]
    return np.stack([np.ones_like(at), wavelet(at), *halves], axis=1)


def _constant(at: Array) -> Array:
    return np.ones((len(at), 1))


POLYNOMIAL = Basis("polynomial", _legendre)
HAAR = Basis("haar", _haar)
TAYLOR = Basis("taylor", _constant, order=_TAYLOR_ORDER, from_segment=True, twists=False)


class Pieces(NamedTuple):
    """A robot of S segments, n disks and t tendons in Q pieces, as the loops take it; m functions a segment.

    Attributes:
        segment: of each piece, shape (Q,).
        parent: frame from which a piece starts, 0 for the base, q + 1 for the end of piece q, shape (Q,).
        length: shape (Q,) [m].
        share: functions in a piece's middle times its share of the segment's length: what they turn it by,
            shape (Q, m).
        frame: in which each disk stands, disk 0 first, shape (n + 1,).
        order: of the series of a piece's pose.
        gram: integral of the functions' products over a segment's, shape (S, m, m).
        stiffness: about x, y and z, over the segment's length, shape (S, 3) [N m].
        free: whether it bends so, shape (S, 3).
        hole: of each tendon in each disk, shape (t, n + 1, 2) [m].
        last: number of the disk where each tendon ends, shape (t,).
    """

    segment: NDArray[np.intp]
    parent: NDArray[np.intp]
    length: Array
    share: Array
    frame: NDArray[np.intp]
    order: int
    gram: Array
    stiffness: Array
    free: NDArray[np.bool_]
    hole: Array
    last: NDArray[np.intp]


def pieces(rod: RodProblem, basis: Basis) -> Pieces:
    """Return a robot cut into the pieces of a basis."""
    count = int(rod.segment[-1]) + 1
    segment, parent, length, share, frame, gram = [], [], [], [], [0], []
    for s in range(count):
        own = np.flatnonzero(rod.segment == s)
        base, total = frame[-1], rod.length_m[own].sum()
        cuts = 1 if basis.from_segment else _PIECES * -(-_LEAST_PIECES // (_PIECES * len(own)))
        ends = np.concatenate([[0.0], np.cumsum(np.repeat(rod.length_m[own] / cuts, cuts))]) / total
        middle, width = 0.5 * (ends[1:] + ends[:-1]), np.diff(ends)
        values = basis.values(middle)
        gram.append((values * width[:, None]).T @ values)
        for q in range(len(width)):
            if basis.from_segment:
                parent.append(base)
                length.append(total * ends[q + 1])
                share.append(values[q] * ends[q + 1])
            else:
                parent.append(len(length))
                length.append(total * width[q])
                share.append(values[q] * width[q])
            segment.append(s)
            if (q + 1) % cuts == 0:
                frame.append(len(length))
    first = [int(np.flatnonzero(rod.segment == s)[0]) for s in range(count)]
    total = np.array([rod.length_m[rod.segment == s].sum() for s in range(count)])
    stiffness = np.stack([rod.bending_N_m2[first]] * 2 + [rod.torsion_N_m2[first]], axis=1) / total[:, None]
    free = np.stack(
        [~rod.planar[first], np.ones(count, bool), basis.twists & np.isfinite(stiffness[:, 2])], axis=1
    )
    return Pieces(
        np.array(segment), np.array(parent), np.array(length), np.array(share), np.array(frame), basis.order,
        np.array(gram), np.where(free, stiffness, 1.0), free, np.ascontiguousarray(rod.hole_m), rod.last_disk,
    )  # fmt: skip


# ----------------------------------------------------------------------------------------------------
# Poses of the pieces and the energy's gradient, compiled.
#
# A piece turned by w, W = [w]x, ends at R = I + a W + b W^2 and p = length (z + b W z + c W^2 z): series of
# exp(W) and of its mean along the piece, to an even order. The gradient is taken backward from the tip: what
# the energy changes by with each frame's position and axes is passed on to the frame that it starts from.


@compiled
def _series(square: float, order: int, out: Array) -> None:
    """Write a, b and c, and their derivatives by the turn's square, shape (6,)."""
    for k in range(3):  # sum over i of (-square)^i / (2 i + 1 + k)!
        out[k] = out[3 + k] = 0.0
        term, slope = 1.0, 0.0
        for j in range(2, 2 + k):
            term /= j
        for i in range(order // 2):
            out[k] += term
            out[3 + k] += slope
            factor = -1.0 / ((2 * i + 2 + k) * (2 * i + 3 + k))
            slope = factor * (slope * square + term)
            term *= factor * square


@compiled
def _turn_of(robot: Pieces, x: Array, q: int, w: Array) -> None:
    """Write the rotation vector of piece q at the unknowns x, shape (S, 3, m) [rad]."""
    for c in range(3):
        w[c] = 0.0
        for r in range(x.shape[2]):
            w[c] += x[robot.segment[q], c, r] * robot.share[q, r]


@compiled
def _step_of(w: Array, f: Array, E: Array, e: Array) -> None:
    """Write the turn of a piece, shape (3, 3), and its shift over its length, shape (3,)."""
    square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    for i in range(3):
        for j in range(3):  # W^2 = w w^T - |w|^2
            E[i, j] = f[1] * w[i] * w[j]
        E[i, i] += 1.0 - f[1] * square
        e[i] = f[2] * w[i] * w[2]
    e[2] += 1.0 - f[2] * square
    E[0, 1] -= f[0] * w[2]
    E[1, 0] += f[0] * w[2]
    E[0, 2] += f[0] * w[1]
    E[2, 0] -= f[0] * w[1]
    E[1, 2] -= f[0] * w[0]
    E[2, 1] += f[0] * w[0]
    e[0] += f[1] * w[1]
    e[1] -= f[1] * w[0]


@compiled
def poses(robot: Pieces, x: Array, p: Array, R: Array) -> None:
    """Write the frames' positions, shape (Q + 1, 3) [m], and axes, shape (Q + 1, 3, 3)."""
    w, f, E, e = np.empty(3), np.empty(6), np.empty((3, 3)), np.empty(3)
    p[0] = 0.0
    R[0] = np.eye(3)
    for q in range(len(robot.segment)):
        _turn_of(robot, x, q, w)
        _series(w[0] * w[0] + w[1] * w[1] + w[2] * w[2], robot.order, f)
        _step_of(w, f, E, e)
        start = robot.parent[q]
        for i in range(3):
            p[q + 1, i] = p[start, i]
            for j in range(3):
                p[q + 1, i] += robot.length[q] * R[start, i, j] * e[j]
                R[q + 1, i, j] = 0.0
                for k in range(3):
                    R[q + 1, i, j] += R[start, i, k] * E[k, j]


@compiled
def _pull_disks(robot: Pieces, tension: Array, p: Array, R: Array, by_p: Array, by_R: Array) -> None:
    """Add what tension times length changes by with the disks' positions and axes."""
    low, high, along = np.empty(3), np.empty(3), np.empty(3)
    for k in range(len(tension)):
        before_x = before_y = 0.0
        for d in range(robot.last[k] + 1):
            to, x, y = robot.frame[d], robot.hole[k, d, 0], robot.hole[k, d, 1]
            for i in range(3):
                high[i] = p[to, i] + R[to, i, 0] * x + R[to, i, 1] * y
                along[i] = high[i] - low[i]
            if d > 0:
                start = robot.frame[d - 1]
                size = np.sqrt(along[0] ** 2 + along[1] ** 2 + along[2] ** 2)
                for i in range(3):
                    pull = tension[k] * along[i] / size
                    by_p[to, i] += pull
                    by_R[to, i, 0] += pull * x
                    by_R[to, i, 1] += pull * y
                    by_p[start, i] -= pull
                    by_R[start, i, 0] -= pull * before_x
                    by_R[start, i, 1] -= pull * before_y
            low[:] = high
            before_x, before_y = x, y


@compiled
def _load_disks(robot: Pieces, force: Array, moment: Array, R: Array, by_p: Array, by_R: Array) -> None:
    """Subtract the loads' work: of a moment M with a turn t M . t, half of [M]x : [t]x."""
    for d in range(len(force)):
        to = robot.frame[d + 1]
        x, y, z = moment[d, 0], moment[d, 1], moment[d, 2]
        for i in range(3):
            by_p[to, i] -= force[d, i]
            by_R[to, 0, i] -= 0.5 * (y * R[to, 2, i] - z * R[to, 1, i])
            by_R[to, 1, i] -= 0.5 * (z * R[to, 0, i] - x * R[to, 2, i])
            by_R[to, 2, i] -= 0.5 * (x * R[to, 1, i] - y * R[to, 0, i])


@compiled
def _by_turn(w: Array, f: Array, B: Array, b: Array, here: Array) -> None:
    """Write the derivative of B : R + b . p by a piece's turn w, shape (3,), B and b in its start's frame.

    R = (1 - f_b |w|^2) I + f_a W + f_b w w^T, and p alike.
    """
    square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    turn = (B[2, 1] - B[1, 2]) * w[0] + (B[0, 2] - B[2, 0]) * w[1] + (B[1, 0] - B[0, 1]) * w[2]
    both = 0.0
    for i in range(3):
        for j in range(3):
            both += B[i, j] * w[i] * w[j]
    trace, dot = B[0, 0] + B[1, 1] + B[2, 2], b[0] * w[0] + b[1] * w[1] + b[2] * w[2]
    spread = both - square * trace
    aside = b[0] * w[1] - b[1] * w[0]
    ahead = w[2] * dot - square * b[2]
    by_square = f[3] * turn + f[4] * (spread + aside) + f[5] * ahead
    for c in range(3):
        i, j = (c + 1) % 3, (c + 2) % 3
        here[c] = f[0] * (B[j, i] - B[i, j]) - 2.0 * f[1] * trace * w[c] + 2.0 * w[c] * by_square
        for k in range(3):
            here[c] += f[1] * (B[c, k] + B[k, c]) * w[k]
        here[c] += f[2] * (w[2] * b[c] - 2.0 * w[c] * b[2])
    here[0] -= f[1] * b[1]
    here[1] += f[1] * b[0]
    here[2] += f[2] * dot


@compiled
def gradient(
    robot: Pieces, x: Array, tension: Array, force: Array, moment: Array, p: Array, R: Array, out: Array
) -> None:
    """Write the energy's gradient at x, both of shape (S, 3, m) [rad], [N m]; the frames are left in p and R.

    A component that is locked has its own value as a gradient, so that it goes to zero.
    """
    poses(robot, x, p, R)
    by_p, by_R = np.zeros_like(p), np.zeros_like(R)
    _pull_disks(robot, tension, p, R, by_p, by_R)
    _load_disks(robot, force, moment, R, by_p, by_R)
    w, f, E, e = np.empty(3), np.empty(6), np.empty((3, 3)), np.empty(3)
    here, B, b = np.empty(3), np.empty((3, 3)), np.empty(3)
    out[:] = 0.0
    for q in range(len(robot.segment) - 1, -1, -1):
        s, start, length = robot.segment[q], robot.parent[q], robot.length[q]
        _turn_of(robot, x, q, w)
        _series(w[0] * w[0] + w[1] * w[1] + w[2] * w[2], robot.order, f)
        for i in range(3):
            b[i] = 0.0
            for k in range(3):
                b[i] += R[start, k, i] * by_p[q + 1, k] * length
            for j in range(3):
                B[i, j] = 0.0
                for k in range(3):
                    B[i, j] += R[start, k, i] * by_R[q + 1, k, j]
        _by_turn(w, f, B, b, here)
        for c in range(3):
            for r in range(x.shape[2]):
                out[s, c, r] += here[c] * robot.share[q, r]
        _step_of(w, f, E, e)  # the start takes the end along
        for i in range(3):
            by_p[start, i] += by_p[q + 1, i]
            for j in range(3):
                by_R[start, i, j] += by_p[q + 1, i] * e[j] * length
                for k in range(3):
                    by_R[start, i, j] += by_R[q + 1, i, k] * E[j, k]
    for s in range(x.shape[0]):
        for c in range(3):
            for r in range(x.shape[2]):
                if not robot.free[s, c]:
                    out[s, c, r] = x[s, c, r] * robot.stiffness[s, c]
                    continue
                for j in range(x.shape[2]):
                    out[s, c, r] += robot.stiffness[s, c] * robot.gram[s, r, j] * x[s, c, j]


# ----------------------------------------------------------------------------------------------------
# Newton's method for the coefficients, and loads raised in steps where it fails, compiled.

_TOLERANCE = 1e-11  # largest gradient at which Newton's method stops, over the softest stiffness [rad]
_DIFFERENCE_RAD = 1e-6  # of a coefficient, for the gradient's derivative
_MOST_ROUNDS = 60
_SLOW = 0.1  # a residual that falls by less asks for another derivative
_LONGEST_RAD = 1.0  # step of any coefficient; longer ones are shortened
_SHORTEST_SHARE = 1e-3  # of the load


@compiled
def _derivative(
    robot: Pieces, x: Array, tension: Array, force: Array, moment: Array, p: Array, R: Array, g: Array,
    matrix: Array,
) -> None:  # fmt: skip
    """Write the derivative of the gradient g at x by the coefficients in one line, shape (N, N)."""
    flat, other = x.reshape(-1), np.empty_like(x)
    for i in range(len(flat)):
        before = flat[i]
        flat[i] = before + _DIFFERENCE_RAD
        gradient(robot, x, tension, force, moment, p, R, other)
        flat[i] = before
        matrix[:, i] = (other.reshape(-1) - g.reshape(-1)) / _DIFFERENCE_RAD


@compiled
def _balance(
    robot: Pieces, x: Array, tension: Array, force: Array, moment: Array, enough: float, p: Array, R: Array,
    g: Array,
) -> bool:  # fmt: skip
    """Bring the gradient below `enough` [N m], from x on; return whether that worked."""
    size = x.size
    matrix, used, step = np.empty((size, size)), np.empty((size, size)), np.empty((size, 1))
    flat, before = x.reshape(-1), 0.0
    for _ in range(_MOST_ROUNDS):
        gradient(robot, x, tension, force, moment, p, R, g)
        now = largest_size(g)
        if now < enough:
            return True
        if not now < 1e300:
            return False
        if not now < _SLOW * before:
            _derivative(robot, x, tension, force, moment, p, R, g, matrix)
        before = now
        used[:] = matrix
        step[:, 0] = g.reshape(-1)
        if not solve_columns_of_any(used, step):
            return False
        flat -= step[:, 0] * min(1.0, _LONGEST_RAD / largest_size(step))
    return False


@compiled
def solve_rows(
    robot: Pieces, tension: Array, force: Array, moment: Array, first_share: Array, x: Array, p: Array,
    R: Array, residual: Array, reached: Array,
) -> None:  # fmt: skip
    """Solve r rows, each from the straight robot; arrays have a row for each.

    Args:
        first_share: of the load, with which to begin; it is halved where there is no balance.
        x: result, shape (r, S, 3, m) [rad]; p, R: of the disks, shapes (r, n + 1, 3) and (r, n + 1, 3, 3).
        residual: largest part of the gradient, shape (r,) [N m].
        reached: share of the load at which there is balance, shape (r,); below 1 a row's posture is none.
    """
    frames = len(robot.segment) + 1
    here_p, here_R, g = np.empty((frames, 3)), np.empty((frames, 3, 3)), np.empty_like(x[0])
    enough = _TOLERANCE * robot.stiffness.min()
    for row in range(len(x)):
        good = np.zeros_like(x[row])
        done, share = 0.0, first_share[row]
        while done < 1.0 and share > _SHORTEST_SHARE:
            part = min(1.0, done + share)
            x[row] = good
            if _balance(
                robot, x[row], part * tension[row], part * force[row], part * moment[row], enough, here_p,
                here_R, g,
            ):  # fmt: skip
                good[:] = x[row]
                done = part
                share = min(2.0 * share, first_share[row])
            else:
                share *= 0.5
        x[row] = good
        gradient(robot, good, done * tension[row], done * force[row], done * moment[row], here_p, here_R, g)
        reached[row], residual[row] = done, largest_size(g)
        for d in range(len(robot.frame)):
            p[row, d] = here_p[robot.frame[d]]
            R[row, d] = here_R[robot.frame[d]]


# ----------------------------------------------------------------------------------------------------
# The static models.

_STEP_RAD = 2.5  # turn by the straight robot's moments that one load step may bring, as of `lumped`


@dataclass(frozen=True)
class ModalEquilibria:
    """Equilibria of a robot under r rows of loads, and the evidence.

    Attributes:
        rod, load: what was asked.
        unknowns: coefficients of the rotation vector's components, shape (r, S, 3, m) [rad].
        p_w, R_w: of disks 0 to n, shapes (r, n + 1, 3) [m], (r, n + 1, 3, 3); Taylor's axes are not quite
            orthogonal.
        span_tension: of every tendon in every subsegment, zero beyond its end, shape (r, t, n) [N].
        residual: largest part of the energy's gradient, shape (r,) [N m].
        reached: share of the load at which there is balance, shape (r,); below 1 the row's posture is none.
    """

    rod: RodProblem
    load: RodLoad
    unknowns: Array
    p_w: Array
    R_w: Array
    span_tension: Array
    residual: Array
    reached: Array


def equilibria(rod: RodProblem, loads: RodLoad, basis: Basis, threads: int = 1) -> ModalEquilibria:
    """Return the equilibria of `rod` under `loads` in a basis; its friction is not read.

    `threads`: among which the rows are shared out.
    """
    rows, n = len(loads), len(rod.length_m)
    robot = pieces(rod, basis)
    found = ModalEquilibria(
        rod=rod,
        load=loads,
        unknowns=np.zeros((rows, len(robot.stiffness), 3, robot.share.shape[1])),
        p_w=np.zeros((rows, n + 1, 3)),
        R_w=np.zeros((rows, n + 1, 3, 3)),
        span_tension=loads.tension_N[:, :, None] * (np.arange(n) < rod.last_disk[:, None]),
        residual=np.zeros(rows),
        reached=np.zeros(rows),
    )
    turn = np.linalg.norm(linear_bends(rod, loads), axis=2).sum(axis=1)
    arrays = (
        *(loads.tension_N, loads.force_N, loads.moment_N_m),
        np.minimum(1.0, _STEP_RAD / np.maximum(turn, 1e-9)),
        *(found.unknowns, found.p_w, found.R_w, found.residual, found.reached),
    )
    share_out(lambda part: solve_rows(robot, *(array[part] for array in arrays)), rows, threads)
    return found


def lacks(robot: ContinuumRobot) -> str:
    """Return what of `robot` the models by energy do not know, in words; empty if nothing."""
    return unsupported(robot) or ("friction, which has no energy" if robot.friction.mu else "")


def _static_run(basis: Basis, robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` under `inputs`.

    Raises:
        InputError: what no rod model carries, displacements that no posture follows, or a row without
            an equilibrium that load steps from the straight robot would reach.
    """
    rod = problem(robot)
    gravity = np.asarray(gravity_mps2, dtype=float)
    loads = load(rod, inputs, gravity)
    if inputs.actuation == "displacement":
        loads = driven(
            basis.name, robot, rod, inputs, loads,
            lambda rows: equilibria(rod, rows, basis), lambda found: straight_lengths(found, rod),
        )  # fmt: skip
    found = equilibria(rod, loads, basis)
    if basis.from_segment:  # the nearest rotations
        left, _, right = np.linalg.svd(found.R_w)
        found = replace(found, R_w=left @ right)
    return run_of(basis.name, robot, rod, inputs, gravity, found, found.residual)


def polynomial(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` with a curvature of degree 2 along each segment, row by row.

    Args:
        robot: any robot without friction that `rods.is_rod` accepts; shear and stretch of the backbone are
            not in the model, and its `effects` are not read.
        inputs: tensions or displacements, and loads on the tip.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: a row without an equilibrium, or whose displacements no posture follows.
    """
    return _static_run(POLYNOMIAL, robot, inputs, gravity_mps2)


def haar(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the same with a curvature of Haar's wavelets, constant on each quarter of a segment."""
    return _static_run(HAAR, robot, inputs, gravity_mps2)


def taylor(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the same with an arc for each segment, whose pose is a Taylor series in its bend; no twist."""
    return _static_run(TAYLOR, robot, inputs, gravity_mps2)
