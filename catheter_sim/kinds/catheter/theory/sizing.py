"""What a joint's drive must give, and how its tendons are preconditioned (Nayar 2023, Section I).

The paper names both as what its model of elongation is good for and prints no figure of either. A bending
joint's tension is that of Algorithm 2; the displacement is Eq. 12 plus the elongation of Algorithm 1. A
tendon that has once been pulled to the joint's largest tension keeps a set; drawn tight after that it
follows one line up and down, and takes less displacement than a new one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.kinds.catheter.theory.elongation import (
    SIMPLIFIED,
    TendonLaw,
    TendonState,
    permanent_set,
    strain_at,
    stretched,
)
from catheter_sim.kinds.catheter.theory.stretching import Side, StretchingJoint, bent_to
from catheter_sim.kinds.catheter.theory.tendons import pulled_m

_STEPS = 60  # of a bend from rest


@dataclass(frozen=True)
class Need:
    """What bending a joint to an angle takes.

    Attributes:
        tension_N: largest at the drive: what the motor holds, and what preconditioning pulls to.
        pure_m: displacement with tendons that do not stretch (Eq. 12).
        new_m: displacement with a new tendon.
        ready_m: displacement with a preconditioned tendon, its set drawn in.
        set_m: by which preconditioning lengthens the tendon for good.
    """

    tension_N: float
    pure_m: float
    new_m: float
    ready_m: float
    set_m: float


def need(joint: StretchingJoint, angle_deg: float) -> Need:
    """Return what a joint's drive must give to bend it from rest to `angle_deg`, above 0."""
    way = np.linspace(0.0, angle_deg, _STEPS + 1)[1:]
    tension_N = max(joint.on_N(float(angle)) for angle in way)
    ready, lengthened = preconditioned(joint, tension_N)
    return Need(
        tension_N=tension_N,
        pure_m=float(pulled_m(joint.segment, math.radians(angle_deg))),
        new_m=_way_m(joint, Side(), way),
        ready_m=_way_m(joint, Side(tendon=ready), way) - lengthened,
        set_m=lengthened,
    )


def preconditioned(
    joint: StretchingJoint, tension_N: float, cycles: int = 1, law: TendonLaw | None = None
) -> tuple[TendonState, float]:
    """Return a tendon that was pulled to a tension and let go, and its set [m].

    Args:
        joint: whose tendon it is.
        tension_N: to which it is pulled.
        cycles: how often.
        law: of the tendon; default: the joint's.
    """
    law = law or joint.law
    state = TendonState()
    top = strain_at(law, state, tension_N)
    for _ in range(cycles):
        state = stretched(law, state, top)
        state = stretched(law, state, permanent_set(law, state))
    return state, permanent_set(law, state) * joint.length_m


def repeats_m(joint: StretchingJoint, angle_deg: float, law: TendonLaw, ready: bool) -> float:
    """Return by how much the displacement halfway differs from the first bend to the second [m].

    Halfway: at the top the tension, and so the strain, is the same for a new tendon and one that comes back.

    Args:
        joint: the joint.
        angle_deg: to which both bends go, above 0.
        law: of its tendon, cycle effects included or not.
        ready: whether the tendon has been preconditioned to the tension of that angle.
    """
    own = replace(joint, law=law)
    tension_N = need(replace(joint, law=SIMPLIFIED), angle_deg).tension_N
    side = Side(tendon=preconditioned(own, tension_N)[0] if ready else TendonState())
    ways = []
    for _ in range(2):
        side, halfway = bent_to(own, side, 0.5 * angle_deg)
        ways.append(halfway)
        side, _ = bent_to(own, side, angle_deg)
        side, _ = bent_to(own, side, 0.0)
    return ways[1] - ways[0]


def _way_m(joint: StretchingJoint, side: Side, way_deg: np.ndarray) -> float:
    ways = []
    for angle in way_deg:
        side, displacement = bent_to(joint, side, float(angle))
        ways.append(displacement)
    return max(ways)
