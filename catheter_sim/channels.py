"""Names of a robot's input and output columns, inputs from columns, and states to columns."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Drive, Inputs, Outputs, Quantity, shares, sums
from catheter_sim.core.posture import Posture, marker_points, offsets_of, points_beside
from catheter_sim.core.robot import RobotSpec, by_identity
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots import kind_of
from catheter_sim.tables import Table, own_clock
from catheter_sim.units import si_factor

# ----------------------------------------------------------------------------------------------------
# Names of a robot's input and output columns, and inputs from their columns.
#
# Columns carry their unit in the name; the values in a `Table` are in that unit, those in `Inputs` and
# `Posture` are SI.

FORCE_CHANNELS = ("force_tip_x_N", "force_tip_y_N", "force_tip_z_N")
MOMENT_CHANNELS = ("moment_tip_x_Nm", "moment_tip_y_Nm", "moment_tip_z_Nm")
ON_BODIES = ("force_body_<k>_x_N ...", "moment_body_<k>_x_Nm ...")  # as listings name them
_ON_BODY = re.compile(r"(force|moment)_body_([1-9][0-9]*)_([xyz])_(N|Nm)")
_UNITS = {"force": "N", "moment": "Nm"}
QUATERNION = ("tip_qw", "tip_qx", "tip_qy", "tip_qz")
_LARGEST_INPUT = 1e15  # in the column's unit; squares of what lies far beyond are no numbers any more


def actuations(robot: RobotSpec) -> tuple[str, ...]:
    """Return the kinds of actuator inputs that `robot` takes."""
    return kind_of(robot).drives.actuations(robot)


def checked_actuation(robot: RobotSpec, actuation: str | None) -> str:
    """Return `actuation`; None: the robot's own.

    Raises:
        InputError: the robot takes no such inputs.
    """
    if actuation is None:
        return robot.actuation
    if actuation not in actuations(robot):
        raise unknown("actuation", str(actuation), actuations(robot), robot.name)
    return actuation


def drives_of(robot: RobotSpec, actuation: str | None = None) -> tuple[Drive, ...]:
    """Return the robot's input columns; none where it takes no such inputs. Default: its own actuation."""
    face, kind = kind_of(robot).drives, actuation or robot.actuation
    return face.drives(robot, kind) if kind in face.actuations(robot) else ()


def outputs_of(robot: RobotSpec) -> Outputs:
    """Return what the robot's output columns are besides the tip's."""
    return kind_of(robot).drives.outputs(robot)


def channel_of(robot: RobotSpec) -> list[str]:
    """Return each tendon's channel, in the tendons' order; several tendons may share one."""
    return list(_channel_of(drives_of(robot)))


@by_identity(1)
def _channel_of(drives: tuple[Drive, ...]) -> tuple[str, ...]:
    names = {index: drive.channel for drive in drives for index in drive.tendons}
    return tuple(names[index] for index in range(len(names)))


def channel_gains(robot: RobotSpec) -> Array:
    """Return how far each tendon is pulled while its channel is pulled by 1, shape (t,); below 0: let out."""
    return _channel_gains(drives_of(robot))


@by_identity(1)
def _channel_gains(drives: tuple[Drive, ...]) -> Array:
    found = np.ones(sum(len(drive.tendons) for drive in drives))
    for drive in drives:
        if drive.gains:
            found[list(drive.tendons)] = drive.gains
    return found


def input_channels(robot: RobotSpec, actuation: str | None = None) -> list[str]:
    """Return the names of the robot's actuator columns (`tension_right_N`), each once."""
    return [drive.column for drive in drives_of(robot, actuation)]


def channel_inputs(robot: RobotSpec, inputs: Inputs) -> Array:
    """Return the input columns' values, shape (r, c), SI: a column's tension is its tendons' sum."""
    return np.asarray(inputs.tendon @ sums(drives_of(robot, inputs.actuation), len(robot.tendons)))


def tendon_inputs(robot: RobotSpec, actuation: str, values: Array) -> Array:
    """Return the input of each tendon, shape (r, t), SI: a column's tension is divided among its tendons.

    Args:
        robot: of which the columns are.
        actuation: which columns they are.
        values: of the columns, SI, shape (r, c).
    """
    return np.asarray(values @ shares(drives_of(robot, actuation), len(robot.tendons)).T)


def body_count(robot: RobotSpec) -> int:
    """Return the number of elements (cells, links or disks), the base's fixed one not counted."""
    return outputs_of(robot).elements


def joint_names(robot: RobotSpec) -> list[str]:
    """Return the joints' names, base to tip; each kind's `drives.outputs` says what they mean."""
    return list(outputs_of(robot).joints)


def output_channels(robot: RobotSpec) -> list[str]:
    """Return the names of every output column that the robot has."""
    return [name for family in COLUMN_FAMILIES for name in family.names(robot)]


def read_inputs(robot: RobotSpec, table: Table) -> Inputs:
    """Return the rows of `table` as SI inputs of `robot`.

    A tendon whose channel the table leaves out has tension or displacement zero. The clock is the
    inputs' own, from zero: stamps in epoch seconds mean what the same rows mean from zero.

    Raises:
        InputError: unknown or mixed channels, a missing or huge value, a tension below zero, an advance
            beyond its stroke, or time that does not increase; the message names the file and the row.
    """
    by_kind = {kind: drives_of(robot, kind) for kind in actuations(robot)}
    columns = {kind: [drive.column for drive in drives] for kind, drives in by_kind.items()}
    choices = [*(name for names in columns.values() for name in names), *FORCE_CHANNELS, *MOMENT_CHANNELS]
    for name in table.columns:
        if name not in choices and _element_of(name) is None:
            raise unknown("input channel", name, [*choices, *ON_BODIES], table.where)
    bodies = _bodies_in(robot, table)
    used = [kind for kind, names in columns.items() if any(name in table.columns for name in names)]
    if len(used) > 1:
        raise InputError(f"{table.where}: {' and '.join(used)} channels cannot be mixed")
    kind = used[0] if used else robot.actuation
    table.require_complete()
    table.require_increasing_time()
    for name, values in table.columns.items():
        beyond = np.abs(values) > _LARGEST_INPUT
        if beyond.any():
            row = int(np.argmax(beyond))
            raise InputError(
                f"{table.row(row)}: {name} = {values[row]:g}: must lie within {_LARGEST_INPUT:g}"
            )
    rows = len(table.time_s)

    def column(name: str) -> Array:
        return table.columns[name] * si_factor(name) if name in table.columns else np.zeros(rows)

    tendon = np.zeros((rows, len(robot.tendons)))
    for drive in by_kind[kind]:
        values = column(drive.column)
        _check_range(drive, values, table)
        tendon[:, drive.tendons] = values[:, np.newaxis] * np.array(drive.parts)
    return Inputs(
        time_s=own_clock(table.time_s),
        actuation=kind,
        tendon=tendon,
        force_tip=np.stack([column(name) for name in FORCE_CHANNELS], axis=1),
        moment_tip=np.stack([column(name) for name in MOMENT_CHANNELS], axis=1),
        bodies=bodies,
        **{
            f"{what}_body": np.stack(
                [[column(f"{what}_body_{k}_{axis}_{unit}") for axis in "xyz"] for k in bodies], axis=0
            ).transpose(2, 0, 1)
            for what, unit in _UNITS.items()
            if bodies
        },
    )


def acts_on_body(name: str) -> bool:
    """Return whether an input column is a force or a moment on an element."""
    return _element_of(name) is not None


def _element_of(name: str) -> int | None:
    """Return the element on which an input column acts, None where it is no such column."""
    found = _ON_BODY.fullmatch(name)
    return int(found[2]) if found is not None and _UNITS[found[1]] == found[4] else None


def _bodies_in(robot: RobotSpec, table: Table) -> tuple[int, ...]:
    """Return the elements on which columns of `table` act, rising.

    Raises:
        InputError: the robot has no such element.
    """
    bodies: set[int] = set()
    for name in table.columns:
        element = _element_of(name)
        if element is not None:
            if element > body_count(robot):
                raise InputError(f"{table.where}: {name}: the robot's bodies are 1 to {body_count(robot)}")
            bodies.add(element)
    return tuple(sorted(bodies))


def _check_range(drive: Drive, values: Array, table: Table) -> None:
    """Raise `InputError` where a column, shape (rows,), SI, goes beyond what its drive takes."""
    outside = (values < drive.least) | (values > drive.most)
    if not outside.any():
        return
    row, unit = int(np.argmax(outside)), si_factor(drive.column)
    least, shown, most = (value / unit for value in (drive.least, values[row], drive.most))
    what = {
        Quantity.TENSION: "a tendon cannot push",
        Quantity.ADVANCE: f"must lie in {least:g} to the stroke, {most:g} mm",
    }.get(drive.quantity, f"must lie in {least:g} to {most:g}")
    raise InputError(f"{table.row(row)}: {drive.column} = {shown:g}: {what}")


def check_output_channels(robot: RobotSpec, names: Iterable[str], where: str) -> None:
    """Raise `InputError` if one of `names` is not an output column of `robot`."""
    choices = output_channels(robot)
    for name in names:
        if name not in choices:
            shown = [item for item in choices if not item.startswith(("body_", "joint_"))]
            raise unknown("output column", name, [*shown, "body_<k>_x_mm ...", "joint_<name>_deg"], where)


# ----------------------------------------------------------------------------------------------------
# From a robot's states to its output columns: the one place that writes them, in the columns' units.
#
# What columns show is worked out once (`shown_by`); then any number of rows, of one robot or of many that
# are alike but for their numbers, are written at once (`write_columns`). A new column is an entry of
# `COLUMN_FAMILIES`.


class Point(NamedTuple):
    """A coordinate: of an element by its index, or of a marker, which are counted on from the elements."""

    number: int
    axis: int


class StateRows(NamedTuple):
    """What columns are read from, for rows of any shape.

    Attributes:
        p_w: positions of the elements that are shown, then of the markers, shape (..., k, 3) [m].
        R_w: the tip's orientation, shape (..., 3, 3); None where none was worked out.
        joint_angles: gives the joints' angles, shape (..., j) [rad]; asked only where a column shows them.
        tension: at the actuators, shape (..., t) [N].
    """

    p_w: Array
    R_w: Array | None
    joint_angles: Callable[[], Array]
    tension: Array


@dataclass(frozen=True)
class ColumnFamily:
    """Output columns that are read in the same way.

    Attributes:
        names: a robot's columns, each with what says which one it is; a `Point` is turned into its place
            in `StateRows.p_w`.
        values: of n columns by these, shape (..., n), in their unit.
        turns: whether they show the tip's orientation.
    """

    names: Callable[[RobotSpec], Mapping[str, Any]]
    values: Callable[[StateRows, list[Any]], Array]
    turns: bool = False


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
        parts: of each family its columns' places, and which ones they are.
    """

    columns: tuple[str, ...]
    elements: tuple[int, ...]
    tip: int | None
    markers: tuple[tuple[int, int], ...]
    parts: tuple[tuple[ColumnFamily, list[int], list[Any]], ...]


def shown_by(robot: RobotSpec, columns: Sequence[str]) -> Shown:
    """Return what `columns` show of `robot`, or of any robot like it."""
    count, found = body_count(robot), []
    for family in COLUMN_FAMILIES:
        which = family.names(robot)
        places = [place for place, name in enumerate(columns) if name in which]
        if places:
            found.append((family, places, [which[columns[place]] for place in places]))
    wanted = {which.number for _, _, own in found for which in own if isinstance(which, Point)}
    markers = sorted(number - count for number in wanted if number >= count)
    holding = [robot.markers[k].element - 1 for k in markers]
    tip = {count - 1} if any(family.turns for family, _, _ in found) else set()
    elements = sorted({number for number in wanted if number < count} | {*holding} | tip)
    place = {number: k for k, number in enumerate([*elements, *(count + k for k in markers)])}
    return Shown(
        columns=tuple(columns),
        elements=tuple(elements),
        tip=elements.index(count - 1) if tip else None,
        markers=tuple((elements.index(element), k) for element, k in zip(holding, markers, strict=True)),
        parts=tuple(
            (family, places, [Point(place[k.number], k.axis) if isinstance(k, Point) else k for k in own])
            for family, places, own in found
        ),
    )


def write_columns(shown: Shown, rows: StateRows) -> Array:
    """Return the values of output columns, shape (..., o), in the columns' units; NaN where a state is.

    Raises:
        ValueError: a column is left that nothing fills.
    """
    result = np.full((*rows.tension.shape[:-1], len(shown.columns)), np.nan)
    parts = [part for part in shown.parts if rows.R_w is not None or not part[0].turns]
    filled = {place for _, places, _ in parts for place in places}
    if len(filled) < len(shown.columns):
        missing = [name for place, name in enumerate(shown.columns) if place not in filled]
        raise ValueError(f"nothing fills the columns {', '.join(missing)}")
    rows = rows._replace(joint_angles=cache(rows.joint_angles))
    for family, places, own in parts:
        result[..., places] = family.values(rows, own)
    return result


def _positions(rows: StateRows, points: list[Point]) -> Array:
    number, axis = np.array(points, dtype=np.intp).T
    return rows.p_w[..., number, axis] * 1e3


def _turned(rows: StateRows, components: list[int]) -> Array:
    """Return components of (w, x, y, z), w >= 0; NaN where an orientation is."""
    assert rows.R_w is not None
    flat = rows.R_w.reshape(-1, 3, 3)
    parts = np.full((len(flat), 4), np.nan)
    balanced = np.isfinite(flat).all(axis=(1, 2))
    if balanced.any():
        parts[balanced] = Rotation.from_matrix(flat[balanced]).as_quat(canonical=True, scalar_first=True)
    return parts.reshape(*rows.R_w.shape[:-2], 4)[..., components]


def _sums_of_angles(rows: StateRows, joints: list[slice]) -> Array:
    degrees = np.degrees(rows.joint_angles())
    return np.stack([degrees[..., own].sum(axis=-1) for own in joints], axis=-1)


def _angles(rows: StateRows, joints: list[int]) -> Array:
    return np.degrees(rows.joint_angles())[..., joints]


def _tensions(rows: StateRows, tendons: list[int]) -> Array:
    return rows.tension[..., tendons]


def _of_tip(robot: RobotSpec) -> dict[str, Point]:
    return _coordinates({"tip": body_count(robot) - 1})


def _of_orientation(robot: RobotSpec) -> dict[str, int]:
    return {name: k for k, name in enumerate(QUATERNION)}


def _of_bodies(robot: RobotSpec) -> dict[str, Point]:
    return _coordinates({f"body_{k + 1}": k for k in range(body_count(robot))})


def _of_markers(robot: RobotSpec) -> dict[str, Point]:
    count = body_count(robot)
    return _coordinates({f"marker_{item.name}": count + k for k, item in enumerate(robot.markers)})


def _of_shared_angles(robot: RobotSpec) -> Mapping[str, slice]:
    return outputs_of(robot).angles


def _of_joints(robot: RobotSpec) -> dict[str, int]:
    return {f"joint_{name}_deg": k for k, name in enumerate(outputs_of(robot).joints)}


def _of_tensions(robot: RobotSpec) -> dict[str, int]:
    return {f"tension_{name}_N": k for k, name in outputs_of(robot).tensions.items()}


def _coordinates(points: Mapping[str, int]) -> dict[str, Point]:
    axes = tuple(enumerate("xyz"))
    return {f"{name}_{letter}_mm": Point(k, axis) for name, k in points.items() for axis, letter in axes}


# In the order in which a robot's columns are listed.
COLUMN_FAMILIES = (
    ColumnFamily(_of_tip, _positions),
    ColumnFamily(_of_orientation, _turned, turns=True),
    ColumnFamily(_of_bodies, _positions),
    ColumnFamily(_of_markers, _positions),
    ColumnFamily(_of_shared_angles, _sums_of_angles),
    ColumnFamily(_of_joints, _angles),
    ColumnFamily(_of_tensions, _tensions),
)


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
    R_w = None if shown.tip is None else np.array([posture.R_w[-1] for posture in postures])
    tension = np.array([posture.actuator_tension for posture in postures])
    angles = [posture.joint_angles for posture in postures]
    values = write_columns(shown, StateRows(p_w, R_w, lambda: np.array(angles), tension))
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
