"""The static model of chest_tube_2025 (doi 10.1109/LRA.2025.3597860) as printed, Eqs 1 to 24."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import exprel

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.statics import StaticRun, require_tensions
from catheter_sim.errors import InputError
from catheter_sim.robots.rolling import complete
from catheter_sim.robots.rolling.complete import (
    Frames,
    NotBalanced,
    Varied,
    balanced,
    constant,
    frames,
    postures,
    single,
)
from catheter_sim.robots.rolling.description import RollingChain, rolling_chain
from catheter_sim.robots.rolling.joint import active_radius, contact_on_profile, span
from catheter_sim.robots.rolling.spec import RollingRobot

# ----------------------------------------------------------------------------------------------------
# What a rod does to a link in the balance of chest_tube_2025: as printed, and by its spans.
#
# Forces are in the link's plane, in its own frame: x toward positive bending, z along the link, places from
# the joint's line. Configurations are a batch of b.


@dataclass(frozen=True)
class RodTensions:
    """Tensions of the rods, shapes (b, t, n): Eqs 1, 5, and N of Eq. 7 with its sign in the plane."""

    below: Varied
    above: Varied
    normal: Varied


def rod_tensions(chain: RollingChain, theta: Array, drive: Array) -> RodTensions:
    """Return the rods' tensions and normal forces under loading, at the bend angles `theta` (b, n) [rad]."""
    b, n, t = len(theta), chain.joints, chain.pulled
    turn, turn_slope = (item[:, :t] for item in complete.turns(chain, theta))
    # Toward the rod's own side; in the neutral plane toward the side to which the rod turns.
    side = np.where(chain.side[:t] == 0.0, np.where(turn < 0.0, -1.0, 1.0), chain.side[:t])
    phi, phi_slope = side * turn, side * turn_slope
    mu = chain.mu
    below, above, normal = (Varied(np.zeros((b, t, n)), np.zeros((b, t, n, n))) for _ in range(3))
    now, slope = np.asarray(drive, dtype=float), np.zeros((b, t, n))
    for k in range(n):
        now = np.where(chain.passes[:t, k], now, 0.0)
        slope = np.where(chain.passes[:t, k, None], slope, 0.0)
        below.value[:, :, k], below.slope[:, :, k] = now, slope
        factor = np.exp(-mu * phi[:, :, k])
        per_tension = side[:, :, k] * phi[:, :, k] * exprel(-mu * phi[:, :, k])  # Eq. 7; phi at mu = 0
        normal.value[:, :, k], normal.slope[:, :, k] = now * per_tension, slope * per_tension[..., None]
        normal.slope[:, :, k, k] += side[:, :, k] * now * factor * phi_slope[:, :, k]
        now, slope = now * factor, slope * factor[..., None]
        slope[..., k] -= mu * phi_slope[:, :, k] * now
        above.value[:, :, k], above.slope[:, :, k] = now, slope
    return RodTensions(below, above, normal)


# Where a force acts in a link's plane, x and z from its line, and the force across and along the link.
LinkForceInPlane = tuple[Varied, Varied, Varied, Varied]


def hole_on_link(chain: RollingChain, tension: RodTensions, r: int, k: int) -> Iterator[LinkForceInPlane]:
    """Yield N and f at the hole's middle (Eqs 6, 7, 18, 22) and F^t at the top where the rod ends (21)."""
    below, above = _pick(tension.below, r, k), _pick(tension.above, r, k)
    b, n = below.slope.shape
    x = constant(chain.offset[r, k], b, n)
    top = chain.link_length[k] - chain.countersink[r, k]
    yield x, constant(0.5 * (chain.mouth[r, k] + top), b, n), _pick(tension.normal, r, k), above - below
    if chain.last[r] == k + 1:
        nothing = constant(0.0, b, n)
        yield x, constant(top, b, n), nothing, nothing - above


def spans_on_link(
    chain: RollingChain, theta: Array, tension: RodTensions, r: int, k: int
) -> Iterator[LinkForceInPlane]:
    """Yield the rod's tension along the span below, at link k's own mouth, and along the span above."""
    b, n = theta.shape
    nothing = constant(0.0, b, n)
    across, along = _direction(chain, theta, r, k)
    sine, cosine = np.sin(theta[:, k]), np.cos(theta[:, k])
    turn_sine, turn_cosine = single(sine, cosine, k, n), single(cosine, -sine, k, n)
    pull = nothing - _pick(tension.below, r, k)
    to_x = pull * (across * turn_cosine - along * turn_sine)
    to_z = pull * (across * turn_sine + along * turn_cosine)
    yield constant(chain.offset[r, k], b, n), constant(chain.mouth[r, k], b, n), to_x, to_z
    if chain.last[r] > k + 1:
        across, along = _direction(chain, theta, r, k + 1)
        pull = _pick(tension.below, r, k + 1)
        same_plane = chain.axis[k] == chain.axis[k + 1]
        x = constant(chain.position[r, k + 1, chain.axis[k]] - chain.line[k], b, n)
        z = constant(chain.link_length[k] - chain.countersink[r, k + 1], b, n)
        yield x, z, pull * across if same_plane else nothing, pull * along


def _direction(chain: RollingChain, theta: Array, r: int, k: int) -> tuple[Varied, Varied]:
    """Return the direction of a rod's span at joint k, in the frame of the link below."""
    angle = theta[:, k]
    radius = active_radius(angle, chain.radius_positive[k], chain.radius_negative[k])
    line = span(angle, radius, chain.offset[r, k], chain.mouth[r, k], chain.countersink[r, k])
    x, z = line.across / line.length, line.along / line.length
    x_slope = (line.along - chain.countersink[r, k] - x * line.slope) / line.length
    z_slope = (line.along_slope - z * line.slope) / line.length
    n = chain.joints
    return single(x, x_slope, k, n), single(z, z_slope, k, n)


def _pick(item: Varied, r: int, k: int) -> Varied:
    return Varied(item.value[:, r, k], item.slope[:, r, k])


# ----------------------------------------------------------------------------------------------------
# The static model of chest_tube_2025 (doi 10.1109/LRA.2025.3597860) as printed, Eqs 1 to 24.
#
# Repairs, the least that make it solvable:
#
# 1. Eqs 13, 14: arcsin(A/R) for arcsin(R/A), which exceeds 1 (`joint.hole_angle`).
# 2. Eqs 15, 16: the gap's exact height for both signs of theta; as printed each side's rod has the
#    radius of its own side, whichever arc the link rolls on (`joint.span`).
# 3. Eq. 17: -R sin theta for even links, whose x axis is mirrored (`joint.contact_on_profile`).
# 4. Eq. 2: A^t, defined nowhere, is A^l (`joint.turn`).
# 5. Eqs 18, 22: L^tl, defined nowhere, is the hole's length L - R^l (1 - cos alpha), so that P^N is the
#    hole's middle, as the text says.
# 6. Eq. 7 is 0/0 at mu = 0; its limit F phi is taken there.
# 7. Eq. 8 is 0/0 at theta = 0; sin(theta)/h is taken (`joint.rod_curvature`).
# 8. The text's Fig. 8(a) for the odd links is Fig. 6(a).
#
# What is *not* repaired is what makes the even joints buckle (Fig. 13). Eq. 9 leaves out the elastic moment
# with which the next joint's rods turn a link further. Eqs 10 and 11 balance forces along the link only, so
# that the reaction at the base grows beyond the actuator's tension, where a robot that its rods alone hold
# needs just that tension; and of the distal links' weight only the part along each link is passed down. Eqs
# 6 and 7 put the rod's whole force on a link into the middle of its hole, and its part across the link is F
# phi with the clearance in phi: a straight robot's rods would push every link sideways. `Terms` gives back
# what is missing, one by one; with all of it the balance is that of `complete` under loading. Eqs 10 and 11
# also leave out F^ext, which stands in Eq. 9; it is used so.
#
# The links are rigid (Section III.B), whatever the robot's `link_modulus_Pa` says. The model has no memory:
# every row is read as loading (Eq. 1). Several rods, as the full robot has them, are summed; a joint's
# balance is taken in its own plane.

MODEL = "printed"
_NEXT, _AFTER = [1, 2, 0], [2, 0, 1]  # of x, y, z, in the terms of a cross product
_STEPS = 8  # from rest to each row; the even joints turn back on the way


@dataclass(frozen=True)
class Terms:
    """What the printed balance leaves out, and may be given back.

    Attributes:
        next_moment: the elastic moment of the next joint's rods, in Eq. 9.
        across: the balance across the link, beside Eqs 10 and 11, and in Eq. 9 the shear that the next
            joint passes down; with it the whole weight and tip force of what lies beyond.
        span_forces: a rod's force on a link as its tensions along its spans below and above, at the
            holes' mouths, in place of N and f at the hole's middle.
    """

    next_moment: bool = False
    across: bool = False
    span_forces: bool = False


AS_PRINTED = Terms()


@dataclass(frozen=True)
class PrintedBalance:
    """The printed balance in given postures; leading dimension b is the batch.

    Attributes:
        unbalanced: moment left at each joint (Eq. 9), shape (b, n) [N m].
        jacobian: its derivative by the bend angles, shape (b, n, n) [N m/rad].
        reaction: F^R_i of each joint along the normal of the link below (Eqs 10, 11), (b, n) [N].
        tension: in each joint's gap, F_(i-1), shape (b, t, n) [N].
    """

    unbalanced: Array
    jacobian: Array
    reaction: Array
    tension: Array


def printed(robot: RollingRobot, inputs: Inputs, gravity_mps2: Array, terms: Terms = AS_PRINTED) -> StaticRun:
    """Return the postures by the printed balance.

    Args:
        robot: a robot of rolling joints.
        inputs: tensions of its rods, and optionally tip force and moment.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        terms: what to add to the printed balance.

    Raises:
        InputError: displacement inputs, or no posture balances a row.
    """
    require_tensions(inputs, MODEL)
    chain = rolling_chain(robot)
    gravity = np.asarray(gravity_mps2, dtype=float)
    theta, found = solve_printed(chain, inputs, gravity, terms)
    run = postures(chain, inputs, gravity, theta, found.tension)
    return StaticRun(MODEL, inputs, gravity, tuple(run), np.abs(found.unbalanced).max(axis=1))


def solve_printed(
    chain: RollingChain, inputs: Inputs, gravity_mps2: Array, terms: Terms = AS_PRINTED
) -> tuple[Array, PrintedBalance]:
    """Return the bend angles of every row, shape (r, n) [rad], and their balance, all rows at once."""
    theta = np.tile(chain.rest_angle, (len(inputs), 1))
    try:
        for part in np.linspace(0.0, 1.0, _STEPS + 1):

            def moments(angles: Array, part: float = part) -> tuple[Array, Array]:
                acting = printed_balance(
                    chain,
                    angles,
                    part * inputs.tendon,
                    gravity_mps2,
                    part * inputs.force_tip,
                    part * inputs.moment_tip,
                    terms,
                )
                return acting.unbalanced, acting.jacobian

            theta = balanced(moments, theta, chain.low, chain.high)
    except NotBalanced as error:
        raise InputError(f"{row_name(inputs, error.index)}: static model {MODEL!r}: {error}") from None
    found = printed_balance(
        chain, theta, inputs.tendon, gravity_mps2, inputs.force_tip, inputs.moment_tip, terms
    )
    return theta, found


def printed_balance(
    chain: RollingChain,
    theta: Array,
    drive: Array,
    gravity_mps2: Array,
    force_tip: Array,
    moment_tip: Array,
    terms: Terms = AS_PRINTED,
) -> PrintedBalance:
    """Return the balance of Eqs 9 to 11 at the bend angles `theta`.

    Args:
        chain: the robot.
        theta: shape (b, n) [rad].
        drive: tension at the actuator, shape (b, t) [N].
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        force_tip, moment_tip: on the last link, base frame, shape (b, 3) [N], [N m].
        terms: what to add.
    """
    n, b = chain.joints, len(theta)
    links = frames(chain, theta)
    elastic, elastic_slope = complete.elastic_moments(chain, theta, complete.spans(chain, theta))
    tension = rod_tensions(chain, theta, drive)
    taut = [r for r in range(chain.pulled) if drive[:, r].any()]
    nothing = Varied(np.zeros(b), np.zeros((b, n)))
    down, shear = nothing, nothing  # the next joint's reaction, along and across the flat it rolls on
    value, jacobian, reaction = np.empty((b, n)), np.empty((b, n, n)), np.empty((b, n))
    for k in reversed(range(n)):
        x_next = _next_contact(chain, theta, k)
        x_own, z_own = _own_contact(chain, theta, k)
        weight_x, weight_z = _in_link(links, k, chain.axis, chain.mass[k] * gravity_mps2)
        # Eqs 10, 11: along the link, pressed down by the next link, the rods and the weight.
        along = down - weight_z
        across = shear - weight_x
        moment = down * (x_next - x_own) - shear * (constant(chain.link_length[k], b, n) - z_own)
        moment += weight_x * (constant(chain.mass_height[k], b, n) - z_own)
        moment -= weight_z * (constant(-chain.line[k], b, n) - x_own)
        for r in taut:
            if not chain.passes[r, k]:
                continue
            for x, z, to_x, to_z in (
                spans_on_link(chain, theta, tension, r, k)
                if terms.span_forces
                else hole_on_link(chain, tension, r, k)
            ):
                along -= to_z
                across -= to_x
                moment += to_x * (z - z_own) - to_z * (x - x_own)
        if k == n - 1:
            tip_x, tip_z = _in_link(links, k, chain.axis, force_tip)
            if terms.across:
                along -= tip_z
                across -= tip_x
            tip_height = constant(chain.link_length[k], b, n)
            moment += tip_x * (tip_height - z_own) - tip_z * (constant(-chain.line[k], b, n) - x_own)
            moment += _about_axis(links, k, moment_tip)
        elif terms.next_moment and chain.axis[k] == chain.axis[k + 1]:
            moment += single(elastic[:, k + 1], elastic_slope[:, k + 1], k + 1, n)
        moment -= single(elastic[:, k], elastic_slope[:, k], k, n)
        value[:, k], jacobian[:, k] = moment.value, moment.slope
        sine, cosine = np.sin(theta[:, k]), np.cos(theta[:, k])
        if terms.across:
            turn_sine, turn_cosine = single(sine, cosine, k, n), single(cosine, -sine, k, n)
            down = along * turn_cosine - across * turn_sine
            shear = along * turn_sine + across * turn_cosine
        else:
            down = along * single(1.0 / cosine, sine / cosine**2, k, n)
        reaction[:, k] = down.value
        if k and chain.axis[k] != chain.axis[k - 1]:
            shear = nothing  # across the plane of the joint below
    return PrintedBalance(value, jacobian, reaction, tension.below.value)


def _own_contact(chain: RollingChain, theta: Array, k: int) -> tuple[Varied, Varied]:
    """Return x and z of O_k (Eq. 17) in link k's frame."""
    radius = active_radius(theta[:, k], chain.radius_positive[k], chain.radius_negative[k])
    x, z = contact_on_profile(theta[:, k], radius)
    n = chain.joints
    return single(x, radius - z, k, n), single(z, x, k, n)


def _next_contact(chain: RollingChain, theta: Array, k: int) -> Varied:
    """Return x of P^F_k (Eqs 20, 24): where the next link touches link k's flat, from link k's line.

    A joint of the other plane touches along this plane; its middle is taken, on the axis.
    """
    n, b = chain.joints, len(theta)
    if k == n - 1 or chain.axis[k] != chain.axis[k + 1]:
        return constant(-chain.line[k], b, n)
    angle = theta[:, k + 1]
    radius = active_radius(angle, chain.radius_positive[k + 1], chain.radius_negative[k + 1])
    return single(chain.line[k + 1] - chain.line[k] + radius * angle, radius, k + 1, n)


def _in_link(links: Frames, k: int, axes: np.ndarray, force: Array) -> tuple[Varied, Varied]:
    """Return a base-frame force in link k's plane, across and along: psi of Eqs 10 and 11."""
    n = links.axis.shape[-2]
    result = []
    for column in (axes[k], 2):
        direction = links.R_w[:, k, :, column]
        acting = np.broadcast_to(force, direction.shape)
        slope = np.zeros((len(direction), n))
        # (axis x direction) . force, with the cross product taken once for all joints below
        slope[:, : k + 1] = (links.axis[:, : k + 1] @ _cross(direction, acting)[..., None])[..., 0]
        result.append(Varied(np.einsum("bi,bi->b", direction, acting), slope))
    return result[0], result[1]


def _about_axis(links: Frames, k: int, moment: Array) -> Varied:
    """Return the part of a base-frame moment about joint k's axis."""
    n = links.axis.shape[-2]
    axis = links.axis[:, k]
    slope = np.zeros((len(axis), n))
    slope[:, :k] = (links.axis[:, :k] @ _cross(axis, moment)[..., None])[..., 0]
    return Varied(np.einsum("bi,bi->b", axis, moment), slope)


def _cross(a: Array, b: Array) -> Array:
    """Return a x b of shapes (b, 3); `np.cross` takes several times as long for a few rows."""
    return a[:, _NEXT] * b[:, _AFTER] - a[:, _AFTER] * b[:, _NEXT]
