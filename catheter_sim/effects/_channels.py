"""Per-channel parameters: a common value first, then one for each input channel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import channel_gains, channel_of
from catheter_sim.core.drive import Quantity, quantity_of
from catheter_sim.core.effect import Parameter, Values
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects._places import sizes

TO_SI = {"N": 1.0, "mm": 1e-3}


def channels(robot: RobotSpec) -> list[str]:
    """Return the robot's actuator channels, each once."""
    return list(dict.fromkeys(channel_of(robot)))


def common_and_each(robot: RobotSpec, common: Parameter, each: str) -> tuple[Parameter, ...]:
    """Return the common parameter, and for several channels the same named by `each` (with `{}`)."""
    return _common_and_each(tuple(channels(robot)), common, each)


@lru_cache(maxsize=256)  # a diagnosis asks for the same of every robot
def _common_and_each(names: tuple[str, ...], common: Parameter, each: str) -> tuple[Parameter, ...]:
    if len(names) == 1:
        return (common,)
    return (common, *(replace(common, name=each.format(name)) for name in names))


def common_then_each(robot: RobotSpec, common: str, each: str) -> tuple[tuple[str, ...], ...]:
    """Return the variants: the common parameter alone, or one for each channel."""
    names = channels(robot)
    if len(names) == 1:
        return ((common,),)
    return ((common,), tuple(each.format(name) for name in names))


def per_tendon(robot: RobotSpec, each: str, values: Values, null: float) -> Array:
    """Return each tendon's own channel value, `null` where none is given, shape (t,)."""
    return np.array([values.get(each.format(name), null) for name in channel_of(robot)])


def actuation_unit(robot: RobotSpec) -> float:
    """Return 1 mm, or the tension that bends the robot by a radian [N], to one digit: what drives it."""
    return float(f"{sizes(robot).tension_N:.1g}") if _tensioned(robot) else 1.0


def _tensioned(robot: RobotSpec) -> bool:
    return quantity_of(robot.actuation) is Quantity.TENSION


def scale_of(robot: RobotSpec) -> str:
    """Return the unit in files of the robot's actuator inputs."""
    return quantity_of(robot.actuation).file_unit


def sized_parameter(robot: RobotSpec, name: str, size: Mapping[str, tuple[float, float]]) -> Parameter:
    """Return a parameter that does nothing at zero, with bounds on both sides of it.

    Args:
        robot: of which the unit is, and the tension that bends it.
        name: of the parameter.
        size: by unit in files, its bound and a change that matters: in mm, or in tensions that bend the
            robot by a radian.

    A fit starts a little below zero where tensions drive the robot. There only the rows say something in
    which a tendon is pulled; at zero, every row at rest speaks for whoever adds nothing, since it cannot
    show that the zero is too low: a tendon cannot push.
    """
    unit = scale_of(robot)
    bound, scale = (round(value * actuation_unit(robot), 9) for value in size[unit])
    start = -scale if unit == "N" else 0.0
    return Parameter(name, null=0.0, lower=-bound, upper=bound, scale=scale, start=start)


def in_si(robot: RobotSpec, names: tuple[str, str], values: Values) -> Array:
    """Return each tendon's value, the common one and its channel's own added up, SI, shape (t,).

    It is as the channel's gain hands it on: a tendon that its channel lets out gets it with the other sign.

    Args:
        robot: in whose actuator inputs' unit the values are.
        names: of the common parameter, and of each channel's (with `{}`).
        values: of the parameters; what is not given is zero.
    """
    common, each = names
    own = (values.get(common, 0.0) + per_tendon(robot, each, values, 0.0)) * TO_SI[scale_of(robot)]
    return np.asarray(own * channel_gains(robot))
