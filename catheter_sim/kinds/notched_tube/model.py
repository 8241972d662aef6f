"""The MuJoCo model of a notched tube: links on hinges (`mjcf.chain`), its tendon and the actuator."""

from __future__ import annotations

from functools import partial

from catheter_sim.core.motion import IMPLICIT_SPRINGS, Integration
from catheter_sim.kinds.notched_tube import layout, picture
from catheter_sim.kinds.notched_tube.mjcf.chain import add_chain, add_displacement_actuator, add_tendon
from catheter_sim.kinds.notched_tube.mjcf.pieces import tendon_width
from catheter_sim.kinds.notched_tube.spec import NotchedTubeRobot
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.parts import add_parts
from catheter_sim.mjcf.tendons import add_tension_actuators

_CLOSE_UP = 3.0  # notches that the close-up shows


def add(root: Element, robot: NotchedTubeRobot, actuation: str) -> None:
    """Add `robot` to the model `root`: links, what they show, the tendon, its actuator."""
    bodies = add_chain(root, robot)
    add_parts(root, bodies, picture.meshes(robot), partial(picture.parts, robot))
    add_tendon(root, robot, tendon_width(robot))
    if actuation == "tension":
        add_tension_actuators(root, robot)
    else:
        add_displacement_actuator(root, robot)


def integration(robot: NotchedTubeRobot, actuation: str) -> Integration:
    """Return how it is stepped in motion: laws change the notches' springs between steps."""
    return Integration(IMPLICIT_SPRINGS, 1.0)


def length_m(robot: NotchedTubeRobot) -> float:
    """Return the length of the straight tube from its lowest notch to its tip [m]."""
    return layout.length_m(robot)


def close_up(robot: NotchedTubeRobot) -> tuple[float, float]:
    """Return the height of the close-up's middle, and how much of the base it shows [m]."""
    size = min(_CLOSE_UP * layout.notches(robot)[0].pitch_m, length_m(robot))
    return 0.45 * size, size


def remarks(robot: NotchedTubeRobot) -> tuple[str, ...]:
    """Return what to say of the model: nothing."""
    return ()
