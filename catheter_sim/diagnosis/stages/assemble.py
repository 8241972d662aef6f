"""The diagnosis as one value."""

from __future__ import annotations

from dataclasses import replace

from catheter_sim.diagnosis.base_frame.registration import document
from catheter_sim.diagnosis.causes.ranking import ranking
from catheter_sim.diagnosis.fitting.prediction import robot_with
from catheter_sim.diagnosis.report.result import DATA_SUSPECT, Cause, Diagnosis, NextExperiment
from catheter_sim.diagnosis.stages.choose_causes import Choice
from catheter_sim.diagnosis.stages.conclude import Conclusion
from catheter_sim.diagnosis.stages.decide_on_heldout import Settled
from catheter_sim.diagnosis.stages.find_data_faults import Faults
from catheter_sim.diagnosis.stages.judge import Verdict
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.prepare import Prepared
from catheter_sim.diagnosis.stages.score_hypotheses import Scores
from catheter_sim.diagnosis.stages.widen_intervals import Numbers
from catheter_sim.diagnosis.verdict.remainder import remainders


def assemble(
    prepared: Prepared,
    posed: Posed,
    faults: Faults,
    choice: Choice,
    settled: Settled,
    verdict: Verdict,
    conclusion: Conclusion,
    following: NextExperiment,
    numbers: Numbers,
    scores: Scores,
) -> Diagnosis:
    """Return the diagnosis from what the stages found."""
    shown, unit = conclusion.fit, settled.unit
    return Diagnosis(
        dataset=posed.dataset,
        verdict=verdict.name,
        unit=unit,
        by_unit=conclusion.by_unit,
        causes=_with_probabilities(numbers.causes, scores),
        ranking=ranking(posed.heldout, scores.hypotheses, unit),
        indistinguishable=conclusion.groups,
        next_experiment=following,
        extended_robot=robot_with(posed.train, shown.numbers, shown.x),
        fits=conclusion.fits,
        notes=(*faults.notes, *prepared.notes, *conclusion.notes),
        extra=conclusion.further,
        calibrated=numbers.calibrated,
        structure=conclusion.structure,
        data_faults=faults.found or (prepared.lacking if verdict.name == DATA_SUSPECT else ()),
        registration=document(posed.registration, conclusion.frame),
        chosen_in_training=choice.fit.causes,
        absorbs=_with_probabilities(conclusion.absorbs, scores),
        probabilities=scores.probabilities,
        evidence=scores.evidence,
        residual=remainders(posed.dataset, conclusion.fits, conclusion.by_unit),
    )


def _with_probabilities(causes: tuple[Cause, ...], scores: Scores) -> tuple[Cause, ...]:
    return tuple(replace(cause, probability=scores.probabilities[cause.name]) for cause in causes)
