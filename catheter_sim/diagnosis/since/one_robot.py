"""Whether one robot, the same in both recordings, explains them as well as one that changed.

Where the later recording has other commands, what both share is known only as far as the earlier one's causes
say it. They may be others than the true ones: then they err on other commands, and that looks like a change.
So causes are chosen anew for both recordings together. A robot that changed cannot be explained so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.base_frame.move import registered
from catheter_sim.diagnosis.base_frame.registration import unmoved
from catheter_sim.diagnosis.data.parting import split
from catheter_sim.diagnosis.data.trials import Dataset, Trial
from catheter_sim.diagnosis.fitting.prediction import robot_with
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report.wording import listed, words
from catheter_sim.diagnosis.since.baseline import Baseline, errors_with, left_by_unit
from catheter_sim.diagnosis.since.compare import CHANGED, Comparison, compared
from catheter_sim.diagnosis.since.differences import Differences, differences
from catheter_sim.diagnosis.stages.choose_causes import choose_causes
from catheter_sim.diagnosis.stages.find_data_faults import Faults
from catheter_sim.diagnosis.stages.pose import pose
from catheter_sim.diagnosis.stages.prepare import Prepared
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.thresholds import EARLIER_CAUSES, ONE_ROBOT_TIMES


@dataclass
class OneRobot:
    """The robot that is the same in both recordings, worked out where it is first asked for.

    Attributes:
        base: the earlier recording.
        after: the later one.
        later: the same, without what it shares with the earlier one.
    """

    base: Baseline
    after: Dataset
    later: Differences
    _left: Mapping[str, float] = field(default_factory=dict)

    def is_as_good(self, run: Run, found: Comparison) -> bool:
        """Return whether it explains both recordings as well as a robot that changed."""
        if found.verdict != CHANGED:
            return False
        if not self._left:
            run.say("asking whether one robot explains both recordings")
            robot = _one_robot(run, self.base, self.after)
            earlier = errors_with(self.base.problem, robot, self.base.dataset.trials)
            same = replace(self.base, robot=robot, errors=earlier)
            there = differences(self.after, same).prepared.dataset.trials
            self._left = left_by_unit(same, there, robot)
        times = max(self._left[unit] / max(value, 1e-12) for unit, value in found.left.items())
        return times <= ONE_ROBOT_TIMES

    def told(self, run: Run, found: Comparison, simulation: bool) -> Comparison:
        """Return what is told instead of changes that it explains as well.

        Args:
            run: where to fit.
            found: the changes.
            simulation: replay the held-out trials in MuJoCo at the end.
        """
        note = Note(
            "one_robot",
            f"{listed([words(cause.name) for cause in found.changes])} would explain the later recording. "
            "But one unchanged robot explains both recordings equally well, so no change is shown. Repeat "
            "the earlier recording's commands.",
        )
        told = compared(run, self.base, self.later, simulation, most=0)
        return replace(told, diagnosis=replace(told.diagnosis, notes=(*told.diagnosis.notes, note)))


def _one_robot(run: Run, base: Baseline, after: Dataset) -> RobotSpec:
    """Return the robot with the causes that explain both recordings, believed or not."""
    moved = registered(after, base.registration)
    trials = (*_named(base.dataset.trials, "earlier"), *_named(moved.trials, "later"))
    both = replace(base.dataset, trials=trials)
    posed = pose(Prepared(both, *split(both), unmoved(base.registration), base.twin, ()))
    chosen = choose_causes(run, posed, Faults(()), EARLIER_CAUSES).fit
    return robot_with(posed.train, chosen.numbers, chosen.x)


def _named(trials: tuple[Trial, ...], recording: str) -> list[Trial]:
    return [replace(trial, file=f"{recording}, {trial.file}") for trial in trials]
