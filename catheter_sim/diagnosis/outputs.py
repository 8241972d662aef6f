"""From a robot's state along a trial to the output columns that a data set asks for, in file units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.effects.apply import observed_frames
from catheter_sim.robots.channels import body_count, joint_names
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array

_QUATERNION = ("tip_qw", "tip_qx", "tip_qy", "tip_qz")


def wanted_disks(columns: Sequence[str], count: int) -> list[int]:
    """Return the indices of the disks whose frames the output columns show."""
    found = {
        count - 1 if name.startswith("tip_") else int(name.split("_")[1]) - 1
        for name in columns
        if name.startswith(("tip_", "body_"))
    }
    return sorted(found)


def output_columns(
    robot: Robot,
    columns: Sequence[str],
    frames: tuple[Sequence[int], Array, Array],
    joint_angles: Callable[[], Array],
    tension: Array,
    moved: Mapping[str, Array] | None = None,
) -> Array:
    """Return output columns from a robot's state along r rows, shape (r, o), in file units.

    Args:
        robot: with effects; those that act on what is measured are applied.
        columns: names of output columns.
        frames: indices of disks, their positions (r, k, 3) [m] and orientations (r, k, 3, 3).
        joint_angles: gives the hinges' angles in the order of `joint_names`, shape (r, j) [rad].
        tension: at the actuator, shape (r, t) [N].
        moved: angles of a catheter's joints by column, shape (r,) each [rad].
    """
    disks, p_w, R_w = frames
    last = body_count(robot) - 1
    at, disk, axis, others = _places(tuple(columns), tuple(disks), last)
    names = [name for _, name in others]
    turned = [list(disks).index(last)] if any(name in _QUATERNION for name in names) else []
    result = np.empty((len(tension), len(columns)))
    values: dict[str, Array] = {}
    if len(disks):
        p_w, R_w = observed_frames(robot, p_w, R_w[:, turned])
        result[:, at] = p_w[:, disk, axis] * 1e3
        values |= _quaternions(R_w[:, 0]) if turned else {}
    if not others:
        return result
    if any(name.startswith("joint_") for name in names):
        angles = np.degrees(joint_angles())
        values |= {f"joint_{name}_deg": angles[:, i] for i, name in enumerate(joint_names(robot))}
    values |= {name: np.degrees(angle) for name, angle in (moved or {}).items()}
    tendons = [tendon.name for tendon in robot.tendons]
    values |= {f"tension_{name}_N": tension[:, i] for i, name in enumerate(tendons)}
    for column, name in others:
        result[:, column] = values[name]
    return result


@lru_cache(maxsize=64)  # a diagnosis asks for the same columns of every robot
def _places(
    columns: tuple[str, ...], disks: tuple[int, ...], last: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[tuple[int, str], ...]]:
    """Return where the coordinates among the columns are found, and which columns are none.

    Args:
        columns: names.
        disks: indices.
        last: the disk at the tip.

    Returns:
        Of every coordinate its index in `columns`, its disk's in `disks`, and its axis, shape (k,) each; of
        every other column its index and name.
    """
    coordinates = {
        f"{body}_{letter}_mm": (place, axis)
        for place, index in enumerate(disks)
        for body in (f"body_{index + 1}", *(["tip"] if index == last else []))
        for axis, letter in enumerate("xyz")
    }
    found = [(at, *coordinates[name]) for at, name in enumerate(columns) if name in coordinates]
    at, disk, axis = np.array(found, dtype=np.intp).reshape(-1, 3).T
    return at, disk, axis, tuple((i, name) for i, name in enumerate(columns) if name not in coordinates)


def _quaternions(R_w: Array) -> dict[str, Array]:
    parts = np.full((len(R_w), 4), np.nan)
    balanced = np.isfinite(R_w).all(axis=(1, 2))
    if balanced.any():
        parts[balanced] = Rotation.from_matrix(R_w[balanced]).as_quat(canonical=True, scalar_first=True)
    return {name: parts[:, index] for index, name in enumerate(_QUATERNION)}
