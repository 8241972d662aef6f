"""What changed between two recordings of one robot: both are explained together."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import read_inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.changes.differences import (
    Baseline,
    Differences,
    baseline,
    differences,
    errors_with,
    left_by_unit,
    share_paired,
    shares_paired,
)
from catheter_sim.diagnosis.choose import choose_causes, without_explained_faults
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.fit import robot_with
from catheter_sim.diagnosis.frame import registered, unmoved
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.pipeline import investigate_prepared
from catheter_sim.diagnosis.prepare import (
    DiagnosisRun,
    Faults,
    Prepared,
    calibrate,
    find_data_faults,
    not_searched,
    prepare,
    readings_of,
    split_problem,
)
from catheter_sim.diagnosis.report import INPUT
from catheter_sim.diagnosis.result import (
    CAUSE_FOUND,
    DATA_SUSPECT,
    IMPROVED,
    NO_DISCREPANCY,
    UNEXPLAINED,
    Cause,
    DiagnosisResult,
    FittedParameter,
)
from catheter_sim.diagnosis.thresholds import EARLIER_CAUSES, MOSTLY_PAIRED
from catheter_sim.diagnosis.trials import Dataset, Trial, split_trials
from catheter_sim.diagnosis.words import listed, words
from catheter_sim.effects import EFFECTS
from catheter_sim.errors import InputError
from catheter_sim.tables import read_table

MOST_CHANGES = 4
"""[causes] At most this many may have changed. Why: assumed. Nobody changes more at once."""
LIKELY = 0.75
"""[probability] Another explanation of the two recordings counts only if each change that it names has at
least this probability. Why: assumed, three to one. Each further explanation is one more chance to name what
is not there."""
ONE_ROBOT_TIMES = 1.25
"""[times the error] One robot for both recordings, or a simpler explanation, is as good if it leaves at most
this. Why: learned on tuning draws. It left 1.6 to 18 times the error in 17 named changes that were there, and
0.96 in the one that was not."""

# ----------------------------------------------------------------------------------------------------
# An earlier recording: a data set, or the folder of its finished report.

REPORT = "diagnosis.json"


@dataclass(frozen=True)
class Earlier:
    """An earlier recording.

    Where it `is_of_report`, its robot is the one that a finished report found, calibrated and with causes in
    it; otherwise the robot as specified.
    """

    dataset: Dataset
    is_of_report: bool = False


def earlier_recording(where: Dataset | Path, later: Dataset) -> Earlier:
    """Return an earlier recording.

    Raises:
        InputError: there is no data set and no finished report, or it cannot be compared.
    """
    if isinstance(where, Dataset):
        return Earlier(where)
    if is_report(where):
        return Earlier(recording_of_report(where, later), is_of_report=True)
    return Earlier(load_dataset(where))


def is_report(folder: Path) -> bool:
    """Return whether a folder is a finished report's."""
    return (folder / REPORT).is_file() and not (folder / "dataset.toml").is_file()


def recording_of_report(folder: Path, later: Dataset) -> Dataset:
    """Return the recording that a report is about, with the robot that the report found.

    Conditions and outputs are taken to be those of the later recording.

    Raises:
        InputError: the report is not complete, is of other outputs, or its tracker stood elsewhere than the
            base frame.
    """
    document = _document(folder / REPORT)
    if document.get("since", {}).get("backward"):
        raise InputError(f"{folder}: its series are of the recording before: give the data set itself")
    if document.get("registration", {}).get("applied"):
        raise InputError(
            f"{folder}: its measurements were moved into the robot's base frame: give the data set itself"
        )
    robot = load_robot(folder / "robot.toml")
    files = sorted(folder.glob("fitted_*.csv"))
    if not files:
        raise InputError(f"{folder}: no fitted_*.csv: not a finished report")
    trials = []
    for path in files:
        table = read_table(path)
        for name in later.output_channels:
            if name not in table.columns:
                raise InputError(f"{path}: no column {name}, which the later recording measures")
        given = {
            name.removeprefix(INPUT): values
            for name, values in table.columns.items()
            if name.startswith(INPUT)
        }
        if not given:
            raise InputError(f"{path}: no columns {INPUT}...: written by an earlier version, diagnose again")
        measured = {name: table.columns[name] for name in later.output_channels}
        role = "heldout" if path.name.startswith("fitted_heldout") else "train"
        trials.append(
            Trial(
                path.name,
                role,
                read_inputs(robot, replace(table, columns=given)),
                replace(table, columns=measured),
            )
        )
    return replace(
        later,
        folder=folder,
        name=str(document.get("dataset", folder.name)),
        robot=robot,
        trials=tuple(trials),
        calibration=(),
    )


def _document(path: Path) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    if not isinstance(document, dict) or "verdict" not in document:
        raise InputError(f"{path}: not the diagnosis.json of a finished report")
    return document


# ----------------------------------------------------------------------------------------------------
# What changed from one recording of a robot to another.

CHANGED, UNCHANGED = "changed", "unchanged"
_IN_WORDS = {CAUSE_FOUND: CHANGED, NO_DISCREPANCY: UNCHANGED, IMPROVED: UNEXPLAINED}


@dataclass(frozen=True)
class Changes:
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

    diagnosis: DiagnosisResult
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
            f"{', '.join(earlier.output_channels)}. Both need the same outputs"
        )


def compared(
    run: DiagnosisRun, base: Baseline, later: Differences, simulation: bool = True, most: int = MOST_CHANGES
) -> Changes:
    """Return what changed.

    `later` is without what it shares with the earlier recording; at most `most` causes are named.
    """
    if later.prepared.lacking and not run.search_anyway:
        diagnosis = not_searched(later.prepared)
    else:
        diagnosis = investigate_prepared(run, later.prepared, simulation, most).diagnosis
    causes = tuple(new_shapes_as_they_are(cause, base.robot) for cause in diagnosis.causes)
    diagnosis = replace(diagnosis, causes=causes)
    name = later.prepared.dataset.name
    return Changes(
        diagnosis,
        base.name,
        name,
        later.rows,
        later.paired_rows,
        base.relative_error,
        left=left_by_unit(base, later.prepared.dataset.trials, diagnosis.extended_robot),
    )


def not_compared(before: Dataset, after: Dataset, search_anyway: bool) -> Changes | None:
    """Return the report on a later recording that lacks what a comparison needs; None: it lacks nothing.

    `search_anyway`: it need not be enough to name a change.
    """
    read = readings_of(after)
    if not read.lacking or (search_anyway and read.can_be_fitted):
        return None
    rows = sum(len(trial.inputs) for trial in after.trials)
    return Changes(not_searched(read), before.name, after.name, rows, paired_rows=0)


def compared_backward(
    run: DiagnosisRun, base: Baseline, earlier: Differences, simulation: bool = True
) -> Changes:
    """Return what changed, from what explains the earlier recording and the later one has not.

    A dead-band that was taken up, a friction that fell: what is no cause of the later recording's errors, as
    it cannot be negative, is one of the earlier recording's.

    `base` is the later recording, and `earlier` without what it shares with that.
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

    A number that changed from an infinite value, or from none, is reported as it is. `backward`: what went
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


# ----------------------------------------------------------------------------------------------------
# Whether one robot, the same in both recordings, explains them as well as one that changed.
#
# Where the later recording has other commands, what both share is known only as far as the earlier one's
# causes say it. They may be others than the true ones: then they err on other commands, and that looks like
# a change. So causes are chosen again for both recordings together. A robot that changed cannot be explained
# so.


@dataclass
class OneRobot:
    """The robot that is the same in both recordings, worked out where it is first asked for.

    `later` is the later recording `after` without what it shares with the earlier one.
    """

    base: Baseline
    after: Dataset
    later: Differences
    _left: Mapping[str, float] = field(default_factory=dict)

    def is_as_good(self, run: DiagnosisRun, found: Changes) -> bool:
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

    def instead_of(self, run: DiagnosisRun, found: Changes, simulation: bool) -> Changes:
        """Return what is reported instead of changes that it explains as well."""
        note = Note(
            "one_robot",
            f"{listed([words(cause.name) for cause in found.changes])} would explain the later recording. "
            "But one unchanged robot explains both recordings equally well, so no change is shown. Repeat "
            "the earlier recording's commands.",
        )
        unchanged = compared(run, self.base, self.later, simulation, most=0)
        notes = (*unchanged.diagnosis.notes, note)
        return replace(unchanged, diagnosis=replace(unchanged.diagnosis, notes=notes))


def _one_robot(run: DiagnosisRun, base: Baseline, after: Dataset) -> RobotSpec:
    """Return the robot with the causes that explain both recordings, believed or not."""
    moved = registered(after, base.registration)
    trials = (*_named(base.dataset.trials, "earlier"), *_named(moved.trials, "later"))
    both = replace(base.dataset, trials=trials)
    split = split_problem(
        Prepared(both, *split_trials(both), registration=unmoved(base.registration), twin=base.twin)
    )
    chosen = choose_causes(run, split, Faults(()), EARLIER_CAUSES).fit
    return robot_with(split.train, chosen.numbers, chosen.x)


def _named(trials: tuple[Trial, ...], recording: str) -> list[Trial]:
    return [replace(trial, file=f"{recording}, {trial.file}") for trial in trials]


# ----------------------------------------------------------------------------------------------------
# Other ways to tell two recordings apart, where taking away what both share does not end in one change.
#
# Of the earlier recording only the specimen's numbers are calibrated at first where the rows pair: what it
# has besides is taken away with its errors. That is right where causes add up. It is not of a dead-band
# beside a dead-band, and a cause that cannot be negative cannot explain by how much less of it there is. So
# more ways are tried: from the causes that explain the earlier recording best; from those that its own
# diagnosis believes; and backward, the earlier recording explained by what it has and the later one has
# not. Each is one more chance to name what is not there, so that it has to be sure.
#
# And what both share is known where both were given the same commands; elsewhere it is a smooth guess,
# which may be grossly wrong far from what the earlier recording holds, so that a sound trial of the later
# one looks like another robot's. Where its data look wrong, but not by themselves, only the trials that
# pair are asked.


@dataclass
class _Earlier:
    """An earlier recording, explained as well as causes can where that is first asked for."""

    dataset: Dataset
    found: Baseline | None

    def explained(self, run: DiagnosisRun) -> Baseline:
        if self.found is None:
            self.found = baseline(run, self.dataset, is_paired=False)
        return self.found


Way = Callable[[DiagnosisRun, _Earlier, Dataset, bool], Changes | None]


def best_comparison(
    run: DiagnosisRun,
    before: Dataset,
    after: Dataset,
    found: Changes,
    same: OneRobot | None,
    simulation: bool,
) -> Changes:
    """Return what changed, by the first way that names one change; else with the fewest numbers.

    Other ways are tried, while there is time, where the first one found several changes or none of what
    there is. `same` is asked before a change is reported; None where the rows pair.
    """
    if found.verdict == DATA_SUSPECT and time.monotonic() < run.deadline:
        found = _of_paired_trials(run, before, after, simulation) or found
    if same is not None and same.is_as_good(run, found):
        return same.instead_of(run, found, simulation)
    ways: tuple[Way, ...] = (_from_best_causes, _from_own_causes, _backward)
    if same is not None:
        ways = ways[1:]  # it was the first
    earlier = _Earlier(before, None if same is None else same.base)
    for way in ways:
        if found.verdict not in (CHANGED, UNEXPLAINED):
            break
        if found.verdict == CHANGED and len(_corrected(found)) == 1:
            break
        if time.monotonic() >= run.deadline:
            break
        other = way(run, earlier, after, simulation)
        if other is None or not _tells_more(other, found):
            continue
        if same is None or not same.is_as_good(run, other):
            found = other
    return found


def _tells_more(other: Changes, found: Changes) -> bool:
    """Return whether a further way names what the first did not, or not surely, or by more numbers."""
    if other.verdict != CHANGED or any(cause.probability < LIKELY for cause in other.changes):
        return False
    worse = max(other.left[unit] / max(left, 1e-12) for unit, left in found.left.items())
    if found.verdict == CHANGED:
        unsure = any(cause.probability < LIKELY for cause in _corrected(found))
        return worse < ONE_ROBOT_TIMES and (unsure or _numbers(other) < _numbers(found))
    return worse < 1.0


def _corrected(found: Changes) -> tuple[Cause, ...]:
    """Return all causes of the hypothesis of a comparison: those that are named, and the others."""
    return (*found.changes, *found.diagnosis.corrections)


def _numbers(found: Changes) -> float:
    """Return how many numbers they have; without end where there is none."""
    return sum(len(cause.parameters) for cause in _corrected(found)) or float("inf")


def _of_paired_trials(run: DiagnosisRun, before: Dataset, after: Dataset, simulation: bool) -> Changes | None:
    """Return what changed in the trials that pair; None: too few do, or the data look wrong by themselves."""
    pairs = [share >= MOSTLY_PAIRED for share in shares_paired(after, before)]
    if sum(pairs) < 2 or all(pairs):
        return None
    split = split_problem(prepare(after))
    calibrated = calibrate(split)
    if without_explained_faults(run, split, calibrated, find_data_faults(split, calibrated)).found:
        return None
    files = ", ".join(item.file for item, is_pair in zip(after.trials, pairs, strict=True) if not is_pair)
    note = Note(
        "unpaired_left_out",
        f"Nothing in the earlier recording pairs with {files}. Only the other trials were compared.",
    )
    kept = [replace(item, role="") for item, is_pair in zip(after.trials, pairs, strict=True) if is_pair]
    base = baseline(run, before, is_paired=True)
    dataset = replace(after, trials=tuple(kept), notes=(*after.notes, note))
    found = compared(run, base, differences(dataset, base), simulation)
    return None if found.verdict == DATA_SUSPECT else found


def _from_best_causes(run: DiagnosisRun, earlier: _Earlier, after: Dataset, simulation: bool) -> Changes:
    """Return what changed since the robot that explains the earlier recording best, believed or not."""
    base = earlier.explained(run)
    return compared(run, base, differences(after, base), simulation)


def _from_own_causes(
    run: DiagnosisRun, earlier: _Earlier, after: Dataset, simulation: bool
) -> Changes | None:
    """Return what changed since the robot that the earlier recording's own diagnosis found; None: none."""
    base = earlier.explained(run)
    before = earlier.dataset
    choice = None if base.notes else base.choice
    own = investigate_prepared(run, prepare(before), False, EARLIER_CAUSES, choice).diagnosis
    if not own.is_corrected or own.registration.get("applied"):
        return None
    known = replace(before, robot=own.extended_robot, calibration=())
    base = baseline(run, known, is_paired=share_paired(after, before) >= MOSTLY_PAIRED)
    return compared(run, base, differences(after, base), simulation)


def _backward(run: DiagnosisRun, earlier: _Earlier, after: Dataset, simulation: bool) -> Changes | None:
    """Return what changed, by what explains the earlier recording and the later one has not."""
    before = earlier.dataset
    try:
        base = baseline(run, after, is_paired=share_paired(before, after) >= MOSTLY_PAIRED)
    except InputError:  # the later recording looks wrong by itself: it explains nothing
        return None
    return compared_backward(run, base, differences(before, base), simulation)
