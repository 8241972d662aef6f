"""What every hypothesis predicts for rows that it was not fitted to, and what that says of every cause."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from catheter_sim.diagnosis.causes.plausible import implausible
from catheter_sim.diagnosis.causes.scored import Scored, scored
from catheter_sim.diagnosis.report.result import DATA_SUSPECT
from catheter_sim.diagnosis.stages.choose_causes import Choice
from catheter_sim.diagnosis.stages.decide_on_heldout import Settled
from catheter_sim.diagnosis.stages.judge import Verdict
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.verdict.evidence import as_numbers, evidence
from catheter_sim.diagnosis.verdict.probabilities import probabilities


@dataclass(frozen=True)
class Scores:
    """Every hypothesis with what it predicts.

    Attributes:
        hypotheses: one of every set of causes that was fitted.
        probabilities: of every cause, of none and of something outside the list.
        evidence: what they were worked out from.
    """

    hypotheses: tuple[Scored, ...]
    probabilities: Mapping[str, float]
    evidence: Mapping[str, Mapping[str, float]]


def score_hypotheses(run: Run, posed: Posed, choice: Choice, settled: Settled, verdict: Verdict) -> Scores:
    """Return what every hypothesis predicts, and how probable every cause is."""
    run.say("scoring the hypotheses")
    after = settled.weighed.after
    hypotheses = scored(posed.train, posed.heldout, choice.selection, after)
    if verdict.name == DATA_SUSPECT:
        return Scores(hypotheses, {} if posed.lacking else probabilities(None, verdict.name), {})
    times = max(item.rmse_after / max(item.noise_floor, 1e-300) for item in settled.weighed.by_unit.values())
    found = evidence(posed.train, posed.heldout, hypotheses, after.causes, times)
    return Scores(hypotheses, probabilities(found, verdict.name, implausible(after)), as_numbers(found))
