"""Inputs of the bench's trials: rich ones with loops inside loops, and poor ones that say little."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.robots import BenchRobot
from catheter_sim.channels import drives_of, input_channels, tendon_inputs
from catheter_sim.core.drive import Quantity
from catheter_sim.core.inputs import Inputs
from catheter_sim.units import si_factor

CYCLE_ROWS = 15
SPACINGS_S = (0.25, 0.5, 1.0, 2.0)  # from row to row; the nominal robot does not notice
_TIMES_LOWEST = 0.5  # of the reach, that a rich cycle takes at least
_POOR = (0.25, 0.45)  # of the reach


def history(bench: BenchRobot, generator: np.random.Generator, rich: bool) -> Inputs:
    """Return one trial's inputs; the first row is zero.

    Args:
        bench: the robot.
        generator: draws sizes, channels, turning points and the spacing of the rows.
        rich: several cycles, each out, partly back, out again and home, in changing channels or directions;
            otherwise one slow way out and home, not far.
    """
    reach = np.array(bench.trials.reach)
    if rich:
        cycles = max(1, round(bench.trials.rows / CYCLE_ROWS))
        values = np.concatenate([_rich_cycle(bench, reach, generator) for _ in range(cycles)])
    else:
        values = _poor_cycle(bench, reach, generator)
    if bench.trials.pretension_N > 0.0:
        standing = generator.uniform(0.0, bench.trials.pretension_N)
        values = np.maximum(values, standing)
    values = np.concatenate([np.zeros((1, values.shape[1])), values])
    spacing = float(generator.choice(SPACINGS_S))
    return _inputs(bench, values, spacing)


def _shares(generator: np.random.Generator) -> Array:
    """Return a pull's course from 0: out to 1, back to a valley, out again, home; `CYCLE_ROWS` rows."""
    valley, second = generator.uniform(0.15, 0.6), generator.uniform(0.75, 1.0)
    corners = ((0.0, 1.0, 5), (1.0, valley, 3), (valley, second, 3), (second, 0.0, 4))
    return np.concatenate([np.linspace(a, b, count + 1)[1:] for a, b, count in corners])


def _rich_cycle(bench: BenchRobot, reach: Array, generator: np.random.Generator) -> Array:
    size = generator.uniform(_TIMES_LOWEST, 1.0)
    share = _shares(generator)
    if bench.trials.drive == "heading":
        return size * share[:, np.newaxis] * _heading(bench, reach, generator)
    if bench.trials.drive == "joints":
        return _to_and_fro(bench, reach, generator)
    values = np.zeros((len(share), len(reach)))
    first = int(generator.integers(len(reach)))
    values[:, first] = size * share * reach[first]
    others = _elsewhere(bench, first) if bench.trials.together else []
    if others and generator.random() < 0.6:
        second = int(generator.choice(others))
        size = generator.uniform(0.3, 0.8)
        values[:, second] = size * np.roll(share, int(generator.integers(2, 6))) * reach[second]
    return values


def _poor_cycle(bench: BenchRobot, reach: Array, generator: np.random.Generator) -> Array:
    size = generator.uniform(*_POOR)
    rows = min(bench.trials.rows // 2, 24)
    share = np.concatenate([np.linspace(0.0, 1.0, rows // 2), np.linspace(1.0, 0.0, rows - rows // 2)])
    if bench.trials.drive == "heading":
        return size * share[:, np.newaxis] * _heading(bench, reach, generator)
    values = np.zeros((len(share), len(reach)))
    channel = int(generator.integers(len(reach)))
    values[:, channel] = size * share * reach[channel]
    return values


def _heading(bench: BenchRobot, reach: Array, generator: np.random.Generator) -> Array:
    """Return the displacements, shape (c,), that bend a segment in a drawn direction."""
    heading = generator.uniform(0.0, 2.0 * math.pi)
    angles = np.array([math.atan2(*drive.side[::-1]) for drive in drives_of(bench.robot)])
    return np.asarray(reach * np.cos(angles - heading), dtype=np.float64)


def _to_and_fro(bench: BenchRobot, reach: Array, generator: np.random.Generator) -> Array:
    """Return all joints' displacements out to both sides, one after the other; what advances only out."""
    turn = float(generator.choice((-1.0, 1.0)))
    shape = np.concatenate(
        [np.linspace(0, 1, 5)[1:], np.linspace(1, -0.8, 8)[1:], np.linspace(-0.8, 0, 5)[1:]]
    )
    values = np.empty((len(shape), len(reach)))
    for index, drive in enumerate(drives_of(bench.robot)):
        size = generator.uniform(0.3, 1.0)
        moved = turn * np.roll(shape, int(generator.integers(0, 5)))
        moved = np.abs(moved) if drive.quantity is Quantity.ADVANCE else moved
        values[:, index] = size * reach[index] * moved
    return values


def _elsewhere(bench: BenchRobot, channel: int) -> list[int]:
    """Return the channels that move another section than `channel` does."""
    sections = [drive.moves for drive in drives_of(bench.robot)]
    return [index for index, end in enumerate(sections) if end != sections[channel]]


def _inputs(bench: BenchRobot, values: Array, spacing_s: float) -> Inputs:
    """Return channel values, shape (r, c), as inputs of every tendon; rounded as a file would."""
    robot = bench.robot
    unit = np.array([1.0 / si_factor(column) for column in input_channels(robot)])
    rounded: Array = np.round(values * unit, 5) / unit
    zeros = np.zeros((len(values), 3))
    time_s = spacing_s * np.arange(len(values), dtype=float)
    tendon = tendon_inputs(robot, robot.actuation, rounded)
    return Inputs(time_s, robot.actuation, tendon, zeros, zeros)
