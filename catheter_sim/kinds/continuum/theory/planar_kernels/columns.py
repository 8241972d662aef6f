"""How planar robots are handed to the compiled loops, and the numbers that `sliding` shares with them."""

from __future__ import annotations

# Columns of `cell`, shape (n, 6), units as in `PlanarChain`.
LENGTH, STIFFNESS, CUBIC, QUINTIC, REST, LARGEST = range(6)

# From no slip to full slip the robot beyond an eyelet bends by this much. Against a third of it the
# tip moves by 4 um in tendon-driven loops, by 0.02 mm where a tip force turns the motion back.
PRE_SLIDING_RAD = 1e-4
MOST_CREEP_STEPS = 200
NO_DRAG, MOST_DRAG = 1e-4, 1e4  # of a cell's stiffness
