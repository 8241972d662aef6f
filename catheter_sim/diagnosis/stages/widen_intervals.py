"""How sure the reported numbers are, and what the simulation would change of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from catheter_sim.diagnosis.causes.forms import with_forms
from catheter_sim.diagnosis.causes.shares import with_intervals
from catheter_sim.diagnosis.fitting.calibrated import calibrated_numbers
from catheter_sim.diagnosis.fitting.intervals import cause_intervals, model_margin
from catheter_sim.diagnosis.report.result import Cause, FittedParameter
from catheter_sim.diagnosis.stages.conclude import Conclusion
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.replay_in_mujoco import Replayed
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.thresholds import TRUSTED_SHARE


@dataclass(frozen=True)
class Numbers:
    """The reported numbers with their intervals.

    Attributes:
        causes, corrections: with their parameters and forms.
        calibrated: numbers of this specimen, by name.
    """

    causes: tuple[Cause, ...]
    corrections: tuple[Cause, ...]
    calibrated: Mapping[str, FittedParameter]


def widen_intervals(
    run: Run, posed: Posed, conclusion: Conclusion, replayed: Replayed, more_is_wrong: bool = False
) -> Numbers:
    """Return the numbers of the reported hypothesis with the intervals that are printed.

    `more_is_wrong`: something else is known to be wrong, by as much as is left.
    """
    run.say("measuring how sure the calibration is")
    shown, shift = conclusion.fit, replayed.shift
    trusted = 1.0 if more_is_wrong else TRUSTED_SHARE
    margin = model_margin(shown, np.zeros(len(shown.numbers)) if shift is None else shift, trusted)
    every = with_forms(posed.train, (*conclusion.causes, *conclusion.corrections), shown, run.pool)
    every = with_intervals(every, cause_intervals(shown, shift, trusted))
    established = len(conclusion.causes)
    return Numbers(
        causes=every[:established],
        corrections=every[established:],
        calibrated=calibrated_numbers(posed.train, shown, posed.thorough, margin, run.pool),
    )
