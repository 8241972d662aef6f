"""The bending tendons of the 4-DoF catheter under cyclic load (Nayar 2023, Fig. 3, Algorithm 1).

Ten cycles each to 1 to 6 mm of a 65 mm sample. Statics of the law, and the simulated tendon beside it.
The figure's ranges are not in the paper's text; what the text says of it is judged.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.robots.catheter.laws import StretchingTendon
from catheter_sim.robots.catheter.measured import PRINTED, tension_along
from catheter_sim.validation import mitral_plots
from catheter_sim.validation.lines import READ_BACK, Line, Validation

NAME = "mitral_4dof"
SAMPLE_M, CYCLES, STEPS = 65e-3, 10, 120
WAYS_MM = (1, 2, 3, 4, 5, 6)
SOURCE = "Nayar 2023, Section III-A, Fig. 3"


def cycles(way_mm: float) -> Array:
    """Return the strains of ten cycles from zero, `STEPS` each way, shape (20 STEPS + 1,)."""
    up = np.linspace(0.0, way_mm * 1e-3 / SAMPLE_M, STEPS + 1)
    return np.concatenate([up[:1], *CYCLES * (up[1:], up[-2::-1])])


def losses_J(strain: Array, tension_N: Array) -> Array:
    """Return the work that each cycle takes and does not give back, shape (10,) [J]."""
    work = np.diff(strain) * SAMPLE_M * 0.5 * (tension_N[1:] + tension_N[:-1])
    return np.asarray(work.reshape(CYCLES, -1).sum(axis=1), dtype=float)


def validate_elongation(folder: Path) -> Validation:
    """Check the cyclic law and the simulated tendon; writes `mitral_elongation.png`."""
    lines, shown = [], []
    apart = 0.0
    for way in WAYS_MM:
        strain = cycles(way)
        tension = tension_along(PRINTED, strain)
        loss = losses_J(strain, tension)
        tendon = StretchingTendon(SAMPLE_M, math.inf)
        simulated = np.array([tendon.at(SAMPLE_M * own).tension_N for own in strain])
        apart = max(apart, float(np.abs(np.maximum(simulated, 0.0) - tension).max()))
        what = f"tendon of 65 mm to {way} mm, ten cycles: "
        lines += [
            _shown(what + "loss of the tenth over the first", "-", float(loss[-1] / loss[0])),
            _shown(what + "largest tension", "N", float(tension.max())),
            _shown(what + "slack after the first", "mm", _slack_mm(strain, tension)),
        ]
        shown.append((f"{way} mm", strain * SAMPLE_M * 1e3, tension))
    what = "simulated tendon against Algorithm 1, all cycles: tension, largest"
    lines.append(Line(NAME, what, "N", apart, 1e-6, "Nayar 2023, Algorithm 1, printed parameters"))
    mitral_plots.elongations(shown, folder / "mitral_elongation.png")
    return Validation(tuple(lines), ())


def _shown(what: str, unit: str, ours: float) -> Line:
    return Line(NAME, what, unit, math.nan, None, SOURCE, ours=ours, kind=READ_BACK)


def _slack_mm(strain: Array, tension: Array) -> float:
    """Return at which elongation the first unloading left no tension [mm]."""
    first = slice(STEPS, 2 * STEPS + 1)
    return float(strain[first][tension[first] > 0.0].min()) * SAMPLE_M * 1e3
