"""Which causes say the same as a number of a robot that is calibrated already."""

from __future__ import annotations

from collections.abc import Iterable

from catheter_sim.channels import actuations
from catheter_sim.core.drive import driven_by
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects import EFFECTS
from catheter_sim.robots import kind_of


def causes_same_as(robot: RobotSpec, keys: Iterable[str]) -> tuple[str, ...]:
    """Return the causes that act on one of the numbers at dotted keys as its calibration does."""
    wanted = set(keys)
    face = kind_of(robot).handles
    driven = (driven_by(robot, actuation) for actuation in actuations(robot))
    roles = {item.role for one in driven for item in face.handles(one) if item.key in wanted}
    return tuple(name for name, effect in EFFECTS.items() if effect.same_as & roles)
