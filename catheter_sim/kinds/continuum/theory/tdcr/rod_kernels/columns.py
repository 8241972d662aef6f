"""How a rod is handed to the compiled loops, and the names of tendon paths."""

from __future__ import annotations

# Columns of `rod`, the sections' data: six compliances, then the length and the number of steps.
LENGTH, STEPS = 6, 7
CONTINUOUS, PROJECTED, EYELETS, LUMENS = range(4)  # tendon paths
