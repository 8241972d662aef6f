"""Shared by the simulation's tests: inputs from plain rows, tips from runs."""

from __future__ import annotations

import numpy as np

from catheter_sim.core.inputs import Inputs

SINGLE = [(t, 0.0) for t in (0.1, 0.2, 0.3, 0.4, 0.3, 0.2, 0.1, 0.0)]
ANTAGONISTIC = [(t, 0.12) for t in (0.12, 0.24, 0.36, 0.48, 0.65, 0.48, 0.36, 0.24, 0.12)]
PARTIAL = [(t, 0.12) for t in (0.12, 0.5, 0.25, 0.4, 0.3, 0.45, 0.12)]


def rows_to_inputs(rows, actuation="tension", force=None):
    """Return inputs with one second between rows; `force` on the tip, shape (r, 3) [N]."""
    tendon = np.array(rows, dtype=float)
    nothing = np.zeros((len(tendon), 3))
    pushes = nothing if force is None else np.array(force, dtype=float)
    return Inputs(np.arange(len(tendon), dtype=float), actuation, tendon, pushes, nothing)


def tips_mm(run):
    """Return the tips of a run, shape (r, 3) [mm]."""
    return np.array([posture.p_w[-1] * 1e3 for posture in run.postures])


def loop_area(x, y):
    """Return the area inside the closed curve through the points (shoelace formula)."""
    return 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1)))
