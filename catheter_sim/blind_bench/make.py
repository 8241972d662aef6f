"""Makes a draw's data by the simulation, and keeps the noise above what the twin itself gets wrong.

The twin that will diagnose and the simulation that makes the data differ a little with every effect off,
and a little with the hidden effects on. Neither may reach more than `GAP_SHARE` of the noise: a draw in
which it does gets more noise, up to `MOST_NOISE`, or is drawn again. So is an effect of which calibrated
numbers, within their ranges, leave less than `SMALLEST` times the noise, and a pair of which one, fitted
alone, does what both do to within that share: no data would show the other. What was refused is kept.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.alike import TOLD_APART, distance
from catheter_sim.blind_bench.draw import (
    TRAINING,
    Hidden,
    Setting,
    hidden_of,
    robot_of,
    setting_of,
    story_of,
    superseded,
    truth,
    twin_of,
)
from catheter_sim.blind_bench.makers import CannotMake, Simulated, rms, simulated
from catheter_sim.blind_bench.outside import Outside, RandomSlip
from catheter_sim.blind_bench.robots import BENCH_ROBOTS
from catheter_sim.blind_bench.sizes import LARGEST, SMALLEST, over_noise
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.nuisance import nuisances_of
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.trials import Trial, unit_of
from catheter_sim.tables import Table
from catheter_sim.theory.predict import twin_for

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
