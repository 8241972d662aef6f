"""How probable it is that each cause is at work, that none is, and that something outside the list is.

Odds grow with what speaks for a cause on trials that no fit had seen (`verdict.evidence`), and fall with what
the settled hypothesis leaves beside the noise. How much each number counts was fitted by logistic regression
to draws with hidden effects that other code made than the diagnosis has (`thresholds`): of ten answers with
0.9, nine should be right. Causes may be at work together: the probabilities need not add up to one.
"""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np

from catheter_sim.diagnosis.report.result import CAUSE_FOUND, DATA_SUSPECT, NO_DISCREPANCY
from catheter_sim.diagnosis.thresholds import (
    IMPLAUSIBLE_BELIEVED,
    LOG_ODDS_OF_NAMED,
    LOG_ODDS_OF_NONE,
    LOG_ODDS_OF_OTHERS,
    LOG_ODDS_OF_OUTSIDE,
    LOG_ODDS_OF_RIVALS,
    MOST_SURE,
)
from catheter_sim.diagnosis.verdict.evidence import CauseEvidence, Evidence
from catheter_sim.effects import EFFECTS

NONE, OUTSIDE = "none", "outside"


def probabilities(found: Evidence | None, verdict: str, not_likely: Collection[str] = ()) -> dict[str, float]:
    """Return the probability of every cause by name, of "none" and of "outside".

    Args:
        found: what speaks for each; None: nothing was asked, since the data look wrong.
        verdict: the diagnosis's.
        not_likely: settled causes whose numbers are not plausible: most of what speaks for one of them speaks
            for something outside the list that it stands for (`IMPLAUSIBLE_BELIEVED`).
    """
    if found is None or verdict == DATA_SUSPECT:
        # What is wrong is not on the list of causes: it is the data themselves.
        return {**dict.fromkeys(EFFECTS, 0.0), NONE: 0.0, OUTSIDE: 1.0}
    result = {}
    for name in EFFECTS:
        item = found.causes.get(name)
        if item is None:
            result[name] = _of((1.0,), LOG_ODDS_OF_OTHERS)
        elif item.named:
            result[name] = _of(features_of_named(item, found, verdict), LOG_ODDS_OF_NAMED)
        else:
            result[name] = _of(features_of_rival(item, found, verdict), LOG_ODDS_OF_RIVALS)
    result[OUTSIDE] = _of(features_of_outside(found, verdict), LOG_ODDS_OF_OUTSIDE)
    result[NONE] = _of(features_of_none(verdict), LOG_ODDS_OF_NONE)
    for name in not_likely:
        soaked = (1.0 - IMPLAUSIBLE_BELIEVED) * result[name]
        result[name] -= soaked
        result[OUTSIDE] = min(1.0 - (1.0 - result[OUTSIDE]) * (1.0 - soaked), MOST_SURE)
    return result


def features_of_named(item: CauseEvidence, found: Evidence, verdict: str) -> tuple[float, ...]:
    """Return what the log odds of a settled cause are linear in."""
    return (
        1.0,
        item.over_others,
        item.over_unknown,
        math.log(max(found.times_noise, 1.0)),
        float(verdict == CAUSE_FOUND),
        float(verdict == NO_DISCREPANCY),
        math.log(max(sum(other.named for other in found.causes.values()), 1)),
    )


def features_of_rival(item: CauseEvidence, found: Evidence, verdict: str) -> tuple[float, ...]:
    """Return what the log odds of a cause are linear in that could stand in a settled one's place."""
    return (1.0, item.over_others, float(verdict == CAUSE_FOUND), float(verdict == NO_DISCREPANCY))


def features_of_outside(found: Evidence, verdict: str) -> tuple[float, ...]:
    """Return what the log odds of something outside the list are linear in."""
    return (
        1.0,
        math.log(max(found.times_noise, 1.0)),
        found.unknown,
        max(found.unknown_share, 0.0),
        float(verdict == CAUSE_FOUND),
        float(verdict == NO_DISCREPANCY),
    )


def features_of_none(verdict: str) -> tuple[float, ...]:
    """Return what the log odds of there being no cause are linear in."""
    return (1.0, float(verdict != NO_DISCREPANCY))


def _of(features: tuple[float, ...], weights: tuple[float, ...]) -> float:
    log_odds = float(np.dot(features, weights))
    probability = 1.0 / (1.0 + math.exp(-min(max(log_odds, -30.0), 30.0)))
    return min(max(probability, 1.0 - MOST_SURE), MOST_SURE)
