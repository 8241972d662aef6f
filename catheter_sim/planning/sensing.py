"""Where a robot is, from what its actuators say, and how sure that is.

The posture is the twin's under the measured inputs, row after row. What could make it another one is
followed to first order. That is noise of every input at every row, through the rows that remember it, and
numbers of the robot that are known only within a range. Draws of all these causes give the regions, so
that an even range stays an even range. Further readings (a tension beside a displacement, an angle from a
tracker) narrow the draws. Each is moved by what its readings differ from the measured ones, times the
gain of linear regression (exact for noise as Gauss has it).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import channel_inputs, drives_of, output_channels, read_inputs, tendon_inputs
from catheter_sim.core.document import number, si_of, with_values
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import built_in
from catheter_sim.errors import InputError
from catheter_sim.robots import check_robot
from catheter_sim.tables import Table
from catheter_sim.theory.twins import Prediction, twin_for
from catheter_sim.units import si_factor

INSIDE = 0.95  # of the truth that regions hold
REMEMBERED = 6  # rows through which a row's noise is followed
_DRAWS = 4000
_CELLS = 8_000_000  # of draws at once
_MOST_TOGETHER = 3000  # rows times columns, where readings of outputs narrow them
_NOISE = "noise of the inputs"
_BEYOND = 5.0  # deviations of noise by which a reading may be beyond what an input can be
_SOME = 0.58  # of half a range, for slopes: its standard deviation


@dataclass(frozen=True)
class Noise:
    """Standard deviations of readings, white; by unit of their columns."""

    tension_N: float = 0.0  # of tensions
    displacement_mm: float = 0.0  # of inputs in mm
    position_mm: float = 0.0  # of measured outputs in mm
    angle_deg: float = 0.0  # of measured outputs in deg

    def of_input(self, column: str) -> float:
        """Return that of an input column, in its unit."""
        return self.tension_N if column.endswith("_N") else self.displacement_mm

    def of_output(self, column: str) -> float:
        """Return that of an output column, in its unit."""
        unit = column.rpartition("_")[2]
        return {"N": self.tension_N, "mm": self.position_mm, "deg": self.angle_deg}[unit]


@dataclass(frozen=True)
class UncertainCause:
    """A number, or several at once, that a robot's specification gives only within an even range."""

    name: str  # of the cause
    # The robot with the number away from what is specified, by -1 to 1 of half its range.
    change: Callable[[RobotSpec, float], RobotSpec]


@dataclass(frozen=True)
class Readings:
    """What was measured."""

    time_s: Array  # of the file, shape (r,) [s]
    inputs: Inputs  # as commanded or measured
    outputs: tuple[str, ...]  # names of measured outputs
    seen: Array  # their values, shape (r, k), in their units; NaN: not measured


@dataclass(frozen=True)
class Sensed:
    """Postures with their regions; columns in their own units."""

    time_s: Array  # shape (r,) [s]
    columns: tuple[str, ...]  # names
    value: Array  # the most likely, shape (r, o)
    low: Array  # ends of the regions that hold `INSIDE` of the truth, shape (r, o)
    high: Array
    # Standard deviation that each cause alone would make, by its name, shape (r, o).
    deviations: Mapping[str, Array]


def readings_of(robot: RobotSpec, table: Table, noise: Noise) -> Readings:
    """Return the readings in `table`: input columns, forces, and outputs in mm, deg or N.

    A reading that noise has taken beyond what its input can be is taken for that input's end. `InputError`: a
    column that is neither, or as `channels.read_inputs`.
    """
    drives = {drive.column: drive for drive in drives_of(robot)}
    outputs = [
        name
        for name in output_channels(robot)
        if name in table.columns and name not in drives and name.endswith(("_mm", "_deg", "_N"))
    ]
    columns = {name: values for name, values in table.columns.items() if name not in outputs}
    for name, drive in drives.items():
        if name in columns:
            unit, slack = si_factor(name), _BEYOND * noise.of_input(name)
            least, most = drive.least / unit, drive.most / unit
            near = (columns[name] > least - slack) & (columns[name] < most + slack)
            columns[name] = np.where(near, np.clip(columns[name], least, most), columns[name])
    inputs = read_inputs(robot, replace(table, columns=columns))
    seen = np.array([table.columns[name] for name in outputs]).T.reshape(len(inputs), len(outputs))
    return Readings(table.time_s, inputs, tuple(outputs), seen)


def within_factor(keys: Sequence[str], half: float) -> Callable[[RobotSpec, float], RobotSpec]:
    """Return a cause's `change`: numbers at dotted keys times one factor in 1 -+ `half`."""

    def change(robot: RobotSpec, share: float) -> RobotSpec:
        return with_values(robot, {key: number(robot, key) * (1.0 + half * share) for key in keys})

    return change


def within_half(key: str, half: float) -> Callable[[RobotSpec, float], RobotSpec]:
    """Return a cause's `change`: the number at a dotted key -+ `half`, in the key's unit."""

    def change(robot: RobotSpec, share: float) -> RobotSpec:
        return with_values(robot, {key: number(robot, key) + si_of(robot, key, half * share)})

    return change


def sense(
    robot: RobotSpec,
    readings: Readings,
    noise: Noise,
    causes: Sequence[UncertainCause],
    columns: Sequence[str],
    gravity_mps2: Array,
) -> Sensed:
    """Return the output columns at every row of readings, with their regions.

    Gravity is in the base frame, shape (3,) [m/s^2]. `InputError`: a row has no balance, or a measured output
    has no noise.
    """
    built_in(robot)
    wanted = (*columns, *(name for name in readings.outputs if name not in columns))
    twin = twin_for(robot, readings.inputs.actuation, wanted, gravity_mps2)
    value = twin.of_histories(robot, [readings.inputs])[0]
    if not np.isfinite(value).all():
        row = int(np.argmin(np.isfinite(value).all(axis=1)))
        raise InputError(
            f"row {row + 1} (time_s = {readings.inputs.time_s[row]:g}): the fast model has no balance"
        )
    slopes = {cause.name: _of_cause(twin, robot, readings.inputs, cause) for cause in causes}
    pushes = _pushes(twin, robot, readings.inputs, noise)
    rng = np.random.default_rng(0)
    shares = {name: rng.uniform(-1.0, 1.0, (_DRAWS, 1, 1)) for name in slopes}
    if readings.outputs and len(value) * len(wanted) > _MOST_TOGETHER:
        most = _MOST_TOGETHER // len(wanted)
        raise InputError(f"with measured outputs at most {most} rows of {len(wanted)} columns; thin them out")
    drives = len(drives_of(robot, readings.inputs.actuation))
    noises = _noise_by_rows(pushes, rng, len(value), drives, len(wanted))
    if readings.outputs:  # readings of a row tell of the causes in all: then all rows are drawn together
        noises = iter([(range(len(value)), np.concatenate([part for _, part in noises], axis=1))])
    parts = []
    for rows, moved in noises:
        draws = {name: shares[name] * slope[rows.start : rows.stop] for name, slope in slopes.items()}
        draws[_NOISE] = moved
        away = np.sum(list(draws.values()), axis=0)
        middle = np.zeros((len(rows), len(wanted)))
        if readings.outputs:
            at = [wanted.index(name) for name in readings.outputs]
            away = _narrowed(away, at, readings, value, noise, rng)
            middle = away.mean(axis=0)
        low, high = np.quantile(away, [0.5 - 0.5 * INSIDE, 0.5 + 0.5 * INSIDE], axis=0)
        own = {name: np.broadcast_to(part.std(axis=0), middle.shape) for name, part in draws.items()}
        parts.append((middle, low, high, own))
    middle, low, high = (np.concatenate([part[k] for part in parts])[:, : len(columns)] for k in range(3))
    deviations = {
        name: np.concatenate([part[3][name] for part in parts])[:, : len(columns)] for name in parts[0][3]
    }
    value = value[:, : len(columns)]
    return Sensed(readings.time_s, tuple(columns), value + middle, value + low, value + high, deviations)


def _of_cause(twin: Prediction, robot: RobotSpec, inputs: Inputs, cause: UncertainCause) -> Array:
    """Return how far half of a cause's range moves the outputs, shape (r, o)."""
    sides = [cause.change(robot, sign * _SOME) for sign in (1.0, -1.0)]
    for side in sides:
        check_robot(side, f"{robot.name}, {cause.name}")
    up, down = twin(sides, inputs)
    return _finite(0.5 * (up - down) / _SOME, cause.name)


@dataclass(frozen=True)
class _Push:
    """What noise of one input does: its rows from `first` on, each `apart` rows, were pushed at once."""

    drive: int  # place of the input among the columns
    first: int  # rows
    apart: int
    gain: Array  # change of the outputs in each row by the last push before it, shape (r, o) [per SI unit]
    deviation: float  # of the noise [SI]
    room: Array  # least and largest deviation that the input's range leaves in each row, shape (2, r) [SI]


def _pushes(twin: Prediction, robot: RobotSpec, inputs: Inputs, noise: Noise) -> list[_Push]:
    """Return how noise of the inputs moves the outputs.

    Rows that lie `REMEMBERED` apart are pushed at once: what a row does is over before the next one's turn.
    """
    drives, values = drives_of(robot, inputs.actuation), channel_inputs(robot, inputs)
    rows, apart = len(inputs), min(len(inputs), REMEMBERED)
    size = [noise.of_input(drive.column) * si_factor(drive.column) for drive in drives]
    pushed = [(k, first) for k in range(len(drives)) if size[k] > 0.0 for first in range(apart)]
    histories, widths = [], []
    for k, first in pushed:
        ways = []
        for sign in (1.0, -1.0):
            moved = values.copy()
            moved[first::apart, k] += sign * size[k]
            np.clip(moved[:, k], drives[k].least, drives[k].most, out=moved[:, k])
            ways.append(moved)
            tendon = tendon_inputs(robot, inputs.actuation, moved)
            histories.append(replace(inputs, tendon=tendon))
        widths.append((ways[0] - ways[1])[:, k])
    if not pushed:
        return []
    outputs = twin.of_histories(robot, histories)
    found = []
    for index, (k, first) in enumerate(pushed):
        change = _finite(outputs[2 * index] - outputs[2 * index + 1], _NOISE)
        source = np.arange(rows) - (np.arange(rows) - first) % apart
        width = widths[index][np.maximum(source, first)]
        gain = change / width[:, np.newaxis]
        room = np.stack([drives[k].least - values[:, k], drives[k].most - values[:, k]])
        found.append(_Push(k, first, apart, gain, size[k], room))
    return found


def _noise_by_rows(
    pushes: Sequence[_Push], rng: np.random.Generator, rows: int, drives: int, outputs: int
) -> Iterator[tuple[range, Array]]:
    """Yield some rows after the other, and how far draws of the inputs' noise move them, shape (n, r, o)."""
    size = max(1, _CELLS // (_DRAWS * max(drives, outputs)))
    before = np.zeros((_DRAWS, 0, drives))
    for first in range(0, rows, size):
        some = range(first, min(first + size, rows))
        drawn = np.concatenate([before, rng.standard_normal((_DRAWS, len(some), drives))], axis=1)
        yield some, _drawn_noise(pushes, drawn, some, outputs)
        before = drawn[:, -(REMEMBERED - 1) :].copy()


def _drawn_noise(pushes: Sequence[_Push], drawn: Array, rows: range, outputs: int) -> Array:
    """Return how far the inputs' noise moves the outputs of some rows, shape (n, r, o).

    It is `drawn` in deviations, of these rows and of those before that they remember, shape (n, k, d).
    """
    earliest = rows.stop - drawn.shape[1]
    total = np.zeros((len(drawn), len(rows), outputs))
    for push in pushes:
        for place, row in enumerate(rows):
            source = row - (row - push.first) % push.apart
            if source >= 0:
                away = np.clip(
                    drawn[:, source - earliest, push.drive] * push.deviation, *push.room[:, source]
                )
                total[:, place] += away[:, np.newaxis] * push.gain[row]
    return total


def _narrowed(
    away: Array, at: Sequence[int], readings: Readings, value: Array, noise: Noise, rng: np.random.Generator
) -> Array:
    """Return draws moved by what their readings miss of the measured ones, shape (n, r, o)."""
    size = np.array([noise.of_output(name) for name in readings.outputs])
    if (size <= 0.0).any():
        name = readings.outputs[int(np.argmin(size))]
        raise InputError(f"{name}: a measured output needs a noise above zero")
    known = np.isfinite(readings.seen)
    measured = away[:, :, at][:, known]  # (n, q)
    deviation = np.broadcast_to(size, known.shape)[known]
    missing = (readings.seen - value[:, at])[known]
    draws, flat = len(away), away.reshape(len(away), -1)
    centred = measured - measured.mean(axis=0)
    together = (flat - flat.mean(axis=0)).T @ centred / draws
    spread = centred.T @ centred / draws + np.diag(deviation**2)
    shaken = measured + deviation * rng.standard_normal(measured.shape)
    moved = flat + np.linalg.solve(spread, (missing - shaken).T).T @ together.T
    return np.asarray(moved.reshape(away.shape))


def _finite(change: Array, cause: str) -> Array:
    if not np.isfinite(change).all():
        raise InputError(f"{cause}: within its range the fast model has no balance")
    return change
