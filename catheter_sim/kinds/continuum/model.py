"""The MuJoCo model of a continuum robot: a chain of links (`mjcf.chain`), its tendons and their actuators."""

from __future__ import annotations

import math
from functools import partial

from catheter_sim.core.motion import IMPLICIT_SPRINGS, Integration, of_springs_and_masses
from catheter_sim.kinds.continuum import picture
from catheter_sim.kinds.continuum.layout import disks, links
from catheter_sim.kinds.continuum.links import BEND_RAD, tip_error_m
from catheter_sim.kinds.continuum.mjcf.chain import add_chain, add_displacement_actuators, add_tendons
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.parts import add_parts
from catheter_sim.mjcf.tendons import add_tension_actuators

_CLOSE_UP = 6.0  # cells that the close-up shows


def add(root: Element, robot: ContinuumRobot, actuation: str) -> None:
    """Add `robot` to the model `root`: links, what they show, tendons, actuators."""
    bodies = add_chain(root, robot)
    add_parts(root, bodies, picture.meshes(robot), partial(picture.parts, robot))
    add_tendons(root, robot)
    if actuation == "tension":
        add_tension_actuators(root, robot)
    else:
        add_displacement_actuators(root, robot)


def integration(robot: ContinuumRobot, actuation: str) -> Integration:
    """Return how it is stepped in motion: tendons that are driven are stiff springs, and so may a law be."""
    law = any(segment.stiffness_cubic_m2 or segment.stiffness_quintic_m4 for segment in robot.segments)
    stiff = actuation != "tension" or law
    return Integration(IMPLICIT_SPRINGS) if stiff else of_springs_and_masses(robot)


def length_m(robot: ContinuumRobot) -> float:
    """Return the length of the straight robot [m]."""
    return sum(segment.length_m for segment in robot.segments)


def close_up(robot: ContinuumRobot) -> tuple[float, float]:
    """Return the height of the close-up's middle, and how much of the base it shows [m]."""
    size = _CLOSE_UP * robot.segments[0].length_m / disks(robot, robot.segments[0])
    return 0.45 * size, size


def remarks(robot: ContinuumRobot) -> tuple[str, ...]:
    """Return how well the chain of links stands for a rod."""
    error_m, by = tip_error_m(robot), "its tendons" if robot.tendons else "a moment"
    if not error_m > 0.0:
        return ()
    return (
        f"links: {robot.links_per_subsegment} per subsegment, {len(links(robot))} in all; with every segment "
        f"bent by {math.degrees(BEND_RAD):.0f} deg by {by} alone the tip is {error_m * 1e3:.2g} mm "
        f"({100.0 * error_m / length_m(robot):.1g} % of the length) off a rod's",
    )
