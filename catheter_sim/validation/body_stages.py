"""The three bodies of Kato 2016, Figs 4 and 5: pulled sideways at the tip to 44 mm and back.

Backbone alone; backbone with wire guides (pressed together by 4 N, free to roll); and with tendons
that carry the 4 N as pretension and rub. Only the last may need another force on the way back.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import Friction
from catheter_sim.robots.continuum.published import neuroendoscope_section
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation.drives import NO_GRAVITY, given, tips_mm

PRETENSION_N = 4.0  # Kato 2016: axial compression of both bodies with guides, sum of the tendons
REACH_MM = 44.0  # Kato 2016: lateral tip position at which the motion turns
PLACES_MM = np.linspace(4.4, 39.6, 9)  # where the two ways are compared
_FORCE_STEP_N = 0.0025


@dataclass(frozen=True)
class Stage:
    """One body: the string's force on the way out and back.

    Attributes:
        name: which body.
        force_N, place_mm: the whole round trip, shape (r,).
        discrepancy_mN: force out less force back at `PLACES_MM`, shape (p,).
    """

    name: str
    force_N: Array
    place_mm: Array
    discrepancy_mN: Array


def body_stages() -> tuple[Stage, ...]:
    """Return the three stages, simulated."""
    mu = neuroendoscope_section().friction.mu
    return (
        _stage("backbone", 0.0, 0.0),
        _stage("backbone with wire guides", PRETENSION_N, 0.0),
        _stage("backbone with wire guides and tendons", PRETENSION_N, mu),
    )


def _stage(name: str, pretension_N: float, mu: float) -> Stage:
    robot = replace(neuroendoscope_section(), friction=Friction(mu))

    def tips(force: Array) -> Array:
        push = np.zeros((len(force), 3))
        push[:, 0] = force
        inputs = given(np.full((len(force), 2), pretension_N / 2.0), force_tip=push)
        return tips_mm(simulate(robot, inputs, NO_GRAVITY, ramp_s=0.5).postures)[:, 0]

    out = np.arange(0.0, 0.08, _FORCE_STEP_N)
    turn = int(np.argmax(tips(out) >= REACH_MM))
    force = np.concatenate([out[: turn + 1], out[:turn][::-1]])
    place = tips(force)
    there, back = slice(0, turn + 1), slice(turn, None)
    outward = np.interp(PLACES_MM, place[there], force[there])
    inward = np.interp(PLACES_MM, place[back][::-1], force[back][::-1])
    return Stage(name, force, place, (outward - inward) * 1e3)
