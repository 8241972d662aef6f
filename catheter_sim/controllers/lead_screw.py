"""A motor with a gearbox and a screw that pulls a tendon's holder (Nayar 2023, Section II-B).

The paper gives the gears (64:1 of a bending joint's motor, 100:1 of the tube's and the torsion's) and that
the tube's carriage rides on a lead screw; neither leads nor efficiencies nor motors' torques are printed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class LeadScrew:
    """A screw behind a gearbox.

    Attributes:
        gear: turns of the motor a turn of the screw.
        lead_m: way of the nut a turn [m].
        diameter_m: of the thread's middle [m].
        friction: coefficient between nut and screw.
        gear_efficiency: of the gearbox.
        counts: of the encoder a turn of the motor.
    """

    gear: float
    lead_m: float = 2e-3  # assumed
    diameter_m: float = 5e-3  # assumed
    friction: float = 0.2  # assumed: bronze on steel, dry
    gear_efficiency: float = 0.7  # assumed
    counts: int = 48  # assumed

    @property
    def locks_itself(self) -> bool:
        """Whether a pull on the nut alone cannot turn the screw: the tendon's tension then moves no motor."""
        return self.lead_m < math.pi * self.diameter_m * self.friction

    @property
    def step_m(self) -> float:
        """Way of the nut a count of the encoder [m]."""
        return self.lead_m / (self.gear * self.counts)

    def torque_Nm(self, tension_N: float) -> float:
        """Return the motor's torque that pulls a tension up, thread's and gearbox's losses included [N m]."""
        rise = math.atan(self.lead_m / (math.pi * self.diameter_m))
        at_screw = 0.5 * self.diameter_m * tension_N * math.tan(rise + math.atan(self.friction))
        return at_screw / (self.gear * self.gear_efficiency)

    def speed_rpm(self, nut_m_per_s: float) -> float:
        """Return the motor's speed for a speed of the nut [turns a minute]."""
        return 60.0 * self.gear * nut_m_per_s / self.lead_m


BENDING_GEAR, ADVANCE_GEAR = 64.0, 100.0  # Nayar 2023, Section II-B
