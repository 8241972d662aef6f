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
        causes: named causes with their parameters and forms.
        calibrated: numbers of this specimen, by name.
    """

    causes: tuple[Cause, ...]
    calibrated: Mapping[str, FittedParameter]


def widen_intervals(
    run: Run, posed: Posed, conclusion: Conclusion, replayed: Replayed, in_part: bool = False
) -> Numbers:
    """Return the numbers of the reported hypothesis with the intervals that are printed.

    `in_part`: something else is known to be wrong, by as much as is left.
    """
    run.say("measuring how sure the calibration is")
    shown, shift = conclusion.fit, replayed.shift
    trusted = 1.0 if in_part else TRUSTED_SHARE
    margin = model_margin(shown, np.zeros(len(shown.numbers)) if shift is None else shift, trusted)
    causes = with_forms(posed.train, conclusion.causes, shown, run.pool)
    return Numbers(
        causes=with_intervals(causes, cause_intervals(shown, shift, trusted)),
        calibrated=calibrated_numbers(posed.train, shown, posed.thorough, margin, run.pool),
    )
