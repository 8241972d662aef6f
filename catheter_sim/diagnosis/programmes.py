"""Programmes of inputs that a bench can play: pulls, loops, holds, within its limits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import FORCE_CHANNELS, channel_inputs, input_channels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.result import NEXT_EXPERIMENT_FILE
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.robots import kind_of
from catheter_sim.tables import Table
from catheter_sim.units import si_factor

PROGRAMME_ROW_S = 2.0
"""[s] Time from row to row of proposed inputs. Why: it is slow enough to be quasi-static."""
PROGRAMME_STEPS = 8
"""[rows] Length of a ramp over the whole reach. Why: assumed. A loop's shape shows in them."""
STANDING_SHARE = 0.3
"""[share of its reach] A channel stands here while others move. Why: it is taut there, and far from its full
reach."""
HOLD_S = 240.0
"""[s] Length of a rest, out and at home. Why: drift goes on over minutes."""
HOLD_ROWS = 6
"""[rows] Such a rest has this many. Why: assumed. A course in time shows in them."""
PACES = (0.25, 4.0)
"""[times the time from row to row of what was measured] Inputs are proposed at these paces. Why: a lag's loop
changes its width with the speed. A factor of four each way shows that."""
MOVING_ROW_S = 0.02
"""[s] Time from row to row of inputs proposed for motion. Why: assumed. A servo takes commands at 50 Hz."""
LET_GO_S = 0.1
"""[s] To make a robot swing, a channel is pulled, or let go, in this time. Why: assumed. It is short beside
most swings, and within what a servo can do."""
SWING_S = 2.0
"""[s] The robot then swings for this time. Why: assumed. It holds several swings of a robot of some Hz."""
SLOW_LOOP_S = 4.0
"""[s] Length of a slow loop out and home, in motion. Why: assumed. It is slow beside a swing, so friction
shows alone."""
SWEEP_S = 6.0
"""[s] Length of a sweep of frequencies. Why: assumed. It holds some ten periods."""
SWEEP_HZ = (0.2, 3.0)
"""[Hz] First and last frequency of the sweep. Why: assumed. They go from quasi-static to beyond most robots'
first swing."""
FORCE_SHARE = 0.2
"""[share of the force that bends the robot by a radian] Size of a known force across the tip. Why: it bends
well beyond the noise and harms nothing."""
PULL_LEVELS = (0.35, 0.7, 1.0)
"""[share of the range] A staircase of holds rests at these levels. Why: assumed. They are low, middle and
end."""
SHORT_HOLD_S = 30.0
"""[s] Length of a rest in such a staircase. Why: assumed. It is shorter than a creep, longer than a lag."""
RANGE_SHARE = 0.95
"""[share of the range] Proposed inputs use this much. Why: stops and slack tendons are at an end."""

# ----------------------------------------------------------------------------------------------------
# Series of inputs that a robot may be made to play next: causes answer each of them differently.
#
# All series start and end at zero input and stay within the reach of what was played so far; only a force
# across the tip is new.


@dataclass(frozen=True)
class Programme:
    """Inputs to play.

    `words` follow "play the CSV, "; the table is in file units.
    """

    words: str
    table: Table


def programmes(robot: RobotSpec, trials: Sequence[Trial]) -> tuple[Programme, ...]:
    """Return what may be played next, simplest first."""
    found = [
        Programme("each channel alone through a full loop, a half loop and a reversal", loops(robot, trials)),
        Programme("all channels pulled together and let go, twice", _together(robot, trials)),
        Programme("each channel out, held for four minutes, home, and as long at rest", _held(robot, trials)),
        Programme(
            "each channel out and home, at four times and at a quarter of the pace so far, with holds",
            _paced(robot, trials),
        ),
    ]
    if len(_columns(robot, trials)) > 1:
        found.append(
            Programme(
                "the loops of each channel with the others at a third of their reach",
                _against(robot, trials),
            )
        )
    if kind_of(robot).twin.twin(robot, trials[0].inputs.actuation).carries_load:
        force_N = float(f"{FORCE_SHARE * kind_of(robot).handles.sizes(robot).tip_force_N:.1g}")
        found.append(
            Programme(
                f"each channel out and home with a known force of {force_N:g} N across the tip, each side",
                _loaded(robot, trials, force_N),
            )
        )
    return tuple(found)


def loops(robot: RobotSpec, trials: Sequence[Trial]) -> Table:
    """Return nested loops of each channel alone, then the first channel's again, in file units."""
    reach = _reach(robot, trials)
    shape = _path([0.0, 1.0, 0.0, 0.5, 0.25, 0.5, 0.0])
    parts = [np.outer(shape, _only(reach, index)) for index in (*range(len(reach)), 0)]
    return _table(robot, trials, np.concatenate(parts))


def _against(robot: RobotSpec, trials: Sequence[Trial]) -> Table:
    """Return each channel's loops from the height at which the others stand, up to its reach."""
    reach = _reach(robot, trials)
    standing = STANDING_SHARE * reach
    parts = [np.outer(_path([0.0, 1.0]), standing)]
    for index in range(len(reach)):
        moved = _only((1.0 - STANDING_SHARE) * reach, index)
        parts.append(standing + np.outer(_path([0.0, 1.0, 0.0, 0.5, 0.0]), moved))
    parts.append(np.outer(_path([1.0, 0.0]), standing))
    return _table(robot, trials, np.concatenate(parts))


def _together(robot: RobotSpec, trials: Sequence[Trial]) -> Table:
    shape = _path([0.0, 0.6, 0.0, 0.6, 0.0])
    return _table(robot, trials, np.outer(shape, _reach(robot, trials)))


def _held(robot: RobotSpec, trials: Sequence[Trial]) -> Table:
    """Return each channel's way out and home with a long rest after each; rows of a rest are far apart."""
    reach = _reach(robot, trials)
    parts, steps = [], []
    for index in range(len(reach)):
        for way in ([0.0, 0.7], [0.7, 0.0]):
            ramp = _path(way)
            parts.append(np.outer(np.append(ramp, np.full(HOLD_ROWS, way[1])), _only(reach, index)))
            steps += [PROGRAMME_ROW_S] * len(ramp) + [HOLD_S / HOLD_ROWS] * HOLD_ROWS
    return _table(robot, trials, np.concatenate(parts), np.array(steps))


def _paced(robot: RobotSpec, trials: Sequence[Trial]) -> Table:
    reach = _reach(robot, trials)
    usual = float(np.median(np.concatenate([np.diff(trial.inputs.time_s) for trial in trials])))
    way = _path([0.0, 0.5])
    shape = np.concatenate([way, [0.5] * 3, _path([0.5, 1.0]), _path([1.0, 0.5]), [0.5] * 3, way[::-1]])
    parts, steps = [], []
    for pace in PACES:
        for index in range(len(reach)):
            parts.append(np.outer(shape, _only(reach, index)))
            steps += [pace * usual] * len(shape)
    return _table(robot, trials, np.concatenate(parts), np.array(steps))


def _loaded(robot: RobotSpec, trials: Sequence[Trial], force_N: float) -> Table:
    reach = _reach(robot, trials)
    shape = _path([0.0, 1.0, 0.0])
    pushes = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0))
    parts, forces = [], []
    for push in pushes:
        for index in range(len(reach)):
            parts.append(np.outer(shape, _only(reach, index)))
            forces.append(np.tile(force_N * np.array(push), (len(shape), 1)))
    values = np.concatenate([*parts, np.zeros((1, len(reach)))])
    force = np.concatenate([*forces, np.zeros((1, 2))])
    extra = {"force_tip_x_N": force[:, 0], "force_tip_y_N": force[:, 1]}
    return _table(robot, trials, values, None, extra)


def _columns(robot: RobotSpec, trials: Sequence[Trial]) -> list[str]:
    return input_channels(robot, trials[0].inputs.actuation)


def _reach(robot: RobotSpec, trials: Sequence[Trial]) -> Array:
    """Return the largest pull of each channel so far, shape (c,), in file units."""
    most = np.max([channel_inputs(robot, trial.inputs).max(axis=0) for trial in trials], axis=0)
    unit = np.array([1.0 / si_factor(column) for column in _columns(robot, trials)])
    return np.asarray(np.maximum(most, 0.0) * unit)


def _only(reach: Array, index: int) -> Array:
    return np.where(np.arange(len(reach)) == index, reach, 0.0)


def _path(corners: Sequence[float]) -> Array:
    """Return the way along `corners` in rows of the same step, both ends included."""
    return np.concatenate([corners[:1], _way(corners)])


def _table(
    robot: RobotSpec,
    trials: Sequence[Trial],
    values: Array,
    steps_s: Array | None = None,
    extra: Mapping[str, Array] | None = None,
) -> Table:
    """Return channels' values, shape (r, c), as a table that starts and ends at zero.

    Values in file units; `steps_s`: time before each row, shape (r,); None: the same before all.
    """
    steps = np.full(len(values), PROGRAMME_ROW_S) if steps_s is None else steps_s
    time_s = np.round(np.cumsum(steps) - steps[0], 6)
    rounded = np.floor(values * 1e4) / 1e4
    columns = {name: rounded[:, index] for index, name in enumerate(_columns(robot, trials))}
    return Table(time_s, columns | dict(extra or {}), NEXT_EXPERIMENT_FILE)


# ----------------------------------------------------------------------------------------------------
# Series of inputs for a robot that is measured while it moves: short, as every simulated second costs time.
#
# All start and end at zero input and stay within the reach of what was played so far.


def moving_programmes(robot: RobotSpec, trials: Sequence[Trial]) -> tuple[Programme, ...]:
    """Return what may be played next, simplest first; arguments as of `programmes`."""
    return (
        Programme("each channel pulled at once, held, and let go at once", _let_go(robot, trials)),
        Programme("each channel out and home slowly, twice", _slow(robot, trials)),
        Programme("each channel through a sweep of rising frequency", _sweep(robot, trials)),
    )


def _let_go(robot: RobotSpec, trials: Sequence[Trial]) -> Table:
    rise, swing = _count(LET_GO_S), _count(SWING_S)
    way = np.concatenate([_line(0.0, 0.7, rise), np.full(swing, 0.7), _line(0.7, 0.0, rise), np.zeros(swing)])
    return _each(robot, trials, way)


def _slow(robot: RobotSpec, trials: Sequence[Trial]) -> Table:
    half = _count(0.5 * SLOW_LOOP_S)
    loops = [_line(a, b, half) for a, b in ((0.0, 1.0), (1.0, 0.2), (0.2, 0.6), (0.6, 0.0))]
    return _each(robot, trials, np.concatenate(loops))


def _sweep(robot: RobotSpec, trials: Sequence[Trial]) -> Table:
    time_s = MOVING_ROW_S * np.arange(1, _count(SWEEP_S) + 1)
    low, high = SWEEP_HZ
    phase = 2.0 * np.pi * (low * time_s + 0.5 * (high - low) * time_s**2 / SWEEP_S)
    way = 0.25 * (1.0 - np.cos(phase))
    return _each(robot, trials, np.concatenate([way, _line(float(way[-1]), 0.0, _count(LET_GO_S))]))


def _each(robot: RobotSpec, trials: Sequence[Trial], way: Array) -> Table:
    """Return a way, in shares of the reach, of each channel after the other."""
    reach = _reach(robot, trials)
    rows = np.concatenate(
        [[np.zeros(len(reach))], *(np.outer(way, _only(reach, k)) for k in range(len(reach)))]
    )
    return _table(robot, trials, rows, np.full(len(rows), MOVING_ROW_S))


def _count(seconds: float) -> int:
    return max(1, round(seconds / MOVING_ROW_S))


def _line(start: float, end: float, count: int) -> Array:
    """Return the rows after `start` up to `end`."""
    return np.linspace(start, end, count + 1)[1:]


# ----------------------------------------------------------------------------------------------------
# Series of inputs that a bench can play within its own limits, of which the best is to be found.
#
# Unlike `programmes`, which stay within the reach of what was played so far, these go as far as the bench
# does, to both sides. Loops, single pulls, holds at several levels and speeds, all channels at once, each
# channel with another one standing (the robot in another posture), and a known force on the tip, as of a
# mass that is hung there. All start and end at zero input.

Ranges = Mapping[str, tuple[float, float]]
_LOOP = (0.0, 1.0, 0.0, -1.0, 0.0, 0.5, 0.25, 0.5, 0.0)  # 1: the range's upper end, -1: its lower end
_PULL = (0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Bench:
    """What programmes are made for.

    Attributes:
        columns: input columns that can be driven, in the robot's order.
        least, most: of each, shape (c,), in the columns' units.
        forces: known forces on the tip that can be hung there: column, least and most [N].
        row_s: usual time from row to row [s].
        longest_s: of one programme [s].
    """

    columns: tuple[str, ...]
    least: Array
    most: Array
    forces: tuple[tuple[str, float, float], ...]
    row_s: float
    longest_s: float


def bench_of(columns: Sequence[str], ranges: Ranges, row_s: float, longest_s: float) -> Bench:
    """Return what programmes are made for; a column whose range is missing, or zero, is not driven."""
    driven = [name for name in columns if name in ranges and ranges[name][0] < ranges[name][1]]
    ends = np.array([ranges[name] for name in driven]).reshape(-1, 2) * RANGE_SHARE
    forces = tuple(
        (name, RANGE_SHARE * ranges[name][0], RANGE_SHARE * ranges[name][1])
        for name in FORCE_CHANNELS
        if name in ranges
    )
    return Bench(tuple(driven), ends[:, 0], ends[:, 1], forces, row_s, longest_s)


def programmes_within(bench: Bench) -> tuple[Programme, ...]:
    """Return what may be played, simplest first; none takes longer than the bench allows."""
    return tuple(
        item
        for item in _every_programme(bench)
        if float(item.table.time_s[-1] - item.table.time_s[0]) <= bench.longest_s
    )


def _every_programme(bench: Bench) -> Iterator[Programme]:
    every = range(len(bench.columns))
    for k in every:
        yield _of(bench, f"{_said(bench, k)} pulled out and home once", [_alone(bench, k, _PULL)])
    loops = "through full loops, a half loop and a reversal on the way"
    for k in every:
        yield _of(bench, f"{_said(bench, k)} {loops}", [_alone(bench, k, _LOOP)])
    if len(bench.columns) > 1:
        parts = [_alone(bench, k, _LOOP) for k in (*every, 0)]
        yield _of(bench, f"each channel alone {loops}, the first one twice", parts)
        together = "all channels pulled together and let go, with a reversal on the way"
        shares = _way((0.0, 0.6, 0.0, 0.6, 0.2, 0.4, 0.0, 0.3, 0.0))
        yield _of(bench, together, [np.outer(shares, bench.most)])
        for k in every:
            against = f"the loops of each other channel while {_said(bench, k)} stands at a third"
            yield _of(bench, against, _against_within(bench, k))
    for k in every:
        yield _staircase(bench, k)
    yield _paced_within(bench)
    yield _held_within(bench)
    for force in bench.forces:
        yield _loaded_within(bench, *force)


def _said(bench: Bench, index: int) -> str:
    return bench.columns[index].rsplit("_", 1)[0].replace("_", " ")


def _way(corners: Sequence[float]) -> Array:
    """Return the way along corners in rows of the same step, without the first corner."""
    return np.concatenate(
        [_line(a, b, max(2, round(PROGRAMME_STEPS * abs(b - a)))) for a, b in pairwise(corners)]
    )


def _alone(bench: Bench, index: int, corners: Sequence[float]) -> Array:
    """Return the rows of one channel's way, shape (r, c), corners in shares of its range's ends."""
    if bench.least[index] == 0.0:  # nothing lies on the other side: each corner once
        kept = [0.0, *(corner for corner in corners[1:] if corner >= 0.0)]
        corners = [corner for place, corner in enumerate(kept) if not place or corner != kept[place - 1]]
    way = _way(corners)
    rows = np.zeros((len(way), len(bench.columns)))
    rows[:, index] = np.where(way >= 0.0, way * bench.most[index], -way * bench.least[index])
    return rows


def _against_within(bench: Bench, standing: int) -> list[Array]:
    """Return the other channels' loops while one stands."""
    stand = np.zeros(len(bench.columns))
    stand[standing] = STANDING_SHARE * bench.most[standing]
    others = [k for k in range(len(bench.columns)) if k != standing]
    loops = [stand + _alone(bench, k, (0.0, 1.0, 0.0, -1.0, 0.0)) for k in others]
    return [np.outer(_way((0.0, 1.0)), stand), *loops, np.outer(_way((1.0, 0.0)), stand)]


def _staircase(bench: Bench, index: int) -> Programme:
    """Return holds of one channel at rising and falling levels, fast ways up and slow ways down."""
    corners = [0.0, *PULL_LEVELS, *PULL_LEVELS[-2::-1], 0.0]
    parts, steps = [np.zeros((1, len(bench.columns)))], [0.0]
    for start, end in pairwise(corners):
        way = np.linspace(start, end, 4)[1:, None] * bench.most * (np.arange(len(bench.columns)) == index)
        parts += [way, np.repeat(way[-1:], 2, axis=0)]
        steps += [bench.row_s * PACES[0 if end > start else 1]] * len(way) + [0.5 * SHORT_HOLD_S] * 2
    return _of(
        bench,
        f"{_said(bench, index)} held half a minute at several levels, up fast and down slowly",
        parts,
        np.array(steps),
    )


def _paced_within(bench: Bench) -> Programme:
    parts, steps = [], []
    for pace in PACES:
        for index in range(len(bench.columns)):
            rows = _alone(bench, index, (0.0, 1.0, 0.0))
            parts.append(rows)
            steps += [pace * bench.row_s] * len(rows)
    words = "each channel out and home at four times the usual pace and at a quarter of it"
    return _of(bench, words, parts, np.array(steps))


def _held_within(bench: Bench) -> Programme:
    parts, steps = [], []
    for index in range(len(bench.columns)):
        for way in ((0.0, 0.7), (0.7, 0.0)):
            rows = _alone(bench, index, way) if way[0] == 0.0 else _alone(bench, index, (0.0, *way))[-6:]
            parts += [rows, np.repeat(rows[-1:], HOLD_ROWS, axis=0)]
            steps += [bench.row_s] * len(rows) + [HOLD_S / HOLD_ROWS] * HOLD_ROWS
    return _of(
        bench, "each channel out, held for four minutes, home, and as long at rest", parts, np.array(steps)
    )


def _loaded_within(bench: Bench, column: str, least: float, most: float) -> Programme:
    """Return each channel out and home with nothing on the tip and with a known force, each way."""
    parts, forces = [], []
    for force in (0.0, *(end for end in (most, least) if end)):
        for index in range(len(bench.columns)):
            rows = _alone(bench, index, _PULL)
            parts.append(rows)
            forces.append(np.full(len(rows), force))
    values = np.concatenate([*forces, [0.0]])
    parts.append(np.zeros((1, len(bench.columns))))
    direction = column.removeprefix("force_tip_").removesuffix("_N")
    words = f"each channel out and home with a known force on the tip along {direction}, {most:g} N"
    words += f" and {least:g} N" if least else ", as of a mass that is hung there"
    return _of(bench, words, parts, None, {column: values})


def _of(
    bench: Bench,
    words: str,
    parts: Sequence[Array],
    steps_s: Array | None = None,
    further: Mapping[str, Array] | None = None,
) -> Programme:
    """Return rows, shape (r, c) in all, as a programme that begins with a row of zeros.

    `steps_s`: time before each row, shape (r,) [s]; None: the usual one.
    """
    rows = np.concatenate(parts)
    steps = np.full(len(rows), bench.row_s) if steps_s is None else steps_s
    if rows[0].any() or steps[0] != 0.0:
        rows = np.concatenate([np.zeros((1, rows.shape[1])), rows])
        steps = np.concatenate([[0.0], steps])
        further = {name: np.concatenate([[0.0], values]) for name, values in (further or {}).items()}
    columns = {name: np.round(rows[:, k], 4) for k, name in enumerate(bench.columns)}
    columns |= {name: np.asarray(values) for name, values in (further or {}).items()}
    return Programme(
        words, Table(np.asarray(np.round(np.cumsum(steps), 6), np.float64), columns, NEXT_EXPERIMENT_FILE)
    )
