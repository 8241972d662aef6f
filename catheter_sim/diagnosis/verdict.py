"""The verdict's rules, and the figures that it stands on: held-out errors, harm, agreement with MuJoCo."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import posture_columns
from catheter_sim.core.inputs import Quantity, quantity_of
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.fit import Fit, blocks_of, column_of, trial_of
from catheter_sim.diagnosis.noise import (
    chance_of_gain,
    errors_of,
    gain_interval,
    gain_percent,
    is_white,
    outputs_of,
    residual_series,
    rmse_by_unit,
    stretch_squares,
    times_noise,
    tip_errors,
)
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.residuals import TESTS, structure_tests
from catheter_sim.diagnosis.result import (
    CAUSE_FOUND,
    IMPROVED,
    NO_DISCREPANCY,
    UNEXPLAINED,
    Cause,
    Remainder,
    StructureTest,
    TrialFit,
    UnitResult,
)
from catheter_sim.diagnosis.shapes import computed_along
from catheter_sim.diagnosis.thresholds import GAIN_CHANCE, LARGE_GAIN_PERCENT, NEAR_NOISE
from catheter_sim.diagnosis.trials import TIP, Dataset, Trial, measured_of, unit_of
from catheter_sim.diagnosis.workers import SERIAL, Workers, map_calls
from catheter_sim.effects.apply import arriving_inputs, observed, with_built_in_effects
from catheter_sim.effects.varying import varies
from catheter_sim.simulation.replay import SimulationRun, simulate
from catheter_sim.tables import Table

ROUGH_NOISE = 3.0
"""[times the noise floor] An error within it is no discrepancy if it shows no structure from row to row. Why:
assumed. An error without structure shows no cause."""
REMAINDER_NOISE = 2.0
"""[times the noise floor] What one cause leaves is small within it. Beyond it, the rest must have no
structure. Why: one cause imitates less than several do, for which `NEAR_NOISE` counts."""
REMAINDER_SHARE = 0.07
"""[share of the error before] What is left is small within it. Why: the causes are then right but for their
form."""
REMAINDER_HANGS_PERCENT = 25.0
"""[% of the squares left] If this much depends on one thing, it speaks against the causes. Why: assumed. With
it, causes outside the list ended as `unexplained` in 58 of 60 draws of the blind bench."""
MUCH_LEFT_NOISE = 5.0
"""[times the noise floor] If more of an error is left, something else is wrong besides. Why: learned from an
eccentric pulley that was taken for stiffness, with 7 and 12 times the floor left."""
LEAST_TAKEN_SHARE = 0.5
"""[share of the error before] Causes that leave so much must take at least this. Why: as for
`MUCH_LEFT_NOISE`, where 31 and 41 % were taken."""
DOUBT_NOISE = 3.0
"""[times the noise floor] If more error is left, the report states it as a doubt. Why: assumed. It doubles
`NEAR_NOISE`."""
HARM_SHARE = 0.05
"""[share of the error before] An error must rise by this much to count as worse. Why: assumed. A cause that
helps elsewhere may cost a twentieth where its form is not quite right."""
HARM_NOISE = 1.3
"""[times the noise floor] An error within it is not worse. Why: a right model leaves at most 1.3 times the
floor (`NEAR_NOISE`)."""
HARM_CHANCE = 0.01
"""[probability] Such a rise may come by chance with at most this probability, shared among all that is looked
at. Why: one diagnosis in a hundred may see harm where none is done."""
SMOOTH_RAMP_S = 0.1
"""[s of simulated time] Time from row to row of a robot without friction. Why: measured on 60 rows of eight
robots. It moves the outputs by at most 0.004 mm from where a whole second leads."""
DRY_RAMP_S = 0.5
"""[s of simulated time] The same with friction, which remembers an overshoot. Why: measured likewise, it
moves them by 0.002 mm. With half of it they move by 0.016 mm."""
SMOOTH_STRIDE = 20
"""[time steps] A replay makes this many in one, for a robot without friction that is driven by tension. Why:
measured on 40 to 60 rows of five robots, it moves the outputs by at most 0.001 mm. Tendons driven by
displacement would not come to rest."""
SMOOTH_DRIVEN_STRIDE = 2
"""[time steps] The same for a robot without friction that is driven by displacement. Why: measured on 40 to
60 rows of three robots, it moves the outputs by 1e-5 mm. With four, catheters do not come to rest."""
DRY_STRIDE = 4
"""[time steps] The same for a robot with friction that is driven by tension. Why: measured on 60 rows of four
robots, it moves the outputs by 0.01 mm. With 20, a rolling robot diverges."""

# ----------------------------------------------------------------------------------------------------
# Held-out trials replayed in MuJoCo with the causes built into the robot.


@dataclass(frozen=True)
class Replay:
    """A trial replayed in the simulation.

    Attributes:
        outputs: in file units, shape (r, o); NaN beyond the row at which the simulation failed.
        measured: shape (r, o), NaN where missing.
        failure: None, or why the simulation ended early.
        restless: rows at which the robot had not come to rest.
    """

    outputs: Array
    measured: Array
    failure: str | None
    restless: int
    SHAPES = "outputs:ro measured:ro"  # of what is read (`kept`)


def replays(
    robot: RobotSpec,
    trials: Sequence[Trial],
    columns: Sequence[str],
    gravity_mps2: Array,
    pool: Workers = SERIAL,
    moving: bool = False,
) -> list[Replay]:
    """Return trials replayed with `robot`, its effects in force, in motion or row by held row."""
    return map_calls(pool, replay, [(robot, trial, columns, gravity_mps2, moving) for trial in trials])


def replay(
    robot: RobotSpec, trial: Trial, columns: Sequence[str], gravity_mps2: Array, moving: bool = False
) -> Replay:
    """Return a trial replayed with `robot`, its effects in force; in motion from rest under its first row.

    Held rows in time steps longer than the robot's own: they end at rest, wherever the steps between them
    fell. A run that so fails, or does not come to rest, is repeated in its own.
    """
    if varies(robot):
        run = simulate(robot, trial.inputs, gravity_mps2, dynamic=moving, ramp_s=SMOOTH_RAMP_S)
        return _replayed(replace(robot, effects={}), trial, columns, run)
    built = with_built_in_effects(robot)
    arriving = arriving_inputs(robot, trial.inputs, moving)
    if moving:
        return _replayed(robot, trial, columns, simulate(built, arriving, gravity_mps2, dynamic=True))
    # Dry friction remembers an overshoot, so that a robot without it may be moved faster.
    dry = built.friction.mu > 0.0
    ramp_s = DRY_RAMP_S if dry else SMOOTH_RAMP_S
    if quantity_of(arriving.actuation) is Quantity.TENSION:
        stride = DRY_STRIDE if dry else SMOOTH_STRIDE
    else:
        stride = 1 if dry else SMOOTH_DRIVEN_STRIDE
    longer = replace(built.dynamics, timestep_s=built.dynamics.timestep_s * stride)
    run = simulate(replace(built, dynamics=longer), arriving, gravity_mps2, ramp_s=ramp_s)
    if stride > 1 and (run.failure is not None or not run.at_rest.all()):
        run = simulate(built, arriving, gravity_mps2, ramp_s=ramp_s)
    return _replayed(robot, trial, columns, run)


def _replayed(robot: RobotSpec, trial: Trial, columns: Sequence[str], run: SimulationRun) -> Replay:
    outputs = np.full((len(trial.inputs), len(columns)), np.nan)
    if run.postures:
        values = posture_columns(robot, observed(robot, trial.inputs.time_s, run.postures))
        outputs[: len(run.postures)] = np.stack([values[name] for name in columns], axis=1)
    return Replay(outputs, measured_of(trial, columns), run.failure, int((~run.at_rest).sum()))


# ----------------------------------------------------------------------------------------------------
# How the simulation agrees with the measurements and with the twin, on the held-out trials.


def agreement_with_simulation(
    problem: Problem, heldout: Sequence[Trial], replays: Sequence[Replay], fits: Sequence[TrialFit]
) -> tuple[dict[str, float], list[Note]]:
    """Return the errors of MuJoCo, with the causes in it, on the held-out trials, and notes where a run
    failed."""
    extra: dict[str, float] = {}
    notes: list[Note] = []
    for trial, item in zip(heldout, replays, strict=True):
        if item.failure:
            notes.append(
                Note("simulation_failed", f"MuJoCo could not simulate {trial.file}: {item.failure}.")
            )
        if item.restless:
            said = f"In MuJoCo, {item.restless} rows of {trial.file} had not come to rest."
            notes.append(Note("simulation_restless", said))
    twins = [
        np.stack([item.after.columns[name] for name in problem.columns], axis=1)
        for item in fits
        if item.role == "heldout"
    ]
    for unit in dict.fromkeys(unit_of(name) for name in problem.columns):
        mine = np.array([unit_of(name) == unit for name in problem.columns])
        error = np.concatenate([(item.outputs - item.measured)[:, mine].ravel() for item in replays])
        apart = np.concatenate(
            [(item.outputs - twin)[:, mine].ravel() for item, twin in zip(replays, twins, strict=True)]
        )
        suffix = "" if unit == "1" else f"_{unit}"
        if np.isfinite(error).any():
            extra[f"heldout_simulation_rmse_after{suffix}"] = float(np.sqrt(np.nanmean(error**2)))
            extra[f"heldout_simulation_minus_twin_rms{suffix}"] = float(np.sqrt(np.nanmean(apart**2)))
    if all(name in problem.columns for name in TIP) and all(item.failure is None for item in replays):
        columns = {
            name: [
                (
                    item.outputs[:, problem.columns.index(name)],
                    item.measured[:, problem.columns.index(name)],
                )
                for item in replays
            ]
            for name in TIP
        }
        extra |= {
            f"heldout_simulation_{name.format('after')}": value for name, value in tip_errors(columns).items()
        }
    return extra, notes


# ----------------------------------------------------------------------------------------------------
# Further numbers of the held-out trials for a reader, and what to doubt.


def further_numbers(
    problem: Problem, fits: Sequence[TrialFit], after: Fit
) -> tuple[dict[str, float], list[Note]]:
    """Return further figures of the held-out trials, and notes about the fit."""
    extra: dict[str, float] = {}
    notes = []
    heldout = [item for item in fits if item.role == "heldout"]
    if all(name in problem.columns for name in TIP):
        for stage in ("before", "after"):
            columns = {
                name: [(getattr(item, stage).columns[name], item.measured.columns[name]) for item in heldout]
                for name in TIP
            }
            extra |= {f"heldout_{name.format(stage)}": value for name, value in tip_errors(columns).items()}
        said = (
            "The tip error is a distance in space. RMSE counts every output by itself. An aligned error is "
            "without its mean offset over the held-out rows."
        )
        notes.append(Note("how_errors_count", said))
    if not problem.nuisances:
        said = (
            "Nothing was calibrated: no calibration range is known for this robot. Before is the robot as "
            "its file specifies it, in the tracker's frame as given."
        )
        notes.append(Note("nothing_calibrated", said))
    for fitted, stuck in zip(after.numbers, after.held, strict=True):
        if stuck and fitted.effect:
            said = f"{fitted.effect}.{fitted.parameter.name} is at its bound, where its interval ends."
            notes.append(Note("number_at_bound", said))
    return extra, notes


def doubts(causes: Sequence[Cause], by_unit: Mapping[str, UnitResult]) -> list[Note]:
    """Return doubts about the causes: a note for each unit in which much error is left."""
    notes = []
    for unit, result in by_unit.items():
        times = times_noise(result.rmse_after, result.noise_floor)
        if causes and times > DOUBT_NOISE:
            said = (
                f"The remaining error [{unit}] is {times:.0f} times the row-to-row noise. Most of it is "
                "unexplained."
            )
            notes.append(Note("error_left", said))
    return notes


# ----------------------------------------------------------------------------------------------------
# No harm: named causes may make no unit, no output and no held-out trial worse.
#
# A hypothesis that fits one output at another one's cost has found something else than what is wrong.


@dataclass(frozen=True)
class Harm:
    """What a hypothesis makes worse on the held-out trials.

    `what` is a unit, an output or a trial, in words; `before` and `after` are root mean square errors there,
    in `unit`.
    """

    what: str
    before: float
    after: float
    unit: str


def harms(test: Problem, before: Fit, after: Fit, noise: Mapping[str, float]) -> tuple[Harm, ...]:
    """Return what gets worse on the held-out trials by more than its noise and chance; worst first.

    Worse is an error that rises by more than `HARM_SHARE`, to more than `HARM_NOISE` times the noise, and in
    more stretches than chance explains (`HARM_CHANCE`, shared among what is looked at). Of a model that is
    known to be wrong, by more than that besides (`Problem.model_share`).
    """
    errors = errors_of(test, before), errors_of(test, after)
    block = blocks_of(test)
    parts = list(_parts(test))
    units = np.array([unit_of(name) for name in test.columns])[column_of(test)]
    found = []
    for what, unit, mine in parts:
        rms = [float(np.sqrt(np.mean(error[mine] ** 2))) for error in errors]
        known = test.model_share * float(np.sqrt(np.mean(errors[0][units == unit] ** 2)))
        if rms[1] <= max((1.0 + HARM_SHARE) * rms[0], HARM_NOISE * noise[unit], known):
            continue
        labels = np.unique(block[mine], return_inverse=True)[1]
        rise = np.bincount(labels, weights=errors[1][mine] ** 2 - errors[0][mine] ** 2).astype(float)
        if len(rise) < 2 or chance_of_gain(rise) <= HARM_CHANCE / len(parts):
            found.append(Harm(what, rms[0], rms[1], unit))
    return tuple(sorted(found, key=lambda item: item.before / max(item.after, 1e-300)))


def harm_note(after: Fit, found: tuple[Harm, ...]) -> Note:
    """Return what to say of causes that are not named because of what they make worse."""
    names = ", ".join(name.replace("_", " ") for name in after.causes)
    worst = found[0]
    return Note(
        "causes_do_harm",
        f"The best set found is {names}. It raises the held-out error of {worst.what} from "
        f"{worst.before:.3g} to {worst.after:.3g} {worst.unit}, so it is not used. Something else is wrong.",
    )


def _parts(test: Problem) -> Iterator[tuple[str, str, Array]]:
    """Yield units, outputs and trials: in words, the unit, and which residuals they have, shape (n,)."""
    columns = column_of(test)
    units = np.array([unit_of(name) for name in test.columns])
    trials = trial_of(test)
    for unit in dict.fromkeys(units.tolist()):
        mine = units[columns] == unit
        if len(set(units.tolist())) > 1 and mine.any():
            yield f"the outputs in {unit}", unit, mine
        for index, trial in enumerate(test.trials):
            if len(test.trials) > 1 and (mine & (trials == index)).any():
                yield f"{trial.file}", unit, mine & (trials == index)
    for index, name in enumerate(test.columns):
        if (columns == index).any():
            yield name, str(units[index]), columns == index


# ----------------------------------------------------------------------------------------------------
# How a hypothesis does on the held-out trials: errors by unit, the gain and how sure it is.


def held_out(
    train: Problem, test: Problem, before: Fit, after: Fit, noise: Mapping[str, float]
) -> dict[str, UnitResult]:
    """Return the held-out figures of every unit of `noise`."""
    return {unit: _of_unit(train, test, before, after, unit, floor) for unit, floor in noise.items()}


def _of_unit(train: Problem, test: Problem, before: Fit, after: Fit, unit: str, noise: float) -> UnitResult:
    errors = errors_of(test, before), errors_of(test, after)
    rmse = [rmse_by_unit(test, error)[unit] for error in errors]
    interval, chance = (0.0, 0.0), 1.0
    if after is not before:
        held = stretch_squares(test, *errors, unit)
        inside = stretch_squares(train, errors_of(train, before), errors_of(train, after), unit)
        interval = gain_interval(held, inside)
        chance = chance_of_gain(-np.diff(np.concatenate(held), axis=1)[:, 0])
    return UnitResult(
        unit=unit,
        noise_floor=noise,
        rmse_before=rmse[0],
        rmse_after=rmse[1],
        gain_percent=gain_percent(*rmse),
        gain_percent_ci95=interval,
        chance=chance,
    )


def trial_fits(
    problem: Problem, trials: Sequence[Trial], before: Fit, after: Fit, shapes: bool = True
) -> tuple[TrialFit, ...]:
    """Return trials, measured and computed by both hypotheses; `shapes`: with where the robot is."""
    return tuple(_trial_fit(problem, trial, before, after, shapes) for trial in trials)


def _trial_fit(problem: Problem, trial: Trial, before: Fit, after: Fit, with_shapes: bool) -> TrialFit:
    shapes = None
    if with_shapes:
        first, second, shapes = computed_along(problem, trial, before, after)
    else:
        first, second = (outputs_of(problem, trial, result) for result in (before, after))
    tables = []
    for values in (first, second):
        columns = {name: values[:, index] for index, name in enumerate(problem.columns)}
        tables.append(Table(trial.outputs.time_s, columns, trial.file))
    return TrialFit(trial.file, trial.role, trial.outputs.time_s, trial.outputs, tables[0], tables[1], shapes)


# ----------------------------------------------------------------------------------------------------
# What is left of the error: how many times the noise, and what it depends on, unit by unit.


def remainders(
    dataset: Dataset, fits: Sequence[TrialFit], by_unit: Mapping[str, UnitResult]
) -> dict[str, Remainder]:
    """Return what is left of each unit's error."""
    found = {}
    for unit, result in by_unit.items():
        tests = structure_tests(dataset, fits, unit, "after")
        strong = sorted((item for item in tests if item.significant), key=lambda item: -item.share_percent)
        times = times_noise(result.rmse_after, result.noise_floor)
        found[unit] = Remainder(times, tuple(item.name for item in strong))
    return found


# ----------------------------------------------------------------------------------------------------
# The rules of the verdict: when a cause is found, and what speaks against it.


def verdict_of(
    problem: Problem,
    before: Fit,
    after: Fit,
    by_unit: Mapping[str, UnitResult],
    established: bool,
    harmful: bool = False,
    structured: bool = False,
) -> str:
    """Return the verdict.

    The corrections of a hypothesis that was chosen on the training trials hold under these conditions. The
    error on the held-out ones falls, in at least one unit, by more than chance and on other trials too
    (`gains_surely`) . Nothing gets worse. Then a cause is found if one of them is established; if none is,
    there is no discrepancy where the calibrated model's residuals are near the noise, else the model is
    improved. Without corrections that hold there is no discrepancy, or it is unexplained.

    `structured`: the calibrated model's residuals depend on something, whether or not neighbouring rows do:
    commands may come in any order.
    """
    holds = bool(after.terms) and not harmful and any(gains_surely(item) for item in by_unit.values())
    if holds and established:
        return CAUSE_FOUND
    times = max(times_noise(result.rmse_before, result.noise_floor) for result in by_unit.values())
    white = not structured and all(is_white(series) for series in residual_series(problem, before).values())
    if times <= (ROUGH_NOISE if white else NEAR_NOISE):
        return NO_DISCREPANCY
    return IMPROVED if holds else UNEXPLAINED


def gains_surely(result: UnitResult) -> bool:
    """Return whether the error surely falls, on the held-out trials (`GAIN_CHANCE`) and on others.

    The interval of a small gain must lie above zero, where it is known. A cause that imitates one outside the
    list, or a small difference between two models of the same physics, does well on some trials and ill on
    others. A large gain needs no such interval, since that of few trials is wide however much is gained in
    all of them.
    """
    comes_back = result.gain_percent >= LARGE_GAIN_PERCENT or not result.gain_percent_ci95[0] <= 0.0
    return result.gain_percent > 0.0 and result.chance <= GAIN_CHANCE and comes_back


def structured_remainder(
    result: UnitResult, tests: Sequence[StructureTest], causes: int, model_share: float = 0.0
) -> StructureTest | None:
    """Return the test that shows on what the error left depends; None where on nothing, or it is small.

    A wrong cause that imitates the right one leaves what it cannot imitate: an error that depends on the
    input or the position, say. An error is small if it is near the noise, or small beside the error before.
    Several causes imitate more than one cause does; they must bring the error nearer to the noise
    (`NEAR_NOISE`). `model_share`: of the error before, what a right cause may leave of a model that is known
    to be wrong.
    """
    near = REMAINDER_NOISE if causes == 1 else NEAR_NOISE
    share = max(REMAINDER_SHARE, model_share)
    if result.rmse_after <= max(near * result.noise_floor, share * result.rmse_before):
        return None
    return strongest_structure(tests)


def strongest_structure(tests: Sequence[StructureTest]) -> StructureTest | None:
    """Return the test that shows on what much of an error hangs (`REMAINDER_HANGS_PERCENT`), if any does."""
    hanging = [test for test in tests if test.significant and test.share_percent >= REMAINDER_HANGS_PERCENT]
    return max(hanging, key=lambda test: test.share_percent, default=None)


def most_error_remains(result: UnitResult, model_share: float = 0.0) -> bool:
    """Return whether most of an error far above the noise is still there after correction.

    Then the model is mainly wrong about something else, and the causes only imitate a part of that.
    `model_share` as of `structured_remainder`.
    """
    near = result.rmse_after <= MUCH_LEFT_NOISE * result.noise_floor
    return not near and result.rmse_after > max(1.0 - LEAST_TAKEN_SHARE, model_share) * result.rmse_before


def remainder_note(after: Fit, result: UnitResult, left: StructureTest | None) -> Note:
    """Return what to say where the error that is left says that something else is wrong as well.

    `left`: on what the rest depends; None: on nothing, but there is too much of it.
    """
    names = ", ".join(name.replace("_", " ") for name in after.causes)
    times = times_noise(result.rmse_after, result.noise_floor)
    what = f"it is {100.0 - gain_percent(result.rmse_before, result.rmse_after):.0f} % of the error before"
    if left is not None:
        what = f"{left.share_percent:.0f} % of it depends on {TESTS[left.name]} ({left.coordinate})"
    verb = "lower" if result.rmse_after < result.rmse_before else "raise"
    many = "" if len(after.causes) > 1 else "s"
    course = f"the held-out error from {result.rmse_before:.3g} to {result.rmse_after:.3g} {result.unit}"
    return Note(
        "something_else_too",
        f"{names} {verb}{many} {course}. The error left is {times:.1f} times the row-to-row noise, and "
        f"{what}. Something else is wrong too, or a cause acts in a form that is not listed. The intervals "
        "allow for an error of that size.",
    )


def unproved_note(names: Sequence[str]) -> Note:
    """Return what to say of probable causes whose gain the held-out trials do not show."""
    causes = " and ".join(name.replace("_", " ") for name in names)
    return Note(
        "cause_unproved",
        f"{causes.capitalize()} explains the training trials, but the held-out trials gain nothing by it for "
        "sure. Hold out trials that move the robot as the training trials do.",
    )
