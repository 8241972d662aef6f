"""A force that came or went, told as a mass, where weight acts and the force points along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.report.result import Cause, FittedParameter

HOLDS_IF = (
    "grams are as right as the measured tensions, or as the stiffness in the robot's file; masses of several "
    "recordings can be compared without that"
)


@dataclass(frozen=True)
class Mass:
    """A force as a mass.

    Attributes:
        mass_g: added; below zero: taken away.
        sideways_N: the part of the force across the weight.
    """

    mass_g: FittedParameter
    sideways_N: float


def mass_of(change: Cause, gravity_mps2: Array) -> Mass | None:
    """Return the mass whose weight a change's force is; None where it is no weight.

    That is where no weight acts, the change is no force, or the force has a part across the weight that its
    interval does not leave open. The interval's half is the sum of the components' halves, each by its share
    in the weight's direction, so that it holds however they go together.

    Args:
        change: what changed.
        gravity_mps2: in the base frame, shape (3,).
    """
    strength = float(np.linalg.norm(gravity_mps2))
    given = [change.parameters.get(f"force_{axis}_N") for axis in "xyz"]
    if strength == 0.0 or all(item is None for item in given):
        return None
    down = gravity_mps2 / strength
    force = np.array([0.0 if item is None else item.value for item in given])
    half = np.array([0.0 if item is None else 0.5 * (item.ci95[1] - item.ci95[0]) for item in given])
    along = float(force @ down)
    across = force - along * down
    if (np.abs(across) > half + 1e-12 * strength).any():
        return None
    grams = 1e3 / strength
    reach = float(np.abs(down) @ half)
    mass = FittedParameter(grams * along, (grams * (along - reach), grams * (along + reach)), 0.0)
    return Mass(mass, float(np.linalg.norm(across)))
