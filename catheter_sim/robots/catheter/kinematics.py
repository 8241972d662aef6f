"""Kinematics of catheters: pairs to joints, joints to the tool and back, also in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import has_mount_slide
from catheter_sim.core.statics import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.mechanics.arcs import arc_functions
from catheter_sim.mechanics.hysteresis import play
from catheter_sim.robots.catheter.description import (
    FOUR_DOF,
    TRANSSEPTAL,
    base_heights_m,
    bent_by,
    beside_springs,
    closing_angle_rad,
    design,
    drives,
    elements,
    hinge_counts,
    is_curved,
    is_extensible,
    joint_stiffness,
    moved_segment,
    moving,
)
from catheter_sim.robots.catheter.kernels import (
    BENDING,
    PRISMATIC,
    RIGID,
    TORSION,
    element_frames,
    joint_values,
)
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment, TendonPair

JOINT_KINDS = {"bending": BENDING, "torsion": TORSION, "prismatic": PRISMATIC, "rigid": RIGID}

# ----------------------------------------------------------------------------------------------------
# Product of exponentials of twists, for many postures at once.
#
# A twist is (v, w): v = -w x q of a turn about the unit axis w through q, or the unit direction of a slide
# with w = 0 (Nayar 2022, before Eq. 11). Transforms are homogeneous, shape (..., 4, 4).


def turn(axis: ArrayLike, point: ArrayLike) -> Array:
    """Return the twist of a turn about `axis` (unit, (3,)) through `point` ((3,) [m]), shape (6,)."""
    w = np.asarray(axis, dtype=float)
    return np.concatenate([-np.cross(w, np.asarray(point, dtype=float)), w])


def slide(direction: ArrayLike) -> Array:
    """Return the twist of a slide along `direction` (unit, (3,)), shape (6,)."""
    return np.concatenate([np.asarray(direction, dtype=float), np.zeros(3)])


def exponential(twist: Array, value: ArrayLike) -> Array:
    """Return the transforms exp(twist * value), shape (..., 4, 4).

    `twist` has shape (6,), its axis unit or zero; `value` is an angle [rad] or a way [m], shape (...).
    """
    value = np.asarray(value, dtype=float)
    v, w = twist[:3], twist[3:]
    result = np.zeros((*value.shape, 4, 4))
    result[..., 3, 3] = 1.0
    if not w.any():
        result[..., :3, :3] = np.eye(3)
        result[..., :3, 3] = value[..., None] * v
        return result
    hat = cross_matrix(w)
    sine = np.sin(value)[..., None, None]
    versine = (2.0 * np.sin(0.5 * value) ** 2)[..., None, None]
    rotation = np.eye(3) + sine * hat + versine * (hat @ hat)
    result[..., :3, :3] = rotation
    pitch = value[..., None] * w * float(w @ v)
    result[..., :3, 3] = (np.eye(3) - rotation) @ np.cross(w, v) + pitch
    return result


def cross_matrix(w: Array) -> Array:
    """Return the matrix of w x, shape (3, 3)."""
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def product_of_exponentials(twists: Array, values: Array, home: Array) -> Array:
    """Return exp(twist_1 value_1) ... exp(twist_j value_j) home, shape (..., 4, 4).

    Twists in the home posture, base frame, (j, 6); values (..., j); home (4, 4).
    """
    result = np.broadcast_to(np.eye(4), (*values.shape[:-1], 4, 4))
    for index, twist in enumerate(twists):
        result = result @ exponential(twist, values[..., index])
    return result @ home


def space_jacobian(twists: Array, values: Array) -> Array:
    """Return the twists (j, 6) in the base frame where the joints are at values (..., j).

    Columns (v, w), shape (..., 6, j).
    """
    before = np.broadcast_to(np.eye(4), (*values.shape[:-1], 4, 4))
    columns = []
    for index, twist in enumerate(twists):
        rotation, place = before[..., :3, :3], before[..., :3, 3]
        w = rotation @ twist[3:]
        v = rotation @ twist[:3] + np.cross(place, w)
        columns.append(np.concatenate([v, w], axis=-1))
        before = before @ exponential(twist, values[..., index])
    return np.stack(columns, axis=-1)


# ----------------------------------------------------------------------------------------------------
# Displacement of an antagonistic pair to the angle of its joint and back: lengths, slack, range.
#
# Nayar 2022, Eqs 1-7, and Nayar 2023, Eqs 12-13. Displacement and angle have the same sign; the pulled
# tendon decides, its length is Eq. 3 or 6 of the angle's size. With phi = theta / (2 (n + 1)),
#
#     bending  l = 2 (n + 1) (t (1 - cos phi) + a sin phi)                          2022 Eq. 3, 2023 Eq. 12
#     torsion  l = sqrt((r a_t)^2 + h^2) - sqrt((r (a_t - theta))^2 + h^2)          2022 Eq. 6
#
# h = 0 is l = r theta, 2023 Eq. 13. Solved for the angle (2022 Eqs 5, 7), here in forms that lose no digits
# near zero, with x = l / (2 (n + 1)) and w = sqrt((r a_t)^2 + h^2),
#
#     bending  tan(phi / 2) = x / (a + sqrt(a^2 + x (2 t - x)))
#     torsion  theta = l (2 w - l) / (r (r a_t + sqrt((w - l)^2 - h^2)))
#
# Valid up to the angle at which a bending joint's gaps have closed, or the tendon is unwrapped.
#
# A bending joint whose rest is bent, by rest_rad, has both tendons taut there. Eq. 3 then holds for each
# tendon by itself: with the angle counted toward its own side, the pulled one is drawn by l(theta) less
# l(rest). "Size" and "sign" of an angle are those of its difference from rest. Between rest and straight
# the antagonist lacks up to 4 (n + 1) t (1 - cos) of the rest's half gap angle, 1 um at a rest of 11 deg of
# the 2022 robot and 7 um at 30 deg; it is taken to give way.
#
# The antagonist. A bending joint needs less of it than the pulley lets go: it slackens (2022, after Eq. 4).
# A torsion joint with h > 0 needs more, as its wrapped length is convex in the angle: by 0.43 mm of 3.55 mm
# at 75 deg of the 2022 proximal joint. The paper does not say so; something there must yield.


def pulled_m(segment: CatheterSegment, angle_rad: ArrayLike) -> Array:
    """Return how far the pair is displaced for the angle, with the angle's sign, same shape [m]."""
    angle = np.asarray(angle_rad, dtype=float)
    if segment.joint == "bending":
        side = _side(segment, angle)
        return side * (_drawn_m(segment, side * angle) - _drawn_m(segment, side * segment.rest_rad))
    return np.copysign(_wrapped_m(segment, 0.0) - _wrapped_m(segment, np.abs(angle)), angle)


def drawn_at_rest_m(segment: CatheterSegment, sign: str) -> float:
    """Return by how much a bending joint's tendon, "pos" or "neg", is shorter at rest than straight [m]."""
    return float(_drawn_m(segment, segment.rest_rad if sign == "pos" else -segment.rest_rad))


def released_m(segment: CatheterSegment, angle_rad: ArrayLike) -> Array:
    """Return how much more of the antagonist the joint takes up at the angle, >= 0, same shape [m].

    Nayar 2022, Eq. 4, and the same for Eq. 6.
    """
    angle = np.asarray(angle_rad, dtype=float)
    if segment.joint == "bending":
        side = _side(segment, angle)
        return _drawn_m(segment, -side * segment.rest_rad) - _drawn_m(segment, -side * angle)
    size = np.abs(angle)
    return _wrapped_m(segment, -size) - _wrapped_m(segment, 0.0)


def slack_m(segment: CatheterSegment, angle_rad: ArrayLike) -> Array:
    """Return the slack of the antagonist on a common pulley, same shape [m]; below 0 it must stretch."""
    return np.abs(pulled_m(segment, angle_rad)) - released_m(segment, angle_rad)


def arm_m(segment: CatheterSegment, angle_rad: ArrayLike) -> Array:
    """Return the pulled tendon's moment arm, the slope of `pulled_m`, same shape [m]."""
    angle = np.asarray(angle_rad, dtype=float)
    if segment.joint == "bending":
        phi = _side(segment, angle) * angle / (2 * (segment.rings + 1))
        return segment.half_gap_m * np.sin(phi) + segment.arm_m * np.cos(phi)
    size = np.abs(angle)
    if segment.wrap_height_m == 0.0:
        return np.full(size.shape, segment.tendon_radius_m)
    left = segment.wrap_rad - size
    return segment.tendon_radius_m**2 * left / _wrapped_m(segment, size)


def largest_angle_rad(segment: CatheterSegment) -> float:
    """Return the angle beyond which no displacement reaches: gaps closed, or tendon unwrapped [rad]."""
    return closing_angle_rad(segment) if segment.joint == "bending" else segment.wrap_rad


def angle_rad(segment: CatheterSegment, displacement_m: ArrayLike) -> Array:
    """Return the angle at a displacement of the inextensible pair, same shape [rad].

    NaN where no angle exists: the displacement is beyond that of `largest_angle_rad`.
    """
    return elastic_angle_rad(segment, displacement_m, 0.0)


def elastic_angle_rad(segment: CatheterSegment, displacement_m: ArrayLike, compliance_m: float) -> Array:
    """Return a bending joint's angle where its pair stretches by `compliance_m` a radian, same shape [rad].

    The pulled tendon's way at the drive is Eq. 3 plus its stretch, which grows with the angle as the
    elastic moment does. NaN where no angle exists. Of any joint if the compliance is 0.
    """
    ways = np.asarray(displacement_m, dtype=float)
    angles = np.empty(ways.shape)
    numbers = np.array(joint_numbers(segment, compliance_m))
    joint_values(JOINT_KINDS[segment.joint], np.ravel(ways), numbers, angles.reshape(-1))
    found: Array = angles[()]
    return found


def joint_numbers(segment: CatheterSegment, compliance_m: float) -> tuple[float, ...]:
    """Return what the compiled loops know of a joint, shape (6,): see `kernels.pure_values`."""
    if segment.joint == "bending":
        gaps = 2.0 * (segment.rings + 1)
        rest, half_gap, arm = segment.rest_rad, segment.half_gap_m, segment.arm_m
        return compliance_m, rest, half_gap, arm, gaps, largest_angle_rad(segment)
    return segment.tendon_radius_m, segment.wrap_rad, segment.wrap_height_m, 0.0, 0.0, 0.0


def _side(segment: CatheterSegment, angle: Array) -> Array:
    """Return 1 where the tendon toward + is the pulled one at a bending joint's angle, else -1."""
    return np.where(angle >= segment.rest_rad, 1.0, -1.0)


def _drawn_m(segment: CatheterSegment, angle: ArrayLike) -> Array:
    """Return by how much the straight tendon is longer than at the angle, counted toward its side [m].

    Nayar 2022, Eqs 1-2.
    """
    phi = np.asarray(angle, dtype=float) / (2 * (segment.rings + 1))
    # 1 - cos as 2 sin^2 of the half: no digits are lost near straight
    versine = 2.0 * np.sin(0.5 * phi) ** 2
    return 2 * (segment.rings + 1) * (segment.half_gap_m * versine + segment.arm_m * np.sin(phi))


def _wrapped_m(segment: CatheterSegment, angle: ArrayLike) -> Array:
    """Return the length of a tendon around a torsion module that has unwound by the angle [m]."""
    around = segment.tendon_radius_m * (segment.wrap_rad - np.asarray(angle, dtype=float))
    return np.hypot(around, segment.wrap_height_m) if segment.wrap_height_m else around


# ----------------------------------------------------------------------------------------------------
# The exposed tube of a prismatic segment: its unloaded arc, and its law as a beam.
#
# Between the end of what guides it and the module that it carries, an advance s shows s of tube. Unloaded
# it is an arc of that length and of the segment's tube curvature.
#
# Law. Seen from its chord the tube turns at its two ends: by alpha from the guide to the chord, by beta
# from the chord to the module, vectors toward +x and +y. With the whole bend b = alpha + beta and the skew
# d = alpha - beta, an Euler-Bernoulli beam of bending stiffness EI with curvature k at rest has
#
#     energy  EI / (2 s) (|b - k s|^2 + 3 |d|^2)
#     chord   s (sin(|b| / 2) / (|b| / 2) - |d|^2 / 40)
#
# In a plane the first is the moments EI / s (4 alpha - 2 beta) and EI / s (4 beta - 2 alpha), exact for
# small bends under any force and moment at the end. The second is exact for arcs and right to second order
# else; its slopes let an axial load bend the tube.

SKEW_STIFFNESS = 3.0  # against skew, over that against the whole bend
SKEW_SHORTENING = 1.0 / 40.0  # of the length, per squared skew
SMALL_RAD = 1e-3  # [rad] below it a series is exact to the last bit but one


def tube_bend(segment: CatheterSegment) -> tuple[Array, float]:
    """Return the axis, shape (3,), about which a curved tube bends, and its curvature [1/m], above 0."""
    x, y = segment.tube_curvature_x_per_m, segment.tube_curvature_y_per_m
    size = math.hypot(x, y)
    return np.array([-y, x, 0.0]) / size, size


def tube_chord_change(advance_m: Array, curvature_per_m: Array) -> tuple[Array, Array]:
    """Return chord less length of an arc, and its slope in the length; shapes broadcast.

    Returns:
        Change [m], and change per meter, 1.
    """
    half = 0.5 * curvature_per_m * advance_m
    sine, _ = arc_functions(half * half)
    return advance_m * (sine - 1.0), np.cos(half) - 1.0


def end_turn(x_rad: float, y_rad: float) -> tuple[tuple[float, float], tuple[float, float, float, float]]:
    """Return how far a universal joint, a hinge toward +x and then one toward +y, turns its axis.

    Returns:
        The turn as a vector toward +x and +y [rad], and its slopes: of the first component in x and y,
        then of the second.
    """
    sx, cx, sy, cy = math.sin(x_rad), math.cos(x_rad), math.sin(y_rad), math.cos(y_rad)
    across_x, across_y = sx * cy, sy
    sine = math.hypot(across_x, across_y)
    angle = math.atan2(sine, cx * cy)
    if angle < SMALL_RAD:
        ratio, slope = 1.0 + angle * angle / 6.0, 1.0 / 3.0
    else:
        ratio, slope = angle / sine, (sine - angle * cx * cy) / sine**3
    by_x, by_y = slope * sx * cy, slope * cx * sy
    return (ratio * across_x, ratio * across_y), (
        ratio * cx * cy + across_x * by_x,
        -ratio * sx * sy + across_x * by_y,
        across_y * by_x,
        ratio * cy + across_y * by_y,
    )


def end_twist_rad(x_rad: float, y_rad: float) -> float:
    """Return by how much the same universal joint twists about the turned axis [rad]."""
    return 2.0 * math.atan(math.tan(0.5 * x_rad) * math.tan(0.5 * y_rad))


def chord_share(bend_rad: float, skew_rad: float) -> tuple[float, float, float]:
    """Return chord over length at sizes of bend and skew, and its slopes in each, over bend and over skew."""
    half = 0.5 * bend_rad
    if half < SMALL_RAD:
        share, slope = 1.0 - half * half / 6.0, -1.0 / 12.0
    else:
        share, slope = math.sin(half) / half, (half * math.cos(half) - math.sin(half)) / (4.0 * half**3)
    return share - SKEW_SHORTENING * skew_rad**2, slope, -2.0 * SKEW_SHORTENING


# ----------------------------------------------------------------------------------------------------
# What of a pair's displacement arrives at its tendons, and how far it may go: play, slack, ends.


def played_m(pair: TendonPair, displacement_m: Array) -> Array:
    """Return where a pair's pulley is along displacements from rest, shape (r,) [m].

    The drive's play follows with the pair's whole `play_m`, centred at rest (Nayar 2022, Eqs 29-31).
    """
    if pair.play_m > 0.0:
        return play(displacement_m[:, np.newaxis], pair.play_m)[:, 0]
    return displacement_m


def arriving_m(pair: TendonPair, displacement_m: Array) -> Array:
    """Return how far a pair's tendons are drawn along displacements from rest, shape (r,) [m].

    Of a bending joint's pair each tendon draws only what is left of its `slack_m`; in between neither does.
    """
    drawn = played_m(pair, displacement_m)
    return np.copysign(np.maximum(np.abs(drawn) - pair.slack_m, 0.0), drawn)


def input_range_m(robot: CatheterRobot) -> tuple[Array, Array]:
    """Return the least and largest displacement of each pair to which an angle belongs, shape (t,) each [m].

    There a joint is at its end: gaps closed, or tendon unwound. A bending pair that stretches goes on beyond
    it, and so does a tube.
    """
    least, most = np.full((2, len(robot.tendons)), [[-math.inf], [math.inf]])
    for index, pair in enumerate(robot.tendons):
        segment = robot.segments[moved_segment(robot, index)]
        if segment.joint == "prismatic" or (segment.joint == "bending" and is_extensible(pair)):
            continue
        ends = pulled_m(segment, largest_angle_rad(segment) * np.array([-1.0, 1.0]))
        spare = pair.slack_m + 0.5 * pair.play_m
        least[index], most[index] = ends[0] - spare, ends[1] + spare
    return least, most


# ----------------------------------------------------------------------------------------------------
# A mount that gives way under a catheter's bending tendons.
#
# The base sinks by s = sum T / k toward the drives, so that every tendon is drawn by s less, whichever way.
# A pulled tendon's tension balances its joint's elastic moment, T = K |theta - rest| / arm(theta); the
# antagonist is slack. With the drawn way d and the tendon's compliance c [m/rad], each bending joint obeys
#
# l(theta) + c |theta - rest| = |d| - s,
#
# and s is where both meet: s - sum T(s) / k rises with s, so that there is one such s. Torsion joints and
# tubes need no tension here.

_MOST_STEPS = 40
_SMALLEST_STEP_M = 1e-15


def require_rigid_mount(robot: CatheterRobot, model: str) -> None:
    """Raise `InputError` where the mount gives way, of which a static model does not know."""
    if has_mount_slide(robot):
        shown = f"{robot.mount.axial_stiffness_N_per_m * 1e-3:g}"
        raise InputError(
            f"{robot.name}: mount.axial_stiffness_N_per_mm = {shown}: static model {model!r} has no mount "
            "that gives way; must be inf"
        )


def require_springs(robot: CatheterRobot, model: str) -> None:
    """Raise `InputError` where the mount gives way under tendons that do more than pull at springs."""
    more = beside_springs(robot)
    if has_mount_slide(robot) and more:
        raise InputError(
            f"{robot.name}: mount.axial_stiffness_N_per_mm: static model {model!r} has a mount that "
            f"gives way beside springs alone, not beside {more}; set it to inf, or simulate"
        )


def eased_m(drawn_m: Array, sunk_m: Array | float) -> Array:
    """Return ways of a pair, shape (r,), after the base has sunk toward the drives, same shape [m]."""
    return np.copysign(np.maximum(np.abs(drawn_m) - sunk_m, 0.0), drawn_m)


def sunk_by(robot: CatheterRobot, drawn_m: Array) -> Array:
    """Return how far the base sinks, (r,) [m], as pairs are drawn by (r, t) [m]; NaN beyond a joint's range.

    The bending joints are springs, without friction.
    """
    sunk = np.zeros(len(drawn_m))
    if not has_mount_slide(robot):
        return sunk
    for _ in range(_MOST_STEPS):  # from no sinking, Newton's steps go up
        tension_N, loosening = _tension(robot, drawn_m, sunk)
        stiffness = robot.mount.axial_stiffness_N_per_m
        step = (tension_N / stiffness - sunk) / (1.0 + loosening / stiffness)
        sunk = np.maximum(sunk + step, 0.0)
        if not (np.abs(step) > _SMALLEST_STEP_M).any():
            break
    return sunk


def _tension(robot: CatheterRobot, drawn_m: Array, sunk_m: Array) -> tuple[Array, Array]:
    """Return the bending tendons' summed tension [N], and by how much it falls as the base sinks [N/m]."""
    tension_N, loosening = np.zeros(len(drawn_m)), np.zeros(len(drawn_m))
    bending = bent_by(robot)
    for pair, item in enumerate(robot.tendons):
        if item.name not in bending:
            continue
        segment = robot.segments[moved_segment(robot, pair)]
        stiffness = joint_stiffness(robot, segment)
        compliance_m = stiffness / segment.arm_m / item.stiffness_N_per_m
        way = eased_m(drawn_m[:, pair], sunk_m)
        angle = elastic_angle_rad(segment, way, compliance_m)
        arm = arm_m(segment, angle)
        tension_N += stiffness * np.abs(angle - segment.rest_rad) / arm
        # The arm's own change with the angle is left out: it is a step's direction alone.
        loosening += np.where(way != 0.0, stiffness / arm / (arm + compliance_m), 0.0)
    return tension_N, loosening


# ----------------------------------------------------------------------------------------------------
# Forward kinematics of any catheter of torsion, bending and prismatic joints: tool, elements, Jacobian.
#
# Joint values q: one for each segment with a joint, base to tip: angle [rad] or advance [m]
# (`description.moving`). A bending joint is an arc of constant curvature, as a chain: a turn by half of
# the bend, a slide by chord less length, a turn by the other half (Nayar 2022, Section II-D, Eq. 20).
#
# A prismatic segment's curved tube is one too, of a length that is its joint value (`tube`).
#
# The rings lie on that arc, at their share of its length. A chain of rigid rings with a hinge in every gap
# differs: all its turning lies in the gaps.

_Z = np.array([0.0, 0.0, 1.0])
_BENDS_ABOUT = {"x": np.array([0.0, 1.0, 0.0]), "y": np.array([-1.0, 0.0, 0.0])}
_SMALL = 1e-3  # [rad] half a bend below which a series is exact to the last bit


@dataclass(frozen=True)
class ScrewChain:
    """A catheter as twists.

    Attributes:
        twists: in the straight posture, base to tip, shape (j, 6).
        home: the tool frame there, shape (4, 4).
        joint: index of the joint value behind each twist, shape (j,).
        chord_m: of twists that shorten with a bend: the joint's length at rest; 0 of others, shape (j,).
        share: of its joint value that each of the other twists takes: 1, 1/2, or half of a curved tube's
            curvature [1/m], shape (j,).
        curvature_per_m: of slides along the chord of a curved tube: its curvature; 0 of others, shape (j,).
    """

    twists: Array
    home: Array
    joint: Array
    chord_m: Array
    share: Array
    curvature_per_m: Array


def screw_chain(robot: CatheterRobot) -> ScrewChain:
    """Return `robot` as twists (Nayar 2022, Eqs 8-11, for any row of such joints)."""
    heights = base_heights_m(robot)
    twists: list[Array] = []
    joint: list[int] = []
    chord: list[float] = []
    share: list[float] = []
    curvature: list[float] = []
    for number, index in enumerate(moving(robot)):
        segment = robot.segments[index]
        base = heights[index] * _Z
        if segment.joint == "bending":
            about = _BENDS_ABOUT[segment.bends_toward]
            twists += [turn(about, base), slide(_Z), turn(about, base + segment.length_m * _Z)]
            joint += 3 * [number]
            chord += [0.0, segment.length_m, 0.0]
            share += [0.5, 0.0, 0.5]
            curvature += 3 * [0.0]
        elif is_curved(segment):
            about, bend = tube_bend(segment)
            twists += [turn(about, base), slide(_Z), turn(about, base)]
            joint += 3 * [number]
            chord += 3 * [0.0]
            share += [0.5 * bend, 1.0, 0.5 * bend]
            curvature += [0.0, bend, 0.0]
        else:
            twists.append(turn(_Z, base) if segment.joint == "torsion" else slide(_Z))
            joint.append(number)
            chord.append(0.0)
            share.append(1.0)
            curvature.append(0.0)
    home = np.eye(4)
    home[2, 3] = heights[-1]
    return ScrewChain(
        np.array(twists), home, np.array(joint), np.array(chord), np.array(share), np.array(curvature)
    )


def tool_frame(robot: CatheterRobot, q: Array) -> Array:
    """Return the tool frame (..., 4, 4) at joint values (..., m), base frame, SI (Nayar 2022, Eq. 12)."""
    chain = screw_chain(robot)
    values, _ = _parameters(chain, q)
    return product_of_exponentials(chain.twists, values, chain.home)


def tool_jacobian(robot: CatheterRobot, q: Array) -> Array:
    """Return d(tip position, tool turn) / dq at joint values (..., m), base frame, shape (..., 6, m).

    Rows 0-2 are the tip's velocity, rows 3-5 the tool's angular velocity.
    """
    chain = screw_chain(robot)
    values, slopes = _parameters(chain, q)
    columns = space_jacobian(chain.twists, values) * slopes[..., None, :]
    tip = product_of_exponentials(chain.twists, values, chain.home)[..., :3, 3]
    columns[..., :3, :] += np.cross(columns[..., 3:, :], tip[..., None], axis=-2)
    member = (chain.joint[:, None] == np.arange(q.shape[-1])).astype(float)
    return columns @ member


def batch_frames(
    robots: Sequence[CatheterRobot], values: Array, wanted: Sequence[int]
) -> tuple[Array, Array]:
    """Return the distal faces of the elements `wanted` (rising indices) at the pairs' values (B, r, t).

    Returns:
        Centres, shape (B, r, n, 3) [m], and orientations, shape (B, r, n, 3, 3).
    """
    first = robots[0]
    mover = np.full(len(first.segments), -1)
    mover[[moved_segment(first, pair) for pair in range(len(first.tendons))]] = np.arange(len(first.tendons))
    joint = np.array([JOINT_KINDS[segment.joint] for segment in first.segments])
    parts = [elements(robot) for robot in robots]
    segment = np.array([parts[0][index].segment for index in wanted], dtype=np.int64)
    shape = (*values.shape[:2], len(segment))
    places, rotations = np.empty((*shape, 3)), np.empty((*shape, 3, 3))
    faces = np.array([[own[index].face_m for index in wanted] for own in parts])
    numbers = np.array([_segment_numbers(robot) for robot in robots])
    element_frames(joint, mover, numbers, segment, faces, np.ascontiguousarray(values), places, rotations)
    return places, rotations


def _segment_numbers(robot: CatheterRobot) -> list[tuple[float, float, float]]:
    """Return the numbers of `kernels.element_frames` for every segment."""
    found = []
    for segment in robot.segments:
        toward = (0.0, 0.0)
        if segment.joint == "bending":
            toward = (1.0, 0.0) if segment.bends_toward == "x" else (0.0, 1.0)
        elif segment.joint == "prismatic":
            toward = segment.tube_curvature_x_per_m, segment.tube_curvature_y_per_m
        found.append((segment.length_m, *toward))
    return found


def chord_change(bend_rad: Array, length_m: Array) -> tuple[Array, Array]:
    """Return chord less length of an arc, and its slope (Nayar 2022, Eq. 20); shapes broadcast.

    Returns:
        Change [m], and change per radian [m/rad].
    """
    half = 0.5 * np.asarray(bend_rad, dtype=float)
    small = np.abs(half) < _SMALL
    safe = np.where(small, 1.0, half)
    change = np.where(small, -(half**2) / 6.0, np.sin(safe) / safe - 1.0)
    slope = np.where(small, -half / 3.0, (safe * np.cos(safe) - np.sin(safe)) / safe**2)
    return length_m * change, 0.5 * length_m * slope


def _parameters(chain: ScrewChain, q: Array) -> tuple[Array, Array]:
    """Return each twist's parameter and its slope in its joint value, both of shape (..., j)."""
    own = q[..., chain.joint]
    change, slope = chord_change(own, chain.chord_m)
    shorter, steeper = tube_chord_change(own, chain.curvature_per_m)
    return chain.share * own + change + shorter, chain.share + slope + steeper


# ----------------------------------------------------------------------------------------------------
# The printed closed forms of the tool frame of both mitral catheters, in the papers' base frames.
#
# {base frame} = R_BASE_PAPER {paper's frame}: the papers bend first toward -y, the base frame toward +x. In
# the papers' frames the tool's R is Rz(proximal torsion) Rx(bending) Rz(distal torsion) (2022) and
# Rx(proximal) Ry(distal) Rz(torsion) (2023); the distal joint's +x is the base frame's +y.
#
# Joint values as in `kinematics`; lengths in m.

# A quarter turn about +z.
R_BASE_PAPER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def four_dof_lengths_m(robot: CatheterRobot) -> tuple[float, float, float, float]:
    """Return the link lengths b_1, bm, b_2 and e_l = ih + dt + bt of Nayar 2023, Section III-C [m]."""
    proximal, middle, distal, tip, advance, torsion = (segment.length_m for segment in robot.segments)
    return proximal, middle, distal, tip + advance + torsion


def transseptal_tool(robot: CatheterRobot, q: Array) -> tuple[Array, Array]:
    """Return the tool of the transseptal robot (Nayar 2022, Eqs 14-15), paper's frame.

    Of proximal torsion, bending, advance, distal torsion (..., 4): position (..., 3), and R (..., 3, 3).
    """
    torsion_m, bending_m, tube_m, holder_m = (segment.length_m for segment in robot.segments)
    p, b, advance, d = np.moveaxis(q, -1, 0)
    cp, sp, cb, sb, cd, sd = np.cos(p), np.sin(p), np.cos(b), np.sin(b), np.cos(d), np.sin(d)
    R = _matrix(
        (cd * cp - cb * sd * sp, -cp * sd - cd * cb * sp, sb * sp),
        (cd * sp + cb * cp * sd, cd * cp * cb - sd * sp, -sb * cp),
        (sb * sd, sb * cd, cb),
    )
    sine, versine = arc_functions(b * b)  # sin(b) / b and (1 - cos b) / b^2
    end = tube_m + holder_m + advance
    radial = bending_m * versine * b + sb * end
    height = torsion_m + cb * end + bending_m * sine
    return np.stack([radial * sp, -radial * cp, height], axis=-1), R


def four_dof_tool(robot: CatheterRobot, q: Array) -> tuple[Array, Array]:
    """Return the tool of the 4-DoF robot (Nayar 2023, Eqs 6-7, corrected), paper's frame.

    Of proximal bending, distal bending, advance, torsion (..., 4): position (..., 3), and R (..., 3, 3).
    Corrections: the third row of R has c_t s_pb + s_db c_pb s_t in the middle; p_y is
    -[s_pb (bm + c_db (e_l + delta)) + b_2 s_db s_pb / theta_db + b_1 (1 - c_pb) / theta_pb].
    """
    proximal_m, middle_m, distal_m, end_m = four_dof_lengths_m(robot)
    pb, db, advance, t = np.moveaxis(q, -1, 0)
    cp, sp, cd, sd, ct, st = np.cos(pb), np.sin(pb), np.cos(db), np.sin(db), np.cos(t), np.sin(t)
    R = _matrix(
        (ct * cd, -st * cd, sd),
        (st * cp + sd * sp * ct, ct * cp - sd * sp * st, -sp * cd),
        (st * sp - sd * cp * ct, ct * sp + sd * cp * st, cp * cd),
    )
    sine_d, versine_d = arc_functions(db * db)
    sine_p, versine_p = arc_functions(pb * pb)
    end = end_m + advance
    straight = middle_m + cd * end + distal_m * sine_d
    x = sd * end + distal_m * versine_d * db
    y = -(sp * straight + proximal_m * versine_p * pb)
    z = cp * straight + proximal_m * sine_p
    return np.stack([x, y, z], axis=-1), R


def in_base_frame(position: Array, R: Array) -> tuple[Array, Array]:
    """Return a paper's position (..., 3) and R (..., 3, 3) in the base frame."""
    return position @ R_BASE_PAPER.T, R_BASE_PAPER @ R @ R_BASE_PAPER.T


def in_paper_frame(position: Array, R: Array) -> tuple[Array, Array]:
    """Return a position (..., 3) and R (..., 3, 3) of the base frame in a paper's."""
    return position @ R_BASE_PAPER, R_BASE_PAPER.T @ R @ R_BASE_PAPER


def _matrix(*rows: tuple[Array, ...]) -> Array:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


# ----------------------------------------------------------------------------------------------------
# Closed-form inverse kinematics of both mitral catheters: joint values from a tool frame.
#
# A tool frame has six coordinates, the robots four joints: the orientation gives the angles (Nayar 2022,
# Eqs 16-19; Nayar 2023, Eqs 8-10), the position the advance. How far the reached tip lies from the asked
# one is part of the answer. Both branches are found, those within the joints' limits kept.
#
# The advance is the way along the tool's axis that is left, with its sign. 2022 Eq. 21 takes the distance,
# which has none; 2023 Eq. 11 divides by sin(theta_db), which is zero when straight.
#
# Where the orientation leaves a family of joint values. Transseptal robot: straight (bending 0), where only
# the two torsions' sum is given (Eq. 19). 4-DoF robot: distal bending +-90 deg, where only the proximal
# bending plus or minus the torsion is; there the position, which does not depend on the torsion, decides,
# so the answer is unique all the same.

STRAIGHT_RAD = 1e-7  # bends below it are straight: torsions would lose half of their digits
_GIMBAL = 1e-6  # |cos(distal bending)| below which the position decides
_LIMIT_SLACK = 1e-9  # [rad, m] a value on its limit may be over it by rounding


@dataclass(frozen=True)
class Family:
    """Joint values that all reach the same straight pose.

    Attributes:
        sum_rad: of proximal and distal torsion, the same for all [rad].
        proximal_rad: least and largest proximal torsion within the joints' limits [rad]; NaN where
            the limits leave none.
    """

    sum_rad: float
    proximal_rad: tuple[float, float]


@dataclass(frozen=True)
class InverseResult:
    """What the inverse kinematics found.

    Attributes:
        solutions: joint values within the limits, each of shape (m,) in the order of
            `kinematics`; of a family, the one that shares the sum out evenly.
        distance_m: of the reached tip from the asked one, for each solution [m].
        branches: joint values of every branch, within the limits or not.
        family: where the pose is straight and not unique; else None.
    """

    solutions: tuple[Array, ...]
    distance_m: tuple[float, ...]
    branches: tuple[Array, ...]
    family: Family | None = None

    @property
    def unique(self) -> bool:
        """Whether exactly one set of joint values within the limits reaches the pose."""
        return len(self.solutions) == 1 and self.family is None

    @property
    def message(self) -> str:
        """One line that says what was found."""
        if self.family is not None:
            total = math.degrees(self.family.sum_rad)
            return f"not unique: straight, any proximal and distal torsion that sum to {total:.6g} deg"
        if not self.solutions:
            return "no joint values within the limits reach this orientation and advance"
        return "unique" if self.unique else f"not unique: {len(self.solutions)} branches within the limits"


def inverse(robot: CatheterRobot, tool: Array) -> InverseResult:
    """Return the joint values that reach a tool frame (4, 4), base frame, SI units.

    Raises:
        InputError: neither of the two designs, a tube that is curved at rest, or no transform.
    """
    solvers: dict[tuple[str, ...], Callable[[CatheterRobot, Array, Array], list[Array]]] = {
        TRANSSEPTAL: _transseptal,
        FOUR_DOF: _four_dof,
    }
    if design(robot) not in solvers:
        raise InputError(f"{robot.name}: no inverse kinematics for this row of joints")
    for segment in robot.segments:
        if is_curved(segment):
            raise InputError(
                f"{robot.name}: segments.{segment.name}.tube_curvature: no closed-form inverse kinematics "
                "for a curved tube; choices: 0 per m"
            )
    tool = np.asarray(tool, dtype=float)
    R = tool[:3, :3]
    if tool.shape != (4, 4) or not np.allclose(R @ R.T, np.eye(3), atol=1e-6) or np.linalg.det(R) < 0.0:
        raise InputError(f"{robot.name}: a tool frame is a rotation and a position, shape (4, 4)")
    position, turned = in_paper_frame(tool[:3, 3], R)
    branches = [_with_advance(robot, q, tool) for q in solvers[design(robot)](robot, position, turned)]
    kept = tuple(q for q in branches if within_limits(robot, q))
    reached = tuple(float(np.linalg.norm(tool_frame(robot, q)[:3, 3] - tool[:3, 3])) for q in kept)
    family = None
    if design(robot) == TRANSSEPTAL and len(branches) == 1:
        family = _family(robot, float(branches[0][0] + branches[0][3]))
    return InverseResult(kept, reached, tuple(branches), family)


def within_limits(robot: CatheterRobot, q: Array) -> bool:
    """Return whether joint values, shape (m,), lie within the joints' limits and strokes."""
    for value, index in zip(q, moving(robot), strict=True):
        segment = robot.segments[index]
        if segment.joint == "prismatic":
            inside = -_LIMIT_SLACK <= value <= segment.stroke_m + _LIMIT_SLACK
        else:
            inside = abs(value) <= segment.limit_rad + _LIMIT_SLACK
        if not inside:
            return False
    return True


def _with_advance(robot: CatheterRobot, q: Array, tool: Array) -> Array:
    """Return `q` with the advance: what is left to the tip along the tool's axis."""
    left = tool[:3, 3] - tool_frame(robot, q)[:3, 3]
    return q + np.array([0.0, 0.0, float(tool[:3, 2] @ left), 0.0])


def _transseptal(robot: CatheterRobot, position: Array, R: Array) -> list[Array]:
    """Return both branches with no advance, one for a straight pose (Nayar 2022, Eqs 16-19)."""
    sine = 0.5 * (math.hypot(R[0, 2], R[1, 2]) + math.hypot(R[2, 0], R[2, 1]))
    # Eq. 16 by its cosine alone would lose half of the digits near straight
    bend = math.atan2(sine, R[2, 2])
    if bend < STRAIGHT_RAD:
        half = 0.5 * math.atan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])
        return [np.array([half, 0.0, 0.0, half])]
    found = []
    for sign in (1.0, -1.0):
        proximal = math.atan2(sign * R[0, 2], -sign * R[1, 2])
        distal = math.atan2(sign * R[2, 0], sign * R[2, 1])
        found.append(np.array([proximal, sign * bend, 0.0, distal]))
    return found


def _family(robot: CatheterRobot, total_rad: float) -> Family:
    first, last = robot.segments[0].limit_rad, robot.segments[3].limit_rad
    least, most = max(-first, total_rad - last), min(first, total_rad + last)
    return Family(total_rad, (least, most) if least <= most else (math.nan, math.nan))


def _four_dof(robot: CatheterRobot, position: Array, R: Array) -> list[Array]:
    """Return both branches with no advance (Nayar 2023, Eqs 8-10)."""
    found = []
    for sign in (1.0, -1.0):
        cosine = sign * 0.5 * (math.hypot(R[0, 0], R[0, 1]) + math.hypot(R[1, 2], R[2, 2]))
        distal = math.atan2(R[0, 2], cosine)
        if abs(cosine) < _GIMBAL:
            proximal = _proximal_from_position(robot, distal, position)
        else:
            proximal = math.atan2(-sign * R[1, 2], sign * R[2, 2])
        # what is left of R is the torsion, whatever the bends
        c, s = math.cos(proximal), math.sin(proximal)
        torsion = math.atan2(c * R[1, 0] + s * R[2, 0], c * R[1, 1] + s * R[2, 1])
        found.append(np.array([proximal, distal, 0.0, torsion]))
        if abs(cosine) < _GIMBAL:
            break  # both branches have met
    return found


def _proximal_from_position(robot: CatheterRobot, distal: float, position: Array) -> float:
    """Return the proximal bend whose tip lies in the direction of `position` about the x axis.

    At a distal bend of +-90 deg the advance moves the tip along x alone.
    """
    proximal_m, middle_m, distal_m, _ = four_dof_lengths_m(robot)
    straight = middle_m + distal_m * math.sin(distal) / distal
    wanted = math.atan2(-position[1], position[2])

    def excess(bend: float) -> float:
        # the chord points along half of the bend, what follows along all of it
        half = 0.5 * bend
        chord = proximal_m * float(np.sinc(half / math.pi))
        across = chord * math.sin(half) + straight * math.sin(bend)
        along = chord * math.cos(half) + straight * math.cos(bend)
        return math.atan2(across, along) - wanted

    limit = 0.75 * math.pi  # within it the direction lies between half of the bend and all of it
    low, high = excess(-limit), excess(limit)
    if not low <= 0.0 <= high:
        return math.copysign(limit, wanted)
    return float(brentq(excess, -limit, limit, xtol=1e-15))


# ----------------------------------------------------------------------------------------------------
# Pure kinematics (PK) as a static model: displacements to angles, angles to the tool.
#
# Nayar 2022, Eqs 5, 7, 15; Nayar 2023, Eqs 7, 12-13. Inextensible, taut tendons, a rigid mount and drives
# without play, unless the robot's say otherwise; play is the only history. Friction, a tendon's own law and
# a joint's measured resistance are `balance`'s.
#
# A bending pair's tension balances the joint's elastic moment at the tendons' arm in the straight joint, K
# |theta - rest| / a_b. The arm at the angle, `tendons.arm_m`, is up to 2.3 % larger within 120 deg (2022
# robot). Torsion joints turn freely, so their pairs carry none.

PURE_KINEMATICS = "pk"


def pk(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures by pure kinematics; without play every row stands alone.

    The run's residual is a displacement here: what the angles' displacement differs by from the input's, the
    largest of the pairs [m].

    Raises:
        InputError: a load that the model does not have, or a displacement beyond the joint's range.
    """
    require_unloaded(robot, inputs, gravity_mps2, PURE_KINEMATICS)
    columns, residual, sunk_m = [], np.zeros(len(inputs)), sunk_along(robot, inputs, PURE_KINEMATICS)
    for pair in range(len(robot.tendons)):
        values, left = pure_joint(robot, inputs, pair, PURE_KINEMATICS, sunk_m)
        columns.append(values)
        residual = np.maximum(residual, left)
    return run_of(robot, inputs, gravity_mps2, PURE_KINEMATICS, columns, residual, sunk_m=sunk_m)


def sunk_along(robot: CatheterRobot, inputs: Inputs, model: str) -> Array:
    """Return how far the mount gives way at each row, shape (r,) [m]; NaN where a joint is beyond its range.

    Raises:
        InputError: it gives way, and something about the tendons is not known to give way with it.
    """
    require_springs(robot, model)
    drawn = [arriving_m(item, inputs.tendon[:, pair]) for pair, item in enumerate(robot.tendons)]
    return sunk_by(robot, np.stack(drawn, axis=-1))


def pure_joint(
    robot: CatheterRobot, inputs: Inputs, pair: int, model: str, sunk_m: Array | float = 0.0
) -> tuple[Array, Array]:
    """Return the value of the joint that a pair moves, and the displacement left over, per row.

    Angle [rad] or advance [m], (r,), and |displacement left over|, (r,) [m]; the mount has sunk by `sunk_m`.

    Raises:
        InputError: a displacement to which no angle belongs.
    """
    segment = robot.segments[moved_segment(robot, pair)]
    displacement = arriving_m(robot.tendons[pair], inputs.tendon[:, pair])
    if segment.joint == "prismatic":
        return displacement, np.zeros(len(inputs))
    compliance_m = 0.0
    if segment.joint == "bending":
        displacement = eased_m(displacement, sunk_m)
        compliance_m = _tension_N_per_rad(robot, segment) / robot.tendons[pair].stiffness_N_per_m
    angle = elastic_angle_rad(segment, displacement, compliance_m)
    if np.isnan(angle).any():
        raise beyond(robot, inputs, int(np.argmax(np.isnan(angle))), pair, segment, model)
    stretch = compliance_m * (angle - segment.rest_rad)
    return angle, np.abs(pulled_m(segment, angle) + stretch - displacement)


def beyond(
    robot: CatheterRobot, inputs: Inputs, row: int, pair: int, segment: CatheterSegment, model: str
) -> InputError:
    """Return the error for a displacement to which no angle of the joint belongs."""
    reach = f"beyond the range of its joint, which ends at {math.degrees(largest_angle_rad(segment)):.4g} deg"
    return InputError(f"{channel_at(robot, inputs, pair, model, row)}: {reach}")


def channel_at(robot: CatheterRobot, inputs: Inputs, pair: int, model: str, row: int) -> str:
    """Return what names a row, a model and the displacement of a pair in a message."""
    channel = f"{drives(robot, inputs.actuation)[pair].column} = {inputs.tendon[row, pair] * 1e3:g}"
    return f"{row_name(inputs, row)}: static model {model!r}: {channel}"


def require_unloaded(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array, model: str) -> None:
    """Raise `InputError` where something acts that a kinematic model does not know."""
    weighs = any(segment.mass_kg > 0.0 for segment in robot.segments)
    if weighs and np.any(np.asarray(gravity_mps2)):
        raise InputError(f"static model {model!r}: has no weight, so gravity or the masses must be 0")
    loaded = inputs.force_tip.any(axis=1) | inputs.moment_tip.any(axis=1)
    if loaded.any():
        row = row_name(inputs, int(np.argmax(loaded)))
        raise InputError(f"{row}: static model {model!r}: has no tip force or moment; it is kinematic")


def run_of(
    robot: CatheterRobot,
    inputs: Inputs,
    gravity_mps2: Array,
    model: str,
    values: Sequence[Array],
    residual: Array,
    tension_N: Array | None = None,
    sunk_m: Array | float = 0.0,
) -> StaticRun:
    """Return the run of a kinematic model.

    Args:
        values: of the joint that each pair moves, each of shape (r,) [rad or m].
        tension_N: of each pair, shape (r, t) [N]; default: the elastic moment's.
        sunk_m: how far the base has sunk along -z, shape (r,) [m].
    """
    drawn = np.stack(values, axis=-1)
    q = joint_vector(robot, drawn)
    p_w, R_w = (item[0] for item in batch_frames([robot], drawn[np.newaxis], range(len(elements(robot)))))
    p_w[..., 2] -= np.broadcast_to(sunk_m, len(p_w))[:, np.newaxis]
    if tension_N is None:
        tension_N = np.stack([elastic_tension_N(robot, k, value) for k, value in enumerate(values)], axis=-1)
    angles = hinge_angles(robot, q)
    inside = np.full((len(robot.tendons), p_w.shape[1]), np.nan)
    postures = tuple(
        Posture(p_w[row], R_w[row], angles[row], tension_N[row], inside) for row in range(len(inputs))
    )
    return StaticRun(model, inputs, np.asarray(gravity_mps2, dtype=float), postures, residual)


def elastic_tension_N(robot: CatheterRobot, pair: int, value: Array) -> Array:
    """Return the pulled tendon's tension at a joint value, same shape [N]; 0 of torsion and advance."""
    segment = robot.segments[moved_segment(robot, pair)]
    if segment.joint != "bending":
        return np.zeros(value.shape)
    return _tension_N_per_rad(robot, segment) * np.abs(value - segment.rest_rad)


def _tension_N_per_rad(robot: CatheterRobot, segment: CatheterSegment) -> float:
    return joint_stiffness(robot, segment) / segment.arm_m


def joint_vector(robot: CatheterRobot, values: Array) -> Array:
    """Return the pairs' values (..., t) in the order of the joints, base to tip, shape (..., m)."""
    pair_of = {moved_segment(robot, pair): pair for pair in range(len(robot.tendons))}
    return values[..., [pair_of[index] for index in moving(robot)]]


def hinge_angles(robot: CatheterRobot, q: Array) -> Array:
    """Return every hinge's angle at joint values q (..., m), shape (..., hinges) [rad].

    The gaps of a bending joint share its bend.
    """
    turns = [k for k, index in enumerate(moving(robot)) if robot.segments[index].joint != "prismatic"]
    counts = hinge_counts(robot)
    return np.repeat(q[..., turns] / np.array(counts), counts, axis=-1)
