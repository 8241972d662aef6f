"""The friction that the published distances in arching leave to a model of the neuroendoscope (Kato 2016).

With the measured tip at the mean distance p from the constant-curvature assumption's and f from the
mapping's, the two models lie |p - f| to p + f from each other (triangle inequality, which holds for the
means of the trials too), and that distance is a function of mu alone. It is the mu that the authors put into
their mapping.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.robots.continuum.kato import (
    _MU_GRID,
    _antagonistic,
    _crossings,
    _single,
    _Solve,
    _tips,
    pcca,
)

_ROUNDING_M = 0.05e-3  # the figures are printed to 0.1 mm


@dataclass(frozen=True)
class ArchingDistance:
    """Published mean distances of the measured tip in arching from two models' tips.

    Attributes:
        arching: (right, left) tensions up to where the tips are compared [N].
        to_constant_curvature_m: measured to PCCA [m].
        to_mapping_least_m, to_mapping_most_m: measured to the extended FKM, what is printed of it [m].
        source: where it is printed.
    """

    arching: tuple[tuple[float, float], ...]
    to_constant_curvature_m: float
    to_mapping_least_m: float
    to_mapping_most_m: float
    source: str


ARCHING_DISTANCES = (
    ArchingDistance(
        _single(0.0, 0.1, 0.2), 5.1e-3, 0.0, 2.9e-3, "Kato 2016, Results: 5.1 mm; FKM at most 2.9"
    ),
    ArchingDistance(
        _single(0.0, 0.1, 0.2, 0.3, 0.4), 5.9e-3, 0.0, 2.9e-3, "Kato 2016, Results: 5.9 mm; FKM at most 2.9"
    ),
    ArchingDistance(
        _antagonistic(0.12, 0.24, 0.36, 0.48),
        10.1e-3,
        10.1e-3 * (1.0 - 0.81),
        10.1e-3 * (1.0 - 0.81),
        "Kato 2016, Results: 10.1 mm, improved by 81 %",
    ),
    ArchingDistance(
        _antagonistic(0.12, 0.24, 0.36, 0.48, 0.65),
        14.6e-3,
        5.5e-3,
        5.5e-3,
        "Kato 2016, Results: 14.6 and 5.5 mm",
    ),
)


def friction_from_arching(
    solve: _Solve, distances: tuple[ArchingDistance, ...] = ARCHING_DISTANCES
) -> tuple[float, float]:
    """Return the interval of mu that the published distances in arching leave to a model.

    The interval is empty (low > high) where they contradict the model.
    """
    low, high = 0.0, float("inf")
    for item in distances:
        p, f_least, f_most = item.to_constant_curvature_m, item.to_mapping_least_m, item.to_mapping_most_m
        least = max(p - f_most - 2.0 * _ROUNDING_M, f_least - p - 2.0 * _ROUNDING_M, 0.0)
        most = p + f_most + 2.0 * _ROUNDING_M

        def apart(mu: float, rows: tuple[tuple[float, float], ...] = item.arching) -> float:
            tips = _tips(solve, rows, mu)[-1], _tips(pcca, rows, 0.0)[-1]
            return float(np.linalg.norm(tips[0] - tips[1]))

        # The distance grows with mu once friction outweighs the models' other differences.
        lower = _crossings(apart, least, _MU_GRID)
        upper = _crossings(apart, most, _MU_GRID)
        low = max(low, lower[-1]) if lower else low
        high = min(high, upper[-1]) if upper else high
    return low, high
