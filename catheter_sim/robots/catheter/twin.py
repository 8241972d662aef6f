"""The twin of catheters: pure kinematics of many at once, or the joints' balance where these do more."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import has_mount_slide
from catheter_sim.core.statics import Twin, TwinStates
from catheter_sim.errors import InputError
from catheter_sim.mechanics.arcs import arc_series, turn_by_arc
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.hysteresis import played
from catheter_sim.robots.catheter.description import carries_load, elements, joint_stiffness, moved_segment
from catheter_sim.robots.catheter.kinematics import (
    elastic_tension_N,
    hinge_angles,
    joint_vector,
    largest_angle_rad,
    sunk_along,
)
from catheter_sim.robots.catheter.loaded import (
    Unloaded,
    Yielded,
    loaded_rows,
    require_no_law,
    yielded_together,
)
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.robots.catheter.statics import balanced_joints, has_laws

# ----------------------------------------------------------------------------------------------------
# Pure kinematics of many catheters in compiled loops: displacements to joint values, these to frames.
#
# The same equations as in `drive`, `tendons` and `kinematics`, whose text explains them.

BENDING, TORSION, PRISMATIC, RIGID = 0, 1, 2, 3
_MOST_STEPS = 50
_SMALLEST_STEP_RAD = 1e-14
_LAST_BITS = 1.0 + 1e-12  # the last bit of the largest displacement is no reason to refuse it


@compiled
def _drawn_m(angle, half_gap, arm, gaps):
    """Return `tendons._drawn_m`: by how much a bending joint's tendon is shorter than straight [m]."""
    phi = angle / gaps
    half = math.sin(0.5 * phi)
    return gaps * (2.0 * half_gap * half * half + arm * math.sin(phi))


@compiled
def _bending_angle(way, compliance, rest, half_gap, arm, gaps, largest):
    """Return `tendons.elastic_angle_rad` of a bending joint [rad]; NaN beyond its range."""
    side = 1.0 if way >= 0.0 else -1.0
    size = abs(way)
    home = _drawn_m(side * rest, half_gap, arm, gaps)
    turn = largest - side * rest  # from rest, toward the drawn side
    reached = _drawn_m(largest, half_gap, arm, gaps) - home + compliance * turn
    if not size <= reached * _LAST_BITS:
        return math.nan
    if compliance == 0.0:
        x = (min(size, reached) + home) / gaps
        return side * 2.0 * gaps * math.atan(x / (arm + math.sqrt(arm * arm + x * (2.0 * half_gap - x))))
    for _ in range(_MOST_STEPS):
        angle = side * rest + turn  # counted toward the drawn side
        phi = angle / gaps
        excess = _drawn_m(angle, half_gap, arm, gaps) - home + compliance * turn - size
        step = excess / (half_gap * math.sin(phi) + arm * math.cos(phi) + compliance)
        turn = max(turn - step, 0.0)
        if abs(step) <= _SMALLEST_STEP_RAD:
            break
    return rest + side * turn


@compiled
def _torsion_angle(way, radius, wrap, height):
    """Return `tendons.angle_rad` of a torsion joint [rad]; NaN beyond its range."""
    whole = math.hypot(radius * wrap, height)
    most = whole - height
    size = abs(way)
    if not size <= most * _LAST_BITS:
        return math.nan
    size = min(size, most)
    around = math.sqrt(max((whole - size) ** 2 - height * height, 0.0))
    return math.copysign(size * (2.0 * whole - size) / (radius * (radius * wrap + around)), way)


@compiled
def pure_values(joint, numbers, ways, values):
    """Set `values` (B, r, t) to the joints' values, angle [rad] or advance [m]; NaN beyond the range.

    Args:
        joint: which kind of joint each pair moves, (t,).
        numbers: (B, t, 8): half of the play, slack [m]; then of a bending joint compliance [m/rad], rest,
            half gap, arm, twice the number of gaps, largest angle; of a torsion joint radius, wrap, height.
        ways: displacements, (B, r, t) [m].
    """
    for b in range(ways.shape[0]):
        for pair in range(ways.shape[2]):
            own = numbers[b, pair]
            drawn = 0.0
            for row in range(ways.shape[1]):
                way = ways[b, row, pair]
                drawn = played(drawn, way, own[0])
                arriving = math.copysign(max(abs(drawn) - own[1], 0.0), drawn)
                if joint[pair] == BENDING:
                    value = _bending_angle(arriving, own[2], own[3], own[4], own[5], own[6], own[7])
                elif joint[pair] == TORSION:
                    value = _torsion_angle(arriving, own[2], own[3], own[4])
                else:
                    value = arriving
                values[b, row, pair] = value


@compiled
def element_frames(joint, mover, numbers, segment, faces, values, places, rotations):
    """Set frames of elements, (B, r, n, 3) [m] and (B, r, n, 3, 3), at joint values (B, r, t).

    Args:
        joint: kind of each segment, (s,); mover: the pair that moves it, or -1, (s,).
        numbers: (B, s, 3): length [m], and the direction (x, y) in which a bending joint bends or the
            curvature (x, y) of a prismatic segment's tube [1/m].
        segment: of each element, rising, (n,).
        faces: of each element from its segment's base, (B, n) [m].
    """
    place, point, rotation, end = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for b in range(values.shape[0]):
        for row in range(values.shape[1]):
            for i in range(3):
                place[i] = 0.0
                for j in range(3):
                    rotation[i, j] = 1.0 if i == j else 0.0
            element = 0
            for s in range(len(joint)):
                length, x, y = numbers[b, s, 0], numbers[b, s, 1], numbers[b, s, 2]
                value = values[b, row, mover[s]] if mover[s] >= 0 else 0.0
                if joint[s] == TORSION:
                    cosine, sine = math.cos(value), math.sin(value)
                    for i in range(3):
                        a, c = rotation[i, 0], rotation[i, 1]
                        rotation[i, 0] = cosine * a + sine * c
                        rotation[i, 1] = cosine * c - sine * a
                # An arc (of a rigid or torsion segment one of no length), then a straight piece.
                arc, straight = 0.0, length
                if joint[s] == BENDING:
                    arc, straight = length, 0.0
                    x, y = x * value / length, y * value / length
                elif joint[s] == PRISMATIC:
                    arc = value
                while True:
                    shown = element < len(segment) and segment[element] == s
                    inside = shown and joint[s] == BENDING  # a ring: a gap follows it
                    reach = faces[b, element] if inside else arc
                    bend_x, bend_y = x * reach, y * reach
                    sine, versine, _, _, _ = arc_series(bend_x * bend_x + bend_y * bend_y)
                    turn_by_arc(bend_x, bend_y, sine, versine, rotation, end)
                    for i in range(3):
                        across = rotation[i, 0] * bend_x + rotation[i, 1] * bend_y
                        point[i] = place[i] + reach * (versine * across + sine * rotation[i, 2])
                        point[i] += straight * end[i, 2]
                    if shown:
                        for i in range(3):
                            places[b, row, element, i] = point[i]
                            for j in range(3):
                                rotations[b, row, element, i, j] = end[i, j]
                        element += 1
                    if not inside:
                        break
                for i in range(3):
                    place[i] = point[i]
                    for j in range(3):
                        rotation[i, j] = end[i, j]


# ----------------------------------------------------------------------------------------------------
# Many catheters at once, alike but for their numbers: joint values and frames, for a twin.
#
# What `pure` knows of a robot on a rigid mount goes through compiled loops; a robot of which `balance`
# knows more, or whose mount gives way, goes through that. What a load adds is found robot by robot, all
# rows at once.

MODEL = "balance"
_KINDS = {"bending": BENDING, "torsion": TORSION, "prismatic": PRISMATIC, "rigid": RIGID}


def batch_joints(
    robots: Sequence[CatheterRobot], inputs: Sequence[Inputs], gravity_mps2: Array
) -> tuple[Array, Array, Array]:
    """Return what each pair's joint does along each robot's own inputs, before any load moves it.

    It is `pure`'s, or `balance`'s if it must be: angles [rad] and advances [m] (B, r, t), tensions (B, r, t)
    [N], and how far the mount has given way (B, r) [m]; NaN of a robot that one of its rows leads beyond what
    its joints or the model can do.
    """
    first = robots[0]
    moved = [moved_segment(first, pair) for pair in range(len(first.tendons))]
    joint = np.array([_KINDS[first.segments[index].joint] for index in moved])
    ways = np.array([item.tendon for item in inputs])
    numbers = np.array(
        [[_pair_numbers(robot, k, index) for k, index in enumerate(moved)] for robot in robots]
    )
    values, tension = np.empty(ways.shape), np.empty(ways.shape)
    sunk_m = np.zeros(ways.shape[:2])
    pure_values(joint, numbers, np.ascontiguousarray(ways), values)
    for place, (robot, driven) in enumerate(zip(robots, inputs, strict=True)):
        try:
            require_no_law(robot, driven, loaded_rows(robot, driven, gravity_mps2), MODEL)
            if has_laws(robot) or has_mount_slide(robot):
                sunk_m[place] = sunk_along(robot, driven, MODEL)
                values[place], tension[place], _ = balanced_joints(robot, driven, sunk_m[place])
            if not has_laws(robot):
                for pair in range(len(moved)):
                    tension[place, :, pair] = elastic_tension_N(robot, pair, values[place, :, pair])
        except InputError:
            values[place] = np.nan
        if np.isnan(values[place]).any():
            values[place], tension[place] = np.nan, np.nan
    return values, tension, sunk_m


def batch_loads(
    robots: Sequence[CatheterRobot],
    inputs: Sequence[Inputs],
    gravity_mps2: Array,
    values: Array,
    tension: Array,
    sunk_m: Array,
    every: int,
) -> list[tuple[int, np.ndarray, Yielded]]:
    """Return what loads do to robots at each `every`-th row: a robot's index, which of these rows, and what.

    `values`, `tension`, `sunk_m` are of all rows, as of `batch_joints`; at a robot of NaN none is looked for.
    """
    asked = []
    for place, (robot, driven) in enumerate(zip(robots, inputs, strict=True)):
        rows = loaded_rows(robot, driven, gravity_mps2)
        rows = rows[rows % every == 0]
        if len(rows) and not np.isnan(values[place]).any():
            there = (item[place, rows] for item in (values, tension, sunk_m))
            asked.append((place, Unloaded(robot, driven, rows, *there)))
    found = yielded_together([item for _, item in asked], gravity_mps2)
    return [(place, item.rows // every, own) for (place, item), own in zip(asked, found, strict=True)]


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
    joint = np.array([_KINDS[segment.joint] for segment in first.segments])
    parts = [elements(robot) for robot in robots]
    segment = np.array([parts[0][index].segment for index in wanted], dtype=np.int64)
    shape = (*values.shape[:2], len(segment))
    places, rotations = np.empty((*shape, 3)), np.empty((*shape, 3, 3))
    faces = np.array([[own[index].face_m for index in wanted] for own in parts])
    numbers = np.array([_segment_numbers(robot) for robot in robots])
    element_frames(joint, mover, numbers, segment, faces, np.ascontiguousarray(values), places, rotations)
    return places, rotations


def _pair_numbers(robot: CatheterRobot, pair: int, index: int) -> tuple[float, ...]:
    """Return the numbers of `batch_kernel.pure_values` for a pair that moves the segment `index`."""
    item, segment = robot.tendons[pair], robot.segments[index]
    drive = 0.5 * item.play_m, item.slack_m
    if segment.joint == "bending":
        compliance_m = joint_stiffness(robot, segment) / segment.arm_m / item.stiffness_N_per_m
        gaps = 2.0 * (segment.rings + 1)
        largest = largest_angle_rad(segment)
        return *drive, compliance_m, segment.rest_rad, segment.half_gap_m, segment.arm_m, gaps, largest
    return *drive, segment.tendon_radius_m, segment.wrap_rad, segment.wrap_height_m, 0.0, 0.0, 0.0


def _segment_numbers(robot: CatheterRobot) -> list[tuple[float, float, float]]:
    """Return the numbers of `batch_kernel.element_frames` for every segment."""
    found = []
    for segment in robot.segments:
        toward = (0.0, 0.0)
        if segment.joint == "bending":
            toward = (1.0, 0.0) if segment.bends_toward == "x" else (0.0, 1.0)
        elif segment.joint == "prismatic":
            toward = segment.tube_curvature_x_per_m, segment.tube_curvature_y_per_m
        found.append((segment.length_m, *toward))
    return found


# ----------------------------------------------------------------------------------------------------
# The twin of catheters: pure kinematics, or the joints' balance where these do more, all at once.


@dataclass(frozen=True)
class CatheterTwin:
    """Twin of catheters.

    Attributes:
        carries_load: whether the robots bend, by joints and tendons that are springs, which may rub.
    """

    carries_load: bool

    def solve(
        self,
        robots: Sequence[CatheterRobot],
        arriving: Sequence[Inputs],
        gravity_mps2: Array,
        elements: Sequence[int],
        every: int,
    ) -> TwinStates:
        """Return where robots are, as `Twin.solve` says; NaN of one that a row leads out of its range."""
        values, tension, sunk_m = batch_joints(robots, arriving, gravity_mps2)
        loads = batch_loads(robots, arriving, gravity_mps2, values, tension, sunk_m, every)
        values, tension = values[:, ::every], tension[:, ::every]
        p_w, R_w = batch_frames(robots, values, elements)
        p_w[..., 2] -= sunk_m[:, ::every, np.newaxis]
        wanted = list(elements)
        for robot, rows, found in loads:
            none = np.where(np.isnan(found.left), np.nan, 0.0)[:, np.newaxis]
            p_w[robot, rows] += found.moved_m[:, wanted] + none[..., np.newaxis]
            R_w[robot, rows] = found.turn[:, wanted] @ R_w[robot, rows] + none[..., np.newaxis, np.newaxis]
            tension[robot, rows] += found.tension + none

        def joint_angles() -> Array:
            angles = hinge_angles(robots[0], joint_vector(robots[0], values))
            for robot, rows, found in loads:
                angles[robot, rows] += found.joint_angles
            return angles

        return TwinStates(p_w, R_w, joint_angles, tension)


def twin(robot: CatheterRobot, actuation: str) -> Twin[CatheterRobot]:
    """Return the twin of robots like `robot`, which displacements drive."""
    return CatheterTwin(carries_load(robot))
