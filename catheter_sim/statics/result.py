"""What every static model returns: the postures, row by row, and the evidence that they balance."""

from __future__ import annotations

from dataclasses import dataclass

from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.posture import Array, Posture


@dataclass(frozen=True)
class StaticRun:
    """Postures of one static model along a history of inputs.

    Attributes:
        model: name of the static model.
        inputs: the inputs that it was given.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        postures: one per row of the inputs.
        residual: largest unbalanced moment at any element, per row, shape (r,) [N m]; of `pk`, what its
            angles miss of the displacements [m].
    """

    model: str
    inputs: Inputs
    gravity_mps2: Array
    postures: tuple[Posture, ...]
    residual: Array
