"""How a continuum robot is steered in environments, by a quick model of arcs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Drive, shares, sums
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
from catheter_sim.errors import InputError
from catheter_sim.mechanics.arcs import segment_frames
from catheter_sim.robots.continuum.constant_curvature import arc_robots, leads
from catheter_sim.robots.continuum.description import (
    ACTUATIONS,
    axes_of,
    disks,
    drives,
    has_gains,
    is_planar,
    links,
)
from catheter_sim.robots.continuum.spec import ContinuumRobot

# ----------------------------------------------------------------------------------------------------
# The quick model of a continuum robot: every segment an arc, without friction and load.
#
# A tension T of a tendon at the distance r bends a segment by T r L / EI, and a bend b shortens the
# tendon's path by r b: bends are linear in the drives' levels.

_NO_ARM_M = 1e-9  # a tendon nearer to the neutral plane bends nothing
_DIFFERENCE_RAD = 1e-5
_FOLLOWS = 1e-3  # of the largest way: what a tendon may be off its channel's gain


@dataclass(frozen=True)
class ArcModel:
    """A `core.published.QuickModel` of arcs; see there."""

    drives: DriveLevels
    segment_length: Array
    segment_of_link: np.ndarray
    planar: bool
    lead: Array
    sets_bends = False

    @property
    def bend_unit(self) -> Array:
        """Half a turn each, shape (s, 2) [rad]."""
        return np.full((len(self.segment_length), 2), math.pi)

    def bend_of(self, joint: str) -> tuple[int, ...] | None:
        """Return the place of the bend that hinge `x<k>` or `y<k>` is part of."""
        return bend_of_link(self.segment_of_link, joint)

    def reach(self, level: Array, rest_bends: Array) -> tuple[Array, Array]:
        """Return tips and bends at `level`."""
        bends = rest_bends + np.einsum("sad,nd->nsa", self.drives.bend, level)
        return arc_tips(bends, self.segment_length, self.lead), bends

    def tip_slopes(self, level: Array, bends: Array) -> Array:
        """Return how the tip of arcs bent by `bends` moves with the levels, the same at every level."""
        return np.einsum("isa,sad->id", tip_jacobian(bends, self.segment_length, self.lead), self.drives.bend)

    def direction_slopes(self, level: Array, bends: Array) -> Array:
        """Return how the tip's direction moves with the levels, the same at every level."""
        return np.einsum("isa,sad->id", direction_jacobian(bends, self.segment_length), self.drives.bend)


def arc_model(robot: ContinuumRobot, actuation: str, largest_bend_rad: float) -> ArcModel:
    """Return the quick model of `robot`; arguments and errors as in `envs.robots.quick_model`."""
    ends = np.cumsum([disks(robot, segment) for segment in robot.segments])
    return ArcModel(
        drives=_drives(robot, actuation, largest_bend_rad),
        segment_length=np.array([segment.length_m for segment in robot.segments]),
        segment_of_link=np.repeat(
            np.arange(len(ends)), np.diff(ends, prepend=0) * robot.links_per_subsegment
        ),
        planar=is_planar(robot),
        lead=leads([robot])[0],
    )


def arc_tips(bend: Array, length: Array, lead: Array | None = None) -> Array:
    """Return the tips of robots of arcs, shape (..., 3) [m].

    Args:
        bend: of each segment, toward +x and +y, shape (..., s, 2) [rad].
        length: shape (s,) [m].
        lead: as of `mechanics.arcs.points_on_arcs`, shape (s,) [m].
    """
    p_w, R_w = segment_frames(bend, length)
    if lead is None or not lead.any():
        return p_w[..., -1, :]
    along = R_w[..., 2]
    return p_w[..., -1, :] + np.einsum("s,...si->...i", lead, along[..., :-1, :] - along[..., 1:, :])


def arc_directions(bend: Array, length: Array) -> Array:
    """Return the unit vectors along the tips' axes, shape (..., 3); arguments as of `arc_tips`."""
    return segment_frames(bend, length)[1][..., -1, :, 2]


def tip_jacobian(bend: Array, length: Array, lead: Array | None = None) -> Array:
    """Return how the tip moves with the segments' bends, shape (3, s, 2) [m/rad]."""
    return _differences(partial(arc_tips, lead=lead), bend, length)


def direction_jacobian(bend: Array, length: Array) -> Array:
    """Return how the tip's direction moves with the segments' bends, shape (3, s, 2) [1/rad]."""
    return _differences(arc_directions, bend, length)


def _differences(function: Callable[[Array, Array], Array], bend: Array, length: Array) -> Array:
    steps = _DIFFERENCE_RAD * np.eye(bend.size).reshape(-1, *bend.shape)
    slopes = (function(bend + steps, length) - function(bend - steps, length)) / (2.0 * _DIFFERENCE_RAD)
    return slopes.T.reshape(3, *bend.shape)


def _drives(robot: ContinuumRobot, actuation: str, largest_bend_rad: float) -> DriveLevels:
    arcs = arc_robots([robot])
    arm = np.where(arcs.free, arcs.arm[0], 0.0)  # (t, s, 2)
    arm[np.abs(arm) < _NO_ARM_M] = 0.0
    compliance = (arcs.length / arcs.bending)[0, :, np.newaxis]  # (s, 1) [rad per N m]
    columns = drives(_pulled_one_by_one(robot), ACTUATIONS[0])
    share = tension_shares(robot, columns)
    per_newton = np.einsum("tsa,td->sad", arm * compliance, share)  # bend by 1 N in a channel
    largest = np.sqrt((per_newton**2).sum(axis=1)).max(axis=0, initial=0.0)
    channels = tuple(drive.column for drive in columns)
    for name, value in zip(channels, largest, strict=True):
        if value == 0.0:
            raise bends_nothing(robot, name)
    limit = largest_bend_rad / largest  # (d,) [N]
    tension = share * limit
    if actuation == "tension":
        return DriveLevels(
            actuation=actuation,
            names=channels,
            lowest=np.zeros(len(channels)),
            tendon=tension,
            bend=per_newton * limit,
            tension=tension.sum(axis=1),
        )
    names, bends = _segment_bends(robot, arcs.length[0], arm, largest_bend_rad)
    drawn = np.einsum("tsa,sad->td", arm, bends)
    if has_gains(robot.tendons):
        _check_gains(robot, drives(robot, actuation), drawn)
    return DriveLevels(
        actuation=actuation,
        names=names,
        lowest=-np.ones(len(names)),
        tendon=drawn,
        bend=bends,
        tension=tension.sum(axis=1),
    )


def _pulled_one_by_one(robot: ContinuumRobot) -> ContinuumRobot:
    """Return `robot`; where channels have gains, with each tendon in a channel of its own."""
    if not has_gains(robot.tendons):
        return robot
    alone = (replace(tendon, channel="", channel_gain=1.0) for tendon in robot.tendons)
    return replace(robot, tendons=tuple(alone))


def _check_gains(robot: ContinuumRobot, columns: tuple[Drive, ...], drawn: Array) -> None:
    """Raise `InputError` where a channel's tendons are not drawn as their gains say when segments bend.

    Args:
        robot: the robot.
        columns: its drives by displacement.
        drawn: by how much each tendon is drawn as each segment bends, shape (t, d) [m].
    """
    count = len(robot.tendons)
    followed = shares(columns, count) @ (sums(columns, count).T @ drawn)
    off = np.abs(followed - drawn).max(axis=1, initial=0.0) > _FOLLOWS * np.abs(drawn).max()
    if off.any():
        others = [item for item, wrong in zip(robot.tendons, off, strict=True) if wrong]
        tendon = next((item for item in others if item.channel_gain != 1.0), others[0])
        raise InputError(
            f"{robot.name}: tendons.{tendon.name}.channel_gain = {tendon.channel_gain:g}: when segments bend "
            "as arcs, the tendon does not move so beside its channel's others (radius_mm, angle_deg, ends_at)"
        )


def _segment_bends(
    robot: ContinuumRobot, length: Array, arm: Array, largest_bend_rad: float
) -> tuple[tuple[str, ...], Array]:
    """Return the bends that the tendons can ask for one by one: names, and shape (s, 2, d) [rad].

    Segments between two tendons' ends bend together, in proportion to their lengths.
    """
    names: list[str] = []
    bends: list[Array] = []
    ends = {tendon.ends_at for tendon in robot.tendons}
    first = 0
    for last, segment in enumerate(robot.segments):
        if segment.name not in ends:
            continue
        together = np.arange(first, last + 1)
        fixed_here = [tendon.ends_at == segment.name for tendon in robot.tendons]
        for axis, letter in enumerate("xy"):
            if arm[fixed_here][:, together, axis].any():
                bend = np.zeros((len(robot.segments), 2))
                bending = together[[letter in axes_of(robot.segments[s]) for s in together]]
                bend[bending, axis] = largest_bend_rad * length[bending] / length[bending].max()
                names.append(f"bend_{segment.name}_{letter}")
                bends.append(bend)
        first = last + 1
    return tuple(names), np.stack(bends, axis=-1)


# ----------------------------------------------------------------------------------------------------
# How a continuum robot is steered in environments, and what its speed test plays.

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
