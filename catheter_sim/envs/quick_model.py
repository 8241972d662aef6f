"""The quick model of any robot that environments drive, as its kind gives it (`steering.py`)."""

from __future__ import annotations

from catheter_sim.arrays import Array
from catheter_sim.channels import actuations
from catheter_sim.core.quick_model import QuickModel
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import unknown
from catheter_sim.robots import face_of


def quick_model(robot: RobotSpec, actuation: str, largest_bend_rad: float | None = None) -> QuickModel:
    """Return the quick model of `robot`.

    Args:
        robot: the robot; its `effects` are not read.
        actuation: "tension" or "displacement".
        largest_bend_rad: what one drive alone may ask of a segment, without friction; default
            `core.quick_model.LARGEST_BEND_RAD`. None of a robot whose joints have limits of their own.

    Raises:
        InputError: no environment drives robots of this kind, the robot knows no such actuation, it has
            tendons that bend nothing, or a largest bend does not apply to it.
    """
    if actuation not in actuations(robot):
        raise unknown("action_type", actuation, actuations(robot))
    face = face_of(robot, "steering", "environment")
    model: QuickModel = face.quick_model(robot, actuation, largest_bend_rad)
    return model


def input_range(robot: RobotSpec) -> tuple[Array, Array]:
    """Return the least and largest input of each tendon that the simulation takes, each of shape (t,)."""
    low, high = face_of(robot, "steering", "environment").input_range(robot)
    return low, high
