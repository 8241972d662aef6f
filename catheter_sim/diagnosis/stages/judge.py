"""The verdict on the hypothesis that is left: it follows from the probabilities of its causes."""

from __future__ import annotations

from dataclasses import dataclass

from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.report.result import (
    CAUSE_FOUND,
    DATA_SUSPECT,
    IMPROVED,
    NO_DISCREPANCY,
    UNEXPLAINED,
)
from catheter_sim.diagnosis.stages.calibrate import Calibrated
from catheter_sim.diagnosis.stages.decide_on_heldout import Settled
from catheter_sim.diagnosis.stages.examine import Examined
from catheter_sim.diagnosis.stages.find_data_faults import Faults
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.score_hypotheses import Scores
from catheter_sim.diagnosis.thresholds import ESTABLISHED
from catheter_sim.diagnosis.verdict.rules import strongest_structure, verdict_of


@dataclass(frozen=True)
class Verdict:
    """The verdict, and what it rests on.

    Attributes:
        name: one of `result.VERDICTS`.
        shown: the hypothesis that is reported: with its causes and corrections, or the calibrated model.
        established: which of its causes are named.
        more_is_wrong: what is left of the error says that something else is wrong as well.
        unproved: probable causes whose gain the held-out trials do not show.
    """

    name: str
    shown: Fit
    established: tuple[str, ...] = ()
    more_is_wrong: bool = False
    unproved: tuple[str, ...] = ()

    @property
    def corrects(self) -> bool:
        """Return whether the reported hypothesis has causes or corrections."""
        return self.name in (CAUSE_FOUND, IMPROVED)


def judge(
    posed: Posed, before: Calibrated, settled: Settled, faults: Faults, examined: Examined, scores: Scores
) -> Verdict:
    """Return the verdict."""
    after = settled.weighed.after
    more = examined.remainder is not None or examined.much_left
    if faults.found:
        return Verdict(DATA_SUSPECT, before.fit, more_is_wrong=more)
    likely = tuple(name for name in after.causes if scores.beliefs.groups.get(name, 0.0) >= ESTABLISHED)
    name = verdict_of(
        posed.train,
        before.fit,
        after,
        settled.weighed.by_unit,
        established=bool(likely),
        harmful=bool(examined.harms),
        structured=strongest_structure(examined.structure["before"]) is not None,
    )
    if posed.lacking and name != NO_DISCREPANCY:
        name = DATA_SUSPECT  # what fits cannot be proved
    if name == NO_DISCREPANCY and likely:
        name = UNEXPLAINED  # the training trials hold one that the held-out ones do not show
    found = Verdict(name, before.fit, (), more, () if examined.harms else likely)
    if not found.corrects:
        return found
    return Verdict(name, after, likely if name == CAUSE_FOUND else (), more)


def unjudged(before: Calibrated, faults: Faults) -> Verdict:
    """Return the verdict that names nothing, where no other could be worked out."""
    return Verdict(DATA_SUSPECT if faults.found else UNEXPLAINED, before.fit)
