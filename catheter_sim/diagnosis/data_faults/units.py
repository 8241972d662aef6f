"""Factors by which a column in a wrong unit is off."""

from __future__ import annotations

import math

from catheter_sim.core.drive import Quantity

METRES = 1e3
OUTPUT_FACTORS = {
    METRES: "m for mm",
    25.4: "inches for mm",
    10.0: "cm for mm",
    180.0 / math.pi: "rad for deg",
}


INPUT_FACTORS = {
    Quantity.TENSION: {
        1e-3: "mN for N",
        1e3: "kN for N",
        9.80665: "kgf for N",
        9.80665e-3: "gf for N",
        4.44822: "lbf for N",
    },
    Quantity.DISPLACEMENT: {1e-3: "um for mm", 1e3: "m for mm", 25.4: "inches for mm", 10.0: "cm for mm"},
}

# By what a number is too large where one unit was read as another: factor, as what it was read, what it is.
MISREAD = (
    (10.0, "cm", "mm"),
    (25.4, "in", "mm"),
    (180.0 / math.pi, "rad", "deg"),
    (360.0, "turn", "deg"),
    (1e3, "m", "mm"),
    (1e3, "mm", "um"),
    (4.44822, "lbf", "N"),
    (9.80665, "kgf", "N"),
    (1e3 / 9.80665, "N", "gf"),
    (1e3, "N", "mN"),
    (1e3, "kN", "N"),
)
