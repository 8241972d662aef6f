"""How much of its tendon a notched tube can take in: until all notches are closed."""

from __future__ import annotations

import math

from catheter_sim.kinds.notched_tube.layout import Notch, notches
from catheter_sim.kinds.notched_tube.spec import NotchedTubeRobot
from catheter_sim.kinds.notched_tube.theory.section import closing_angle, section


def span(notch: Notch, tendon_radius_m: float, bend_rad: float) -> float:
    """Return the tendon's straight way between the edges of a notch that is bent toward +x [m].

    The strip's neutral plane is an arc of the notch's height; the tendon runs inside of it.
    """
    arm = tendon_radius_m + section(notch.segment).centroid_m
    half = 0.5 * bend_rad
    chord = notch.segment.notch_height_m * (math.sin(half) / half if half else 1.0)
    return chord - 2.0 * arm * math.sin(half)


def closing_displacement(robot: NotchedTubeRobot) -> float:
    """Return by how much the tendon is shorter where all notches are closed [m]; inf: it can stretch."""
    tendon = robot.tendons[0]
    if math.isfinite(tendon.stiffness_N_per_m):
        return math.inf
    total = 0.0
    for notch in notches(robot):
        rest = notch.segment.rest_curvature_x_per_m * notch.pitch_m
        total += span(notch, tendon.radius_m, rest)
        total -= span(notch, tendon.radius_m, closing_angle(notch.segment))
    return total
