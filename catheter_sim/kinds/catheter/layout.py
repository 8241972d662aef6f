"""Where everything of a catheter lies when it is straight: elements, joints, their order. Derived.

Elements, counted from 1 at the base, are what `body_<k>` names: every rigid, torsion or prismatic
segment, and every ring of a bending one. A bending segment begins and ends with a gap.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment, TendonPair

TRANSSEPTAL = ("torsion", "bending", "prismatic", "torsion")
FOUR_DOF = ("bending", "rigid", "bending", "rigid", "prismatic", "torsion")


@dataclass(frozen=True)
class Element:
    """A rigid piece of the catheter.

    Attributes:
        segment: index of its segment.
        ring: 0, or the number of the ring in its segment, from 1.
        face_m: from the segment's base end to the element's distal face at rest [m].
    """

    segment: int
    ring: int
    face_m: float


def ring_length_m(segment: CatheterSegment) -> float:
    """Return the length of one ring of a bending segment [m]."""
    return _ring_length_m(segment.length_m, segment.rings, segment.half_gap_m)


def _ring_length_m(length_m: float, rings: int, half_gap_m: float) -> float:
    return length_m / rings - 2.0 * half_gap_m * (rings + 1) / rings


def elements(robot: CatheterRobot) -> tuple[Element, ...]:
    """Return the robot's elements, base to tip."""
    rings = (item.rings if item.joint == "bending" else 0 for item in robot.segments)
    return _elements(
        tuple((item.length_m, n, item.half_gap_m) for item, n in zip(robot.segments, rings, strict=True))
    )


@lru_cache(maxsize=64)  # a diagnosis asks for the same few, robot by robot
def _elements(segments: tuple[tuple[float, int, float], ...]) -> tuple[Element, ...]:
    """Return the elements of segments of given length, rings (0: it is one rigid piece) and half gap."""
    result = []
    for index, (length_m, rings, half_gap_m) in enumerate(segments):
        if rings:
            pitch = _ring_length_m(length_m, rings, half_gap_m) + 2.0 * half_gap_m
            result += [Element(index, ring, ring * pitch) for ring in range(1, rings + 1)]
        else:
            result.append(Element(index, 0, length_m))
    return tuple(result)


def base_heights_m(robot: CatheterRobot) -> list[float]:
    """Return the height of each segment's base end in the straight robot, then the tip's [m]."""
    heights = [0.0]
    for segment in robot.segments:
        heights.append(heights[-1] + segment.length_m)
    return heights


def moving(robot: CatheterRobot) -> list[int]:
    """Return the indices of the segments that have a joint, base to tip: the order of joint values."""
    return [index for index, segment in enumerate(robot.segments) if segment.joint != "rigid"]


def moved_segment(robot: CatheterRobot, pair: int) -> int:
    """Return the index of the segment that the pair of this index moves."""
    return [segment.name for segment in robot.segments].index(robot.tendons[pair].moves)


def bent_by(robot: CatheterRobot) -> dict[str, CatheterSegment]:
    """Return the bending segments, by the name of the pair that moves each, in the order of the pairs."""
    moved = {pair.name: robot.segments[moved_segment(robot, k)] for k, pair in enumerate(robot.tendons)}
    return {name: segment for name, segment in moved.items() if segment.joint == "bending"}


def beside_springs(robot: CatheterRobot) -> str:
    """Return what the bending joints and their tendons do more than springs would; "" if nothing."""
    return _first_words(robot, pair_beside_springs)


def beside_friction(robot: CatheterRobot) -> str:
    """Return what the bending joints and their tendons do more than springs that rub; "" if nothing."""
    return _first_words(robot, _pair_beside_friction)


def carries_load(robot: CatheterRobot) -> bool:
    """Return whether there are bending joints, and the statics carry a load on them: springs that may rub."""
    return bool(bent_by(robot)) and not beside_friction(robot)


def pair_beside_springs(robot: CatheterRobot, pair: TendonPair, segment: CatheterSegment) -> str:
    """Return what a pair and the bending joint that it moves do more than springs would; "" if nothing."""
    return "friction" if robot.friction.mu > 0.0 else _pair_beside_friction(robot, pair, segment)


def _pair_beside_friction(robot: CatheterRobot, pair: TendonPair, segment: CatheterSegment) -> str:
    if pair.law != "linear":
        return "tendons of a measured law"
    return "" if segment.resistance == "elastic" else "a measured resistance"


def _first_words(
    robot: CatheterRobot, words_of: Callable[[CatheterRobot, TendonPair, CatheterSegment], str]
) -> str:
    bending = bent_by(robot)
    found = (words_of(robot, pair, bending[pair.name]) for pair in robot.tendons if pair.name in bending)
    return next((words for words in found if words), "")


def is_extensible(pair: TendonPair) -> bool:
    """Return whether the pair's tendons stretch."""
    return math.isfinite(pair.stiffness_N_per_m) or pair.law != "linear"


def turning(robot: CatheterRobot) -> list[CatheterSegment]:
    """Return the segments whose joint has an angle (torsion, bending), base to tip."""
    return [segment for segment in robot.segments if segment.joint in ("torsion", "bending")]


def hinge_counts(robot: CatheterRobot) -> list[int]:
    """Return how many hinges each of `turning` has: one, or one in every gap."""
    return [segment.rings + 1 if segment.joint == "bending" else 1 for segment in turning(robot)]


def hinge_names(robot: CatheterRobot) -> list[str]:
    """Return the hinges' names, base to tip: a torsion joint's own; `<name>_<k>`, a gap of a bending one."""
    names = []
    for segment in turning(robot):
        if segment.joint == "bending":
            names += [f"{segment.name}_{gap}" for gap in range(1, segment.rings + 2)]
        else:
            names.append(segment.name)
    return names


def hinge_heights_m(segment: CatheterSegment) -> Array:
    """Return the heights of a bending segment's hinges above its base end, shape (rings + 1,) [m].

    Evenly spaced, the ends so that the mean square of the turn about the joint's middle is the arc's,
    1/12 of the squared bend: the chords of chain and arc then differ by the bend's fourth power.
    """
    gaps = segment.rings + 1
    inner = float(((np.arange(1, gaps) / gaps - 0.5) ** 2).mean())
    end = segment.length_m * (1.0 / 12.0 - inner) / (0.5 - 2.0 * inner)
    return np.linspace(end, segment.length_m - end, gaps)


def tube_stiffness_N_m2(robot: CatheterRobot, segment: CatheterSegment) -> float:
    """Return the bending stiffness EI of the exposed tube of a prismatic segment; inf: rigid [N m^2]."""
    return robot.stiffness_scale * segment.tube_stiffness_N_m2


def is_curved(segment: CatheterSegment) -> bool:
    """Return whether a prismatic segment's unloaded tube is not straight."""
    return segment.tube_curvature_x_per_m != 0.0 or segment.tube_curvature_y_per_m != 0.0


def bending_tubes(robot: CatheterRobot) -> list[CatheterSegment]:
    """Return the prismatic segments whose exposed tube bends, by load or by itself, base to tip."""
    return [
        segment
        for segment in robot.segments
        if segment.joint == "prismatic" and (math.isfinite(segment.tube_stiffness_N_m2) or is_curved(segment))
    ]


def joint_stiffness(robot: CatheterRobot, segment: CatheterSegment) -> float:
    """Return a bending joint's stiffness over all of its gaps [N m/rad].

    The sum of its wires' and of EI / length of every tube of finite EI that runs through it to a prismatic
    segment beyond. What a tube of infinite EI adds is in the wires' number.
    """
    beyond = robot.segments[robot.segments.index(segment) + 1 :]
    tubes = sum(part.tube_stiffness_N_m2 for part in beyond if math.isfinite(part.tube_stiffness_N_m2))
    return robot.stiffness_scale * (segment.bending_stiffness_N_m_per_rad + tubes / segment.length_m)


def closing_angle_rad(segment: CatheterSegment) -> float:
    """Return the bend at which the rings' rims touch in every gap [rad].

    Nayar 2022, Section II-A: tan(bend / (2 (n + 1))) = t / rim radius.
    """
    return 2.0 * (segment.rings + 1) * math.atan2(segment.half_gap_m, segment.rim_radius_m)


def design(robot: CatheterRobot) -> tuple[str, ...]:
    """Return the robot's joints in a row: `TRANSSEPTAL`, `FOUR_DOF` or another."""
    return tuple(segment.joint for segment in robot.segments)


def is_transseptal(robot: CatheterRobot) -> bool:
    """Return whether `robot` has the joints of Nayar 2022 in their order."""
    return design(robot) == TRANSSEPTAL


def is_four_dof(robot: CatheterRobot) -> bool:
    """Return whether `robot` has the joints of Nayar 2023 in their order."""
    return design(robot) == FOUR_DOF
