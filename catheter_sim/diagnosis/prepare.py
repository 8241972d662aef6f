"""The first stages of a diagnosis: read, register the frame, calibrate, and look for faults of the data."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.faults_of_columns import (
    BesideModel,
    beyond_robot,
    computed_outputs,
    most_likely_mistake,
    moved_without_inputs,
    outputs_out_of_step,
    outputs_that_do_not_follow,
    relative_error_of,
    within_robot,
)
from catheter_sim.diagnosis.faults_of_readings import (
    bumped_trackers,
    clipped_outputs,
    copied_rows,
    exchanged_points,
    hardly_moved,
    interpolated_outputs,
    jumps_elsewhere,
)
from catheter_sim.diagnosis.faults_of_trials import (
    mistakes_of_one_trial,
    moved_between_trials,
    odd_trial,
    outstanding_trials,
)
from catheter_sim.diagnosis.fit import Fit, fit, predicted
from catheter_sim.diagnosis.frame import SHIFTS, Registration, frame_numbers, register, registered, unmoved
from catheter_sim.diagnosis.noise import least_noise, noise_floor, repeat_noise, residual_noise
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.nuisance import Nuisance, nuisances_of
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.readings import (
    resolution_of,
    without_copies,
    without_frozen_readings,
    without_old_readings,
)
from catheter_sim.diagnosis.result import (
    DATA_SUSPECT,
    DataFault,
    DiagnosisResult,
    NextExperiment,
    TrialFit,
    UnitResult,
)
from catheter_sim.diagnosis.trials import (
    Dataset,
    Trial,
    can_be_fitted,
    measured_of,
    split_trials,
    too_little,
    unit_of,
)
from catheter_sim.diagnosis.workers import Workers, twin_of, workers
from catheter_sim.progress import Stages
from catheter_sim.theory.twins import Predict, Prediction

MISTAKE_SURER = 0.85
"""[error with a mistake put right over the error with the tracker moved] Below this ratio the mistake is
believed and nothing is moved. Why: assumed. Both explain inches for mm, and the simpler one must do
better."""
SMALLEST_WEIGHT_SHARE = 1e-3
"""[share of the spread of a unit's measurements] A unit's weight is at least this. Why: a test's data without
noise would have none."""

# ----------------------------------------------------------------------------------------------------
# What every stage of a diagnosis may use: where fits run, and how to say what is being done.


@dataclass(frozen=True)
class DiagnosisRun:
    """A diagnosis that is under way.

    Attributes:
        pool: where to fit.
        say: called with a line where a stage, or a step of it, begins.
        deadline: on the clock of `time.monotonic`, when a search for causes ends with the best so far [s].
        search_anyway: look for causes where too little was measured to name any, too.
    """

    pool: Workers
    say: Callable[[str], None]
    deadline: float = math.inf
    search_anyway: bool = False


@contextmanager
def running(
    place: Workers, progress: bool, budget_s: float = math.inf, search_anyway: bool = False
) -> Iterator[DiagnosisRun]:
    """Give a run whose processes or cluster stay up until it ends.

    Arguments as of `pipeline.diagnose_dataset`.

    Raises:
        InputError: no scheduler answers, or Dask is not installed.
    """
    with Stages("diagnose", progress, budget_s=budget_s) as stages, workers(place) as pool:
        yield DiagnosisRun(pool, stages.say, time.monotonic() + budget_s, search_anyway)


# ----------------------------------------------------------------------------------------------------
# Measurements without frozen readings, in the robot's base frame, parted for the test.

BEYOND = "beyond_robot"  # the code of notes on numbers that are far beyond the robot


@dataclass(frozen=True)
class ReadData:
    """Measurements as the files have them, before any model is asked.

    Attributes:
        dataset: without copies and frozen readings.
        train, heldout: its trials, parted.
        notes: on the files and on frozen sensors.
        faults: what looks wrong with the files themselves.
        lacking: what was measured too little to name any cause.
    """

    dataset: Dataset
    train: tuple[Trial, ...]
    heldout: tuple[Trial, ...]
    notes: tuple[Note, ...] = ()
    faults: tuple[DataFault, ...] = ()
    lacking: tuple[DataFault, ...] = ()

    @property
    def can_be_fitted(self) -> bool:
        """Return whether there is enough to fit anything, if nothing can be named."""
        return can_be_fitted(self.train, self.heldout, self.dataset.output_channels)


@dataclass(frozen=True, kw_only=True)
class Prepared(ReadData):
    """Measurements that can be fitted, moved into the robot's base frame by `registration`.

    `twin` is what its fits go by; the notes are on it, too.
    """

    registration: Registration
    twin: Prediction


def readings_of(dataset: Dataset) -> ReadData:
    """Return what a data set's files hold that can be used."""
    single, twice, copies = without_copies(replace(dataset, resolution=resolution_of(dataset)))
    new, old = without_old_readings(single)
    readings, frozen = without_frozen_readings(new)
    train, heldout = split_trials(readings)
    notes, faults = (*readings.notes, *twice, *old, *frozen), copied_rows(single.trials, copies)
    return ReadData(readings, train, heldout, notes, faults, lacking_in(readings, train, heldout))


def lacking_in(dataset: Dataset, train: Sequence[Trial], heldout: Sequence[Trial]) -> tuple[DataFault, ...]:
    """Return what was measured too little to name any cause; (): nothing."""
    said = too_little(train, heldout, dataset.output_channels, dataset.motion.moving)
    return tuple(DataFault(text, is_lack=True) for text in said)


def prepare(dataset: Dataset, read: ReadData | None = None) -> Prepared:
    """Return a data set as it can be fitted; `read`: what `readings_of` makes of it, if known."""
    read = read or readings_of(dataset)
    chosen = twin_of(read.dataset, read.train)
    readings, impossible, far = within_reach(read.dataset, chosen.predict)
    moved, registration = in_base_frame(readings, chosen.predict)
    train, heldout = split_trials(moved)
    short = (Note("too_little", item.words) for item in read.lacking)
    notes, faults = (*far, *read.notes, *chosen.notes, *short), impossible or read.faults
    given = moved, train, heldout, notes, faults, read.lacking
    return Prepared(*given, registration=registration, twin=chosen.predict)


def within_reach(
    dataset: Dataset, twin: Prediction
) -> tuple[Dataset, tuple[DataFault, ...], tuple[Note, ...]]:
    """Return a data set that a model can follow, why it is impossible as it was measured, and notes.

    Commands or motions far beyond the robot are a note. They are a fault where no such robot can have been
    measured, or no model follows them. Commands are cut off then, so that a model can be shown beside them.
    """
    beyond = beyond_robot(dataset.robot, dataset.trials)
    train, _ = split_trials(dataset)
    robot = replace(dataset.robot, actuation=train[0].inputs.actuation)

    def predict(inputs: Inputs) -> Array:
        return twin([robot], inputs, 1)[0]

    def followed() -> bool:
        return all(bool(np.isfinite(predict(trial.inputs)).all()) for trial in dataset.trials)

    if not beyond or not (any(item.impossible for item in beyond) or not followed()):
        return dataset, (), tuple(Note(BEYOND, f"{item.words()}.") for item in beyond)
    found = most_likely_mistake(train, dataset.output_channels, robot, predict, shifted=True)
    words = [item.words() for item in beyond] if found is None else [f"{beyond[0].what}: {found.words}"]
    trials = tuple(replace(trial, inputs=within_robot(robot, trial.inputs)) for trial in dataset.trials)
    note = Note(BEYOND, "Commands are cut off at what bends the robot fully.")
    return replace(dataset, trials=trials), tuple(map(DataFault, words)), (note,)


def in_base_frame(dataset: Dataset, twin: Prediction | None = None) -> tuple[Dataset, Registration]:
    """Return the data set with its positions in the robot's base frame, and how they were moved there.

    A mistake in the data, such as inches for mm, may look like a tracker far away. Where putting it right
    does better than any motion, nothing is moved, and `find_data_faults` will name the mistake. `twin`: what
    its fits go by; None: it is chosen.
    """
    train, _ = split_trials(dataset)
    twin = twin or twin_of(dataset, train).predict
    robot, columns = replace(dataset.robot, actuation=train[0].inputs.actuation), dataset.output_channels
    registration = register(train, columns, robot, twin)
    if not registration.applied:
        return dataset, registration

    def predict(inputs: Inputs) -> Array:
        return twin([robot], inputs, 1)[0]

    moved_there = registered(dataset, registration)
    found = most_likely_mistake(train, columns, robot, predict, solved=math.inf)
    there = relative_error_of(split_trials(moved_there)[0], columns, predict, shifted=True)
    if found is not None and found.error < MISTAKE_SURER * there:
        return dataset, unmoved(registration)
    return moved_there, registration


# ----------------------------------------------------------------------------------------------------
# The problem that hypotheses are fitted to: robot, twin, calibrated numbers, weights.


@dataclass(frozen=True)
class SplitProblem:
    """What is to be fitted, and what it is tested on.

    Attributes:
        dataset: in the base frame.
        registration: how it was moved there.
        train: the problem of the training trials.
        heldout: the same with the held-out trials.
        thorough: whether fits search along valleys. The numbers that a data set itself wants calibrated
            may trade against one another, the others hardly do.
        faults: what looks wrong with the files themselves.
        lacking: what was measured too little to name any cause.
    """

    dataset: Dataset
    registration: Registration
    train: Problem
    heldout: Problem
    thorough: bool
    faults: tuple[DataFault, ...] = ()
    lacking: tuple[DataFault, ...] = ()


def split_problem(prepared: Prepared) -> SplitProblem:
    """Return the problem of prepared measurements."""
    dataset = prepared.dataset
    frame = frame_numbers(prepared.registration)
    train = training_problem(dataset, prepared.train, frame, prepared.twin)
    heldout = replace(train, trials=prepared.heldout)
    thorough = bool(dataset.calibration)
    return SplitProblem(
        dataset, prepared.registration, train, heldout, thorough, prepared.faults, prepared.lacking
    )


def training_problem(
    dataset: Dataset,
    train: Sequence[Trial],
    frame: tuple[Nuisance, ...] = (),
    twin: Predict | None = None,
) -> Problem:
    """Return what is to be fitted: the nominal robot, its twin and the training trials.

    Each unit has the weight of the white part of the calibrated model's residual. `dataset` is in the base
    frame;
    `frame`: numbers of the tracker's frame to calibrate besides; `twin`: None: it is chosen.
    """
    actuation = train[0].inputs.actuation
    robot = replace(dataset.robot, actuation=actuation)
    columns = dataset.output_channels
    twin = twin or twin_of(dataset, train).predict
    known = nuisances_of(dataset.robot_reference) if dataset.calibration is None else dataset.calibration
    problem = Problem(
        robot=robot,
        nuisances=(*known, *frame),
        trials=tuple(train),
        columns=columns,
        weight=np.ones(len(columns)),
        twin=twin,
        moving=dataset.motion.moving,
        repeatability=dataset.repeatability,
        resolution=resolution_of(dataset),
        model_share=dataset.model_share,
    )
    spread: dict[str, float] = {}
    for index, name in enumerate(columns):
        values = np.concatenate([measured_of(trial, columns)[:, index] for trial in train])
        spread[unit_of(name)] = max(spread.get(unit_of(name), 0.0), float(np.nanstd(values)), 1e-9)
    problem = replace(problem, weight=np.array([spread[unit_of(name)] for name in columns]))
    noise = residual_noise(problem, fit(problem, (), cross_validate=False))
    weight = [
        max(noise.get(unit_of(name), 0.0), SMALLEST_WEIGHT_SHARE * spread[unit_of(name)]) for name in columns
    ]
    return replace(problem, weight=np.array(weight))


# ----------------------------------------------------------------------------------------------------
# The model "before", calibrated to the training trials, without any cause.


@dataclass(frozen=True)
class Calibrated:
    """The calibrated model without causes.

    `noise` is that of each unit, as far as this model lets it be seen.
    """

    fit: Fit
    noise: Mapping[str, float]


def calibrate(split: SplitProblem) -> Calibrated:
    """Return the model without causes, its nuisance parameters fitted."""
    found = fit(split.train, (), cross_validate=False, thorough=split.thorough)
    return Calibrated(found, noise_beside(split.train, found))


def noise_beside(train: Problem, result: Fit) -> dict[str, float]:
    """Return the noise of each unit: from repeats, and from what is white in a hypothesis's residuals.

    It is no less than what the readings' resolution leaves. Of the training trials alone: where one trial was
    cut, its held-out part runs through all of its rows.
    """
    found = noise_floor(residual_noise(train, result), repeat_noise(train.trials, train.columns))
    least = least_noise(train)
    return {
        unit: max(value, least[unit], train.repeatability.get(unit, 0.0)) for unit, value in found.items()
    }


# ----------------------------------------------------------------------------------------------------
# The answer where too little was measured to name any cause: no model runs for it.


def not_searched(read: ReadData) -> DiagnosisResult:
    """Return the diagnosis of measurements that lack something: what it is, and nothing of the robot.

    No figure is worked out, and no probability. The robot is as specified.
    """
    units = dict.fromkeys(unit_of(name) for name in read.dataset.output_channels)
    unknown = math.nan
    by_unit = {
        unit: UnitResult(unit, unknown, unknown, unknown, unknown, (unknown, unknown), unknown)
        for unit in units
    }
    return DiagnosisResult(
        dataset=read.dataset,
        verdict=DATA_SUSPECT,
        unit=next(iter(units)),
        by_unit=by_unit,
        causes=(),
        ranking=(),
        indistinguishable=(),
        next_experiment=NextExperiment("Record what is missing, and diagnose again."),
        extended_robot=read.dataset.robot,
        fits=tuple(_not_computed(trial) for trial in (*read.train, *read.heldout)),
        notes=read.notes,
        data_faults=(*read.faults, *read.lacking),
    )


def _not_computed(trial: Trial) -> TrialFit:
    """Return a trial as it was measured, with nothing computed beside it."""
    none = {name: np.full(len(trial.inputs), np.nan) for name in trial.outputs.columns}
    computed = replace(trial.outputs, columns=none)
    return TrialFit(trial.file, trial.role, trial.inputs.time_s, trial.outputs, computed, computed)


# ----------------------------------------------------------------------------------------------------
# What looks wrong with the data themselves, before anything is blamed on the robot.
#
# A column in other units, two columns swapped, a sensor that froze, a trial of another robot: each makes
# the model err grossly, and each can be imitated by a cause of error, wrongly. They are looked for first,
# and where one is found no cause is named. What speaks against some trials alone may be a cause that these
# trials call upon more than others: see `without_explained_faults`.

SUSPECTED = "The data look wrong, so no cause was looked for"


@dataclass(frozen=True)
class Faults:
    """What looks wrong with the data.

    None `found`: the data look sound. `of_trials`: they are of some trials only, which the model meets worse
    than others.
    """

    found: tuple[DataFault, ...]
    of_trials: bool = False

    @property
    def notes(self) -> tuple[Note, ...]:
        """Return a note on each."""
        return tuple(Note("data_fault", f"{SUSPECTED}: {item.words}") for item in self.found)


def find_data_faults(split: SplitProblem, before: Calibrated) -> Faults:
    """Return what looks wrong with the data."""
    if split.faults:
        return Faults(split.faults)
    return data_faults(split.train, before.fit, split.heldout.trials, before.noise)


def data_faults(
    problem: Problem, before: Fit, heldout: Sequence[Trial], noise: Mapping[str, float]
) -> Faults:
    """Return what looks wrong with the data; nothing where they look sound.

    The checks run in an order in which the fault that explains others comes first, and the first that finds
    something speaks. `before`: the calibrated model, without causes or with what may account for what it
    errs. The held-out trials are asked only whether they were measured as the others were.
    """
    trials = (*problem.trials, *heldout)
    models = computed_outputs(problem, before, trials)
    seen = BesideModel(trials, problem.columns, models, noise, problem.moving)
    checks: tuple[tuple[Callable[[], tuple[DataFault, ...]], bool], ...] = (
        (lambda: hardly_moved(problem.robot, trials, problem.columns, models), False),
        (lambda: interpolated_outputs(seen), False),
        (lambda: _mistake_in_all(problem, before), False),
        (lambda: bumped_trackers(trials, problem.columns, models, noise), False),
        (lambda: mistakes_of_one_trial(seen, problem.robot, _prediction(problem, before)), True),
        (lambda: exchanged_points(seen), False),
        (lambda: jumps_elsewhere(seen), False),
        (lambda: outputs_out_of_step(seen), False),
        (lambda: outputs_that_do_not_follow(problem, models[: len(problem.trials)]), False),
        (lambda: moved_without_inputs(seen), False),
        (lambda: clipped_outputs(seen), False),
        (lambda: outstanding_trials(seen), True),
        (lambda: moved_between_trials(seen), False),
        (lambda: odd_trial(problem, before, heldout, noise), True),
    )
    for check, of_trials in checks:
        if found := check():
            return Faults(found, of_trials)
    return Faults(())


def _mistake_in_all(problem: Problem, before: Fit) -> tuple[DataFault, ...]:
    """Return the mistake in all trials without which the calibrated model agrees with them far better."""
    shifted = any(name in SHIFTS for name in (item.name for item in problem.nuisances))
    found = most_likely_mistake(
        problem.trials, problem.columns, problem.robot, _prediction(problem, before), shifted
    )
    if found is None:
        return ()
    return (
        DataFault(
            f"{found.words}. If you correct that, the model's error falls from {100 * found.before:.0f} to "
            f"{100 * found.error:.0f} % of the measurements' spread."
        ),
    )


def _prediction(problem: Problem, before: Fit) -> Callable[[Inputs], Array]:
    """Return what the calibrated model says along inputs."""
    return lambda inputs: predicted(problem, before.numbers, before.x, inputs)
