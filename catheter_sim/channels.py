"""Names of a robot's input and output columns, and inputs from their columns.

Columns carry their unit in the name; the values in a `Table` are in that unit, those in
`Inputs` and `Posture` are SI. Only this file and `columns.py` convert one to the other.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.drive import Drive, Outputs, Quantity, shares, sums
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.remembered import by_identity
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots import kind_of
from catheter_sim.tables import Table, own_clock
from catheter_sim.units import si_factor

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


def channel_names(robot: RobotSpec) -> list[str]:
    """Return the robot's channels, each once, in the order of its input columns."""
    return [drive.channel for drive in drives_of(robot)]


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
    outputs = outputs_of(robot)
    return [
        *(f"tip_{axis}_mm" for axis in "xyz"),
        *QUATERNION,
        *(f"body_{k}_{axis}_mm" for k in range(1, outputs.elements + 1) for axis in "xyz"),
        *(f"marker_{marker.name}_{axis}_mm" for marker in robot.markers for axis in "xyz"),
        *outputs.angles,
        *(f"joint_{name}_deg" for name in outputs.joints),
        *(f"tension_{name}_N" for name in outputs.tensions.values()),
    ]


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
