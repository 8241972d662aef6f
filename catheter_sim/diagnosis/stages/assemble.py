"""The diagnosis as one value."""

from __future__ import annotations

from catheter_sim.diagnosis.base_frame.registration import document
from catheter_sim.diagnosis.causes.ranking import ranking
from catheter_sim.diagnosis.data.resolution import resolution_by_unit
from catheter_sim.diagnosis.fitting.noise import repeat_noise
from catheter_sim.diagnosis.fitting.prediction import robot_with
from catheter_sim.diagnosis.notes import Attempts
from catheter_sim.diagnosis.report.next_experiment import NextExperiment
from catheter_sim.diagnosis.report.result import DATA_SUSPECT, Diagnosis, Remainder
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
    attempt: Attempts,
) -> Diagnosis:
    """Return the diagnosis from what the stages found.

    `attempt`: has notes on the stages that failed.
    """
    shown, unit = conclusion.fit, settled.unit
    ranked = attempt("The ranking", lambda: ranking(posed.heldout, scores.hypotheses, unit), lambda: ())
    left: dict[str, Remainder] = attempt(
        "What is left of the error",
        lambda: remainders(posed.dataset, conclusion.fits, conclusion.by_unit),
        dict,
    )
    return Diagnosis(
        dataset=posed.dataset,
        verdict=verdict.name,
        unit=unit,
        by_unit=conclusion.by_unit,
        causes=numbers.causes,
        ranking=ranked,
        indistinguishable=conclusion.groups,
        next_experiment=following,
        extended_robot=robot_with(posed.train, shown.numbers, shown.x),
        fits=conclusion.fits,
        notes=(*faults.notes, *prepared.notes, *conclusion.notes, *attempt.notes),
        extra=conclusion.further,
        calibrated=numbers.calibrated,
        structure=conclusion.structure,
        data_faults=faults.found or (prepared.lacking if verdict.name == DATA_SUSPECT else ()),
        registration=document(posed.registration, conclusion.frame),
        chosen_in_training=choice.fit.causes,
        absorbs=conclusion.absorbs,
        corrections=numbers.corrections,
        probabilities=scores.beliefs.each,
        evidence=scores.evidence,
        residual=left,
        repeatability=repeat_noise(posed.dataset.trials, posed.train.columns),
        resolution=resolution_by_unit(posed.train.resolution),
    )
