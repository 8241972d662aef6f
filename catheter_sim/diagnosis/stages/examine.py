"""What a hypothesis makes of every trial: its series, on what its errors depend, and what gets worse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from catheter_sim.diagnosis.fitting.noise import times_noise
from catheter_sim.diagnosis.report.result import StructureTest, TrialFit, UnitResult
from catheter_sim.diagnosis.residuals.coordinates import STAGES
from catheter_sim.diagnosis.residuals.structure import structure_tests
from catheter_sim.diagnosis.stages.calibrate import Calibrated
from catheter_sim.diagnosis.stages.decide_on_heldout import Settled
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.verdict.harm import Harm, harms
from catheter_sim.diagnosis.verdict.heldout_figures import trial_fits
from catheter_sim.diagnosis.verdict.rules import most_error_remains, strongest_structure, structured_remainder


@dataclass(frozen=True)
class Examined:
    """What a hypothesis makes of the trials.

    Attributes:
        fits: every trial, computed before and by the hypothesis.
        structure: tests of the residuals, by stage ("before", "after").
        by_unit: its held-out figures.
        remainder: on what the error that is left depends; None: on nothing, or it is small.
        much_left: most of an error far above the noise is still there.
        harms: what it makes worse on the held-out trials, worst first.
    """

    fits: tuple[TrialFit, ...]
    structure: Mapping[str, tuple[StructureTest, ...]]
    by_unit: Mapping[str, UnitResult]
    remainder: StructureTest | None
    much_left: bool
    harms: tuple[Harm, ...]

    @property
    def depends(self) -> StructureTest | None:
        """On what much of the error that is left depends, however small it is; None: on nothing."""
        return strongest_structure(self.structure["after"])

    @property
    def times_before(self) -> float:
        """Return the largest held-out error without causes over the noise, of any unit."""
        return max(times_noise(item.rmse_before, item.noise_floor) for item in self.by_unit.values())

    @property
    def times_after(self) -> float:
        """Return the same of the hypothesis."""
        return max(times_noise(item.rmse_after, item.noise_floor) for item in self.by_unit.values())


def examine(posed: Posed, before: Calibrated, settled: Settled) -> Examined:
    """Return what the hypothesis that is left makes of the trials."""
    weighed, unit = settled.weighed, settled.unit
    trials = (*posed.train.trials, *posed.heldout.trials)
    fits = trial_fits(posed.train, trials, before.fit, weighed.after)
    structure = {stage: structure_tests(posed.dataset, fits, unit, stage) for stage in STAGES}
    told, share = weighed.by_unit[unit], posed.train.model_share
    return Examined(
        fits,
        structure,
        weighed.by_unit,
        structured_remainder(told, structure["after"], len(weighed.after.terms), share),
        most_error_remains(told, share),
        harms(posed.heldout, before.fit, weighed.after, settled.scales.noise),
    )


def examined_plainly(posed: Posed, before: Calibrated, settled: Settled) -> Examined:
    """Return the series alone, where the rest could not be found."""
    trials = (*posed.train.trials, *posed.heldout.trials)
    fits = trial_fits(posed.train, trials, before.fit, settled.weighed.after)
    return Examined(fits, dict.fromkeys(STAGES, ()), settled.weighed.by_unit, None, False, ())
