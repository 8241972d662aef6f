"""The workspace in which sections are integrated: one slot after another, each an eight (`mechanics.eight`).

The eight are eight sections of one robot, or one section of eight robots.
"""

from __future__ import annotations

from typing import Any

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled

# Slots of the workspace, eights. A state is a quaternion (4), a position (3), then the
# pose's derivatives by the wrench: turn in the body's frame (3, 6), shift in the start's frame (3, 6).
STATE, TRIAL, TOTAL, RATE, SIZE = 0, 43, 86, 129, 43
TURN, WRENCH, BODY, STRAIN = 172, 181, 187, 193  # orientation (3, 3) of the trial, then six each
COLUMNS = 199  # derivative of the body's wrench, then of its strain, (6, 6)
COMPLIANCE, STIFFNESS, INVERSE = 235, 241, 247  # six, six and (6, 6)
STEP = 283
LOW, LOW_SLOPE = 284, 290  # tendons' pull on the lower disk, (6,), and its derivative, (6, 6)
SPAN = 326  # a tendon's direction (3) and length, its reverse in the upper disk's frame (3)
TENDONS = 333  # three slots for each tendon: tension, and what of it acts along the lower, upper disk's axis


@compiled
def three(w: Array, slot: int) -> tuple[Any, Any, Any]:
    """Return three slots in a row."""
    return w[slot], w[slot + 1], w[slot + 2]


@compiled
def column(w: Array, slot: int) -> tuple[Any, Any, Any]:
    """Return three numbers of a column of a matrix with rows of six."""
    return w[slot], w[slot + 6], w[slot + 12]
