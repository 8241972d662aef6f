"""What is fitted: trials, columns, weights, terms, and what is known of their numbers before."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Parameter
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.nuisance import Nuisance
from catheter_sim.diagnosis.trials import Trial, beginnings
from catheter_sim.effects import EFFECTS
from catheter_sim.theory.twins import Predict

ROWS_TO_CHOOSE_BY = 600
"""[rows] About this many are compared to choose between hypotheses. Why: more rows of the same cycles cost
time and say nothing new. The chosen hypothesis is fitted to all rows."""
SECONDS_TO_CHOOSE_BY = 10.0
"""[s] The same for data taken in motion, for the trials' beginnings together. Why: a simulated second costs
time, not a row. A few seconds of each trial hold several swings of a robot."""
SECONDS_BESIDE_SWINGS = 36.0
"""[s] The same for two recordings whose difference is mostly what no command explains. Why: 10 s of a real
trunk's recordings told a weight from a gain by chance. 36 s told 100 g from it by a tenth of the error."""

# ----------------------------------------------------------------------------------------------------
# A hypothesis about what is wrong: effects whose parameters are fitted, and the trials to fit.
#
# A hypothesis is a set of terms, each an effect with the parameters that are freed; the empty set is the
# model without causes, its nuisance parameters calibrated. Every number is in units of a change that
# matters (`Parameter.scale`).


@dataclass(frozen=True)
class Term:
    """An effect and the names of its parameters that are fitted."""

    effect: str
    free: tuple[str, ...]


@dataclass(frozen=True)
class FittedNumber:
    """One fitted number: a parameter of an effect, or a nuisance (then `effect` is empty).

    `spread` is its standard deviation about `parameter.null` known beforehand, inf where there is none.
    """

    effect: str
    parameter: Parameter
    spread: float = math.inf

    @property
    def key(self) -> tuple[str, str]:
        """Effect and parameter name."""
        return self.effect, self.parameter.name


@dataclass(frozen=True)
class Problem:
    """What stays the same for every hypothesis.

    Attributes:
        robot: as specified.
        nuisances: its known-uncertain numbers.
        trials: to fit.
        columns: outputs compared.
        weight: size of a residual per column that counts as one, shape (o,), in file units.
        twin: robots and inputs to outputs.
        every: each so-many-th row is compared; the others still make the history.
        moving: the robot moved while it was measured; otherwise each row was held.
        model_share: share of the error without causes that a right cause may leave, beside the noise.
        interleaved: what is left out of a fit by turns are short pieces between others, not whole stretches.
        repeatability: by how much a second recording of the same would differ, by unit, where that is known.
        resolution: step of the readings, by column that shows one.
    """

    robot: RobotSpec
    nuisances: tuple[Nuisance, ...]
    trials: tuple[Trial, ...]
    columns: tuple[str, ...]
    weight: Array
    twin: Predict
    every: int = 1
    moving: bool = False
    repeatability: Mapping[str, float] = field(default_factory=dict)
    resolution: Mapping[str, float] = field(default_factory=dict)
    model_share: float = 0.0
    interleaved: bool = False


def further_terms(robot: RobotSpec, effect: str, moving: bool = False) -> tuple[Term, ...]:
    """Return the ways in which the further forms of `effect` may be freed; arguments as of `terms_for`."""
    variants = EFFECTS[effect].variants(robot, moving, further=True)
    return tuple(Term(effect, names) for names in variants)


def terms_for(robot: RobotSpec, effect: str, moving: bool = False) -> tuple[Term, ...]:
    """Return the ways in which `effect` may be freed for `robot` at first, simplest first.

    `moving`: of data that were taken while it moved.
    """
    parameters = EFFECTS[effect].parameters(robot)
    if not parameters:
        return ()
    everything = tuple(item.name for item in parameters)
    return tuple(Term(effect, names or everything) for names in EFFECTS[effect].variants(robot, moving))


def in_other_forms(robot: RobotSpec, term: Term, moving: bool = False) -> tuple[tuple[str, Term], ...]:
    """Return the names of the other forms of a term's cause, each with a term for it; one whose form is freed
    in several ways has one of each. `moving` as of `terms_for`."""
    effect = EFFECTS[term.effect]
    mine = effect.form_of(robot, term.free)
    others = [form for form in effect.forms if form is not mine and (moving or not form.in_motion)]
    return tuple((form.name, Term(term.effect, names)) for form in others for names in form.freed(robot))


def fitted_numbers(problem: Problem, terms: Sequence[Term]) -> tuple[FittedNumber, ...]:
    """Return what is fitted for a hypothesis: nuisances not superseded, then its effects' parameters."""
    found = []
    named = {term.effect for term in terms}
    for nuisance in problem.nuisances:
        if named.isdisjoint(nuisance.superseded_by):
            found.append(FittedNumber("", nuisance.parameter, nuisance.spread))
    for term in terms:
        given = problem.robot.effects.get(term.effect, {})
        for name in term.free:
            parameter = EFFECTS[term.effect].parameter(problem.robot, name)
            assert parameter is not None
            own = _moving(parameter) if problem.moving else parameter
            found.append(FittedNumber(term.effect, _as_given(own, given)))
    return tuple(found)


def _moving(parameter: Parameter) -> Parameter:
    """Return a parameter with the scale and the start that it has for a robot in motion."""
    if parameter.in_motion is None:
        return parameter
    scale, start = parameter.in_motion
    return replace(parameter, scale=scale, start=start)


def _as_given(parameter: Parameter, given: Mapping[str, float]) -> Parameter:
    """Return a parameter that changes nothing at the value that the robot's file gives it already, if any."""
    if parameter.name not in given:
        return parameter
    value = float(given[parameter.name])
    return replace(parameter, null=value, start=value)


def start_of(numbers: Sequence[FittedNumber], known: dict[tuple[str, str], float] | None = None) -> Array:
    """Return where a fit starts: `known` values, or each parameter's own start."""
    values = known or {}
    return np.array(
        [
            fitted.parameter.to_fit(values.get(fitted.key, fitted.parameter.start)) / fitted.parameter.scale
            for fitted in numbers
        ]
    )


def with_fewer_rows(problem: Problem) -> Problem:
    """Return `problem` with as few rows compared as a choice of hypotheses needs (`ROWS_TO_CHOOSE_BY`).

    Where the robot moves, time costs, not rows: only the beginnings of the trials are left
    (`SECONDS_TO_CHOOSE_BY`; of a model known to be wrong `SECONDS_BESIDE_SWINGS`).
    """
    if problem.moving:
        seconds = SECONDS_BESIDE_SWINGS if problem.model_share else SECONDS_TO_CHOOSE_BY
        problem = replace(problem, trials=beginnings(problem.trials, seconds))
    rows = sum(len(trial.inputs) for trial in problem.trials)
    return replace(problem, every=max(1, round(rows / ROWS_TO_CHOOSE_BY)))


def box_of(numbers: Sequence[FittedNumber]) -> tuple[Array, Array]:
    """Return the least and the largest values of fitted numbers in units of their scales, each (p,)."""
    bounds = np.array([fitted.parameter.fit_bounds for fitted in numbers]).reshape(-1, 2)
    scale = np.array([fitted.parameter.scale for fitted in numbers])
    return bounds[:, 0] / scale, bounds[:, 1] / scale


# ----------------------------------------------------------------------------------------------------
# What is known of calibrated numbers before anything is measured.


@dataclass(frozen=True)
class Prior:
    """Squares added for nuisances that leave their middle, in units of the residuals' weights.

    A nuisance is uniform in its range, so that its standard deviation is half_range / sqrt(3). Beside
    hundreds of measurements this decides only what they leave open: where a nuisance and a cause do the same,
    the cause moves.
    """

    middle: Array
    precision: Array

    def cost(self, x: Array) -> float:
        return float(self.precision @ (x - self.middle) ** 2)

    def gradient(self, x: Array) -> Array:
        return self.precision * (x - self.middle)


def prior_of(numbers: Sequence[FittedNumber]) -> Prior:
    scale = np.array([fitted.parameter.scale for fitted in numbers])
    spread = np.array([fitted.spread for fitted in numbers])
    known = np.isfinite(spread)
    middle = [fitted.parameter.to_fit(fitted.parameter.null) for fitted in numbers]
    return Prior(np.where(known, middle, 0.0) / scale, np.where(known, (scale / spread) ** 2, 0.0))
