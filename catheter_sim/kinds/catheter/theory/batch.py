"""Many catheters at once, alike but for their numbers: joint values and frames, for a twin.

What `pure` knows of a robot on a rigid mount goes through compiled loops; a robot of which `balance` knows
more, or whose mount gives way, goes through that. What a load adds is found robot by robot, all rows at once.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import has_mount_slide
from catheter_sim.errors import InputError
from catheter_sim.kinds.catheter.layout import elements, joint_stiffness, moved_segment
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.kinds.catheter.theory.balance import balanced_joints, has_laws
from catheter_sim.kinds.catheter.theory.batch_kernel import (
    BENDING,
    PRISMATIC,
    RIGID,
    TORSION,
    element_frames,
    pure_values,
)
from catheter_sim.kinds.catheter.theory.loaded import (
    Unloaded,
    Yielded,
    loaded_rows,
    require_no_law,
    yielded_together,
)
from catheter_sim.kinds.catheter.theory.pure import elastic_tension_N, sunk_along
from catheter_sim.kinds.catheter.theory.tendons import largest_angle_rad

MODEL = "balance"
_KINDS = {"bending": BENDING, "torsion": TORSION, "prismatic": PRISMATIC, "rigid": RIGID}


def batch_joints(
    robots: Sequence[CatheterRobot], inputs: Sequence[Inputs], gravity_mps2: Array
) -> tuple[Array, Array, Array]:
    """Return what each pair's joint does along each robot's own inputs, before any load moves it.

    It is `pure`'s, or `balance`'s if it must be. What a load adds is `batch_loads`'.

    Returns:
        Angles [rad] and advances [m], shape (B, r, t), tensions, shape (B, r, t) [N], and how far the mount
        has given way, (B, r) [m]; NaN of a robot that one of its rows leads beyond what its joints or the
        model can do.
    """
    first = robots[0]
    moved = [moved_segment(first, pair) for pair in range(len(first.tendons))]
    joint = np.array([_KINDS[first.segments[index].joint] for index in moved])
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

    Args:
        robots, inputs, gravity_mps2: as of `batch_joints`.
        values, tension, sunk_m: of all rows, as it returns them; at a robot of NaN none is looked for.
        every: 1 or more.
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


def batch_frames(
    robots: Sequence[CatheterRobot], values: Array, wanted: Sequence[int]
) -> tuple[Array, Array]:
    """Return the distal faces of the elements `wanted` (rising indices) at the pairs' values (B, r, t).

    Returns:
        Centres, shape (B, r, n, 3) [m], and orientations, shape (B, r, n, 3, 3).
    """
    first = robots[0]
    mover = np.full(len(first.segments), -1)
    mover[[moved_segment(first, pair) for pair in range(len(first.tendons))]] = np.arange(len(first.tendons))
    joint = np.array([_KINDS[segment.joint] for segment in first.segments])
    parts = [elements(robot) for robot in robots]
    segment = np.array([parts[0][index].segment for index in wanted], dtype=np.int64)
    shape = (*values.shape[:2], len(segment))
    places, rotations = np.empty((*shape, 3)), np.empty((*shape, 3, 3))
    faces = np.array([[own[index].face_m for index in wanted] for own in parts])
    numbers = np.array([_segment_numbers(robot) for robot in robots])
    element_frames(joint, mover, numbers, segment, faces, np.ascontiguousarray(values), places, rotations)
    return places, rotations


def _pair_numbers(robot: CatheterRobot, pair: int, index: int) -> tuple[float, ...]:
    """Return the numbers of `batch_kernel.pure_values` for a pair that moves the segment `index`."""
    item, segment = robot.tendons[pair], robot.segments[index]
    drive = 0.5 * item.play_m, item.slack_m
    if segment.joint == "bending":
        compliance_m = joint_stiffness(robot, segment) / segment.arm_m / item.stiffness_N_per_m
        gaps = 2.0 * (segment.rings + 1)
        largest = largest_angle_rad(segment)
        return *drive, compliance_m, segment.rest_rad, segment.half_gap_m, segment.arm_m, gaps, largest
    return *drive, segment.tendon_radius_m, segment.wrap_rad, segment.wrap_height_m, 0.0, 0.0, 0.0


def _segment_numbers(robot: CatheterRobot) -> list[tuple[float, float, float]]:
    """Return the numbers of `batch_kernel.element_frames` for every segment."""
    found = []
    for segment in robot.segments:
        toward = (0.0, 0.0)
        if segment.joint == "bending":
            toward = (1.0, 0.0) if segment.bends_toward == "x" else (0.0, 1.0)
        elif segment.joint == "prismatic":
            toward = segment.tube_curvature_x_per_m, segment.tube_curvature_y_per_m
        found.append((segment.length_m, *toward))
    return found
