"""The force with which the flow through the valve shakes the implant, 70 times a minute.

Nayar 2022, Section IV-F, ran 70 strokes a minute of 60 ml through a phantom of the left heart and held the
robot bent by 90 deg: its tip swung by 0.13 mm, as under a periodic force of that frequency. The force itself
is not printed; it is the one that swings the tip of `mitral_transseptal@tube`, held likewise with its tube
not advanced and no friction, by as much.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.procedure.frames import DOWN

BEATS_PER_S = 70.0 / 60.0  # Nayar 2022, Section IV-F
PRINTED_FLOW_N = 9.2e-3  # amplitude at 60 ml a stroke; derived, see above
# Assumed: from half of it to twice as much. A valve that leaks passes more than the phantom's did, and only
# a part of the stream meets the implant.
FLOW_N = (0.5 * PRINTED_FLOW_N, 2.0 * PRINTED_FLOW_N)
TILT_RAD = math.radians(30.0)  # of the stream from the valve's axis, at most; assumed
EXPOSED_M = 10e-3  # way of the tip beyond the septum over which the stream gets hold of it; assumed


@dataclass(frozen=True)
class Flow:
    """A pulsating force on the tool frame's origin.

    Attributes:
        amplitude_N: of the force; its mean over a beat is zero.
        direction: in which it acts at the start of a beat's second quarter, unit vector, valve frame,
            shape (3,).
        phase_rad: of the beat at time zero.
    """

    amplitude_N: float
    direction: Array
    phase_rad: float

    def beat_rad(self, time_s: float) -> float:
        """Return the phase of the beat [rad]: 0 where the force rises through zero."""
        return (2.0 * math.pi * BEATS_PER_S * time_s + self.phase_rad) % (2.0 * math.pi)

    def force_N(self, time_s: float, beyond_m: float) -> Array:
        """Return the force, valve frame, shape (3,) [N].

        Args:
            time_s: of the episode.
            beyond_m: of the tip beyond the septum, along the sheath; the septum shields it before.
        """
        share = min(max(beyond_m / EXPOSED_M, 0.0), 1.0)
        force: Array = share * self.amplitude_N * math.sin(self.beat_rad(time_s)) * self.direction
        return force


def random_flow(rng: np.random.Generator, bounds_N: tuple[float, float] = FLOW_N) -> Flow:
    """Return a flow of an amplitude drawn evenly within bounds, its tilt and phase drawn too.

    The direction is evenly spread over the cone of `TILT_RAD` about the valve's axis.
    """
    amplitude = float(rng.uniform(*bounds_N))
    height = float(rng.uniform(math.cos(TILT_RAD), 1.0))
    around, phase = rng.uniform(0.0, 2.0 * math.pi, 2)
    flat = math.sqrt(1.0 - height**2)
    direction = np.array([flat * math.cos(around), flat * math.sin(around), height * DOWN[2]])
    return Flow(amplitude, direction, float(phase))
