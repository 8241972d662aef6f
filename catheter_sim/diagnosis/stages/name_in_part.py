"""Causes that are surely at work although something else is wrong as well.

Where what the settled causes leave depends on something, the verdict names none of them: a wrong cause leaves
what it cannot imitate. So does a right one beside another that no form describes. The two are parted by a
smooth error of unknown cause (`verdict.discrepancy`; Kennedy and O'Hagan 2001): a cause is named for what it
explains on held-out trials that neither the best hypothesis without it explains, nor that one with such an
error in the cause's place. What is left stays said, as a remainder and as the probability of "outside".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from catheter_sim.diagnosis.causes.plausible import implausible
from catheter_sim.diagnosis.causes.weighing import weigh, with_shares
from catheter_sim.diagnosis.fitting.fit import fit
from catheter_sim.diagnosis.report.result import CAUSE_FOUND, UNEXPLAINED
from catheter_sim.diagnosis.stages.calibrate import Calibrated
from catheter_sim.diagnosis.stages.decide_on_heldout import Settled
from catheter_sim.diagnosis.stages.find_data_faults import Faults
from catheter_sim.diagnosis.stages.judge import Verdict, judge
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.stages.score_hypotheses import Scores
from catheter_sim.diagnosis.thresholds import SURE_BESIDE_OTHERS, SURE_BESIDE_UNKNOWN
from catheter_sim.diagnosis.verdict.rules import gains_surely, most_error_remains


def name_in_part(
    run: Run, posed: Posed, before: Calibrated, settled: Settled, verdict: Verdict, scores: Scores
) -> tuple[Settled, Verdict]:
    """Return the hypothesis of the causes that are surely at work, and the verdict that names them.

    What was settled stays as it is where causes are named already, where none is sure, or where those that
    are explain by themselves too little, do harm or are implausible. Where a model is known to be wrong
    (`Problem.model_share`: a comparison of recordings that it does not meet) nothing is named in part.
    """
    after = settled.weighed.after
    asked = verdict.name == UNEXPLAINED and not posed.train.model_share
    sure = surely_at_work(scores.evidence, after.causes) if asked else ()
    if not sure:
        return settled, verdict
    run.say("asking which causes are sure whatever else is wrong")
    part = settled
    if len(sure) < len(after.causes):
        terms = tuple(term for term in after.terms if term.effect in sure)
        after = fit(posed.train, terms, after.values, cross_validate=False, thorough=posed.thorough)
        part = replace(settled, weighed=weigh(settled.scales, with_shares(settled.scales, after)), equals=())
    weighed = part.weighed
    found = judge(posed, before, part, Faults(()))
    named = (
        set(weighed.after.causes) == set(sure)
        and not implausible(weighed.after)
        and not found.harms
        and not most_error_remains(weighed.by_unit[part.unit])
        and any(gains_surely(item) for item in weighed.by_unit.values())
    )
    if not named:
        return settled, verdict
    return part, replace(found, name=CAUSE_FOUND, shown=weighed.after, in_part=True)


def surely_at_work(evidence: Mapping[str, Mapping[str, float]], causes: Sequence[str]) -> tuple[str, ...]:
    """Return those of the settled causes whose work neither others nor an unknown error can do."""
    return tuple(
        name
        for name in causes
        if name in evidence
        and evidence[name]["over_others"] >= SURE_BESIDE_OTHERS
        and evidence[name]["over_unknown"] >= SURE_BESIDE_UNKNOWN
    )
