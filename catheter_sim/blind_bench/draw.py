"""Draws what a data set hides: a robot, a story, sizes, inputs, noise and errors of calibration.

The seed and the number of the draw decide everything. Stories are dealt in blocks of twenty: ten single
effects, four pairs, three times nothing and three causes outside the list; robots in blocks of all robots.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.histories import history
from catheter_sim.blind_bench.makers import CannotMake, Simulated, twin_outputs
from catheter_sim.blind_bench.outside import OUTSIDE, Outside, drawn_numbers
from catheter_sim.blind_bench.robots import BENCH_ROBOTS, BenchRobot, bench_robot
from catheter_sim.blind_bench.sizes import (
    LARGEST,
    SMALLEST,
    Direction,
    amplitude_for,
    drawn_direction,
    over_noise,
)
from catheter_sim.channels import drives_of
from catheter_sim.core.drive import Quantity
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.nuisance import Nuisance, nuisances_of
from catheter_sim.diagnosis.trials import unit_of
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import with_effects

STORIES = ("single",) * 10 + ("pair",) * 4 + ("none",) * 3 + ("outside",) * 3
TRAINING, HELDOUT, ASIDE = 4, 2, 3  # trials; one more repeats a training trial
_RICH = 0.6  # share of the trials, the first of each part aside, which is
_MANY = 0.25  # share of the data sets with many points measured
NOISE = {"mm": (0.05, 0.3), "deg": (0.1, 0.5)}  # of the data sets to the nominal specification
_ATTEMPTS = 40
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
    for _ in range(_ATTEMPTS):
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
    for _ in range(_ATTEMPTS):
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
