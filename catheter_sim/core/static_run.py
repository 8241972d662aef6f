"""What every static model returns: the postures, row by row, and the evidence that they balance.

And what all of them refuse in the same words.
"""

from __future__ import annotations

from dataclasses import dataclass

from catheter_sim.arrays import Array
from catheter_sim.core.drive import Quantity, quantity_of
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.errors import InputError


class NoEquilibrium(ArithmeticError):
    """No posture balances what acts; the caller knows the row and says so."""


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


def require_tensions(inputs: Inputs, model: str, instead: str = "") -> None:
    """Raise `InputError` where the inputs are displacements; `instead` says what takes these."""
    if quantity_of(inputs.actuation) is not Quantity.TENSION:
        raise InputError(f"static model {model!r}: takes tension inputs only{instead}")
