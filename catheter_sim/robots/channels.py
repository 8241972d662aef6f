"""Names of a robot's input and output columns, and values to and from them.

Columns carry their unit in the name; the values in a `Table` are in that unit, those in
`Inputs` and `Posture` are SI. This file is the only place that converts one to the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import singledispatch

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.catheter_layout import elements, hinge_counts, hinge_names, moved_segment, turning
from catheter_sim.robots.checks import disks
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array, Posture
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.rolling_layout import rolling_joints
from catheter_sim.robots.specification import ContinuumRobot
from catheter_sim.tables import Table, own_clock
from catheter_sim.units import si_factor

FORCE_CHANNELS = ("force_tip_x_N", "force_tip_y_N", "force_tip_z_N")
MOMENT_CHANNELS = ("moment_tip_x_Nm", "moment_tip_y_Nm", "moment_tip_z_Nm")
_QUATERNION = ("tip_qw", "tip_qx", "tip_qy", "tip_qz")
_LARGEST_INPUT = 1e15  # in the column's unit; squares of what lies far beyond are no numbers any more
_UNIT = {"tension": "N", "displacement": "mm"}


@dataclass(frozen=True)
class Inputs:
    """What drives a robot, row by row, in SI units.

    Attributes:
        time_s: since the first row, shape (r,), strictly increasing.
        actuation: "tension" or "displacement".
        tendon: tension [N] or displacement [m] of each tendon in the robot's order, shape (r, t); of
            a catheter each pair's displacement and the tube's advance.
        force_tip: on the tip, base frame, shape (r, 3) [N].
        moment_tip: on the tip, base frame, shape (r, 3) [N m].
    """

    time_s: Array
    actuation: str
    tendon: Array
    force_tip: Array
    moment_tip: Array

    def __len__(self) -> int:
        return len(self.time_s)


def channel_of(robot: Robot) -> list[str]:
    """Return each tendon's channel, in the tendons' order; several tendons may share one."""
    if isinstance(robot, CatheterRobot):
        return [pair.name for pair in robot.tendons]
    return [tendon.channel or tendon.name for tendon in robot.tendons]


def input_channels(robot: Robot, actuation: str | None = None) -> list[str]:
    """Return the names of the robot's actuator columns (`tension_right_N`), each once."""
    return list(dict.fromkeys(_tendon_columns(robot, actuation or robot.actuation)))


def _tendon_columns(robot: Robot, kind: str) -> list[str]:
    """Return the column that drives each tendon; none where the robot takes no such inputs."""
    if kind not in actuations(robot):
        return []
    tubes = _tubes(robot)
    return [
        f"{channel}_mm" if index in tubes else f"{kind}_{channel}_{_UNIT[kind]}"
        for index, channel in enumerate(channel_of(robot))
    ]


def _tubes(robot: Robot) -> dict[int, float]:
    """Return the stroke [m] of what is advanced rather than pulled, by its place among the tendons."""
    if not isinstance(robot, CatheterRobot):
        return {}
    moved = [robot.segments[moved_segment(robot, index)] for index in range(len(robot.tendons))]
    return {index: part.stroke_m for index, part in enumerate(moved) if part.joint == "prismatic"}


@singledispatch
def actuations(robot: Robot) -> tuple[str, ...]:
    """Return the kinds of actuator inputs that `robot` takes."""
    raise TypeError(f"no channels for a {type(robot).__name__}")


@actuations.register
def _(robot: ContinuumRobot) -> tuple[str, ...]:
    return tuple(_UNIT)


@actuations.register
def _(robot: RollingRobot) -> tuple[str, ...]:
    return ("tension",)


@actuations.register
def _(robot: CatheterRobot) -> tuple[str, ...]:
    return ("displacement",)


@singledispatch
def body_count(robot: Robot) -> int:
    """Return the number of elements (cells, links or disks), the base's fixed one not counted."""
    raise TypeError(f"no channels for a {type(robot).__name__}")


@body_count.register
def _(robot: ContinuumRobot) -> int:
    return sum(disks(robot, segment) for segment in robot.segments)


@body_count.register
def _(robot: RollingRobot) -> int:
    return sum(segment.joints for segment in robot.segments)


@body_count.register
def _(robot: CatheterRobot) -> int:
    return len(elements(robot))


@singledispatch
def joint_names(robot: Robot) -> list[str]:
    """Return the joints' names, base to tip: `x<k>` bends toward +x, `y<k>` toward +y, `t<k>` twists.

    A catheter's bear its segments' names (`catheter_layout.hinge_names`).
    """
    raise TypeError(f"no channels for a {type(robot).__name__}")


@joint_names.register
def _(robot: ContinuumRobot) -> list[str]:
    names = []
    link = 0
    for segment in robot.segments:
        for _ in range(disks(robot, segment) * robot.links_per_subsegment):
            link += 1
            names.append(f"x{link}")
            if segment.bending_axes == "xy":
                names.append(f"y{link}")
            if np.isfinite(segment.torsion_stiffness_N_m2):
                names.append(f"t{link}")
    return names


@joint_names.register
def _(robot: RollingRobot) -> list[str]:
    return [joint.name for joint in rolling_joints(robot)]


@joint_names.register
def _(robot: CatheterRobot) -> list[str]:
    return hinge_names(robot)


def _angles(robot: Robot) -> dict[str, slice]:
    """Return the columns of angles that several hinges share, with their hinges."""
    if not isinstance(robot, CatheterRobot):
        return {}
    ends = np.cumsum([0, *hinge_counts(robot)]).tolist()
    names = [f"angle_{segment.name}_deg" for segment in turning(robot)]
    return {name: slice(*ends[index : index + 2]) for index, name in enumerate(names)}


def _tensioned(robot: Robot) -> dict[int, str]:
    """Return the names of what has a tension, by its place among the tendons."""
    tubes = _tubes(robot)
    names = [item.name for item in robot.tendons]
    return {index: name for index, name in enumerate(names) if index not in tubes}


def output_channels(robot: Robot) -> list[str]:
    """Return the names of every output column that the robot has."""
    return [
        *(f"tip_{axis}_mm" for axis in "xyz"),
        *_QUATERNION,
        *(f"body_{k}_{axis}_mm" for k in range(1, body_count(robot) + 1) for axis in "xyz"),
        *_angles(robot),
        *(f"joint_{name}_deg" for name in joint_names(robot)),
        *(f"tension_{name}_N" for name in _tensioned(robot).values()),
    ]


def read_inputs(robot: Robot, table: Table) -> Inputs:
    """Return the rows of `table` as SI inputs of `robot`.

    A tendon whose channel the table leaves out has tension or displacement zero. The clock is the
    inputs' own, from zero: stamps in epoch seconds mean what the same rows mean from zero.

    Raises:
        InputError: unknown or mixed channels, a missing or huge value, a tension below zero, an advance
            beyond its stroke, or time that does not increase; the message names the file and the row.
    """
    kinds = {kind: input_channels(robot, kind) for kind in _UNIT}
    choices = [*kinds["tension"], *kinds["displacement"], *FORCE_CHANNELS, *MOMENT_CHANNELS]
    for name in table.columns:
        if name not in choices:
            raise unknown("input channel", name, choices, table.where)
    used = [kind for kind, names in kinds.items() if any(name in table.columns for name in names)]
    if len(used) > 1:
        raise InputError(f"{table.where}: tension and displacement channels cannot be mixed")
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

    per_channel = {name: column(name) for name in kinds[kind]}
    if kind == "tension":
        for name, values in per_channel.items():
            if (values < 0).any():
                row = int(np.argmax(values < 0))
                raise InputError(f"{table.row(row)}: {name} = {values[row]:g}: a tendon cannot push")
    columns = _tendon_columns(robot, kind)
    tendon = np.zeros((rows, len(columns)))
    for index, name in enumerate(columns):
        share = columns.count(name) if kind == "tension" else 1  # a tension is their sum
        tendon[:, index] = per_channel[name] / share
    for index, stroke_m in _tubes(robot).items():
        outside = (tendon[:, index] < 0.0) | (tendon[:, index] > stroke_m)
        if outside.any():
            row = int(np.argmax(outside))
            shown = f"{columns[index]} = {tendon[row, index] * 1e3:g}"
            raise InputError(f"{table.row(row)}: {shown}: must lie in 0 to the stroke, {stroke_m * 1e3:g} mm")
    return Inputs(
        time_s=own_clock(table.time_s),
        actuation=kind,
        tendon=tendon,
        force_tip=np.stack([column(name) for name in FORCE_CHANNELS], axis=1),
        moment_tip=np.stack([column(name) for name in MOMENT_CHANNELS], axis=1),
    )


def check_output_channels(robot: Robot, names: Iterable[str], where: str) -> None:
    """Raise `InputError` if one of `names` is not an output column of `robot`."""
    choices = output_channels(robot)
    for name in names:
        if name not in choices:
            shown = [item for item in choices if not item.startswith(("body_", "joint_"))]
            raise unknown("output column", name, [*shown, "body_<k>_x_mm ...", "joint_<name>_deg"], where)


def output_table(
    robot: Robot, time_s: Array, postures: Sequence[Posture], names: Sequence[str] | None = None
) -> Table:
    """Return the columns `names` (default: all) of `postures`, one row each, in the columns' units."""
    values = posture_columns(robot, postures)
    chosen = list(names) if names is not None else output_channels(robot)
    return Table(time_s=time_s[: len(postures)], columns={name: values[name] for name in chosen})


def posture_columns(robot: Robot, postures: Sequence[Posture]) -> dict[str, Array]:
    """Return every output column of `postures` by name, each of shape (rows,), in its unit."""
    if not postures:
        return {name: np.zeros(0) for name in output_channels(robot)}
    columns: dict[str, Array] = {}
    p_w = np.array([posture.p_w for posture in postures]) * 1e3  # (rows, n, 3)
    for axis, letter in enumerate("xyz"):
        columns[f"tip_{letter}_mm"] = p_w[:, -1, axis]
    matrices = np.array([posture.R_w[-1] for posture in postures])
    quaternions = Rotation.from_matrix(matrices).as_quat(canonical=True, scalar_first=True)
    for index, name in enumerate(_QUATERNION):
        columns[name] = quaternions[:, index]
    for k in range(body_count(robot)):
        for axis, letter in enumerate("xyz"):
            columns[f"body_{k + 1}_{letter}_mm"] = p_w[:, k, axis]
    angles = np.degrees([posture.joint_angles for posture in postures])
    for name, hinges in _angles(robot).items():
        columns[name] = angles[:, hinges].sum(axis=1)
    for index, name in enumerate(joint_names(robot)):
        columns[f"joint_{name}_deg"] = angles[:, index]
    tensions = np.array([posture.actuator_tension for posture in postures])
    for index, name in _tensioned(robot).items():
        columns[f"tension_{name}_N"] = tensions[:, index]
    return columns


def slice_inputs(inputs: Inputs, rows: slice) -> Inputs:
    """Return the given rows of `inputs`."""
    return replace(
        inputs,
        time_s=inputs.time_s[rows],
        tendon=inputs.tendon[rows],
        force_tip=inputs.force_tip[rows],
        moment_tip=inputs.moment_tip[rows],
    )
