"""Series of inputs for a robot that is measured while it moves: short, as every simulated second costs time.

All start and end at zero input and stay within the reach of what was played so far.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.next_experiment.programmes import Programme, only, reach_of, table_of
from catheter_sim.diagnosis.thresholds import LET_GO_S, MOVING_ROW_S, SLOW_LOOP_S, SWEEP_HZ, SWEEP_S, SWING_S
from catheter_sim.tables import Table


def moving_programmes(robot: RobotSpec, trials: Sequence[Trial]) -> tuple[Programme, ...]:
    """Return what may be played next, simplest first; arguments as of `programmes.programmes`."""
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
    reach = reach_of(robot, trials)
    rows = np.concatenate(
        [[np.zeros(len(reach))], *(np.outer(way, only(reach, k)) for k in range(len(reach)))]
    )
    return table_of(robot, trials, rows, np.full(len(rows), MOVING_ROW_S))


def _count(seconds: float) -> int:
    return max(1, round(seconds / MOVING_ROW_S))


def _line(start: float, end: float, count: int) -> Array:
    """Return the rows after `start` up to `end`."""
    return np.linspace(start, end, count + 1)[1:]
