"""Inputs that bring a robot to targets, or as near as they can."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catheter_sim.core.requirements import number_of, whole_of
from catheter_sim.errors import InputError, shown
from catheter_sim.public.arguments import AT_REST, gravity_of, mapping_of, path_of, progress_of, robot_of
from catheter_sim.public.data import table_of
from catheter_sim.public.listing import Listing, data_frame, listing_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from catheter_sim.arrays import Array
    from catheter_sim.core.inputs import Inputs
    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.planning.inverse import Plan
    from catheter_sim.tables import Table

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
    plan: Plan

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
        from catheter_sim.planning.drives import input_table

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
        from catheter_sim.public.planning_figures import inverse_figure

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
            direction of the tip's axis (`tip_direction_x`, `_y`, `_z`), and every other output column in mm
            or deg (`angle_bending_deg`), shape (r,) each; NaN asks nothing. Without `time_s` rows are a
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
    from catheter_sim.planning.drives import plan_drives, with_limits
    from catheter_sim.planning.inverse import TOLERANCE_DEG, TOLERANCE_SHARE, Tolerance
    from catheter_sim.planning.inverse import inverse_kinematics as solve
    from catheter_sim.planning.targets import targets_of

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
