"""What of a pair's displacement arrives at its tendons: play of the drive, slack of the tendons."""

from __future__ import annotations

import numpy as np

from catheter_sim.robots.catheter import TendonPair
from catheter_sim.robots.posture import Array
from catheter_sim.statics.catheter.prandtl_ishlinskii import plays


def arriving_m(pair: TendonPair, displacement_m: Array) -> Array:
    """Return how far a pair's tendons are drawn along displacements from rest, shape (r,) [m].

    The drive's play follows with the pair's whole `play_m`, centred at rest (Nayar 2022, Eqs 29-31). Of a
    bending joint's pair each tendon draws only what is left of its `slack_m`; in between neither does.
    """
    drawn = displacement_m
    if pair.play_m > 0.0:
        drawn = plays(displacement_m, np.array([0.5 * pair.play_m]))[:, 0]
    return np.copysign(np.maximum(np.abs(drawn) - pair.slack_m, 0.0), drawn)
