"""Series of inputs that a robot may be made to play next: causes answer each of them differently.

All series start and end at zero input and stay within the reach of what was played so far; only a force
across the tip is new.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import channel_inputs, input_channels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.report.next_experiment import NEXT_EXPERIMENT_FILE
from catheter_sim.diagnosis.thresholds import (
    FORCE_SHARE,
    HOLD_ROWS,
    HOLD_S,
    PACES,
    PROGRAMME_ROW_S,
    PROGRAMME_STEPS,
    STANDING_SHARE,
)
from catheter_sim.robots import kind_of
from catheter_sim.tables import Table
from catheter_sim.units import si_factor


@dataclass(frozen=True)
class Programme:
    """Inputs to play.

    Attributes:
        words: what they are, to follow "play the CSV, ".
        table: in file units.
    """

    words: str
    table: Table


def programmes(robot: RobotSpec, trials: Sequence[Trial]) -> tuple[Programme, ...]:
    """Return what may be played next, simplest first.

    Args:
        robot: its channels are driven.
        trials: what was played so far.
    """
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
    reach = reach_of(robot, trials)
    shape = _path([0.0, 1.0, 0.0, 0.5, 0.25, 0.5, 0.0])
    parts = [np.outer(shape, only(reach, index)) for index in (*range(len(reach)), 0)]
    return table_of(robot, trials, np.concatenate(parts))


def _against(robot: RobotSpec, trials: Sequence[Trial]) -> Table:
    """Return each channel's loops from the height at which the others stand, up to its reach."""
    reach = reach_of(robot, trials)
    standing = STANDING_SHARE * reach
    parts = [np.outer(_path([0.0, 1.0]), standing)]
    for index in range(len(reach)):
        moved = only((1.0 - STANDING_SHARE) * reach, index)
        parts.append(standing + np.outer(_path([0.0, 1.0, 0.0, 0.5, 0.0]), moved))
    parts.append(np.outer(_path([1.0, 0.0]), standing))
    return table_of(robot, trials, np.concatenate(parts))


def _together(robot: RobotSpec, trials: Sequence[Trial]) -> Table:
    shape = _path([0.0, 0.6, 0.0, 0.6, 0.0])
    return table_of(robot, trials, np.outer(shape, reach_of(robot, trials)))


def _held(robot: RobotSpec, trials: Sequence[Trial]) -> Table:
    """Return each channel's way out and home with a long rest after each; rows of a rest are far apart."""
    reach = reach_of(robot, trials)
    parts, steps = [], []
    for index in range(len(reach)):
        for way in ([0.0, 0.7], [0.7, 0.0]):
            ramp = _path(way)
            parts.append(np.outer(np.append(ramp, np.full(HOLD_ROWS, way[1])), only(reach, index)))
            steps += [PROGRAMME_ROW_S] * len(ramp) + [HOLD_S / HOLD_ROWS] * HOLD_ROWS
    return table_of(robot, trials, np.concatenate(parts), np.array(steps))


def _paced(robot: RobotSpec, trials: Sequence[Trial]) -> Table:
    reach = reach_of(robot, trials)
    usual = float(np.median(np.concatenate([np.diff(trial.inputs.time_s) for trial in trials])))
    way = _path([0.0, 0.5])
    shape = np.concatenate([way, [0.5] * 3, _path([0.5, 1.0]), _path([1.0, 0.5]), [0.5] * 3, way[::-1]])
    parts, steps = [], []
    for pace in PACES:
        for index in range(len(reach)):
            parts.append(np.outer(shape, only(reach, index)))
            steps += [pace * usual] * len(shape)
    return table_of(robot, trials, np.concatenate(parts), np.array(steps))


def _loaded(robot: RobotSpec, trials: Sequence[Trial], force_N: float) -> Table:
    reach = reach_of(robot, trials)
    shape = _path([0.0, 1.0, 0.0])
    pushes = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0))
    parts, forces = [], []
    for push in pushes:
        for index in range(len(reach)):
            parts.append(np.outer(shape, only(reach, index)))
            forces.append(np.tile(force_N * np.array(push), (len(shape), 1)))
    values = np.concatenate([*parts, np.zeros((1, len(reach)))])
    force = np.concatenate([*forces, np.zeros((1, 2))])
    extra = {"force_tip_x_N": force[:, 0], "force_tip_y_N": force[:, 1]}
    return table_of(robot, trials, values, None, extra)


def _columns(robot: RobotSpec, trials: Sequence[Trial]) -> list[str]:
    return input_channels(robot, trials[0].inputs.actuation)


def reach_of(robot: RobotSpec, trials: Sequence[Trial]) -> Array:
    """Return the largest pull of each channel so far, shape (c,), in file units."""
    most = np.max([channel_inputs(robot, trial.inputs).max(axis=0) for trial in trials], axis=0)
    unit = np.array([1.0 / si_factor(column) for column in _columns(robot, trials)])
    return np.asarray(np.maximum(most, 0.0) * unit)


def only(reach: Array, index: int) -> Array:
    return np.where(np.arange(len(reach)) == index, reach, 0.0)


def _path(corners: Sequence[float]) -> Array:
    """Return the way along `corners` in rows of the same step, both ends included."""
    parts = [np.array(corners[:1])]
    for start, end in pairwise(corners):
        count = max(2, round(PROGRAMME_STEPS * abs(end - start)))
        parts.append(np.linspace(start, end, count + 1)[1:])
    return np.concatenate(parts)


def table_of(
    robot: RobotSpec,
    trials: Sequence[Trial],
    values: Array,
    steps_s: Array | None = None,
    extra: Mapping[str, Array] | None = None,
) -> Table:
    """Return channels' values, shape (r, c), as a table that starts and ends at zero.

    Args:
        robot: of which the channels are.
        trials: what was played so far.
        values: in file units.
        steps_s: time before each row, shape (r,); None: the same before all.
        extra: further columns, shape (r,) each.
    """
    steps = np.full(len(values), PROGRAMME_ROW_S) if steps_s is None else steps_s
    time_s = np.round(np.cumsum(steps) - steps[0], 6)
    rounded = np.floor(values * 1e4) / 1e4
    columns = {name: rounded[:, index] for index, name in enumerate(_columns(robot, trials))}
    return Table(time_s, columns | dict(extra or {}), NEXT_EXPERIMENT_FILE)
