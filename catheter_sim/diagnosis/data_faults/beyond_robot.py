"""Commands and motions far beyond what the robot can do: a wrong unit or spool, counts read as an angle."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import drives_of
from catheter_sim.core.drive import Quantity, sums
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.mapping.scales import UNITS
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.data_faults.units import MISREAD
from catheter_sim.diagnosis.thresholds import (
    MOTION_BEYOND,
    OUTER_SHARE,
    PULL_BEYOND,
    TENSION_BEYOND,
    TURN_BEYOND,
)
from catheter_sim.errors import InputError
from catheter_sim.planning.drives import plan_drives
from catheter_sim.robots import kind_of

_MOST = {Quantity.DISPLACEMENT: PULL_BEYOND, Quantity.TENSION: TENSION_BEYOND}
_COUNTS = "an encoder's counts read as an angle"
_READ = {
    "mm": ("cm", "in", "m", "mm"),
    "way": ("mm",),
    "deg": ("rad",),
    "N": ("lbf", "kgf", "N"),
}


@dataclass(frozen=True)
class Beyond:
    """A column whose numbers are far beyond the robot.

    Attributes:
        column: of the inputs or outputs.
        times: what the robot can do.
        what: what is beyond, a sentence without its end.
        kind: "way" of a tendon, "N", or "mm" and "deg" of a motion.
        impossible: by so much that no such robot was measured.
    """

    column: str
    times: float
    what: str
    kind: str
    impossible: bool

    def words(self, unit: str = "", spool_radius_mm: float = 0.0) -> str:
        """Return it as one line, with what is likely wrong.

        Args:
            unit: as which the file was read; "": not known.
            spool_radius_mm: with which a motor's angle was read; 0: not known, or none.
        """
        read = (unit,) if unit else _READ[self.kind]
        fitting = [(by, f"{of} read as {own}") for by, own, of in MISREAD if own in read]
        likely = [said for _, said in sorted(item for item in fitting if item[0] >= 0.5 * self.times)[:2]]
        if self.kind == "way" and unit in ("", *UNITS["deg"]):
            likely.append(_COUNTS)
        if spool_radius_mm:
            likely.append(f"a spool of {spool_radius_mm / self.times:.2g} mm for one of {spool_radius_mm:g}")
        elif self.kind == "way" and not unit:
            likely.append(f"a spool whose radius is {_figure(self.times)} times too large")
        guess = f"; perhaps {', or '.join(likely)}" if likely else ""
        return f"{self.what}: its unit or scale is wrong{guess}"


def beyond_robot(robot: RobotSpec, trials: Sequence[Trial]) -> tuple[Beyond, ...]:
    """Return the columns of inputs, then of outputs, that are far beyond what a robot can do."""
    return (*_commands(robot, trials), *_motions(robot, trials))


def within_robot(robot: RobotSpec, inputs: Inputs) -> Inputs:
    """Return inputs with those of tendons cut off at what bends `robot` fully."""
    full = _full(replace(robot, actuation=inputs.actuation))
    return inputs if full is None else replace(inputs, tendon=np.clip(inputs.tendon, -full, full))


def _full(robot: RobotSpec) -> Array | None:
    """Return each tendon's input that bends `robot` fully, all drives together, shape (t,).

    Infinite for a tendon that bends nothing; None where none does.
    """
    try:
        plan = plan_drives(robot)
    except InputError:
        return None
    full = np.abs(plan.tendon) @ np.maximum(np.abs(plan.least), plan.most)
    return np.where(full > 0.0, full, np.inf)


def full_pulls(robot: RobotSpec) -> dict[str, float]:
    """Return by input column what bends `robot` fully, SI; a column that bends nothing is left out."""
    full = _full(robot)
    if full is None:
        return {}
    drives = [drive for drive in drives_of(robot) if drive.quantity in _MOST]
    found = {
        drive.column: min(full[i] / abs(part) for i, part in zip(drive.tendons, drive.parts, strict=True))
        for drive in drives
    }
    return {column: float(value) for column, value in found.items() if np.isfinite(value)}


def _commands(robot: RobotSpec, trials: Sequence[Trial]) -> Iterable[Beyond]:
    driven = replace(robot, actuation=trials[0].inputs.actuation)
    full, drives = full_pulls(driven), drives_of(driven)
    asked = [np.abs(trial.inputs.tendon @ sums(drives, trial.inputs.tendon.shape[1])) for trial in trials]
    for drive, values in zip(drives, np.concatenate(asked).T, strict=True):
        if drive.column not in full:
            continue
        reach, most = float(np.quantile(values, 1.0 - OUTER_SHARE)), full[drive.column]
        said, impossible = _MOST[drive.quantity]
        if reach > said * most:
            unit, size = drive.quantity.file_unit, drive.quantity.file_size
            what = (
                f"{drive.column} reaches {_figure(reach / size)} {unit}, {_figure(reach / most)} times the "
                f"{most / size:.2g} {unit} that bend the robot fully"
            )
            kind = "N" if drive.quantity is Quantity.TENSION else "way"
            yield Beyond(drive.column, reach / most, what, kind, reach > impossible * most)


def _motions(robot: RobotSpec, trials: Sequence[Trial]) -> Iterable[Beyond]:
    length_mm = 1e3 * kind_of(robot).model.length_m(robot)
    sizes = {
        "mm": (length_mm, MOTION_BEYOND, f"the robot's length of {length_mm:.3g} mm"),
        "deg": (360.0, TURN_BEYOND, "a full turn"),
    }
    for column in trials[0].outputs.columns:
        unit = column.rsplit("_", 1)[-1]
        if unit not in sizes:
            continue
        size, (said, impossible), name = sizes[unit]
        moves = max(_spread(trial.outputs.columns[column]) for trial in trials)
        if moves > said * size:
            what = f"{column} moves by {_figure(moves)} {unit}, {_figure(moves / size)} times {name}"
            yield Beyond(column, moves / size, what, unit, moves > impossible * size)


def _figure(value: float) -> str:
    """Return a number in two digits, or whole."""
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def _spread(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.subtract(*np.quantile(known, (1.0 - OUTER_SHARE, OUTER_SHARE)))) if len(known) else 0.0
