"""What may be wrong, one cause a file; here their list, in the order in which they act.

Whoever adds a cause adds its file and a line below.
"""

from __future__ import annotations

from collections.abc import Mapping

from catheter_sim.core.effect import Effect
from catheter_sim.effects import (
    actuation_gain,
    actuation_offset,
    axial_compression,
    backlash,
    coupling,
    drift,
    measurement_frame,
    nonlinear_stiffness,
    payload,
    precurvature,
    rate,
    stiffness,
    tendon_elongation,
    tendon_friction,
    twist,
)

EFFECTS: Mapping[str, Effect] = {
    effect.name: effect
    for effect in (
        # on the way in: sensor or drive first, then its zero and where that wanders, then how fast the
        # drive follows, the play behind it, and what the routing makes of it
        actuation_gain.EFFECT,
        actuation_offset.EFFECT,
        drift.EFFECT,
        rate.EFFECT,
        backlash.EFFECT,
        coupling.EFFECT,
        payload.EFFECT,
        # in the robot
        tendon_friction.EFFECT,
        tendon_elongation.EFFECT,
        axial_compression.EFFECT,
        stiffness.EFFECT,
        nonlinear_stiffness.EFFECT,
        precurvature.EFFECT,
        twist.EFFECT,
        # on the way out
        measurement_frame.EFFECT,
    )
}
