"""How probable every cause is, from what speaks for it on trials that no fit had seen."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.fit import Fit, column_of, fold_of
from catheter_sim.diagnosis.hypotheses import Scored, cost_of, stretch_sums, surety
from catheter_sim.diagnosis.noise import chance_of_gain
from catheter_sim.diagnosis.problem import Problem, with_fewer_rows
from catheter_sim.diagnosis.residuals import turning_points
from catheter_sim.diagnosis.result import NONE, OUTSIDE
from catheter_sim.diagnosis.thresholds import (
    DISCREPANCY_SURE,
    EQUAL_FACTOR,
    LARGEST_GROUP,
    LEAST_MEMBER_SHARE,
    MOST_SURE,
    PAYS_CHANCE,
)
from catheter_sim.diagnosis.trials import all_inputs, measured_of
from catheter_sim.effects import EFFECTS

DISCREPANCY_PRICES = (1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0)
"""[share of the rows] Prices of a smooth error's coefficients. The price that predicts best is taken. Why:
they go from nearly free coefficients to nearly none, a factor of ten apart. Finer steps change the prediction
by little."""
MOST_CROSSED_INPUTS = 4
"""[inputs] A smooth error may depend on the products of at most this many. Why: assumed. Eight inputs have
twenty-eight products, more than a short data set can price."""
IMPLAUSIBLE_BELIEVED = 0.15
"""[share of its probability] A cause whose numbers are not plausible keeps this much, and the rest goes to
"outside". Why: on data that other code had made, one of six such causes was at work. For the five others, the
cause was outside the list."""
MEMBER_WEIGHT = 0.7
"""[1/standard deviation] The share of a group's member falls at this rate, the more surely another cause does
better. Why: assumed. In three draws of the independent bench just one of two was at work, which says
little."""
MOST_RATIO = 1.5
"""[natural logarithm] A ratio of two errors beyond it says no more. Why: a cause without which the error is
four times as large is needed, whatever else is wrong."""
MOST_NUMBERS = 6
"""[fitted numbers] A larger difference between two hypotheses says no more. Why: assumed. A tracker's frame
has six."""
UNLISTED_SINGLES = 6
"""[single causes] This many of the best are tried with a smooth error beside them. Why: assumed. What
explains little alone leaves the smooth error to explain the rest."""
LOG_ODDS_OF_NAMED = (-0.61, 0.17, 2.62, 0.2, 0.1, -0.36, -1.09, -0.43, -0.55, 0.64)
"""[1, 1/standard deviation, 1/log, 1/number, 1/standard deviation, 1/log, 1/log, 1, 1, 1/log] Weights of the
evidence for a cause or group of the hypothesis (`probabilities.features_of_named`). Why: they are what was
believed before, changed by 98 draws (`scripts/calibrate_probabilities.py`). The draws are of the independent
bench (tuning seed 51), of the first bench (seed 61), of interventions (tuning seed 62), and six loads of a
real joint (`tests/diagnosis/test_wrist_changes.py`). Of 109 answers, 70 were right."""
LOG_ODDS_OF_RIVALS = (-3.8, 0.2, 0.51, -0.12)
"""[1, 1/standard deviation, 1/log, 1/number] The same for a cause that could stand in another's place
(`features_of_rival`). Why: from the same draws. Of 1124 answers, 11 were right."""
LOG_ODDS_OF_OTHERS = (-5.33,)
"""[1] The same for a cause that no good hypothesis has. Why: of 205 in the same draws none was at work (one
of each kind added)."""
LOG_ODDS_OF_OUTSIDE = (-4.56, 2.67, 0.45, 0.15, 0.47, 0.52)
"""[1, 1/log, 1/standard deviation, 1, 1, 1] The same for something outside the list (`features_of_outside`).
Why: from the same draws. Of 83 answers, 8 were right."""
LOG_ODDS_OF_NONE = (4.29, -3.87, -1.24)
"""[1, 1/log, 1/standard deviation] The same for no cause (`features_of_none`). Why: from the same draws. Of
98 answers, 23 were right."""

# ----------------------------------------------------------------------------------------------------
# Something else that is wrong: a smooth error of unknown cause, fitted to what a hypothesis leaves.
#
# What a model gets wrong without a name is described by functions of what was commanded: the inputs and
# their squares and products, the direction and the way since it turned, the time (Kennedy and O'Hagan 2001,
# with a linear basis in place of a Gaussian process). Each output has coefficients of its own, drawn
# towards zero (ridge regression); how strongly, the stretches left out of the fit decide. So it costs what
# it needs: where residuals are noise its coefficients stay at zero, and what it fits by accident does harm
# on other trials. Brynjarsdottir and O'Hagan 2014 show why it must stand beside causes, and never in their
# place.


def explained(train: Problem, residual: Array, block: np.ndarray, test: Problem) -> Array:
    """Return what a smooth error of unknown cause, fitted to training residuals, predicts on other trials.

    `residual` (n,) is what a hypothesis leaves on the training trials, which are thinned as it is, in
    weights, and `block` (n,) the stretch of each. So are those of `test` that are returned, shape (m,).
    """
    driven = _driven(train)
    basis = _rows(train, driven)
    centre, spread = basis.mean(axis=0), basis.std(axis=0)
    use = spread > 1e-9 * max(float(spread.max(initial=0.0)), 1e-300)
    here = _with_constant((basis[:, use] - centre[use]) / spread[use])
    there = _with_constant((_rows(test, driven)[:, use] - centre[use]) / spread[use])
    column, other_column = column_of(train), column_of(test)
    found = np.zeros(len(there))
    for index in range(len(train.columns)):
        mine, others = column == index, other_column == index
        if not mine.any() or not others.any():
            continue
        weights = _ridge(here[mine], residual[mine], block[mine])
        found[others] = there[others] @ weights
    return found


def _ridge(basis: Array, values: Array, block: np.ndarray) -> Array:
    """Return the coefficients whose price does best on stretches left out; none if that may be chance."""
    fold = fold_of(block)
    left = {price: values.copy() for price in DISCREPANCY_PRICES}
    for left_out in np.unique(fold):
        away = fold == left_out
        if away.all():
            return np.zeros(basis.shape[1])
        for price, weights in _solved(basis[~away], values[~away]).items():
            left[price][away] -= basis[away] @ weights
    price = min(left, key=lambda item: float(left[item] @ left[item]))
    if surety(stretch_sums(block, values), stretch_sums(block, left[price])) < DISCREPANCY_SURE:
        return np.zeros(basis.shape[1])
    return _solved(basis, values)[price]


def _solved(basis: Array, values: Array) -> dict[float, Array]:
    """Return the ridge coefficients for every price, a share of the rows' number."""
    normal, right = basis.T @ basis, basis.T @ values
    size, turn = np.linalg.eigh(normal)
    along = turn.T @ right
    size = np.maximum(size, 0.0)
    return {price: turn @ (along / (size + price * len(values))) for price in DISCREPANCY_PRICES}


def _with_constant(basis: Array) -> Array:
    return np.hstack([np.ones((len(basis), 1)), basis])


def _driven(problem: Problem) -> np.ndarray:
    """Return the input columns that move in the training trials, each of several equal ones once."""
    rows = np.concatenate([all_inputs(trial.inputs) for trial in problem.trials])
    moving = np.flatnonzero(np.ptp(rows, axis=0) > 0.0)
    _, first = np.unique(rows[:, moving], axis=1, return_index=True)
    return np.asarray(moving[np.sort(first)])


def _rows(problem: Problem, driven: np.ndarray) -> Array:
    """Return the functions' values at every residual of a problem, shape (n, f)."""
    parts = []
    for trial in problem.trials:
        finite = np.isfinite(measured_of(trial, problem.columns)[:: problem.every])
        values = _functions(trial.inputs, driven)[:: problem.every]
        row = np.broadcast_to(np.arange(len(values))[:, None], finite.shape)[finite]
        parts.append(values[row])
    return np.concatenate(parts)


def _functions(inputs: Inputs, driven: np.ndarray) -> Array:
    """Return what an unknown error may be made of at each row, shape (r, f)."""
    rows = all_inputs(inputs)[:, driven]
    time_s = (inputs.time_s - inputs.time_s[0])[:, None]
    turned = [turning_points(values) for values in rows.T]
    direction = np.stack([item[0] for item in turned], axis=1) if turned else rows
    way = np.stack([item[1] for item in turned], axis=1) if turned else rows
    pairs = list(combinations(range(min(rows.shape[1], MOST_CROSSED_INPUTS)), 2))
    crossed = [rows[:, [a]] * rows[:, [b]] for a, b in pairs]
    powers = [rows, rows**2, rows**3]
    turns = [direction, direction * rows, way, np.abs(way) * way]
    return np.hstack([*powers, *turns, *crossed, time_s, time_s * rows])


# ----------------------------------------------------------------------------------------------------
# Which causes the data cannot tell apart: each explains the stretches that it was not fitted to as well.


def alike_groups(
    hypotheses: Sequence[Scored], chosen: Sequence[str], equals: Sequence[tuple[str, str, Fit]]
) -> dict[str, dict[str, float]]:
    """Return, by causes of a hypothesis, those that the data cannot tell from it, with how surely it does
    better than each [standard deviations of chance].

    A member stands in a cause's place and explains the training and the held-out stretches together as well:
    its error is within `EQUAL_FACTOR`, and what it errs more may be chance (`PAYS_CHANCE`). At most
    `LARGEST_GROUP` have a place; of more, those that err least.

    `equals`: a cause of the hypothesis, another one in its place, and the hypothesis with that one.
    """
    by_causes = {item.causes: item for item in hypotheses}
    mine = by_causes[tuple(sorted(chosen))]
    found: dict[str, dict[str, Scored]] = {}
    taken: set[str] = set()
    for name, rival, item in sorted(equals, key=lambda entry: entry[2].cross_validated_rms):
        other = by_causes.get(tuple(sorted(item.causes)))
        if rival in chosen or rival in taken or other is None or not _explains_as_well(mine, other):
            continue
        group = found.setdefault(name, {})
        if len(group) < LARGEST_GROUP - 1:
            group[rival] = other
            taken.add(rival)
    return {
        name: {rival: surety(other.squares, mine.squares) for rival, other in group.items()}
        for name, group in found.items()
    }


def _explains_as_well(mine: Scored, other: Scored) -> bool:
    near = cost_of(other) <= EQUAL_FACTOR**2 * cost_of(mine)
    return near and chance_of_gain(other.squares - mine.squares) > PAYS_CHANCE


# ----------------------------------------------------------------------------------------------------
# What speaks for and against every cause, in numbers from trials that no fit had seen.
#
# All numbers are measures of `diagnosis.hypotheses.surety`: by how many standard deviations of chance one
# hypothesis does better than another, stretch by stretch.


@dataclass(frozen=True)
class CauseEvidence:
    """What speaks for one cause, or for a group of causes that the data cannot tell apart.

    Attributes:
        named: it is among the causes of the hypothesis.
        over_others: how surely the hypothesis does better than the best one without the cause, or any of its
            group. Of a cause that the hypothesis does not have, how surely the best one in which it stands in
            the place of a cause does better than the hypothesis (mostly below zero).
        over_unknown: how surely the hypothesis does better on the held-out trials than that one without the
            cause and with a smooth error of unknown cause in its place (`diagnosis.probabilities`). 0 for a
            cause that the hypothesis does not have.
        ratio: by what factor the error of the one without the cause is larger, of the one in its place
            smaller [natural logarithm].
        numbers: how many more numbers the one without the cause has, or the one in its place.
        members: of a group: the others, which stand in the cause's place, with how surely it does better than
            each.
    """

    named: bool
    over_others: float
    over_unknown: float = 0.0
    ratio: float = 0.0
    numbers: int = 0
    members: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Evidence:
    """What speaks for every cause, for none, and for something outside the list.

    Attributes:
        causes: by name; one that no hypothesis has is missing.
        over_none: how surely the best hypothesis does better than the calibrated model.
        number: of the sets of causes that were tried.
        times_noise: largest held-out error of the hypothesis over the noise floor, of any unit.
        times_before: the same of the calibrated model without causes.
        unknown: how surely a smooth error of unknown cause, beside the hypothesis, does better on the
            held-out trials.
        unknown_share: of the hypothesis's held-out squares, which it takes away.
        structure: share of what is left that depends on one thing, of the strongest test that shows any
            (`rules.strongest_structure`); 0 where none does.
        values: measured, by which hypotheses are compared.
        harmful: the hypothesis makes some output, unit or trial worse (`diagnosis.verdict`).
    """

    causes: Mapping[str, CauseEvidence]
    over_none: float
    number: int
    times_noise: float
    unknown: float
    unknown_share: float
    times_before: float = 1.0
    structure: float = 0.0
    harmful: bool = False
    values: int = 0


def evidence(
    problem: Problem,
    test: Problem,
    hypotheses: Sequence[Scored],
    chosen: Sequence[str],
    alike: Mapping[str, Mapping[str, float]],
    times: tuple[float, float],
    structure: float = 0.0,
    harmful: bool = False,
) -> Evidence:
    """Return what speaks for every cause.

    `hypotheses` are all that were tried, the one with the `chosen` causes and the one without any among them;
    `alike` is from `alike_groups`, `times` the held-out error before and after over the noise.
    """
    few = with_fewer_rows(problem)
    named = tuple(sorted(chosen))
    mine = next(item for item in hypotheses if item.causes == named)
    null = next(item for item in hypotheses if not item.causes)
    best = min(hypotheses, key=cost_of)
    standing_in = {name for others in alike.values() for name in others}
    found = {}
    for name in EFFECTS:
        if name in named:
            members = alike.get(name, {})
            others = [item for item in hypotheses if not {name, *members} & set(item.causes)]
            other = min(others, key=cost_of)
            unknown = _over_unknown(few, test, other, mine)
            found[name] = _beside(other, mine, named=True, over_unknown=unknown, members=members)
        elif name not in standing_in:
            rivals = [item for item in hypotheses if name in item.causes and _stands_in(item.causes, named)]
            if rivals:
                found[name] = _beside(min(rivals, key=cost_of), mine, named=False)
    beside = _with_unknown(few, test, mine)
    own = stretch_sums(mine.heldout_block, mine.heldout)
    return Evidence(
        causes=found,
        over_none=surety(null.squares, best.squares),
        number=len(hypotheses),
        times_noise=times[1],
        unknown=surety(own, beside),
        unknown_share=1.0 - float(beside.sum()) / max(float(own.sum()), 1e-300),
        times_before=times[0],
        structure=structure,
        harmful=harmful,
        values=len(mine.fit.left_out) + len(mine.heldout),
    )


@dataclass(frozen=True)
class UnlistedForm:
    """One cause in a form that is not listed, in the place of many corrections.

    The simplest form of `name` explains most with a smooth error of unknown cause beside it; `surer`: how
    surely the corrections do better on the held-out trials [standard deviations of chance].
    """

    name: str
    surer: float


def one_unlisted_form(
    problem: Problem, test: Problem, hypotheses: Sequence[Scored], chosen: Sequence[str]
) -> UnlistedForm | None:
    """Return the single cause that does best with a smooth error beside it; None: no single was fitted.

    A smooth function of the commands stands for what the cause's listed forms lack.
    """
    few = with_fewer_rows(problem)
    mine = next(item for item in hypotheses if item.causes == tuple(sorted(chosen)))
    own = stretch_sums(mine.heldout_block, mine.heldout)
    singles = sorted((item for item in hypotheses if len(item.causes) == 1), key=cost_of)
    found = [(_with_unknown(few, test, item), item.causes[0]) for item in singles[:UNLISTED_SINGLES]]
    if not found:
        return None
    squares, name = min(found, key=lambda pair: float(pair[0].sum()))
    return UnlistedForm(name, surety(squares, own))


def _beside(
    other: Scored,
    mine: Scored,
    named: bool,
    over_unknown: float = 0.0,
    members: Mapping[str, float] | None = None,
) -> CauseEvidence:
    """Return what speaks for a cause of the hypothesis `mine`, or for one of `other` in its place."""
    worse, better = (other, mine) if named else (mine, other)
    ratio = 0.5 * math.log(max(cost_of(worse), 1e-300) / max(cost_of(better), 1e-300))
    more = len(other.fit.numbers) - len(mine.fit.numbers)
    return CauseEvidence(
        named, surety(worse.squares, better.squares), over_unknown, ratio, more, members or {}
    )


def as_numbers(found: Evidence) -> dict[str, dict[str, float]]:
    """Return evidence as the numbers of a document; a group's other members stand as further keys."""
    causes = {
        name: {
            "named": float(item.named),
            "over_others": item.over_others,
            "over_unknown": item.over_unknown,
            "ratio": item.ratio,
            "numbers": float(item.numbers),
            **{f"over_{member}": value for member, value in item.members.items()},
        }
        for name, item in found.causes.items()
    }
    whole = {
        "over_none": found.over_none,
        "sets_tried": float(found.number),
        "times_noise": found.times_noise,
        "times_before": found.times_before,
        "unknown": found.unknown,
        "unknown_share": found.unknown_share,
        "structure": found.structure,
        "harmful": float(found.harmful),
        "values": float(found.values),
    }
    return {**causes, "all": whole}


def _stands_in(causes: Sequence[str], named: Sequence[str]) -> bool:
    """Return whether a set is the chosen one with at most one cause exchanged, and none more."""
    return len(causes) <= max(len(named), 1) and len(set(causes) - set(named)) == 1


def _over_unknown(few: Problem, test: Problem, other: Scored, mine: Scored) -> float:
    return surety(_with_unknown(few, test, other), stretch_sums(mine.heldout_block, mine.heldout))


def _with_unknown(few: Problem, test: Problem, item: Scored) -> Array:
    """Return a hypothesis's held-out squares by stretch, a smooth error of unknown cause beside it."""
    smooth = explained(few, item.fit.residual, item.fit.block, replace(test, every=1))
    if not np.isfinite(smooth).all():
        return stretch_sums(item.heldout_block, item.heldout)
    return stretch_sums(item.heldout_block, item.heldout - smooth)


# ----------------------------------------------------------------------------------------------------
# How probable it is that each cause is at work, that none is, and that something outside the list is.
#
# Odds grow with what speaks for a cause on trials that no fit had seen (`diagnosis.probabilities`), and fall
# with what the hypothesis leaves beside the noise. The verdict has no part in them: it follows from them. How
# much each number counts was fitted by logistic regression to draws with hidden effects that other code
# made than the diagnosis has (`thresholds`): of ten answers with 0.9, nine should be right. Causes may be
# at work together: the probabilities need not add up to one. Causes that the data cannot tell apart have
# one probability as a group, of which each member has a share.


@dataclass(frozen=True)
class Beliefs:
    """What is probably at work.

    The probability of `each` cause by name, of "none" and of "outside". In `groups` that of each cause of the
    hypothesis, or of its group, by the cause's name. In `members`, by the same name, of each group of several
    that of every member, the likeliest first.
    """

    each: Mapping[str, float]
    groups: Mapping[str, float]
    members: Mapping[str, Mapping[str, float]]


def beliefs(found: Evidence | None, not_likely: Collection[str] = ()) -> Beliefs:
    """Return what is probably at work.

    `found` is None where nothing was asked, since the data look wrong. Of causes whose numbers are not
    plausible (`not_likely`) most of what speaks for one speaks for something outside the list that it stands
    for (`IMPLAUSIBLE_BELIEVED`).
    """
    if found is None:
        # What is wrong is not on the list of causes: it is the data themselves.
        return Beliefs({**dict.fromkeys(EFFECTS, 0.0), NONE: 0.0, OUTSIDE: 1.0}, {}, {})
    each = {OUTSIDE: _of(features_of_outside(found), LOG_ODDS_OF_OUTSIDE)}
    groups: dict[str, float] = {}
    members: dict[str, dict[str, float]] = {}
    for name in EFFECTS:
        item = found.causes.get(name)
        if item is None:
            each.setdefault(name, _of((1.0,), LOG_ODDS_OF_OTHERS))
        elif not item.named:
            each[name] = _of(features_of_rival(item), LOG_ODDS_OF_RIVALS)
        else:
            whole = _of(features_of_named(item, found), LOG_ODDS_OF_NAMED)
            if name in not_likely:
                soaked = (1.0 - IMPLAUSIBLE_BELIEVED) * whole
                whole -= soaked
                each[OUTSIDE] = min(1.0 - (1.0 - each[OUTSIDE]) * (1.0 - soaked), MOST_SURE)
            own = {member: whole * share for member, share in shares(name, item.members).items()}
            groups[name] = sum(own.values())
            members[name] = dict(sorted(own.items(), key=lambda pair: -pair[1]))
            each |= own
    each[NONE] = _of(features_of_none(found), LOG_ODDS_OF_NONE)
    return Beliefs(each, groups, {name: own for name, own in members.items() if len(own) > 1})


def shares(name: str, members: Mapping[str, float]) -> dict[str, float]:
    """Return how a group's probability is shared among its members; they add up to one.

    `name`: of the cause that the hypothesis has; `members`: the others, with how surely it does better than
    each. One that would have less than `LEAST_MEMBER_SHARE` is no member. None has more than the cause, which
    was chosen for its numbers.
    """
    weights = {name: 1.0}
    for other, surer in members.items():
        weights[other] = math.exp(-MEMBER_WEIGHT * max(surer, 0.0))
    total = sum(weights.values())
    kept = {other: value for other, value in weights.items() if value >= LEAST_MEMBER_SHARE * total}
    return {other: value / sum(kept.values()) for other, value in kept.items()}


def features_of_named(item: CauseEvidence, found: Evidence) -> tuple[float, ...]:
    """Return what the log odds of a cause of the hypothesis, or of its group, are linear in."""
    named = sum(other.named for other in found.causes.values())
    return (
        1.0,
        item.over_others,
        min(item.ratio, MOST_RATIO),
        float(np.clip(item.numbers, -MOST_NUMBERS, MOST_NUMBERS)),
        item.over_unknown,
        math.log(max(found.times_noise, 1.0)),
        math.log(max(named, 1)),
        found.structure,
        float(found.harmful),
        _likelihood(item, found) if named == 1 else 0.0,
    )


def _likelihood(item: CauseEvidence, found: Evidence) -> float:
    """Return how many nats of white noise a ratio of errors is worth, on a scale of logarithms.

    Where more than the noise is left, values err together, and as many fewer count. A ratio that may be
    chance counts by the probability that chance brings none as large, of either sign.
    """
    nats = found.values * max(item.ratio, 0.0) / max(found.times_noise, 1.0) ** 2
    return math.log1p(nats) * math.erf(max(item.over_others, 0.0) / math.sqrt(2.0))


def features_of_rival(item: CauseEvidence) -> tuple[float, ...]:
    """Return what the log odds of a cause are linear in that could stand in a cause's place."""
    more = float(np.clip(item.numbers, -MOST_NUMBERS, MOST_NUMBERS))
    return (1.0, item.over_others, max(item.ratio, -MOST_RATIO), more)


def features_of_outside(found: Evidence) -> tuple[float, ...]:
    """Return what the log odds of something outside the list are linear in."""
    return (
        1.0,
        math.log(max(found.times_noise, 1.0)),
        found.unknown,
        max(found.unknown_share, 0.0),
        found.structure,
        float(found.harmful),
    )


def features_of_none(found: Evidence) -> tuple[float, ...]:
    """Return what the log odds of there being no cause are linear in."""
    return (1.0, math.log(max(found.times_before, 1.0)), found.over_none)


def _of(features: tuple[float, ...], weights: tuple[float, ...]) -> float:
    return probability_of(float(np.dot(features, weights)))


def probability_of(log_odds: float) -> float:
    """Return a probability, within `MOST_SURE`, from its log odds."""
    probability = 1.0 / (1.0 + math.exp(-min(max(log_odds, -30.0), 30.0)))
    return min(max(probability, 1.0 - MOST_SURE), MOST_SURE)
