"""Inverse kinematics of any robot: inputs that bring it to each target in turn, or as near as they can.

The rows are found on the robot's twin (`rows`). Then the whole file is simulated, and what the simulation
misses is asked for on top, as often as it takes or is allowed; rows that it still misses by little are
searched for in the simulation itself (`in_simulation`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.planning.bounded import Found, binding
from catheter_sim.planning.drives import PlanDrives
from catheter_sim.planning.in_simulation import GOOD, InSimulation
from catheter_sim.planning.rows import FRUITLESS, NEARLY, Rows
from catheter_sim.planning.targets import Targets
from catheter_sim.progress import counted

TOLERANCE_SHARE = 1e-3  # of the robot's length: a target that is missed by less is reached
TOLERANCE_DEG = 0.2  # the same of angles and of the direction
CORRECTIONS = 3  # by simulation, at most
WORKSPACE = "workspace"  # no input's limit binds, and still the robot comes no nearer


@dataclass(frozen=True)
class Tolerance:
    """By how much a reached target may be missed."""

    mm: float
    deg: float

    def of_misses(self, targets: Targets) -> float:
        """Return the largest length of misses with which every column is within the tolerance."""
        return float(
            min(
                self.mm / targets.length_mm if targets.millimetres else np.inf,
                np.radians(self.deg) if len(targets.names) > targets.millimetres else np.inf,
            )
        )


@dataclass(frozen=True)
class Plan:
    """Inputs for targets.

    Attributes:
        targets: what was asked.
        inputs: a row for each target.
        reached: the targets' columns by the twin, shape (r, m).
        simulated: the same by the simulation, shape (r, m); None: not simulated.
        error_mm, error_deg: what is missed of each row's target, by the simulation where there is one, (r,).
        reachable: whether that is within the tolerance, shape (r,).
        limits: of a row that is not reachable, the limits that hold it back, else empty.
        corrections: how often the simulation's misses were corrected.
    """

    targets: Targets
    inputs: Inputs
    reached: Array
    simulated: Array | None
    error_mm: Array
    error_deg: Array
    reachable: np.ndarray
    limits: tuple[str, ...]
    corrections: int


def inverse_kinematics(
    robot: RobotSpec,
    targets: Targets,
    drives: PlanDrives,
    gravity_mps2: Array,
    corrections: int | None = CORRECTIONS,
    tolerance: Tolerance | None = None,
    progress: bool = False,
) -> Plan:
    """Return inputs that bring `robot` to one target after another, each row held until rest.

    Args:
        robot: as it is specified, effects named.
        targets: what is asked.
        drives: what may be asked of the inputs.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        corrections: largest number of corrections by simulation; None: do not simulate at all.
        tolerance: default: `TOLERANCE_SHARE`, `TOLERANCE_DEG`.
        progress: show on standard error what is done.

    Raises:
        InputError: the robot cannot be driven or built, or stands nowhere that the twin knows.
        SimulationDiverged: the simulation left the finite numbers under the inputs found.
    """
    within = tolerance or Tolerance(TOLERANCE_SHARE * targets.length_mm, TOLERANCE_DEG)
    rows = Rows(robot, targets, drives, gravity_mps2, within.of_misses(targets))
    found = rows.find(np.zeros_like(targets.asked), None, progress)
    if corrections is None:
        return _plan(rows, within, found, None, 0)
    simulation = InSimulation(rows, robot, gravity_mps2)
    found, plan = _corrected(rows, simulation, within, found, corrections, progress)
    return _searched_by_simulation(rows, simulation, within, found, plan, progress) if corrections else plan


def _corrected(
    rows: Rows,
    simulation: InSimulation,
    within: Tolerance,
    found: list[Found],
    corrections: int,
    progress: bool,
) -> tuple[list[Found], Plan]:
    """Return what is found, and its plan, where the simulation's misses are asked for on top."""
    targets = rows.targets
    offset = np.zeros_like(targets.asked)
    best: tuple[list[Found], Plan] | None = None
    for count in range(corrections + 1):
        plan = _plan(rows, within, found, simulation.reached(found, progress), count)
        if best is None or _score(plan) < _score(best[1]):
            best = found, plan
        assert plan.simulated is not None
        close = _inside(targets, within, plan.simulated, targets.asked)
        done = close | ~_inside(targets, within, plan.reached, targets.asked + offset)
        if done.all() or count == corrections:
            break
        missed = np.where(np.isfinite(targets.asked), targets.asked - plan.simulated, 0.0)
        offset = offset + np.where(done[:, np.newaxis], 0.0, missed)
        found = rows.find(offset, found, progress)
    assert best is not None
    return best


def _searched_by_simulation(
    rows: Rows, simulation: InSimulation, within: Tolerance, found: list[Found], plan: Plan, progress: bool
) -> Plan:
    """Return the best plan where one row after another that is missed by little is searched for anew.

    Rows after one that is found may be missed by that: they are searched for in their turn.
    """
    best, fruitless = plan, 0
    for row in counted(range(len(found)), len(found), "searching by simulation", "target", progress):
        error = max(plan.error_mm[row] / within.mm, plan.error_deg[row] / within.deg)
        if plan.reachable[row] or error > NEARLY or rows.too_far(row) or fruitless == FRUITLESS:
            continue
        other = simulation.row(found, row)
        if other is None:
            fruitless += 1
            continue
        changed = [*found[:row], other, *found[row + 1 :]]
        again = _plan(rows, within, changed, simulation.reached(changed), plan.corrections)
        if not again.reachable[row]:
            fruitless += 1
            continue
        found, plan, fruitless = changed, again, 0
        best = min(best, plan, key=_score)
    return best


def _inside(targets: Targets, within: Tolerance, seen: Array, asked: Array) -> np.ndarray:
    """Return which rows are missed by so little that nothing is corrected, shape (r,)."""
    misses = targets.misses(seen, asked)
    near = targets.error_mm(misses) <= GOOD * within.mm
    return near & (targets.error_deg(misses) <= GOOD * within.deg)


def _plan(
    rows: Rows, within: Tolerance, found: Sequence[Found], simulated: Array | None, corrections: int
) -> Plan:
    """Return what was found as a plan."""
    targets, drives = rows.targets, rows.drives
    reached = rows.reached(found)
    misses = targets.misses(reached if simulated is None else simulated, targets.asked)
    error_mm, error_deg = targets.error_mm(misses), targets.error_deg(misses)
    reachable = (error_mm <= within.mm) & (error_deg <= within.deg)
    limits = []
    for item, can in zip(found, reachable, strict=True):
        held = [drives.limit(k, upper) for k, upper in binding(item, drives.least, drives.most)]
        limits.append("" if can else ";".join(held) or WORKSPACE)
    return Plan(
        targets,
        rows.inputs(found),
        reached,
        simulated,
        error_mm,
        error_deg,
        reachable,
        tuple(limits),
        corrections,
    )


def _score(plan: Plan) -> tuple[int, float]:
    """Return a number that is the less, the better a plan is: rows that are reached, then what is missed."""
    return -int(plan.reachable.sum()), float(plan.error_mm.sum() + plan.error_deg.sum())
