"""What changed between two recordings of one robot: the row of stages."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from catheter_sim.diagnosis.data.trials import Dataset
from catheter_sim.diagnosis.fitting.workers import SERIAL, Workers
from catheter_sim.diagnosis.pipeline import diagnose_prepared
from catheter_sim.diagnosis.report.result import (
    CAUSE_FOUND,
    NO_DISCREPANCY,
    Cause,
    Diagnosis,
    FittedParameter,
)
from catheter_sim.diagnosis.since.baseline import baseline
from catheter_sim.diagnosis.since.differences import differences
from catheter_sim.diagnosis.since.pairing import share_paired
from catheter_sim.diagnosis.stages.run import running
from catheter_sim.diagnosis.thresholds import MOSTLY_PAIRED
from catheter_sim.errors import InputError

CHANGED, UNCHANGED = "changed", "unchanged"
_IN_WORDS = {CAUSE_FOUND: CHANGED, NO_DISCREPANCY: UNCHANGED}


@dataclass(frozen=True)
class Comparison:
    """What changed between two recordings of one robot.

    Attributes:
        diagnosis: of the later recording without what both share; its robot is the earlier recording's.
        since: name of the earlier data set.
        rows: of the later recording.
        paired_rows: how many of them pair with rows of the earlier one.
        relative_error: of the earlier recording's model, beside what moved. It is wrong by about as much
            about how much a change does, so that every change's interval is widened by that share of it.
    """

    diagnosis: Diagnosis
    since: str
    rows: int
    paired_rows: int
    relative_error: float = 0.0

    @property
    def verdict(self) -> str:
        """Return "changed", "unchanged", "unexplained" or "data_suspect"."""
        return _IN_WORDS.get(self.diagnosis.verdict, self.diagnosis.verdict)

    @property
    def changes(self) -> tuple[Cause, ...]:
        """Return the causes that changed; each number is its change, and `null` 0."""
        share = self.relative_error
        return tuple(
            replace(cause, parameters={name: _change(item, share) for name, item in cause.parameters.items()})
            for cause in self.diagnosis.causes
        )


def compare(
    before: Dataset,
    after: Dataset,
    place: Workers = SERIAL,
    progress: bool = False,
    simulation: bool = True,
    budget_s: float = math.inf,
) -> Comparison:
    """Return what changed from one recording of a robot to another.

    Args:
        before, after: the two recordings.
        place: where to fit.
        progress: show what is being done where standard error is a terminal.
        simulation: replay the held-out trials in MuJoCo at the end.
        budget_s: seconds after which the search for causes ends with the best so far.

    Raises:
        InputError: they are not of the same robot or outputs, or the earlier one looks wrong by itself.
    """
    extended = before.calibration == ()  # of a finished report: the robot with what was found
    if not extended and before.robot != after.robot:
        raise InputError(
            f"{after.folder}: is of {after.robot_reference}, the earlier recording of "
            f"{before.robot_reference}: both need the same robot"
        )
    if before.motion != after.motion:
        raise InputError(f"{after.folder}: both recordings need the same motion, held or dynamic")
    with running(place, progress, budget_s) as run:
        base = baseline(run, before, is_paired=share_paired(after, before) >= MOSTLY_PAIRED)
        found = differences(after, base)
        diagnosis = diagnose_prepared(run, found.prepared, simulation)
    return Comparison(diagnosis, before.name, found.rows, found.paired_rows, base.relative_error)


def _change(parameter: FittedParameter, share: float) -> FittedParameter:
    """Return a number's change, its interval wider by a share of it.

    A number that changed from an infinite value is told as it is.
    """
    null = parameter.null
    if null is None or not math.isfinite(null):
        return parameter
    low, high = parameter.ci95
    change = parameter.value - null
    margin = share * abs(change)
    return FittedParameter(change, (low - null - margin, high - null + margin), 0.0)
