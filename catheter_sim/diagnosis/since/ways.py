"""Other ways to tell two recordings apart, where taking away what both share does not end in one change.

Of the earlier recording only the specimen's numbers are calibrated at first where the rows pair: what it has
besides is taken away with its errors. That is right where causes add up. It is not of a dead-band beside a
dead-band, and a cause that cannot be negative cannot explain by how much less of it there is. So more ways
are tried: from the causes that explain the earlier recording best; from those that its own diagnosis
believes; and backward, the earlier recording explained by what it has and the later one has not. Each is one
more chance to name what is not there, so that it has to be sure.

And what both share is known where both were given the same commands; elsewhere it is a smooth guess, which
may be grossly wrong far from what the earlier recording holds, so that a sound trial of the later one looks
like another robot's. Where its data look wrong, but not by themselves, only the trials that pair are asked.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from catheter_sim.diagnosis.data.trials import Dataset
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.pipeline import investigate_prepared
from catheter_sim.diagnosis.report.result import DATA_SUSPECT, UNEXPLAINED
from catheter_sim.diagnosis.since.baseline import Baseline, baseline
from catheter_sim.diagnosis.since.compare import CHANGED, Comparison, compared, compared_backward
from catheter_sim.diagnosis.since.differences import differences
from catheter_sim.diagnosis.since.one_robot import OneRobot
from catheter_sim.diagnosis.since.pairing import share_paired, shares_paired
from catheter_sim.diagnosis.stages.acquit_trials import acquit_trials
from catheter_sim.diagnosis.stages.calibrate import calibrate
from catheter_sim.diagnosis.stages.find_data_faults import find_data_faults
from catheter_sim.diagnosis.stages.pose import pose
from catheter_sim.diagnosis.stages.prepare import prepare
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.thresholds import EARLIER_CAUSES, LIKELY, MOSTLY_PAIRED, ONE_ROBOT_TIMES
from catheter_sim.errors import InputError


@dataclass
class _Earlier:
    """An earlier recording, explained as well as causes can where that is first asked for."""

    dataset: Dataset
    found: Baseline | None

    def explained(self, run: Run) -> Baseline:
        if self.found is None:
            self.found = baseline(run, self.dataset, is_paired=False)
        return self.found


Way = Callable[[Run, _Earlier, Dataset, bool], Comparison | None]


def told_best(
    run: Run, before: Dataset, after: Dataset, found: Comparison, same: OneRobot | None, simulation: bool
) -> Comparison:
    """Return what changed, told in the first way that names one change; else with the fewest numbers.

    Args:
        run: where to fit; no other way is tried when its time is up.
        before, after: the recordings; the first holds more than its noise.
        found: what was told at first. Other ways are tried where it names several changes, or none of what
            there is.
        same: asked before a change is told, where the rows do not pair.
        simulation: replay the held-out trials in MuJoCo at the end.
    """
    if found.verdict == DATA_SUSPECT and time.monotonic() < run.deadline:
        found = _of_paired_trials(run, before, after, simulation) or found
    if same is not None and same.is_as_good(run, found):
        return same.told(run, found, simulation)
    ways: tuple[Way, ...] = (_from_best_causes, _from_own_causes, _backward)
    if same is not None:
        ways = ways[1:]  # it was the first
    earlier = _Earlier(before, None if same is None else same.base)
    for way in ways:
        if found.verdict not in (CHANGED, UNEXPLAINED) or len(found.changes) == 1:
            break
        if time.monotonic() >= run.deadline:
            break
        other = way(run, earlier, after, simulation)
        if other is None or not _tells_more(other, found):
            continue
        if same is None or not same.is_as_good(run, other):
            found = other
    return found


def _tells_more(other: Comparison, found: Comparison) -> bool:
    """Return whether a further way names what the first did not, or not surely, or by more numbers."""
    if other.verdict != CHANGED or any(cause.probability < LIKELY for cause in other.changes):
        return False
    worse = max(other.left[unit] / max(left, 1e-12) for unit, left in found.left.items())
    if found.verdict == CHANGED:
        unsure = any(cause.probability < LIKELY for cause in found.changes)
        return worse < ONE_ROBOT_TIMES and (unsure or _numbers(other) < _numbers(found))
    return worse < 1.0


def _numbers(found: Comparison) -> float:
    """Return how many numbers the changes have; without end where none is named."""
    return sum(len(cause.parameters) for cause in found.changes) or float("inf")


def _of_paired_trials(run: Run, before: Dataset, after: Dataset, simulation: bool) -> Comparison | None:
    """Return what changed in the trials that pair; None: too few do, or the data look wrong by themselves."""
    pairs = [share >= MOSTLY_PAIRED for share in shares_paired(after, before)]
    if sum(pairs) < 2 or all(pairs):
        return None
    posed = pose(prepare(after))
    calibrated = calibrate(posed)
    if acquit_trials(run, posed, calibrated, find_data_faults(posed, calibrated)).found:
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


def _from_best_causes(run: Run, earlier: _Earlier, after: Dataset, simulation: bool) -> Comparison:
    """Return what changed since the robot that explains the earlier recording best, believed or not."""
    base = earlier.explained(run)
    return compared(run, base, differences(after, base), simulation)


def _from_own_causes(run: Run, earlier: _Earlier, after: Dataset, simulation: bool) -> Comparison | None:
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


def _backward(run: Run, earlier: _Earlier, after: Dataset, simulation: bool) -> Comparison | None:
    """Return what changed, by what explains the earlier recording and the later one has not."""
    before = earlier.dataset
    try:
        base = baseline(run, after, is_paired=share_paired(before, after) >= MOSTLY_PAIRED)
    except InputError:  # the later recording looks wrong by itself: it explains nothing
        return None
    return compared_backward(run, base, differences(before, base), simulation)
