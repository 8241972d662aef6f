"""How a notched tube is steered in environments, by its statics without friction and load."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.published import (
    LARGEST_BEND_RAD,
    DriveLevels,
    InputLimits,
    SpeedCase,
    bend_of_link,
    bends_nothing,
    pulled_in_turn,
)
from catheter_sim.core.robot import Friction, Mount
from catheter_sim.mechanics.arcs import arc_end
from catheter_sim.robots.notched_tube.description import (
    closing_displacement,
    drives,
    largest_displacement_m,
    notches,
)
from catheter_sim.robots.notched_tube.laws import bending_seen_from_tendon
from catheter_sim.robots.notched_tube.section import section
from catheter_sim.robots.notched_tube.spec import NotchedTubeRobot
from catheter_sim.robots.notched_tube.statics import solve_rows

# ----------------------------------------------------------------------------------------------------
# The quick model of a notched tube: its kinetostatic statics, without friction and load.
#
# One tendon bends all notches, so that the postures lie on one curve. Its points are solved once, along the
# tendon's displacement, on which notches cannot snap, and postures between them are interpolated.

_POINTS = 200  # of the curve
_SHARE = 0.98  # of the displacement that closes all notches: where the curve ends
_DIFFERENCE = 1e-3  # of a level, to either side
_DIFFERENCE_N = 1e-9  # by which tensions along the curve grow at least: they stand still where notches snap


@dataclass(frozen=True)
class NotchModel:
    """A `core.published.QuickModel` of notches; see there.

    Attributes:
        curve_level: of the drive, rising, shape (p,).
        curve_bend: of the notches there, toward +x, shape (p, n) [rad].
        rest_bend: of the notches without load, toward +x and +y, shape (n, 2) [rad].
        notch: height, uncut tube after it, and centroid of each notch, shape (n, 3) [m].
    """

    drives: DriveLevels
    segment_length: Array
    segment_of_link: np.ndarray
    planar: bool
    sets_bends = False
    curve_level: Array
    curve_bend: Array
    rest_bend: Array
    notch: Array

    @property
    def bend_unit(self) -> Array:
        """Half a turn each, shape (s, 2) [rad]."""
        return np.full((len(self.segment_length), 2), math.pi)

    def bend_of(self, joint: str) -> tuple[int, ...] | None:
        """Return the place of the bend that hinge `x<k>` or `y<k>` is part of."""
        return bend_of_link(self.segment_of_link, joint)

    def reach(self, level: Array, rest_bends: Array) -> tuple[Array, Array]:
        """Return where the robot goes; rest bends beyond the model's own are added evenly."""
        bent = self._bent(np.asarray(level)[:, 0]) + self._evenly(rest_bends - self._sums(self.rest_bend))
        return self._tips(bent)[0], self._sums(bent)

    def tip_slopes(self, level: Array, bends: Array) -> Array:
        """Return how the tip moves with the level.

        Notches bend on as those of the frictionless tube do at `level`; the tube that they move stands bent
        by `bends`: what the frictionless one lacks of them is shared evenly by a segment's notches.
        """
        return self._slopes(level, bends, 0)

    def direction_slopes(self, level: Array, bends: Array) -> Array:
        """Return how the tip's direction moves with the level, by the same change of the bends."""
        return self._slopes(level, bends, 1)

    def _slopes(self, level: Array, bends: Array, which: int) -> Array:
        here = float(np.clip(level[0], 0.0, 1.0))
        low, high = max(here - _DIFFERENCE, 0.0), min(here + _DIFFERENCE, 1.0)
        below, at, above = self._bent(np.array([low, here, high]))
        at = at + self._evenly(bends - self._sums(at))
        change = 0.5 * (above - below)
        moved = self._tips(np.stack([at - change, at + change]))[which]
        slopes: Array = ((moved[1] - moved[0]) / (high - low))[:, np.newaxis]
        return slopes

    def _bent(self, level: Array) -> Array:
        """Return the notches' bends at levels of the drive, shape (m, n, 2) [rad]."""
        toward = [np.interp(level, self.curve_level, own) for own in self.curve_bend.T]
        aside = np.broadcast_to(self.rest_bend[:, 1], (len(level), len(self.notch)))
        return np.stack([np.stack(toward, axis=-1), aside], axis=-1)

    def _sums(self, bent: Array) -> Array:
        """Return the segments' bends, shape (..., s, 2), of notches', shape (..., n, 2)."""
        member = self.segment_of_link == np.arange(len(self.segment_length))[:, np.newaxis]
        return np.einsum("sn,...na->...sa", member.astype(float), bent)

    def _evenly(self, bends: Array) -> Array:
        """Return notches' bends that add up to `bends`, equal within a segment, shape (n, 2)."""
        count = np.bincount(self.segment_of_link)[:, np.newaxis]
        evenly: Array = (bends / count)[self.segment_of_link]
        return evenly

    def _tips(self, bent: Array) -> tuple[Array, Array]:
        """Return tips [m] and their directions, shape (m, 3) each, of notches bent so, shape (m, n, 2)."""
        height, uncut, centroid = self.notch.T
        ends, turns = arc_end(bent, height)
        here, R = np.zeros((len(bent), 3)), np.broadcast_to(np.eye(3), (len(bent), 3, 3))
        for k in range(len(self.notch)):
            step = ends[:, k] + centroid[k] * (turns[:, k, :, 0] - [1.0, 0.0, 0.0])
            step = step + uncut[k] * turns[:, k, :, 2]
            here = here + np.einsum("mij,mj->mi", R, step)
            R = R @ turns[:, k]
        return here, R[:, :, 2]


def notch_model(robot: NotchedTubeRobot, actuation: str, largest_bend_rad: float) -> NotchModel:
    """Return the quick model of `robot`; arguments and errors as in `core.kind.Steering.quick_model`."""
    row = notches(robot)
    segment = np.repeat(np.arange(len(robot.segments)), [item.notches for item in robot.segments])
    rest = [(n.segment.rest_curvature_x_per_m, n.segment.rest_curvature_y_per_m) for n in row]
    rest_bend = np.array(rest) * np.array([[notch.pitch_m] for notch in row])
    displacement, tension, bend = _curve(robot)
    total = np.stack([bend[:, segment == k].sum(axis=1) for k in range(len(robot.segments))], axis=1)
    beyond = np.abs(total - total[0]).max(axis=1) > largest_bend_rad
    last = int(np.argmax(beyond)) if beyond.any() else len(bend) - 1
    (drive,) = drives(robot, actuation)
    if last == 0 or not np.ptp(bend):
        raise bends_nothing(robot, drive.column)
    level = tension if actuation == "tension" else displacement
    end = float(level[last])
    change = np.zeros((len(robot.segments), 2, 1))
    change[:, 0, 0] = total[last] - total[0]
    return NotchModel(
        drives=DriveLevels(
            actuation=actuation,
            names=(drive.column,),
            lowest=np.zeros(1),
            tendon=np.array([[end]]),
            bend=change,
            tension=tension[last : last + 1],
        ),
        segment_length=np.bincount(segment, weights=[notch.pitch_m for notch in row]).astype(float),
        segment_of_link=segment,
        planar=robot.bending_axes == "x",
        curve_level=level[: last + 1] / end,
        curve_bend=bend[: last + 1],
        rest_bend=rest_bend,
        notch=np.array([(n.segment.notch_height_m, n.uncut_m, section(n.segment).centroid_m) for n in row]),
    )


def _curve(robot: NotchedTubeRobot) -> tuple[Array, Array, Array]:
    """Return displacements (p,) [m], tensions (p,) [N] and the notches' bends (p, n) [rad], from rest."""
    stiffness = robot.tendons[0].stiffness_N_per_m
    tendon = replace(robot.tendons[0], stiffness_N_per_m=math.inf, pretension_N=0.0)
    free = replace(robot, tendons=(tendon,), friction=Friction(0.0), mount=Mount())
    displacement = np.linspace(0.0, _SHARE * closing_displacement(free), _POINTS)
    zeros = np.zeros((_POINTS, 3))
    rows = Inputs(np.arange(_POINTS, dtype=float), "displacement", displacement[:, np.newaxis], zeros, zeros)
    states = solve_rows([free], [rows], np.zeros(3))
    there = np.isfinite(states.residual[0])
    tension = np.maximum.accumulate(states.tension[0, there])
    tension = tension + _DIFFERENCE_N * np.arange(len(tension))
    return displacement[there] + tension / stiffness, tension, states.w[0, there, :, 1]


# ----------------------------------------------------------------------------------------------------
# How a notched tube is steered in environments, and what its speed test plays.

_BEND_RAD = 0.5  # that the speed test asks of the unbent tube's stiffness: the plateau adds to it


def quick_model(robot: NotchedTubeRobot, actuation: str, largest_bend_rad: float | None) -> NotchModel:
    """Return the frictionless statics by which an environment steers; see `core.kind.Steering`."""
    return notch_model(robot, actuation, LARGEST_BEND_RAD if largest_bend_rad is None else largest_bend_rad)


def input_range(robot: NotchedTubeRobot) -> tuple[Array, Array]:
    """Return the least and largest input that the simulation takes, shape (1,) each.

    A displacement that the notches cannot close tears at the tube; any tension is far above it as a number.
    """
    most = largest_displacement_m(robot) if robot.actuation == "displacement" else math.inf
    return np.array([-math.inf]), np.array([most])


def input_limits(robot: NotchedTubeRobot, actuation: str) -> InputLimits:
    """Return what closes the notches."""
    most = notch_model(robot, actuation, math.inf).drives.tendon[0]
    return InputLimits(np.array([-math.inf]), most, "there the notches are closed")


def speed_case(robot: NotchedTubeRobot, levels: int) -> SpeedCase:
    """Return a cycle to and fro; its peak would bend the tube by half a radian if it stayed as stiff.

    By MuJoCo alone notches are no arcs and their metal has no plateau: the model does not follow the inputs.
    """
    row = notches(robot)
    arm = robot.tendons[0].radius_m + max(section(notch.segment).centroid_m for notch in row)
    peak = _BEND_RAD * bending_seen_from_tendon(robot) * arm
    return SpeedCase(pulled_in_turn([(peak, 1.0)], levels), len(row), rubs=True, follows=False)
