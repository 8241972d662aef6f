"""The verdict on the hypothesis that is left."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.report.result import (
    CAUSE_FOUND,
    DATA_SUSPECT,
    NO_DISCREPANCY,
    StructureTest,
    TrialFit,
)
from catheter_sim.diagnosis.residuals.coordinates import STAGES
from catheter_sim.diagnosis.residuals.structure import structure_tests
from catheter_sim.diagnosis.stages.calibrate import Calibrated
from catheter_sim.diagnosis.stages.decide_on_heldout import Settled
from catheter_sim.diagnosis.stages.find_data_faults import Faults
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.verdict.harm import Harm, harms
from catheter_sim.diagnosis.verdict.heldout_figures import trial_fits
from catheter_sim.diagnosis.verdict.rules import strongest_structure, structured_remainder, verdict_of


@dataclass(frozen=True)
class Verdict:
    """The verdict, and what it rests on.

    Attributes:
        name: one of `result.VERDICTS`.
        shown: the hypothesis that is reported: with its causes if they are named, else the calibrated model.
        fits: every trial, computed before and with the causes, named or not.
        structure: tests of the residuals, by stage ("before", "after").
        remainder: on what the error that is left depends; None: on nothing, or it is small.
        harms: what the causes make worse on the held-out trials, worst first.
        in_part: the causes are named although something else is wrong as well.
    """

    name: str
    shown: Fit
    fits: tuple[TrialFit, ...]
    structure: Mapping[str, tuple[StructureTest, ...]]
    remainder: StructureTest | None
    harms: tuple[Harm, ...] = ()
    in_part: bool = False

    @property
    def names_causes(self) -> bool:
        """Return whether causes are named."""
        return self.name == CAUSE_FOUND


def judge(posed: Posed, before: Calibrated, settled: Settled, faults: Faults) -> Verdict:
    """Return the verdict."""
    weighed, unit = settled.weighed, settled.unit
    trials = (*posed.train.trials, *posed.heldout.trials)
    fits = trial_fits(posed.train, trials, before.fit, weighed.after)
    structure = {stage: structure_tests(posed.dataset, fits, unit, stage) for stage in STAGES}
    remainder = structured_remainder(
        weighed.by_unit[unit], structure["after"], len(weighed.after.terms), posed.train.model_share
    )
    harmed = harms(posed.heldout, before.fit, weighed.after, settled.scales.noise)
    name = DATA_SUSPECT
    if not faults.found:
        name = verdict_of(
            posed.train,
            before.fit,
            weighed.after,
            weighed.by_unit,
            unit,
            remainder,
            harmful=bool(harmed),
            structured=strongest_structure(structure["before"]) is not None,
        )
        if posed.lacking and name != NO_DISCREPANCY:
            name = DATA_SUSPECT
    shown = weighed.after if name == CAUSE_FOUND else before.fit
    return Verdict(name, shown, fits, structure, remainder, harmed)
