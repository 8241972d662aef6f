"""The twin of catheters: pure kinematics of many at once, or the joints' balance where these do more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import has_mount_slide
from catheter_sim.core.statics import Twin, TwinStates
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter.description import carries_load, joint_stiffness, moved_segment
from catheter_sim.robots.catheter.kernels import pure_values
from catheter_sim.robots.catheter.kinematics import (
    JOINT_KINDS,
    batch_frames,
    elastic_tension_N,
    hinge_angles,
    joint_numbers,
    joint_vector,
    sunk_along,
)
from catheter_sim.robots.catheter.loaded import (
    Unloaded,
    Yielded,
    loaded_rows,
    require_no_law,
    yielded_together,
)
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.robots.catheter.statics import balanced_joints, has_laws

# ----------------------------------------------------------------------------------------------------
# Many catheters at once, alike but for their numbers: joint values and frames, for a twin.
#
# What `pure` knows of a robot on a rigid mount goes through compiled loops; a robot of which `balance`
# knows more, or whose mount gives way, goes through that. What a load adds is found robot by robot, all
# rows at once.

MODEL = "balance"


def batch_joints(
    robots: Sequence[CatheterRobot], inputs: Sequence[Inputs], gravity_mps2: Array
) -> tuple[Array, Array, Array]:
    """Return what each pair's joint does along each robot's own inputs, before any load moves it.

    It is `pure`'s, or `balance`'s if it must be: angles [rad] and advances [m] (B, r, t), tensions (B, r, t)
    [N], and how far the mount has given way (B, r) [m]. NaN of a robot that one of its rows leads beyond what
    its joints or the model can do.
    """
    first = robots[0]
    moved = [moved_segment(first, pair) for pair in range(len(first.tendons))]
    joint = np.array([JOINT_KINDS[first.segments[index].joint] for index in moved])
    ways = np.array([item.tendon for item in inputs])
    numbers = np.array(
        [[_pair_numbers(robot, k, index) for k, index in enumerate(moved)] for robot in robots]
    )
    values, tension = np.empty(ways.shape), np.empty(ways.shape)
    sunk_m = np.zeros(ways.shape[:2])
    pure_values(joint, numbers, np.ascontiguousarray(ways), values)
    for place, (robot, driven) in enumerate(zip(robots, inputs, strict=True)):
        try:
            require_no_law(robot, driven, loaded_rows(robot, driven, gravity_mps2), MODEL)
            if has_laws(robot) or has_mount_slide(robot):
                sunk_m[place] = sunk_along(robot, driven, MODEL)
                values[place], tension[place], _ = balanced_joints(robot, driven, sunk_m[place])
            if not has_laws(robot):
                for pair in range(len(moved)):
                    tension[place, :, pair] = elastic_tension_N(robot, pair, values[place, :, pair])
        except InputError:
            values[place] = np.nan
        if np.isnan(values[place]).any():
            values[place], tension[place] = np.nan, np.nan
    return values, tension, sunk_m


def batch_loads(
    robots: Sequence[CatheterRobot],
    inputs: Sequence[Inputs],
    gravity_mps2: Array,
    values: Array,
    tension: Array,
    sunk_m: Array,
    every: int,
) -> list[tuple[int, np.ndarray, Yielded]]:
    """Return what loads do to robots at each `every`-th row: a robot's index, which of these rows, and what.

    `values`, `tension`, `sunk_m` are of all rows, as of `batch_joints`; at a robot of NaN none is looked for.
    """
    asked = []
    for place, (robot, driven) in enumerate(zip(robots, inputs, strict=True)):
        rows = loaded_rows(robot, driven, gravity_mps2)
        rows = rows[rows % every == 0]
        if len(rows) and not np.isnan(values[place]).any():
            there = (item[place, rows] for item in (values, tension, sunk_m))
            asked.append((place, Unloaded(robot, driven, rows, *there)))
    found = yielded_together([item for _, item in asked], gravity_mps2)
    return [(place, item.rows // every, own) for (place, item), own in zip(asked, found, strict=True)]


def _pair_numbers(robot: CatheterRobot, pair: int, index: int) -> tuple[float, ...]:
    """Return the numbers of `kernels.pure_values` for a pair that moves the segment `index`."""
    item, segment = robot.tendons[pair], robot.segments[index]
    compliance_m = 0.0
    if segment.joint == "bending":
        compliance_m = joint_stiffness(robot, segment) / segment.arm_m / item.stiffness_N_per_m
    return 0.5 * item.play_m, item.slack_m, *joint_numbers(segment, compliance_m)


# ----------------------------------------------------------------------------------------------------
# The twin of catheters: pure kinematics, or the joints' balance where these do more, all at once.


@dataclass(frozen=True)
class CatheterTwin:
    """Twin of catheters.

    Attributes:
        carries_load: whether the robots bend, by joints and tendons that are springs, which may rub.
    """

    carries_load: bool

    def solve(
        self,
        robots: Sequence[CatheterRobot],
        arriving: Sequence[Inputs],
        gravity_mps2: Array,
        elements: Sequence[int],
        every: int,
    ) -> TwinStates:
        """Return where robots are, as `Twin.solve` says; NaN of one that a row leads out of its range."""
        values, tension, sunk_m = batch_joints(robots, arriving, gravity_mps2)
        loads = batch_loads(robots, arriving, gravity_mps2, values, tension, sunk_m, every)
        values, tension = values[:, ::every], tension[:, ::every]
        p_w, R_w = batch_frames(robots, values, elements)
        p_w[..., 2] -= sunk_m[:, ::every, np.newaxis]
        wanted = list(elements)
        for robot, rows, found in loads:
            none = np.where(np.isnan(found.left), np.nan, 0.0)[:, np.newaxis]
            p_w[robot, rows] += found.moved_m[:, wanted] + none[..., np.newaxis]
            R_w[robot, rows] = found.turn[:, wanted] @ R_w[robot, rows] + none[..., np.newaxis, np.newaxis]
            tension[robot, rows] += found.tension + none

        def joint_angles() -> Array:
            angles = hinge_angles(robots[0], joint_vector(robots[0], values))
            for robot, rows, found in loads:
                angles[robot, rows] += found.joint_angles
            return angles

        return TwinStates(p_w, R_w, joint_angles, tension)


def twin(robot: CatheterRobot, actuation: str) -> Twin[CatheterRobot]:
    """Return the twin of robots like `robot`, which displacements drive."""
    return CatheterTwin(carries_load(robot))
