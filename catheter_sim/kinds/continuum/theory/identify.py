"""Which friction coefficient do the published figures of the neuroendoscope hold?

Kato 2016 (doi 10.1007/s11548-015-1310-2) prints no value of mu. Two kinds of printed figures hold it:

- **Loop openings**: the mean distance of the tips in arching and extending at the same tension,
  9.8 mm at 0.4 N with a single tendon and 13.2 mm at (0.12, 0.48) N with an antagonistic pair.
  Extending started from "maximum bending of the robot", whose tension is not printed, and the
  opening hangs on it. It also has a maximum over mu, since a robot with much friction bends less: for
  one maximum tension an opening fits two values of mu, or none. **Assumed here: full reversal**, a
  start so far bent that back at the loop's tension the whole tendon runs out; the opening then no
  longer hangs on where it started.
- **Distances in arching** between measurement, mapping and the constant-curvature assumption. They
  need no maximum tension: with the measured tip at the mean distance p from the assumption's and f
  from the mapping's, the two models lie |p - f| to p + f from each other (triangle inequality, which
  holds for the means of the trials too), and that distance is a function of mu alone. It is the mu
  that the authors put into their mapping.

What comes out. With full reversal the first opening gives mu = 0.143 (`fkm`, `fkm_stick`) or 0.128
(`fkm_exact_arm`), and the second comes out as 13.3 or 13.5 mm against the published 13.2. The
distances in arching leave 0.26 to 0.34 to `fkm`, and with such a mu both openings need a start from
less bending, 0.56 N and 0.70 N. The openings fit either way. Fig. 13 does not: its distance between mapping
and constant curvature falls at the turn and peaks again at 0.3 N, which it does with the friction of the
arching distances and not with that of full reversal (`validation/neuroendoscope_figures.py`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.core.static_run import StaticRun
from catheter_sim.kinds.continuum.robots.neuroendoscope import neuroendoscope_section
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.kinds.continuum.theory.kato import pcca

_Solve = Callable[[ContinuumRobot, Inputs, Array], StaticRun]

FULL_REVERSAL_N = 1.5  # assumed start of extending; at mu up to 0.2 any above 1 N gives the same opening
_MU_GRID = np.linspace(0.0, 1.0, 26)
_TENSION_GRID_N = np.linspace(0.0, 0.6, 13)  # beyond the loop's own tension
_ROUNDING_M = 0.05e-3  # the figures are printed to 0.1 mm
_SAME_OPENING_M = 2e-5  # a root of a jump misses its value by more


@dataclass(frozen=True)
class Loop:
    """A published opening between arching and extending.

    Attributes:
        opening_m: mean distance of the tips [m].
        arching: (right, left) tensions up to where the tips are compared, shape (r, 2) [N].
        source: where it is printed.
    """

    opening_m: float
    arching: tuple[tuple[float, float], ...]
    source: str


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


@dataclass(frozen=True)
class Identification:
    """A friction coefficient from the single tendon's loop, and its check on the antagonistic one.

    Attributes:
        highest_N: tension from which extending is assumed to start, in both loops.
        mu: the coefficients that give the single tendon's opening; more than one where it is not unique.
        antagonistic_opening_m: what each of them gives for the antagonistic opening.
    """

    highest_N: float
    mu: tuple[float, ...]
    antagonistic_opening_m: tuple[float, ...]


def _single(*tensions: float) -> tuple[tuple[float, float], ...]:
    return tuple((tension, 0.0) for tension in tensions)


def _antagonistic(*tensions: float) -> tuple[tuple[float, float], ...]:
    return tuple((tension, 0.12) for tension in tensions)


SINGLE_LOOP = Loop(9.8e-3, _single(0.0, 0.1, 0.2, 0.3, 0.4), "Kato 2016, Results: 9.8 mm at 0.4 N")
ANTAGONISTIC_LOOP = Loop(
    13.2e-3, _antagonistic(0.12, 0.24, 0.36, 0.48), "Kato 2016, Results: 13.2 mm at (0.12, 0.48) N"
)

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


def identify(solve: _Solve, highest_N: float = FULL_REVERSAL_N) -> Identification:
    """Return the friction that the single tendon's opening gives a model, checked on the other opening."""
    found = friction_from_opening(solve, SINGLE_LOOP, highest_N)
    checks = tuple(loop_opening(solve, ANTAGONISTIC_LOOP, mu, highest_N) for mu in found)
    return Identification(highest_N, found, checks)


def loop_opening(solve: _Solve, loop: Loop, mu: float, highest_N: float) -> float:
    """Return the distance of a model's tips in arching and extending [m].

    Args:
        solve: a static model of `neuroendoscope_section`.
        loop: which tensions.
        mu: friction coefficient.
        highest_N: right tendon's tension from which extending starts.
    """
    right, left = loop.arching[-1]
    rows = (*loop.arching, (highest_N, left), (right, left))
    tips = _tips(solve, rows, mu)
    return float(np.linalg.norm(tips[-1] - tips[len(loop.arching) - 1]))


def friction_from_opening(solve: _Solve, loop: Loop, highest_N: float) -> tuple[float, ...]:
    """Return the values of mu in 0 to 1 that give the loop's published opening; often two, or none."""
    return _crossings(lambda mu: loop_opening(solve, loop, mu, highest_N), loop.opening_m, _MU_GRID)


def highest_tension_from_opening(solve: _Solve, loop: Loop, mu: float) -> tuple[float, ...]:
    """Return the tensions [N] from which extending must start to give the loop's published opening."""
    grid = loop.arching[-1][0] + _TENSION_GRID_N
    return _crossings(lambda tension: loop_opening(solve, loop, mu, tension), loop.opening_m, grid)


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


def _tips(solve: _Solve, rows: tuple[tuple[float, float], ...], mu: float) -> Array:
    robot = replace(neuroendoscope_section(), friction=Friction(mu))
    count = len(rows)
    inputs = Inputs(
        np.arange(count, dtype=float), "tension", np.array(rows), np.zeros((count, 3)), np.zeros((count, 3))
    )
    return np.array([item.p_w[-1] for item in solve(robot, inputs, np.zeros(3)).postures])


def _crossings(function: Callable[[float], float], value: float, grid: Array) -> tuple[float, ...]:
    """Return where `function` takes `value` on `grid`; where it only jumps across, that is left out."""

    def excess(x: float) -> float:
        return function(x) - value

    excesses = [excess(float(x)) for x in grid]
    found = []
    for i in range(len(grid) - 1):
        if excesses[i] * excesses[i + 1] < 0.0:
            root = float(brentq(excess, float(grid[i]), float(grid[i + 1]), xtol=1e-6))
            if abs(excess(root)) < _SAME_OPENING_M:
                found.append(root)
    return tuple(found)
