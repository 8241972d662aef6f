"""Forces on a robot's elements that the statics of rolling joints and the simulation both take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
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


def with_tip_weight(inputs: Inputs, tip_mass_kg: float, gravity_mps2: Array) -> Inputs:
    """Return `inputs` with the weight of a mass at the tip added to the force there.

    For static models and twins; the simulation's model holds the mass itself.
    """
    if tip_mass_kg == 0.0:
        return inputs
    return replace(inputs, force_tip=inputs.force_tip + tip_mass_kg * gravity_mps2)
