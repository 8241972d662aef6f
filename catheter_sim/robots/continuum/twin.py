"""The twin of tendon-driven continuum robots.

Robots that bend in a plane and are driven by tension go through the exact-arm statics, all at once
(`robots.continuum.planar_batch`) or, with tendons that it does not know, one by one (`fkm_exact_arm`). All
others go through arcs of constant curvature, all at once (`robots.continuum.arcs`), with tendons that run
straight between disks, as in the simulation. Where a load acts or tendons rub, a segment's curvature varies
along it: then it is several arcs (`arcs_of`). A single one errs by half of what a force on the tip does to a
robot whose tendons are held; the error falls as the square of their number. Robots of three segments or more
keep single arcs, since every row costs so much more. Of the example of a trunk that hangs in its own weight
they err by 3.6 mm, two of each segment would by 0.7 mm in four times the time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.statics import OneByOne, StaticModel, Twin, TwinStates
from catheter_sim.mechanics.arcs import points_on_arcs
from catheter_sim.robots.continuum.arcs import solve_rows
from catheter_sim.robots.continuum.constant_curvature import arc_robots, joint_values, loads, places, turns
from catheter_sim.robots.continuum.description import (
    axes_of,
    disks,
    link_lengths,
    outputs,
    winds_or_converges,
)
from catheter_sim.robots.continuum.exact_arm import FKM_EXACT_ARM as MODEL
from catheter_sim.robots.continuum.exact_arm import fkm_exact_arm
from catheter_sim.robots.continuum.planar import bends_in_plane, hinge_faces, joint_angles, rotations
from catheter_sim.robots.continuum.planar_batch import knows, solve_planar
from catheter_sim.robots.continuum.spec import ContinuumRobot

_MOST_ARCS = 5  # of a robot: what an equilibrium costs grows with the square of it
_EXACT_ARM: StaticModel[ContinuumRobot] = StaticModel(MODEL, "one robot at a time", fkm_exact_arm)


@dataclass(frozen=True)
class ArcTwin:
    """Constant-curvature twin of any continuum robot."""

    carries_load: bool = True

    def solve(
        self,
        robots: Sequence[ContinuumRobot],
        arriving: Sequence[Inputs],
        gravity_mps2: Array,
        elements: Sequence[int],
        every: int,
    ) -> TwinStates:
        """Return where robots are, as `Twin.solve` says."""
        if _varies(robots, arriving, gravity_mps2):
            robots = [in_parts(robot, arcs_of(robots[0])) for robot in robots]
        arcs = arc_robots(robots, straight_between_disks=True)
        commands = np.array([item.tendon for item in arriving])
        acting = loads(robots, arriving, gravity_mps2)
        states = solve_rows(arcs, commands, arriving[0].actuation == "tension", acting, every)
        segment, fraction = places(robots[0])
        disks = list(elements)
        turn = turns(robots)[:, None]
        p_w, R_w = points_on_arcs(
            states.bend,
            arcs.length[:, None],
            segment[disks],
            fraction[disks],
            turn if turn.any() else None,
            arcs.lead[:, None],
        )
        p_w[..., 2] -= states.shift[..., None]
        return TwinStates(p_w, R_w, partial(joint_values, robots[0], states.bend, turn), states.tension)


def arcs_of(robot: ContinuumRobot) -> int:
    """Return into how many arcs each segment that bends is divided; every one ends at a disk."""
    bending = [segment for segment in robot.segments if axes_of(segment)]
    common = math.gcd(*(disks(robot, segment) for segment in bending))
    most = max(_MOST_ARCS // len(bending), 1)
    return max(parts for parts in range(1, most + 1) if common % parts == 0)


def in_parts(robot: ContinuumRobot, parts: int) -> ContinuumRobot:
    """Return the same robot described by so many equal segments for each of its own that bends."""
    if parts == 1:
        return robot
    segments = [
        replace(
            segment,
            name=segment.name if part == count - 1 else f"{segment.name}/{part + 1}",
            length_m=segment.length_m / count,
            disks=disks(robot, segment) // count,
            mass_kg=segment.mass_kg / count,
        )
        for segment in robot.segments
        for count in (parts if axes_of(segment) else 1,)
        for part in range(count)
    ]
    return replace(robot, segments=tuple(segments), disks_per_segment=0)


def _varies(robots: Sequence[ContinuumRobot], arriving: Sequence[Inputs], gravity_mps2: Array) -> bool:
    """Return whether something acts that makes a segment's curvature vary along it."""
    heavy = gravity_mps2.any() and any(segment.mass_kg for item in robots for segment in item.segments)
    loaded = any(item.force_tip.any() or item.moment_tip.any() for item in arriving)
    routed = winds_or_converges(robots[0])
    return bool(heavy or loaded or routed or any(robot.friction.mu for robot in robots))


@dataclass(frozen=True)
class PlanarTwin:
    """Exact-arm twin of planar robots driven by tension."""

    carries_load: bool = True

    def solve(
        self,
        robots: Sequence[ContinuumRobot],
        arriving: Sequence[Inputs],
        gravity_mps2: Array,
        elements: Sequence[int],
        every: int,
    ) -> TwinStates:
        """Return where robots are, as `Twin.solve` says; NaN from the row on at which nothing balances."""
        shown = slice(None, None, every)
        angles, shift = solve_planar(robots, arriving, gravity_mps2)
        angles = angles[:, shown]
        length = np.array([[link_lengths(robot)] for robot in robots])
        p_w = hinge_faces(angles, length, elements)
        p_w[..., 2] += shift[:, shown, None]
        R_w = rotations(np.cumsum(angles, axis=2)[:, :, list(elements)])
        tension = np.array([item.tendon[shown] for item in arriving])
        return TwinStates(p_w, R_w, partial(joint_angles, robots[0], angles), tension)


def twin(robot: ContinuumRobot, actuation: str) -> Twin[ContinuumRobot]:
    """Return the twin of robots like `robot` driven by "tension" or "displacement"."""
    if not bends_in_plane(robot) or actuation != "tension":
        return ArcTwin()
    if knows(robot):
        return PlanarTwin()
    return OneByOne(_EXACT_ARM, len(outputs(robot).joints))
