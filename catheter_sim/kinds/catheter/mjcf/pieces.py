"""The rigid pieces of a catheter's model."""

from __future__ import annotations

from dataclasses import dataclass

from catheter_sim.kinds.catheter.layout import elements, hinge_heights_m
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.mjcf.names import link


@dataclass(frozen=True)
class Piece:
    """What one body of the model stands for.

    Attributes:
        name: the body's.
        segment: index of its segment.
        element: number of its element, from 1; 0 for what lies beyond a bending segment's last gap.
        gap: number of the gap below it, from 1; 0 where its segment does not bend.
        origin_m: height of the body's origin above its segment's base end at rest: of the hinge in the
            gap below it, or 0 [m].
    """

    name: str
    segment: int
    element: int
    gap: int
    origin_m: float


def pieces(robot: CatheterRobot) -> list[Piece]:
    """Return the bodies of the robot's model, base to tip."""
    result: list[Piece] = []
    parts = list(enumerate(elements(robot), 1))
    for index, segment in enumerate(robot.segments):
        numbers = [number for number, part in parts if part.segment == index]
        if segment.joint != "bending":
            result.append(Piece(link(numbers[0]), index, numbers[0], 0, 0.0))
            continue
        heights = [float(height) for height in hinge_heights_m(segment)]
        for gap, number in enumerate(numbers, 1):
            result.append(Piece(link(number), index, number, gap, heights[gap - 1]))
        result.append(Piece(f"end_{segment.name}", index, 0, len(heights), heights[-1]))
    return result
