"""How far each segment of a rolling-joint robot bends under its own rods, each pulled alone.

By the complete statics, loaded from rest without weight; there the simulation agrees with them also
with friction (`chest_tube_full`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.robots.rolling.complete import complete
from catheter_sim.robots.rolling.description import RollingChain, rolling_chain
from catheter_sim.robots.rolling.spec import RollingRobot
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation.drives import NO_GRAVITY, given

MOST_TENSION_N = 100.0  # chest_tube_2025, Table I: upper end of the estimated tension
_TENSIONS_N = np.linspace(0.0, MOST_TENSION_N, 41)


@dataclass(frozen=True)
class Bend:
    """How far one segment bends in one plane under the rods that end at it, each alone.

    Attributes:
        rods: their indices.
        segment, axis: which joints.
        angle: by rod and tension (`_TENSIONS_N`), toward the rod's own side, shape (k, 41) [rad].
        closed: bend at which the first gap of every joint is closed, the lesser of both sides [rad].
        length_mm: of the segment.
    """

    rods: tuple[int, ...]
    segment: str
    axis: int
    angle: Array
    closed: float
    length_mm: float

    def tension_N(self, bend_deg: float) -> float:
        """Return the tension that bends the segment so far toward every side that has a rod, NaN if none."""
        found = [
            float(np.interp(math.radians(bend_deg), row, _TENSIONS_N))
            if row[-1] >= math.radians(bend_deg)
            else math.nan
            for row in self.angle
        ]
        return max(found) if all(map(math.isfinite, found)) else math.nan


def bending_planes(robot: RollingRobot) -> list[tuple[str, int]]:
    """Return each segment's bending planes that have a rod of their own, base first."""
    planes = []
    for segment in robot.segments:
        for axis, letter in enumerate(segment.bending_axes):
            if any(rod.ends_at == segment.name and rod.side.endswith(letter) for rod in robot.tendons):
                planes.append((segment.name, axis))
    return planes


def segment_bend(robot: RollingRobot, segment: str, axis: int) -> Bend:
    """Return the bends of a segment in one of `bending_planes`.

    Raises:
        InputError: no posture balances a rod's pull.
    """
    chain = rolling_chain(robot)
    joints = _joints(chain, segment, axis)
    own = [
        index
        for index, rod in enumerate(robot.tendons)
        if rod.ends_at == segment and rod.side.endswith("xy"[axis])
    ]
    angle = []
    for index in own:
        tension = np.zeros((len(_TENSIONS_N), len(robot.tendons)))
        tension[:, index] = _TENSIONS_N
        postures = complete(robot, given(tension), NO_GRAVITY).postures
        toward = 1.0 if robot.tendons[index].side[0] == "+" else -1.0
        angle.append([toward * posture.joint_angles[joints].sum() for posture in postures])
    closed = min(float(chain.high[joints].sum()), float(-chain.low[joints].sum()))
    length = next(item.length_m for item in robot.segments if item.name == segment)
    return Bend(tuple(own), segment, axis, np.array(angle), closed, length * 1e3)


def simulated_bend_deg(robot: RollingRobot, bend: Bend, rod: int, tension: float) -> float:
    """Return the size of a segment's bend under one rod's tension [N], simulated."""
    rows = np.zeros((1, len(robot.tendons)))
    rows[0, rod] = tension
    theta = simulate(robot, given(rows), NO_GRAVITY).postures[0].joint_angles
    joints = _joints(rolling_chain(robot), bend.segment, bend.axis)
    return abs(float(np.degrees(theta[joints].sum())))


def _joints(chain: RollingChain, segment: str, axis: int) -> np.ndarray:
    """Return which joints belong to a segment's bending plane, shape (n,)."""
    segments = chain.robot.segments
    names = np.repeat([item.name for item in segments], [item.joints for item in segments])
    return (names == segment) & (chain.axis == axis)
