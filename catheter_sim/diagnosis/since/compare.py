"""What changed from one recording of a robot to another."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.trials import Dataset
from catheter_sim.diagnosis.pipeline import investigate_prepared
from catheter_sim.diagnosis.report.result import (
    CAUSE_FOUND,
    IMPROVED,
    NO_DISCREPANCY,
    UNEXPLAINED,
    Cause,
    Diagnosis,
    FittedParameter,
)
from catheter_sim.diagnosis.since.baseline import Baseline, left_by_unit
from catheter_sim.diagnosis.since.differences import Differences
from catheter_sim.diagnosis.since.from_report import Earlier
from catheter_sim.diagnosis.stages.not_searched import not_searched
from catheter_sim.diagnosis.stages.prepare import readings_of
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.thresholds import MOST_CHANGES
from catheter_sim.effects import EFFECTS
from catheter_sim.errors import InputError

CHANGED, UNCHANGED = "changed", "unchanged"
_IN_WORDS = {CAUSE_FOUND: CHANGED, NO_DISCREPANCY: UNCHANGED, IMPROVED: UNEXPLAINED}


@dataclass(frozen=True)
class Comparison:
    """What changed between two recordings of one robot.

    Attributes:
        diagnosis: of the later recording without what both share; its robot is the earlier recording's. Told
            backward: of the earlier one; its extended robot is the later one's.
        since: name of the earlier data set.
        name: of the later one.
        rows: of the recording that is diagnosed.
        paired_rows: how many of them pair with rows of the other one; 0 where nothing was compared.
        relative_error: of the earlier recording's model, beside what moved. It is wrong by about as much
            about how much a change does, so that every change's interval is widened by that share of it.
        backward: the earlier recording was explained by what it has and the later one has not.
        left: of both recordings, root mean square by unit, by the earlier robot and the one that changed.
    """

    diagnosis: Diagnosis
    since: str
    name: str
    rows: int
    paired_rows: int
    relative_error: float = 0.0
    backward: bool = False
    left: Mapping[str, float] = field(default_factory=dict)

    @property
    def verdict(self) -> str:
        """Return "changed", "unchanged", "unexplained" or "data_suspect"."""
        return _IN_WORDS.get(self.diagnosis.verdict, self.diagnosis.verdict)

    @property
    def changes(self) -> tuple[Cause, ...]:
        """Return the causes that changed; each number is its change, and `null` 0."""
        share = self.relative_error
        return tuple(
            replace(
                cause,
                parameters={
                    name: change_of(item, share, self.backward) for name, item in cause.parameters.items()
                },
            )
            for cause in self.diagnosis.causes
        )


def check_pair(before: Earlier, after: Dataset) -> None:
    """Raise InputError where two recordings are not of one robot, kind of motion and set of outputs."""
    earlier = before.dataset
    if not before.is_of_report and earlier.robot != after.robot:
        raise InputError(
            f"{after.folder}: is of {after.robot_reference}, the earlier recording of "
            f"{earlier.robot_reference}: both need the same robot"
        )
    if earlier.motion != after.motion:
        raise InputError(f"{after.folder}: both recordings need the same motion, held or dynamic")
    if tuple(earlier.output_channels) != tuple(after.output_channels):
        raise InputError(
            f"{after.folder}: measures {', '.join(after.output_channels)}; the earlier recording "
            f"{', '.join(earlier.output_channels)}: both need the same outputs"
        )


def compared(
    run: Run, base: Baseline, later: Differences, simulation: bool = True, most: int = MOST_CHANGES
) -> Comparison:
    """Return what changed.

    Args:
        run: where to fit.
        base: the earlier recording.
        later: the later one, without what it shares with that.
        simulation: replay the held-out trials in MuJoCo at the end.
        most: causes that may be named.
    """
    if later.prepared.lacking and not run.search_anyway:
        diagnosis = not_searched(later.prepared)
    else:
        diagnosis = investigate_prepared(run, later.prepared, simulation, most).diagnosis
    causes = tuple(new_shapes_as_they_are(cause, base.robot) for cause in diagnosis.causes)
    diagnosis = replace(diagnosis, causes=causes)
    name = later.prepared.dataset.name
    return Comparison(
        diagnosis,
        base.name,
        name,
        later.rows,
        later.paired_rows,
        base.relative_error,
        left=left_by_unit(base, later.prepared.dataset.trials, diagnosis.extended_robot),
    )


def not_compared(before: Dataset, after: Dataset, search_anyway: bool) -> Comparison | None:
    """Return what is told of a later recording that lacks what a comparison needs; None: it can be compared.

    `search_anyway`: it need not be enough to name a change.
    """
    read = readings_of(after)
    if not read.lacking or (search_anyway and read.can_be_fitted):
        return None
    rows = sum(len(trial.inputs) for trial in after.trials)
    return Comparison(not_searched(read), before.name, after.name, rows, paired_rows=0)


def compared_backward(run: Run, base: Baseline, earlier: Differences, simulation: bool = True) -> Comparison:
    """Return what changed, from what explains the earlier recording and the later one has not.

    A dead-band that was taken up, a friction that fell: what is no cause of the later recording's errors, as
    it cannot be negative, is one of the earlier recording's.

    Args:
        run: where to fit.
        base: the later recording.
        earlier: the earlier one, without what it shares with that.
        simulation: as of `compared`.
    """
    found = compared(run, base, earlier, simulation)
    diagnosis = replace(found.diagnosis, extended_robot=base.robot)
    return replace(found, diagnosis=diagnosis, since=found.name, name=found.since, backward=True)


def new_shapes_as_they_are(cause: Cause, earlier: RobotSpec) -> Cause:
    """Return a cause without the null of numbers that say how it acts, where it is new to the earlier robot.

    A time constant of a creep that was not there has not changed from anything.
    """
    shapes = {item.name for item in EFFECTS[cause.name].parameters(earlier) if item.of_shape}
    new = shapes - set(earlier.effects.get(cause.name, {}))
    return replace(
        cause,
        parameters={
            name: replace(item, null=None) if name in new else item for name, item in cause.parameters.items()
        },
    )


def change_of(parameter: FittedParameter, share: float, backward: bool = False) -> FittedParameter:
    """Return a number's change, its interval wider by a share of it.

    A number that changed from an infinite value, or from none, is told as it is. `backward`: what went
    away.
    """
    null = parameter.null
    if null is None or not math.isfinite(null):
        return parameter
    low, high = parameter.ci95
    change = parameter.value - null
    margin = share * abs(change)
    low, high = low - null - margin, high - null + margin
    if backward:
        change, low, high = -change, -high, -low
    return FittedParameter(change, (low, high), 0.0)
