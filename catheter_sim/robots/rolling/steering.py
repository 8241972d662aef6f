"""How a robot of rolling joints is steered in environments, by its statics without friction and load."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.published import (
    LARGEST_BEND_RAD,
    DriveLevels,
    InputLimits,
    SpeedCase,
    bend_of_link,
    bends_nothing,
    pulled_in_turn,
    tension_shares,
)
from catheter_sim.core.robot import Friction
from catheter_sim.mjcf.parts import MAX_TENSION_N
from catheter_sim.robots.rolling.complete import Frames, Solved, frames, solve_loaded, spans
from catheter_sim.robots.rolling.description import RollingChain, drives, rolling_chain
from catheter_sim.robots.rolling.spec import RollingRobot

# ----------------------------------------------------------------------------------------------------
# The quick model of a robot of rolling joints: its complete statics, without friction and load.
#
# Joints stiffen as their gaps close, so that bends are not linear in the tensions: every posture is solved,
# some 0.05 ms each in a batch, and slopes are differences of solved postures.

_NO_BEND_RAD = 1e-6  # a rod whose largest tension bends every segment less bends nothing
_DIFFERENCE = 1e-3  # of a level, to either side
_HALVINGS = 40  # of the interval in which a range's end lies: to 1e-10 N
_NO_GRAVITY = np.zeros(3)


@dataclass(frozen=True)
class RollingModel:
    """A `core.published.QuickModel` of rolling joints; see there.

    Attributes:
        chain: the robot without friction.
        member: 1 where a joint belongs to a segment and bends toward +x or +y, shape (s, 2, n).
    """

    drives: DriveLevels
    segment_length: Array
    segment_of_link: np.ndarray
    planar: bool
    sets_bends = False
    chain: RollingChain
    member: Array

    @property
    def bend_unit(self) -> Array:
        """Half a turn each, shape (s, 2) [rad]."""
        return np.full((len(self.segment_length), 2), math.pi)

    def bend_of(self, joint: str) -> tuple[int, ...] | None:
        """Return the place of the bend that hinge `x<k>` or `y<k>` is part of."""
        return bend_of_link(self.segment_of_link, joint)

    def reach(self, level: Array, rest_bends: Array) -> tuple[Array, Array]:
        """Return tips and bends at `level`; rest bends beyond the model's own are added evenly."""
        solved = _solved(self.chain, level @ self.drives.tendon.T)
        at_rest = _bends(self.member, self.chain.rest_angle)
        theta = solved.theta + self._evenly(rest_bends - at_rest)
        tips = frames(self.chain, theta, solved.link_length).face[:, -1]
        return tips, _bends(self.member, theta)

    def tip_slopes(self, level: Array, bends: Array) -> Array:
        """Return how the tip moves with the levels.

        Angles change as the frictionless robot's do at `level`; the robot that they move stands bent
        by `bends`: what the frictionless one lacks of them is shared evenly by a segment's joints.
        """
        moved, change = self._moved(level, bends)
        tips = moved.face[:, :, -1]  # (2, d, 3)
        return ((tips[1] - tips[0]) / change[:, np.newaxis]).T

    def direction_slopes(self, level: Array, bends: Array) -> Array:
        """Return how the tip's direction moves with the levels, by the same change of the angles."""
        moved, change = self._moved(level, bends)
        axes = moved.R_w[:, :, -1, :, 2]
        return ((axes[1] - axes[0]) / change[:, np.newaxis]).T

    def _moved(self, level: Array, bends: Array) -> tuple[Frames, Array]:
        """Return the links a little below and above each level, (2, d, ...), and how far apart, (d,)."""
        drives = self.drives
        level = np.clip(level, drives.lowest, 1.0)
        below = np.maximum(level - _DIFFERENCE, drives.lowest)
        above = np.minimum(level + _DIFFERENCE, 1.0)
        own = np.eye(len(level), dtype=bool)
        rows = np.concatenate([np.where(own, below, level), np.where(own, above, level), level[np.newaxis]])
        theta = _solved(self.chain, rows @ drives.tendon.T).theta
        low, high, here = theta[: len(level)], theta[len(level) : -1], theta[-1]
        here = here + self._evenly(bends - _bends(self.member, here))
        change = 0.5 * (high - low)
        return frames(self.chain, np.stack([here - change, here + change])), above - below

    def _evenly(self, bends: Array) -> Array:
        """Return angles of the joints that add up to `bends`, equal within a segment and plane, (n,)."""
        count = np.maximum(self.member.sum(axis=2), 1.0)
        return np.einsum("san,sa->n", self.member, bends / count)


def rolling_model(robot: RollingRobot, actuation: str, largest_bend_rad: float) -> RollingModel:
    """Return the quick model of `robot`; arguments and errors as in `envs.robots.quick_model`."""
    chain = rolling_chain(replace(robot, friction=Friction(0.0)))
    segment = np.repeat(np.arange(len(robot.segments)), [item.joints for item in robot.segments])
    numbers = np.arange(len(robot.segments))[:, np.newaxis, np.newaxis]
    axes = np.arange(2)[np.newaxis, :, np.newaxis]
    member = ((segment == numbers) & (chain.axis == axes)).astype(float)
    return RollingModel(
        drives=_drives(robot, chain, member, actuation, largest_bend_rad),
        segment_length=np.array([item.length_m for item in robot.segments]),
        segment_of_link=segment,
        planar=bool((chain.axis == 0).all()),
        chain=chain,
        member=member,
    )


def _drives(
    robot: RollingRobot, chain: RollingChain, member: Array, actuation: str, largest_bend_rad: float
) -> DriveLevels:
    columns = drives(robot, actuation)
    share = tension_shares(robot, columns)
    names = tuple(drive.column for drive in columns)
    at_rest = _bends(member, chain.rest_angle)

    def bends(tensions: Array) -> Array:
        """Return how far each channel's tension alone bends the segments, shape (c, s, 2) [rad]."""
        return _bends(member, _solved(chain, tensions[:, np.newaxis] * share.T).theta) - at_rest

    def largest(tensions: Array) -> Array:
        return np.hypot(*np.moveaxis(bends(tensions), -1, 0)).max(axis=-1)

    low, end = np.zeros(len(names)), MAX_TENSION_N / share.max(axis=0)
    for name, value in zip(names, largest(end), strict=True):
        if value < _NO_BEND_RAD:
            raise bends_nothing(robot, name)
    for _ in range(_HALVINGS):  # the end stays where the largest tension asks too little
        middle = 0.5 * (low + end)
        beyond = largest(middle) > largest_bend_rad
        low, end = np.where(beyond, low, middle), np.where(beyond, middle, end)
    return DriveLevels(
        actuation=actuation,
        names=names,
        lowest=np.zeros(len(names)),
        tendon=share * end,
        bend=np.moveaxis(bends(end), 0, -1),
        tension=(share * end).sum(axis=1),
    )


def _solved(chain: RollingChain, tension: Array) -> Solved:
    return solve_loaded(chain, tension, _NO_GRAVITY)


def _bends(member: Array, theta: Array) -> Array:
    """Return the bends of the segments, shape (..., s, 2) [rad]."""
    return np.einsum("san,...n->...sa", member, theta)


# ----------------------------------------------------------------------------------------------------
# How a robot of rolling joints is steered in environments, and what its speed test plays.

_BEND_RAD = 1.0  # that the speed test asks of each segment: well away from straight


def quick_model(robot: RollingRobot, actuation: str, largest_bend_rad: float | None) -> RollingModel:
    """Return the complete statics by which an environment steers; see `core.kind.Steering`."""
    largest = LARGEST_BEND_RAD if largest_bend_rad is None else largest_bend_rad
    return rolling_model(robot, actuation, largest)


def input_range(robot: RollingRobot) -> tuple[Array, Array]:
    """Return the least and largest input of each rod that the simulation takes: any, shape (t,) each."""
    return np.full(len(robot.tendons), -math.inf), np.full(len(robot.tendons), math.inf)


def input_limits(robot: RollingRobot, actuation: str) -> InputLimits:
    """Return the largest tension of each column: joints stiffen until their gaps are closed."""
    share = tension_shares(robot, drives(robot, actuation))
    most = MAX_TENSION_N / share.max(axis=0)
    why = f"the model's actuators pull with {MAX_TENSION_N:g} N at most"
    return InputLimits(np.zeros(len(most)), most, why)


def speed_case(robot: RollingRobot, levels: int) -> SpeedCase:
    """Return a cycle to and fro; each rod's peak bends its last segment by about a radian.

    By MuJoCo alone links do not roll and rods do not resist: the model does not follow the inputs.
    """
    links = sum(segment.joints for segment in robot.segments)
    return SpeedCase(pulled_in_turn(_peaks(robot), levels), links, rubs=True, follows=False)


def _peaks(robot: RollingRobot) -> list[tuple[float, float]]:
    """Return each rod's tension that bends its last segment by a radian [N], and its side, 1 or -1.

    T sum(-dl/dtheta / K) = 1 rad over the segment's joints in the rod's plane, K at rest.
    """
    chain = rolling_chain(robot)
    span = spans(chain, chain.rest_angle)
    per_newton = -span.slope[: chain.pulled] / chain.rest_stiffness
    segment = np.repeat([item.name for item in robot.segments], [item.joints for item in robot.segments])
    peaks = []
    for index, rod in enumerate(robot.tendons):
        own = (segment == rod.ends_at) & (chain.axis == "xy".index(rod.side[1]))
        side = 1.0 if rod.side[0] == "+" else -1.0
        peaks.append((_BEND_RAD / abs(float(per_newton[index, own].sum())), side))
    return peaks
