"""The complete balance of rolling joints, by Newton-Euler and by virtual work, and its static models."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, LinkForce, check_links, row_name
from catheter_sim.core.posture import Posture
from catheter_sim.core.statics import NoEquilibrium, StaticRun, require_tensions
from catheter_sim.errors import InputError
from catheter_sim.mechanics.hysteresis import counts_where_alone
from catheter_sim.robots.rolling import joint
from catheter_sim.robots.rolling.description import RollingChain, rolling_chain
from catheter_sim.robots.rolling.joint import Span, active_radius
from catheter_sim.robots.rolling.kernels import (
    LENGTH,
    REST,
    ChainBalance,
    RodPulls,
    follow,
    load_batch,
    pack,
    tops,
)
from catheter_sim.robots.rolling.spec import RollingRobot

# ----------------------------------------------------------------------------------------------------
# Where the links of a rolling-joint robot are, from its joints' angles; whole batches at once.
#
# A link's frame has its z axis on the robot's axis and its origin at the height of its joint's line at
# rest, so that the link's flat top is at z = link_length. Leading dimensions of `theta` are the batch.


@dataclass(frozen=True)
class Frames:
    """The links' frames, and the joints' contacts, in the base frame.

    Attributes:
        R_w: of the links, shape (..., n, 3, 3).
        origin: of the links' frames, shape (..., n, 3) [m].
        face: centres of the links' flat tops, shape (..., n, 3) [m].
        below_R_w: of the flat on which joint k rolls: link k - 1's, or the base's, (..., n, 3, 3).
        below_face: centre of that flat, shape (..., n, 3) [m].
        contact: on the joint's own plane, shape (..., n, 3) [m].
        along: unit vector of the bending direction on the flat below, shape (..., n, 3).
        axis: unit vector about which the joint turns toward it, shape (..., n, 3).
    """

    R_w: Array
    origin: Array
    face: Array
    below_R_w: Array
    below_face: Array
    contact: Array
    along: Array
    axis: Array


def frames(chain: RollingChain, theta: Array, link_length: Array | None = None) -> Frames:
    """Return the frames of the links at the bend angles `theta`, shape (..., n) [rad].

    Args:
        chain: the robot.
        theta: bend angles, shape (..., n) [rad].
        link_length: of the links as compressed, shape (..., n) [m]; default: their own.
    """
    batch = theta.shape[:-1]
    length = np.broadcast_to(chain.link_length if link_length is None else link_length, theta.shape)
    radius = joint.active_radius(theta, chain.radius_positive, chain.radius_negative)
    across, rise = joint.line_position(theta, radius)
    turn_w = _turns(chain, theta)
    R = np.broadcast_to(np.eye(3), (*batch, 3, 3))
    face = np.zeros((*batch, 3))
    steps: list[tuple[Array, ...]] = []
    for k in range(chain.joints):
        below, below_face = R, face
        along, normal = below[..., :, chain.axis[k]], below[..., :, 2]
        contact = face + (chain.line[k] + radius[..., k] * theta[..., k])[..., None] * along
        line = face + (chain.line[k] + across[..., k])[..., None] * along + rise[..., k][..., None] * normal
        R = below @ turn_w[..., k, :, :]
        origin = line - chain.line[k] * R[..., :, chain.axis[k]]
        face = origin + length[..., k][..., None] * R[..., :, 2]
        axis = below[..., :, 1] if chain.axis[k] == 0 else -below[..., :, 0]
        steps.append((R, origin, face, below, below_face, contact, along, axis))
    columns = list(zip(*steps, strict=True))
    return Frames(
        R_w=np.stack(columns[0], axis=-3),
        origin=np.stack(columns[1], axis=-2),
        face=np.stack(columns[2], axis=-2),
        below_R_w=np.stack(columns[3], axis=-3),
        below_face=np.stack(columns[4], axis=-2),
        contact=np.stack(columns[5], axis=-2),
        along=np.stack(columns[6], axis=-2),
        axis=np.stack(columns[7], axis=-2),
    )


def _turns(chain: RollingChain, theta: Array) -> Array:
    """Return each joint's rotation from the frame below to the link's, shape (..., n, 3, 3)."""
    cosine, sine = np.cos(theta), np.sin(theta)
    result = np.zeros((*theta.shape, 3, 3))
    toward_x = chain.axis == 0
    # Toward +x the joint turns about +y, toward +y about -x; both turn z toward the bending direction.
    for i, here in ((0, toward_x), (1, ~toward_x)):
        other = 1 - i
        result[..., here, i, i] = cosine[..., here]
        result[..., here, i, 2] = sine[..., here]
        result[..., here, 2, i] = -sine[..., here]
        result[..., here, 2, 2] = cosine[..., here]
        result[..., here, other, other] = 1.0
    return result


# ----------------------------------------------------------------------------------------------------
# What acts on the links of a rolling-joint robot besides its rods: weight, tip load, other forces.


@dataclass(frozen=True)
class LinkLoads:
    """Forces at points of links, and a moment on the last link, all steady in the base frame.

    Attributes:
        link: index of the link, from 0, shape (p,).
        point: in the link's frame, shape (p, 3) [m].
        force: in the base frame, shape (p, 3) [N].
        tip_moment: in the base frame, shape (3,) [N m].
        tip: which of the forces acts on the tip.
    """

    link: np.ndarray
    point: Array
    force: Array
    tip_moment: Array
    tip: int


def loads(
    chain: RollingChain,
    gravity_mps2: Array,
    force_tip: Array | None = None,
    moment_tip: Array | None = None,
    others: Sequence[LinkForce] = (),
) -> LinkLoads:
    """Return the weight of every link, the tip's load and `others`.

    Args:
        chain: the robot.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        force_tip: on the centre of the last link's top, base frame, shape (3,) [N].
        moment_tip: on the last link, base frame, shape (3,) [N m].
        others: further forces.

    Raises:
        InputError: a link that the robot does not have, or a moment on one.
    """
    n = chain.joints
    check_links(others, n)
    for item in others:
        if any(item.moment_Nm):
            raise InputError(
                f"moment on link {item.link}: statics of rolling joints take one at the tip only"
            )
    centres = np.zeros((n, 3))
    centres[:, 2] = chain.mass_height
    link = np.concatenate([np.arange(n), [n - 1], np.array([item.link - 1 for item in others], dtype=int)])
    tip = np.array([[0.0, 0.0, chain.link_length[-1]]])
    tops = [(0.0, 0.0, float(chain.link_length[item.link - 1])) for item in others]
    places = [item.point_m or top for item, top in zip(others, tops, strict=True)]
    point = np.concatenate([centres, tip, np.array(places).reshape(-1, 3)])
    force = np.concatenate(
        [
            chain.mass[:, None] * np.asarray(gravity_mps2, dtype=float)[None, :],
            np.zeros((1, 3)) if force_tip is None else np.asarray(force_tip, dtype=float)[None, :],
            np.array([item.force_N for item in others], dtype=float).reshape(-1, 3),
        ]
    )
    order = np.argsort(link, kind="stable")
    moment = np.zeros(3) if moment_tip is None else np.asarray(moment_tip, dtype=float)
    return LinkLoads(link[order], point[order], force[order], moment, int(np.flatnonzero(order == n)[0]))


def load_points(links: Frames, acting: LinkLoads) -> Array:
    """Return where the forces act in the base frame, shape (..., p, 3) [m]."""
    origin = links.origin[..., acting.link, :]
    R = links.R_w[..., acting.link, :, :]
    return origin + np.einsum("...pij,pj->...pi", R, acting.point)


# ----------------------------------------------------------------------------------------------------
# From rows of inputs to steps of what acts, and from solved angles to postures.
#
# A trial starts at rest: zero inputs, no friction history, weight already acting. Between rows the inputs
# move linearly, in steps so small that their number does not matter.

# A step's change of inputs would bend the softest joint by at most this much, were it alone.
# Halving it moves the tip of `chest_tube_section` by at most 2 um over its nominal tables.
STEP_BEND_RAD = 0.04
_MAX_STEPS = 2000  # between two rows
_SLACK_SHARE = 1e-3  # of the largest tension: what an input that comes late leaves behind


@dataclass(frozen=True)
class Stretch:
    """The way from one row of inputs to the next.

    Attributes:
        drive_from, drive_to: tension at the actuator, shape (t,) [N].
        loads_from, loads_to: on the links.
        steps: how many.
    """

    drive_from: Array
    drive_to: Array
    loads_from: LinkLoads
    loads_to: LinkLoads
    steps: int

    def at(self, part: float) -> tuple[Array, LinkLoads]:
        """Return what acts at a share of the way."""

        def blend(start: Array, end: Array) -> Array:
            return start + part * (end - start)

        force = blend(self.loads_from.force, self.loads_to.force)
        moment = blend(self.loads_from.tip_moment, self.loads_to.tip_moment)
        drive = blend(self.drive_from, self.drive_to)
        return drive, replace(self.loads_to, force=force, tip_moment=moment)


@dataclass(frozen=True)
class StandingLinks:
    """Where a robot stands after rows of inputs, and what its friction remembers: rows may go on from there.

    Attributes:
        theta: bend angles, shape (n,) [rad].
        link_length: as compressed, shape (n,) [m].
        memory: of each rod in each link, shape (1, t, n), or (3, t, n) where it goes by how rods slide.
        drive: tension at the actuator, shape (t,) [N].
        force: of the points that are loaded, in the base frame, shape (p, 3) [N].
        tip_moment: in the base frame, shape (3,) [N m].
    """

    theta: Array
    link_length: Array
    memory: Array
    drive: Array
    force: Array
    tip_moment: Array


@dataclass(frozen=True)
class Ways:
    """The ways to rest under the weight alone, then to each of r rows of inputs.

    Of rows that go on from where a robot stands, the first way has no steps.

    Attributes:
        drive: tension at the actuator at their ends, shape (r + 1, t) [N].
        force: in the base frame, of the points in `at_rest`, shape (r + 1, p, 3) [N].
        tip_moment: in the base frame, shape (r + 1, 3) [N m].
        steps: how many, shape (r + 1,).
        at_rest: the loads of the first way.
    """

    drive: Array
    force: Array
    tip_moment: Array
    steps: np.ndarray
    at_rest: LinkLoads


def ways(
    chain: RollingChain,
    inputs: Inputs,
    gravity_mps2: Array,
    others: Sequence[LinkForce] = (),
    step_bend_rad: float | None = None,
    alone_bend_rad: float | None = None,
    after: StandingLinks | None = None,
) -> Ways:
    """Return the way to rest under the weight and `others` alone, and the way to each row of inputs.

    Args:
        chain: the robot.
        inputs: the rows.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        others: further forces, steady from the start.
        step_bend_rad: what a step may bend the softest joint; default `STEP_BEND_RAD`.
        alone_bend_rad: what the rods of one end may that move all but alone, the rest by less than a tenth of
            `step_bend_rad`; default: no more than the others.
        after: where the robot stands instead of at rest.
    """
    at_rest = loads(chain, gravity_mps2, others=others)
    force = np.repeat(at_rest.force[np.newaxis], len(inputs) + 1, axis=0)
    force[1:, at_rest.tip] = inputs.force_tip
    drive = np.concatenate([np.zeros((1, chain.pulled)), inputs.tendon])
    moment = np.concatenate([np.zeros((1, 3)), inputs.moment_tip])
    if after is not None:
        drive[0], force[0], moment[0] = after.drive, after.force, after.tip_moment
    moves = np.abs(np.diff(drive, axis=0))
    arm = float(np.abs(chain.offset).max())
    change = (
        arm * moves.sum(axis=1)
        + float(chain.link_length.sum()) * np.linalg.norm(np.diff(force, axis=0), axis=(1, 2))
        + np.linalg.norm(np.diff(moment, axis=0), axis=1)
    )
    stiffness, step_rad = float(chain.rest_stiffness.min()), step_bend_rad or STEP_BEND_RAD
    counts = np.ceil(change / (stiffness * step_rad))
    if alone_bend_rad is not None:
        last = chain.last[: chain.pulled]
        alone = np.max([moves[:, last == end].sum(axis=1) for end in last], axis=0)
        counts = counts_where_alone(change / stiffness, arm * alone / stiffness, step_rad, alone_bend_rad)
    # Undefined where numbers are beyond a float's digits: the search then finds no balance, and says so.
    steps = np.nan_to_num(np.clip(counts, 1, _MAX_STEPS), nan=1.0).astype(np.int64)
    return Ways(drive, force, moment, np.concatenate([[int(after is None)], steps]), at_rest)


def several_rods_at_once(tension: Array) -> bool:
    """Return whether more than one rod is tense anywhere on the way through rows of tensions, (r, t) [N]."""
    tense = tension > _SLACK_SHARE * tension.max(initial=0.0)
    tense[1:] |= tense[:-1]
    return bool((tense.sum(axis=1) > 1).any())


def stretches(
    chain: RollingChain, inputs: Inputs, gravity_mps2: Array, others: Sequence[LinkForce] = ()
) -> Iterator[Stretch]:
    """Yield `ways`, of the same arguments, one by one."""
    all_ways = ways(chain, inputs, gravity_mps2, others)
    drive, before = all_ways.drive, all_ways.at_rest
    for row, steps in enumerate(all_ways.steps):
        acting = replace(before, force=all_ways.force[row], tip_moment=all_ways.tip_moment[row])
        yield Stretch(drive[max(row - 1, 0)], drive[row], before, acting, int(steps))
        before = acting


def faces(
    chain: RollingChain,
    inputs: Inputs,
    gravity_mps2: Array,
    theta: Array,
    link_length: Array | None = None,
) -> tuple[Array, Array]:
    """Return every link's flat top in every row, the base pressed into the mount by all that acts.

    Arguments as in `postures`.

    Returns:
        Positions, shape (r, n, 3) [m], and orientations, shape (r, n, 3, 3), in the base frame.
    """
    if link_length is None:
        link_length = np.tile(chain.link_length, (len(theta), 1))
    face, R_w = np.empty((*theta.shape, 3)), np.empty((*theta.shape, 3, 3))
    angles, lengths = np.ascontiguousarray(theta), np.ascontiguousarray(link_length)
    tops(pack(chain).joint, angles, lengths, face, R_w)
    weight = float(chain.mass.sum() * gravity_mps2[2])
    pressed = weight + inputs.force_tip[:, 2] - inputs.tendon.sum(axis=1)
    shift = np.zeros((len(inputs), 1, 3))
    shift[:, 0, 2] = pressed / chain.robot.mount.axial_stiffness_N_per_m
    return face + shift, R_w


def postures(
    chain: RollingChain,
    inputs: Inputs,
    gravity_mps2: Array,
    theta: Array,
    at_joint: Array,
    link_length: Array | None = None,
) -> list[Posture]:
    """Return the postures of every row, the base pressed into the mount by all that acts.

    Args:
        chain: the robot.
        inputs: the rows.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        theta: bend angles, shape (r, n) [rad].
        at_joint: tension of the pulled rods in each joint's gap, shape (r, t, n) [N].
        link_length: as compressed, shape (r, n) [m].
    """
    face, R_w = faces(chain, inputs, gravity_mps2, theta, link_length)
    inside = np.where(chain.passes[: chain.pulled], at_joint, np.nan)
    return [
        Posture(
            p_w=face[row],
            R_w=R_w[row],
            joint_angles=theta[row],
            actuator_tension=inputs.tendon[row],
            tendon_tension=inside[row],
        )
        for row in range(len(inputs))
    ]


# ----------------------------------------------------------------------------------------------------
# Newton's method for a batch of configurations whose joints must not close their gaps.

ANGLE_TOLERANCE_RAD = 1e-11
_MOST_ROUNDS = 60
_MOST_HALVINGS = 12
_TOWARD_LIMIT = 0.9  # of the way to a closing gap that one step may go


class NotBalanced(NoEquilibrium):
    """No posture was found for one configuration of a batch: `index` says which."""

    def __init__(self, index: int) -> None:
        """Say which configuration."""
        super().__init__("no posture close by balances the rods and the loads")
        self.index = index


# Bend angles (b, n) -> moment left at each joint (b, n) [N m] and its derivative (b, n, n) [N m/rad].
BalanceOf = Callable[[Array], tuple[Array, Array]]


def balanced(balance: BalanceOf, start: Array, low: Array, high: Array) -> Array:
    """Return the bend angles near `start` that leave no moment, shape (b, n) [rad].

    `balance` is called last with the angles that are returned. A step stops short of a closing gap,
    and is halved while it makes the balance worse.

    Args:
        balance: moments left and their derivative.
        start: shape (b, n) [rad].
        low, high: where the gaps close, shape (n,) [rad].

    Raises:
        NotBalanced: none was found for one configuration or more.
    """
    theta = np.array(start, dtype=float)
    value, jacobian = balance(theta)
    small = np.zeros(theta.shape[:-1], dtype=bool)
    for _ in range(_MOST_ROUNDS):
        try:
            step = -np.linalg.solve(jacobian, value[..., None])[..., 0]
        except np.linalg.LinAlgError:
            break
        room = np.where(step > 0.0, high - theta, theta - low)
        share = np.min(_TOWARD_LIMIT * room / np.maximum(np.abs(step), 1e-300), axis=-1, initial=1.0)
        before = np.abs(value).max(axis=-1)
        small = np.abs(step).max(axis=-1) < ANGLE_TOLERANCE_RAD
        for _ in range(_MOST_HALVINGS):
            following = theta + share[..., None] * step
            value, jacobian = balance(following)
            worse = (np.abs(value).max(axis=-1) > before) & ~small
            if not worse.any():
                break
            share = np.where(worse, 0.5 * share, share)
        theta = following
        if small.all():
            return theta
    raise NotBalanced(int(np.argmax(np.atleast_1d(~small))))


# ----------------------------------------------------------------------------------------------------
# What the rods do at every joint: their spans, elastic moments and tensions, in plain NumPy.
#
# Leading dimensions of `theta` are the batch; rods come before joints: shape (..., m, n).


@dataclass(frozen=True)
class Tensions:
    """Tension of the pulled rods at every joint.

    Attributes:
        at_joint: in the gap of the joint, which the joint feels, shape (..., t, n) [N].
        above: behind the hole of the joint's own link, shape (..., t, n) [N].
        slope: derivative of `at_joint` by the bend angles, shape (..., t, n, n) [N/rad].
    """

    at_joint: Array
    above: Array
    slope: Array


def spans(chain: RollingChain, theta: Array) -> joint.Span:
    """Return every rod's free span at every joint."""
    radius = joint.active_radius(theta, chain.radius_positive, chain.radius_negative)
    return joint.span(theta[..., None, :], radius[..., None, :], chain.offset, chain.mouth, chain.countersink)


def turns(chain: RollingChain, theta: Array) -> tuple[Array, Array]:
    """Return every rod's turn in every link, signed, and its derivative, shapes (..., m, n) [rad]."""
    radius = joint.active_radius(theta, chain.radius_positive, chain.radius_negative)
    below = np.concatenate([chain.link_length[:1], chain.link_length[:-1]])
    return joint.turn(
        theta[..., None, :],
        radius[..., None, :],
        chain.offset,
        chain.mouth,
        chain.side * chain.clearance,
        chain.link_length - chain.countersink,
        below,
    )


def elastic_moments(chain: RollingChain, theta: Array, span: joint.Span) -> tuple[Array, Array]:
    """Return the moment with which rods and sleeve resist at each joint, and its slope, (..., n).

    chest_tube_2025, Eq. 8, summed over the rods that pass, with cubic and quintic terms and the rest
    angle where the robot has them.
    """
    curvature, slope = joint.rod_curvature(theta[..., None, :], span.along, span.along_slope)
    bent = curvature - chain.rest_curvature
    stiffness = np.where(chain.passes, chain.stiffness[:, None], 0.0)
    mean = (theta - chain.rest_angle) / chain.link_length
    law = 1.0 + mean**2 * (chain.cubic + mean**2 * chain.quintic)
    steeper = mean * (2.0 * chain.cubic + 4.0 * mean**2 * chain.quintic) / chain.link_length
    moment = stiffness * bent * law[..., None, :]
    tangent = stiffness * (slope * law[..., None, :] + bent * steeper[..., None, :])
    sleeve = chain.sleeve_stiffness * (theta - chain.rest_angle)
    return moment.sum(axis=-2) + sleeve, tangent.sum(axis=-2) + chain.sleeve_stiffness


def tensions(chain: RollingChain, drive: Array, kept: Array, turn: Array, turn_slope: Array) -> Tensions:
    """Return the pulled rods' tensions, from the actuator to the tip, with dry friction.

    The tension above joint i lies in [F e^(-mu |phi_i|), F e^(+mu |phi_i|)] around the tension F below
    it and keeps its value unless the interval pushes it (Eq. 1 is its lower end). It knows one rod's
    own history only: where several rods are pulled against one another, or a force moves the robot
    while a rod is held, Coulomb's law asks for the rod's sliding instead.

    Args:
        chain: the robot.
        drive: tension at the actuator, shape (..., t) [N].
        kept: tension above each joint a moment ago, shape (..., t, n) [N].
        turn, turn_slope: from `turns`, shape (..., m, n).
    """
    t, n = chain.pulled, chain.joints
    passes = chain.passes[:t]
    factor = np.exp(chain.mu * np.abs(turn[..., :t, :]))
    grows = chain.mu * np.sign(turn[..., :t, :]) * turn_slope[..., :t, :]
    below = np.asarray(drive, dtype=float)
    slope_below = np.zeros((*below.shape, n))
    at_joint, above, slopes = [], [], []
    for k in range(n):
        below = np.where(passes[:, k], below, 0.0)
        slope_below = np.where(passes[:, k, None], slope_below, 0.0)
        at_joint.append(below)
        slopes.append(slope_below)
        e, held = factor[..., k], kept[..., k]
        low, high = below / e, below * e
        sign = np.where(held < low, -1.0, np.where(held > high, 1.0, 0.0))
        ratio = np.where(sign == 0.0, 0.0, e**sign)
        next_slope = ratio[..., None] * slope_below
        next_slope[..., k] += sign * ratio * below * grows[..., k]
        below, slope_below = np.clip(held, low, high), next_slope
        above.append(below)
    return Tensions(np.stack(at_joint, axis=-1), np.stack(above, axis=-1), np.stack(slopes, axis=-2))


# ----------------------------------------------------------------------------------------------------
# The complete Newton-Euler balance, link by link, in plain NumPy: the reference of the compiled one.
#
# Link k with the rods in it is cut free in the gaps below and above. On it act: at its own gap each pulled
# rod's tension along the rod's span, and the rods' elastic moment; at the gap above the same with the
# opposite signs; its loads; the next joint's reaction; and the reaction of its own joint, a force at the
# contact and a moment about any axis but the joint's own. Friction of a rod in its hole is inside the cut.
# chest_tube_2025 (doi 10.1109/LRA.2025.3597860), Eqs 9 to 11, leaves out the elastic moment of the next
# joint and the balance across the link, and with it the weight of what lies beyond.


@dataclass(frozen=True)
class Reactions:
    """What the joints carry in one posture.

    Attributes:
        force: of joint k on link k at the contact, base frame, shape (n, 3) [N]; the first is the
            base's.
        moment: of joint k on link k, base frame, shape (n, 3) [N m].
        unbalanced: its part about the joint's own axis, which a rolling joint cannot carry: zero in
            equilibrium, shape (n,) [N m].
        compression: force that each link carries along its axis, pressed positive, shape (n,) [N].
    """

    force: Array
    moment: Array
    unbalanced: Array
    compression: Array


def reactions(
    chain: RollingChain,
    theta: Array,
    tension: Tensions,
    acting: LinkLoads,
    link_length: Array | None = None,
) -> Reactions:
    """Return what the joints carry at the bend angles `theta`.

    Args:
        chain: the robot.
        theta: shape (n,) [rad].
        tension: of the pulled rods, from `tensions`.
        acting: the loads on the links.
        link_length: of the links as compressed, shape (n,) [m]; default: their own.
    """
    n = chain.joints
    links = frames(chain, theta, link_length)
    span = spans(chain, theta)
    elastic, _ = elastic_moments(chain, theta, span)
    points = load_points(links, acting)
    force, moment = np.zeros((n, 3)), np.zeros((n, 3))
    for k in reversed(range(n)):
        contact = links.contact[k]
        pushes: list[tuple[Array, Array]] = [
            (point, push)
            for point, push, link in zip(points, acting.force, acting.link, strict=True)
            if link == k
        ]
        twists = -elastic[k] * links.axis[k]
        for lower, chord, pull in _pulls(chain, links, span, tension, k):
            pushes.append((lower + chord, -pull * chord / np.linalg.norm(chord)))
        if k == n - 1:
            twists = twists + acting.tip_moment
        else:
            for lower, chord, pull in _pulls(chain, links, span, tension, k + 1):
                pushes.append((lower, pull * chord / np.linalg.norm(chord)))
            pushes.append((links.contact[k + 1], -force[k + 1]))
            twists = twists + elastic[k + 1] * links.axis[k + 1] - moment[k + 1]
        force[k] = -sum(push for _, push in pushes)
        moment[k] = -twists - sum(np.cross(point - contact, push) for point, push in pushes)
    return Reactions(
        force=force,
        moment=moment,
        unbalanced=-np.einsum("ki,ki->k", moment, links.axis),
        compression=compressions(chain, links, tension, acting),
    )


def _pulls(
    chain: RollingChain, links: Frames, span: Span, tension: Tensions, k: int
) -> Iterator[tuple[Array, Array, float]]:
    """Yield each pulled rod's lower mouth, span and tension in the gap of joint k."""
    for r in range(chain.pulled):
        if chain.passes[r, k]:
            local = np.array([*chain.position[r, k], -chain.countersink[r, k]])
            lower = links.below_face[k] + links.below_R_w[k] @ local
            chord = span.across[r, k] * links.along[k] + span.along[r, k] * links.below_R_w[k, :, 2]
            yield lower, chord, float(tension.at_joint[r, k])


def compressions(chain: RollingChain, links: Frames, tension: Tensions, acting: LinkLoads) -> Array:
    """Return the force that presses each link together along its axis, shape (..., n) [N].

    Its rods, whose tension falls along the hole by friction (the mean is taken), and the loads that
    act beyond its middle.
    """
    t = chain.pulled
    inside = 0.5 * (tension.at_joint + tension.above) * chain.passes[:t]
    beyond = (acting.link[None, :] >= np.arange(chain.joints)[:, None]) @ acting.force
    return inside.sum(axis=-2) - np.einsum("...kj,kj->...k", links.R_w[..., :, :, 2], beyond)


# ----------------------------------------------------------------------------------------------------
# The balance of a rolling-joint robot by virtual work, in plain NumPy, for whole batches.
#
# Turning joint i alone by d theta, everything beyond it turns about its contact. So
#
# -sum_r F_ri dl_ri/dtheta - elastic moment + axis . sum (r_p - contact_i) x f_p = 0,
#
# F_ri the tension of pulled rod r in the gap of joint i and l_ri its span there. No reaction does work.


@dataclass(frozen=True)
class Balance:
    """What acts about each joint in given postures; leading dimensions are the batch.

    Attributes:
        theta: bend angles, shape (..., n) [rad].
        tension: of the pulled rods, at every joint.
        unbalanced: moment left at each joint, zero in equilibrium, shape (..., n) [N m].
        jacobian: its derivative by the bend angles, shape (..., n, n) [N m/rad].
        link_length: as these tensions and loads compress the links, shape (..., n) [m].
    """

    theta: Array
    tension: Tensions
    unbalanced: Array
    jacobian: Array
    link_length: Array


def load_moments(chain: RollingChain, links: Frames, theta: Array, acting: LinkLoads) -> tuple[Array, Array]:
    """Return what the loads do about each joint, and its derivative, shapes (..., n) and (..., n, n)."""
    arm = load_points(links, acting)[..., None, :, :] - links.contact[..., :, None, :]
    beyond = acting.link[None, :] >= np.arange(chain.joints)[:, None]
    force = np.where(beyond[:, :, None], acting.force, 0.0)
    axis = links.axis
    about = np.cross(arm, force).sum(axis=-2) + acting.tip_moment
    moment = np.einsum("...ki,...ki->...k", axis, about)
    # Forces with a fixed direction have a potential: their derivative is symmetric.
    moved = np.cross(np.cross(axis[..., :, None, :], arm), force).sum(axis=-2)
    upper = np.triu(axis @ np.swapaxes(moved, -1, -2), k=1)
    radius = active_radius(theta, chain.radius_positive, chain.radius_negative)
    rolls = radius[..., None] * np.cross(links.along, force.sum(axis=-2))
    own = np.einsum("...ki,...ki->...k", axis, moved - rolls)
    slope = upper + np.swapaxes(upper, -1, -2) + own[..., :, None] * np.eye(chain.joints)
    # A moment has no potential in space: a joint below turns the axis about which it acts.
    turned = np.cross(axis[..., None, :, :], axis[..., :, None, :]) @ acting.tip_moment
    return moment, slope + np.tril(turned, k=-1)


def balance(
    chain: RollingChain, theta: Array, drive: Array, kept: Array, acting: LinkLoads, link_length: Array
) -> Balance:
    """Return what acts about each joint at the bend angles `theta`.

    Args:
        chain: the robot.
        theta: shape (..., n) [rad].
        drive: tension at the actuator, shape (..., t) [N].
        kept: tension above each joint a moment ago, shape (..., t, n) [N].
        acting: loads on the links, the same for all.
        link_length: of the links, shape (..., n) [m].
    """
    t = chain.pulled
    span = spans(chain, theta)
    tension = tensions(chain, drive, kept, *turns(chain, theta))
    elastic, elastic_slope = elastic_moments(chain, theta, span)
    slope, second = (np.where(chain.passes[:t], item[..., :t, :], 0.0) for item in (span.slope, span.second))
    links = frames(chain, theta, link_length)
    pushed, pushed_slope = load_moments(chain, links, theta, acting)
    diagonal = -(tension.at_joint * second).sum(axis=-2) - elastic_slope
    return Balance(
        theta=theta,
        tension=tension,
        unbalanced=pushed - elastic - (tension.at_joint * slope).sum(axis=-2),
        jacobian=pushed_slope
        + diagonal[..., :, None] * np.eye(chain.joints)
        - (tension.slope * slope[..., None]).sum(axis=-3),
        link_length=chain.link_length - compressions(chain, links, tension, acting) / chain.link_stiffness,
    )


def equilibrium(
    chain: RollingChain,
    drive: Array,
    acting: LinkLoads,
    start: Array,
    kept: Array,
    link_length: Array | None = None,
) -> Balance:
    """Return the equilibria nearest to `start`; each configuration of the batch has its own.

    Args:
        chain: the robot.
        drive: tension at the actuator, shape (..., t) [N].
        acting: loads on the links, the same for all.
        start: bend angles to start from, shape (..., n) [rad].
        kept: tension above each joint before, shape (..., t, n) [N].
        link_length: of the links as compressed at the start, shape (..., n) [m]; default: their own.

    Raises:
        NoEquilibrium: none was found for one configuration or more.
    """
    length = np.broadcast_to(chain.link_length if link_length is None else link_length, np.shape(start))
    found: Balance | None = None

    def moments(theta: Array) -> tuple[Array, Array]:
        # The links' compression hardly turns a joint: it follows one round behind.
        nonlocal found
        found = balance(chain, theta, drive, kept, acting, length if found is None else found.link_length)
        return found.unbalanced, found.jacobian

    balanced(moments, start, chain.low, chain.high)
    assert found is not None
    return found


# ----------------------------------------------------------------------------------------------------
# The static models `complete`, `complete_sliding` and `virtual_work`: the same robot, balanced in two ways.
#
# `complete` takes the Newton-Euler balance of every link, compiled (`kernels`); `virtual_work` the
# principle of virtual work, in plain NumPy. They agree to rounding. Neither shows the buckling of the even
# joints that the printed balance of chest_tube_2025 has (`printed`).

_SHORTEST_STEP = 1e-4  # share of the way between two rows
# Of rods that stick, the first that finds an equilibrium. Ten times as much moves the tip of
# `chest_tube_section` by 0.04 mm where it turns round, of `chest_tube` by 0.1 mm.
PRE_SLIDING_M = (1e-8, 1e-7, 1e-6)


@dataclass(frozen=True)
class Solved:
    """Equilibria of one robot, one a row.

    Attributes:
        theta: bend angles, shape (r, n) [rad].
        at_joint: tension of the pulled rods in each joint's gap, shape (r, t, n) [N].
        link_length: as compressed, shape (r, n) [m].
        unbalanced: moment left at each joint, shape (r, n) [N m].
        steps: how many lead to rest under the weight, then to each row, shape (r + 1,), or (0,).
        made: what each of all s steps along a history did, as `robots.rolling.kernels.follow` leaves it.
        end: where a history ended; None: there is none.
    """

    theta: Array
    at_joint: Array
    link_length: Array
    unbalanced: Array
    steps: np.ndarray
    made: Array
    end: StandingLinks | None = None


def complete(
    robot: RollingRobot, inputs: Inputs, gravity_mps2: Array, others: Sequence[LinkForce] = ()
) -> StaticRun:
    """Return the postures by the complete Newton-Euler balance, with the friction's history.

    As long as one rod at a time pulls and no load is given, its tensions alone tell how it rubs
    (`tensions`). Weight makes that err by up to 0.35 mm at the tip of `chest_tube_section`. Where
    several rods are tense at once, or a force or moment acts on the tip or on links, friction goes by how
    rods slide, as in `complete_sliding` . Tensions alone err there by up to 190 mm at the tip of
    `chest_tube`.

    Args:
        robot: a robot of rolling joints.
        inputs: tensions of its rods, and optionally tip force and moment.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        others: further forces, steady from the start.

    Raises:
        InputError: displacement inputs, or no posture balances a row.
    """
    return _run("complete", robot, inputs, gravity_mps2, others)


def complete_sliding(
    robot: RollingRobot, inputs: Inputs, gravity_mps2: Array, others: Sequence[LinkForce] = ()
) -> StaticRun:
    """Return the postures by the complete balance, with friction by how the rods slide in the links.

    Coulomb's law asks how a rod moves, not what its tension was: see `robots.rolling.kernels`. Arguments and
    errors as in `complete`.
    """
    return _run("complete_sliding", robot, inputs, gravity_mps2, others)


def virtual_work(
    robot: RollingRobot, inputs: Inputs, gravity_mps2: Array, others: Sequence[LinkForce] = ()
) -> StaticRun:
    """Return the postures by virtual work; arguments, errors and the choice of friction as in `complete`.

    Where friction goes by how rods slide, how they do is read from `complete`: the balance alone is checked.
    """
    return _run("virtual_work", robot, inputs, gravity_mps2, others)


def solve_history(
    chain: RollingChain,
    inputs: Inputs,
    gravity_mps2: Array,
    others: Sequence[LinkForce] = (),
    step_bend_rad: float | None = None,
    alone_bend_rad: float | None = None,
    guide: Solved | None = None,
    pre_sliding_m: tuple[float, ...] = (),
    after: StandingLinks | None = None,
) -> Solved:
    """Return the equilibria of every row, one after another, by the complete balance.

    Arguments are those of `history.ways`, and

    Args:
        guide: of a robot that is much alike, under as many rows; the search goes in its steps where those are
            nearly as many as asked for, and begins where it went.
        pre_sliding_m: of rods that stick, by which friction goes by how they slide
            (`robots.rolling.kernels`); the first with which an equilibrium is found. None: friction keeps
            tensions.
        after: where the robot stands, after rows by the same choices; None: at rest.

    Raises:
        InputError: no posture balances a row.
    """
    robot = pack(chain)
    way = ways(chain, inputs, gravity_mps2, others, step_bend_rad, alone_bend_rad, after)
    steps, alike = way.steps, guide is not None and _nearly_as_many(guide.steps, way.steps)
    if guide is not None and alike:
        steps = guide.steps
    r, n, t = len(steps), chain.joints, chain.pulled
    if after is None:
        memory = np.zeros((3 if pre_sliding_m else 1, t, n))
        angle, lengths = robot.joint[:, REST].copy(), robot.joint[:, LENGTH].copy()
    else:
        angle, lengths, memory = after.theta.copy(), after.link_length.copy(), after.memory.copy()
    theta, length, value = np.empty((r, n)), np.empty((r, n)), np.empty((r, n))
    at_joint = np.empty((r, t, n))
    made = np.empty((int(steps.sum()), 1 + t if pre_sliding_m else 1, n))
    known = guide.made if guide is not None and alike and guide.made.shape == made.shape else made[:0]
    acting = RodPulls(way.drive, way.at_rest.link, way.at_rest.point, way.force, way.tip_moment)
    reached = follow(
        *(robot, acting, steps, np.array(pre_sliding_m), known, made, 0 if after is None else 1),
        *(angle, lengths, memory, ChainBalance(theta, length, at_joint, value)),
    )
    if reached < r:
        raise _no_equilibrium("complete", inputs, reached)
    end = StandingLinks(angle, lengths, memory, way.drive[-1], way.force[-1], way.tip_moment[-1])
    return Solved(theta[1:], at_joint[1:], length[1:], value[1:], steps, made, end)


def _nearly_as_many(theirs: np.ndarray, asked: np.ndarray) -> bool:
    """Return whether no row's steps are more than a tenth, and more than one, away from those asked for."""
    return theirs.shape == asked.shape and bool((np.abs(theirs - asked) <= np.maximum(1, asked // 10)).all())


def solve_loaded(
    chain: RollingChain,
    tension: Array,
    gravity_mps2: Array,
    force_tip: Array | None = None,
    moment_tip: Array | None = None,
) -> Solved:
    """Return the equilibria of a batch of tensions, each loaded from rest: no history but its own.

    Args:
        chain: the robot.
        tension: at the actuator, shape (b, t) [N].
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        force_tip, moment_tip: the same for all, shape (3,) [N], [N m].

    Raises:
        InputError: no posture balances one of them.
    """
    packed = pack(chain)
    acting = loads(chain, gravity_mps2, force_tip, moment_tip)
    b, n, t = len(tension), chain.joints, chain.pulled
    order = np.argsort(tension.sum(axis=1), kind="stable")  # neighbours are good starts for one another
    drive = np.ascontiguousarray(tension[order], dtype=float)
    theta, length, value = np.empty((b, n)), np.empty((b, n)), np.empty((b, n))
    at_joint = np.empty((b, t, n))
    failed = load_batch(
        packed,
        RodPulls(drive, acting.link, acting.point, acting.force, acting.tip_moment),
        ChainBalance(theta, length, at_joint, value),
    )
    if failed >= 0:
        raise InputError(
            f"static model 'complete': no posture balances the tensions {tension[order[failed]].tolist()} N"
        )
    back = np.argsort(order, kind="stable")
    return Solved(
        theta[back], at_joint[back], length[back], value[back], np.empty(0, np.int64), np.empty((0, 1, n))
    )


def solve_history_by_virtual_work(
    chain: RollingChain, inputs: Inputs, gravity_mps2: Array, others: Sequence[LinkForce] = ()
) -> Solved:
    """Return the equilibria of every row by virtual work; as `solve_history`."""
    theta, kept = chain.rest_angle.copy(), np.zeros((chain.pulled, chain.joints))
    rows = []
    for row, way in enumerate(stretches(chain, inputs, gravity_mps2, others)):
        try:
            found = _follow(chain, way, theta, kept)
        except NoEquilibrium:
            raise _no_equilibrium("virtual_work", inputs, row) from None
        theta, kept = found.theta, found.tension.above
        rows.append((theta, found.tension.at_joint, found.link_length, found.unbalanced))
    thetas, at_joint, length, value = (np.array(column[1:]) for column in zip(*rows, strict=True))
    return Solved(thetas, at_joint, length, value, np.empty(0, np.int64), np.empty((0, 1, chain.joints)))


def balance_by_virtual_work(
    chain: RollingChain, inputs: Inputs, gravity_mps2: Array, others: Sequence[LinkForce], solved: Solved
) -> Solved:
    """Return the equilibria by virtual work under the tensions that `solved` has along its rods, row by row.

    Raises:
        InputError: no posture balances a row.
    """
    rows, rod = [], np.arange(chain.pulled)
    last = chain.last[: chain.pulled] - 1
    for row, way in enumerate(itertools.islice(stretches(chain, inputs, gravity_mps2, others), 1, None)):
        at_joint = solved.at_joint[row]
        above = np.zeros_like(at_joint)
        above[:, :-1] = at_joint[:, 1:]
        above[rod, last] = at_joint[rod, last]  # a rod ends in its last link
        try:
            found = equilibrium(chain, *way.at(1.0), solved.theta[row], above, solved.link_length[row])
        except NoEquilibrium:
            raise _no_equilibrium("virtual_work", inputs, row + 1) from None
        rows.append((found.theta, found.tension.at_joint, found.link_length, found.unbalanced))
    theta, tension, length, value = (np.array(column) for column in zip(*rows, strict=True))
    return Solved(theta, tension, length, value, np.empty(0, np.int64), np.empty((0, 1, chain.joints)))


def _follow(chain: RollingChain, way: Stretch, theta: Array, kept: Array) -> Balance:
    """Return the equilibrium at the end of `way`; steps are halved where none is found."""
    done, stride = 0.0, 1.0 / way.steps
    while True:
        part = done + stride
        part = 1.0 if part > 1.0 - 1e-9 else part
        drive, acting = way.at(part)
        try:
            found = equilibrium(chain, drive, acting, theta, kept)
        except NoEquilibrium:
            stride *= 0.5
            if stride < _SHORTEST_STEP:
                raise
            continue
        theta, kept, done = found.theta, found.tension.above, part
        if done == 1.0:
            return found


def _run(
    model: str,
    robot: RollingRobot,
    inputs: Inputs,
    gravity_mps2: Array,
    others: Sequence[LinkForce],
) -> StaticRun:
    require_tensions(inputs, model)
    chain = rolling_chain(robot)
    gravity = np.asarray(gravity_mps2, dtype=float)
    loaded = bool(inputs.force_tip.any() or inputs.moment_tip.any() or others)
    sliding = model == "complete_sliding" or loaded or several_rods_at_once(inputs.tendon)
    if model == "virtual_work" and not sliding:
        solved = solve_history_by_virtual_work(chain, inputs, gravity, others)
    else:
        gives = PRE_SLIDING_M if sliding else ()
        solved = solve_history(chain, inputs, gravity, others, pre_sliding_m=gives)
        if model == "virtual_work":
            solved = balance_by_virtual_work(chain, inputs, gravity, others, solved)
    found = postures(chain, inputs, gravity, solved.theta, solved.at_joint, solved.link_length)
    residual = np.abs(solved.unbalanced).max(axis=1)
    return StaticRun(model, inputs, gravity, tuple(found), residual)


def _no_equilibrium(model: str, inputs: Inputs, row: int) -> InputError:
    place = row_name(inputs, row - 1) if row else "at rest under its weight"
    what = "no posture close by balances rods and loads; the robot snaps or folds"
    return InputError(f"{place}: static model {model!r}: {what}")


# ----------------------------------------------------------------------------------------------------
# A value per configuration with its derivative by every bend angle, for balances written term by term.


@dataclass(frozen=True)
class Varied:
    """A value per configuration and its derivative by the bend angles, shapes (b, ...) and (b, ..., n)."""

    value: Array
    slope: Array

    def __add__(self, other: Varied) -> Varied:
        return Varied(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: Varied) -> Varied:
        return Varied(self.value - other.value, self.slope - other.slope)

    def __mul__(self, other: Varied) -> Varied:
        return Varied(
            self.value * other.value,
            self.value[..., None] * other.slope + other.value[..., None] * self.slope,
        )


def constant(value: float, b: int, n: int) -> Varied:
    """Return a value that depends on no joint."""
    return Varied(np.full(b, value), np.zeros((b, n)))


def single(value: Array, slope: Array, k: int, n: int) -> Varied:
    """Return a value that depends on joint k alone."""
    slopes = np.zeros((len(value), n))
    slopes[:, k] = slope
    return Varied(np.array(value), slopes)
