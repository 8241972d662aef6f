"""Which experiment tells most of the causes that are still open, and which further sensor would."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import logsumexp

from catheter_sim.arrays import Array
from catheter_sim.channels import output_channels, read_inputs
from catheter_sim.diagnosis.comparison import rivals_of
from catheter_sim.diagnosis.fit import Fit, blocks_of, fit, linearised, predicted, robot_with
from catheter_sim.diagnosis.hypotheses import Scored
from catheter_sim.diagnosis.noise import outputs_of
from catheter_sim.diagnosis.problem import Problem, box_of, prior_of, with_fewer_rows
from catheter_sim.diagnosis.programmes import (
    Bench,
    Programme,
    loops,
    moving_programmes,
    programmes,
    programmes_within,
)
from catheter_sim.diagnosis.result import NEXT_EXPERIMENT_FILE, NONE, NextExperiment, Separation
from catheter_sim.diagnosis.thresholds import NATS_PER_MINUTE, SURE_BELIEF, TRUSTED_SHARE
from catheter_sim.diagnosis.trials import Trial, unit_of
from catheter_sim.diagnosis.verdict import replays
from catheter_sim.diagnosis.workers import SERIAL, OutOfTime, Workers, map_calls
from catheter_sim.effects import EFFECTS
from catheter_sim.errors import InputError
from catheter_sim.tables import Table
from catheter_sim.theory.twins import twin_for

TELLS_APART_NOISE = 2.0
"""[times the noise, root mean square] Inputs that separate two causes by this much tell them apart. Why:
assumed. Over hundreds of rows that is far beyond chance."""
ENOUGH_APART_NOISE = 10.0
"""[times the noise] A larger separation does not count for more. Why: inputs that separate several rivals
well win over those that separate one extremely well."""
ALIVE_BELIEF = 0.05
"""[probability] The best next experiment does not ask about a hypothesis below it. Why: a report shows none
below it either (`LEAST_SHOWN_PROBABILITY`)."""
IDLE_BELIEF = 0.02
"""[probability] If fewer than two hypotheses are alive, a cause that nothing speaks for gets this. Why: the
data may never have shown it, as single pulls show no play. About one in fifteen causes is at work."""
ROWS_AS_ONE = 4.0
"""[rows] This many count as one where information is computed. Why: rows of one stretch err together, by what
no hypothesis knows (assumed)."""
MOST_OF_STRETCH = 0.3
"""[nat] One stretch of an experiment may tell at most this much. Why: ten must agree before two equals are
separated with `SURE_BELIEF`. A diagnosis turns the signs of stretches (`PAYS_CHANCE`), and cuts one cycle
into several."""
INFORMATION_DRAWS = 200
"""[draws] Each hypothesis gives this many draws of data. Why: the information is then known to 0.03 nat."""
REFITTED_PROGRAMMES = 6
"""[programmes] For at most this many, every hypothesis is fitted again to what every other one predicts. Why:
assumed. Fits cost a hundred times what a derivative does, and mostly the first by derivatives stays the
first."""
SENSOR_WORTH = 0.1
"""[nat] One more sensor must tell this much beyond the proposed inputs to be mentioned. Why: assumed. It is a
seventh of what decides between two causes."""
MARKER_NOISE = {"mm": 0.2, "deg": 0.3, "N": 0.02}
"""[mm, deg, N] Noise of a further sensor, where no output of its unit is measured. Why: assumed. Such are the
trackers and load cells of the papers' benches."""

# ----------------------------------------------------------------------------------------------------
# Which hypotheses are still alive after a diagnosis, and how much each is believed.


@dataclass(frozen=True)
class Alive:
    """A hypothesis that is still alive.

    `about` is the cause, or "none", by which it differs from the others; `belief` its weight beside the
    others, which add up to one. No causes: the calibrated model.
    """

    causes: tuple[str, ...]
    about: str
    fit: Fit
    belief: float


def alive_hypotheses(
    believed: Mapping[str, float],
    chosen: Fit,
    equals: Sequence[Fit],
    tried: Sequence[Scored],
) -> tuple[Alive, ...]:
    """Return the hypotheses that are worth an experiment, most believed first.

    They are the chosen one. For each of its causes that is not sure, the best without it; and for each other
    cause that is believed at all, the best with it in a chosen one's place. Where fewer than two are left,
    single causes that the data have never asked about stand beside them, little believed.

    `believed`: the probability of every cause and "none"; `equals` explain the data as well, another cause in
    a chosen one's place; `tried`: every set of causes that was fitted.
    """
    named = set(chosen.causes)
    ordered = sorted(tried, key=lambda item: float(item.squares.sum()))
    found: list[Alive] = []

    def add(fit: Fit, about: str, belief: float) -> None:
        causes = tuple(sorted(fit.causes))
        if belief >= ALIVE_BELIEF and all((item.causes, item.about) != (causes, about) for item in found):
            found.append(Alive(causes, about, fit, belief))

    if named:
        weakest = min(named, key=lambda name: believed.get(name, 0.0))
        add(chosen, weakest, believed.get(weakest, 0.0))
        for gone, come, fit in rivals_of(chosen, sorted(equals, key=lambda item: item.cross_validated_rms)):
            about = come if come != gone else f"{come}, other numbers"
            if all(item.about != about for item in found):
                add(fit, about, believed.get(come, 0.0))
    for name in EFFECTS:
        if name in named or any(item.about == name for item in found):
            continue
        mine = [
            item.fit for item in ordered if name in item.causes and len(item.causes) <= max(len(named), 1)
        ]
        if mine:
            add(mine[0], name, believed.get(name, 0.0))
    for name in named:
        without = [item.fit for item in ordered if name not in item.causes]
        doubt = 1.0 - believed.get(name, 0.0) - sum(item.belief for item in found if name not in item.causes)
        if without and all(item.fit is not without[0] for item in found):
            add(without[0], NONE if not without[0].causes else "+".join(without[0].causes), doubt)
    if not named:
        nulls = [item.fit for item in ordered if not item.causes]
        add(nulls[0], NONE, max(believed.get(NONE, 0.0), ALIVE_BELIEF))
    if len(found) < 2:
        for item in ordered:
            if len(item.causes) == 1 and item.causes[0] not in named:
                found.append(Alive(item.causes, item.causes[0], item.fit, IDLE_BELIEF))
    total = sum(item.belief for item in found)
    shares = [Alive(item.causes, item.about, item.fit, item.belief / total) for item in found]
    return tuple(sorted(shares, key=lambda item: -item.belief))


# ----------------------------------------------------------------------------------------------------
# How much an experiment would tell: the information between "which hypothesis" and the data that it gives.
#
# Each hypothesis h predicts the data of a programme as a normal distribution N(m_h, S_h): its mean with the
# numbers fitted so far, and the covariance S_h = s^2 I + J C J^T + (t d)(t d)^T, of the noise s, of what
# the fit leaves open of its numbers (covariance C, derivative J), and of a share t by which no correction
# of the model, d = m_h - m_0, is trusted (`TRUSTED_SHARE`). The information I(h; y) of hypothesis and data
# (Lindley 1956) is what the best reader of the data would learn. Here it is what a diagnosis would learn,
# which is less:
#
# I(h; y) >= sum_h w_h E_(y|h) [ln q(h|y) - ln w_h] [nat]
#
# for any reader q (Barber and Agakov 2003), of weights w. Ours reads as the diagnosis does: every
# hypothesis g is refitted to the data, so that it errs only by what it cannot follow,
#
# ln q(g|y) = ln w_g - sum_b min(e_gb - min_k e_kb, E) - (f_g + p_g) / 2 + const
#
# with e_gb half the squared error left in stretch b over the noise, f_g the squares of how far its numbers
# had to go from where they were, and p_g how many numbers the data then settle. Rows of one stretch err
# together, so that no stretch tells more than E (`MOST_OF_STRETCH`), and hypotheses that follow one another
# everywhere are never told apart, also where one of them has more numbers. The mean is taken over draws.


@dataclass(frozen=True)
class Predictive:
    """What a hypothesis says of an experiment's data, in units of the noise.

    `mean` (n,), and the directions `spread` (n, q) in which it is unsure, each times its standard deviation.
    """

    mean: Array
    spread: Array


@dataclass(frozen=True)
class Information:
    """What an experiment is expected to tell.

    `nats` between hypothesis and data, as a diagnosis would read them; `decided`, the probability that one
    hypothesis then stands at `SURE_BELIEF` or more.
    """

    nats: float
    decided: float


def information(
    weights: Sequence[float],
    predicted: Sequence[Predictive],
    stretch: np.ndarray,
    seed: int = 0,
    draws: int = INFORMATION_DRAWS,
) -> Information:
    """Return what data would tell about hypotheses.

    `weights`: their probabilities, shape (k,), which add up to one; `predicted`: what each says, all of the
    same n values; `stretch`: which stretch each value belongs to, shape (n,); `draws`: of data of each
    hypothesis.
    """
    prior = np.asarray(weights, dtype=float)
    readers = [_Reader(item, stretch) for item in predicted]
    generator = np.random.default_rng(seed)
    noise = generator.normal(size=(draws, len(stretch)))
    gain, decided = 0.0, 0.0
    for index, weight in enumerate(prior):
        own = predicted[index]
        unsure = generator.normal(size=(draws, own.spread.shape[1]))
        posterior = _posterior(prior, readers, own.mean + unsure @ own.spread.T + noise)
        gain += weight * float(np.mean(np.log(np.maximum(posterior[index], 1e-300)) - np.log(weight)))
        decided += weight * float(np.mean(posterior.max(axis=0) >= SURE_BELIEF))
    return Information(max(float(gain), 0.0), float(decided))


def from_refits(weights: Sequence[float], errors: Sequence[Sequence[Array]]) -> Information:
    """Return what data would tell, from how far each hypothesis errs that was fitted to another one's data.

    The noise is left out: where linear information says too much, since numbers go further than their
    derivatives hold, this says so. `errors[h][g]`: of data of hypothesis h, fitted by g, half the squared
    errors by stretch over the noise, shape (b,); `weights`: of the hypotheses, shape (k,).
    """
    prior, gain, decided = np.asarray(weights, dtype=float), 0.0, 0.0
    for index, row in enumerate(errors):
        posterior = _posterior_of(prior, np.stack(row)[:, None, :], np.zeros(len(prior)))[:, 0]
        gain += prior[index] * float(np.log(max(posterior[index], 1e-300) / prior[index]))
        decided += prior[index] * float(posterior.max() >= SURE_BELIEF)
    return Information(max(float(gain), 0.0), float(decided))


class _Reader:
    """A hypothesis that is refitted to data."""

    def __init__(self, predicted: Predictive, stretch: np.ndarray) -> None:
        self._predicted = predicted
        labels = np.unique(stretch, return_inverse=True)[1]
        self._in_stretch = np.eye(int(labels.max()) + 1)[labels]
        square = predicted.spread.T @ predicted.spread
        self._solve = np.linalg.solve(np.eye(len(square)) + square, predicted.spread.T)
        self.settles = float(np.trace(self._solve @ predicted.spread))

    def __call__(self, data: Array) -> tuple[Array, Array]:
        """Return half the squared errors by stretch (d, b) and the squares of how far numbers went (d,)."""
        off = data - self._predicted.mean
        moved = off @ self._solve.T
        left = off - moved @ self._predicted.spread.T
        return 0.5 * left**2 @ self._in_stretch, (moved**2).sum(axis=1)


def _posterior(prior: Array, readers: Sequence[_Reader], data: Array) -> Array:
    """Return the probability of each hypothesis for rows of data, shape (k, d)."""
    read = [reader(data) for reader in readers]
    beside = np.stack([0.5 * (far + reader.settles) for (_, far), reader in zip(read, readers, strict=True)])
    return _posterior_of(prior, np.stack([errors for errors, _ in read]), beside)


def _posterior_of(prior: Array, errors: Array, beside: Array) -> Array:
    """Return probabilities, shape (k, d).

    `prior` has the shape (k,), half the squared `errors` by stretch (k, d, b), what else speaks against each,
    `beside`, (k, d) or (k,).
    """
    against = np.minimum(errors - errors.min(axis=0), MOST_OF_STRETCH).sum(axis=-1)
    beside = beside.reshape(len(prior), -1)
    against = against + np.minimum(beside - beside.min(axis=0), MOST_OF_STRETCH)
    logs = np.log(np.maximum(prior, 1e-300))[:, None] - against
    return np.asarray(np.exp(logs - logsumexp(logs, axis=0)))


# ----------------------------------------------------------------------------------------------------
# What a hypothesis says of a programme, how sure it is of it, and what the programme so tells.


def information_of(
    problem: Problem, hypotheses: Sequence[Alive], programme: Programme, noise: Array
) -> Information | None:
    """Return what a programme tells; None where a hypothesis cannot follow it."""
    inputs = playable(problem, programme)
    if inputs is None:
        return None
    trials = [as_said(problem, item.fit, inputs) for item in hypotheses]
    if any(trial is None for trial in trials):
        return None
    plain = _without_causes(problem, hypotheses, inputs)
    predictives = [
        _predictive(problem, item.fit, trial, noise, plain)
        for item, trial in zip(hypotheses, trials, strict=True)
        if trial is not None
    ]
    stretch = stretches_of(problem, trials[0])
    return information([item.belief for item in hypotheses], predictives, stretch)


def stretches_of(problem: Problem, trial: Trial | None) -> np.ndarray:
    """Return the stretch of each output of a trial as a diagnosis of it with the data so far would cut it."""
    assert trial is not None
    measured = problem.columns[:1]  # the trials so far have not measured what a further sensor would
    together = replace(problem, trials=(*problem.trials, trial), every=1, columns=measured)
    return np.repeat(blocks_of(together)[-len(trial.inputs) :], len(problem.columns))


def playable(problem: Problem, programme: Programme) -> Trial | None:
    robot = replace(problem.robot, actuation=problem.trials[0].inputs.actuation)
    try:
        inputs = read_inputs(robot, programme.table)
    except InputError:
        return None
    return Trial(NEXT_EXPERIMENT_FILE, "train", inputs, Table(inputs.time_s, {}, NEXT_EXPERIMENT_FILE))


def played(problem: Problem, result: Fit, programme: Programme) -> Trial | None:
    """Return a programme as a trial with the outputs that a hypothesis says; None: it cannot follow it."""
    inputs = playable(problem, programme)
    return None if inputs is None else as_said(problem, result, inputs)


def as_said(problem: Problem, result: Fit, trial: Trial) -> Trial | None:
    """Return a trial with the outputs that a hypothesis says; None where it finds no posture."""
    try:
        outputs = predicted(problem, result.numbers, result.x, trial.inputs)
    except InputError:
        return None
    if not np.isfinite(outputs).all():
        return None
    columns = {name: outputs[:, index] for index, name in enumerate(problem.columns)}
    return replace(trial, outputs=Table(trial.inputs.time_s, columns, NEXT_EXPERIMENT_FILE))


def said(problem: Problem, trial: Trial) -> Array:
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
    mean = said(problem, trial)
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


# ----------------------------------------------------------------------------------------------------
# Whether fits confirm what a programme tells: every hypothesis fitted to what every other one says of it.


def by_fits(
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
    trial = played(problem, truth, programme)
    if trial is None:
        return np.zeros(1)
    together = replace(problem, trials=(*problem.trials, trial))
    again = fit(together, other.terms, other.values, cross_validate=False)
    labels = np.unique(stretches_of(problem, trial), return_inverse=True)[1]
    outputs = as_said(problem, again, trial)
    if outputs is None:
        return np.zeros(int(labels.max()) + 1)
    apart = ((said(problem, outputs) - said(problem, trial)) / noise).reshape(-1)
    return np.asarray(0.5 * np.bincount(labels, weights=apart**2) / ROWS_AS_ONE)


def off_by(
    problem: Problem, hypotheses: Sequence[Alive], programme: Programme, noise: Array
) -> dict[str, float]:
    """Return by how much rivals, refitted to all data and the programme, are off, over the noise."""
    trial = played(problem, hypotheses[0].fit, programme)
    if trial is None:
        return {}
    found = {}
    for item in hypotheses[1:]:
        together = replace(problem, trials=(*problem.trials, trial))
        again = fit(together, item.fit.terms, item.fit.values, cross_validate=False)
        outputs = as_said(problem, again, trial)
        if outputs is not None:
            found[item.about] = _apart(said(problem, outputs), said(problem, trial), noise)
    return found


# ----------------------------------------------------------------------------------------------------
# What one more sensor would tell: a further marker, angles of the joints, tensions of the tendons.


@dataclass(frozen=True)
class Sensor:
    """Something more to measure.

    It gives the output `columns`; `nats` is the information of the best programme with it.
    """

    words: str
    columns: tuple[str, ...]
    nats: float


def sizes_of(columns: Sequence[str], noise: Mapping[str, float]) -> Array:
    """Return the noise of each column, shape (o,), in its unit; of one that is not measured, a usual one."""
    units = [unit_of(name) for name in columns]
    return np.array([noise.get(unit) or MARKER_NOISE.get(unit, 1.0) for unit in units])


def further_sensors(
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
        size = sizes_of(extended.columns, noise)
        more = information_of(extended, hypotheses, programme, size)
        if more is not None and more.nats > before + SENSOR_WORTH:
            found.append(Sensor(words, columns, more.nats))
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


# ----------------------------------------------------------------------------------------------------
# The best next experiment: of what a bench can play, what tells most between the hypotheses still alive.
#
# The information of each programme (`information`) less a price for its duration (`NATS_PER_MINUTE`). For
# the best one, whether one more sensor would tell more; and, as in `propose`, by how much each rival,
# refitted to the data and to what the most believed one says of the programme, would still be off.


@dataclass(frozen=True)
class Worth:
    """A programme with what it is expected to tell.

    `score` is the information less the price of the duration [nat].
    """

    programme: Programme
    minutes: float
    information: Information
    score: float


@dataclass(frozen=True)
class BestExperiment:
    """The experiment to make next.

    Attributes:
        hypotheses: those that it is to tell apart.
        ranking: every programme that could be played, best first; (): none could.
        sensors: what one more sensor would tell with the best one, most first; only what is worth it.
        off: by how many times the noise each other hypothesis, refitted, would be off on the best
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

    `noise` is the floor of each unit, `price` that of a minute [nat].
    """
    choices = programmes_within(bench)
    size = sizes_of(problem.columns, noise)
    work = [(problem, tuple(hypotheses), item, size) for item in choices]
    worths = []
    for programme, found in zip(choices, map_calls(pool, information_of, work), strict=True):
        if found is not None:
            minutes = float(programme.table.time_s[-1] - programme.table.time_s[0]) / 60.0
            worths.append(Worth(programme, minutes, found, found.nats - price * minutes))
    worths.sort(key=lambda item: -item.score)
    if not worths:
        return BestExperiment(tuple(hypotheses), ())
    worths = _checked_by_fits(problem, tuple(hypotheses), worths, size, price, pool)
    best = worths[0].programme
    sensors = further_sensors(problem, hypotheses, best, noise, gravity_mps2, worths[0].information.nats)
    return BestExperiment(tuple(hypotheses), tuple(worths), sensors, off_by(problem, hypotheses, best, size))


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
        found = by_fits(problem, hypotheses, item.programme, noise, pool)
        least = min(found, item.information, key=lambda one: one.nats)
        ranking.append(Worth(item.programme, item.minutes, least, least.nats - price * item.minutes))
        ranking.sort(key=lambda one: -one.score)
        done.add(item.programme.words)
    return ranking


# ----------------------------------------------------------------------------------------------------
# What to measure next: inputs that tell rivals apart, tried in the twin and the simulation, or words.
#
# Causes that explain the measurements equally well may differ on other inputs. The twin plays each series
# of inputs (`programmes`) with the chosen causes. The rival is then refitted to the measurements *and*
# to that series, so that only what it cannot follow counts. The series on which the rival errs most is
# proposed, and both are simulated on it.

_LOOPS = (
    "The CSV drives each channel alone through a full loop, a half loop and a reversal on the way. Then it "
    "repeats the first channel's loops: the repeat shows noise, drift and random slip."
)


def next_experiment(
    problem: Problem,
    chosen: Fit,
    likeliest: Sequence[str],
    equals: Sequence[Fit],
    groups: Sequence[Sequence[str]],
    noise: Array,
    gravity_mps2: Array,
    simulation: bool = True,
    pool: Workers = SERIAL,
    deadline: float = math.inf,
) -> NextExperiment:
    """Return what to measure next.

    `chosen` is the hypothesis of the verdict, `likeliest` its causes and corrections, the most probable
    first. `equals` explain the data as well, with another effect in the place of one of its. `groups` are
    effects that these data cannot tell apart, the chosen one first. `noise`: of each output column, shape
    (o,), in file units; `gravity_mps2`: in the base frame, shape (3,) [m/s^2]; `deadline`: on the clock of
    `time.monotonic` [s], after which no inputs are tried any more. New inputs stay inside the training
    trials' range.
    """
    if not groups:
        checking = advice(likeliest[:1], f"To check {_said(likeliest[:1])}: ")
        table = loops(problem.robot, problem.trials)
        return NextExperiment(f"{checking} {_LOOPS}".strip(), table)
    rivals = _rivals(chosen, equals)
    choices = moving_programmes if problem.moving else programmes
    possible = [item for item in choices(problem.robot, problem.trials) if played(problem, chosen, item)]
    if not possible:  # the twin follows none of them
        return _in_words(groups)
    few = with_fewer_rows(replace(problem, model_share=0.0))  # a plan needs no more of a motion than that
    work = [(few, chosen, rival, item, noise) for item in possible for rival in rivals.values()]
    try:
        found = map_calls(pool, _refitted, work, deadline)
    except OutOfTime:
        return _in_words(groups)
    apart = np.array([size for _, size in found]).reshape(len(possible), len(rivals))
    best = int(np.argmax(np.minimum(apart, ENOUGH_APART_NOISE).sum(axis=1)))
    trial = played(problem, chosen, possible[best])
    assert trial is not None
    refits = [item for item, _ in found[best * len(rivals) : (best + 1) * len(rivals)]]
    simulated = [float("nan")] * len(rivals)
    if simulation and apart[best].max() >= TELLS_APART_NOISE:
        robots = [robot_with(problem, item.numbers, item.x) for item in (chosen, *refits)]
        runs = [(robot, [trial], problem.columns, gravity_mps2, SERIAL, problem.moving) for robot in robots]
        outputs = [item[0].outputs for item in map_calls(pool, replays, runs)]
        simulated = [_apart(outputs[0], other, noise) for other in outputs[1:]]
    checked = {
        name: Separation(float(twin), float(again))
        for name, twin, again in zip(rivals, apart[best], simulated, strict=True)
    }
    sentences = [f"Play the CSV: {possible[best].words}."] if apart[best].max() >= TELLS_APART_NOISE else []
    sentences += [_group_words(group, checked) for group in groups]
    return NextExperiment(" ".join(sentences), possible[best].table, checked)


def _in_words(groups: Sequence[Sequence[str]]) -> NextExperiment:
    """Return how groups of effects are told apart by other means than by inputs."""
    words = [advice(group, f"To tell {_said(group)} apart: ") for group in groups]
    return NextExperiment(" ".join(item for item in words if item))


def advice(names: Sequence[str], before: str = "") -> str:
    """Return how to tell effects apart by other means, after the words `before`; "" where none is known.

    The effects' own advice is looked through from the measurement back to the command.
    """
    wanted = min(2, len(names))
    for effect in reversed(list(EFFECTS.values())):
        for others, words in effect.advice.items():
            if names and len({effect.name, *others} & set(names)) >= wanted:
                return before + words
    return ""


def _group_words(group: Sequence[str], checked: dict[str, Separation]) -> str:
    """Return what the proposed inputs would show of one group, and what else to do where they show
    nothing."""
    first, *others = group
    apart = [name for name in others if checked[_for(name, first)].twin >= TELLS_APART_NOISE]
    words = []
    for name in apart:
        item = checked[_for(name, first)]
        simulated = item.simulation
        again = f", {simulated:.1f} times in the simulation" if np.isfinite(simulated) else ""
        words.append(
            f"If the cause is {_said([first])}, a refitted {_said([name])} would miss the new data by "
            f"{item.twin:.1f} times the noise{again}."
        )
    left = [name for name in others if name not in apart]
    if left:
        alone = advice([first, *left]) or "Measure more of the robot: points along it, or tensions."
        words.append(f"None of the inputs that were tried tells {_said([first])} from {_said(left)}. {alone}")
    return " ".join(words)


def _said(names: Sequence[str]) -> str:
    return " or ".join(name.replace("_", " ") for name in names)


def _for(rival: str, first: str) -> str:
    return f"{rival} for {first}"


def _rivals(chosen: Fit, equals: Sequence[Fit]) -> dict[str, Fit]:
    """Return the best of the fits in which one effect stands in the place of another, by both names."""
    found: dict[str, Fit] = {}
    for gone, come, item in rivals_of(chosen, sorted(equals, key=lambda other: other.cross_validated_rms)):
        found.setdefault(_for(come, gone), item)
    return found


def _refitted(
    problem: Problem, chosen: Fit, rival: Fit, programme: Programme, noise: Array
) -> tuple[Fit, float]:
    """Return a rival fitted to measurements and a programme, and its error on the programme over the
    noise."""
    trial = played(problem, chosen, programme)
    assert trial is not None
    result = fit(
        replace(problem, trials=(*problem.trials, trial)), rival.terms, rival.values, cross_validate=False
    )
    return result, _apart(outputs_of(problem, trial, result), said(problem, trial), noise)


def _apart(first: Array, second: Array, noise: Array) -> float:
    """Return the root mean square difference of outputs (r, o) in units of the noise; 0 where none is
    finite."""
    difference = (first - second) / noise
    difference = difference[np.isfinite(difference)]
    return float(np.sqrt(np.mean(difference**2))) if len(difference) else 0.0
