"""The balance of one cell under the tensions that an eyelet lets through to it, compiled."""

from __future__ import annotations

import math

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.planar_kernels.columns import LARGEST, LENGTH, REST, STIFFNESS
from catheter_sim.kinds.continuum.theory.planar_kernels.elastic import hardening
from catheter_sim.mechanics.compiled import compiled

_MOST_BISECTIONS = 60


@compiled
def _behind(
    right: float, left: float, kept_right: float, kept_left: float, a: float, b: float, capstan: float
) -> tuple[float, float]:
    """Return the tensions behind an eyelet: `slip.tensions_behind` for two tendons with arms a and b."""
    low_right, high_right = right / capstan, right * capstan
    low_left, high_left = left / capstan, left * capstan
    if low_right <= kept_right <= high_right and low_left <= kept_left <= high_left:
        return kept_right, kept_left
    moment = a * kept_right - b * kept_left
    if moment <= a * low_right - b * high_left:
        return low_right, high_left
    if moment >= a * high_right - b * low_left:
        return high_right, low_left
    # Sticking: on the line of this moment, as near to the kept tensions as both intervals allow.
    lowest = max(low_right, (moment + b * low_left) / a)
    highest = min(high_right, (moment + b * high_left) / a)
    stuck = min(max(kept_right, lowest), max(highest, lowest))
    return stuck, (a * stuck - moment) / b


@compiled
def excess(
    cell: Array,
    k: int,
    a: float,
    b: float,
    half_mu: float,
    right: float,
    left: float,
    kept_right: float,
    kept_left: float,
    angle_before: float,
    load: float,
    angle: float,
) -> tuple[float, float, float]:
    """Return by how much what acts on cell k outweighs its elastic moment [N m], and its tensions [N]."""
    capstan = math.exp(half_mu * abs(angle_before + angle))
    right, left = _behind(right, left, kept_right, kept_left, a, b, capstan)
    half = 0.5 * angle
    bent = angle / cell[k, LENGTH] - cell[k, REST]
    acting = (a * right - b * left) * math.cos(half) + 0.5 * cell[k, LENGTH] * (right + left) * math.sin(half)
    return acting + load - cell[k, STIFFNESS] * bent * hardening(cell, k, bent), right, left


@compiled
def bisected(
    cell: Array,
    k: int,
    a: float,
    b: float,
    half_mu: float,
    right: float,
    left: float,
    kept_right: float,
    kept_left: float,
    angle_before: float,
    load: float,
) -> tuple[float, float, float]:
    """Return the angle at which cell k balances, NaN where none does, and its tensions."""
    high = cell[k, LARGEST] * (1.0 - 1e-9)
    low = angle = -high
    for trial in range(_MOST_BISECTIONS):
        value, out_right, out_left = excess(
            cell, k, a, b, half_mu, right, left, kept_right, kept_left, angle_before, load, angle
        )
        if trial < 2 and not (value > 0.0 if trial == 0 else value < 0.0):
            return math.nan, out_right, out_left
        if value > 0.0:
            low = angle
        else:
            high = angle
        angle = high if trial == 0 else 0.5 * (low + high)
    return angle, out_right, out_left
