"""How probable it is that each cause is at work, that none is, and that something outside the list is.

Odds grow with what speaks for a cause on trials that no fit had seen (`verdict.evidence`), and fall with what
the hypothesis leaves beside the noise. The verdict has no part in them: it follows from them. How much each
number counts was fitted by logistic regression to draws with hidden effects that other code made than the
diagnosis has (`thresholds`): of ten answers with 0.9, nine should be right. Causes may be at work together:
the probabilities need not add up to one. Causes that the data cannot tell apart have one probability as a
group, of which each member has a share.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from catheter_sim.diagnosis.thresholds import (
    IMPLAUSIBLE_BELIEVED,
    LEAST_MEMBER_SHARE,
    LOG_ODDS_OF_NAMED,
    LOG_ODDS_OF_NONE,
    LOG_ODDS_OF_OTHERS,
    LOG_ODDS_OF_OUTSIDE,
    LOG_ODDS_OF_RIVALS,
    MEMBER_WEIGHT,
    MOST_NUMBERS,
    MOST_RATIO,
    MOST_SURE,
)
from catheter_sim.diagnosis.verdict.evidence import CauseEvidence, Evidence
from catheter_sim.effects import EFFECTS

NONE, OUTSIDE = "none", "outside"


@dataclass(frozen=True)
class Beliefs:
    """What is probably at work.

    Attributes:
        each: the probability of every cause by name, of "none" and of "outside".
        groups: the probability of each cause of the hypothesis, or of its group, by the cause's name.
        members: of each group of several the probability of every member, the likeliest first, by the same
            name.
    """

    each: Mapping[str, float]
    groups: Mapping[str, float]
    members: Mapping[str, Mapping[str, float]]


def beliefs(found: Evidence | None, not_likely: Collection[str] = ()) -> Beliefs:
    """Return what is probably at work.

    Args:
        found: what speaks for each; None: nothing was asked, since the data look wrong.
        not_likely: causes of the hypothesis whose numbers are not plausible: most of what speaks for one of
            them speaks for something outside the list that it stands for (`IMPLAUSIBLE_BELIEVED`).
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

    Args:
        name: of the cause that the hypothesis has.
        members: the others, with how surely it does better than each. One that would have less than
            `LEAST_MEMBER_SHARE` is no member. None has more than the cause, which was chosen for its numbers.
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
    log_odds = float(np.dot(features, weights))
    probability = 1.0 / (1.0 + math.exp(-min(max(log_odds, -30.0), 30.0)))
    return min(max(probability, 1.0 - MOST_SURE), MOST_SURE)
