"""How probable it is that a generic cause is at work in somebody's MJCF.

The evidence of a cause is that of the chosen fit over the best one without it. Nats of one data set promise
too much, since models are wrong in more ways than were tried: they are divided by `NATS`. And what is left
on held-out data, beside what a right model leaves, speaks for something that was not tried: with the error at
which a model no longer explains the data, a cause is as probable as not at best. The scales are assumed;
docs/truth/foreign_models.md says how often names were right.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from catheter_sim.foreign.thresholds import (
    EQUAL_ERROR,
    EXPLAINED_NOISE,
    EXPLAINED_SHARE,
    LARGEST_GROUP,
    LEAST_MEMBER_SHARE,
    MOST_SURE,
    NATS,
)

NONE, OUTSIDE = "none", "outside"


@dataclass(frozen=True)
class Tried:
    """A set of causes that was fitted: names, evidence [nat], and held-out error over the noise."""

    causes: tuple[str, ...]
    evidence: float
    times_noise: float


@dataclass(frozen=True)
class Likely:
    """A cause of the chosen fit.

    Attributes:
        name: of the cause.
        probability: that it is at work, or one of its group.
        members: of a group, the probability of each by name, the likeliest first; empty: it stands alone.
    """

    name: str
    probability: float
    members: Mapping[str, float] = field(default_factory=dict)


def likely(chosen: Tried, before: Tried, tried: Sequence[Tried]) -> tuple[Likely, ...]:
    """Return the causes of the chosen fit with their probabilities, the most probable first.

    Args:
        chosen: the fit that is reported.
        before: the model as it is.
        tried: everything that was fitted, these two among it.
    """
    listed = 1.0 - outside(chosen, before)
    found = []
    for name in chosen.causes:
        weights = _group(name, chosen, tried)
        others = [item.evidence for item in tried if not set(weights) & set(item.causes)]
        whole = listed * _chance((chosen.evidence - max(others)) / NATS)
        total = sum(weights.values())
        members = {other: whole * weight / total for other, weight in weights.items()}
        ordered = dict(sorted(members.items(), key=lambda pair: -pair[1]))
        found.append(Likely(name, whole, ordered if len(ordered) > 1 else {}))
    return tuple(sorted(found, key=lambda item: -item.probability))


def outside(chosen: Tried, before: Tried) -> float:
    """Return the probability that something is at work that was not tried."""
    explained = max(EXPLAINED_NOISE, EXPLAINED_SHARE * before.times_noise)
    return min(max(1.0 - 1.0 / (1.0 + (chosen.times_noise / explained) ** 4), 1.0 - MOST_SURE), MOST_SURE)


def probabilities(found: Sequence[Likely], chosen: Tried, before: Tried) -> dict[str, float]:
    """Return the probability of each cause of the fit, of its groups, of none and of something else."""
    each = {
        name: value
        for item in found
        for name, value in (item.members or {item.name: item.probability}).items()
    }
    none = 1.0 - _chance((chosen.evidence - before.evidence) / NATS)
    return {**each, NONE: MOST_SURE if not found else none, OUTSIDE: outside(chosen, before)}


def _group(name: str, chosen: Tried, tried: Sequence[Tried]) -> dict[str, float]:
    """Return a cause with those that the data cannot tell from it, by their weights; of single causes alone.

    A member has evidence within `NATS` of the cause's, and leaves as little on the held-out data.
    """
    weights = {name: 1.0}
    if len(chosen.causes) > 1:
        return weights
    near = [
        item
        for item in sorted(tried, key=lambda item: -item.evidence)
        if len(item.causes) == 1
        and item.causes[0] != name
        and chosen.evidence - item.evidence < NATS
        and item.times_noise <= EQUAL_ERROR * chosen.times_noise
    ]
    for item in near:
        weight = math.exp((item.evidence - chosen.evidence) / NATS)
        if len(weights) < LARGEST_GROUP and weight >= LEAST_MEMBER_SHARE * (sum(weights.values()) + weight):
            weights.setdefault(item.causes[0], weight)
    return weights


def _chance(log_odds: float) -> float:
    chance = 1.0 / (1.0 + math.exp(-min(max(log_odds, -30.0), 30.0)))
    return min(max(chance, 1.0 - MOST_SURE), MOST_SURE)
