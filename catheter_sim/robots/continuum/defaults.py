"""What a continuum robot's file may leave out: links of its chain, stiffnesses."""

from __future__ import annotations

import cmath
import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

from catheter_sim.core.robot import MAX_LINKS
from catheter_sim.robots.continuum.description import disks, hinge_places, is_centred
from catheter_sim.robots.continuum.spec import ContinuumRobot, with_stiffness

# ----------------------------------------------------------------------------------------------------
# How many links a chain needs to bend as the rod that it stands for: the error, and the default from it.
#
# The simulation makes a backbone a chain of links. Two things are then off. Bent by the same angle, a chain
# is shorter than a rod. And a tendon, straight between two disks, is farther from hinges than from a rod,
# so that a tension bends the chain more. Both are exact here for a bend in one plane by a tension T alone.
# At a distance d from the tendon and an angle a to it, both begin at a disk with a = t / 2, d = r cos(t /
# 2) and end at the next with a = -t / 2; t is the turn of the subsegment, r the tendon's distance from the
# disks' centres. Along the rod EI a' = -T d and d' = sin a; at a hinge of the chain, which stands for a
# length l, the angle falls by T d l / EI.
#
# With hinges at the middles of equal links both errors fall with 1 / n^2. With hinges where they make the
# chain as long as an arc to second order (`layout.hinge_places`) they are of fourth order in t: two hinges
# between disks do what else takes a dozen.

BEND_RAD = 0.5 * math.pi  # of every segment, toward the same side: the shape at which the error is stated
LARGEST_ERROR = 1e-3  # of the robot's length, of a robot that does not say its links
LEAST_OF_A_ROD = 50  # links of a robot without tendons that does not say them: loads bend it in between
_HALVINGS, _STEPS = 45, 8


def with_enough_links(robot: ContinuumRobot) -> ContinuumRobot:
    """Return `robot` with the fewest links whose tip error (`tip_error_m`) is at most `LARGEST_ERROR`.

    Their hinges are where they bend as a rod (`hinges` = "rod"). A robot of cells (`appearance` =
    "wire_guides") is returned as it is: a cell is one flexure; so is a chain whose hinges say where they are.
    One without tendons has `LEAST_OF_A_ROD` at least. Of a robot that would need more than `MAX_LINKS` links
    in all it is as many as these allow.
    """
    if _is_no_rod(robot):
        return robot
    robot = replace(robot, hinges="rod")
    length = sum(segment.length_m for segment in robot.segments)
    most = max(1, MAX_LINKS // sum(disks(robot, segment) for segment in robot.segments))
    least = 1 if robot.tendons else math.ceil(LEAST_OF_A_ROD / sum(disks(robot, s) for s in robot.segments))
    found = replace(robot, links_per_subsegment=least)
    while tip_error_m(found) > LARGEST_ERROR * length and found.links_per_subsegment < most:
        found = replace(robot, links_per_subsegment=found.links_per_subsegment + 1)
    return found


def tip_error_m(robot: ContinuumRobot) -> float:
    """Return how far the chain's tip is from that of a rod when every segment is bent by `BEND_RAD` [m].

    Each segment is bent by a tension in the innermost tendon that runs through it, all toward the same side,
    without friction or load; segments without tendons stay straight. A robot without any is bent by a moment
    on its tip. Zero of a robot that is no rod.
    """
    if _is_no_rod(robot):
        return 0.0
    places = tuple(hinge_places(robot))
    chain, rod = (0j, 1 + 0j), (0j, 1 + 0j)  # the tip and its direction
    for index, segment in enumerate(robot.segments):
        count = disks(robot, segment)
        h, turn = segment.length_m / count, BEND_RAD / count
        radius = _innermost_m(robot, index)
        if radius is None and not robot.tendons:  # chords of a chain and of a circle's arc
            chain = _beyond(chain, count, h * _moment_chord(places, turn), turn)
            rod = _beyond(rod, count, h * math.sin(0.5 * turn) / (0.5 * turn), turn)
            continue
        if radius is None:
            chain, rod = (_beyond(tip, 1, segment.length_m, 0.0) for tip in (chain, rod))
            continue
        pull, chord = _bent_rod(radius / h, turn)
        rod = _beyond(rod, count, h * chord, turn)
        bent, chord = _bent_chain(places, radius / h, pull)
        chain = _beyond(chain, count, h * chord, bent)
    return abs(chain[0] - rod[0])


def _is_no_rod(robot: ContinuumRobot) -> bool:
    """Return whether hinges are what they are: of cells, off the middles, in other planes, or not there."""
    others = any(segment.bending_axes in ("y", "none") for segment in robot.segments)
    return robot.appearance == "wire_guides" or others or not is_centred(robot)


def _innermost_m(robot: ContinuumRobot, index: int) -> float | None:
    """Return the smallest distance of a tendon that runs through a segment; None where none does."""
    beyond = {segment.name for segment in robot.segments[index:]}
    return min((tendon.radius_m for tendon in robot.tendons if tendon.ends_at in beyond), default=None)


def _beyond(tip: tuple[complex, complex], count: int, chord: float, turn: float) -> tuple[complex, complex]:
    """Return the tip and its direction beyond so many more subsegments of one chord and turn."""
    place, along = tip
    for _ in range(count):
        place += along * chord * cmath.exp(0.5j * turn)
        along *= cmath.exp(1j * turn)
    return place, along


def _moment_chord(places: tuple[float, ...], turn: float) -> float:
    """Return the chord over h of a subsegment whose hinges, at `places`, share a turn [rad] equally."""
    angle, along = 0.5 * turn, 0.0
    for here, there in pairwise((0.0, *places, 1.0)):
        along += (there - here) * math.cos(angle)
        angle -= turn / len(places)
    return along


def _bent_chain(places: tuple[float, ...], radius: float, pull: float) -> tuple[float, float]:
    """Return how far a pull bends a subsegment of the chain, half a turn at most [rad], and its chord over h.

    Args:
        places: of the hinges, shares of the subsegment's length h.
        radius: of the tendon, over h.
        pull: T h^2 / EI.
    """
    ends = (0.0, *places, 1.0)

    def from_disk_to_disk(turn: float) -> tuple[float, float]:
        """Return the sum of the hinges' turns, and the chord."""
        angle, distance, along = 0.5 * turn, radius * math.cos(0.5 * turn), 0.0
        for here, there in pairwise(ends):
            distance += (there - here) * math.sin(angle)
            along += (there - here) * math.cos(angle)
            if there < 1.0:
                angle -= pull * distance / len(places)
        return 0.5 * turn - angle, along

    low, high = 0.0, math.pi
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if from_disk_to_disk(middle)[0] > middle else (low, middle)
    return low, from_disk_to_disk(low)[1]


@lru_cache(maxsize=64)  # the same rod for every number of links that is tried
def _bent_rod(radius: float, turn: float) -> tuple[float, float]:
    """Return the pull T h^2 / EI that turns a rod between disks by `turn` [rad], and its chord over h.

    The pull is sought up to twice that on a tendon that keeps its distance.
    """
    low, high = 0.0, 2.0 * turn / (radius * math.cos(0.5 * turn))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _half_way(radius, turn, middle)[0] > 0.0 else (low, middle)
    return low, 2.0 * _half_way(radius, turn, low)[1]


def _half_way(radius: float, turn: float, pull: float) -> tuple[float, float]:
    """Return the rod's angle to the tendon half way between disks [rad], and how far along it is, over h."""

    def slopes(angle: float, distance: float) -> tuple[float, float, float]:
        return -pull * distance, math.sin(angle), math.cos(angle)

    angle, distance, along = 0.5 * turn, radius * math.cos(0.5 * turn), 0.0
    step = 0.5 / _STEPS
    for _ in range(_STEPS):  # Runge and Kutta's fourth order
        a = slopes(angle, distance)
        b = slopes(angle + 0.5 * step * a[0], distance + 0.5 * step * a[1])
        c = slopes(angle + 0.5 * step * b[0], distance + 0.5 * step * b[1])
        d = slopes(angle + step * c[0], distance + step * c[1])
        angle += step / 6.0 * (a[0] + 2.0 * (b[0] + c[0]) + d[0])
        distance += step / 6.0 * (a[1] + 2.0 * (b[1] + c[1]) + d[1])
        along += step / 6.0 * (a[2] + 2.0 * (b[2] + c[2]) + d[2])
    return angle, along


# ----------------------------------------------------------------------------------------------------
# What a continuum robot's file may leave out, as it follows from the rest: links of its chain, stiffness.

_LINKS = "links_per_subsegment"


def complete(robot: ContinuumRobot, given: Collection[str]) -> ContinuumRobot:
    """Return `robot` with enough links (`links.with_enough_links`) where the file's keys say none."""
    return robot if _LINKS in given else with_enough_links(robot)


def expanded(document: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return a file's document with what other keys stand for: a backbone's stiffness by its material."""
    return with_stiffness(document, where)
