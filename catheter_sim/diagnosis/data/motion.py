"""How the robot moved while data were taken, and what of a diagnosis depends on that."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from catheter_sim.core.posture import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import unknown
from catheter_sim.theory.predict import Prediction, moving_twin_for, twin_for


@dataclass(frozen=True)
class Motion:
    """What depends on whether rows were held.

    Attributes:
        name: as `[conditions] motion` of a `dataset.toml`.
        moving: whether the robot moved while it was measured, from rest under a trial's first row.
        twin: returns what fits go by: of a robot, its actuation, output columns and gravity.
    """

    name: str
    moving: bool
    twin: Callable[[RobotSpec, str, Sequence[str], Array], Prediction]


HELD = Motion("held", False, twin_for)
DYNAMIC = Motion("dynamic", True, moving_twin_for)
MOTIONS = {item.name: item for item in (HELD, DYNAMIC)}


def motion_named(name: object, where: str) -> Motion:
    """Return the motion of a name.

    Raises:
        InputError: there is none.
    """
    if not isinstance(name, str) or name not in MOTIONS:
        raise unknown("motion", str(name), MOTIONS, where)
    return MOTIONS[name]
