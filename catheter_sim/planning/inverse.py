"""Inverse kinematics of any robot: inputs that bring it to each target in turn, or as near as they can.

Each row is solved on the robot's twin, after the rows before it: a robot that rubs gets the inputs that
lead to the target from where it stands, so that its hysteresis is compensated. Then the whole file is
simulated, and what the simulation misses is asked for on top, as often as it takes or is allowed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.columns import posture_columns
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Array, Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, SimulationDiverged
from catheter_sim.planning.bounded import Found, binding, differences, least_squares
from catheter_sim.planning.drives import PlanDrives, inputs_at
from catheter_sim.planning.forward import REMEMBERED, Forward
from catheter_sim.planning.targets import Targets
from catheter_sim.planning.workspace import random_levels
from catheter_sim.progress import counted
from catheter_sim.simulation.replay import simulate

TOLERANCE_SHARE = 1e-3  # of the robot's length: a target that is missed by less is reached
TOLERANCE_DEG = 0.2  # the same of angles and of the direction
CORRECTIONS = 3  # by simulation, at most
WORKSPACE = "workspace"  # no input's limit binds, and still the robot comes no nearer
_CLOUD, _CLOUD_RUBBING = (
    1024,
    256,
)  # postures from rest among which searches start; fewer where each takes long
_STARTS, _ELSEWHERE = 16, 12  # near the target, and anywhere; the best of them are searched from
_SEARCHES, _SEARCHES_TO_SPARE = 10, 24  # at most, until one reaches the target; the second one as below
_APART = 0.3  # of some input's range: searches from starts that are nearer to one another end alike
# Share of the tolerance at which a search ends; the second one of robots that rub and have inputs to spare:
# without these, what rows before leave of their error may put a target out of reach.
_ENOUGH, _ENOUGH_TO_SPARE = 0.02, 0.1
_NEAR_TO_SPARE = (
    5.0  # times that: with inputs to spare no other search is begun; simulation corrects the rest
)
_GOOD = 0.3  # share of the tolerance below which the simulation's miss is left alone
# What the simulation misses by more than the tolerance and less than so many times it is searched for in the
# simulation itself: a twin that keeps tensions by their own history may stick where the robot slides.
# Rows that are out of reach mostly stand together: after so many in which nothing is found the search ends.
_NEARLY, _STEPS_BY_SIMULATION, _FRUITLESS = 50.0, 8, 3


@dataclass(frozen=True)
class Tolerance:
    """By how much a reached target may be missed."""

    mm: float
    deg: float


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
    search = _Search(robot, targets, drives, gravity_mps2, within)
    found = search.rows(np.zeros_like(targets.asked), None, progress)
    if corrections is None:
        return search.plan(found, None, 0)
    offset = np.zeros_like(targets.asked)
    best: tuple[list[Found], Plan] | None = None
    for count in range(corrections + 1):
        plan = search.plan(found, search.simulated(found, progress), count)
        if best is None or _score(plan) < _score(best[1]):
            best = found, plan
        assert plan.simulated is not None
        done = search.close(plan.simulated) | ~search.reaches(plan.reached, offset)
        if done.all() or count == corrections:
            break
        missed = np.where(np.isfinite(targets.asked), targets.asked - plan.simulated, 0.0)
        offset = offset + np.where(done[:, np.newaxis], 0.0, missed)
        found = search.rows(offset, found, progress)
    assert best is not None
    return search.by_simulation(*best, progress) if corrections else best[1]


class _Search:
    """The rows of one file of targets, searched one after another.

    Attributes:
        targets: the file's.
    """

    def __init__(
        self, robot: RobotSpec, targets: Targets, drives: PlanDrives, gravity_mps2: Array, within: Tolerance
    ) -> None:
        self.targets, self._drives, self._within = targets, drives, within
        self._robot, self._gravity_mps2 = robot, gravity_mps2
        self._forward = Forward(robot, drives, targets, gravity_mps2)
        self._clock = targets.time_s - targets.time_s[0] + 1.0  # from rest to the first row: a second
        self._cloud = _cloud(drives, _CLOUD_RUBBING if self._forward.remembers else _CLOUD)
        self._cloud_seen = self._forward.seen(np.zeros((0, len(drives.names))), self._cloud, np.zeros(1))
        if not np.isfinite(self._cloud_seen).all(axis=1).any():
            raise InputError(f"{robot.name}: no posture of its twin balances within the limits of its inputs")
        self._spare = self._forward.remembers and len(drives.names) > len(targets.names)
        self._reached = min(
            within.mm / targets.length_mm if targets.millimetres else np.inf,
            np.radians(within.deg) if len(targets.names) > targets.millimetres else np.inf,
        )
        self._enough = (_ENOUGH_TO_SPARE if self._spare else _ENOUGH) * self._reached

    def rows(self, offset: Array, known: list[Found] | None, progress: bool) -> list[Found]:
        """Return what is found for each row, asked for with an offset, shape (r, m).

        Args:
            offset: added to what is asked.
            known: of the rows as found with a smaller or no offset; None: nothing is known.
            progress: show how many rows are done.
        """
        asked = self.targets.asked + offset
        found: list[Found] = []
        rows = len(asked)
        name = "inverse kinematics" if known is None else "correcting"
        for row in counted(range(rows), rows, name, "target", progress):
            past = np.array([item.point for item in found]).reshape(-1, len(self._drives.names))
            found.append(self._row(asked[row], past, row, known[row] if known else None))
        return found

    def _row(self, asked: Array, past: Array, row: int, known: Found | None) -> Found:
        least, most = self._drives.least, self._drives.most
        times = self._clock[: row + 1]

        def misses(levels: Array) -> Array:
            return self.targets.misses(self._forward.seen(past, levels, times), asked)

        if known is not None and np.isfinite(misses(known.point[np.newaxis])).all():
            return least_squares(misses, known.point, least, most, self._enough, known.slopes)
        starts = self._starts(asked, past)
        size = np.linalg.norm(misses(starts), axis=1)
        best: Found | None = None
        tried: list[Array] = []
        searches = 1 if self._too_far(asked) else _SEARCHES_TO_SPARE if self._spare else _SEARCHES
        for index in np.argsort(np.where(np.isfinite(size), size, np.inf)):
            alike = any(np.abs(starts[index] - other).max() < _APART for other in tried)
            if not np.isfinite(size[index]) or alike or len(tried) == searches:
                continue
            tried.append(starts[index])
            found = least_squares(misses, starts[index], least, most, self._enough)
            if best is None or found.size < best.size:
                best = found
            if best.size <= (_NEAR_TO_SPARE if self._spare else 1.0) * self._enough:
                return best
        if best is None:
            raise InputError(f"row {row + 1}: the twin has no balance near any posture from which to search")
        fresh = differences(misses, best.point, best.misses, least, most)
        return replace(best, slopes=fresh)

    def _too_far(self, asked: Array) -> bool:
        """Return whether a tip is asked for beyond the robot's length: one search finds the nearest."""
        place = dict(zip(self.targets.names, asked, strict=True))
        tip = np.array([place.get(f"tip_{axis}_mm", 0.0) for axis in "xyz"])
        return bool(np.linalg.norm(np.nan_to_num(tip)) > self.targets.length_mm + self._within.mm)

    def _starts(self, asked: Array, past: Array) -> Array:
        """Return levels to search from, shape (s, d): postures near the target, and the one before."""
        size = np.linalg.norm(self.targets.misses(self._cloud_seen, asked), axis=1)
        order = np.argsort(np.where(np.isfinite(size), size, np.inf))
        before = past[-1:] if len(past) else np.zeros((1, len(self._drives.names)))
        if self._spare or not self._forward.remembers:
            return np.vstack([before, self._cloud[self._spread(order, _STARTS)]])
        # After other inputs a posture from rest is elsewhere.
        nearest = self._cloud[self._spread(order, _STARTS)]
        return np.vstack([before, nearest, self._cloud[1 : _ELSEWHERE + 1]])

    def _spread(self, order: np.ndarray, count: int) -> list[int]:
        """Return the first of some postures of the cloud, and then those that are apart from all before."""
        chosen: list[int] = []
        for index in order[: count * count]:
            if all(np.abs(self._cloud[index] - self._cloud[other]).max() >= _APART for other in chosen):
                chosen.append(int(index))
            if len(chosen) == count:
                break
        return chosen

    def simulated(self, found: Sequence[Found], progress: bool = False) -> Array:
        """Return the targets' columns by the simulation, shape (r, m).

        Raises:
            SimulationDiverged: the simulation left the finite numbers.
        """
        run = simulate(self._robot, self.inputs(found), self._gravity_mps2, progress=progress)
        if run.failure is not None:
            raise SimulationDiverged(run.failure)
        return self._columns(run.postures)

    def by_simulation(self, found: list[Found], plan: Plan, progress: bool) -> Plan:
        """Return a plan in which rows that are missed by little are searched for in the simulation itself."""
        fruitless = 0
        for row in counted(range(len(found)), len(found), "searching by simulation", "target", progress):
            error = max(plan.error_mm[row] / self._within.mm, plan.error_deg[row] / self._within.deg)
            hopeless = error > _NEARLY or self._too_far(self.targets.asked[row]) or fruitless == _FRUITLESS
            if plan.reachable[row] or hopeless:
                continue
            other, fruitless = self._row_by_simulation(found, row), fruitless + 1
            if other is None:
                continue
            changed = [*found[:row], other, *found[row + 1 :]]
            again = self.plan(changed, self.simulated(changed), plan.corrections)
            if _score(again) < _score(plan):
                found, plan, fruitless = changed, again, 0
        return plan

    def _row_by_simulation(self, found: Sequence[Found], row: int) -> Found | None:
        """Return inputs that reach a row's target after those of the rows before; None: none were found.

        Of the rows before, those are simulated that a twin is given.
        """
        way = found[max(row - REMEMBERED, 0) if self._forward.remembers else row : row]

        def misses(levels: Array) -> Array:
            seen = [self._simulated_last(way, row, level) for level in levels]
            return self.targets.misses(np.array(seen), self.targets.asked[row])

        start = found[row].point
        if not np.isfinite(misses(start[np.newaxis])).all():
            return None
        least, most, enough = self._drives.least, self._drives.most, _GOOD * self._reached
        other = least_squares(misses, start, least, most, enough, steps=_STEPS_BY_SIMULATION)
        return other if other.size <= self._reached else None

    def _simulated_last(self, way: Sequence[Found], row: int, level: Array) -> Array:
        """Return the targets' columns of one row by the simulation, after a way from rest; NaN: diverged."""
        levels = np.array([*(item.point for item in way), level])
        clock = self._clock[row - len(way) : row + 1]
        inputs = inputs_at(self._drives, levels, clock - clock[0])
        run = simulate(self._robot, inputs, self._gravity_mps2)
        if run.failure is not None:
            return np.full(len(self.targets.names), np.nan)
        return self._columns(run.postures[-1:])[0]

    def _columns(self, postures: Sequence[Posture]) -> Array:
        columns = posture_columns(self._robot, postures, self.targets.observed)
        return self.targets.seen(np.stack([columns[name] for name in self.targets.observed], axis=1))

    def reaches(self, reached: Array, offset: Array) -> np.ndarray:
        """Return for which rows the twin comes to what is asked with an offset, shape (r,)."""
        return self._inside(self.targets.misses(reached, self.targets.asked + offset), _GOOD)

    def close(self, simulated: Array) -> np.ndarray:
        """Return which rows the simulation misses by so little that nothing is corrected, shape (r,)."""
        return self._inside(self.targets.misses(simulated, self.targets.asked), _GOOD)

    def _inside(self, misses: Array, share: float) -> np.ndarray:
        near = self.targets.error_mm(misses) <= share * self._within.mm
        return near & (self.targets.error_deg(misses) <= share * self._within.deg)

    def inputs(self, found: Sequence[Found]) -> Inputs:
        """Return the rows' inputs."""
        levels = np.array([item.point for item in found])
        return inputs_at(self._drives, levels, self.targets.time_s - self.targets.time_s[0])

    def plan(self, found: Sequence[Found], simulated: Array | None, corrections: int) -> Plan:
        """Return what was found as a plan."""
        targets, drives = self.targets, self._drives
        levels = np.array([item.point for item in found])
        clock = self._clock
        reached = np.array(
            [
                self._forward.seen(levels[:row], levels[row : row + 1], clock[: row + 1])[0]
                for row in range(len(levels))
            ]
        )
        misses = targets.misses(reached if simulated is None else simulated, targets.asked)
        error_mm, error_deg = targets.error_mm(misses), targets.error_deg(misses)
        reachable = (error_mm <= self._within.mm) & (error_deg <= self._within.deg)
        limits = []
        for item, can in zip(found, reachable, strict=True):
            held = [drives.limit(k, upper) for k, upper in binding(item, drives.least, drives.most)]
            limits.append("" if can else ";".join(held) or WORKSPACE)
        return Plan(
            targets,
            self.inputs(found),
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


def _cloud(drives: PlanDrives, count: int) -> Array:
    """Return levels all over the range, the same every time, shape (count, d)."""
    levels = random_levels(drives, count, np.random.default_rng(0))
    levels[0] = 0.0
    return levels
