"""The rows of one file of targets, searched for on a robot's twin, one after another.

Each row is solved after the rows before it: a robot that rubs gets the inputs that lead to the target from
where it stands. With inputs to spare, a row that is out of reach from there lets the one before be reached in
another way.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError
from catheter_sim.planning.bounded import Found, Function, differences, least_squares
from catheter_sim.planning.drives import PlanDrives, inputs_at
from catheter_sim.planning.forward import Forward
from catheter_sim.planning.targets import Targets
from catheter_sim.planning.workspace import random_levels
from catheter_sim.progress import counted

# What is missed by more than the tolerance and less than so many times it is looked for in other ways. Rows
# that are out of reach mostly stand together: after so many in which nothing is found no more is looked for.
NEARLY, FRUITLESS = 50.0, 3
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


class Rows:
    """The rows of one file of targets.

    Attributes:
        targets: the file's.
        drives: what may be asked of the inputs.
        clock: when each row is held, shape (r,) [s]: a second from rest to the first.
        tolerance: the largest length of misses with which a target is reached.
        remembers: whether a posture depends on the rows before.
        spare: whether it does, and the robot has more inputs than are needed.
    """

    def __init__(
        self, robot: RobotSpec, targets: Targets, drives: PlanDrives, gravity_mps2: Array, tolerance: float
    ) -> None:
        self.targets, self.drives, self.tolerance = targets, drives, tolerance
        self.clock = targets.time_s - targets.time_s[0] + 1.0
        self._forward = Forward(robot, drives, targets, gravity_mps2)
        self.remembers = self._forward.remembers
        self.spare = self.remembers and len(drives.names) > len(targets.names)
        self._cloud = _cloud(drives, _CLOUD_RUBBING if self.remembers else _CLOUD)
        self._cloud_seen = self._forward.seen(np.zeros((0, len(drives.names))), self._cloud, np.zeros(1))
        if not np.isfinite(self._cloud_seen).all(axis=1).any():
            raise InputError(f"{robot.name}: no posture of its twin balances within the limits of its inputs")
        self._enough = (_ENOUGH_TO_SPARE if self.spare else _ENOUGH) * tolerance
        self._near = (_NEAR_TO_SPARE if self.spare else 1.0) * self._enough

    def find(self, offset: Array, known: list[Found] | None, progress: bool) -> list[Found]:
        """Return what is found for each row, asked for with an offset, shape (r, m).

        Args:
            offset: added to what is asked.
            known: of the rows as found with a smaller or no offset; None: nothing is known.
            progress: show how many rows are done.
        """
        asked = self.targets.asked + offset
        found: list[Found] = []
        name, fruitless = "inverse kinematics" if known is None else "correcting", 0
        for row in counted(range(len(asked)), len(asked), name, "target", progress):
            if known is not None and np.isfinite(self._misses(asked, found, row)(_as_row(known[row]))).all():
                found.append(self._search(asked, found, row, known[row].point, known[row].slopes))
                continue
            found.append(self._best(asked, found, row))
            missed = found[-1].size / self.tolerance
            if (
                row
                and self.spare
                and 1.0 < missed < NEARLY
                and not self.too_far(row)
                and fruitless < FRUITLESS
            ):
                pair = self._by_another_way(asked, found, row)
                found[-2:], fruitless = pair or found[-2:], 0 if pair else fruitless + 1
        return found

    def others(self, found: Sequence[Found], row: int) -> Iterator[Found]:
        """Yield inputs by which the twin reaches a row's target after those of the rows before."""
        yield from self._others(self.targets.asked, found, row)

    def too_far(self, row: int) -> bool:
        """Return whether a tip is asked for beyond the robot's length: one search finds the nearest."""
        place = dict(zip(self.targets.names, self.targets.asked[row], strict=True))
        tip = np.array([place.get(f"tip_{axis}_mm", 0.0) for axis in "xyz"])
        within_mm = self.tolerance * self.targets.length_mm
        return bool(np.linalg.norm(np.nan_to_num(tip)) > self.targets.length_mm + within_mm)

    def reached(self, found: Sequence[Found]) -> Array:
        """Return the targets' columns by the twin, shape (r, m)."""
        levels = np.array([item.point for item in found])
        rows = range(len(levels))
        seen = [
            self._forward.seen(levels[:row], levels[row : row + 1], self.clock[: row + 1]) for row in rows
        ]
        return np.concatenate(seen)

    def inputs(self, found: Sequence[Found]) -> Inputs:
        """Return the rows' inputs."""
        levels = np.array([item.point for item in found])
        return inputs_at(self.drives, levels, self.targets.time_s - self.targets.time_s[0])

    def _misses(self, asked: Array, found: Sequence[Found], row: int) -> Function:
        past = np.array([item.point for item in found[:row]]).reshape(-1, len(self.drives.names))
        times = self.clock[: row + 1]
        return lambda levels: self.targets.misses(self._forward.seen(past, levels, times), asked[row])

    def _search(
        self, asked: Array, found: Sequence[Found], row: int, start: Array, slopes: Array | None = None
    ) -> Found:
        misses = self._misses(asked, found, row)
        return least_squares(misses, start, self.drives.least, self.drives.most, self._enough, slopes)

    def _best(self, asked: Array, found: Sequence[Found], row: int) -> Found:
        """Return the nearest that searches come from anywhere to a row's target."""
        best: Found | None = None
        for item in self._searches(asked, found, row):
            if best is None or item.size < best.size:
                best = item
            if best.size <= self._near:
                return best
        if best is None:
            raise InputError(f"row {row + 1}: the twin has no balance near any posture from which to search")
        misses = self._misses(asked, found, row)
        fresh = differences(misses, best.point, best.misses, self.drives.least, self.drives.most)
        return replace(best, slopes=fresh)

    def _searches(self, asked: Array, found: Sequence[Found], row: int) -> Iterator[Found]:
        """Yield where the searches from starts apart from one another end, the best start first."""
        misses = self._misses(asked, found, row)
        starts = self._starts(asked[row], found[:row])
        size = np.linalg.norm(misses(starts), axis=1)
        tried: list[Array] = []
        most = 1 if self.too_far(row) else _SEARCHES_TO_SPARE if self.spare else _SEARCHES
        for index in np.argsort(np.where(np.isfinite(size), size, np.inf)):
            alike = any(np.abs(starts[index] - other).max() < _APART for other in tried)
            if not np.isfinite(size[index]) or alike or len(tried) == most:
                continue
            tried.append(starts[index])
            yield self._search(asked, found, row, starts[index])

    def _nearly(self, found: Found) -> bool:
        """Return whether a robot with inputs to spare missed by little."""
        return self.spare and 1.0 < found.size / self.tolerance < NEARLY

    def _others(self, asked: Array, found: Sequence[Found], row: int) -> Iterator[Found]:
        for item in self._searches(asked, found, row):
            if item.size <= self._near:
                yield item

    def _by_another_way(self, asked: Array, found: Sequence[Found], row: int) -> list[Found] | None:
        """Return the inputs of the row before and of a row, such that both are reached; None: not found.

        After each other way to the row before searches go on from where the row was nearest; then, where none
        of them ends at it, from inputs at rest: what was pulled may have to be let go.
        """
        at_rest = np.clip(0.0, self.drives.least, self.drives.most)
        tried: list[Found] = []
        for before in self._others(asked, found, row - 1):
            item = self._search(asked, [*found[: row - 1], before], row, found[row].point)
            if item.size <= self._near:
                return [before, item]
            tried.append(before)
        for before in tried:
            item = self._search(asked, [*found[: row - 1], before], row, at_rest)
            if item.size <= self._near:
                return [before, item]
        return None

    def _starts(self, asked: Array, found: Sequence[Found]) -> Array:
        """Return levels to search from, shape (s, d): postures near the target, and the one before."""
        size = np.linalg.norm(self.targets.misses(self._cloud_seen, asked), axis=1)
        order = np.argsort(np.where(np.isfinite(size), size, np.inf))
        before = _as_row(found[-1]) if found else np.zeros((1, len(self.drives.names)))
        nearest = self._cloud[self._spread(order, _STARTS)]
        if self.spare or not self.remembers:
            return np.vstack([before, nearest])
        # After other inputs a posture from rest is elsewhere.
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


def _as_row(found: Found) -> Array:
    return found.point[np.newaxis]


def _cloud(drives: PlanDrives, count: int) -> Array:
    """Return levels all over the range, the same every time, shape (count, d)."""
    levels = random_levels(drives, count, np.random.default_rng(0))
    levels[0] = 0.0
    return levels
