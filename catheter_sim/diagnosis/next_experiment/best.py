"""The best next experiment: of what a bench can play, what tells most between the hypotheses still alive.

The information of each programme (`information`) less a price for its duration (`NATS_PER_MINUTE`). For the
best one, whether one more sensor would tell more; and, as in `propose`, by how much each rival, fitted anew
to the data and to what the most believed one says of the programme, would still be off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from catheter_sim.channels import output_channels, read_inputs
from catheter_sim.core.posture import Array
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.least_squares import linearised
from catheter_sim.diagnosis.fitting.prediction import predicted
from catheter_sim.diagnosis.fitting.prior import prior_of
from catheter_sim.diagnosis.fitting.problem import Problem, box_of
from catheter_sim.diagnosis.fitting.stretches import blocks_of
from catheter_sim.diagnosis.fitting.workers import SERIAL, Workers, map_calls
from catheter_sim.diagnosis.next_experiment.alive import Alive
from catheter_sim.diagnosis.next_experiment.information import (
    Information,
    Predictive,
    from_refits,
    information,
)
from catheter_sim.diagnosis.next_experiment.programmes import Programme
from catheter_sim.diagnosis.next_experiment.within_limits import Bench, programmes_within
from catheter_sim.diagnosis.report.result import NEXT_EXPERIMENT_FILE
from catheter_sim.diagnosis.thresholds import (
    MARKER_NOISE,
    NATS_PER_MINUTE,
    REFITTED_PROGRAMMES,
    ROWS_AS_ONE,
    TRUSTED_SHARE,
)
from catheter_sim.errors import InputError
from catheter_sim.tables import Table
from catheter_sim.theory.predict import twin_for

_ADVANTAGE = 0.1  # nat that a further sensor must tell more to be worth a word


@dataclass(frozen=True)
class Worth:
    """A programme with what it is expected to tell.

    Attributes:
        programme: the inputs.
        minutes: its duration.
        information: between hypothesis and data.
        score: the information less the price of the duration [nat].
    """

    programme: Programme
    minutes: float
    information: Information
    score: float


@dataclass(frozen=True)
class Sensor:
    """Something more to measure.

    Attributes:
        words: what it is.
        columns: the output columns that it gives.
        nats: information of the best programme with it.
    """

    words: str
    columns: tuple[str, ...]
    nats: float


@dataclass(frozen=True)
class BestExperiment:
    """The experiment to make next.

    Attributes:
        hypotheses: those that it is to tell apart.
        ranking: every programme that could be played, best first; (): none could.
        sensors: what one more sensor would tell with the best one, most first; only what is worth it.
        off: by how many times the noise each other hypothesis, fitted anew, would be off on the best
            programme if the most believed one were right, by what it is about.
    """

    hypotheses: tuple[Alive, ...]
    ranking: tuple[Worth, ...]
    sensors: tuple[Sensor, ...] = ()
    off: Mapping[str, float] = field(default_factory=dict)

    @property
    def best(self) -> Worth:
        """The first of the ranking."""
        return self.ranking[0]


def best_experiment(
    problem: Problem,
    hypotheses: Sequence[Alive],
    bench: Bench,
    noise: Mapping[str, float],
    gravity_mps2: Array,
    price: float = NATS_PER_MINUTE,
    pool: Workers = SERIAL,
) -> BestExperiment:
    """Return the experiment that tells most between hypotheses.

    Args:
        problem: the training trials so far.
        hypotheses: those alive, fitted to them.
        bench: what can be played.
        noise: floor of each unit, in it.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        price: of a minute [nat].
        pool: where to compute.
    """
    choices = programmes_within(bench)
    size = np.array(
        [noise.get(unit_of(name)) or MARKER_NOISE.get(unit_of(name), 1.0) for name in problem.columns]
    )
    work = [(problem, tuple(hypotheses), item, size) for item in choices]
    worths = []
    for programme, found in zip(choices, map_calls(pool, _told, work), strict=True):
        if found is not None:
            minutes = float(programme.table.time_s[-1] - programme.table.time_s[0]) / 60.0
            worths.append(Worth(programme, minutes, found, found.nats - price * minutes))
    worths.sort(key=lambda item: -item.score)
    if not worths:
        return BestExperiment(tuple(hypotheses), ())
    worths = _checked_by_fits(problem, tuple(hypotheses), worths, size, price, pool)
    best = worths[0].programme
    sensors = _further_sensors(problem, hypotheses, best, noise, gravity_mps2, worths[0].information.nats)
    return BestExperiment(tuple(hypotheses), tuple(worths), sensors, _off(problem, hypotheses, best, size))


def _told(
    problem: Problem, hypotheses: Sequence[Alive], programme: Programme, noise: Array
) -> Information | None:
    """Return what a programme tells; None where a hypothesis cannot follow it."""
    inputs = _inputs(problem, programme)
    if inputs is None:
        return None
    trials = [_as_said(problem, item.fit, inputs) for item in hypotheses]
    if any(trial is None for trial in trials):
        return None
    plain = _without_causes(problem, hypotheses, inputs)
    predictives = [
        _predictive(problem, item.fit, trial, noise, plain)
        for item, trial in zip(hypotheses, trials, strict=True)
        if trial is not None
    ]
    stretch = _stretches(problem, trials[0])
    return information([item.belief for item in hypotheses], predictives, stretch)


def _stretches(problem: Problem, trial: Trial | None) -> np.ndarray:
    """Return the stretch of each output of a trial as a diagnosis of it with the data so far would cut it."""
    assert trial is not None
    measured = problem.columns[:1]  # the trials so far have not measured what a further sensor would
    together = replace(problem, trials=(*problem.trials, trial), every=1, columns=measured)
    return np.repeat(blocks_of(together)[-len(trial.inputs) :], len(problem.columns))


def _checked_by_fits(
    problem: Problem,
    hypotheses: tuple[Alive, ...],
    worths: Sequence[Worth],
    noise: Array,
    price: float,
    pool: Workers,
) -> list[Worth]:
    """Return the ranking with information no more than fits confirm, of the first programmes.

    The first is fitted until the one that comes first has been.
    """
    ranking, done = list(worths), set()
    for _ in range(REFITTED_PROGRAMMES):
        if ranking[0].programme.words in done:
            break
        item = ranking.pop(0)
        found = _by_fits(problem, hypotheses, item.programme, noise, pool)
        told = min(found, item.information, key=lambda one: one.nats)
        ranking.append(Worth(item.programme, item.minutes, told, told.nats - price * item.minutes))
        ranking.sort(key=lambda one: -one.score)
        done.add(item.programme.words)
    return ranking


def _by_fits(
    problem: Problem, hypotheses: tuple[Alive, ...], programme: Programme, noise: Array, pool: Workers
) -> Information:
    """Return what a programme tells where every hypothesis is fitted to what every other one says of it."""
    count = range(len(hypotheses))
    pairs = [(h, g) for h in count for g in count if h != g]
    work = [(problem, hypotheses[h].fit, hypotheses[g].fit, programme, noise) for h, g in pairs]
    errors = dict(zip(pairs, map_calls(pool, _error_by_stretch, work), strict=True))
    stretches = max((len(item) for item in errors.values()), default=1)
    none = np.zeros(stretches)
    rows = [[none if h == g else np.resize(errors[h, g], stretches) for g in count] for h in count]
    return from_refits([one.belief for one in hypotheses], rows)


def _error_by_stretch(problem: Problem, truth: Fit, other: Fit, programme: Programme, noise: Array) -> Array:
    """Return half the squared error, by stretch, of a hypothesis fitted to the data and to another's outputs.

    Over the noise, rows counted as in `_predictive`; zero where it finds no posture.
    """
    inputs = _inputs(problem, programme)
    trial = None if inputs is None else _as_said(problem, truth, inputs)
    if trial is None:
        return np.zeros(1)
    together = replace(problem, trials=(*problem.trials, trial))
    again = fit(together, other.terms, other.values, cross_validate=False)
    labels = np.unique(_stretches(problem, trial), return_inverse=True)[1]
    said = _as_said(problem, again, trial)
    if said is None:
        return np.zeros(int(labels.max()) + 1)
    apart = ((_said(problem, said) - _said(problem, trial)) / noise).reshape(-1)
    return np.asarray(0.5 * np.bincount(labels, weights=apart**2) / ROWS_AS_ONE)


def _inputs(problem: Problem, programme: Programme) -> Trial | None:
    robot = replace(problem.robot, actuation=problem.trials[0].inputs.actuation)
    try:
        inputs = read_inputs(robot, programme.table)
    except InputError:
        return None
    return Trial(NEXT_EXPERIMENT_FILE, "train", inputs, Table(inputs.time_s, {}, NEXT_EXPERIMENT_FILE))


def _as_said(problem: Problem, result: Fit, trial: Trial) -> Trial | None:
    """Return a trial with the outputs that a hypothesis says; None where it finds no posture."""
    try:
        outputs = predicted(problem, result.numbers, result.x, trial.inputs)
    except InputError:
        return None
    if not np.isfinite(outputs).all():
        return None
    columns = {name: outputs[:, index] for index, name in enumerate(problem.columns)}
    return replace(trial, outputs=Table(trial.inputs.time_s, columns, NEXT_EXPERIMENT_FILE))


def _said(problem: Problem, trial: Trial) -> Array:
    return np.stack([trial.outputs.columns[name] for name in problem.columns], axis=1)


def _without_causes(problem: Problem, hypotheses: Sequence[Alive], trial: Trial) -> Array | None:
    """Return what a hypothesis without its causes says, shape (r, o): the most believed one's calibration."""
    result = hypotheses[0].fit
    kept = [index for index, item in enumerate(result.numbers) if not item.effect]
    numbers = tuple(result.numbers[index] for index in kept)
    outputs = predicted(problem, numbers, result.x[kept], trial.inputs)
    return outputs if np.isfinite(outputs).all() else None


def _predictive(problem: Problem, result: Fit, trial: Trial, noise: Array, plain: Array | None) -> Predictive:
    """Return what a hypothesis says of a trial, in units of the noise, with what it leaves open."""
    mean = _said(problem, trial)
    size = noise * np.sqrt(ROWS_AS_ONE)
    alone = replace(problem, trials=(trial,), every=1)
    low, high = box_of(result.numbers)
    spread = np.zeros((mean.size, 0))
    if len(result.numbers):
        slope = linearised(alone, result.numbers, result.x, high).jacobian
        slope = slope * np.broadcast_to(problem.weight / size, mean.shape).reshape(-1, 1)
        slope = np.where(np.isfinite(slope), slope, 0.0)
        spread = slope @ _open_directions(result, low, high)
    if plain is not None:
        doubt = TRUSTED_SHARE * ((mean - plain) / size).reshape(-1, 1)
        spread = np.concatenate([spread, doubt], axis=1)
    return Predictive((mean / size).reshape(-1), spread)


def _open_directions(result: Fit, low: Array, high: Array) -> Array:
    """Return the root of the covariance of a hypothesis's numbers after the data so far, shape (p, p).

    Where the data say nothing of a number it is uniform between its bounds, or as wide as is known of it.
    """
    known = prior_of(result.numbers).precision
    width = np.maximum(high - low, 1e-12)
    wide = np.where(np.isfinite(width), 12.0 / width**2, 0.0)
    residual = result.residual
    variance = max(float(residual @ residual) / max(len(residual) - len(result.numbers), 1), 1e-12)
    precision = result.jacobian.T @ result.jacobian / (ROWS_AS_ONE * variance)
    precision = precision + np.diag(np.where(known > 0.0, known, wide) + 1e-9)
    values, vectors = np.linalg.eigh(precision)
    return np.asarray(vectors / np.sqrt(np.maximum(values, 1e-12)))


def _off(
    problem: Problem, hypotheses: Sequence[Alive], programme: Programme, noise: Array
) -> dict[str, float]:
    """Return by how much rivals, fitted anew to all data and the programme, are off, over the noise."""
    inputs = _inputs(problem, programme)
    trial = None if inputs is None else _as_said(problem, hypotheses[0].fit, inputs)
    if trial is None:
        return {}
    found = {}
    for item in hypotheses[1:]:
        together = replace(problem, trials=(*problem.trials, trial))
        again = fit(together, item.fit.terms, item.fit.values, cross_validate=False)
        said = _as_said(problem, again, trial)
        if said is not None:
            apart = (_said(problem, said) - _said(problem, trial)) / noise
            found[item.about] = float(np.sqrt(np.mean(apart**2)))
    return found


def _further_sensors(
    problem: Problem,
    hypotheses: Sequence[Alive],
    programme: Programme,
    noise: Mapping[str, float],
    gravity_mps2: Array,
    before: float,
) -> tuple[Sensor, ...]:
    """Return the sensors that would tell more with a programme, most first."""
    found = []
    for words, columns in _sensors(problem).items():
        extended = _measuring(problem, (*problem.columns, *columns), gravity_mps2)
        size = np.array(
            [noise.get(unit_of(name)) or MARKER_NOISE.get(unit_of(name), 1.0) for name in extended.columns]
        )
        told = _told(extended, hypotheses, programme, size)
        if told is not None and told.nats > before + _ADVANTAGE:
            found.append(Sensor(words, columns, told.nats))
    return tuple(sorted(found, key=lambda item: -item.nats))


def _sensors(problem: Problem) -> dict[str, tuple[str, ...]]:
    """Return what may be measured besides, in words, with its columns."""
    known = output_channels(problem.robot)
    axes = sorted({name[-4] for name in problem.columns if name.startswith("tip_") and name.endswith("_mm")})
    bodies = max((int(name.split("_")[1]) for name in known if name.startswith("body_")), default=0)
    found = {}
    for place, share in (("a third of", 1 / 3), ("half", 1 / 2), ("two thirds of", 2 / 3)):
        body = max(1, round(share * bodies))
        columns = tuple(f"body_{body}_{axis}_mm" for axis in axes or "xyz")
        if bodies and not set(columns) & set(problem.columns):
            found[f"one more marker at body {body}, {place} the robot's length from its base"] = columns
    angles = tuple(name for name in known if name.startswith("angle_"))
    if angles and not set(angles) & set(problem.columns):
        found["an angle sensor at the joints"] = angles
    tensions = tuple(name for name in known if name.startswith("tension_"))
    if tensions and not set(tensions) & {*problem.columns}:
        found["a tension sensor at each tendon"] = tensions
    return found


def _measuring(problem: Problem, columns: tuple[str, ...], gravity_mps2: Array) -> Problem:
    """Return the problem with further outputs, which no trial so far has measured."""
    actuation = problem.trials[0].inputs.actuation
    twin = twin_for(problem.robot, actuation, columns, gravity_mps2)
    added = len(columns) - len(problem.columns)
    return replace(problem, columns=columns, weight=np.append(problem.weight, np.ones(added)), twin=twin)
