"""The MuJoCo model of a catheter: its pieces (`mjcf.chain`), pairs, tubes, actuators and implant."""

from __future__ import annotations

from functools import partial

from catheter_sim.core.motion import IMPLICIT_SPRINGS, Integration
from catheter_sim.errors import InputError
from catheter_sim.kinds.catheter import picture
from catheter_sim.kinds.catheter.drives import ACTUATIONS
from catheter_sim.kinds.catheter.layout import base_heights_m
from catheter_sim.kinds.catheter.mjcf.chain import add_catheter, add_catheter_tendons
from catheter_sim.kinds.catheter.mjcf.drive import add_catheter_actuators
from catheter_sim.kinds.catheter.mjcf.implant import add_implant
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.parts import add_parts

_CLOSE_UP = 6.0  # rings of the first bending joint that the close-up shows, or outer radii


def add(root: Element, robot: CatheterRobot, actuation: str) -> None:
    """Add `robot` to the model `root`: pieces, what they show, pairs and tubes, actuators, implant.

    Raises:
        InputError: another actuation than displacement, or a bending joint without stiffness.
    """
    if actuation not in ACTUATIONS:
        raise InputError(f"{robot.name}: its pulleys are turned by a displacement; choices: displacement")
    bodies = add_catheter(root, robot)
    add_parts(root, bodies, picture.meshes(robot), partial(picture.parts, robot))
    add_catheter_tendons(root, robot)
    add_catheter_actuators(root, robot)
    add_implant(root, robot, bodies[-1])


def integration(robot: CatheterRobot, actuation: str) -> Integration:
    """Return how it is stepped in motion: pulleys and wires are stiff springs.

    A tube that passes through a joint, and a resistance that was measured, act by laws between two steps.
    There the joint itself may have no spring and, no mass being printed, no inertia: they are taken for as
    stiff as the scale of its damping. Without that the inertia of `mitral_transseptal@tube` is singular.
    """
    return Integration(IMPLICIT_SPRINGS, stiffening=1.0)


def length_m(robot: CatheterRobot) -> float:
    """Return the length of the straight robot, its tubes fully advanced [m]."""
    length = sum(segment.length_m for segment in robot.segments)
    return length + sum(segment.stroke_m for segment in robot.segments)


def close_up(robot: CatheterRobot) -> tuple[float, float]:
    """Return the height of the close-up's middle, and how much it shows of the first bending joint [m]."""
    for start, segment in zip(base_heights_m(robot), robot.segments, strict=False):
        if segment.joint == "bending":
            size = _CLOSE_UP * segment.length_m / segment.rings
            return start + 0.3 * size, size
    size = _CLOSE_UP * robot.segments[0].outer_radius_m
    return 0.45 * size, size


def remarks(robot: CatheterRobot) -> tuple[str, ...]:
    """Return what to say of the model: nothing."""
    return ()
