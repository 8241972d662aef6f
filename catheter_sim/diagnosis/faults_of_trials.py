"""Faults of whole trials: odd ones, moved ones, and mistakes of one trial alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import drives_of
from catheter_sim.core.inputs import Inputs, Quantity
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.faults_of_columns import (
    BesideModel,
    Mistake,
    delayed,
    errors_in_noise,
    most_likely_mistake,
)
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.result import DataFault
from catheter_sim.diagnosis.thresholds import (
    BUMP_ROWS,
    BUMP_SAME_INPUTS,
    GROSS_SHARE,
    LATE_NOISE,
    LATE_ROWS,
    MISTAKE_SOLVED_SHARE,
    NO_EQUILIBRIUM_ERROR,
    STEP_STRETCH_ROWS,
)
from catheter_sim.diagnosis.trials import Trial

OUTLYING_FACTOR = 4.0
"""[times the noise, and times the largest error of the other trials] A trial that errs by more is odd. Why:
assumed. Specimens and set-ups differ by more than trials of one do."""
OTHERS_NEAR_NOISE = 2.0
"""[times the noise] The other trials must err by less. Why: only then would there be no discrepancy without
the odd trial."""
ZERO_CONVINCING = 0.35
"""[error with the zero of one trial's inputs put right over the error with it as given] Below this ratio the
zero is off. Why: a number is fitted here, and takes a part of any error."""
ZERO_TIMES = 1.8
"""[times the largest error of the other trials] From here on, the diagnosis checks the zero of that one
trial. Why: zeros that differ from trial to trial are a cause. None of 123 sound sets had a trial that stood
out so far."""
MOVED_NOISE = 6.0
"""[times the noise] If a tracker was moved between trials, points must lie elsewhere by this much. Why:
assumed. Less is hardly more than a row's noise, and no cause is made of it."""
MOVED_LEFT_SHARE = 0.15
"""[share of that distance] At most this is left when the trials are moved back as one body. Why: assumed. A
robot that changed moves its tip, and not its base."""
MOVED_FIRST_NOISE = 3.0
"""[times the noise] The first rows must also lie elsewhere by this much. Why: it is five standard errors of
their mean."""
MOVED_FIRST_ROWS = 3
"""[rows] The mean of this many at a trial's start is its first place. Why: assumed. Few trials rest for
longer."""
MOVED_ROWS = 300
"""[rows] This many of each trial are compared. Why: more rows of the same motion say nothing new."""
ONE_TRIAL_TIMES = 1.5
"""[times the error of the middle trial] From here on, a mistake is looked for in one trial. Why: assumed. A
cause is at work in all trials, in some more than in others."""
ZEROS_TRIED = (0.05, 0.1, 0.15, 0.2, 0.25)
"""[share of the largest input] The zero of one trial's inputs may be off by these amounts. Why: the nearest
of them takes three quarters of any error in between. Less than a twentieth is a small error."""
LONE_FOLLOWS_SHARE = 0.5
"""[share of a trial's variance] If the model, now or some rows earlier, explains less of it, the trial
follows nothing. Why: assumed. With causes of the list, 3 of 123 sound data sets had a trial that followed by
less, but not alone."""
OTHERS_FOLLOW_SHARE = 0.97
"""[share of a trial's variance] In every other trial, the model must explain more than this. Why: in sound
data sets with such a trial, another one followed by 0.94 at most."""
LONE_MOTION_SHARE = 0.5
"""[share of the middle trial's motion] A trial that should move less is not checked. Why: play or friction
may take most of a small motion."""
OUTSTANDING_SHARE = 0.25
"""[share of the motion] A trial with a smaller error does not stand out. Why: assumed. Near the noise, trials
differ by chance."""
OUTSTANDING_TIMES = 2.5
"""[times the largest error of the other trials] A trial with a larger error stands out. Why: of 123 sound
sets, most with causes, one trial erred 1.4 times as much as any other. In one set, two trials erred 2.1 times
as much."""

# ----------------------------------------------------------------------------------------------------
# One trial, or two, that the model errs in far more than in any other.


def outstanding_trials(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return the trials in which the model errs far more than in all others, at most a third of them.

    A cause of an error is at work in all trials, more in some and less in others; no gap lies between them.
    Nor does a trial follow its inputs no more where all others do.
    """
    return _far_worse(seen) or _following_nothing(seen)


def _far_worse(seen: BesideModel) -> tuple[DataFault, ...]:
    known = np.flatnonzero(seen.error_shares < NO_EQUILIBRIUM_ERROR)  # without a posture a model says nothing
    order = known[np.argsort(seen.error_shares[known])[::-1]].tolist()
    for count in range(1, len(order) // 3 + 1):
        odd, least = order[:count], seen.error_shares[order[count - 1]]
        next_one = seen.error_shares[order[count]]
        if least > max(OUTSTANDING_SHARE, OUTSTANDING_TIMES * next_one):
            return tuple(
                DataFault(
                    f"The model misses this trial by {100.0 * seen.error_shares[number]:.0f} % of the "
                    f"motion, every other trial by at most {100.0 * next_one:.0f} %. Are these the outputs "
                    "of this trial, of this robot, in the same set-up?",
                    seen.trials[number].file,
                )
                for number in sorted(odd)
            )
    return ()


def _following_nothing(seen: BesideModel) -> tuple[DataFault, ...]:
    shares = {number: _followed(seen, number) for number in range(len(seen.trials))}
    known = {number: share for number, share in shares.items() if share is not None}
    if len(known) < 3:
        return ()
    order = sorted(known, key=lambda number: known[number])
    if known[order[0]] > LONE_FOLLOWS_SHARE or known[order[1]] < OTHERS_FOLLOW_SHARE:
        return ()
    return (
        DataFault(
            "The outputs do not follow the inputs, as they do in every other trial. Are these the outputs of "
            "this trial, with their rows in order?",
            seen.trials[order[0]].file,
        ),
    )


def _followed(seen: BesideModel, number: int) -> float | None:
    """Return the share of the outputs' variance that is what the model says, now or some rows before.

    In any size; adjusted for the count of numbers fitted. None: the trial moves too little to tell.
    """
    if seen.motions[number] < LONE_MOTION_SHARE * float(np.median(seen.motions)):
        return None
    measured, model = seen.measured[number], seen.models[number]
    left = total = 0.0
    count = numbers = 0
    for column in seen.moves:
        computed = model[:, column]
        known = np.isfinite(measured[:, column])
        if known.sum() < STEP_STRETCH_ROWS:
            continue
        if float(np.std(computed[known])) < LATE_NOISE * seen.noise_of(column):
            continue
        late = [delayed(computed, rows) for rows in LATE_ROWS]
        features = np.column_stack([np.ones(len(computed)), computed, *late])[known]
        shown = measured[known, column]
        scaled = features / np.maximum(np.abs(features).max(axis=0), 1e-300)
        rest = shown - scaled @ np.linalg.lstsq(scaled, shown, rcond=None)[0]
        left, total = left + float(rest @ rest), total + len(shown) * float(np.var(shown))
        count, numbers = count + len(shown), numbers + features.shape[1]
    return 1.0 - left / (count - numbers) * count / total if total > 0.0 else None


# ----------------------------------------------------------------------------------------------------
# One trial that errs where all others agree: another robot, or another set-up.


def odd_trial(
    problem: Problem, before: Fit, heldout: Sequence[Trial], noise: Mapping[str, float]
) -> tuple[DataFault, ...]:
    """Return what to say of one trial that errs where all others agree with a model calibrated to them."""
    trials = (*problem.trials, *heldout)
    if len(trials) < 3:
        return ()
    errors = errors_in_noise(problem, before, trials, noise)
    odd = int(np.argmax(errors))
    others = [trial for index, trial in enumerate(trials) if index != odd]
    if errors[odd] <= OUTLYING_FACTOR:
        return ()
    if odd < len(problem.trials):
        rest = replace(problem, trials=tuple(item for item in problem.trials if item is not trials[odd]))
        if not rest.trials:
            return ()
        before = fit(rest, (), cross_validate=False)
    most = errors_in_noise(problem, before, others, noise).max()
    alone = float(errors_in_noise(problem, before, [trials[odd]], noise)[0])
    if alone <= OUTLYING_FACTOR * max(most, 1.0) or most > OTHERS_NEAR_NOISE:
        return ()
    return (
        DataFault(
            f"The model misses this trial by {alone:.0f} times the noise and agrees with all other trials "
            f"(at most {most:.1f} times). Was it another robot or set-up?",
            trials[odd].file,
        ),
    )


# ----------------------------------------------------------------------------------------------------
# A tracker, or a robot's base, that was moved between trials.


@dataclass(frozen=True)
class _Moved:
    """Trials whose points lie elsewhere at the same inputs, by one rigid motion.

    `before` and `left` are the distance from the same rows of other trials, without and with the motion, root
    mean square [mm].
    """

    trials: tuple[int, ...]
    before: float
    left: float


def moved_between_trials(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return from which trial on, or in which one, all points lie elsewhere by one rigid motion.

    Rows of these trials are compared with rows of the others that have nearly the same inputs and move the
    same way; what a wrong model says of both cancels. The motion must take nearly all of the difference, and
    that of the first rows: no cause of an error of the model is at work before a robot was driven.
    """
    count = len(seen.trials)
    if count < 3 or not seen.points:
        return ()
    groups = [tuple(range(first, count)) for first in range(1, count)]
    groups += [(number,) for number in range(count - 1)]
    tried = [item for item in (_moved(seen, group) for group in groups) if item is not None]
    best = min(tried, key=lambda item: item.left / item.before, default=None)
    if best is None:
        return ()
    first = seen.trials[best.trials[0]].file
    where = "in this trial" if len(best.trials) == 1 else f"from this trial on ({len(best.trials)} trials)"
    return (
        DataFault(
            f"All points lie elsewhere {where}, from the first rows on: {best.before:.2g} mm from the "
            f"other trials at the same inputs. Moved back as one body, {best.left:.2g} mm are left. Was the "
            "tracker, or the robot's base, moved? Measure again, or leave these trials out.",
            first,
        ),
    )


def _moved(seen: BesideModel, group: tuple[int, ...]) -> _Moved | None:
    """Return what moving a group of trials back as one body would do; None: they were not moved."""
    others = [number for number in range(len(seen.trials)) if number not in group]
    here, there = _pairs(seen, group, others)
    if len(here) < BUMP_ROWS:
        return None
    turn, shift = _rigid_motion(here.reshape(-1, here.shape[-1]), there.reshape(-1, here.shape[-1]))
    before, left = _rms(here - there), _rms(here @ turn.T + shift - there)
    if before < MOVED_NOISE * seen.noise_mm or left > MOVED_LEFT_SHARE * before + seen.noise_mm:
        return None
    first_here, first_there = _first(seen, group), _first(seen, others)
    off = first_here - first_there
    rest = first_here @ turn.T + shift - first_there
    if _rms(off) < MOVED_FIRST_NOISE * seen.noise_mm or _rms(rest) > MOVED_LEFT_SHARE * _rms(off):
        return None
    return _Moved(group, before, left)


def _pairs(seen: BesideModel, group: tuple[int, ...], others: list[int]) -> tuple[Array, Array]:
    """Return points (k, points, axes) of a group's rows, and of other trials' rows at the same inputs.

    What the inputs still differ by is taken off with the model's help.
    """
    mine = [_rows(seen, number) for number in group]
    theirs = [_rows(seen, number) for number in others]
    drive, way, points, model = (np.concatenate(parts) for parts in zip(*mine, strict=True))
    other_drive, other_way, other_points, other_model = (
        np.concatenate(parts) for parts in zip(*theirs, strict=True)
    )
    here, there = [], []
    for row in range(len(drive)):
        distance = np.abs(other_drive - drive[row]).max(axis=1)
        distance = np.where(other_way @ way[row] >= 0.0, distance, np.inf)
        near = int(np.argmin(distance)) if len(distance) else 0
        if len(distance) and distance[near] < BUMP_SAME_INPUTS:
            here.append(points[row])
            there.append(other_points[near] + model[row] - other_model[near])
    shape = (0, *points.shape[1:])
    return (np.array(here), np.array(there)) if here else (np.zeros(shape), np.zeros(shape))


def _rows(seen: BesideModel, number: int) -> tuple[Array, Array, Array, Array]:
    """Return of a trial's rows without missing values, at most so many: inputs, their way, points, model."""
    columns = np.array(seen.points)
    points, model = seen.measured[number][:, columns], seen.models[number][:, columns]
    drive = seen.drives[number]
    known = np.flatnonzero(np.isfinite(points).all(axis=(1, 2)))
    known = known[:: max(1, len(known) // MOVED_ROWS)]
    way = np.gradient(drive, axis=0) if len(drive) > 1 else np.zeros_like(drive)
    return drive[known], way[known], points[known], model[known]


def _first(seen: BesideModel, group: tuple[int, ...] | list[int]) -> Array:
    """Return where points lie in the first rows of some trials, the model's motion since taken off."""
    columns = np.array(seen.points)
    found = []
    for number in group:
        error = seen.errors[number][:, columns]
        known = np.flatnonzero(np.isfinite(error).all(axis=(1, 2)))[:MOVED_FIRST_ROWS]
        found.append(error[known].mean(axis=0) + seen.models[number][0, columns])
    return np.asarray(np.nanmedian(np.array(found), axis=0))


def _rigid_motion(points: Array, targets: Array) -> tuple[Array, Array]:
    """Return the turn (a, a) and the shift (a,) that lay points (n, a) over targets best (Kabsch 1976)."""
    middle, goal = points.mean(axis=0), targets.mean(axis=0)
    u, _, v = np.linalg.svd((points - middle).T @ (targets - goal))
    mirror = np.ones(points.shape[1])
    mirror[-1] = np.sign(np.linalg.det(v.T @ u.T)) or 1.0
    turn = v.T @ np.diag(mirror) @ u.T
    return turn, goal - turn @ middle


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


# ----------------------------------------------------------------------------------------------------
# One trial with columns swapped, turned in sign, in another unit, or with its inputs' zero off.


def mistakes_of_one_trial(
    seen: BesideModel, robot: RobotSpec, predict: Callable[[Inputs], Array]
) -> tuple[DataFault, ...]:
    """Return the trials in which the model errs far more than in others, but for one mistake.

    In the middle trial it must err far less: a cause of an error is at work in all of them. With the mistake
    put right the model must meet the trial no worse than that one, or well.
    """
    errors = seen.error_shares
    usual = float(np.median(errors))
    faults = []
    for number in np.argsort(errors)[::-1].tolist():
        if errors[number] <= ONE_TRIAL_TIMES * usual:
            break
        trial = seen.trials[number]
        found = None
        if errors[number] > GROSS_SHARE:
            everything = np.concatenate(list(seen.models))
            found = most_likely_mistake(
                [trial],
                seen.columns,
                robot,
                predict,
                beside=everything,
                solved=max(MISTAKE_SOLVED_SHARE, usual),
            )
        if errors[number] > ZERO_TIMES * np.delete(errors, number).max():
            found = found or _zero_off(seen, number, robot, predict, usual)
        if found is not None:
            faults.append(
                DataFault(
                    f"{found.words}. If you correct that, the model's error falls from "
                    f"{100 * found.before:.0f} to {100 * found.error:.0f} % of the spread. The other trials "
                    "have no such mistake.",
                    trial.file,
                )
            )
    return tuple(faults)


def _zero_off(
    seen: BesideModel, number: int, robot: RobotSpec, predict: Callable[[Inputs], Array], usual: float
) -> Mistake | None:
    """Return how far the zero of a trial's inputs looks off; None: it does not, or something else is wrong.

    In several trials that is a cause. With it put right this trial must be explained about as well as others.
    """
    given = seen.trials[number].inputs
    drives = drives_of(robot, given.actuation)
    count = given.tendon.shape[1]
    largest = np.max([np.abs(trial.inputs.tendon).max(axis=0) for trial in seen.trials], axis=0)
    moved = np.flatnonzero(largest > 0.0)
    choices = [(largest, "the inputs")]
    if len(drives) == count and len(moved) > 1:
        choices += [(largest * (np.arange(count) == k), drives[k].column) for k in moved.tolist()]
    before = float(seen.error_shares[number])
    best = Mistake("", before)
    for zero, name in choices:
        for share in (sign * size for size in ZEROS_TRIED for sign in (1.0, -1.0)):
            tendon = given.tendon - share * zero
            if drives[0].quantity is Quantity.TENSION:
                tendon = np.maximum(tendon, 0.0)
            error = seen.error_share(number, predict(replace(given, tendon=tendon)))
            if error < best.error:
                words = f"The zero of {name} looks off by about {100 * share:.0f} % of the largest value"
                best = Mistake(words, error, before)
    solved = best.error < min(ZERO_CONVINCING * before, max(ONE_TRIAL_TIMES * usual, OUTSTANDING_SHARE))
    return best if solved else None
