"""How a continuum robot is steered in environments, and what its speed test plays."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.drive import shares, sums
from catheter_sim.core.quick_model import LARGEST_BEND_RAD, InputLimits, SpeedCase, pulled_in_turn
from catheter_sim.kinds.continuum.arc_model import ArcModel, arc_model
from catheter_sim.kinds.continuum.drives import drives
from catheter_sim.kinds.continuum.layout import links
from catheter_sim.kinds.continuum.spec import ContinuumRobot

_FULL_CIRCLE_RAD = 2.0 * math.pi
_BEND_RAD = 1.0  # that the speed test asks of each segment: well away from straight


def quick_model(robot: ContinuumRobot, actuation: str, largest_bend_rad: float | None) -> ArcModel:
    """Return the model of arcs by which an environment steers; see `core.kind.Steering`."""
    return arc_model(robot, actuation, LARGEST_BEND_RAD if largest_bend_rad is None else largest_bend_rad)


def input_range(robot: ContinuumRobot) -> tuple[Array, Array]:
    """Return the least and largest input of each tendon that the simulation takes: any, shape (t,) each."""
    return np.full(len(robot.tendons), -math.inf), np.full(len(robot.tendons), math.inf)


def input_limits(robot: ContinuumRobot, actuation: str) -> InputLimits:
    """Return what bends one segment, or each that a tendon passes, so far that it meets itself.

    Friction is left out. An arc meets itself as a full circle, or where the inner sides of its elements
    touch: at a radius of curvature of their own radius.
    """
    touching = min(segment.length_m / segment.outer_radius_m for segment in robot.segments)
    shape = (
        "to a full circle" if touching > _FULL_CIRCLE_RAD else "until its elements touch on the inner side"
    )
    full = arc_model(robot, actuation, min(_FULL_CIRCLE_RAD, touching)).drives
    columns = drives(robot, actuation)
    if actuation == "tension":
        most = (full.tendon * sums(columns, len(robot.tendons))).sum(axis=0)
        why = f"there this pull alone would bend a segment {shape}"
    else:
        ways: dict[str, Array] = {}  # of each segment, along x and y together: of each tendon, shape (t,)
        for name, way in zip(full.names, full.tendon.T, strict=True):
            segment = name.rpartition("_")[0]
            ways[segment] = np.hypot(ways.get(segment, 0.0), way)
        share = np.abs(shares(columns, len(robot.tendons)))
        longest = np.where(share > 0.0, np.sum(list(ways.values()), axis=0)[:, np.newaxis], math.inf)
        most = (longest / np.where(share > 0.0, share, 1.0)).min(axis=0)
        why = f"there the tendon has bent each segment that it passes {shape}"
    return InputLimits(np.full(len(columns), -math.inf), most, why)


def speed_case(robot: ContinuumRobot, levels: int) -> SpeedCase:
    """Return a cycle to and fro; each tendon's peak bends its last segment by about a radian."""
    return SpeedCase(pulled_in_turn(_peaks(robot), levels), len(links(robot)), rubs=True, follows=True)


def _peaks(robot: ContinuumRobot) -> list[tuple[float, float]]:
    """Return each tendon's tension that bends its last segment by a radian [N], and its side, 1 or -1.

    T r = EI (1 rad) / length.
    """
    segments = {segment.name: segment for segment in robot.segments}
    peaks = []
    for tendon in robot.tendons:
        segment = segments[tendon.ends_at]
        stiffness = segment.bending_stiffness_N_m2 * robot.stiffness_scale
        side = 1.0 if np.cos(tendon.angle_rad) + np.sin(tendon.angle_rad) > 0 else -1.0
        peaks.append((stiffness * _BEND_RAD / segment.length_m / tendon.radius_m, side))
    return peaks
