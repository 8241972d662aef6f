"""Which inputs of a robot are planned, and by which model."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import PUBLISHED
from catheter_sim.channels import drives_of
from catheter_sim.core.inputs import Inputs, sums
from catheter_sim.core.posture import Posture, finite_rows
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, SimulationDiverged, unknown
from catheter_sim.robots import face_of, kind_of
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.which_model import (
    ChosenModel,
    apart,
    chosen,
    interleaved_s,
    model_error,
    solver_calls,
)
from catheter_sim.units import si_factor

# ----------------------------------------------------------------------------------------------------
# Which static model is accurate enough along a file of inputs, and fastest: any robot, history included.
#
# `theory.which_model` answers for rods, each set of tensions from rest. Here rows follow one another, as in
# the file, so that friction's history counts; the reference is the simulation, or a static model.

SIMULATION = "simulation"
_LONGEST_S = 20.0  # of timing, all models together


def compare_models(
    robot: RobotSpec,
    inputs: Inputs,
    gravity_mps2: Array,
    tolerance_percent: float,
    tolerance_deg: float = math.inf,
    reference: str = SIMULATION,
    clock: Callable[[], float] = time.process_time,
    progress: bool = False,
) -> ChosenModel:
    """Return the fastest static model whose tip stays within a tolerance of the reference's, row after row.

    Arguments as of `theory.which_model`; the rows of `inputs`, as commanded, make the history, and the
    reference may be "simulation".

    Raises:
        InputError: a tolerance is not above zero, or the reference is unknown or does not solve the rows.
        SimulationDiverged: the simulation did.
    """
    if not (tolerance_percent > 0.0 and tolerance_deg > 0.0):
        raise InputError(f"tolerance {tolerance_percent:g} % and {tolerance_deg:g} deg: must be above zero")
    names = [name for name, model in STATIC_MODELS.items() if model.applies_to(robot)]
    if reference != SIMULATION and reference not in names:
        raise unknown("reference", reference, [SIMULATION, *names], robot.name)
    if reference == SIMULATION:
        run = simulate(robot, inputs, gravity_mps2, progress=progress)
        if run.failure is not None:
            raise SimulationDiverged(run.failure)
        exact: Sequence[Posture] = run.postures
    else:
        exact = STATIC_MODELS[reference].solve(robot, inputs, gravity_mps2).postures
    length_m = kind_of(robot).model.length_m(robot)
    away: dict[str, list[tuple[float, float] | None]] = {}
    why: dict[str, str] = {}
    spent_once = 0.0
    for name in names:
        began = clock()
        try:
            away[name] = _away(name, robot, inputs, gravity_mps2, exact)
        except InputError as error:
            away[name], why[name] = [None] * len(inputs), str(error)
        spent_once += clock() - began
    whole = {name: range(len(inputs)) for name in names if None not in away[name]}
    calls = solver_calls(robot, inputs, gravity_mps2, whole) or {
        name: partial(STATIC_MODELS[name].solve, robot, inputs, gravity_mps2) for name in whole
    }
    rounds = int(np.clip(_LONGEST_S / max(spent_once, 1e-9), 1, 7))
    spent = interleaved_s(calls, clock, rounds)
    ms = {name: 1e3 * spent[name] / len(inputs) if name in spent else math.inf for name in names}
    found = [model_error(name, away[name], length_m, ms[name], why.get(name, "")) for name in names]
    return chosen(found, reference, tolerance_percent, tolerance_deg)


def _away(
    model: str, robot: RobotSpec, inputs: Inputs, gravity: Array, exact: Sequence[Posture]
) -> list[tuple[float, float] | None]:
    """Return each row's distance [m] and angle [rad] from the reference; None where it is not solved."""
    postures = STATIC_MODELS[model].solve(robot, inputs, gravity).postures
    good = finite_rows(postures)
    return [apart(postures[row], right) if row < good else None for row, right in enumerate(exact)]


# ----------------------------------------------------------------------------------------------------
# What a plan may ask of a robot's inputs: drives with a range each, and how they become inputs.
#
# The drives are those by which environments steer (`core.published`). Their ranges follow from the
# joints' own limits or, where a robot has none, from a largest bend that one drive alone would cause
# without friction: the published tasks' of the robot, else 90 deg a segment (assumed). A user may say
# otherwise (`with_limits`).


@dataclass(frozen=True)
class PlanDrives:
    """A robot's inputs as independent drives; a level of 1 is the upper end of a drive's own range."""

    actuation: str  # "tension" or "displacement"
    names: tuple[str, ...]  # an input column, or the bend of a segment (`bend_<segment>_<axis>_deg`)
    least: Array  # levels between which a plan stays, shape (d,)
    most: Array
    unit: Array  # what a level of 1 is, in the unit that the name ends in, shape (d,)
    tendon: Array  # input of each tendon at level 1, shape (t, d) [N or m]
    input_range: Array  # least and largest input of each tendon that the simulation takes, shape (2, t)
    length_m: float  # of the straight robot, all pushed out [m]

    def tendon_inputs(self, levels: Array) -> Array:
        """Return the tendons' inputs at levels (..., d), shape (..., t) [N or m]."""
        asked = np.matmul(levels, self.tendon.T)
        return np.clip(asked, self.input_range[0], self.input_range[1])

    def limit(self, drive: int, upper: bool) -> str:
        """Return one end of a drive's range as `name<=value` or `name>=value`."""
        level = (self.most if upper else self.least)[drive]
        return f"{self.names[drive]}{'<=' if upper else '>='}{level * self.unit[drive]:.6g}"


def plan_drives(robot: RobotSpec) -> PlanDrives:
    """Return the drives of `robot`, driven as it is specified; `InputError` where nothing drives it."""
    face = face_of(robot, "steering", "plan")
    quick = face.quick_model(robot, robot.actuation, _largest_bend_rad(robot.name))
    drives = quick.drives
    column = drives.tendon.T @ sums(drives_of(robot), len(robot.tendons))  # of each drive, at level 1
    by_column = drives.names == tuple(drive.column for drive in drives_of(robot))
    if by_column:
        unit = np.array(
            [value / si_factor(name) for name, value in zip(drives.names, np.diag(column), strict=True)]
        )
        names = drives.names
    else:
        unit = np.degrees(np.abs(drives.bend).reshape(-1, len(drives.names)).max(axis=0))
        names = tuple(f"{name}_deg" for name in drives.names)
    return PlanDrives(
        actuation=drives.actuation,
        names=names,
        least=np.array(drives.lowest, dtype=float),
        most=np.ones(len(names)),
        unit=unit,
        tendon=drives.tendon,
        input_range=np.array(face.input_range(robot)),
        length_m=float(quick.segment_length.sum()),
    )


def with_limits(drives: PlanDrives, limits: Mapping[str, tuple[float, float]], where: str) -> PlanDrives:
    """Return `drives` that stay within a user's limits, least and most by name in the unit that it ends in.

    `InputError`, which calls them `where`: no such drive, least above most, or rest (0) not between them.
    """
    least, most = drives.least.copy(), drives.most.copy()
    for name, (low, high) in limits.items():
        if name not in drives.names:
            raise unknown("input", name, drives.names, where)
        if not (math.isfinite(low) and math.isfinite(high) and low <= 0.0 <= high and low < high):
            raise InputError(f"{where} {name}={low:g},{high:g}: LEAST,MOST with 0 between them is needed")
        k = drives.names.index(name)
        if low < 0.0 <= drives.least[k]:
            raise InputError(f"{where} {name}={low:g},{high:g}: must not be below 0")
        least[k], most[k] = low / drives.unit[k], high / drives.unit[k]
    return replace(drives, least=least, most=most)


def inputs_at(drives: PlanDrives, levels: Array, time_s: Array) -> Inputs:
    """Return levels, shape (r, d), as inputs at the times, shape (r,) [s]."""
    nothing = np.zeros((len(levels), 3))
    return Inputs(time_s, drives.actuation, drives.tendon_inputs(levels), nothing, nothing)


def input_table(robot: RobotSpec, inputs: Inputs, time_s: Array) -> Table:
    """Return inputs as the columns of a file that `simulate` takes, in their units."""
    drives = drives_of(robot, inputs.actuation)
    values = inputs.tendon @ sums(drives, len(robot.tendons))
    columns = {drive.column: values[:, k] / si_factor(drive.column) + 0.0 for k, drive in enumerate(drives)}
    return Table(time_s, columns)


def _largest_bend_rad(name: str) -> float | None:
    """Return what a published robot's tasks ask of a segment; None: the default."""
    published = PUBLISHED.get(name) or PUBLISHED.get(name.partition("@")[0])
    for task in published.environments if published else ():
        if task.task == "Reach":
            value = task.arguments.get("largest_bend_rad")
            return None if value is None else float(value)
    return None
