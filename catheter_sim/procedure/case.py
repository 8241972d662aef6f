"""One patient for one robot, drawn at random: anatomy, planned way and flow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.errors import InputError, unknown
from catheter_sim.procedure.anatomy import RANGES, Anatomy, random_anatomy
from catheter_sim.procedure.flow import FLOW_N, Flow, random_flow
from catheter_sim.procedure.frames import DOWN
from catheter_sim.procedure.plan import Plan, plan_way
from catheter_sim.robots.catheter.description import is_four_dof
from catheter_sim.robots.catheter.spec import CatheterRobot

# Of the crossed design's outer sheath, which is led by hand: 10 deg about the roll that would do without its
# proximal joint, +y toward the valve. Assumed.
CROSSED_ROLL_RAD = (math.radians(80.0), math.radians(100.0))
_MOST_DRAWS = 20


@dataclass(frozen=True)
class Case:
    """What an episode of the delivery has around the robot.

    Attributes:
        plan: the way to the target; holds the anatomy.
        flow: the force of the flow.
    """

    plan: Plan
    flow: Flow


def ranges(robot: CatheterRobot) -> dict[str, tuple[float, float]]:
    """Return the ranges of the anatomies that `robot` meets, by name."""
    return RANGES | ({"roll_rad": CROSSED_ROLL_RAD} if is_four_dof(robot) else {})


def random_case(
    robot: CatheterRobot,
    rng: np.random.Generator,
    given: Mapping[str, float] | None = None,
    flow_N: tuple[float, float] = FLOW_N,
) -> Case:
    """Return a case; an anatomy in which there is no way is drawn again.

    Args:
        robot: the catheter, its limits and lengths.
        rng: the generator.
        given: numbers of the anatomy that are not drawn.
        flow_N: range of the force's amplitude.

    Raises:
        InputError: a robot of another design, an unknown name, a number outside its range, or no way in any
            of 20 anatomies.
    """
    bounds = ranges(robot)
    for name, value in (given or {}).items():
        _require(name, value, bounds)

    def one() -> Case:
        anatomy = replace(random_anatomy(rng, bounds), **(given or {}))
        return Case(plan_way(robot, anatomy), random_flow(rng, flow_N))

    for _ in range(_MOST_DRAWS - 1):
        with suppress(InputError):
            return one()
    return one()


def median_case(robot: CatheterRobot) -> Case:
    """Return the case in the middle of all ranges, its flow along the valve's axis.

    Raises:
        InputError: a robot of another design, or no way.
    """
    anatomy = Anatomy(**{name: 0.5 * (low + high) for name, (low, high) in ranges(robot).items()})
    return Case(plan_way(robot, anatomy), Flow(0.5 * sum(FLOW_N), DOWN, 0.0))


def _require(name: str, value: float, bounds: Mapping[str, tuple[float, float]]) -> None:
    if name not in bounds:
        raise unknown("number of the anatomy", name, bounds)
    low, high = bounds[name]
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise InputError(f"anatomy: {name} = {value!r}: must be a number in {low:g} to {high:g}")
