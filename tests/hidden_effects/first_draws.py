"""Draws of the first bench: a robot, a story, sizes, inputs, noise; made by the simulation."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice, product, takewhile
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.catalogue import read_toml, robot_toml
from catheter_sim.channels import (
    channel_inputs,
    drives_of,
    input_channels,
    posture_columns,
    read_inputs,
    tendon_inputs,
)
from catheter_sim.core.effect import Parameter
from catheter_sim.core.inputs import Inputs, Quantity, pulls_alone
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.nuisance import Nuisance, nuisances_of
from catheter_sim.diagnosis.problem import Problem, Term, terms_for
from catheter_sim.diagnosis.trials import Trial, measured_of, unit_of
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import arriving_inputs, observed, with_built_in_effects, with_effects
from catheter_sim.errors import InputError
from catheter_sim.lab.robots import BENCH_ROBOTS, BenchRobot, bench_robot
from catheter_sim.robots.documents import complete_document, robot_from_document
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table, read_table, write_table
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.twins import twin_for
from catheter_sim.units import si_factor
from hidden_effects.running import ANSWER, Folders, write_json, write_tables

# ----------------------------------------------------------------------------------------------------
# Inputs of the bench's trials: rich ones with loops inside loops, and poor ones that say little.

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


# ----------------------------------------------------------------------------------------------------
# How large an effect is: by the change that it makes in the outputs, over their noise.

SMALLEST, LARGEST = 5.0, 30.0  # times the noise, of an effect that is to be found
_TOLERANCE = 0.03
_MOST_TRIALS = 24
_FACTOR = 2.0
_INSIDE = 0.9  # of the way from the value that does nothing to a bound
_SIMPLEST = 0.6  # share of the draws that take an effect's first variant

Values = dict[str, float]
# Root mean square change of the outputs over their noise at an amplitude; NaN: not possible.
Trace = Callable[[float], float]


@dataclass(frozen=True)
class Direction:
    """A way to turn an effect on: its parameters move from what does nothing, in fixed proportions.

    Attributes:
        effect: its name.
        parameters: those that move.
        share: of each one's scale per unit of amplitude, shape (p,).
    """

    effect: str
    parameters: tuple[Parameter, ...]
    share: Array

    def values(self, amplitude: float) -> Values | None:
        """Return the parameters' values at an amplitude; None at or near a bound, where no interval is."""
        found = {}
        for item, share in zip(self.parameters, self.share, strict=True):
            null = item.to_fit(item.null)
            low, high = (null + _INSIDE * (bound - null) for bound in item.fit_bounds)
            coordinate = null + amplitude * float(share) * item.scale
            if not low <= coordinate <= high:
                return None
            found[item.name] = item.from_fit(coordinate)
        return found


def drawn_direction(robot: RobotSpec, effect: str, generator: np.random.Generator) -> Direction:
    """Return a direction in one of the effect's variants, often the first, inside the bounds near zero."""
    variants = EFFECTS[effect].variants(robot)
    simplest = len(variants) == 1 or generator.random() < _SIMPLEST
    names = variants[0 if simplest else int(generator.integers(1, len(variants)))]
    by_name = {item.name: item for item in EFFECTS[effect].parameters(robot)}
    parameters = tuple(by_name[name] for name in (names or tuple(by_name)))
    share = generator.choice((-1.0, 1.0), len(parameters)) * generator.uniform(0.3, 1.0, len(parameters))
    for index, item in enumerate(parameters):
        low, high = item.fit_bounds
        null = item.to_fit(item.null)
        if null <= low:
            share[index] = abs(share[index])
        elif null >= high:
            share[index] = -abs(share[index])
    return Direction(effect, parameters, share / np.abs(share).max())


def amplitude_for(trace: Trace, target: float) -> tuple[float, float] | None:
    """Return the amplitude at which `trace` is `target`, and the trace there, by doubling and secants.

    Where the trace ends before it reaches `target`, the largest amplitude tried that gives at least
    `SMALLEST` is returned; None if there is none.
    """
    low = high = None
    amplitude, value = 1.0, trace(1.0)
    for _ in range(_MOST_TRIALS):
        if abs(value - target) <= _TOLERANCE * target:
            return amplitude, value
        if value < target:  # False where it is NaN
            low = (amplitude, value)
        else:
            high = (amplitude, value)
        if high is None:
            amplitude *= _FACTOR
        elif low is None or low[1] <= 0.0:
            amplitude = high[0] / _FACTOR if low is None else 0.5 * (low[0] + high[0])
        else:
            amplitude = _between(low, high, target)
        if low is not None and high is not None and high[0] - low[0] < 1e-3 * high[0]:
            break
        value = trace(amplitude)
    return low if low is not None and low[1] >= SMALLEST else None


def _between(low: tuple[float, float], high: tuple[float, float], target: float) -> float:
    """Return where a line in logarithms meets `target`, kept off the ends; the middle if one end is not."""
    middle = float(np.sqrt(low[0] * high[0]))
    if not np.isfinite(high[1]) or high[1] <= low[1]:
        return middle
    share = float(np.log(target / low[1]) / np.log(high[1] / low[1]))
    return float(low[0] * (high[0] / low[0]) ** min(max(share, 0.1), 0.9))


def over_noise(outputs: Sequence[Array], others: Sequence[Array], noise: Array) -> float:
    """Return the root mean square of the difference of two sets of outputs over their columns' noise."""
    squares = [((one - other) / noise) ** 2 for one, other in zip(outputs, others, strict=True)]
    return float(np.sqrt(np.mean(np.concatenate([item.ravel() for item in squares]))))


# ----------------------------------------------------------------------------------------------------
# Causes that are not on the list of effects: a kinked cell, an eccentric pulley, random slip.
#
# No effect of `effects` has their form. Each has one size, and does nothing at size zero.

_SLIPS_A_ROW = 0.12  # share of the rows at which a tendon slips


@dataclass(frozen=True)
class Outside:
    """A cause outside the list; this one does nothing.

    Attributes:
        size: how much of it.
        numbers: what else was drawn, by name.
    """

    size: float
    numbers: Mapping[str, float]

    def change_inputs(self, inputs: Inputs) -> Inputs:
        """Return what arrives instead of `inputs`."""
        return inputs

    def change_postures(self, postures: tuple[Posture, ...]) -> tuple[Posture, ...]:
        """Return where the robot is instead of `postures`."""
        return postures


@dataclass(frozen=True)
class KinkedCell(Outside):
    """One element folds: beyond a small bend (`fold_from_rad`) it bends by `size` times what exceeds that.

    `element` counts from 0 at the base. All that is distal to it turns with it.
    """

    def change_postures(self, postures: tuple[Posture, ...]) -> tuple[Posture, ...]:
        """Return the postures with the fold in them."""
        return tuple(self._folded(posture) for posture in postures)

    def _folded(self, posture: Posture) -> Posture:
        index = int(self.numbers["element"])
        hinge = posture.p_w[index - 1]
        base = posture.R_w[index - 1]
        bend = Rotation.from_matrix(base.T @ posture.R_w[index]).as_rotvec()
        angle = float(np.linalg.norm(bend))
        excess = self.size * max(angle - self.numbers["fold_from_rad"], 0.0)
        if excess == 0.0:
            return posture
        turn = base @ Rotation.from_rotvec(bend / angle * excess).as_matrix() @ base.T
        p_w, R_w = posture.p_w.copy(), posture.R_w.copy()
        p_w[index:] = hinge + (p_w[index:] - hinge) @ turn.T
        R_w[index:] = turn @ R_w[index:]
        return replace(posture, p_w=p_w, R_w=R_w)


@dataclass(frozen=True)
class EccentricPulley(Outside):
    """A pulley that runs out of true: every input u arrives as u + `size` times the amplitude
    `wave` (sin(2 pi u / `period` + `phase_rad`) - sin(`phase_rad`)), zero at zero; never a push."""

    def change_inputs(self, inputs: Inputs) -> Inputs:
        """Return the inputs with the wave on them."""
        period, phase = self.numbers["period"], self.numbers["phase_rad"]
        wave = np.sin(2.0 * np.pi * inputs.tendon / period + phase) - np.sin(phase)
        return _replaced(inputs, self.size * self.numbers["wave"] * wave, int(self.numbers["pulled"]))


@dataclass(frozen=True)
class RandomSlip(Outside):
    """A clamp that slips at random under load: at some rows each tendon loses, for all rows of the cycle
    that follow, a share of its input, drawn anew; `size` is the share's scale. `seed` and the trial's
    inputs and clock make the draw, `again` makes that of a repeated trial another one."""

    def change_inputs(self, inputs: Inputs) -> Inputs:
        """Return the inputs with the slips in them."""
        key = zlib.crc32(inputs.tendon.tobytes()), int(self.numbers["seed"]), int(self.numbers["again"])
        generator = np.random.default_rng(key)
        share = np.zeros_like(inputs.tendon)
        for column in range(share.shape[1]):
            now = 0.0
            slips = generator.random(len(share)) < _SLIPS_A_ROW
            levels = generator.uniform(-1.0, 1.0, len(share))
            for row in range(len(share)):
                now = levels[row] if slips[row] else now
                share[row, column] = now
        return _replaced(inputs, -self.size * share * inputs.tendon, int(self.numbers["pulled"]))


OUTSIDE: Mapping[str, type[Outside]] = {
    "kinked_cell": KinkedCell,
    "eccentric_pulley": EccentricPulley,
    "random_slip": RandomSlip,
}


def drawn_numbers(
    name: str,
    generator: np.random.Generator,
    elements: tuple[int, ...],
    bends_rad: Array,
    reach: float,
    pulled: int,
) -> dict[str, float]:
    """Return what a cause outside the list has besides its size.

    Args:
        name: in `OUTSIDE`.
        generator: draws.
        elements: those that may fold, counted from 0.
        bends_rad: bend of each element at each row without the cause, shape (n, r).
        reach: largest input of any channel that pulls [N, or m].
        pulled: so many inputs, the first ones, are tendons' (a tube's advance is none).
    """
    if name == "kinked_cell":
        element = int(generator.choice(elements))
        largest = float(np.abs(bends_rad[element]).max())
        return {"element": element, "fold_from_rad": generator.uniform(0.2, 0.5) * largest}
    if name == "eccentric_pulley":
        return {
            "period": generator.uniform(0.2, 0.5) * reach,
            "phase_rad": generator.uniform(0.0, 2.0 * np.pi),
            "wave": 0.01 * reach,
            "pulled": pulled,
        }
    return {"seed": float(generator.integers(2**31)), "again": 0.0, "pulled": pulled}


def _replaced(inputs: Inputs, added: Array, pulled: int) -> Inputs:
    tendon = inputs.tendon.copy()
    tendon[:, :pulled] += added[:, :pulled]
    return replace(inputs, tendon=pulls_alone(inputs.actuation, tendon))


# ----------------------------------------------------------------------------------------------------
# What a robot shows along a trial, by the simulation, which makes the data, and by the twin.

ROD_MODEL = STATIC_MODELS["VC_ref_noproj"]
RAMP_S = 0.5  # simulated time from row to row


class CannotMake(Exception):
    """The simulation, or the twin, finds no posture for some row: another draw is needed."""


@dataclass(frozen=True)
class Simulated:
    """A simulated trial: the robot that was simulated, and its postures as they are observed."""

    robot: RobotSpec
    postures: tuple[Posture, ...]

    def columns(self, names: Sequence[str]) -> Array:
        """Return output columns, shape (r, o), in file units."""
        values = posture_columns(self.robot, self.postures)
        return np.stack([values[name] for name in names], axis=1)


def simulated(
    bench: BenchRobot, robot: RobotSpec, inputs: Inputs, gravity_mps2: Array, outside: Outside | None = None
) -> Simulated:
    """Return a trial of the robot with its effects, by the simulation or by the rod model.

    Raises:
        CannotMake: the simulation diverged, or an input goes beyond a joint's range.
    """
    built = replace(with_built_in_effects(robot), **bench.trials.simulated)
    arriving = arriving_inputs(robot, inputs)
    if outside is not None:
        arriving = outside.change_inputs(arriving)
    try:
        # The rod model's friction knows no history.
        if bench.trials.rods and built.friction.mu == 0.0 and ROD_MODEL.applies_to(built):
            postures = ROD_MODEL.solve(built, arriving, gravity_mps2).postures
        else:
            run = simulate(built, arriving, gravity_mps2, ramp_s=RAMP_S)
            if run.failure:
                raise CannotMake(run.failure)
            postures = run.postures
    except InputError as error:
        raise CannotMake(str(error)) from None
    if outside is not None:
        postures = outside.change_postures(postures)
    return Simulated(built, observed(robot, inputs.time_s, postures))


def twin_outputs(
    robots: Sequence[RobotSpec], trials: Sequence[Inputs], columns: Sequence[str], gravity_mps2: Array
) -> list[Array]:
    """Return the twin's outputs of several robots along each trial, shape (B, r, o) each; NaN: none found."""
    twin = twin_for(robots[0], trials[0].actuation, columns, gravity_mps2)
    found = []
    for inputs in trials:
        try:
            found.append(twin(robots, inputs, 1))
        except InputError:
            found.append(np.full((len(robots), len(inputs), len(columns)), np.nan))
    return found


def rms(values: Array) -> float:
    """Return the root mean square; NaN where a value is missing."""
    return float(np.sqrt(np.mean(values**2)))


# ----------------------------------------------------------------------------------------------------
# Draws what a data set hides: a robot, a story, sizes, inputs, noise and errors of calibration.
#
# The seed and the number of the draw decide everything. Stories are dealt in blocks of twenty: ten single
# effects, four pairs, three times nothing and three causes outside the list; robots in blocks of all
# robots.

STORIES = ("single",) * 10 + ("pair",) * 4 + ("none",) * 3 + ("outside",) * 3
TRAINING, HELDOUT, ASIDE = 4, 2, 3  # trials; one more repeats a training trial
_RICH = 0.6  # share of the trials, the first of each part aside, which is
_MANY = 0.25  # share of the data sets with many points measured
NOISE = {"mm": (0.05, 0.3), "deg": (0.1, 0.5)}  # of the data sets to the nominal specification
_DEALS = 40
_SHOWS = 0.02  # of what the parameter that shows most changes
_MARGIN = 1.05  # by which an effect could be larger, and every row still have a posture


@dataclass(frozen=True)
class Setting:
    """What a data set is about, before anything is hidden in it.

    Attributes:
        bench: the robot.
        built: the robot of this data set, with its errors of calibration.
        factors: those errors, by nuisance's name.
        columns: what is measured.
        noise: of each column, shape (o,), in file units.
        trials: inputs of the data set, training trials first, a repeat of the first one last of them.
        aside: inputs of the third set.
        roles: of the data set's trials; "" where it leaves them open.
        gravity_mps2: shape (3,) [m/s^2].
    """

    bench: BenchRobot
    built: RobotSpec
    factors: Mapping[str, float]
    columns: tuple[str, ...]
    noise: Array
    trials: tuple[Inputs, ...]
    aside: tuple[Inputs, ...]
    roles: tuple[str, ...]
    gravity_mps2: Array


@dataclass(frozen=True)
class Hidden:
    """What is hidden: effects, or one cause outside the list, or nothing.

    Attributes:
        effects: by name, values in file units.
        sizes: of each effect or outside cause: the change that leaving it out makes, over the noise.
        outside: a cause outside the list, or None.
        outside_name: its name, or "".
        refused: what was drawn before and could not be made, and why.
    """

    effects: Mapping[str, Mapping[str, float]]
    sizes: Mapping[str, float]
    outside: Outside | None = None
    outside_name: str = ""
    refused: tuple[str, ...] = ()


def story_of(seed: int, index: int) -> str:
    """Return which kind of story a draw tells."""
    block, place = divmod(index, len(STORIES))
    return STORIES[int(np.random.default_rng((1, seed, block)).permutation(len(STORIES))[place])]


def robot_of(seed: int, index: int, names: Sequence[str] = tuple(BENCH_ROBOTS)) -> str:
    """Return which of the bench's robots a draw is about."""
    block, place = divmod(index, len(names))
    return names[int(np.random.default_rng((2, seed, block)).permutation(len(names))[place])]


def setting_of(key: Sequence[int], robot: str, many_bodies: bool) -> Setting:
    """Return a draw's robot, inputs and measurements.

    Args:
        key: of the random draw.
        robot: name of a robot of the bench.
        many_bodies: measure three points along the robot besides the tip, which shows what happens inside;
            otherwise this is drawn.
    """
    generator = np.random.default_rng((3, *key))
    bench = bench_robot(robot, generator)
    columns = _columns(bench, generator, generator.random() < _MANY or many_bodies)
    noise = {unit: generator.uniform(*ends) for unit, ends in NOISE.items()}
    built, factors = bench.robot, {}
    for nuisance in nuisances_of(bench.reference):
        factors[nuisance.name] = generator.uniform(nuisance.parameter.lower, nuisance.parameter.upper)
        built = nuisance.change_robot(built, factors[nuisance.name])
    training = _histories(bench, generator, TRAINING)
    pulled = np.asarray(np.concatenate([inputs.tendon for inputs in training]).any(axis=0))
    heldout, aside = (_histories(bench, generator, count, pulled) for count in (HELDOUT, ASIDE))
    training = (*training, training[0])
    roles = ("train",) * len(training) + ("heldout",) * HELDOUT
    if generator.random() < 0.25:
        roles = ("",) * len(roles)
    return Setting(
        bench=bench,
        built=built,
        factors=factors,
        columns=columns,
        noise=np.array([noise[unit_of(name)] for name in columns]),
        trials=(*training, *heldout),
        aside=aside,
        roles=roles,
        gravity_mps2=np.zeros(3),
    )


def _histories(
    bench: BenchRobot, generator: np.random.Generator, count: int, channels: np.ndarray | None = None
) -> tuple[Inputs, ...]:
    """Return inputs of so many trials, the first one rich, that move no other than these channels, (t,)."""
    found: list[Inputs] = []
    while len(found) < count:
        drawn = history(bench, generator, not found or generator.random() < _RICH)
        if channels is None or not drawn.tendon[:, ~channels].any():
            found.append(drawn)
    return tuple(found)


def hidden_of(key: Sequence[int], story: str, setting: Setting, nothing: Sequence[Simulated]) -> Hidden:
    """Return what a draw hides, sized by the twin on the data set's inputs.

    Args:
        key: of the random draw.
        story: one of `STORIES`.
        setting: where it is hidden.
        nothing: the simulation of the data set's trials with nothing hidden.

    Raises:
        CannotMake: nothing that was drawn could be given the wanted size.
    """
    generator = np.random.default_rng((4, *key))
    if story == "none":
        return Hidden({}, {})
    if story == "outside":
        return _outside(setting, generator, nothing)
    wanted = 1 if story == "single" else 2
    names = [name for name in EFFECTS if EFFECTS[name].variants(setting.bench.robot)]
    refused: list[str] = []
    for _ in range(_DEALS):
        chosen = [names[int(k)] for k in generator.choice(len(names), wanted, replace=False)]
        targets = generator.uniform(SMALLEST * 1.2, LARGEST / 1.2, wanted)
        directions = [
            _shown(setting, drawn_direction(setting.bench.robot, name, generator)) for name in chosen
        ]
        effects: dict[str, dict[str, float]] = {}
        for direction, target in zip(directions, targets, strict=True):
            values = _sized(setting, effects, direction, float(target))
            if values is None:
                refused.append(f"{direction.effect}: no size of {target:.0f} times the noise within bounds")
                break
            effects[direction.effect] = values
        else:
            sizes = {name: _left_out_size(setting, effects, name) for name in effects}
            if all(SMALLEST <= size <= LARGEST for size in sizes.values()):
                return Hidden(effects, sizes, refused=tuple(refused))
            refused.append(f"{' + '.join(effects)}: {sizes}: one hides the other")
    raise CannotMake(f"{setting.bench.reference}: {'; '.join(refused)}")


def superseded(robot_reference: str, effects: Mapping[str, object]) -> list[Nuisance]:
    """Return the nuisance numbers that are as specified, since an effect frees the same number."""
    return [item for item in nuisances_of(robot_reference) if not set(item.superseded_by).isdisjoint(effects)]


def truth(setting: Setting, effects: Mapping[str, Mapping[str, float]]) -> RobotSpec:
    """Return the robot that makes the data: errors of calibration built in, effects attached."""
    robot = setting.bench.robot
    fixed = [item.name for item in superseded(setting.bench.reference, effects)]
    for nuisance in nuisances_of(setting.bench.reference):
        if nuisance.name not in fixed:
            robot = nuisance.change_robot(robot, setting.factors[nuisance.name])
    return with_effects(robot, effects)


def twin_of(setting: Setting, robot: RobotSpec, trials: Sequence[Inputs]) -> list[Array]:
    """Return the twin's outputs of one robot along trials, shape (r, o) each."""
    found = twin_outputs([robot], trials, setting.columns, setting.gravity_mps2)
    return [outputs[0] for outputs in found]


def _sized(
    setting: Setting, others: Mapping[str, Mapping[str, float]], direction: Direction, target: float
) -> dict[str, float] | None:
    """Return the values that change the outputs of the robot with `others` by `target` times the noise."""
    name = direction.effect
    freed = superseded(setting.bench.reference, {name: None})
    base = truth(setting, {**others, name: {}} if freed else others)
    without = twin_of(setting, base, setting.trials)

    def trace(amplitude: float) -> float:
        values = direction.values(amplitude)
        if values is None:
            return float("nan")
        changed = twin_of(setting, truth(setting, {**others, name: values}), setting.trials)
        return over_noise(changed, without, setting.noise)

    found = amplitude_for(trace, target)
    if found is None:
        return None
    beyond = {**others, name: direction.values(_MARGIN * found[0]) or {}}
    reached = twin_of(setting, truth(setting, beyond), (*setting.trials, *setting.aside))
    if not all(np.isfinite(outputs).all() for outputs in reached):
        return None  # so near the end of a joint's range a fit could not move
    return direction.values(found[0])


def _shown(setting: Setting, direction: Direction) -> Direction:
    """Return a direction without the parameters that change next to nothing in the training trials.

    A plane's frame is not turned out of it: that shows in the second order only, and could not be found; nor
    could the scale of a channel that only held-out trials pull.
    """
    values = direction.values(1.0)
    if values is None:
        return direction
    name = direction.effect

    def outputs(some: Mapping[str, float]) -> list[Array]:
        return twin_of(setting, truth(setting, {name: some}), setting.trials[: TRAINING + 1])

    full = outputs(values)
    apart = [
        over_noise(outputs({**values, item.name: item.null}), full, setting.noise)
        for item in direction.parameters
    ]
    share = np.where(np.array(apart) < _SHOWS * max(apart), 0.0, direction.share)
    return replace(direction, share=share / np.abs(share).max()) if share.any() else direction


def _left_out_size(setting: Setting, effects: Mapping[str, Mapping[str, float]], name: str) -> float:
    others = {key: values for key, values in effects.items() if key != name}
    nothing = {**others, name: {}} if superseded(setting.bench.reference, {name: None}) else others
    both = twin_of(setting, truth(setting, effects), setting.trials)
    return over_noise(both, twin_of(setting, truth(setting, nothing), setting.trials), setting.noise)


def _columns(bench: BenchRobot, generator: np.random.Generator, many_bodies: bool) -> tuple[str, ...]:
    places = ["tip"]
    if many_bodies:
        places += [f"body_{k}" for k in bench.bodies]
    elif generator.random() < 0.6:
        places.append(f"body_{bench.bodies[1]}")
    found = [f"{place}_{axis}_mm" for place in places for axis in bench.trials.axes]
    if bench.trials.angles and not many_bodies and generator.random() < 0.4:
        found += bench.trials.angles
    return tuple(found)


def _outside(setting: Setting, generator: np.random.Generator, nothing: Sequence[Simulated]) -> Hidden:
    """Return a cause outside the list, sized on the simulation or on the twin, whichever it acts on."""
    bench = setting.bench
    clean = [run.columns(setting.columns) for run in nothing]
    twins = twin_of(setting, setting.built, setting.trials)
    bends = _bends(nothing[0].postures)
    pulled, reach = _pulled(bench)
    refused: list[str] = []
    for _ in range(_DEALS):
        name = list(OUTSIDE)[int(generator.integers(len(OUTSIDE)))]
        target = generator.uniform(SMALLEST * 1.2, LARGEST / 1.2)
        numbers = drawn_numbers(name, generator, _foldable(bench, bends), bends, reach, pulled)

        def trace(size: float, name: str = name, numbers: Mapping[str, float] = numbers) -> float:
            cause = OUTSIDE[name](size, numbers)
            if name == "kinked_cell":
                changed = [replace(run, postures=cause.change_postures(run.postures)) for run in nothing]
                return over_noise([run.columns(setting.columns) for run in changed], clean, setting.noise)
            if name == "random_slip" and size > 0.9:
                return float("nan")
            arriving = [cause.change_inputs(inputs) for inputs in setting.trials]
            return over_noise(twin_of(setting, setting.built, arriving), twins, setting.noise)

        found = amplitude_for(trace, target)
        if found is not None:
            return Hidden({}, {name: found[1]}, OUTSIDE[name](found[0], numbers), name, tuple(refused))
        refused.append(f"{name}: no size of {target:.0f} times the noise")
    raise CannotMake(f"{bench.reference}: {'; '.join(refused)}")


def _bends(postures: Sequence[Posture]) -> Array:
    """Return by how much each element is turned against the one below it, shape (n, r) [rad]."""
    turned = np.array([posture.R_w for posture in postures])  # (r, n, 3, 3)
    trace = np.einsum("rnij,rnij->rn", turned[:, 1:], turned[:, :-1])
    angle = np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0))
    return np.concatenate([np.zeros((1, len(turned))), angle.T])


def _foldable(bench: BenchRobot, bends_rad: Array) -> tuple[int, ...]:
    """Return the elements, counted from 0, between the first and the last measured point that bend."""
    low, high = bench.bodies[0], bench.bodies[-1]
    moving = [k for k in range(low, high) if np.ptp(bends_rad[k]) > 1e-3]
    return tuple(moving) or (int(np.argmax(np.ptp(bends_rad, axis=1))),)


def _pulled(bench: BenchRobot) -> tuple[int, float]:
    """Return how many inputs pull tendons, and the largest of them [N, or m]."""
    pulled = list(takewhile(lambda drive: drive.quantity is not Quantity.ADVANCE, drives_of(bench.robot)))
    return sum(len(drive.tendons) for drive in pulled), max(bench.trials.reach[: len(pulled)])


# ----------------------------------------------------------------------------------------------------
# Whether two explanations can be told apart on a data set at all, whoever tries.
#
# The data's twin is made anew from the true robot, without noise and without the simulation's differences.
# A rival hypothesis, nuisance numbers included, is fitted to that. What is left, over the noise and rooted
# over all values, is the distance d of the two hypotheses in these data: one who knew the noise and both
# hypotheses would take one for the other with probability Phi(-d / 2).

TOLD_APART = 4.0  # distance from which on two hypotheses can be told apart: 2 % would be mistaken
_MOST_VARIANTS = 6
Known = dict[tuple[str, str], float]


def distance(
    problem: Problem,
    trials: Sequence[Trial],
    true_robot: RobotSpec,
    noise: Mapping[str, float],
    effects: Sequence[str],
    known: Known,
) -> tuple[float, float]:
    """Return how far the nearest hypothesis with `effects` stays from the truth in these data.

    Args:
        problem: the data set's, for its robot, nuisance numbers and twin.
        trials: all trials of the data set.
        true_robot: the robot that made the data, effects attached.
        noise: standard deviation by unit.
        effects: the rival's names; () is the calibrated model.
        known: values to start from.

    Returns:
        The distance d, and the root mean square over the noise of a single value.
    """
    columns = problem.columns
    weight = np.array([noise[unit_of(name)] for name in columns])
    exact = tuple(_as_true(problem, trial, true_robot) for trial in trials)
    asked = replace(problem, trials=exact, weight=weight, every=1)
    best = np.inf
    count = 1
    for terms in islice(product(*(_variants(problem, name) for name in effects)), _MOST_VARIANTS):
        found = fit(asked, terms, known, cross_validate=False)
        found = fit(asked, terms, found.values, cross_validate=False, thorough=True)
        best = min(best, float(found.residual @ found.residual))
        count = len(found.residual)
    return float(np.sqrt(best)), float(np.sqrt(best / count))


def _variants(problem: Problem, effect: str) -> tuple[Term, ...]:
    """Return an effect's variants, the most detailed first."""
    return tuple(sorted(terms_for(problem.robot, effect), key=lambda term: -len(term.free)))


def _as_true(problem: Problem, trial: Trial, true_robot: RobotSpec) -> Trial:
    values = problem.twin([true_robot], trial.inputs, 1)[0]
    values = np.where(np.isfinite(measured_of(trial, problem.columns)), values, np.nan)
    columns = {name: values[:, index] for index, name in enumerate(problem.columns)}
    return replace(trial, outputs=replace(trial.outputs, columns=columns))


# ----------------------------------------------------------------------------------------------------
# Makes a draw's data by the simulation, and keeps the noise above what the twin itself gets wrong.
#
# The twin that will diagnose and the simulation that makes the data differ a little with every effect off,
# and a little with the hidden effects on. Neither may reach more than `GAP_SHARE` of the noise: a draw in
# which it does gets more noise, up to `MOST_NOISE`, or is drawn again. So is an effect of which calibrated
# numbers, within their ranges, leave less than `SMALLEST` times the noise, and a pair of which one, fitted
# alone, does what both do to within that share: no data would show the other. What was refused is kept.

GAP_SHARE = 1.0 / 3.0  # of the noise, that the twin and the simulation may differ by
MOST_NOISE = {"mm": 0.5, "deg": 0.75}
MISSING = 0.01  # share of the cells that may be empty, at most
_MORE_NOISE = 1.1
Effects = Mapping[str, Mapping[str, float]]
_ATTEMPTS = 8


@dataclass(frozen=True)
class Made:
    """A draw with its data.

    Attributes:
        seed, index: of the draw.
        story: one of `draw.STORIES`.
        robot: the bench's name of the robot.
        setting: robot, inputs, noise.
        hidden: the answer.
        size: change of the simulated outputs that all of it makes, over the noise.
        gap: rms of simulation minus twin by unit, every effect off.
        gap_with: the same with the hidden effects on; empty for a cause outside the list.
        clean: outputs without noise of the data set's trials, shape (r, o) each.
        outputs: the same with noise and gaps.
        aside: outputs with noise of the third set.
        refused: what was drawn before this and could not be used, and why.
    """

    seed: int
    index: int
    story: str
    robot: str
    setting: Setting
    hidden: Hidden
    size: float
    gap: dict[str, float]
    gap_with: dict[str, float]
    clean: tuple[Array, ...]
    outputs: tuple[Array, ...]
    aside: tuple[Array, ...]
    refused: tuple[str, ...]


def make(seed: int, index: int, robots: Sequence[str] = tuple(BENCH_ROBOTS)) -> Made:
    """Return a draw with its data; seed, index and the robots to draw from decide everything.

    Raises:
        CannotMake: none of the attempts gave data.
    """
    story, robot = story_of(seed, index), robot_of(seed, index, robots)
    refused: list[str] = []
    for attempt in range(_ATTEMPTS):
        key = (seed, index, attempt)
        try:
            return _made(key, story, robot, tuple(refused))
        except CannotMake as error:
            refused.append(str(error))
    raise CannotMake(f"draw {index}, {robot}, {story}: {'; '.join(refused)}")


def _made(key: tuple[int, int, int], story: str, robot: str, refused: tuple[str, ...]) -> Made:
    setting = setting_of(key, robot, many_bodies=story == "outside")
    runs = [_simulation(setting, {}, inputs, None) for inputs in setting.trials]
    nothing = [run.columns(setting.columns) for run in runs]
    gap = _gaps(setting, nothing, twin_of(setting, setting.built, setting.trials))
    setting = _with_noise_above(setting, gap)
    for _ in range(2):
        hidden = hidden_of(key, story, setting, runs)
        clean = nothing if story == "none" else _simulations(setting, hidden, setting.trials)
        gap_with = {}
        if hidden.outside is None:
            gap_with = _gaps(setting, clean, twin_of(setting, truth(setting, hidden.effects), setting.trials))
        if all(gap <= GAP_SHARE * _noise(setting)[unit] for unit, gap in gap_with.items()):
            break
        setting = _with_noise_above(setting, gap_with, ", ".join(hidden.effects))
    else:
        raise CannotMake(f"{', '.join(hidden.effects)}: the twin differs by {gap_with} with it")
    if hidden.effects:
        _require_all_shown(setting, hidden.effects)
    size = over_noise(clean, _without(setting, hidden, nothing), setting.noise)
    if hidden.sizes and not SMALLEST <= size <= LARGEST * len(hidden.sizes):
        raise CannotMake(f"{', '.join(hidden.sizes)}: {size:.1f} times the noise in the simulation")
    generator = np.random.default_rng((5, *key))
    aside = _simulations(setting, hidden, setting.aside)
    return Made(
        seed=key[0],
        index=key[1],
        story=story,
        robot=robot,
        setting=setting,
        hidden=hidden,
        size=size,
        gap=gap,
        gap_with=gap_with,
        clean=tuple(clean),
        outputs=tuple(_measured(values, setting.noise, generator) for values in clean),
        aside=tuple(_measured(values, setting.noise, generator) for values in aside),
        refused=(*refused, *hidden.refused),
    )


def _require_all_shown(setting: Setting, effects: Effects) -> None:
    """Raise where calibrated numbers leave little of a single effect, or one of several does what all do."""
    tables = [
        Table(inputs.time_s, {name: np.zeros(len(inputs)) for name in setting.columns})
        for inputs in setting.trials
    ]
    robot = replace(setting.bench.robot, actuation=setting.trials[0].actuation)
    problem = Problem(
        robot=robot,
        nuisances=nuisances_of(setting.bench.reference),
        trials=tuple(
            Trial("", "train", inputs, table) for inputs, table in zip(setting.trials, tables, strict=True)
        ),
        columns=setting.columns,
        weight=setting.noise,
        twin=twin_for(robot, setting.trials[0].actuation, setting.columns, setting.gravity_mps2),
    )
    true = truth(setting, effects)
    rivals: list[tuple[tuple[str, ...], float]] = [((), SMALLEST)]
    if len(effects) > 1:
        rivals = [((name,), GAP_SHARE) for name in effects]
    for alone, least in rivals:
        known = {(name, key): value for name in alone for key, value in effects[name].items()}
        apart, per_value = distance(problem, problem.trials, true, _noise(setting), alone, known)
        if apart < TOLD_APART or per_value < least:
            what = f"{alone[0]} alone does" if alone else "calibrated numbers do"
            raise CannotMake(f"{', '.join(effects)}: {what} the same to {per_value:.2f} of the noise")


def _simulations(setting: Setting, hidden: Hidden, trials: Sequence[Inputs]) -> list[Array]:
    """Return the simulated outputs of trials with what is hidden; the repeat slips in its own way."""
    found = []
    for index, inputs in enumerate(trials):
        cause = hidden.outside
        if isinstance(cause, RandomSlip) and index == TRAINING:
            cause = replace(cause, numbers={**cause.numbers, "again": 1.0})
        found.append(_simulation(setting, hidden.effects, inputs, cause).columns(setting.columns))
    return found


def _simulation(setting: Setting, effects: Effects, inputs: Inputs, cause: Outside | None) -> Simulated:
    return simulated(setting.bench, truth(setting, effects), inputs, setting.gravity_mps2, cause)


def _without(setting: Setting, hidden: Hidden, nothing: list[Array]) -> list[Array]:
    """Return the simulated outputs without what is hidden, of the very same robot."""
    freed = superseded(setting.bench.reference, hidden.effects)
    if not freed:
        return nothing
    idle: Effects = {
        name: {} for name in hidden.effects if any(name in nuisance.superseded_by for nuisance in freed)
    }
    runs = [_simulation(setting, idle, inputs, None) for inputs in setting.trials]
    return [run.columns(setting.columns) for run in runs]


def _noise(setting: Setting) -> dict[str, float]:
    return {unit_of(name): float(size) for name, size in zip(setting.columns, setting.noise, strict=True)}


def _gaps(setting: Setting, outputs: Sequence[Array], others: Sequence[Array]) -> dict[str, float]:
    """Return the root mean square difference of two sets of outputs by unit; raise where one is missing."""
    apart = np.concatenate(outputs) - np.concatenate(others)
    if not np.isfinite(apart).all():
        raise CannotMake("the twin finds no posture")
    units = np.array([unit_of(name) for name in setting.columns])
    return {str(unit): rms(apart[:, units == unit]) for unit in dict.fromkeys(units.tolist())}


def _with_noise_above(setting: Setting, gap: dict[str, float], what: str = "nothing") -> Setting:
    """Return the setting with as much noise as the twin's gap asks for."""
    noise = _noise(setting)
    for unit, size in gap.items():
        if size > GAP_SHARE * noise[unit]:
            noise[unit] = _MORE_NOISE * size / GAP_SHARE
        if noise[unit] > MOST_NOISE[unit]:
            raise CannotMake(f"with {what} hidden, twin and simulation differ by {size:.2g} {unit}")
    return replace(setting, noise=np.array([noise[unit_of(name)] for name in setting.columns]))


def _measured(clean: Array, noise: Array, generator: np.random.Generator) -> Array:
    """Return outputs with white noise and some cells missing (NaN)."""
    noisy = clean + noise * generator.normal(size=clean.shape)
    share = generator.uniform(0.0, MISSING)
    return np.where(generator.random(clean.shape) < share, np.nan, noisy)


# ----------------------------------------------------------------------------------------------------
# Writes a draw and reads it back: the data set, the answer, the third set of trials.

TRUTH = "truth.toml"


def write_draw(made: Made, folders: Folders) -> None:
    """Write the data set and the answer; the answer's own file last."""
    setting = made.setting
    folders.answer.mkdir(parents=True, exist_ok=True)
    write_dataset(
        folders.data,
        folders.name,
        setting.bench,
        setting.columns,
        setting.gravity_mps2,
        list(zip(setting.trials, made.outputs, setting.roles, strict=True)),
    )
    (folders.answer / TRUTH).write_text(robot_toml(truth(setting, made.hidden.effects)), encoding="utf-8")
    for number, (inputs, outputs) in enumerate(zip(setting.aside, made.aside, strict=True), start=1):
        table = _table(setting.bench.robot, inputs, setting.columns, outputs)
        write_table(table, folders.answer / f"aside_{number:02d}.csv")
    write_json(_answer(made), folders.answer / ANSWER)


def write_dataset(
    folder: Path,
    name: str,
    bench: BenchRobot,
    columns: Sequence[str],
    gravity_mps2: Array,
    trials: Sequence[tuple[Inputs, Array, str]],
) -> None:
    """Write a data set of made trials.

    Args:
        folder: to write.
        name: of the data set.
        bench: the robot as specified.
        columns: of the outputs.
        gravity_mps2: shape (3,).
        trials: inputs, outputs of shape (r, o) in file units, and role, "" for none.
    """
    tables = [(_table(bench.robot, inputs, columns, outputs), role) for inputs, outputs, role in trials]
    write_tables(folder, name, bench, columns, gravity_mps2, tables)


def robot_as_written(path: Path) -> RobotSpec:
    """Return the robot in a `.toml` without asking whether such a robot is possible.

    A specimen's calibrated numbers may lie a little beyond what the checks of a specification allow.
    """
    robot: RobotSpec = robot_from_document(complete_document(read_toml(path), str(path)), str(path))
    return robot


def read_aside(folders: Folders, columns: Sequence[str]) -> tuple[Trial, ...]:
    """Return the third set of trials."""
    robot = robot_as_written(folders.answer / TRUTH)
    trials = []
    for path in sorted(folders.answer.glob("aside_*.csv")):
        table = read_table(path)
        inputs = {name: values for name, values in table.columns.items() if name not in columns}
        outputs = {name: table.columns[name] for name in columns}
        trials.append(
            Trial(
                path.name,
                "heldout",
                read_inputs(robot, Table(table.time_s, inputs, str(path))),
                Table(table.time_s, outputs, str(path)),
            )
        )
    return tuple(trials)


def _answer(made: Made) -> dict[str, Any]:
    setting, hidden = made.setting, made.hidden
    noise = {unit_of(name): float(size) for name, size in zip(setting.columns, setting.noise, strict=True)}
    return {
        "seed": made.seed,
        "index": made.index,
        "story": made.story,
        "robot": made.robot,
        "effects": hidden.effects,
        "outside": hidden.outside_name,
        "outside_size": None if hidden.outside is None else hidden.outside.size,
        "outside_numbers": {} if hidden.outside is None else hidden.outside.numbers,
        "sizes_over_noise": hidden.sizes,
        "simulated_size_over_noise": made.size,
        "noise": noise,
        "gap": made.gap,
        "gap_with": made.gap_with,
        "calibration": setting.factors,
        "rows": sum(len(inputs) for inputs in setting.trials),
        "refused": made.refused,
    }


def _table(robot: RobotSpec, inputs: Inputs, columns: Sequence[str], outputs: Array) -> Table:
    """Return a trial as a file's table: channels' inputs, then outputs."""
    values = channel_inputs(robot, inputs)
    names = input_channels(robot)
    found = {name: values[:, index] * (1.0 / si_factor(name)) for index, name in enumerate(names)}
    found |= {name: outputs[:, index] for index, name in enumerate(columns)}
    return Table(inputs.time_s, found)
