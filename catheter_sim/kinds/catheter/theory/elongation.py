"""How a UHMWPE tendon stretches under cyclic load, permanent set included (Nayar 2023, Algorithm 1).

Three phases. Loading follows the envelope, a cubic in strain. Unloading from (e_ul, F_ul) follows
F = a e^q + b e + c, flat and slack at e_pl = gamma e_ul, q = a_n e_ul + b_n (Eqs 1-4). Reloading is a
line of the slope between (e_pl + (n_c - 1) beta, 0) and (e_ul, phi^(n_c - 1) F_ul), n_c the number of
unloadings since the envelope was left, until it meets the envelope.

Readings. (e_ul, F_ul) of q, e_pl and the line are those at which the envelope was left: a set does not
heal when a later cycle turns back earlier; each unloading curve starts where its cycle turns. Below e_pl
the tendon is slack; the algorithm holds strain and tension there. After a partial unloading the line
goes from there to the same top: with the full line's slope it would pass below the envelope for good.

The text lets every reloading line meet the envelope in the end. With the printed phi and beta those that
follow ten cycles to 2 mm or more of 65 mm do not: phi^9 lowers them by a sixth, and from there on the
envelope is the steeper one. Such a line is followed past the largest strain, and the next turn counts as
a new largest one. With phi = 1 and beta = 0 all meet, at the largest strain.

Strain of a 65 mm sample at 0.05 mm/s; measured to 6 mm, strain 0.092.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq

from catheter_sim.arrays import Array

LARGEST_STRAIN = 6.0 / 65.0  # of the paper's Fig. 3
UNTOUCHED = 1e-6  # strain: a tendon that never had more is as new
TOUCH = 1e-9  # strain: a line that ends on the envelope has not crossed it


@dataclass(frozen=True)
class TendonLaw:
    """Parameters of Algorithm 1."""

    envelope_N: tuple[float, float, float, float]  # p_1 to p_4: of strain^3, ^2, ^1, ^0
    gamma: float  # permanent set per strain at the turn
    a_n: float  # exponent q per strain at the turn
    b_n: float  # exponent q at zero
    phi: float  # by which the reloading line's top falls each cycle
    beta: float  # strain by which its foot shifts each cycle


PRINTED = TendonLaw((-2000.0, 6000.0, 150.0, 0.03), 0.4605, 7.7751, 5.4876, 0.9810, 0.00035)
SIMPLIFIED = replace(PRINTED, phi=1.0, beta=0.0)  # Section III-A.4: what the TE model uses


@dataclass(frozen=True)
class TendonState:
    """A tendon at a point of its history; the defaults are a new one at rest.

    Attributes:
        strain: now.
        tension_N: now [N].
        phase: "loading", "unloading" or "reloading".
        cycle: n_c, unloadings since the envelope was left.
        most: strain and tension [N] at which it was left.
        anchor: strain and tension [N] at which the present unloading or reloading began.
    """

    strain: float = 0.0
    tension_N: float = 0.0
    phase: str = "loading"
    cycle: int = 0
    most: tuple[float, float] = (0.0, 0.0)
    anchor: tuple[float, float] = (0.0, 0.0)


def envelope_N(law: TendonLaw, strain: float) -> float:
    """Return the tension of a tendon that is loaded for the first time [N]; 0 at and below zero strain.

    Beyond `LARGEST_STRAIN` it goes on straight: the cubic would turn down.
    """
    if strain <= 0.0:
        return 0.0
    p1, p2, p3, p4 = law.envelope_N
    e = min(strain, LARGEST_STRAIN)
    slope = 3.0 * p1 * e * e + 2.0 * p2 * e + p3
    return ((p1 * e + p2) * e + p3) * e + p4 + slope * (strain - e)


def permanent_set(law: TendonLaw, state: TendonState) -> float:
    """Return the strain at which the tendon goes slack when it is let go now."""
    most = state.strain if state.phase == "loading" else state.most[0]
    return law.gamma * most


def stretched(law: TendonLaw, state: TendonState, strain: float) -> TendonState:
    """Return the tendon after its strain has moved straight to `strain`."""
    if state.phase == "loading":
        if strain >= state.strain or state.strain <= UNTOUCHED:
            return replace(state, strain=strain, tension_N=envelope_N(law, strain))
        now = (state.strain, state.tension_N)
        return _let_go(law, replace(state, phase="unloading", cycle=1, most=now, anchor=now), strain)
    if state.phase == "unloading":
        if strain <= state.strain:
            return _let_go(law, state, strain)
        taut = state.tension_N > 0.0
        anchor = (state.strain, state.tension_N) if taut else (_foot(law, state), 0.0)
        return _pulled_again(law, replace(state, phase="reloading", anchor=anchor), strain)
    if strain >= state.strain:
        return _pulled_again(law, state, strain)
    now = (state.strain, state.tension_N)
    turned = replace(state, phase="unloading", anchor=now)
    if state.strain > state.most[0] + TOUCH:
        turned = replace(turned, most=now, cycle=1)
    elif state.tension_N > 0.0:
        turned = replace(turned, cycle=state.cycle + 1)
    return _let_go(law, turned, strain)


def strain_at(law: TendonLaw, state: TendonState, tension_N: float) -> float:
    """Return the strain at which the tendon, moved there straight, has a tension, [N] >= 0.

    At zero tension: where it just goes slack.

    Raises:
        ValueError: the law's tension does not reach so high.
    """

    def excess(strain: float) -> float:
        return stretched(law, state, strain).tension_N - tension_N

    if tension_N >= state.tension_N:
        low, high = state.strain, max(state.strain, LARGEST_STRAIN)
        if excess(high) < 0.0:
            raise ValueError(f"no strain up to {high:g} has a tension of {tension_N:g} N")
        if tension_N == 0.0:
            return low
        if excess(low) >= 0.0:
            return low
    else:
        low, high = permanent_set(law, state), state.strain
        if tension_N == 0.0 or excess(low) >= 0.0:
            return low
    return float(brentq(excess, low, high, xtol=1e-15, rtol=1e-14))


def tension_along(law: TendonLaw, strains: Array) -> Array:
    """Return the tension along a history of strains of a new tendon, same shape (r,) [N]."""
    state = TendonState()
    result = np.empty(len(strains))
    for row, strain in enumerate(strains):
        state = stretched(law, state, float(strain))
        result[row] = state.tension_N
    return result


def _foot(law: TendonLaw, state: TendonState) -> float:
    """Return the strain at which a slack tendon becomes taut again.

    Many cycles shift it at most half of the way to the turn (the ten measured ones by two fifths).
    """
    slack = law.gamma * state.most[0]
    return min(slack + (state.cycle - 1) * law.beta, 0.5 * (slack + state.most[0]))


def _let_go(law: TendonLaw, state: TendonState, strain: float) -> TendonState:
    """Return the tendon on its unloading curve (Eqs 1-4)."""
    slack, (turn, top_N) = law.gamma * state.most[0], state.anchor
    tension = 0.0
    if strain > slack and top_N > 0.0:
        q = law.a_n * state.most[0] + law.b_n
        rise = turn**q - slack**q - q * slack ** (q - 1.0) * (turn - slack)
        here = strain**q - slack**q - q * slack ** (q - 1.0) * (strain - slack)
        tension = top_N * max(here, 0.0) / rise if rise > 0.0 else top_N
    return replace(state, strain=strain, tension_N=tension)


def _pulled_again(law: TendonLaw, state: TendonState, strain: float) -> TendonState:
    """Return the tendon on its reloading line, or on the envelope beyond where they meet."""
    foot, (start, start_N) = _foot(law, state), state.anchor
    turn, top_N = state.most[0], law.phi ** (state.cycle - 1) * state.most[1]
    slope = top_N / (turn - foot)
    if start < turn - TOUCH:
        slope = max(slope, (top_N - start_N) / (turn - start))
    if strain > _meeting(law, start, start_N, slope) + TOUCH:
        return TendonState(strain, envelope_N(law, strain))
    tension = max(start_N + slope * (strain - start), 0.0)
    return replace(state, strain=strain, tension_N=tension)


@lru_cache(maxsize=256)
def _meeting(law: TendonLaw, start: float, start_N: float, slope: float) -> float:
    """Return the first strain beyond `start` at which the line is not below the envelope; inf: none."""
    p1, p2, p3, p4 = law.envelope_N
    roots = np.roots([p1, p2, p3 - slope, p4 - start_N + slope * start])
    beyond = [root.real for root in roots if abs(root.imag) < 1e-9 and root.real > start]
    return min(beyond, default=math.inf)
