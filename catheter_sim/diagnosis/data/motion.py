"""How the robot moved while data were taken."""

from __future__ import annotations

from dataclasses import dataclass

from catheter_sim.errors import shown, unknown


@dataclass(frozen=True)
class Motion:
    """Whether rows were held.

    Attributes:
        name: as `[conditions] motion` of a `dataset.toml`.
        moving: whether the robot moved while it was measured, from rest under a trial's first row; otherwise
            each row was held until it rested.
    """

    name: str
    moving: bool


HELD = Motion("held", False)
DYNAMIC = Motion("dynamic", True)
MOTIONS = {item.name: item for item in (HELD, DYNAMIC)}


def motion_named(name: object, where: str) -> Motion:
    """Return the motion of a name; raise `InputError` where there is none."""
    if not isinstance(name, str):
        raise unknown("motion", shown(name), MOTIONS, where)
    if name not in MOTIONS:
        raise unknown("motion", name, MOTIONS, where)
    return MOTIONS[name]
