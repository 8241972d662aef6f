"""Inputs that bring a robot to targets, or as near as its limits let it; and the points that it reaches."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import QUATERNION, check_output_channels, output_channels, posture_columns
from catheter_sim.core.inputs import Inputs, Quantity, quantity_of
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import built_in, check_effects
from catheter_sim.errors import InputError, SimulationDiverged, unknown
from catheter_sim.planning.bounded import BoundedFit, Function, binding, differences, least_squares
from catheter_sim.planning.models import PlanDrives, inputs_at
from catheter_sim.progress import counted
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table
from catheter_sim.theory.twins import Prediction, twin_for

# ----------------------------------------------------------------------------------------------------
# What is asked of a robot's posture, row by row, and by how much a posture misses it.
#
# A target is any output column in mm or deg, or the direction of the tip's axis as `tip_direction_x`, `_y`,
# `_z`. Misses of all kinds become one vector without unit: a mm counts as its share of the robot's length,
# a radian as one. So a degree weighs as much as 1.7 % of the length.

DIRECTION = ("tip_direction_x", "tip_direction_y", "tip_direction_z")
_SHORTEST = 1e-6  # a direction's length


@dataclass(frozen=True)
class Targets:
    """What is asked, row by row."""

    time_s: Array  # shape (r,) [s]
    names: tuple[str, ...]  # columns in mm, then those in deg, then the direction's three if asked
    asked: Array  # their values, shape (r, m); NaN: not asked in this row
    millimetres: int  # how many of the columns are in mm and in deg
    degrees: int
    length_mm: float  # by which mm are measured

    @property
    def observed(self) -> tuple[str, ...]:
        """The output columns that show what is asked: the tip's quaternion shows its direction."""
        plain = self.names[: self.millimetres + self.degrees]
        return (*plain, *QUATERNION) if len(self.names) > len(plain) else plain

    def values_of(self, outputs: Array) -> Array:
        """Return the values of `names` in outputs of `observed`, shape (..., m)."""
        plain = self.millimetres + self.degrees
        if len(self.names) == plain:
            return outputs
        return np.concatenate([outputs[..., :plain], axis_of(outputs[..., plain:])], axis=-1)

    def misses(self, seen: Array, asked: Array) -> Array:
        """Return seen less asked without unit, shape (..., m); 0 where nothing is asked."""
        unit = np.ones(len(self.names))
        unit[: self.millimetres] = 1.0 / self.length_mm
        unit[self.millimetres : self.millimetres + self.degrees] = np.radians(1.0)
        missed = (seen - asked) * unit
        return np.where(np.isnan(np.broadcast_to(asked, missed.shape)), 0.0, missed)

    def error_mm(self, misses: Array) -> Array:
        """Return the distance that misses (..., m) are of what is asked in mm, shape (...) [mm]."""
        return np.asarray(np.linalg.norm(misses[..., : self.millimetres], axis=-1) * self.length_mm)

    def error_deg(self, misses: Array) -> Array:
        """Return the largest miss of what is asked in deg, the direction's included, shape (...) [deg]."""
        plain = self.millimetres + self.degrees
        turned = np.abs(misses[..., self.millimetres : plain]).max(axis=-1, initial=0.0)
        if len(self.names) > plain:
            chord = np.linalg.norm(misses[..., plain:], axis=-1)
            turned = np.maximum(turned, 2.0 * np.arcsin(np.clip(0.5 * chord, 0.0, 1.0)))
        return np.degrees(turned)


def axis_of(quaternions: Array) -> Array:
    """Return where the z axis of orientations (w, x, y, z), shape (..., 4), points, shape (..., 3)."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=-1)


def targets_of(robot: RobotSpec, table: Table, length_m: float) -> Targets:
    """Return what the columns of `table` ask of `robot`; an empty cell asks nothing.

    `InputError` is raised for a column that is no target, a row that asks nothing, half a direction, or time
    that does not increase.
    """
    choices = [name for name in output_channels(robot) if name.endswith(("_mm", "_deg"))]
    for name in table.columns:
        if name not in choices and name not in DIRECTION:
            shown = [item for item in choices if item.startswith(("tip_", "angle_", "marker_"))]
            raise unknown("target", name, [*shown, *DIRECTION, "body_<k>_x_mm ..."], table.where)
    check_output_channels(robot, [name for name in table.columns if name not in DIRECTION], table.where)
    table.require_increasing_time()
    lengths = [name for name in table.columns if name.endswith("_mm")]
    angles = [name for name in table.columns if name.endswith("_deg")]
    direction = [name for name in DIRECTION if name in table.columns]
    if direction and len(direction) < len(DIRECTION):
        raise InputError(f"{table.where}: a direction has three columns: {', '.join(DIRECTION)}")
    names = (*lengths, *angles, *direction)
    if not names:
        raise InputError(f"{table.where}: no targets; choices: tip_x_mm, tip_y_mm, tip_z_mm and others")
    asked = np.stack([table.columns[name] for name in names], axis=1)
    empty = np.isnan(asked).all(axis=1)
    if empty.any():
        raise InputError(f"{table.row(int(np.argmax(empty)))}: no target")
    if direction:
        asked[:, -3:] = _unit_vectors(asked[:, -3:], table)
    return Targets(table.time_s, names, asked, len(lengths), len(angles), 1e3 * length_m)


def _unit_vectors(direction: Array, table: Table) -> Array:
    length = np.linalg.norm(direction, axis=1)
    whole = np.isnan(direction).sum(axis=1) % 3 == 0
    bad = ~whole | (length < _SHORTEST)
    if bad.any():
        raise InputError(
            f"{table.row(int(np.argmax(bad)))}: tip_direction: three numbers, not all 0, are needed"
        )
    return direction / length[:, np.newaxis]


# ----------------------------------------------------------------------------------------------------
# Where a robot's tip can be: tips by its twin under inputs drawn all over their ranges, each from rest.
#
# Draws are even in the inputs, so that tips crowd where the robot moves little; the cloud's edge is what
# matters. Where tendons pull, a robot has antagonists: half of the draws leave each of them slack as often
# as not.

_SLACK_SHARE = 0.5  # of tensions, in every second draw
_TOGETHER = 200  # draws that are solved at once
_TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")


@dataclass(frozen=True)
class ReachedPoints:
    """Reachable tips."""

    inputs: Inputs  # under which, a row each
    tip_mm: Array  # shape (n, 3) [mm]
    direction: Array  # of the tip's axis there, shape (n, 3)
    rejected: int  # how many draws had no balance


def random_levels(drives: PlanDrives, count: int, rng: np.random.Generator) -> Array:
    """Return levels all over the drives' ranges, shape (count, d); of tensions many are slack."""
    levels = rng.uniform(drives.least, drives.most, (count, len(drives.names)))
    if quantity_of(drives.actuation) is Quantity.TENSION:
        levels[1::2] *= rng.random(levels[1::2].shape) >= _SLACK_SHARE
    return levels


def workspace(
    robot: RobotSpec,
    drives: PlanDrives,
    gravity_mps2: Array,
    samples: int,
    seed: int = 0,
    progress: bool = False,
) -> ReachedPoints:
    """Return where so many inputs drawn within the ranges of `drives` bring the tip, each from rest.

    Gravity is in the base frame, shape (3,) [m/s^2]. `InputError` is raised where no draw has a balance.
    """
    specified = replace(robot, actuation=drives.actuation)
    built_in(specified)
    twin = twin_for(specified, drives.actuation, (*_TIP, *QUATERNION), gravity_mps2)
    levels = random_levels(drives, samples, np.random.default_rng(seed))
    clock = np.zeros(1)
    parts = []
    blocks = range(0, samples, _TOGETHER)
    for first in counted(blocks, len(blocks), "workspace", f"block of {_TOGETHER} draws", progress):
        histories = [
            inputs_at(drives, level[np.newaxis], clock) for level in levels[first : first + _TOGETHER]
        ]
        parts.append(twin.of_histories(specified, histories)[:, 0])
    outputs = np.concatenate(parts)
    kept = np.isfinite(outputs).all(axis=1)
    if not kept.any():
        raise InputError(f"{robot.name}: none of {samples} draws of its inputs has a balance")
    rows = np.arange(float(kept.sum()))
    return ReachedPoints(
        inputs_at(drives, levels[kept], rows),
        outputs[kept, :3],
        axis_of(outputs[kept, 3:]),
        int((~kept).sum()),
    )


# ----------------------------------------------------------------------------------------------------
# Where a robot's inputs lead it: the twin asked about many next inputs that share a past.
#
# Dry friction makes a posture depend on the way. Of that way the twin is given the last `REMEMBERED` rows,
# from rest: a friction's memory fades as inputs go past where they turned before. What is forgotten by
# that, and what the twin leaves out besides, shows when the whole way is simulated (`inverse_kinematics`,
# corrections).

REMEMBERED = 8  # rows of the way that lead to a posture
_SAME = 1e-9  # share of the robot's length, or rad: postures that differ by less are one
_PAIRS = 6  # of random inputs by which it is found out whether the way counts


class Forward:
    """A robot's answers to inputs, in the targets' columns.

    Attributes:
        drives: what is asked of the robot.
        targets: what is seen of it.
        remembers: whether a posture depends on the inputs before.
    """

    def __init__(self, robot: RobotSpec, drives: PlanDrives, targets: Targets, gravity_mps2: Array) -> None:
        """Prepare the twin of `robot`, as it is specified."""
        self.drives, self.targets = drives, targets
        self._robot = replace(robot, actuation=drives.actuation)
        check_effects(self._robot)
        self._twin: Prediction = twin_for(self._robot, drives.actuation, targets.observed, gravity_mps2)
        self.remembers = self._way_counts()

    def next_values(self, past: Array, candidates: Array, times: Array) -> Array:
        """Return the targets' columns under each candidate for the next row, shape (B, m); NaN: no balance.

        `past` holds the levels of the rows before, shape (h, d), `candidates` levels, shape (B, d), and
        `times` those of the rows before and of the next one, shape (h + 1,) [s].
        """
        kept = min(len(past), REMEMBERED) if self.remembers else 0
        way = past[len(past) - kept :]
        clock = times[len(times) - kept - 1 :]
        return self._at_the_end([np.vstack([way, level]) for level in candidates], clock)

    def _at_the_end(self, ways: Sequence[Array], times: Array) -> Array:
        """Return the targets' columns at the end of ways of levels, shape (h, d) each, (B, m)."""
        histories = [inputs_at(self.drives, levels, times - times[0]) for levels in ways]
        return self.targets.values_of(self._twin.of_histories(self._robot, histories)[:, -1])

    def _way_counts(self) -> bool:
        """Try whether larger inputs before, and any, change what is seen; asked of a few random pairs."""
        rng = np.random.default_rng(0)
        least, most = self.drives.least, self.drives.most
        before, after = (rng.uniform(least, most, (_PAIRS, len(least))) for _ in range(2))
        before[::2] = np.clip(1.3 * after[::2] + 0.2 * np.sign(after[::2]), least, most)
        clock = np.array([0.0, 1.0])
        way = self._at_the_end([np.stack(pair) for pair in zip(before, after, strict=True)], clock)
        alone = self._at_the_end([level[np.newaxis] for level in after], clock[:1])
        apart = self.targets.misses(way, alone)
        return not bool(np.nanmax(np.abs(apart), initial=0.0) < _SAME)


# ----------------------------------------------------------------------------------------------------
# The rows of one file of targets, searched for on a robot's twin, one after another.
#
# Each row is solved after the rows before it: a robot that rubs gets the inputs that lead to the target
# from where it stands. With inputs to spare, a row that is out of reach from there lets the one before be
# reached in another way.

# What is missed by more than the tolerance and less than so many times it is looked for in other ways. Rows
# that are out of reach mostly stand together: after so many in which nothing is found no more is looked for.
NEARLY, FRUITLESS = 50.0, 3
# Postures from rest among which searches start; fewer where each takes long.
_CLOUD, _CLOUD_RUBBING = 1024, 256
_STARTS, _ELSEWHERE = 16, 12  # near the target, and anywhere; the best of them are searched from
_SEARCHES, _SEARCHES_TO_SPARE = 10, 24  # at most, until one reaches the target; the second one as below
_APART = 0.3  # of some input's range: searches from starts that are nearer to one another end alike
# Share of the tolerance at which a search ends; the second one of robots that rub and have inputs to spare:
# without these, what rows before leave of their error may put a target out of reach.
_ENOUGH, _ENOUGH_TO_SPARE = 0.02, 0.1
# Times that: with inputs to spare no other search is begun; simulation corrects the rest.
_NEAR_TO_SPARE = 5.0


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


class Rows:
    """The rows of one file of targets.

    Attributes:
        targets: the file's.
        drives: what may be asked of the inputs.
        clock: when each row is held, shape (r,) [s]: a second from rest to the first.
        within: by how much a target may be missed that is reached.
        tolerance: the largest length of misses with which it is.
        remembers: whether a posture depends on the rows before.
        spare: whether it does, and the robot has more inputs than are needed.
    """

    def __init__(
        self, robot: RobotSpec, targets: Targets, drives: PlanDrives, gravity_mps2: Array, within: Tolerance
    ) -> None:
        self.targets, self.drives = targets, drives
        self.within, self.tolerance = within, within.of_misses(targets)
        self.clock = targets.time_s - targets.time_s[0] + 1.0
        self._forward = Forward(robot, drives, targets, gravity_mps2)
        self.remembers = self._forward.remembers
        self.spare = self.remembers and len(drives.names) > len(targets.names)
        count = _CLOUD_RUBBING if self.remembers else _CLOUD
        self._cloud = random_levels(drives, count, np.random.default_rng(0))  # the same every time
        self._cloud[0] = 0.0
        self._cloud_seen = self._forward.next_values(
            np.zeros((0, len(drives.names))), self._cloud, np.zeros(1)
        )
        if not np.isfinite(self._cloud_seen).all(axis=1).any():
            raise InputError(
                f"{robot.name}: its fast model finds no posture that balances within the limits of its inputs"
            )
        self._enough = (_ENOUGH_TO_SPARE if self.spare else _ENOUGH) * self.tolerance
        self._near = (_NEAR_TO_SPARE if self.spare else 1.0) * self._enough

    def find(self, offset: Array, known: list[BoundedFit] | None, progress: bool) -> list[BoundedFit]:
        """Return what is found for each row, asked for with an offset on top, shape (r, m).

        What is `known` of the rows was found with a smaller or no offset; None: nothing is.
        """
        asked = self.targets.asked + offset
        found: list[BoundedFit] = []
        name, fruitless = "inverse kinematics" if known is None else "correcting", 0
        for row in counted(range(len(asked)), len(asked), name, "target", progress):
            before = None if known is None else known[row]
            if before is not None:
                misses = self._misses(asked, found, row)
                if np.isfinite(misses(before.point[np.newaxis])).all():
                    found.append(self._search(asked, found, row, before.point, before.slopes))
                    continue
            found.append(self._best(asked, found, row))
            nearly = self.spare and 1.0 < found[-1].size / self.tolerance < NEARLY
            if row and nearly and not self.too_far(row) and fruitless < FRUITLESS:
                pair = self._by_another_way(asked, found, row)
                found[-2:], fruitless = pair or found[-2:], 0 if pair else fruitless + 1
        return found

    def others(
        self, found: Sequence[BoundedFit], row: int, asked: Array | None = None
    ) -> Iterator[BoundedFit]:
        """Yield inputs by which the twin reaches what a row is asked after those of the rows before."""
        asked = self.targets.asked if asked is None else asked
        return (item for item in self._searches(asked, found, row) if item.size <= self._near)

    def too_far(self, row: int) -> bool:
        """Return whether a tip is asked for beyond the robot's length: one search finds the nearest."""
        place = dict(zip(self.targets.names, self.targets.asked[row], strict=True))
        tip = np.array([place.get(f"tip_{axis}_mm", 0.0) for axis in "xyz"])
        within_mm = self.tolerance * self.targets.length_mm
        return bool(np.linalg.norm(np.nan_to_num(tip)) > self.targets.length_mm + within_mm)

    def reached(self, found: Sequence[BoundedFit]) -> Array:
        """Return the targets' columns by the twin, shape (r, m)."""
        levels, clock, values = _levels(found), self.clock, self._forward.next_values
        rows = range(len(levels))
        return np.concatenate([values(levels[:k], levels[k : k + 1], clock[: k + 1]) for k in rows])

    def inputs(self, found: Sequence[BoundedFit]) -> Inputs:
        """Return the rows' inputs."""
        return inputs_at(self.drives, _levels(found), self.targets.time_s - self.targets.time_s[0])

    def _misses(self, asked: Array, found: Sequence[BoundedFit], row: int) -> Function:
        past = _levels(found[:row]).reshape(-1, len(self.drives.names))
        times = self.clock[: row + 1]
        return lambda levels: self.targets.misses(self._forward.next_values(past, levels, times), asked[row])

    def _search(
        self, asked: Array, found: Sequence[BoundedFit], row: int, start: Array, slopes: Array | None = None
    ) -> BoundedFit:
        misses = self._misses(asked, found, row)
        return least_squares(misses, start, self.drives.least, self.drives.most, self._enough, slopes)

    def _best(self, asked: Array, found: Sequence[BoundedFit], row: int) -> BoundedFit:
        """Return the nearest that searches come from anywhere to a row's target."""
        best: BoundedFit | None = None
        for item in self._searches(asked, found, row):
            if best is None or item.size < best.size:
                best = item
            if best.size <= self._near:
                return best
        if best is None:
            raise InputError(
                f"row {row + 1}: the fast model has no balance near any posture from which to search"
            )
        misses = self._misses(asked, found, row)
        fresh = differences(misses, best.point, best.misses, self.drives.least, self.drives.most)
        return replace(best, slopes=fresh)

    def _searches(self, asked: Array, found: Sequence[BoundedFit], row: int) -> Iterator[BoundedFit]:
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

    def _by_another_way(self, asked: Array, found: Sequence[BoundedFit], row: int) -> list[BoundedFit] | None:
        """Return the inputs of the row before and of a row, such that both are reached; None: not found.

        After each other way to the row before searches go on from where the row was nearest; then, where none
        of them ends at it, from inputs at rest: what was pulled may have to be let go.
        """
        at_rest = np.clip(0.0, self.drives.least, self.drives.most)
        tried: list[BoundedFit] = []
        for before in self.others(found, row - 1, asked):
            item = self._search(asked, [*found[: row - 1], before], row, found[row].point)
            if item.size <= self._near:
                return [before, item]
            tried.append(before)
        for before in tried:
            item = self._search(asked, [*found[: row - 1], before], row, at_rest)
            if item.size <= self._near:
                return [before, item]
        return None

    def _starts(self, asked: Array, found: Sequence[BoundedFit]) -> Array:
        """Return levels to search from, shape (s, d): postures near the target, and the one before."""
        size = np.linalg.norm(self.targets.misses(self._cloud_seen, asked), axis=1)
        order = np.argsort(np.where(np.isfinite(size), size, np.inf))
        before = found[-1].point if found else np.zeros(len(self.drives.names))
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


def _levels(found: Sequence[BoundedFit]) -> Array:
    return np.array([item.point for item in found])


# ----------------------------------------------------------------------------------------------------
# A file's rows in the simulation itself, which shares nothing with the twin that found them.
#
# A twin that keeps tensions by their own history may stick where the robot slides. A row that the
# simulation misses by little is therefore searched for in the simulation: from what was found, and where
# that leads nowhere and the robot has inputs to spare, from other inputs by which the twin reaches the
# target.

GOOD = 0.3  # share of the tolerance below which the simulation's miss is left alone
_STEPS = 8  # of a search in the simulation
_OTHERS = 3  # ways of the twin, those that the simulation misses by least, from which it is searched


class InSimulation:
    """The rows of a file, simulated."""

    def __init__(self, rows: Rows, robot: RobotSpec, gravity_mps2: Array) -> None:
        self.rows, self._robot, self._gravity_mps2 = rows, robot, gravity_mps2

    def reached(self, found: Sequence[BoundedFit], progress: bool = False) -> Array:
        """Return the targets' columns by the simulation, shape (r, m), where it does not diverge."""
        run = simulate(self._robot, self.rows.inputs(found), self._gravity_mps2, progress=progress)
        if run.failure is not None:
            raise SimulationDiverged(run.failure)
        return self._columns(run.postures)

    def row(self, found: Sequence[BoundedFit], row: int) -> BoundedFit | None:
        """Return inputs that reach a row's target after those of the rows before; None: none were found.

        Of the rows before, those are simulated that a twin is given.
        """
        other = self._search(found, row, found[row].point)
        if other is not None or not self.rows.spare:
            return other
        points = _levels(list(self.rows.others(found, row)))
        if not len(points):
            return None
        size = np.linalg.norm(self._misses(found, row, points), axis=1)
        for index in np.argsort(np.where(np.isfinite(size), size, np.inf))[:_OTHERS]:
            other = self._search(found, row, points[index])
            if other is not None:
                return other
        return None

    def _search(self, found: Sequence[BoundedFit], row: int, start: Array) -> BoundedFit | None:
        def misses(levels: Array) -> Array:
            return self._misses(found, row, levels)

        if not np.isfinite(misses(start[np.newaxis])).all():
            return None
        drives, tolerance = self.rows.drives, self.rows.tolerance
        other = least_squares(misses, start, drives.least, drives.most, GOOD * tolerance, steps=_STEPS)
        return other if other.size <= tolerance else None

    def _misses(self, found: Sequence[BoundedFit], row: int, levels: Array) -> Array:
        way = found[max(row - REMEMBERED, 0) if self.rows.remembers else row : row]
        seen = [self._last(way, row, level) for level in levels]
        return self.rows.targets.misses(np.array(seen), self.rows.targets.asked[row])

    def _last(self, way: Sequence[BoundedFit], row: int, level: Array) -> Array:
        """Return the targets' columns of one row by the simulation, after a way from rest; NaN: diverged."""
        levels = np.array([*(item.point for item in way), level])
        clock = self.rows.clock[row - len(way) : row + 1]
        inputs = inputs_at(self.rows.drives, levels, clock - clock[0])
        run = simulate(self._robot, inputs, self._gravity_mps2)
        if run.failure is not None:
            return np.full(len(self.rows.targets.names), np.nan)
        return self._columns(run.postures[-1:])[0]

    def _columns(self, postures: Sequence[Posture]) -> Array:
        targets = self.rows.targets
        columns = posture_columns(self._robot, postures, targets.observed)
        return targets.values_of(np.stack([columns[name] for name in targets.observed], axis=1))


# ----------------------------------------------------------------------------------------------------
# Inverse kinematics of any robot: inputs that bring it to each target in turn, or as near as they can.
#
# The rows are found on the robot's twin (`Rows`). Then the whole file is simulated, and what the simulation
# misses is asked for on top, as often as it takes or is allowed; rows that it still misses by little are
# searched for in the simulation itself (`InSimulation`).

TOLERANCE_SHARE = 1e-3  # of the robot's length: a target that is missed by less is reached
TOLERANCE_DEG = 0.2  # the same of angles and of the direction
CORRECTIONS = 3  # by simulation, at most
WORKSPACE = "workspace"  # no input's limit binds, and still the robot comes no nearer


@dataclass(frozen=True)
class InputPlan:
    """Inputs for targets."""

    targets: Targets  # what was asked
    inputs: Inputs  # a row for each target
    reached: Array  # the targets' columns by the twin, shape (r, m)
    simulated: Array | None  # the same by the simulation, shape (r, m); None: not simulated
    error_mm: Array  # what is missed of each row's target, by the simulation where there is one, (r,)
    error_deg: Array
    reachable: np.ndarray  # whether that is within the tolerance, shape (r,)
    limits: tuple[str, ...]  # of a row that is not reachable, the limits that hold it back, else empty
    corrections: int  # how often the simulation's misses were corrected


def inverse_kinematics(
    robot: RobotSpec,
    targets: Targets,
    drives: PlanDrives,
    gravity_mps2: Array,
    corrections: int | None = CORRECTIONS,
    tolerance: Tolerance | None = None,
    progress: bool = False,
) -> InputPlan:
    """Return inputs that bring `robot` to one target after another, each row held until rest.

    Gravity is in the base frame, shape (3,) [m/s^2]. At most so many `corrections` by simulation are made;
    None: nothing is simulated. The default tolerance is `TOLERANCE_SHARE`, `TOLERANCE_DEG`.

    Raises:
        InputError: the robot cannot be driven or built, or stands nowhere that the twin knows.
        SimulationDiverged: the simulation left the finite numbers under the inputs found.
    """
    within = tolerance or Tolerance(TOLERANCE_SHARE * targets.length_mm, TOLERANCE_DEG)
    rows = Rows(robot, targets, drives, gravity_mps2, within)
    found = rows.find(np.zeros_like(targets.asked), None, progress)
    if corrections is None:
        return _plan(rows, found, None, 0)
    simulation = InSimulation(rows, robot, gravity_mps2)
    found, plan = _corrected(simulation, found, corrections, progress)
    return _searched_by_simulation(simulation, found, plan, progress) if corrections else plan


def _corrected(
    simulation: InSimulation, found: list[BoundedFit], corrections: int, progress: bool
) -> tuple[list[BoundedFit], InputPlan]:
    """Return what is found, and its plan, where the simulation's misses are asked for on top."""
    rows, targets = simulation.rows, simulation.rows.targets
    offset = np.zeros_like(targets.asked)
    tried: list[tuple[list[BoundedFit], InputPlan]] = []
    for count in range(corrections + 1):
        simulated = simulation.reached(found, progress)
        tried.append((found, _plan(rows, found, simulated, count)))
        close = _inside(rows, simulated, targets.asked)
        done = close | ~_inside(rows, tried[-1][1].reached, targets.asked + offset)
        if done.all() or count == corrections:
            break
        missed = np.where(np.isfinite(targets.asked), targets.asked - simulated, 0.0)
        offset = offset + np.where(done[:, np.newaxis], 0.0, missed)
        found = rows.find(offset, found, progress)
    return min(tried, key=lambda item: _score(item[1]))


def _searched_by_simulation(
    simulation: InSimulation, found: list[BoundedFit], plan: InputPlan, progress: bool
) -> InputPlan:
    """Return the best plan where one row after another that is missed by little is searched for anew.

    Rows after one that is found may be missed by that: they are searched for in their turn.
    """
    rows, best, fruitless = simulation.rows, plan, 0
    for row in counted(range(len(found)), len(found), "searching by simulation", "target", progress):
        error = max(plan.error_mm[row] / rows.within.mm, plan.error_deg[row] / rows.within.deg)
        if plan.reachable[row] or error > NEARLY or rows.too_far(row) or fruitless == FRUITLESS:
            continue
        other = simulation.row(found, row)
        if other is None:
            fruitless += 1
            continue
        changed = [*found[:row], other, *found[row + 1 :]]
        again = _plan(rows, changed, simulation.reached(changed), plan.corrections)
        if not again.reachable[row]:
            fruitless += 1
            continue
        found, plan, fruitless = changed, again, 0
        best = min(best, plan, key=_score)
    return best


def _inside(rows: Rows, seen: Array, asked: Array) -> np.ndarray:
    """Return which rows are missed by so little that nothing is corrected, shape (r,)."""
    targets, within = rows.targets, rows.within
    misses = targets.misses(seen, asked)
    near = targets.error_mm(misses) <= GOOD * within.mm
    return near & (targets.error_deg(misses) <= GOOD * within.deg)


def _plan(rows: Rows, found: Sequence[BoundedFit], simulated: Array | None, corrections: int) -> InputPlan:
    """Return what was found as a plan."""
    targets, drives, within = rows.targets, rows.drives, rows.within
    reached = rows.reached(found)
    misses = targets.misses(reached if simulated is None else simulated, targets.asked)
    error_mm, error_deg = targets.error_mm(misses), targets.error_deg(misses)
    reachable = (error_mm <= within.mm) & (error_deg <= within.deg)
    limits = []
    for item, can in zip(found, reachable, strict=True):
        held = [drives.limit(k, upper) for k, upper in binding(item, drives.least, drives.most)]
        limits.append("" if can else ";".join(held) or WORKSPACE)
    return InputPlan(
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


def _score(plan: InputPlan) -> tuple[int, float]:
    """Return a number that is the less, the better a plan is: rows that are reached, then what is missed."""
    return -int(plan.reachable.sum()), float(plan.error_mm.sum() + plan.error_deg.sum())
