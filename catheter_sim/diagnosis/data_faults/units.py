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
