"""Inputs for targets, reachable points, sensed postures, and which static model to take."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.core.robot import number_of, whole_of
from catheter_sim.errors import InputError, shown, unknown
from catheter_sim.pictures.curves import entitle, panels_of
from catheter_sim.public.data import (
    AT_REST,
    Listing,
    columns_of,
    data_frame,
    gravity_of,
    inputs_of,
    listing_of,
    mapping_of,
    path_of,
    progress_of,
    robot_of,
    table_of,
)

if TYPE_CHECKING:
    from catheter_sim.arrays import Array
    from catheter_sim.core.inputs import Inputs
    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.planning.inverse import InputPlan
    from catheter_sim.planning.inverse import ReachedPoints as Cloud
    from catheter_sim.planning.sensing import Sensed, UncertainCause
    from catheter_sim.public.runs import Control
    from catheter_sim.tables import Table
    from catheter_sim.theory.which_model import ChosenModel as Result

# ----------------------------------------------------------------------------------------------------
# Figures of what is planned and sensed: targets, regions, workspaces, controlled motions.

BLUE, ORANGE, GREY = "#1f5fa8", "#d9822b", "#888888"


def inverse_figure(found: InverseKinematics, ax: Any = None) -> Figure:
    """Return targets and what is reached of them, panel by unit, above the inputs."""
    plan, table = found.plan, found.to_table()
    reached = plan.reached if plan.simulated is None else plan.simulated
    figure, panels = panels_of(ax, 2, 1, (8.0, 6.5), sharex=True)
    above, below = panels[:, 0]
    time_s = plan.targets.time_s
    for k, name in enumerate(plan.targets.names):
        (line,) = above.plot(time_s, reached[:, k], label=name)
        above.plot(time_s, plan.targets.asked[:, k], "o", mfc="none", ms=5, color=line.get_color())
    missed = ~plan.reachable
    if missed.any():
        for when in time_s[missed]:
            above.axvline(when, color=ORANGE, lw=0.8, alpha=0.5)
    above.set_ylabel("asked (rings), reached (lines)")
    above.legend(fontsize="small", frameon=False)
    for name, values in table.columns.items():
        below.plot(time_s, values, label=name)
    below.set_ylabel("inputs")
    below.set_xlabel("time [s]")
    below.legend(fontsize="small", frameon=False)
    unreached = f"; out of reach: {int(missed.sum())} (orange)" if missed.any() else ""
    entitle(figure, panels, f"{found.robot.name}: inverse kinematics{unreached}")
    return figure


def sensing_figure(found: Sensing, ax: Any = None) -> Figure:
    """Return every column over time, with its region."""
    sensed = found.sensed
    count = len(sensed.columns)
    figure, panels = panels_of(ax, count, 1, (8.0, 1.6 * count + 1.0), sharex=True)
    for k, (axes, name) in enumerate(zip(panels[:, 0], sensed.columns, strict=True)):
        axes.fill_between(sensed.time_s, sensed.low[:, k], sensed.high[:, k], color=BLUE, alpha=0.25, lw=0)
        axes.plot(sensed.time_s, sensed.value[:, k], color=BLUE, lw=1.2)
        axes.set_ylabel(name, fontsize="small")
    panels[-1, 0].set_xlabel("time [s]")
    entitle(figure, panels, f"{found.robot.name}: sensed, with 95 % regions")
    return figure


def workspace_figure(found: Workspace, ax: Any = None) -> Figure:
    """Return the tips in three views."""
    tip = found.tip_mm
    figure, panels = panels_of(ax, 1, 3, (12.0, 4.2))
    for axes, (across, up) in zip(panels[0], ((0, 2), (1, 2), (0, 1)), strict=True):
        axes.scatter(tip[:, across], tip[:, up], s=3, color=BLUE, alpha=0.4, lw=0)
        axes.plot(0.0, 0.0, "+", color=ORANGE, ms=8)
        axes.set_xlabel(f"{'xyz'[across]} [mm]")
        axes.set_ylabel(f"{'xyz'[up]} [mm]")
        axes.set_aspect("equal", adjustable="datalim")
    entitle(figure, panels, f"{found.robot.name}: {len(tip)} reachable tips (+: base)")
    return figure


def models_figure(found: ModelChoice, ax: Any = None) -> Figure:
    """Return every model's largest error over the time of a row, both by their logarithm."""
    figure, panels = panels_of(ax, 1, 1, (6.5, 4.5))
    axes = panels[0, 0]
    for row in found.to_table():
        if row["failed"] or not np.isfinite(row["ms"]):
            continue
        error = max(row["position_percent"], 1e-6)
        axes.loglog(row["ms"], error, "o", color=BLUE if row["within"] else GREY)
        axes.annotate(row["model"], (row["ms"], error), xytext=(4, 4), textcoords="offset points", fontsize=8)
    axes.axhline(found.tolerance_percent, color=ORANGE, lw=1.0)
    axes.set_xlabel("time of a row [ms]")
    axes.set_ylabel("largest distance of the tip [% of length]")
    axes.set_title(f"{found.robot.name}, against {found.result.reference}", fontsize="medium")
    return figure


def control_figure(found: Control, ax: Any = None) -> Figure:
    """Return angle, error and effort over time, a column for each joint that is asked to move."""
    first = next(iter(found.runs.values()))
    moved = [k for k in range(len(found.pairs)) if np.any(first.desired[:, k])] or [0]
    figure, panels = panels_of(ax, 3, len(moved), (5.0 * len(moved), 8.0), sharex=True)
    colours = [BLUE, ORANGE, "#3a8f4c", "#8a4fa3", GREY, "#b03a3a"]
    for k, (above, middle, below) in zip(moved, panels.T, strict=True):
        unit, size = ("mm", 1e3) if first.joints[k] == "prismatic" else ("deg", 180.0 / np.pi)
        above.plot(first.times_s, size * first.desired[:, k], color=GREY, lw=3, alpha=0.5, label="desired")
        for (name, run), colour in zip(found.runs.items(), colours * len(found.runs), strict=False):
            above.plot(run.times_s, size * run.reached[:, k], color=colour, lw=1, label=name)
            middle.plot(run.times_s, size * (run.reached - run.desired)[:, k], color=colour, lw=1)
            below.plot(run.times_s, 1e3 * run.model_m[:, k], "--", color=colour, lw=1)
            if np.any(run.controller_m[:, k]):
                below.plot(run.times_s, 1e3 * run.controller_m[:, k], color=colour, lw=1)
        above.set_title(found.pairs[k], fontsize="medium")
        above.set_ylabel(f"reached [{unit}]")
        middle.set_ylabel(f"error [{unit}]")
        below.set_ylabel("effort [mm]; dashed: model")
        below.set_xlabel("time [s]")
        above.legend(fontsize="small", frameon=False)
    return figure


# ----------------------------------------------------------------------------------------------------
# Inputs that bring a robot to targets, or as near as they can.

CORRECTIONS = 3


@dataclass(frozen=True, repr=False)
class InverseKinematics:
    """Inputs for targets, row by row: see `inverse_kinematics`, which returns it.

    Attributes:
        robot: as it was specified, effects named.
        plan: every figure, SI units but for the targets' columns.

    Examples:
        >>> import catheter_sim as cs
        >>> found = cs.inverse_kinematics("mitral_transseptal", {"tip_x_mm": [20.0], "tip_z_mm": [70.0]})
        >>> found
        <InverseKinematics of mitral_transseptal: 1 of 1 targets reached>
        >>> tip = cs.simulate("mitral_transseptal", found.inputs).to_table(["tip_x_mm", "tip_z_mm"])
        >>> {name: float(value[0].round(1)) for name, value in tip.columns.items()}
        {'tip_x_mm': 20.0, 'tip_z_mm': 70.0}
    """

    robot: RobotSpec
    plan: InputPlan

    def __len__(self) -> int:
        return len(self.plan.inputs)

    @property
    def inputs(self) -> Inputs:
        """The inputs, for `simulate` and `statics`."""
        return self.plan.inputs

    @property
    def error_mm(self) -> Array:
        """Distance of each row's tip from what was asked of it in mm, shape (r,) [mm]."""
        return self.plan.error_mm

    @property
    def error_deg(self) -> Array:
        """Largest miss of what was asked in deg, the direction's included, shape (r,) [deg]."""
        return self.plan.error_deg

    @property
    def reachable(self) -> Array:
        """Whether each row's target is reached within the tolerance, shape (r,), bool."""
        return self.plan.reachable

    @property
    def limits(self) -> tuple[str, ...]:
        """What holds each row back (`tension_right_N<=0.32`, `workspace`); empty where nothing does."""
        return self.plan.limits

    def to_table(self) -> Table:
        """Return the inputs as a file has them: `time_s` and the robot's input columns, in their units."""
        from catheter_sim.planning.models import input_table

        return input_table(self.robot, self.plan.inputs, self.plan.targets.time_s)

    def to_dataframe(self) -> Any:
        """Return inputs and report side by side as a pandas `DataFrame`.

        Raises:
            InputError: pandas is not installed.
        """
        table, report = self.to_table(), self.report()
        columns = {name: report.column(name) for name in report.columns if name != "time_s"}
        return data_frame({"time_s": table.time_s, **table.columns, **columns})

    def report(self) -> Listing:
        """Return a row for each target.

        Columns: `time_s`, the targets' own, what is reached of each (`reached_tip_x_mm`), `ik_error_mm`,
        `ik_error_deg`, `ik_reachable`, `ik_limit`.
        """
        plan = self.plan
        reached = plan.reached if plan.simulated is None else plan.simulated
        columns: dict[str, Any] = {"time_s": plan.targets.time_s}
        columns |= {name: plan.targets.asked[:, k] for k, name in enumerate(plan.targets.names)}
        columns |= {f"reached_{name}": reached[:, k] for k, name in enumerate(plan.targets.names)}
        columns |= {"ik_error_mm": plan.error_mm, "ik_error_deg": plan.error_deg}
        columns |= {"ik_reachable": plan.reachable, "ik_limit": plan.limits}
        return listing_of(f"Inverse kinematics of {self.robot.name}", columns)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the inputs to a CSV that `simulate` takes, the report beside it; return the report's path.

        Raises:
            InputError: a file cannot be written, or does not end in `.csv`.
        """
        from catheter_sim.tables import write_table

        report = report_path(path)
        write_table(self.to_table(), path)
        self.report().save(report)
        return report

    def plot(self, ax: Any = None) -> Figure:
        """Return a figure: targets and what is reached of them, and the inputs over the rows.

        Args:
            ax: axes of matplotlib to draw into, two; None: a new figure.

        Raises:
            InputError: `ax` holds something else.
        """

        return inverse_figure(self, ax)

    def __repr__(self) -> str:
        count = int(self.plan.reachable.sum())
        return f"<InverseKinematics of {self.robot.name}: {count} of {len(self)} targets reached>"

    def _repr_html_(self) -> str:
        return self.report()._repr_html_()


def report_path(path: str | os.PathLike[str]) -> Path:
    """Return where the report of a file of inputs stands: `inputs_report.csv` beside `inputs.csv`.

    Raises:
        InputError: the file does not end in `.csv`.
    """
    file = Path(path_of(path, "save"))
    if file.suffix.lower() != ".csv":
        raise InputError(f"{file}: inputs are saved as a table; choices: .csv")
    return file.with_name(f"{file.stem}_report.csv")


def inverse_kinematics(
    robot: RobotSpec | str | os.PathLike[str],
    targets: Any,
    gravity_mps2: Sequence[float] = AT_REST,
    limits: Mapping[str, Sequence[float]] | None = None,
    tolerance_mm: float | None = None,
    tolerance_deg: float | None = None,
    corrections: int | None = CORRECTIONS,
    progress: bool | None = None,
) -> InverseKinematics:
    """Return inputs that bring `robot` to one target after another, or as near as its inputs' limits let it.

    Solved on the robot's twin, friction's history followed row after row; then the rows are simulated, and
    what the simulation misses is corrected.

    Args:
        robot: a robot, its id or its file.
        targets: a mapping, a data frame or a CSV file: any of `tip_x_mm`, `tip_y_mm`, `tip_z_mm`, the
            direction of the tip's axis (`tip_direction_x`, `_y`, `_z`), and other output columns in mm or
            deg (`angle_bending_deg`), shape (r,) each. NaN asks nothing. Without `time_s` rows are a
            second apart.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        limits: least and most of an input by its column, in the column's unit; 0 must lie between them.
            Default: the joints' own, or what bends a segment by 90 deg without friction.
        tolerance_mm, tolerance_deg: what a reached target may be missed by; default: 0.1 % of the robot's
            length, and 0.2 deg.
        corrections: largest number of corrections by simulation; None: the twin alone, without simulation.
        progress: show on standard error what is done; None: on a terminal, and in a notebook.

    Raises:
        InputError: anything is not possible.
        SimulationDiverged: the simulation left the finite numbers under the inputs found.

    Examples:
        >>> import catheter_sim as cs
        >>> ahead = {"tip_x_mm": [0.0], "tip_y_mm": [0.0], "tip_z_mm": [140.0]}
        >>> cs.inverse_kinematics("mitral_4dof", ahead).limits
        ('advance_mm<=60',)
    """
    from catheter_sim.planning.inverse import TOLERANCE_DEG, TOLERANCE_SHARE, Tolerance, targets_of
    from catheter_sim.planning.inverse import inverse_kinematics as solve
    from catheter_sim.planning.models import plan_drives, with_limits

    value, gravity, told = robot_of(robot), gravity_of(gravity_mps2), progress_of(progress)
    miss_mm, miss_deg = _above_zero(tolerance_mm, "tolerance_mm"), _above_zero(tolerance_deg, "tolerance_deg")
    if corrections is not None:
        corrections = whole_of(corrections, "corrections", "a whole number from 0, or None,", 0)
    drives = with_limits(plan_drives(value), limits_of(limits), "limits")
    asked = targets_of(value, clocked_table(targets, "targets"), drives.length_m)
    within = Tolerance(miss_mm or TOLERANCE_SHARE * asked.length_mm, miss_deg or TOLERANCE_DEG)
    plan = solve(value, asked, drives, gravity, corrections, within, told)
    return InverseKinematics(value, plan)


def limits_of(limits: Mapping[str, Sequence[float]] | None) -> dict[str, tuple[float, float]]:
    """Return limits as pairs of numbers.

    Raises:
        InputError: they are no mapping, or one is no pair.
    """
    found = {}
    for name, ends in mapping_of(limits, "limits", "inputs to (least, most)").items():
        try:
            low, high = (number_of(end, "limits", holds=lambda _: True) for end in ends)
        except (TypeError, ValueError):  # an `InputError` is one, too
            raise InputError(f"limits: {name} = {shown(ends)}: least and most are needed") from None
        found[name] = (low, high)
    return found


def clocked_table(given: Any, where: str) -> Table:
    """Return a file, a mapping or a data frame as a table; without `time_s` its rows are a second apart.

    Raises:
        InputError: it is none of these.
    """
    import numpy as np

    from catheter_sim.public.data import is_table
    from catheter_sim.tables import read_table

    if isinstance(given, str | os.PathLike):
        return read_table(path_of(given, where), spacing_s=1.0)
    if is_table(given) and "time_s" not in given:
        columns = {str(name): given[name] for name in given.keys()}  # noqa: SIM118 - a data frame has columns
        rows = max((np.size(column) for column in columns.values()), default=0)
        given = {"time_s": np.arange(float(rows)), **columns}
    return table_of(given, where)


def _above_zero(value: float | None, where: str) -> float | None:
    if value is None:
        return None
    return number_of(value, where, "a number above zero", lambda size: 0.0 < size < float("inf"))


# ----------------------------------------------------------------------------------------------------
# The cloud of points that a robot's tip can reach.

_MOST_SAMPLES = 100_000


@dataclass(frozen=True, repr=False)
class Workspace:
    """Reachable tips: see `workspace`, which returns it.

    Attributes:
        robot: as it was specified, effects named.
        cloud: inputs, tips and directions.

    Examples:
        >>> import catheter_sim as cs
        >>> found = cs.workspace("mitral_4dof", samples=200)
        >>> found
        <Workspace of mitral_4dof: 200 points>
        >>> list(found.extent())
        ['tip_x_mm', 'tip_y_mm', 'tip_z_mm']
    """

    robot: RobotSpec
    cloud: Cloud

    def __len__(self) -> int:
        return len(self.cloud.tip_mm)

    @property
    def tip_mm(self) -> Array:
        """The tips, shape (n, 3) [mm]."""
        return self.cloud.tip_mm

    def extent(self) -> dict[str, tuple[float, float]]:
        """Return the least and largest coordinate of the tips [mm]."""
        low, high = self.cloud.tip_mm.min(axis=0), self.cloud.tip_mm.max(axis=0)
        return {f"tip_{axis}_mm": (float(low[k]), float(high[k])) for k, axis in enumerate("xyz")}

    def to_table(self) -> Listing:
        """Return a row for each point: the inputs' columns, the tip's place, the direction of its axis."""
        return listing_of(f"Workspace of {self.robot.name}", self._columns())

    def to_dataframe(self) -> Any:
        """Return `to_table` as a pandas `DataFrame`.

        Raises:
            InputError: pandas is not installed.
        """
        return data_frame(self._columns())

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write `to_table` to a CSV file.

        Raises:
            InputError: the file cannot be written, or does not end in `.csv`.
        """
        file = path_of(path, "save")
        if not file.lower().endswith(".csv"):
            raise InputError(f"{file}: a workspace is saved as a table; choices: .csv")
        self.to_table().save(file)

    def plot(self, ax: Any = None) -> Figure:
        """Return a figure of the tips from the side, from the front and from above.

        Args:
            ax: axes of matplotlib to draw into, three; None: a new figure.

        Raises:
            InputError: `ax` holds something else.
        """

        return workspace_figure(self, ax)

    def _columns(self) -> dict[str, Any]:
        from catheter_sim.planning.inverse import DIRECTION
        from catheter_sim.planning.models import input_table

        cloud = self.cloud
        columns: dict[str, Any] = dict(input_table(self.robot, cloud.inputs, cloud.inputs.time_s).columns)
        columns |= {f"tip_{axis}_mm": cloud.tip_mm[:, k] for k, axis in enumerate("xyz")}
        return columns | {name: cloud.direction[:, k] for k, name in enumerate(DIRECTION)}

    def __repr__(self) -> str:
        return f"<Workspace of {self.robot.name}: {len(self)} points>"

    def _repr_html_(self) -> str:
        return self.to_table()._repr_html_()


def workspace(
    robot: RobotSpec | str | os.PathLike[str],
    samples: int = 2000,
    seed: int = 0,
    limits: Mapping[str, Sequence[float]] | None = None,
    gravity_mps2: Sequence[float] = AT_REST,
) -> Workspace:
    """Return where the tip of `robot` comes to under inputs drawn within their ranges, each from rest.

    By the robot's analytic twin, effects included; draws without a balance are left out.

    Args:
        robot: a robot, its id or its file.
        samples: how many draws, up to 100,000.
        seed: of the draws, from 0.
        limits: as for `inverse_kinematics`.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: anything is not possible, or no draw has a balance.

    Examples:
        >>> import catheter_sim as cs
        >>> reach = cs.workspace("chest_tube_section", samples=50, limits={"tension_active_N": (0, 20)})
        >>> reach.extent()["tip_y_mm"]
        (0.0, 0.0)
    """
    from catheter_sim.planning.inverse import workspace as solve
    from catheter_sim.planning.models import plan_drives, with_limits

    value = robot_of(robot)
    if not _is_whole(samples) or not 1 <= samples <= _MOST_SAMPLES:
        raise InputError(f"samples = {shown(samples)}: a whole number of 1 to {_MOST_SAMPLES} is needed")
    if not _is_whole(seed) or seed < 0:
        raise InputError(f"seed = {shown(seed)}: a whole number from 0 is needed")
    drives = with_limits(plan_drives(value), limits_of(limits), "limits")
    return Workspace(value, solve(value, drives, gravity_of(gravity_mps2), int(samples), int(seed)))


def _is_whole(value: object) -> bool:
    """Return whether a value is a whole number, Python's or NumPy's; True and False are none."""
    return isinstance(value, Integral) and not isinstance(value, bool)


# ----------------------------------------------------------------------------------------------------
# A robot's posture from readings of its actuators, with the region that holds the truth.


@dataclass(frozen=True, repr=False)
class Sensing:
    """Postures sensed, row by row: see `sense`, which returns it.

    Attributes:
        robot: as it was specified, effects named.
        sensed: values, regions and what each cause adds to them, in the columns' units.

    Examples:
        >>> import catheter_sim as cs
        >>> pulled = {"time_s": [0.0, 1.0], "tension_active_N": [0.0, 20.0]}
        >>> found = cs.sense("chest_tube_section", pulled, noise_tension_N=0.1, columns=["tip_x_mm"])
        >>> tip = found.to_table().columns
        >>> bool(tip["tip_x_mm_low"][1] < 169.54 < tip["tip_x_mm_high"][1])
        True
    """

    robot: RobotSpec
    sensed: Sensed

    def __len__(self) -> int:
        return len(self.sensed.time_s)

    def to_table(self) -> Table:
        """Return each column with the ends of its region, `tip_x_mm`, `tip_x_mm_low`, `tip_x_mm_high`."""
        from catheter_sim.tables import Table as Value

        columns: dict[str, Any] = {}
        for k, name in enumerate(self.sensed.columns):
            columns[name] = self.sensed.value[:, k]
            columns[f"{name}_low"], columns[f"{name}_high"] = self.sensed.low[:, k], self.sensed.high[:, k]
        return Value(self.sensed.time_s, columns)

    def to_dataframe(self) -> Any:
        """Return `to_table` with its `time_s` as a pandas `DataFrame`.

        Raises:
            InputError: pandas is not installed.
        """
        table = self.to_table()
        return data_frame({"time_s": table.time_s, **table.columns})

    def causes(self) -> dict[str, dict[str, float]]:
        """Return the largest standard deviation that each cause alone makes, by cause and column."""
        return {
            cause: dict(zip(self.sensed.columns, part.max(axis=0).tolist(), strict=True))
            for cause, part in self.sensed.deviations.items()
        }

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write `to_table` to a CSV file.

        Raises:
            InputError: the file cannot be written, or does not end in `.csv`.
        """
        from catheter_sim.tables import write_table

        file = path_of(path, "save")
        if not file.lower().endswith(".csv"):
            raise InputError(f"{file}: what is sensed is saved as a table; choices: .csv")
        write_table(self.to_table(), file)

    def plot(self, ax: Any = None) -> Figure:
        """Return a figure of every column over time with its region.

        Args:
            ax: axes of matplotlib to draw into, one a column; None: a new figure.

        Raises:
            InputError: `ax` holds something else.
        """

        return sensing_figure(self, ax)

    def __repr__(self) -> str:
        return f"<Sensing of {self.robot.name}: {len(self)} rows>"

    def _repr_html_(self) -> str:
        table = self.to_table()
        return listing_of(repr(self)[1:-1], {"time_s": table.time_s, **table.columns})._repr_html_()


def sense(
    robot: RobotSpec | str | os.PathLike[str],
    readings: Any,
    noise_tension_N: float = 0.0,
    noise_displacement_mm: float = 0.0,
    noise_position_mm: float = 0.0,
    noise_angle_deg: float = 0.0,
    uncertain: Mapping[str, float] | None = None,
    columns: Sequence[str] | None = None,
    gravity_mps2: Sequence[float] = AT_REST,
    *,
    step_tension_N: float = 0.0,
) -> Sensing:
    """Return the posture of `robot` from what its actuators measured, with regions of 95 %.

    Args:
        robot: a robot, its id or its file.
        readings: a mapping, a data frame or a CSV file: `time_s` and the robot's input columns as they were
            measured. Add any output column in mm, deg or N that was measured too (`tension_bending_N` of
            a catheter, `angle_bending_deg` of a tracker), NaN where it was not.
        noise_tension_N, noise_displacement_mm: standard deviation of the measured inputs in N and in mm.
        noise_position_mm, noise_angle_deg: of measured outputs in mm and in deg; tensions have the inputs'.
        uncertain: half of the even range of numbers by their dotted key, in the key's unit
            (`{"friction.mu": 0.05}`); default: what differs from one specimen of a published robot to the
            next. An empty mapping: the robot is as specified.
        columns: output columns wanted; default: the tip's place, and a catheter's angles.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        step_tension_N: step in which tensions are read or set, as by a motor's current; a reading is then
            anywhere within half a step, which counts as step / sqrt(12) beside the noise.

    Raises:
        InputError: anything is not possible, or a row has no balance.

    Examples:
        >>> import catheter_sim as cs
        >>> pulled = {"time_s": [0.0], "displacement_bending_mm": [2.0]}
        >>> found = cs.sense("mitral_transseptal", pulled, noise_displacement_mm=0.01, uncertain={})
        >>> list(found.causes())
        ['noise of the inputs']
    """
    from catheter_sim.channels import check_output_channels
    from catheter_sim.planning.sensing import Noise, readings_of
    from catheter_sim.planning.sensing import sense as solve

    value = robot_of(robot)
    sizes = {
        "noise_tension_N": noise_tension_N,
        "noise_displacement_mm": noise_displacement_mm,
        "noise_position_mm": noise_position_mm,
        "noise_angle_deg": noise_angle_deg,
    }

    def positive(size: float, name: str, what: str) -> float:
        return number_of(size, name, f"{what}, a finite number from 0,", lambda of: 0.0 <= of < math.inf)

    noise = Noise(*(positive(size, name, "a standard deviation") for name, size in sizes.items()))
    step = positive(step_tension_N, "step_tension_N", "a step")
    noise = replace(noise, tension_N=math.hypot(noise.tension_N, step / math.sqrt(12.0)))
    names = sensed_columns(value) if columns is None else columns_of(columns)
    check_output_channels(value, names, "columns")
    asked = readings_of(value, clocked_table(readings, "readings"), noise)
    causes = causes_of(value, uncertain, "uncertain")
    return Sensing(value, solve(value, asked, noise, causes, names, gravity_of(gravity_mps2)))


def sensed_columns(robot: RobotSpec) -> list[str]:
    """Return the columns that are sensed unless others are asked for."""
    from catheter_sim.channels import output_channels

    return [
        name
        for name in output_channels(robot)
        if name in ("tip_x_mm", "tip_y_mm", "tip_z_mm") or name.startswith("angle_")
    ]


def causes_of(robot: RobotSpec, uncertain: Mapping[str, float] | None, where: str) -> list[UncertainCause]:
    """Return what of a robot is known only within a range.

    `uncertain`: half of the range by dotted key; None: as published.

    Raises:
        InputError: no such number, or half a range that is none.
    """
    from catheter_sim.catalogue import PUBLISHED
    from catheter_sim.core.document import leaves, to_document
    from catheter_sim.core.inputs import READ_WITH
    from catheter_sim.planning.sensing import UncertainCause as Value
    from catheter_sim.planning.sensing import within_factor, within_half

    if uncertain is None:
        published = PUBLISHED.get(robot.name)
        ranges = published.uncertain if published else ()
        return [Value(item.name, within_factor(item.keys, item.half)) for item in ranges]
    choices = dict(leaves(to_document(robot)))
    found = []
    for key, half in mapping_of(uncertain, where, "numbers of the robot to half their range").items():
        if key not in choices:
            raise unknown("number", key, choices, where)
        if key.endswith(READ_WITH):
            raise InputError(f"{where}: {key}: inputs are read with it, it has no range")
        if not np.isfinite(choices[key]):
            raise InputError(f"{where}: {key}: is infinite as specified, it has no range")
        needed = "half a range, above zero,"
        size = number_of(half, f"{where}: {key}", needed, lambda of: 0.0 < of < float("inf"))
        found.append(Value(key, within_half(key, size)))
    return found


# ----------------------------------------------------------------------------------------------------
# Which static model is accurate enough for given inputs, and fastest.

TOLERANCE_PERCENT = 1.0
COLUMNS = ("model", "position_percent", "mean_percent", "orientation_deg", "ms", "failed", "within")


@dataclass(frozen=True, repr=False)
class ModelChoice:
    """What every static model does along some inputs: see `which_model`, which returns it.

    Attributes:
        robot: as it was specified, effects named.
        result: errors and times of all models.
        tolerance_percent: largest allowed distance of the tip [% of the robot's length].
        tolerance_deg: largest allowed angle between the tips' frames [deg].

    Examples:
        >>> import catheter_sim as cs
        >>> pull = {"time_s": [0.0, 1.0, 2.0], "tension_active_N": [5.0, 20.0, 5.0]}
        >>> choice = cs.which_model("chest_tube_section", pull, reference="complete_sliding")
        >>> "pcc" in [row["model"] for row in choice.to_table() if row["within"]]
        False
    """

    robot: RobotSpec
    result: Result
    tolerance_percent: float
    tolerance_deg: float

    @property
    def model(self) -> str | None:
        """The fastest model within the tolerance, of equally fast ones the most accurate; None: none is."""
        return self.result.model if any(row["within"] for row in self.to_table()) else None

    def to_table(self) -> Listing:
        """Return a row for each model, the fastest first.

        Columns: `model`, `position_percent` and `mean_percent` (largest and mean distance of the tip
        [% of length]), `orientation_deg` (largest angle between the tips' frames). Then `ms` (of a row, by
        the solver alone where all models have one, else by the model as it is called), `failed` (rows that
        it does not solve), `within` (the tolerance).
        """
        from catheter_sim.theory.which_model import accurate

        within = accurate(self.result.errors, self.tolerance_percent, self.tolerance_deg)
        rows = tuple(
            {
                "model": item.model,
                "position_percent": item.position_percent,
                "mean_percent": item.mean_percent,
                "orientation_deg": item.orientation_deg,
                "ms": item.ms,
                "failed": len(item.failed),
                "within": item in within,
            }
            for item in self.result.errors
        )
        return Listing(f"Static models of {self.robot.name} against {self.result.reference}", COLUMNS, rows)

    def to_dataframe(self) -> Any:
        """Return `to_table` as a pandas `DataFrame`.

        Raises:
            InputError: pandas is not installed.
        """
        return self.to_table().to_dataframe()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write `to_table` to a CSV file.

        Raises:
            InputError: the file cannot be written, or does not end in `.csv`.
        """
        file = path_of(path, "save")
        if not file.lower().endswith(".csv"):
            raise InputError(f"{file}: a comparison is saved as a table; choices: .csv")
        self.to_table().save(file)

    def plot(self, ax: Any = None) -> Figure:
        """Return a figure of every model's error over its time.

        Args:
            ax: axes of matplotlib to draw into, one; None: a new figure.

        Raises:
            InputError: `ax` holds something else.
        """

        return models_figure(self, ax)

    def __repr__(self) -> str:
        return f"<ModelChoice of {self.robot.name}: {self.model or 'none'}>"

    def _repr_html_(self) -> str:
        return self.to_table()._repr_html_()


def which_model(
    robot: RobotSpec | str | os.PathLike[str],
    inputs: Any,
    tolerance_percent: float = TOLERANCE_PERCENT,
    tolerance_deg: float = math.inf,
    gravity_mps2: Sequence[float] = AT_REST,
    reference: str = "simulation",
    progress: bool | None = None,
) -> ModelChoice:
    """Return which static model of `robot` is accurate enough along `inputs`, and fastest.

    Args:
        robot: a robot, its id or its file.
        inputs: as for `simulate`; rows follow one another, friction's history included.
        tolerance_percent: largest allowed distance of the tip from the reference's [% of the robot's length].
        tolerance_deg: largest allowed angle between the tips' frames [deg].
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        reference: "simulation", or one of `list_models(robot)`.
        progress: show on standard error what is done; None: on a terminal, and in a notebook.

    Raises:
        InputError: anything is not possible.
        SimulationDiverged: the simulation left the finite numbers.

    Examples:
        >>> import catheter_sim as cs
        >>> bend = {"time_s": [0.0, 1.0], "displacement_bending_mm": [1.0, 2.0]}
        >>> cs.which_model("mitral_transseptal", bend, reference="balance").model in ("pk", "balance")
        True
    """
    from catheter_sim.planning.models import compare_models

    value = robot_of(robot)
    percent, degrees = (
        number_of(number, what, "a number above zero", lambda size: size > 0.0)
        for what, number in (("tolerance_percent", tolerance_percent), ("tolerance_deg", tolerance_deg))
    )
    commanded, gravity, shown = inputs_of(value, inputs), gravity_of(gravity_mps2), progress_of(progress)
    result = compare_models(value, commanded, gravity, percent, degrees, str(reference), progress=shown)
    return ModelChoice(value, result, percent, degrees)
