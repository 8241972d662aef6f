"""The steps of the procedure as places to go to, and the displacements that take the joints there.

Nayar 2022, Section IV-E: introduce, align, bend, advance under the leaflets, orient, manipulate the implant.
Where the straight robot is too long for the atrium, it is pushed on while it bends. The implant opens
under the leaflets, is drawn back until they lie on its arms, and closes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.procedure.plan import Plan
from catheter_sim.robots.catheter.description import joint_stiffness, moved_segment, moving
from catheter_sim.robots.catheter.kinematics import largest_angle_rad, pulled_m
from catheter_sim.robots.catheter.spec import CatheterRobot

# Speeds, slow against the robot's relaxation; assumed.
PUSH_M_PER_S = 20e-3
TURN_RAD_PER_S = math.radians(30.0)
OPENING_S = 1.0  # of the implant
HOLD_S = 0.4  # after every motion


@dataclass(frozen=True)
class Step:
    """Where a step of the procedure ends.

    Attributes:
        name: of the step.
        insertion_m: of the robot's base beyond the puncture.
        q: joint values, base to tip, shape (4,) [rad, m].
        opening: of the implant, 0 closed, 1 open.
    """

    name: str
    insertion_m: float
    q: Array
    opening: float


def steps(plan: Plan) -> tuple[Step, ...]:
    """Return the steps, from the straight robot in the atrium to the closed implant."""
    proximal, bend, advance, distal = plan.q
    deep = advance + plan.below_m

    def q(*values: float) -> Array:
        return np.array(values, dtype=float)

    inside = plan.insertion_m
    return (
        Step("insert", plan.straight_m, q(0, 0, 0, 0), 0.0),
        Step("align", plan.straight_m, q(proximal, 0, 0, 0), 0.0),
        Step("bend", inside, q(proximal, bend, 0, 0), 0.0),
        Step("advance", inside, q(proximal, bend, deep, 0), 0.0),
        Step("orient", inside, q(proximal, bend, deep, distal), 0.0),
        Step("open", inside, q(proximal, bend, deep, distal), 1.0),
        Step("clip", inside, q(proximal, bend, advance, distal), 1.0),
        Step("close", inside, q(proximal, bend, advance, distal), 0.0),
    )


def duration_s(robot: CatheterRobot, before: Step, after: Step) -> float:
    """Return how long the motion between two places takes at the stated speeds [s]."""
    needed = [abs(after.insertion_m - before.insertion_m) / PUSH_M_PER_S]
    needed.append(abs(after.opening - before.opening) * OPENING_S)
    for index, way in zip(moving(robot), np.abs(after.q - before.q), strict=True):
        slides = robot.segments[index].joint == "prismatic"
        needed.append(float(way) / (PUSH_M_PER_S if slides else TURN_RAD_PER_S))
    return max(needed)


def between(before: Step, after: Step, share: float) -> Step:
    """Return the place at this share of the straight way between two, named after the second."""
    return Step(
        after.name,
        before.insertion_m + share * (after.insertion_m - before.insertion_m),
        before.q + share * (after.q - before.q),
        before.opening + share * (after.opening - before.opening),
    )


def displacements_m(robot: CatheterRobot, q: Array, way: Array) -> Array:
    """Return what moves the joints to q, in the order of the pairs, shape (p,) [m].

    Pure kinematics (Nayar 2022, Eqs 3, 6), and what the robot is taken to lose on top of it: slack, the
    stretch under the joint's elastic moment, half of the drive's play in the direction of motion. Not
    friction.

    Args:
        robot: the catheter.
        q: joint values, base to tip, shape (4,) [rad, m].
        way: direction in which each joint moves, +1, -1 or 0, shape (4,).
    """
    order = moving(robot)
    result = []
    for number, pair in enumerate(robot.tendons):
        index = moved_segment(robot, number)
        segment, place = robot.segments[index], order.index(index)
        value = float(q[place])
        play = 0.5 * pair.play_m * float(way[place])
        if segment.joint == "prismatic":
            result.append(value + play)
            continue
        most = largest_angle_rad(segment)
        value = min(max(value, -most), most)
        lost = play + math.copysign(pair.slack_m, value) * float(abs(value) > 1e-9)
        if segment.joint == "bending" and math.isfinite(pair.stiffness_N_per_m):
            lost += joint_stiffness(robot, segment) * value / (segment.arm_m * pair.stiffness_N_per_m)
        result.append(float(pulled_m(segment, value)) + lost)
    return np.array(result)
