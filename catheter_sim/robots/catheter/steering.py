"""How a catheter is steered in environments, by a quick model of rigid rings on taut pairs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.published import DriveLevels, InputLimits, SpeedCase, bends_nothing
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter.description import (
    drives,
    elements,
    hinge_counts,
    hinge_names,
    joint_stiffness,
    moved_segment,
    moved_segments,
    moving,
    turning,
)
from catheter_sim.robots.catheter.kinematics import (
    angle_rad,
    arm_m,
    input_range_m,
    pulled_m,
    tool_frame,
    tool_jacobian,
)
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment

# ----------------------------------------------------------------------------------------------------
# The quick model of a catheter: rigid rings and modules on taut, inextensible pairs.
#
# An angle follows from a pair's displacement by the papers' equations, which are not linear
# (`robots.catheter.kinematics`), the tip from the joint values by the product of exponentials. What a
# robot has besides, stretching tendons, slack, friction or a tube that bends, is left out.

_NO_ELASTIC_JOINT_N = 1.0  # assumed: the unit of tensions in a robot of which nothing springs back
_LEAST_ARM_M = 1e-5  # a tendon that is all unwound has no arm: its angle would go on without end


@dataclass(frozen=True)
class CatheterModel:
    """A `core.published.QuickModel` of torsion, bending and prismatic joints; see there.

    Bends are the joint values, shape (m,) [rad, m], in the order of `description.moving`.

    Attributes:
        segment_length: with every tube pushed out, shape (s,) [m].
        bend_unit: half a turn [rad], or the stroke of a tube [m], shape (m,).
        robot: the catheter.
        moved: the segment that each drive moves.
        value: index of its joint value, shape (d,).
        value_of_joint: index of the joint value to which a joint of the simulation adds, by its name.
    """

    drives: DriveLevels
    segment_length: Array
    planar: bool
    bend_unit: Array
    robot: CatheterRobot
    moved: tuple[CatheterSegment, ...]
    value: np.ndarray
    value_of_joint: dict[str, int]
    sets_bends = True

    def bend_of(self, joint: str) -> tuple[int, ...] | None:
        """Return the place of the joint value that a gap's hinge, a module's hinge or a slide is part of."""
        return (self.value_of_joint[joint],) if joint in self.value_of_joint else None

    def reach(self, level: Array, rest_bends: Array) -> tuple[Array, Array]:
        """Return tips and joint values at `level`; what a pair turns its joint by is added to the rest's."""
        values = np.tile(rest_bends, (len(level), 1))
        displacement = level @ self.drives.tendon.T
        for drive, segment in enumerate(self.moved):
            moved = displacement[:, drive]
            turned = moved if segment.joint == "prismatic" else angle_rad(segment, moved) - segment.rest_rad
            values[:, self.value[drive]] += turned
        return tool_frame(self.robot, values)[..., :3, 3], values

    def tip_slopes(self, level: Array, bends: Array) -> Array:
        """Return how the tip moves with the levels where the joints stand at `bends`."""
        return self._tool_slopes(bends)[:3]

    def direction_slopes(self, level: Array, bends: Array) -> Array:
        """Return how the tip's direction moves with the levels where the joints stand at `bends`."""
        return np.cross(
            self._tool_slopes(bends)[3:], tool_frame(self.robot, bends)[:3, 2, np.newaxis], axis=0
        )

    def _tool_slopes(self, bends: Array) -> Array:
        """Return the tip's velocity and the tool's angular velocity for each level, shape (6, d)."""
        full = np.diag(self.drives.tendon)
        rates = [
            size / _arm_at(segment, float(bends[value]))
            for size, segment, value in zip(full, self.moved, self.value, strict=True)
        ]
        slopes: Array = tool_jacobian(self.robot, bends)[:, self.value] * np.array(rates)
        return slopes


def catheter_model(robot: CatheterRobot, largest_bend_rad: float | None) -> CatheterModel:
    """Return the quick model of `robot`; arguments and errors as in `envs.robots.quick_model`."""
    if largest_bend_rad is not None:
        raise InputError(
            f"{robot.name}: largest_bend_rad = {largest_bend_rad:g}: does not apply to catheters, whose "
            "drives range over their joints' own limits; leave it out and set segments.<name>.limit_deg"
        )
    places = moving(robot)
    joints = [robot.segments[place] for place in places]
    segments = [moved_segment(robot, pair) for pair in range(len(robot.tendons))]
    value = np.array([places.index(place) for place in segments])
    return CatheterModel(
        drives=_drives(robot, [robot.segments[place] for place in segments], value),
        segment_length=np.array([part.length_m + part.stroke_m for part in robot.segments]),
        planar=all(_stays_in_plane(part) for part in joints),
        bend_unit=np.array([part.stroke_m if part.joint == "prismatic" else math.pi for part in joints]),
        robot=robot,
        moved=tuple(robot.segments[place] for place in segments),
        value=value,
        value_of_joint=_value_of_joint(robot, joints),
    )


def _drives(robot: CatheterRobot, moved: list[CatheterSegment], value: np.ndarray) -> DriveLevels:
    names = tuple(drive.column for drive in drives(robot, "displacement"))
    full = []
    for name, part in zip(names, moved, strict=True):
        # A joint that is bent at rest is nearer to one of its limits: the range is the same to both sides.
        ends = np.array([-part.limit_rad, part.limit_rad])
        full.append(part.stroke_m if part.joint == "prismatic" else float(np.abs(pulled_m(part, ends)).min()))
        if full[-1] == 0.0:
            raise bends_nothing(robot, name)
    holding = np.array([_holding_N(robot, part) for part in moved])
    bend = np.zeros((len(moved), len(moved)))
    bend[value, np.arange(len(moved))] = [
        size if part.joint == "prismatic" else float(angle_rad(part, size)) - part.rest_rad
        for size, part in zip(full, moved, strict=True)
    ]
    return DriveLevels(
        actuation="displacement",
        names=names,
        lowest=np.array([0.0 if part.joint == "prismatic" else -1.0 for part in moved]),
        tendon=np.diag(full),
        bend=bend,
        tension=np.where(holding > 0.0, holding, holding.max() or _NO_ELASTIC_JOINT_N),
    )


def _holding_N(robot: CatheterRobot, segment: CatheterSegment) -> float:
    """Return the tension that holds a bending joint at its limit against its stiffness [N]; 0 of others."""
    if segment.joint != "bending":
        return 0.0
    moment = joint_stiffness(robot, segment) * (segment.limit_rad - segment.rest_rad)
    return moment / float(arm_m(segment, segment.limit_rad))


def _arm_at(segment: CatheterSegment, value: float) -> float:
    """Return the displacement per change of the joint value within the joint's limit [m/rad]; 1 of a tube."""
    if segment.joint == "prismatic":
        return 1.0
    angle = min(max(value, -segment.limit_rad), segment.limit_rad)
    return max(float(arm_m(segment, angle)), _LEAST_ARM_M)


def _stays_in_plane(segment: CatheterSegment) -> bool:
    if segment.joint == "prismatic":
        return segment.tube_curvature_y_per_m == 0.0
    return segment.joint == "bending" and segment.bends_toward == "x"


def _value_of_joint(robot: CatheterRobot, joints: list[CatheterSegment]) -> dict[str, int]:
    """Return the joint value to which each joint of the simulation adds, by its name in the model."""
    ends = np.cumsum([0, *hinge_counts(robot)]).tolist()
    names = hinge_names(robot)
    hinges = {part.name: names[slice(*ends[k : k + 2])] for k, part in enumerate(turning(robot))}
    return {name: value for value, part in enumerate(joints) for name in hinges.get(part.name, [part.name])}


# ----------------------------------------------------------------------------------------------------
# How a catheter is steered in environments, and what its speed test plays.

_BEND_RAD = 1.0  # that the speed test asks of each joint


def quick_model(robot: CatheterRobot, actuation: str, largest_bend_rad: float | None) -> CatheterModel:
    """Return the rigid rings and modules by which an environment steers; see `core.kind.Steering`."""
    return catheter_model(robot, largest_bend_rad)


def input_range(robot: CatheterRobot) -> tuple[Array, Array]:
    """Return the least and largest displacement of each pair that the simulation takes, (t,) each [m]."""
    return input_range_m(robot)


def input_limits(robot: CatheterRobot, actuation: str) -> InputLimits:
    """Return what brings each joint to the limit that the robot's file gives it."""
    own = catheter_model(robot, None).drives
    most = np.diag(own.tendon)
    why = "there the joint is at its limit (segments.<name>.limit_deg, or stroke_mm)"
    return InputLimits(own.lowest * most, most, why)


def speed_case(robot: CatheterRobot, levels: int) -> SpeedCase:
    """Return a cycle: pairs turn their joints by a radian to either side, a tube goes out by its stroke."""
    phase = np.linspace(0.0, 2.0 * np.pi, levels, endpoint=False)
    moved = moved_segments(robot)
    out, turn = 0.5 * (1.0 - np.cos(phase)), _BEND_RAD * np.sin(phase)
    inputs = [part.stroke_m * out if part.joint == "prismatic" else pulled_m(part, turn) for part in moved]
    return SpeedCase(np.stack(inputs, axis=1), len(elements(robot)), rubs=False, follows=True)
