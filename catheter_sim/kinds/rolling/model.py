"""The MuJoCo model of a robot of rolling joints: a chain of hinges (`mjcf.chain`), its rods and actuators."""

from __future__ import annotations

from functools import partial

from catheter_sim.core.motion import IMPLICIT_SPRINGS, Integration
from catheter_sim.errors import InputError
from catheter_sim.kinds.rolling import picture
from catheter_sim.kinds.rolling.drives import ACTUATIONS
from catheter_sim.kinds.rolling.mjcf.chain import add_rods, add_rolling_chain
from catheter_sim.kinds.rolling.spec import RollingRobot
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.parts import add_parts
from catheter_sim.mjcf.tendons import add_tension_actuators

_STIFFER = 10.0  # than unbent: a joint whose gap nearly closes, by the table of its rods' lengths
_CLOSE_UP = 2.5  # joints that the close-up shows


def add(root: Element, robot: RollingRobot, actuation: str) -> None:
    """Add `robot` to the model `root`: links, what they show, rods, actuators.

    Raises:
        InputError: another actuation than tension.
    """
    if actuation not in ACTUATIONS:
        raise InputError(f"{robot.name}: its rods are pulled by tension; choices: tension")
    bodies = add_rolling_chain(root, robot)
    add_parts(root, bodies, picture.meshes(robot), partial(picture.parts, robot))
    add_rods(root, robot)
    add_tension_actuators(root, robot)


def integration(robot: RollingRobot, actuation: str) -> Integration:
    """Return how it is stepped in motion: rods resist beside the step, up to `_STIFFER` times as unbent."""
    return Integration(IMPLICIT_SPRINGS, _STIFFER, own_springs=False)


def length_m(robot: RollingRobot) -> float:
    """Return the length of the straight robot [m]."""
    return sum(segment.length_m for segment in robot.segments)


def close_up(robot: RollingRobot) -> tuple[float, float]:
    """Return the height of the close-up's middle, and how much of the base it shows [m]."""
    size = _CLOSE_UP * robot.segments[0].length_m / robot.segments[0].joints
    return 0.45 * size, size


def remarks(robot: RollingRobot) -> tuple[str, ...]:
    """Return what to say of the model: nothing."""
    return ()
