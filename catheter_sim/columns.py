"""From a robot's states to its output columns: the one place that writes them, in the columns' units.

What columns show is worked out once (`shown_by`); then any number of rows, of one robot or of many that are
alike but for their numbers, are written at once (`write_columns`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.channels import QUATERNION, output_channels, outputs_of
from catheter_sim.core.markers import marker_points, offsets_of, points_beside
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.tables import Table

Places = tuple[tuple[int, int], ...]  # of columns among all, and what each shows


@dataclass(frozen=True)
class Shown:
    """What output columns show of a robot.

    Attributes:
        columns: their names.
        elements: indices of the elements whose positions are shown, or whose orientation, or beside which
            there is a marker that is, rising.
        tip: place among `elements` of the one whose orientation is shown; None: no orientation is.
        markers: of every marker that is shown, its element's place among `elements`, and its own among the
            robot's markers.
        coordinates: of every coordinate its place among `columns`, its point's among `elements` and then
            `markers`, and its axis, shape (n,) each.
        quaternion: places of columns, and which of (w, x, y, z) each is.
        joints: places of columns, and which joint's angle each is.
        angles: places of columns, and the joints whose angles' sum each is.
        tensions: places of columns, and which tendon's each is.
    """

    columns: tuple[str, ...]
    elements: tuple[int, ...]
    tip: int | None
    markers: Places
    coordinates: tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]
    quaternion: Places
    joints: Places
    angles: tuple[tuple[int, slice], ...]
    tensions: Places


def shown_by(robot: RobotSpec, columns: Sequence[str]) -> Shown:
    """Return what `columns` show of `robot`, or of any robot like it."""
    outputs = outputs_of(robot)
    count = outputs.elements
    last = count - 1
    place = {f"body_{k + 1}": k for k in range(count)} | {"tip": last}
    place |= {f"marker_{marker.name}": count + k for k, marker in enumerate(robot.markers)}
    coordinate = {
        f"{point}_{letter}_mm": (k, axis) for point, k in place.items() for axis, letter in enumerate("xyz")
    }
    found = [(at, *coordinate[name]) for at, name in enumerate(columns) if name in coordinate]
    joints = {f"joint_{name}_deg": k for k, name in enumerate(outputs.joints)}
    tensions = {f"tension_{name}_N": k for k, name in outputs.tensions.items()}
    components = {name: k for k, name in enumerate(QUATERNION)}
    quaternion = _places(columns, components)
    wanted = {k for _, k, _ in found}
    markers = sorted(k - count for k in wanted if k >= count)
    holding = [robot.markers[k].element - 1 for k in markers]
    elements = sorted({k for k in wanted if k < count} | {*holding} | ({last} if quaternion else set()))
    at, of, axis = np.array(found, dtype=np.intp).reshape(-1, 3).T
    return Shown(
        columns=tuple(columns),
        elements=tuple(elements),
        tip=elements.index(last) if quaternion else None,
        markers=tuple((elements.index(element), k) for element, k in zip(holding, markers, strict=True)),
        coordinates=(at, np.searchsorted([*elements, *(count + k for k in markers)], of), axis),
        quaternion=quaternion,
        joints=_places(columns, joints),
        angles=tuple(
            (place, outputs.angles[name]) for place, name in enumerate(columns) if name in outputs.angles
        ),
        tensions=_places(columns, tensions),
    )


def write_columns(
    shown: Shown, p_w: Array, R_w: Array | None, joint_angles: Callable[[], Array], tension: Array
) -> Array:
    """Return the values of output columns, shape (..., o), in the columns' units; NaN where a state is.

    Args:
        shown: the columns.
        p_w: positions of `shown.elements`, then of `shown.markers`, shape (..., k, 3) [m].
        R_w: the tip's orientation, shape (..., 3, 3); None where none is shown.
        joint_angles: gives the joints' angles, shape (..., j) [rad]; asked only where a column shows them.
        tension: at the actuators, shape (..., t) [N].

    Raises:
        ValueError: a column is left that nothing fills.
    """
    result = np.full((*tension.shape[:-1], len(shown.columns)), np.nan)
    filled = {*shown.coordinates[0].tolist()}
    for places in (shown.quaternion if R_w is not None else (), shown.joints, shown.angles, shown.tensions):
        filled.update(place for place, _ in places)
    if len(filled) < len(shown.columns):
        missing = [name for place, name in enumerate(shown.columns) if place not in filled]
        raise ValueError(f"nothing fills the columns {', '.join(missing)}")
    at, point, axis = shown.coordinates
    if len(at):
        result[..., at] = p_w[..., point, axis] * 1e3
    if R_w is not None:
        components = _quaternions(R_w)
        for column, component in shown.quaternion:
            result[..., column] = components[..., component]
    if shown.joints or shown.angles:
        degrees = np.degrees(joint_angles())
        for column, joint in shown.joints:
            result[..., column] = degrees[..., joint]
        for column, joints in shown.angles:
            result[..., column] = degrees[..., joints].sum(axis=-1)
    for column, tendon in shown.tensions:
        result[..., column] = tension[..., tendon]
    return result


def with_markers(shown: Shown, robots: Sequence[RobotSpec], p_w: Array, R_w: Array) -> Array:
    """Return positions of the elements that are shown, then of the markers, shape (B, r, k + m, 3) [m].

    Args:
        shown: the columns.
        robots: of which the states are, B of them: their markers are the same but for where they lie.
        p_w: positions of `shown.elements`, shape (B, r, k, 3) [m].
        R_w: their orientations, shape (B, r, k, 3, 3).
    """
    if not shown.markers:
        return p_w
    at, numbers = (list(part) for part in zip(*shown.markers, strict=True))
    offset = np.array([offsets_of(robot.markers)[numbers] for robot in robots])[:, np.newaxis]
    return np.concatenate([p_w, points_beside(p_w[:, :, at], R_w[:, :, at], offset)], axis=2)


def posture_columns(
    robot: RobotSpec, postures: Sequence[Posture], names: Sequence[str] | None = None
) -> dict[str, Array]:
    """Return output columns of `postures` by name (default: all), each of shape (rows,), in its unit."""
    chosen = list(names) if names is not None else output_channels(robot)
    if not postures:
        return {name: np.zeros(0) for name in chosen}
    shown = shown_by(robot, chosen)
    p_w = np.array([posture.p_w for posture in postures])[:, list(shown.elements)]
    if shown.markers:
        seen = [number for _, number in shown.markers]
        p_w = np.concatenate([p_w, np.array([_markers(robot, item)[seen] for item in postures])], axis=1)
    values = write_columns(
        shown,
        p_w,
        None if shown.tip is None else np.array([posture.R_w[-1] for posture in postures]),
        lambda: np.array([posture.joint_angles for posture in postures]),
        np.array([posture.actuator_tension for posture in postures]),
    )
    return dict(zip(chosen, np.ascontiguousarray(values.T), strict=True))


def output_table(
    robot: RobotSpec, time_s: Array, postures: Sequence[Posture], names: Sequence[str] | None = None
) -> Table:
    """Return the columns `names` (default: all) of `postures`, one row each, in the columns' units."""
    return Table(time_s=time_s[: len(postures)], columns=posture_columns(robot, postures, names))


def _markers(robot: RobotSpec, posture: Posture) -> Array:
    """Return where all markers of a robot are seen, shape (m, 3) [m]."""
    if posture.markers_w is not None:
        return posture.markers_w
    return marker_points(robot.markers, posture.p_w, posture.R_w)


def _places(columns: Sequence[str], indices: dict[str, int]) -> Places:
    return tuple((place, indices[name]) for place, name in enumerate(columns) if name in indices)


def _quaternions(R_w: Array) -> Array:
    """Return (w, x, y, z) of orientations (..., 3, 3), w >= 0; NaN where an orientation is."""
    flat = R_w.reshape(-1, 3, 3)
    parts = np.full((len(flat), 4), np.nan)
    balanced = np.isfinite(flat).all(axis=(1, 2))
    if balanced.any():
        parts[balanced] = Rotation.from_matrix(flat[balanced]).as_quat(canonical=True, scalar_first=True)
    return parts.reshape(*R_w.shape[:-2], 4)
