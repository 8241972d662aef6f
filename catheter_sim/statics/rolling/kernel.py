"""The complete balance in compiled form: link by link, Newton's method, friction's history.

The same as `newton_euler`, `virtual_work` and `rods` in plain NumPy, which the tests hold it to; here
for one configuration after another. All compiled code is in this file: the compiled form is kept on
disk and renewed when this file changes, not when another does.

Arrays. `joint`, shape (n, 12), `rod`, shape (m, n, 7), `stiffness`, shape (m,): see `pack` and the
columns' names below. Loads as in `loads.Loads`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from catheter_sim.compiled import compiled
from catheter_sim.robots.posture import Array
from catheter_sim.statics.rolling.chain import RollingChain

ANGLE_TOLERANCE_RAD = 1e-11
_MOST_ROUNDS = 40
_MOST_HALVINGS = 10
_SHORTEST_STEP = 1e-4  # share of the way between two inputs
_TOWARD_LIMIT = 0.9  # of the way to a closing gap that one step may go

# Columns of `joint`: as in `RollingChain`; COMPLIANCE is of the link along its axis [m/N].
AXIS, RADIUS_POSITIVE, RADIUS_NEGATIVE, LINE, LENGTH, COMPLIANCE = range(6)
REST, SLEEVE, CUBIC, QUINTIC, LOW, HIGH = range(6, 12)
# Columns of `rod`: CLEARANCE carries the sign of the rod's side, OFFSET is NaN where it does not pass.
OFFSET, MOUTH, SINK, CLEARANCE, REST_CURVATURE, X, Y = range(7)


@dataclass(frozen=True)
class Packed:
    """A chain as the compiled code takes it."""

    joint: Array
    rod: Array
    stiffness: Array
    pulled: int
    mu: float


def pack(chain: RollingChain) -> Packed:
    """Return `chain` in the compiled code's arrays."""
    joint = np.stack(
        [
            chain.axis.astype(float),
            chain.radius_positive,
            chain.radius_negative,
            chain.line,
            chain.link_length,
            1.0 / chain.link_stiffness,
            chain.rest_angle,
            chain.sleeve_stiffness,
            chain.cubic,
            chain.quintic,
            chain.low,
            chain.high,
        ],
        axis=1,
    )
    offset = np.where(chain.passes, chain.offset, np.nan)
    rod = np.stack(
        [
            offset,
            chain.mouth,
            chain.countersink,
            chain.side * chain.clearance,
            chain.rest_curvature,
            chain.position[:, :, 0],
            chain.position[:, :, 1],
        ],
        axis=2,
    )
    return Packed(joint, rod, chain.stiffness.copy(), chain.pulled, chain.mu)


@compiled
def _cross(a: Array, b: Array, out: Array) -> None:
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@compiled
def _dot(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def _turn(
    theta: float,
    sine: float,
    cosine: float,
    radius: float,
    offset: float,
    mouth: float,
    clearance: float,
    hole_end: float,
    below: float,
) -> tuple[float, float]:
    """Return phi and its derivative at theta, of that sine and cosine: `joint.turn` for one rod."""
    reach = offset + clearance - radius * theta
    x3 = radius * sine + reach * cosine + below * sine
    z3 = radius * (1.0 - cosine) + reach * sine - below * cosine
    x1, z1 = offset + clearance - x3, hole_end - z3
    x2, z2 = offset - clearance - x3, mouth - z3
    dx3, dz3 = -reach * sine + below * cosine, reach * cosine + below * sine
    phi = 2.0 * math.atan2(x1 * z2 - z1 * x2, x1 * x2 + z1 * z2)
    slope = (z2 * dx3 - x2 * dz3) / (x2 * x2 + z2 * z2) - (z1 * dx3 - x1 * dz3) / (x1 * x1 + z1 * z1)
    return phi, 2.0 * slope


@compiled
def workspace(n: int, pulled: int) -> tuple[Array, ...]:
    """Return the arrays that `_evaluate` works in, of n joints: made once for a whole history."""
    return (
        np.empty((pulled, n, 3)), np.empty(n), np.empty(n), np.empty(n), np.empty(n),
        np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)),
        np.empty((n, 3, 3)), np.empty((n + 1, 3)), np.empty((n + 1, 3)), np.empty((n, 3)), np.empty((n, 3)),
        np.empty((n, 3)), np.empty((n, 3)), np.empty((n + 1, 3, 3)), np.empty((3, 3)), np.empty((8, 3)),
    )  # fmt: skip


@compiled
def _rods(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    drive: Array,
    kept: Array,
    theta: Array,
    at_joint: Array,
    above: Array,
    wrench: Array,
    elastic: Array,
    sines: Array,
    cosines: Array,
    grows: Array,
    jacobian: Array,
) -> None:
    """Fill tensions, the pull of all rods along their spans, elastic moments and their part of the Jacobian.

    `wrench`, shape (t, n, 3): across, along and tension over length of each pulled rod's span.
    """
    n, m = joint.shape[0], rod.shape[0]
    jacobian[:, :] = 0.0
    for k in range(n):
        t = theta[k]
        sines[k], cosines[k] = math.sin(t), math.cos(t)
        elastic[k] = joint[k, SLEEVE] * (t - joint[k, REST])
        jacobian[k, k] = -joint[k, SLEEVE]
    for r in range(m):
        tension = drive[r] if r < pulled else 0.0
        grows[:] = 0.0  # derivative of the tension by the angles from `first` to the joint below
        first = 0
        for k in range(n):
            offset = rod[r, k, OFFSET]
            if math.isnan(offset):
                if r < pulled:
                    at_joint[r, k:] = 0.0
                    above[r, k:] = 0.0
                    wrench[r, k:, :] = 0.0
                break
            t = theta[k]
            radius = joint[k, RADIUS_POSITIVE] if t >= 0.0 else joint[k, RADIUS_NEGATIVE]
            mouth, sink = rod[r, k, MOUTH], rod[r, k, SINK]
            sine, cosine = sines[k], cosines[k]
            across = radius * (t - sine) + offset * cosine + mouth * sine - offset
            along = radius * (1.0 - cosine) - offset * sine + mouth * cosine + sink
            across_slope = along - sink
            along_slope = radius * t - offset - across
            curvature = sine / along
            bent = curvature - rod[r, k, REST_CURVATURE]
            mean = (t - joint[k, REST]) / joint[k, LENGTH]
            square = mean * mean
            law = 1.0 + square * (joint[k, CUBIC] + square * joint[k, QUINTIC])
            steeper = mean * (2.0 * joint[k, CUBIC] + 4.0 * square * joint[k, QUINTIC]) / joint[k, LENGTH]
            elastic[k] += stiffness[r] * bent * law
            jacobian[k, k] -= stiffness[r] * (
                law * (cosine - curvature * along_slope) / along + bent * steeper
            )
            if r >= pulled:
                continue
            length = math.hypot(across, along)
            slope = (across * across_slope + along * along_slope) / length
            second = (
                across_slope * across_slope
                + along_slope * along_slope
                + across * along_slope
                + along * (radius - across_slope)
                - slope * slope
            ) / length
            at_joint[r, k] = tension
            wrench[r, k, 0], wrench[r, k, 1], wrench[r, k, 2] = across, along, tension / length
            jacobian[k, k] -= tension * second
            for j in range(first, k):
                jacobian[k, j] -= grows[j] * slope
            below = joint[k - 1, LENGTH] if k > 0 else joint[0, LENGTH]
            phi, phi_slope = _turn(
                *(t, sine, cosine, radius, offset, mouth),
                *(rod[r, k, CLEARANCE], joint[k, LENGTH] - sink, below),
            )
            factor = math.exp(mu * abs(phi))
            rate = mu * phi_slope if phi >= 0.0 else -mu * phi_slope
            held = kept[r, k]
            if held < tension / factor:
                for j in range(first, k):
                    grows[j] /= factor
                grows[k] = -rate * tension / factor
                tension = tension / factor
            elif held > tension * factor:
                for j in range(first, k):
                    grows[j] *= factor
                grows[k] = rate * tension * factor
                tension = tension * factor
            else:
                first = k + 1
                tension = held
            above[r, k] = tension


@compiled
def _roll_on(joint: Array, k: int, theta: float, length: float, face: Array, R: Array, origin: Array) -> None:
    """Go from the flat below joint k to its link's: move `face` and `R`, fill its frame's `origin`."""
    a, line = int(joint[k, AXIS]), joint[k, LINE]
    radius = joint[k, RADIUS_POSITIVE] if theta >= 0.0 else joint[k, RADIUS_NEGATIVE]
    sine, cosine = math.sin(theta), math.cos(theta)
    for i in range(3):
        e, z = R[i, a], R[i, 2]
        face[i] += (line + radius * (theta - sine)) * e + radius * (1.0 - cosine) * z
        R[i, a] = cosine * e - sine * z
        R[i, 2] = sine * e + cosine * z
        origin[i] = face[i] - line * R[i, a]
        face[i] = origin[i] + length * R[i, 2]


@compiled
def tops(joint: Array, theta: Array, length: Array, face: Array, R_w: Array) -> None:
    """Fill the links' flat tops and orientations, shapes (r, n, 3) and (r, n, 3, 3), of r rows of angles."""
    rows, n = theta.shape
    here, R, origin = np.empty(3), np.empty((3, 3)), np.empty(3)
    for row in range(rows):
        here[:] = 0.0
        R[:, :] = np.eye(3)
        for k in range(n):
            _roll_on(joint, k, theta[row, k], length[row, k], here, R, origin)
            face[row, k], R_w[row, k] = here, R


@compiled
def _evaluate(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    drive: Array,
    kept: Array,
    theta: Array,
    length: Array,
    load_link: np.ndarray,
    load_point: Array,
    load_force: Array,
    tip_moment: Array,
    at_joint: Array,
    above: Array,
    value: Array,
    jacobian: Array,
    work: tuple[Array, ...],
) -> bool:
    """Fill tensions, the moment left at every joint and its derivative; renew the links' lengths.

    Link by link from the tip: all wrenches on a link, about the base's origin, give the reaction of its
    joint; what that would have to carry about the joint's own axis is left over. Returned is whether joints
    feel those above them, so that the derivative has entries above its diagonal: where a load acts.
    """
    n, loads = joint.shape[0], load_link.shape[0]
    wrench, elastic, sines, cosines, grows, along, axis, contact, up, origin, turned = work[:11]
    pull, pull_moment, push, push_moment, moved, beyond, outer, R, small = work[11:]
    face, chord, lower, product = small[0], small[1], small[2], small[3]
    point, react, react_moment = small[4], small[5], small[6]
    _rods(
        joint, rod, stiffness, pulled, mu, drive, kept, theta, at_joint, above,
        wrench, elastic, sines, cosines, grows, jacobian,
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
            _cross(lower, chord, product)
            for i in range(3):
                pull[k, i] += chord[i]
                pull_moment[k, i] += product[i]
        for i in range(3):
            e = R[i, a]
            along[k, i] = e
            axis[k, i] = R[i, 1] if a == 0 else -R[i, 0]
            contact[k, i] = face[i] + (line + radius * t) * e
        _roll_on(joint, k, t, length[k], face, R, origin[k])
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
        _cross(point, force, product)
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
            a_f = _dot(axis[k], beyond[k])
            p_f = outer[k, 0, 0] + outer[k, 1, 1] + outer[k, 2, 2] - _dot(contact[k], beyond[k])
            for i in range(3):
                moved[k, i] = _dot(outer[k, i], axis[k]) - contact[k, i] * a_f - axis[k, i] * p_f
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
        _cross(contact[k], react, product)
        value[k] = -(_dot(axis[k], react_moment) - _dot(axis[k], product))
    # Loads' part of the derivative: symmetric, as they have a potential; the tip's moment has none.
    if loaded:
        for k in range(n):
            radius = joint[k, RADIUS_POSITIVE] if theta[k] >= 0.0 else joint[k, RADIUS_NEGATIVE]
            _cross(along[k], beyond[k], product)
            jacobian[k, k] += _dot(axis[k], moved[k]) - radius * _dot(axis[k], product)
            for j in range(k + 1, n):
                slope = _dot(axis[k], moved[j])
                jacobian[k, j] += slope
                jacobian[j, k] += slope
    if tip_moment[0] != 0.0 or tip_moment[1] != 0.0 or tip_moment[2] != 0.0:
        for k in range(n):
            for j in range(k):
                _cross(axis[j], axis[k], product)
                jacobian[k, j] += _dot(product, tip_moment)
    for k in range(n):
        if joint[k, COMPLIANCE] == 0.0:
            length[k] = joint[k, LENGTH]
            continue
        inside = -_dot(up[k], beyond[k])
        for r in range(pulled):
            if not math.isnan(rod[r, k, OFFSET]):
                inside += 0.5 * (at_joint[r, k] + above[r, k])
        length[k] = joint[k, LENGTH] - inside * joint[k, COMPLIANCE]
    return loaded


@compiled
def _largest(values: Array) -> float:
    """Return the largest size in a vector, NaN where one is."""
    result = 0.0
    for k in range(values.shape[0]):
        if not abs(values[k]) <= result:
            result = abs(values[k])
    return result


@compiled
def _blend(start: Array, end: Array, part: float, out: Array) -> None:
    """Fill the vector between `start` and `end`."""
    for i in range(start.shape[0]):
        out[i] = start[i] + part * (end[i] - start[i])


@compiled
def _copy(source: Array, out: Array) -> None:
    for i in range(source.shape[0]):
        out[i] = source[i]


@compiled
def _solve_linear(matrix: Array, right: Array, triangular: bool) -> bool:
    """Solve in place, forward or by elimination with row exchange; return whether the matrix is regular."""
    n = right.shape[0]
    if triangular:
        for k in range(n):
            if not abs(matrix[k, k]) > 0.0:
                return False
            for j in range(k):
                right[k] -= matrix[k, j] * right[j]
            right[k] /= matrix[k, k]
        return True
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if not abs(matrix[best, k]) > 0.0:
            return False
        if best != k:
            for j in range(k, n):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
            right[k], right[best] = right[best], right[k]
        for i in range(k + 1, n):
            if matrix[i, k] != 0.0:
                ratio = matrix[i, k] / matrix[k, k]
                for j in range(k + 1, n):
                    matrix[i, j] -= ratio * matrix[k, j]
                right[i] -= ratio * right[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            right[k] -= matrix[k, j] * right[j]
        right[k] /= matrix[k, k]
    return True


@compiled
def _equilibrium(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    drive: Array,
    kept: Array,
    theta: Array,
    length: Array,
    load_link: np.ndarray,
    load_point: Array,
    load_force: Array,
    tip_moment: Array,
    at_joint: Array,
    above: Array,
    value: Array,
    work: tuple[Array, ...],
) -> bool:
    """Move `theta` to the equilibrium nearest to it; return whether one was found."""
    n = joint.shape[0]
    jacobian, step, trial = np.empty((n, n)), np.empty(n), np.empty(n)
    loaded = _evaluate(
        joint, rod, stiffness, pulled, mu, drive, kept, theta, length,
        load_link, load_point, load_force, tip_moment, at_joint, above, value, jacobian, work,
    )  # fmt: skip
    for _ in range(_MOST_ROUNDS):
        worst = _largest(value)
        for k in range(n):
            step[k] = -value[k]
        if not _solve_linear(jacobian, step, not loaded):
            return False
        share = 1.0
        for k in range(n):
            room = joint[k, HIGH] - theta[k] if step[k] > 0.0 else theta[k] - joint[k, LOW]
            if abs(step[k]) * share > _TOWARD_LIMIT * room:
                share = _TOWARD_LIMIT * room / abs(step[k])
        largest = _largest(step)
        if not math.isfinite(largest):
            return False
        for _ in range(_MOST_HALVINGS):
            for k in range(n):
                trial[k] = theta[k] + share * step[k]
            loaded = _evaluate(
                joint, rod, stiffness, pulled, mu, drive, kept, trial, length,
                load_link, load_point, load_force, tip_moment, at_joint, above, value, jacobian, work,
            )  # fmt: skip
            if _largest(value) <= worst or largest < ANGLE_TOLERANCE_RAD:
                break
            share *= 0.5
        _copy(trial, theta)
        # The next step would be smaller than this one by as much as what is left over is.
        if largest < ANGLE_TOLERANCE_RAD or largest * _largest(value) < 0.1 * ANGLE_TOLERANCE_RAD * worst:
            return True
    return False


@compiled
def advance(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    drive_from: Array,
    drive_to: Array,
    theta: Array,
    kept: Array,
    length: Array,
    load_link: np.ndarray,
    load_point: Array,
    force_from: Array,
    force_to: Array,
    moment_from: Array,
    moment_to: Array,
    steps: int,
    at_joint: Array,
    value: Array,
    work: tuple[Array, ...],
) -> float:
    """Go from one row of inputs to the next in `steps` or more equal steps; return the share reached.

    `theta`, `kept` and `length` are moved along; `at_joint` and `value` are filled. A step that finds
    no equilibrium is halved. Less than 1 is returned where none is found however short the step.
    """
    done, stride = 0.0, 1.0 / steps
    above, guess, lengths = np.empty_like(kept), np.empty_like(theta), np.empty_like(length)
    drive, force, moment = np.empty_like(drive_to), np.empty_like(force_to), np.empty_like(moment_to)
    while done < 1.0:
        part = min(done + stride, 1.0)
        if 1.0 - part < 1e-9:
            part = 1.0
        _copy(theta, guess)
        _copy(length, lengths)
        _blend(drive_from, drive_to, part, drive)
        for p in range(force.shape[0]):
            _blend(force_from[p], force_to[p], part, force[p])
        _blend(moment_from, moment_to, part, moment)
        found = _equilibrium(
            joint, rod, stiffness, pulled, mu, drive, kept, guess, lengths,
            load_link, load_point, force, moment, at_joint, above, value, work,
        )  # fmt: skip
        if not found:
            stride *= 0.5
            if stride < _SHORTEST_STEP:
                return done
            continue
        _copy(guess, theta)
        _copy(lengths, length)
        kept[:] = above
        done = part
    return 1.0


@compiled
def follow(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    drive: Array,
    load_link: np.ndarray,
    load_point: Array,
    load_force: Array,
    tip_moment: Array,
    steps: np.ndarray,
    theta: Array,
    length: Array,
    at_joint: Array,
    value: Array,
) -> int:
    """Go from rest without load through rows of inputs; return how many were reached.

    `drive`, shape (r, t), `load_force`, (r, p, 3), `tip_moment`, (r, 3), and `steps`, (r,), are those of the
    rows; `theta`, `length`, `value`, shape (r, n), and `at_joint`, (r, t, n), are filled.
    """
    rows, n = theta.shape
    angle, lengths = joint[:, REST].copy(), joint[:, LENGTH].copy()
    kept, before, work = np.zeros((pulled, n)), 0, workspace(n, pulled)
    for row in range(rows):
        reached = advance(
            joint, rod, stiffness, pulled, mu, drive[before], drive[row], angle, kept, lengths,
            load_link, load_point, load_force[before], load_force[row], tip_moment[before], tip_moment[row],
            steps[row], at_joint[row], value[row], work,
        )  # fmt: skip
        if reached < 1.0:
            return row
        _copy(angle, theta[row])
        _copy(lengths, length[row])
        before = row
    return rows


@compiled
def load_batch(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    drive: Array,
    length: Array,
    load_link: np.ndarray,
    load_point: Array,
    load_force: Array,
    tip_moment: Array,
    theta: Array,
    at_joint: Array,
    value: Array,
) -> int:
    """Solve configurations that are each loaded from rest; return the index of one that fails, or -1.

    `drive`, shape (b, t); `theta`, `length`, shape (b, n), `at_joint` (b, t, n) and `value` (b, n) are
    filled. Each starts from the one before, and from rest in steps where that leads nowhere.
    """
    batch, n = theta.shape
    nothing, kept, above = np.zeros((pulled, n)), np.zeros((pulled, n)), np.empty((pulled, n))
    slack, work = np.zeros(pulled), workspace(n, pulled)
    for b in range(batch):
        for k in range(n):
            theta[b, k] = theta[b - 1, k] if b > 0 else joint[k, REST]
            length[b, k] = length[b - 1, k] if b > 0 else joint[k, LENGTH]
        found = _equilibrium(
            joint, rod, stiffness, pulled, mu, drive[b], nothing, theta[b], length[b],
            load_link, load_point, load_force, tip_moment, at_joint[b], above, value[b], work,
        )  # fmt: skip
        if not found:
            for k in range(n):
                theta[b, k] = joint[k, REST]
                length[b, k] = joint[k, LENGTH]
            kept[:] = 0.0
            reached = advance(
                joint, rod, stiffness, pulled, mu, slack, drive[b], theta[b], kept, length[b],
                load_link, load_point, load_force, load_force, tip_moment, tip_moment, 8,
                at_joint[b], value[b], work,
            )  # fmt: skip
            if reached < 1.0:
                return b
    return -1
