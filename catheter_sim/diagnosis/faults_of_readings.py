"""Faults of single readings: clipped, filled in, copied, bumped, of another marker, or in metres."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.faults_of_columns import BesideModel
from catheter_sim.diagnosis.readings import Copy
from catheter_sim.diagnosis.result import DataFault
from catheter_sim.diagnosis.thresholds import BUMP_ROWS, BUMP_SAME_INPUTS, ROUNDING_SHARE, STANDS_SHARE
from catheter_sim.diagnosis.trials import Trial, all_inputs, measured_of, unit_of
from catheter_sim.robots import kind_of

HARDLY_MOVED_SHARE = 0.002
"""[robot lengths] If a robot moves nowhere by more, measured and computed, its data are taken to be in other
units. Why: assumed. Nobody records a robot of 100 mm that moves by 0.2 mm, and m for mm is far below."""
BUMP_NOISE = 8.0
"""[times the noise] A smaller jump is no bump. Why: assumed. None of a thousand rows of noise reaches it."""
BUMP_ALONE = 3.0
"""[times the next largest change of the error in that trial] A smaller jump is no bump. Why: a wrong model
jumps again where the inputs come back."""
BUMP_BEYOND_SHARE = 0.02
"""[share of an input's range] Inputs that go further than this beyond all earlier rows explain a jump. Why:
if something gives way there for good, it belongs to the robot."""
BUMP_ALIKE_SHARE = 0.35
"""[share of the bump] The shift of later rows may differ from the bump by at most this. Why: assumed.
Hysteresis changes the error of such pairs of rows."""
FILLED_SHARE = 0.5
"""[share of the rows] If this many of an output's rows lie on straight lines between others, they are taken
for filled in. Why: assumed. Half of the rows were then not measured."""
FILLED_KINKS = 8
"""[rows] The lines must bend at this many rows where no input bends. Why: a smooth motion without noise bends
where its inputs do."""
FILLED_SLOPES_SHARE = 0.25
"""[slopes per bend] With fewer, the sensor counts coarsely. Why: assumed. Each line between measured rows has
its own slope. Steps of a counter have few slopes."""
EXCHANGED_ROWS = 3
"""[rows] In this many, two points lie where the model has the other. Why: assumed. One row may be an
outlier."""
EXCHANGED_SHARE = 0.3
"""[share of their distance from their own places] They must then lie this near to the other's place. Why: as
for mistakes (`MISTAKE_CONVINCING`)."""
AWAY_STEPS = 2.5
"""[times the largest computed step nearby] A smaller leap is a motion. Why: a robot that lags may catch up by
twice the step that the model makes."""
AWAY_STEPS_NEAR = 10
"""[rows] "Nearby" reaches this far. Why: assumed. A lag of ten rows is a long one."""
AWAY_NOISE = 12.0
"""[times the noise] A leap must also exceed this. Why: outliers of trackers reach it, in single rows."""
AWAY_REACH_SHARE = 0.5
"""[share of a point's whole motion] A leap must also exceed this. Why: a tendon that slips lets a robot leap
back by a part of its motion. A tracker that takes something else for its marker knows no such bound."""
AWAY_BACK_SHARE = 0.35
"""[share of the leap] A point that is back may be this far from where it was before. Why: as for bumps
(`BUMP_ALIKE_SHARE`)."""
AWAY_LONGEST_SHARE = 0.6
"""[share of a trial's rows] A point may stay away for this long. Why: what stays away longer is a bump, or
the rest is."""
AWAY_ROWS = 5
"""[rows] A point must be away for at least this many in all, in stretches of two or more. Why: assumed. A few
rows move no fit."""
CLIPPED_ROWS = 5
"""[rows] This many must stand at exactly an output's end. Why: assumed. A measured value comes twice by
rounding."""
CLIPPED_TIMES = 4.0
"""[times as often as any other value] The same for sensors that count coarsely. Why: their ends come about as
often as other values."""
CLIPPED_BEYOND_SHARE = 0.1
"""[share of the computed range] The model must move by more than this there. Why: a robot at rest also stands
at an end."""

# ----------------------------------------------------------------------------------------------------
# Outputs that end at a limit of their sensor.


def clipped_outputs(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return the outputs that stand at exactly their largest or smallest value while the model moves on."""
    measured, models = np.concatenate(seen.measured), np.concatenate(list(seen.models))
    faults = []
    for column in seen.moves:
        values, computed = measured[:, column], models[:, column]
        known = np.isfinite(values)
        if not known.any():
            continue
        counts = np.unique(values[known], return_counts=True)[1]
        usual = int(np.sort(counts)[-3:][0])  # how often a value comes again that is no end
        for end, word in ((np.nanmax(values), "largest"), (np.nanmin(values), "smallest")):
            rows = known & (values == end)
            beyond = float(np.ptp(computed[rows])) if rows.any() else 0.0
            if rows.sum() < max(CLIPPED_ROWS, CLIPPED_TIMES * usual):
                continue
            if beyond > CLIPPED_BEYOND_SHARE * float(np.ptp(computed)):
                faults.append(
                    DataFault(
                        f"{int(rows.sum())} rows have exactly its {word} value, {end:g}, while the model "
                        f"moves by {beyond:.2g}. Does its sensor end there? Leave these cells empty.",
                        seen.columns[column],
                    )
                )
    return tuple(faults)


# ----------------------------------------------------------------------------------------------------
# Training rows that stand among the held-out ones once more.


def copied_rows(trials: Sequence[Trial], copies: Sequence[Copy]) -> tuple[DataFault, ...]:
    """Return what to say of rows that train and are held out: a fit would be tested on what it had seen."""
    faults = []
    for copy in copies:
        first, second = trials[copy.first], trials[copy.second]
        one = "trains" if first.role == "train" else "is held out" if first.role else "has no role"
        faults.append(
            DataFault(
                f"Its readings are those of {first.file}, which {one}, to the last digit. It is a copy, not "
                "a repeated measurement. Leave one of them out.",
                second.file,
                copy.rows,
            )
        )
    return tuple(faults)


# ----------------------------------------------------------------------------------------------------
# Outputs that were not measured in every row, but filled in between rows that were.


def interpolated_outputs(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return whether most rows lie on straight lines between few others, where nothing of the inputs turns.

    Measured values have noise in every row. What lies between them then moves at its own speed, whatever the
    robot did meanwhile, and a lag or a play is read into it.
    """
    if not seen.moves:
        return ()
    shares = [_filled_share(seen, column) for column in seen.moves]
    if float(np.median(shares)) < FILLED_SHARE:
        return ()
    return (
        DataFault(
            f"{100.0 * float(np.median(shares)):.0f} % of the rows lie on straight lines between the others. "
            "Were they filled in? Leave cells empty where nothing was measured.",
            ", ".join(seen.columns[column] for column in seen.moves),
        ),
    )


def _filled_share(seen: BesideModel, column: int) -> float:
    """Return the share of the rows that lie on straight lines, 0 where the inputs make these lines."""
    spread = max(float(np.nanstd(np.concatenate(seen.measured)[:, column])), 1e-12)
    straight = bends = rows = 0
    slopes: list[float] = []
    for measured, drive in zip(seen.measured, seen.drives, strict=True):
        step = np.diff(measured[:, column])
        bend = np.abs(np.diff(step))
        known = np.isfinite(bend)
        on_line = known & (bend < ROUNDING_SHARE * spread) & (np.abs(step[1:]) > ROUNDING_SHARE * spread)
        even = (np.abs(np.diff(drive, 2, axis=0)) <= STANDS_SHARE).all(axis=1)
        straight, rows = straight + int(on_line.sum()), rows + int(known.sum())
        bends += int((known & ~on_line & even).sum())
        slopes += step[1:][on_line].tolist()
    if not rows or bends < FILLED_KINKS:
        return 0.0
    kinds = len(_distinct(np.array(slopes), ROUNDING_SHARE * spread))
    # A sensor that counts coarsely has few slopes, each many times.
    return straight / rows if kinds >= FILLED_SLOPES_SHARE * bends else 0.0


def _distinct(values: Array, apart: float) -> Array:
    """Return values that differ from one another by more than rounding."""
    ordered = np.sort(values)
    return ordered[np.concatenate([[True], np.diff(ordered) > 4.0 * apart])] if len(ordered) else ordered


# ----------------------------------------------------------------------------------------------------
# Robots that hardly move at all: everything in metres where millimetres are meant.


def hardly_moved(
    robot: RobotSpec, trials: Sequence[Trial], columns: Sequence[str], models: Sequence[Array]
) -> tuple[DataFault, ...]:
    """Return that no position moves by more than next to nothing, neither as measured nor as computed.

    Inputs and outputs that are both 1000 times too small agree with one another. `models`: what the
    calibrated model computes, by trial, shape (r, o).
    """
    length_mm = 1e3 * kind_of(robot).model.length_m(robot)
    places = [index for index, name in enumerate(columns) if name.endswith("_mm")]
    if not places:
        return ()
    measured = _widest([measured_of(trial, columns)[:, places] for trial in trials])
    computed = _widest([values[:, places] for values in models])
    if max(measured, computed) > HARDLY_MOVED_SHARE * length_mm:
        return ()
    return (
        DataFault(
            f"The robot hardly moves: by {measured:.2g} mm as measured and by {computed:.2g} mm as computed, "
            f"of its {length_mm:.4g} mm. Are inputs and outputs in another unit, such as m for mm?"
        ),
    )


def _widest(parts: Sequence[Array]) -> float:
    """Return the largest range of a column within a part, 0 of columns without a value."""
    widest = 0.0
    for values in parts:
        for column in values.T:
            known = column[np.isfinite(column)]
            widest = max(widest, float(np.ptp(known)) if len(known) else 0.0)
    return widest


# ----------------------------------------------------------------------------------------------------
# A tracker that was bumped in the middle of a trial.


def bumped_trackers(
    trials: Sequence[Trial], columns: Sequence[str], models: Sequence[Array], noise: Mapping[str, float]
) -> tuple[DataFault, ...]:
    """Return where every position jumps from one row to the next and stays off: the tracker was moved.

    The error of a wrong model changes with the inputs and comes back with them. So a jump of the error is a
    bump under two conditions. No other jump of the trial is like it (`BUMP_ALONE`), Rows after it are off
    by that jump beside rows before it that have nearly the same inputs and move the same way. No bump is
    seen where the inputs go beyond all earlier ones: there something of the robot may have given way for
    good. `models`: what the calibrated model says, shape (r, o) each; `noise`: of each unit.
    """
    places = [index for index, name in enumerate(columns) if unit_of(name) == "mm"]
    found = []
    for trial, model in zip(trials, models, strict=True) if places else ():
        error = (measured_of(trial, columns) - model)[:, places]
        known = np.flatnonzero(np.isfinite(error).all(axis=1))
        row = _bump(error[known], all_inputs(trial.inputs), known, max(noise.get("mm", 0.0), 1e-9))
        if row is not None:
            found.append(
                DataFault(
                    "All positions jump here and stay off by as much, and the inputs do not explain it. Was "
                    f"the tracker, or the robot's base, moved (before row {row + 1})?",
                    trial.file,
                    (row + 1, len(model)),
                )
            )
    return tuple(found)


def _bump(error: Array, drive: Array, known: np.ndarray, noise: float) -> int | None:
    """Return the first row after a bump, None where there is none.

    `error`: of the rows without missing values, whose indices are `known` (k,), shape (k, o) [mm]; `drive`:
    all rows' inputs, shape (r, i); `noise` [mm].
    """
    if len(known) < 4 * BUMP_ROWS:
        return None
    steps = np.diff(error, axis=0)
    sizes = np.sqrt((steps**2).mean(axis=1))
    order = np.argsort(sizes)[::-1]
    at = int(order[0])  # the bump lies between the known rows `at` and `at + 1`
    if not BUMP_ROWS <= at < len(known) - BUMP_ROWS:
        return None
    if sizes[at] < BUMP_NOISE * noise or sizes[at] < BUMP_ALONE * sizes[order[1]]:
        return None
    scaled = drive / np.maximum(np.ptp(drive, axis=0), 1e-300)
    row = known[at + 1]
    if (scaled[row] > scaled[:row].max(axis=0) + BUMP_BEYOND_SHARE).any():
        return None
    moving = np.gradient(scaled, axis=0)[known]
    places = scaled[known]
    differences = []
    for after in range(at + 1, len(known)):
        same_way = (moving[: at + 1] * moving[after]).sum(axis=1) >= 0.0
        distance = np.where(same_way, np.abs(places[: at + 1] - places[after]).max(axis=1), np.inf)
        near = int(np.argmin(distance))
        if distance[near] < BUMP_SAME_INPUTS:
            differences.append(error[after] - error[near])
    if len(differences) < BUMP_ROWS:
        return None
    middle = np.median(differences, axis=0)
    apart = np.median(np.sqrt(((np.array(differences) - middle) ** 2).mean(axis=1)))
    size = float(np.sqrt((middle**2).mean()))
    off = float(np.sqrt(((steps[at] - middle) ** 2).mean()))
    return int(row) if off < BUMP_ALIKE_SHARE * size and apart < BUMP_ALIKE_SHARE * size else None


# ----------------------------------------------------------------------------------------------------
# A tracker that takes something else for its marker, over some rows at a time.


@dataclass(frozen=True)
class Excursion:
    """Rows over which a point is measured far from where it was, and comes back.

    `trial` and `point` are indices; `start` is the first row away, `end` the first row back.
    """

    trial: int
    point: int
    start: int
    end: int

    def __len__(self) -> int:
        return self.end - self.start


def jumps_elsewhere(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return where a point leaps away from one row to the next, and back some rows later.

    No robot does that: the leap is larger than any motion that the model expects of it thereabouts, and a
    fair share of all its motion, as no slip is. Single rows are outliers, which every tracker has.
    """
    found = [
        item
        for trial in range(len(seen.trials))
        for point in range(len(seen.points))
        for item in _excursions(seen, trial, point)
    ]
    found = [item for item in found if len(item) > 1]
    if sum(len(item) for item in found) < AWAY_ROWS:
        return ()
    faults = []
    for number in dict.fromkeys(item.trial for item in found):
        mine = [item for item in found if item.trial == number]
        points = dict.fromkeys(seen.columns[seen.points[item.point][0]].rsplit("_", 2)[0] for item in mine)
        rows = len({row for item in mine for row in range(item.start, item.end)})
        spans = dict.fromkeys(f"{item.start + 1} to {item.end}" for item in mine)
        faults.append(
            DataFault(
                f"{', '.join(points)} leaps away and comes back ({rows} rows: {', '.join([*spans][:5])}"
                f"{', ...' if len(spans) > 5 else ''}). Did the tracker lose it, or follow something else? "
                "Leave these cells empty.",
                seen.trials[number].file,
                (min(item.start for item in mine) + 1, max(item.end for item in mine)),
            )
        )
    return tuple(faults)


def _excursions(seen: BesideModel, trial: int, point: int) -> list[Excursion]:
    columns = seen.points[point]
    error, model = seen.errors[trial][:, columns], seen.models[trial][:, columns]
    known = np.flatnonzero(np.isfinite(error).all(axis=1))
    if len(known) < AWAY_ROWS:
        return []
    error = error[known]
    steps = np.maximum(
        _nearby(_steps(model), np.max)[known], _nearby(_steps(error + model[known]), np.median)
    )
    places = np.concatenate([item[:, columns] for item in seen.models])
    reach = float(np.linalg.norm(np.nanmax(places, axis=0) - np.nanmin(places, axis=0)))
    most = np.maximum(AWAY_STEPS * steps + AWAY_NOISE * seen.noise_mm, AWAY_REACH_SHARE * reach)
    longest = max(AWAY_ROWS, round(AWAY_LONGEST_SHARE * len(known)))
    found, row = [], 1
    while row < len(known):
        size = float(np.linalg.norm(error[row] - error[row - 1]))
        end = _way_back(error, row, size, longest) if size > most[row] else None
        if end is not None:
            found.append(Excursion(trial, point, int(known[row]), int(known[end - 1]) + 1))
        row = end + 1 if end is not None else row + 1
    return found


def _way_back(error: Array, start: int, size: float, longest: int) -> int | None:
    """Return the first row at which the error is back where it was before `start`, None: it never is."""
    away = np.linalg.norm(error[start : start + longest + 1] - error[start - 1], axis=1)
    back = np.flatnonzero(away < AWAY_BACK_SHARE * size)
    if not len(back) or (away[: back[0]] < 0.5 * size).any():
        return None
    return start + int(back[0])


def _steps(points: Array) -> Array:
    """Return by how much a point has moved since the row before, shape (r,)."""
    return np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1)])


def _nearby(values: Array, of: Callable[..., Array]) -> Array:
    """Return a figure of the values within some rows of each row, shape (r,)."""
    padded = np.pad(values, AWAY_STEPS_NEAR, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * AWAY_STEPS_NEAR + 1)
    return np.asarray(of(windows, axis=1))


# ----------------------------------------------------------------------------------------------------
# Two markers that change their labels over some rows.


def exchanged_points(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return where two points of the robot lie near one another's computed places, and far from their own."""
    faults = []
    for number, (measured, model) in enumerate(zip(seen.measured, seen.models, strict=True)):
        for one, other in combinations(seen.points, 2):
            given = _apart(measured, model, one, one) + _apart(measured, model, other, other)
            put_right = _apart(measured, model, one, other) + _apart(measured, model, other, one)
            rows = (put_right < EXCHANGED_SHARE**2 * given) & (given > (AWAY_NOISE * seen.noise_mm) ** 2)
            index = np.flatnonzero(rows)
            if len(index) < EXCHANGED_ROWS:
                continue
            names = [seen.columns[point[0]].rsplit("_", 2)[0] for point in (one, other)]
            faults.append(
                DataFault(
                    f"{names[0]} and {names[1]} look exchanged in {len(index)} rows. Did the tracker confuse "
                    "two markers? Exchange them there, or leave these cells empty.",
                    seen.trials[number].file,
                    (int(index[0]) + 1, int(index[-1]) + 1),
                )
            )
    return tuple(faults)


def _apart(measured: np.ndarray, model: np.ndarray, one: list[int], other: list[int]) -> np.ndarray:
    """Return the squared distance of a measured point from a computed one, shape (r,) [mm^2]."""
    return np.asarray(((measured[:, one] - model[:, other]) ** 2).sum(axis=1))
