"""What every hypothesis predicts for rows that it was not fitted to, and what that says of every cause."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from catheter_sim.diagnosis.causes.comparison import only_mends, rivals_of
from catheter_sim.diagnosis.causes.scored import Scored, scored
from catheter_sim.diagnosis.stages.choose_causes import Choice
from catheter_sim.diagnosis.stages.decide_on_heldout import Settled
from catheter_sim.diagnosis.stages.examine import Examined
from catheter_sim.diagnosis.stages.find_data_faults import Faults
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.thresholds import FEWEST_UNLISTED, UNLISTED_NOISE
from catheter_sim.diagnosis.verdict.evidence import UnlistedForm, as_numbers, evidence, one_unlisted_form
from catheter_sim.diagnosis.verdict.groups import alike_groups
from catheter_sim.diagnosis.verdict.probabilities import NONE, OUTSIDE, Beliefs, beliefs
from catheter_sim.effects import EFFECTS


@dataclass(frozen=True)
class Scores:
    """Every hypothesis with what it predicts.

    Attributes:
        hypotheses: one of every set of causes that was fitted.
        beliefs: the probability of every cause, of groups, of none and of something outside the list.
        evidence: what they were worked out from.
        unlisted: one cause in a form that is not listed, in the place of many corrections; None: not asked.
    """

    hypotheses: tuple[Scored, ...]
    beliefs: Beliefs
    evidence: Mapping[str, Mapping[str, float]]
    unlisted: UnlistedForm | None = None


def score_hypotheses(
    run: Run, posed: Posed, choice: Choice, settled: Settled, examined: Examined, faults: Faults
) -> Scores:
    """Return what every hypothesis predicts, and how probable every cause is."""
    run.say("scoring the hypotheses")
    train, heldout, weighed = posed.train, posed.heldout, settled.weighed
    known = dict(weighed.after.values)
    for cause in settled.soaked:
        known |= {(cause.name, name): item.value for name, item in cause.parameters.items()}
    hypotheses = scored(train, heldout, choice.selection, settled.terms, known)
    if faults.found or posed.lacking:
        return Scores(hypotheses, Beliefs({}, {}, {}) if posed.lacking else beliefs(None), {})
    names = tuple(term.effect for term in settled.terms)
    rivals = [] if settled.soaked else rivals_of(weighed.after, settled.equals)
    chosen = next(item.fit for item in hypotheses if item.causes == tuple(sorted(names)))
    against = [item for item in hypotheses if not only_mends(train, chosen, item.fit)]
    found = evidence(
        train,
        heldout,
        against,
        names,
        alike_groups(against, names, rivals),
        (examined.times_before, examined.times_after),
        0.0 if examined.depends is None else examined.depends.share_percent / 100.0,
        bool(examined.harms),
    )
    unlisted = None
    if len(weighed.after.causes) >= FEWEST_UNLISTED and examined.times_after > UNLISTED_NOISE:
        unlisted = one_unlisted_form(train, heldout, hypotheses, names)
    believed = beliefs(found, tuple(cause.name for cause in settled.soaked))
    return Scores(hypotheses, believed, as_numbers(found), unlisted)


def unscored() -> Scores:
    """Return what is known where hypotheses could not be scored: no probability of anything."""
    return Scores((), Beliefs(dict.fromkeys((*EFFECTS, NONE, OUTSIDE), math.nan), {}, {}), {})
