"""The complete balance in compiled form: link by link, Newton's method, friction's history."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.vectors import blend, copy, cross3, dot3, largest_size, solve_lower, solve_vector
from catheter_sim.robots.rolling.description import RollingChain

# ----------------------------------------------------------------------------------------------------
# Columns of the arrays in which the compiled loops take a chain.

# Columns of `joint`: as in `RollingChain`; COMPLIANCE is of the link along its axis [m/N].
AXIS, RADIUS_POSITIVE, RADIUS_NEGATIVE, LINE, LENGTH, COMPLIANCE = range(6)
REST, SLEEVE, CUBIC, QUINTIC, LOW, HIGH = range(6, 12)
# Columns of `rod`: CLEARANCE carries the sign of the rod's side, OFFSET is NaN where it does not pass.
OFFSET, MOUTH, SINK, CLEARANCE, REST_CURVATURE, X, Y = range(7)


# ----------------------------------------------------------------------------------------------------
# A chain in the arrays of the compiled loops.


class PackedChain(NamedTuple):
    """A chain of n joints and m rods as the compiled code takes it.

    Attributes:
        joint: shape (n, 12), columns above.
        rod: shape (m, n, 7), columns above.
        stiffness: of the rods, shape (m,) [N m^2].
        pulled: how many of the rods, the first ones, are pulled.
        mu: coefficient of friction.
    """

    joint: Array
    rod: Array
    stiffness: Array
    pulled: int
    mu: float


class RodPulls(NamedTuple):
    """What acts on a chain at one row; of a history `drive`, `force` and `moment` have a row each.

    Attributes:
        drive: tensions at the actuators, shape (t,) [N].
        link, point, force: on which link each load acts, (p,), where in its frame [m], and how [N], (p, 3).
        moment: on the tip, shape (3,) [N m].
    """

    drive: Array
    link: np.ndarray
    point: Array
    force: Array
    moment: Array


class ChainBalance(NamedTuple):
    """An equilibrium, or the way to one; of several each array has a row for each.

    Attributes:
        theta: bend angles, shape (n,) [rad].
        length: of the links, as compressed, shape (n,) [m].
        at_joint: tension of the pulled rods in each gap, shape (t, n) [N].
        value: moment left at each joint, shape (n,) [N m].
    """

    theta: Array
    length: Array
    at_joint: Array
    value: Array


class Work(NamedTuple):
    """Arrays that a balance of n joints and t pulled rods works in, made once for a whole history.

    `wrench` holds across, along and tension over length of each pulled rod's span, `rods` and `kept` what
    `slide_and_bend_rods` says; the others are of the links and joints, base to tip.
    """

    wrench: Array
    elastic: Array
    sines: Array
    cosines: Array
    kept: Array
    along: Array
    axis: Array
    contact: Array
    up: Array
    origin: Array
    turned: Array
    pull: Array
    pull_moment: Array
    push: Array
    push_moment: Array
    moved: Array
    beyond: Array
    outer: Array
    R: Array
    small: Array
    rods: Array


def pack(chain: RollingChain) -> PackedChain:
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
    return PackedChain(joint, rod, chain.stiffness.copy(), chain.pulled, chain.mu)


# ----------------------------------------------------------------------------------------------------
# Where pure rolling puts the links, compiled.


@compiled
def roll_on(joint: Array, k: int, theta: float, length: float, face: Array, R: Array, origin: Array) -> None:
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
            roll_on(joint, k, theta[row, k], length[row, k], here, R, origin)
            face[row, k], R_w[row, k] = here, R


# ----------------------------------------------------------------------------------------------------
# Rods in the joints' gaps, compiled: turns, pulls, elastic moments, and tensions that friction keeps.


@compiled
def turn_of(
    joint: Array, rod: Array, r: int, k: int, theta: float, sine: float, cosine: float
) -> tuple[float, float]:
    """Return the turn phi of rod r at joint k, and its derivative at theta: `joint.turn`."""
    radius = joint[k, RADIUS_POSITIVE] if theta >= 0.0 else joint[k, RADIUS_NEGATIVE]
    offset, mouth, clearance = rod[r, k, OFFSET], rod[r, k, MOUTH], rod[r, k, CLEARANCE]
    hole_end = joint[k, LENGTH] - rod[r, k, SINK]
    below = joint[k - 1, LENGTH] if k > 0 else joint[0, LENGTH]
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
def cross_gap(
    joint: Array, rod: Array, r: int, k: int, theta: float, sine: float, cosine: float
) -> tuple[float, float, float, float]:
    """Return where rod r goes from mouth to mouth of gap k, and how that changes with theta.

    Across and along the flat below the gap, [m]; their derivatives, [m/rad].
    """
    radius = joint[k, RADIUS_POSITIVE] if theta >= 0.0 else joint[k, RADIUS_NEGATIVE]
    offset, mouth, sink = rod[r, k, OFFSET], rod[r, k, MOUTH], rod[r, k, SINK]
    across = radius * (theta - sine) + offset * cosine + mouth * sine - offset
    along = radius * (1.0 - cosine) - offset * sine + mouth * cosine + sink
    return across, along, along - sink, radius * theta - offset - across


@compiled
def bend_rod(
    joint: Array,
    rod: Array,
    stiffness: Array,
    r: int,
    k: int,
    theta: float,
    sine: float,
    cosine: float,
    along: float,
    along_slope: float,
    elastic: Array,
    jacobian: Array,
) -> None:
    """Add the elastic moment of rod r in gap k, and its derivative."""
    curvature = sine / along
    bent = curvature - rod[r, k, REST_CURVATURE]
    mean = (theta - joint[k, REST]) / joint[k, LENGTH]
    square = mean * mean
    law = 1.0 + square * (joint[k, CUBIC] + square * joint[k, QUINTIC])
    steeper = mean * (2.0 * joint[k, CUBIC] + 4.0 * square * joint[k, QUINTIC]) / joint[k, LENGTH]
    elastic[k] += stiffness[r] * bent * law
    jacobian[k, k] -= stiffness[r] * (law * (cosine - curvature * along_slope) / along + bent * steeper)


@compiled
def stretch_of(
    radius: float, across: float, along: float, across_slope: float, along_slope: float
) -> tuple[float, float, float]:
    """Return the length of a rod in a gap, and its first and second derivative by the angle."""
    length = math.hypot(across, along)
    slope = (across * across_slope + along * along_slope) / length
    second = (
        across_slope * across_slope
        + along_slope * along_slope
        + across * along_slope
        + along * (radius - across_slope)
        - slope * slope
    ) / length
    return length, slope, second


@compiled
def bend_sleeve(
    joint: Array, theta: Array, elastic: Array, sines: Array, cosines: Array, jacobian: Array
) -> None:
    """Begin `elastic` and `jacobian` with the outer tube; fill sines and cosines."""
    jacobian[:, :] = 0.0
    for k in range(len(theta)):
        sines[k], cosines[k] = math.sin(theta[k]), math.cos(theta[k])
        elastic[k] = joint[k, SLEEVE] * (theta[k] - joint[k, REST])
        jacobian[k, k] = -joint[k, SLEEVE]


@compiled
def pull_and_bend_rods(
    chain: PackedChain,
    drive: Array,
    kept: Array,
    theta: Array,
    at_joint: Array,
    above: Array,
    work: Work,
    jacobian: Array,
) -> None:
    """Fill tensions, the pull of all rods along their spans, elastic moments and their Jacobian's part."""
    joint, rod, stiffness, pulled, mu = chain
    wrench, elastic, sines, cosines, grows = work.wrench, work.elastic, work.sines, work.cosines, work.kept[0]
    n, m = joint.shape[0], rod.shape[0]
    bend_sleeve(joint, theta, elastic, sines, cosines, jacobian)
    for r in range(m):
        tension = drive[r] if r < pulled else 0.0
        grows[:] = 0.0  # derivative of the tension by the angles from `first` to the joint below
        first = 0
        for k in range(n):
            if math.isnan(rod[r, k, OFFSET]):
                if r < pulled:
                    at_joint[r, k:] = 0.0
                    above[r, k:] = 0.0
                    wrench[r, k:, :] = 0.0
                break
            t, sine, cosine = theta[k], sines[k], cosines[k]
            across, along, across_slope, along_slope = cross_gap(joint, rod, r, k, t, sine, cosine)
            bend_rod(joint, rod, stiffness, r, k, t, sine, cosine, along, along_slope, elastic, jacobian)
            if r >= pulled:
                continue
            at_joint[r, k] = tension
            if tension == 0.0 and kept[r, k] == 0.0:  # a slack rod neither pulls nor rubs
                wrench[r, k, 0], wrench[r, k, 1], wrench[r, k, 2] = across, along, 0.0
                above[r, k] = 0.0
                first = k + 1
                continue
            radius = joint[k, RADIUS_POSITIVE] if t >= 0.0 else joint[k, RADIUS_NEGATIVE]
            length, slope, second = stretch_of(radius, across, along, across_slope, along_slope)
            wrench[r, k, 0], wrench[r, k, 1], wrench[r, k, 2] = across, along, tension / length
            jacobian[k, k] -= tension * second
            for j in range(first, k):
                jacobian[k, j] -= grows[j] * slope
            phi, phi_slope = turn_of(joint, rod, r, k, t, sine, cosine)
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


# ----------------------------------------------------------------------------------------------------
# Dry friction of rods by how they slide in the links' holes, compiled.
#
# A rod is fixed where it ends, so what it slides in the hole of link k is the change of its length in the
# gaps beyond. Drawn in, it comes out of the hole with T exp(-mu phi); run out, with T exp(+mu phi); while
# it sticks, with anything between, T exp(-mu s phi) with -1 < s < 1. So a rod that another section draws in
# rubs the right way even while its own tension rises, which no rule on tensions alone can know.
#
# The share s is an unknown beside the angles: with the length drawn in since the step before, d,
#
#     s = s_before + d / pre_sliding_m  where |s + (d - pre_sliding_m (s - s_before)) / CHOICE_M| < 1:
# sticking,     s = -1 or 1                       elsewhere: slipping.
#
# Newton's method renews s and this choice with every step, as active-set methods for contact do, so that
# stiff sticking costs no short steps. The less pre-sliding, the truer and the slower; that there is some
# shares the tension of rods that stick together out alike.

CHOICE_M = (
    1e-1  # weighs how far a rod slides against what it lacks to slip: a choice of the way, not of the end
)
ALONE_SHARE = 0.8  # of all changes of tension: of a rod that moves all but alone
# Layers of what a chain remembers, each of shape (t, n): tension above each joint [N]; how the rod slid in
# the hole there, 1: drawn in, -1: run out; its length in the gap below [m]. Without the last two, friction
# keeps tensions instead (`pull_and_bend_rods`).
ABOVE, SLIP, SPAN = range(3)
SLOPE, LACK, STICKS = range(3)  # layers of `rods` in `slide_and_bend_rods`


@compiled
def slide_and_bend_rods(
    chain: PackedChain,
    pre_sliding_m: float,
    drive: Array,
    memory: Array,
    theta: Array,
    at_joint: Array,
    renewed: Array,
    work: Work,
    jacobian: Array,
) -> None:
    """As `pull_and_bend_rods`, with friction by sliding at the shares in `renewed[SLIP]`.

    `jacobian` takes with it that the shares change as the module's text says. `renewed` gets tensions and
    spans. Further filled are, of `work`,

        rods: for each pulled rod and joint, shape (3, t, n): `SLOPE`, how its span's length changes with the
            angle [m/rad]. `LACK`, by how much the share has to change, were the angles to stay. `STICKS`, 1
            where it does, 0 where it slips.
        kept: worked in, but its last row, shape (3, n): what `LACK` adds to the moments [N m].
    """
    joint, rod, stiffness, pulled, mu = chain
    wrench, elastic, sines, cosines, rods = work.wrench, work.elastic, work.sines, work.cosines, work.rods
    gives, rates, lacks = work.kept[0], work.kept[1], work.kept[2]
    n, m = joint.shape[0], rod.shape[0]
    bend_sleeve(joint, theta, elastic, sines, cosines, jacobian)
    lacks[:] = 0.0
    for r in range(m):
        ends = n
        for k in range(n):
            if math.isnan(rod[r, k, OFFSET]):
                ends = k
                break
            t, sine, cosine = theta[k], sines[k], cosines[k]
            across, away, across_slope, away_slope = cross_gap(joint, rod, r, k, t, sine, cosine)
            bend_rod(joint, rod, stiffness, r, k, t, sine, cosine, away, away_slope, elastic, jacobian)
            if r < pulled:
                radius = joint[k, RADIUS_POSITIVE] if t >= 0.0 else joint[k, RADIUS_NEGATIVE]
                length, slope, second = stretch_of(radius, across, away, across_slope, away_slope)
                wrench[r, k, 0], wrench[r, k, 1], wrench[r, k, 2] = across, away, second
                renewed[SPAN, r, k], rods[SLOPE, r, k] = length, slope
        if r >= pulled:
            continue
        slopes = rods[SLOPE, r]
        drawn = 0.0
        for k in range(ends - 1, -1, -1):
            share, before = renewed[SLIP, r, k], memory[SLIP, r, k]
            rods[LACK, r, k], rods[STICKS, r, k] = 0.0, 0.0
            if k < ends - 1:
                left = drawn - pre_sliding_m * (share - before)
                choice = share + left / CHOICE_M
                if abs(choice) < 1.0:
                    rods[LACK, r, k], rods[STICKS, r, k] = left / pre_sliding_m, 1.0
                else:
                    rods[LACK, r, k] = (1.0 if choice > 0.0 else -1.0) - share
            drawn += memory[SPAN, r, k] - renewed[SPAN, r, k]
        tension, give, lack = drive[r], 0.0, 0.0
        for k in range(ends):
            at_joint[r, k] = tension
            jacobian[k, k] -= tension * wrench[r, k, 2]
            wrench[r, k, 2] = tension / renewed[SPAN, r, k]
            gives[k], rates[k] = give, 0.0
            if tension > 0.0:
                pull = tension * slopes[k]
                lacks[k] += pull * lack
                for j in range(k):
                    jacobian[k, j] += pull * (rates[j] - slopes[j] * gives[j])
                for j in range(k, ends):
                    jacobian[k, j] -= pull * slopes[j] * give
                if mu > 0.0 and k < ends - 1:
                    share = renewed[SLIP, r, k]
                    phi, phi_slope = turn_of(joint, rod, r, k, theta[k], sines[k], cosines[k])
                    rates[k] = mu * share * (phi_slope if phi >= 0.0 else -phi_slope)
                    lack += mu * abs(phi) * rods[LACK, r, k]
                    give += mu * abs(phi) / pre_sliding_m * rods[STICKS, r, k]
                    tension *= math.exp(-mu * share * abs(phi))
            renewed[ABOVE, r, k] = tension
        for k in range(ends, n):
            at_joint[r, k] = 0.0
            renewed[:, r, k] = 0.0
            wrench[r, k, :] = 0.0


@compiled
def renew_shares(
    rod: Array, pre_sliding_m: float, part: float, step: Array, rods: Array, renewed: Array
) -> None:
    """Change the shares in `renewed[SLIP]` by `part` of what goes with `step` of the angles."""
    pulled, n = renewed.shape[1:]
    for r in range(pulled):
        drawn = 0.0
        for k in range(n - 1, -1, -1):
            if math.isnan(rod[r, k, OFFSET]):
                continue
            change = rods[LACK, r, k] + rods[STICKS, r, k] * drawn / pre_sliding_m
            renewed[SLIP, r, k] = min(max(renewed[SLIP, r, k] + part * change, -1.0), 1.0)
            drawn -= rods[SLOPE, r, k] * step[k]


@compiled
def guess_shares(
    chain: PackedChain, before: Array, drive: Array, memory: Array, theta: Array, renewed: Array
) -> None:
    """Fill `renewed[SLIP]` with the shares from which to search on for those under `drive`.

    A rod whose own tension changes all but alone, from `before`, starts with the shares that keep the
    tensions along it, where the bounds let them. All others slide on as they did.
    """
    joint, rod, _, pulled, mu = chain
    n, changes = len(theta), 0.0
    renewed[SLIP] = memory[SLIP]
    for r in range(pulled):
        changes += abs(drive[r] - before[r])
    for r in range(pulled):
        if abs(drive[r] - before[r]) <= ALONE_SHARE * changes:
            continue
        tension = drive[r]
        for k in range(n):
            if math.isnan(rod[r, k, OFFSET]) or tension == 0.0 or mu == 0.0:
                break
            phi, _ = turn_of(joint, rod, r, k, theta[k], math.sin(theta[k]), math.cos(theta[k]))
            turned, held = mu * abs(phi), memory[ABOVE, r, k]
            lost = math.log(tension / held) if held > 0.0 else math.inf
            if turned > 0.0:
                renewed[SLIP, r, k] = min(max(lost / turned, -1.0), 1.0)
            elif lost != 0.0:
                renewed[SLIP, r, k] = 1.0 if lost > 0.0 else -1.0
            tension *= math.exp(-turned * renewed[SLIP, r, k])


# ----------------------------------------------------------------------------------------------------
# The moments left at the joints, and their derivative, compiled.


@compiled
def workspace(n: int, pulled: int) -> Work:
    """Return arrays for `evaluate` to work in, of n joints."""
    return Work(
        np.empty((pulled, n, 3)), np.empty(n), np.empty(n), np.empty(n), np.empty((3, n)),
        np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)),
        np.empty((n, 3, 3)), np.empty((n + 1, 3)), np.empty((n + 1, 3)), np.empty((n, 3)), np.empty((n, 3)),
        np.empty((n, 3)), np.empty((n, 3)), np.empty((n + 1, 3, 3)), np.empty((3, 3)), np.empty((8, 3)),
        np.empty((3, pulled, n)),
    )  # fmt: skip


@compiled
def evaluate(
    chain: PackedChain,
    pre_sliding_m: float,
    acting: RodPulls,
    memory: Array,
    theta: Array,
    found: ChainBalance,
    renewed: Array,
    jacobian: Array,
    work: Work,
) -> bool:
    """Fill tensions, the moment left at every joint and its derivative, at `theta`; renew the links' lengths.

    Link by link from the tip: all wrenches on a link, about the base's origin, give the reaction of its
    joint; what that would have to carry about the joint's own axis is left over. `renewed` is what `memory`
    becomes, see `sliding`. Returned is whether joints feel those above them, so that the derivative has
    entries above its diagonal: where a load acts, or rods stick that others move.
    """
    joint, rod, _, pulled, _ = chain
    drive, load_link, load_point, load_force, tip_moment = acting
    _, length, at_joint, value = found
    n, loads = joint.shape[0], load_link.shape[0]
    wrench, elastic, _, _, _, along, axis, contact, up, origin, turned = work[:11]
    pull, pull_moment, push, push_moment, moved, beyond, outer, R, small, _ = work[11:]
    face, chord, lower, product = small[0], small[1], small[2], small[3]
    point, react, react_moment = small[4], small[5], small[6]
    if pre_sliding_m > 0.0:
        slide_and_bend_rods(chain, pre_sliding_m, drive, memory, theta, at_joint, renewed, work, jacobian)
    else:
        pull_and_bend_rods(chain, drive, memory[ABOVE], theta, at_joint, renewed[ABOVE], work, jacobian)
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


# ----------------------------------------------------------------------------------------------------
# Newton's method for the joints' angles, compiled.

ANGLE_TOLERANCE_RAD = 1e-11
_MOST_ROUNDS = 40
_MOST_SLIDING_ROUNDS = 14
_FARTHEST_RAD = 0.3  # of a joint in one search that may overshoot: beyond, it fell to another equilibrium
_MOST_HALVINGS = 10
_TOWARD_LIMIT = 0.9  # of the way to a closing gap that one step may go


@compiled
def find_equilibrium(
    chain: PackedChain, acting: RodPulls, memory: Array, found: ChainBalance, renewed: Array, work: Work
) -> bool:
    """Move `found.theta` to the equilibrium nearest to it; return whether one was found."""
    joint, theta, value = chain.joint, found.theta, found.value
    n = joint.shape[0]
    jacobian, step, trial = np.empty((n, n)), np.empty(n), np.empty(n)
    loaded = evaluate(chain, 0.0, acting, memory, theta, found, renewed, jacobian, work)
    for _ in range(_MOST_ROUNDS):
        worst = largest_size(value)
        for k in range(n):
            step[k] = -value[k]
        if not (solve_vector(jacobian, step, 0.0) if loaded else solve_lower(jacobian, step)):
            return False
        share = 1.0
        for k in range(n):
            room = joint[k, HIGH] - theta[k] if step[k] > 0.0 else theta[k] - joint[k, LOW]
            if abs(step[k]) * share > _TOWARD_LIMIT * room:
                share = _TOWARD_LIMIT * room / abs(step[k])
        largest = largest_size(step)
        if not math.isfinite(largest):
            return False
        # Where a rod starts or stops sticking the slope jumps. Then no share of the step may leave less over
        # than there is, and the one that leaves least is still the way across.
        best, best_share = math.inf, share
        for halvings in range(_MOST_HALVINGS + 1):
            if halvings == _MOST_HALVINGS:
                share = best_share
            for k in range(n):
                trial[k] = theta[k] + share * step[k]
            loaded = evaluate(chain, 0.0, acting, memory, trial, found, renewed, jacobian, work)
            left = largest_size(value)
            if left <= worst or largest < ANGLE_TOLERANCE_RAD:
                break
            if left < best:
                best, best_share = left, share
            share *= 0.5
        copy(trial, theta)
        # The next step would be smaller than this one by as much as what is left over is.
        if largest < ANGLE_TOLERANCE_RAD or largest * largest_size(value) < 0.1 * ANGLE_TOLERANCE_RAD * worst:
            return True
    return False


@compiled
def find_equilibrium_by_sliding(
    chain: PackedChain,
    pre_sliding_m: float,
    acting: RodPulls,
    memory: Array,
    found: ChainBalance,
    renewed: Array,
    work: Work,
) -> bool:
    """Move `found.theta` to the nearest equilibrium, with sliding rods; return whether one was found.

    `renewed[SLIP]` holds the shares with which the search begins.
    """
    joint, theta, value = chain.joint, found.theta, found.value
    n = joint.shape[0]
    jacobian, step = np.empty((n, n)), np.empty(n)
    before, largest, start = math.inf, math.inf, theta.copy()
    for _ in range(_MOST_SLIDING_ROUNDS):
        evaluate(chain, pre_sliding_m, acting, memory, theta, found, renewed, jacobian, work)
        worst = 0.0
        for k in range(n):
            step[k] = -value[k] - work.kept[2, k]
            worst = max(worst, abs(step[k]))
        if largest < ANGLE_TOLERANCE_RAD or largest * worst < 0.1 * ANGLE_TOLERANCE_RAD * before:
            farthest = 0.0
            for k in range(n):
                farthest = max(farthest, abs(theta[k] - start[k]))
            return farthest <= _FARTHEST_RAD
        before = worst
        if not solve_vector(jacobian, step, 0.0):
            return False
        share = 1.0
        for k in range(n):
            room = joint[k, HIGH] - theta[k] if step[k] > 0.0 else theta[k] - joint[k, LOW]
            if abs(step[k]) * share > _TOWARD_LIMIT * room:
                share = _TOWARD_LIMIT * room / abs(step[k])
        largest = largest_size(step)
        if not math.isfinite(largest):
            return False
        renew_shares(chain.rod, pre_sliding_m, share, step, work.rods, renewed)
        for k in range(n):
            theta[k] += share * step[k]
    return False


# ----------------------------------------------------------------------------------------------------
# A robot's way along its inputs, with the tensions that friction keeps, compiled.

_SHORTEST_STEP = 1e-4  # share of the way between two inputs
_STEPS_FROM_REST = 8


@compiled
def advance(
    chain: PackedChain,
    before: RodPulls,
    after: RodPulls,
    here: ChainBalance,
    memory: Array,
    pre_sliding_m: Array,
    steps: int,
    guide: Array,
    made: Array,
    work: Work,
) -> float:
    """Go from one row of inputs to the next in `steps` or more steps; return the share reached.

    `here` and `memory` are moved along; `before` and `after` differ in tensions, forces and moment alone.
    The search for each equilibrium begins where its row of `guide` leads to, see `follow`. A step that finds
    none begins once more without, and then is cut in halves. Less than 1 is returned where none is found
    however short it is.
    """
    theta, length, pulled = here.theta, here.length, chain.pulled
    renewed, guess, lengths = np.empty_like(memory), np.empty_like(theta), np.empty_like(length)
    start, there = np.empty_like(theta), np.empty_like(after.drive)
    drive, force, moment = np.empty_like(after.drive), np.empty_like(after.force), np.empty_like(after.moment)
    acting = RodPulls(drive, after.link, after.point, force, moment)
    trial = ChainBalance(guess, lengths, here.at_joint, here.value)
    done, stride, sliding = 0.0, 1.0 / steps, len(pre_sliding_m) > 0
    for step in range(steps):
        goal = (step + 1.0) / steps if step + 1 < steps else 1.0
        foreseen = len(guide) > 0 and not math.isnan(guide[step, 0, 0])
        whole, tries = True, 0
        copy(theta, start)
        while done < goal:
            part = done + stride
            if goal - part < 1e-9:
                part = goal
            for k in range(theta.shape[0]):
                guess[k] = theta[k] + (guide[step, 0, k] if foreseen else 0.0)
            copy(length, lengths)
            blend(before.drive, after.drive, part, drive)
            blend(before.drive, after.drive, done, there)
            for p in range(force.shape[0]):
                blend(before.force[p], after.force[p], part, force[p])
            blend(before.moment, after.moment, part, moment)
            if sliding:
                if foreseen:
                    renewed[SLIP] = guide[step, 1:]
                elif tries > 0:
                    renewed[SLIP] = memory[SLIP]
                else:
                    guess_shares(chain, there, drive, memory, theta, renewed)
                found = find_equilibrium_by_sliding(
                    chain, pre_sliding_m[tries], acting, memory, trial, renewed, work
                )
            else:
                found = find_equilibrium(chain, acting, memory, trial, renewed, work)
            if found:
                copy(guess, theta)
                copy(lengths, length)
                memory[:] = renewed
                for r in range(pulled if sliding else 0):
                    if drive[r] == 0.0:
                        memory[SLIP, r] = 0.0  # without tension nothing rubs
                done = part
            elif sliding and not foreseen and tries < len(pre_sliding_m) - 1:
                tries += 1
                continue
            elif not foreseen:
                whole = False
                stride *= 0.5
                if stride < _SHORTEST_STEP:
                    return done
            foreseen, tries = False, 0
        for k in range(theta.shape[0]):
            made[step, 0, k] = theta[k] - start[k] if whole else math.nan
        if sliding:
            made[step, 1:] = memory[SLIP]
    return 1.0


@compiled
def pulls_at(acting: RodPulls, row: int) -> RodPulls:
    """Return what acts at one row of a history."""
    return RodPulls(acting.drive[row], acting.link, acting.point, acting.force[row], acting.moment[row])


@compiled
def follow(
    chain: PackedChain,
    acting: RodPulls,
    steps: np.ndarray,
    pre_sliding_m: Array,
    guide: Array,
    made: Array,
    first: int,
    angle: Array,
    lengths: Array,
    memory: Array,
    found: ChainBalance,
) -> int:
    """Go through rows of inputs, from the `first` on; return how many were reached.

    `angle`, shape (n,), `lengths`, (n,), and `memory`, (k, t, n), are those where the way begins and, when it
    returns, where it ended. From rest without load the way to row 0 is gone, too: `first` is 0; else row 0 is
    where the robot stands, and `first` is 1.

    Friction goes by how rods slide, by the first `pre_sliding_m` with which an equilibrium is found; of none,
    by the tensions that it keeps.
    `made` is filled for all s steps with what each did to the angles, NaN where it had to be cut. Where
    rods slide it is filled with their shares after it: shape (s, 1, n) or (s, 1 + t, n). `guide` is `made`
    of a robot that is much alike; of no steps: none is known. `acting` and `steps`, shape (r,), have a
    value a row, and `found` is filled row by row.
    """
    rows, n = found.theta.shape
    before, start, work = 0, 0, workspace(n, chain.pulled)
    for row in range(first, rows):
        end = start + steps[row]
        reached = advance(
            chain, pulls_at(acting, before), pulls_at(acting, row),
            ChainBalance(angle, lengths, found.at_joint[row], found.value[row]),
            memory, pre_sliding_m, steps[row], guide[start:end], made[start:end], work,
        )  # fmt: skip
        if reached < 1.0:
            return row
        copy(angle, found.theta[row])
        copy(lengths, found.length[row])
        before, start = row, end
    return rows


@compiled
def load_batch(chain: PackedChain, acting: RodPulls, found: ChainBalance) -> int:
    """Solve configurations that are each loaded from rest; return the index of one that fails, or -1.

    `acting.drive`, shape (b, t), has a row each, the loads are the same for all; `found` is filled. Each
    starts from the one before, and from rest in steps where that leads nowhere.
    """
    joint, pulled = chain.joint, chain.pulled
    theta, length = found.theta, found.length
    batch, n = theta.shape
    nothing, memory, renewed = np.zeros((1, pulled, n)), np.zeros((1, pulled, n)), np.empty((1, pulled, n))
    slack, work = np.zeros(pulled), workspace(n, pulled)
    nothing_slides, nothing_known, made = np.empty(0), np.empty((0, 1, n)), np.empty((_STEPS_FROM_REST, 1, n))
    for b in range(batch):
        for k in range(n):
            theta[b, k] = theta[b - 1, k] if b > 0 else joint[k, REST]
            length[b, k] = length[b - 1, k] if b > 0 else joint[k, LENGTH]
        there = RodPulls(acting.drive[b], acting.link, acting.point, acting.force, acting.moment)
        here = ChainBalance(theta[b], length[b], found.at_joint[b], found.value[b])
        if not find_equilibrium(chain, there, nothing, here, renewed, work):
            for k in range(n):
                theta[b, k] = joint[k, REST]
                length[b, k] = joint[k, LENGTH]
            memory[:] = 0.0
            rest = RodPulls(slack, acting.link, acting.point, acting.force, acting.moment)
            reached = advance(
                chain, rest, there, here, memory, nothing_slides, _STEPS_FROM_REST, nothing_known, made, work
            )
            if reached < 1.0:
                return b
    return -1
