"""Forces on a robot's elements that the statics of rolling joints and the simulation both take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from catheter_sim.errors import InputError


@dataclass(frozen=True)
class LinkForce:
    """A force on one link, and a moment, that keep their directions in the base frame.

    Attributes:
        link: counted from 1 at the base.
        point_m: where it acts, in the link's frame (z on the axis, the flat top at z = the link's
            length), shape (3,); None: in the middle of its distal face.
        force_N: in the base frame, shape (3,).
        moment_Nm: the same, for the simulation; the statics of rolling joints take a moment at the tip only.
    """

    link: int
    point_m: tuple[float, float, float] | None
    force_N: tuple[float, float, float]
    moment_Nm: tuple[float, float, float] = (0.0, 0.0, 0.0)


def check_links(others: Sequence[LinkForce], links: int) -> None:
    """Raise `InputError` where one of `others` names a link that a robot of `links` links does not have."""
    for item in others:
        if not 1 <= item.link <= links:
            raise InputError(f"force on link {item.link}: the robot's links are 1 to {links}")
