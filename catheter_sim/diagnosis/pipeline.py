"""From measured data to a diagnosis, stage by stage; and from a diagnosis to the best next experiment."""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from catheter_sim.channels import input_channels
from catheter_sim.diagnosis.choose import (
    Choice,
    HeldoutChoice,
    choose_causes,
    decide_on_heldout,
    fit_unproved,
    no_heldout_choice,
    without_explained_faults,
)
from catheter_sim.diagnosis.conclude import (
    Examined,
    Replayed,
    Scores,
    Verdict,
    assemble,
    conclude,
    concluded_plainly,
    examine,
    examined_plainly,
    judge,
    nothing_planned,
    plan_next_experiment,
    prune_again,
    replay_in_mujoco,
    score_hypotheses,
    unjudged,
    unscored,
    widen_intervals,
)
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.document import stamped
from catheter_sim.diagnosis.fit import Fit
from catheter_sim.diagnosis.hypotheses import Scored
from catheter_sim.diagnosis.next_experiment import BestExperiment, alive_hypotheses, best_experiment
from catheter_sim.diagnosis.notes import Attempts
from catheter_sim.diagnosis.prepare import (
    BEYOND,
    Calibrated,
    DiagnosisRun,
    Faults,
    Prepared,
    SplitProblem,
    calibrate,
    find_data_faults,
    not_searched,
    prepare,
    readings_of,
    running,
    split_problem,
)
from catheter_sim.diagnosis.programmes import bench_of
from catheter_sim.diagnosis.report import with_notes, write_results
from catheter_sim.diagnosis.result import DiagnosisResult
from catheter_sim.diagnosis.thresholds import MOST_CAUSES, NATS_PER_MINUTE
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.diagnosis.workers import SERIAL, Workers
from catheter_sim.effects.apply import with_built_in_effects
from catheter_sim.effects.varying import without_variations
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.progress import note

# ----------------------------------------------------------------------------------------------------
# From a folder of measurements to a diagnosis: a row of stages, each a file in `stages`.
#
# Each stage takes values and returns one; none knows a kind of robot or the name of an effect.

UNFINISHED = ".unfinished"  # folder of finished fits in the output folder of a run that was stopped


def diagnose(
    dataset: Dataset | str | os.PathLike[str],
    output_folder: str | os.PathLike[str],
    jobs: int = 1,
    progress: bool = False,
    dask: str = "",
    budget_s: float = math.inf,
    command: str = "",
    search_anyway: bool = False,
) -> DiagnosisResult:
    """Diagnose a data set and write what was found to a folder.

    A run that was stopped left its finished fits in the output folder; the same run, started again, takes
    them over. They are gone when it is done. `dask` is the address of a scheduler to fit on, "" for none;
    `command` is how this was asked for, for the report; the other arguments are those of `diagnose_dataset`.

    Raises:
        InputError: the data set is not what it must be, the output folder cannot be written, or no
            scheduler answers.
    """
    data = dataset if isinstance(dataset, Dataset) else load_dataset(dataset)
    unfinished = Path(output_folder) / UNFINISHED
    place = Workers(jobs, dask, unfinished)
    found = diagnose_dataset(data, place, progress, budget_s=budget_s, search_anyway=search_anyway)
    drawing = SERIAL if dask else Workers(jobs)
    diagnosis = write_diagnosis(stamped(found, command), output_folder, drawing)
    shutil.rmtree(unfinished, ignore_errors=True)
    return diagnosis


def write_diagnosis(
    diagnosis: DiagnosisResult, folder: str | os.PathLike[str], place: Workers = SERIAL
) -> DiagnosisResult:
    """Write report, diagnosis.json, the extended robot and its model, and the fitted series to `folder`.

    Pictures are drawn at `place`.
    The diagnosis is returned as it was written: with a note on each file that is missing.

    Raises:
        InputError: the folder cannot be made or written.
    """
    attempt = Attempts()
    diagnosis = stamped(diagnosis)
    model = attempt("model.xml", lambda: model_of(diagnosis), str)
    write_results(diagnosis, folder, model, attempt=attempt, place=place)
    return with_notes(diagnosis, attempt)


def model_of(diagnosis: DiagnosisResult) -> str:
    """Return the extended robot as MJCF."""
    actuation = diagnosis.dataset.trials[0].inputs.actuation
    return build_mjcf(with_built_in_effects(without_variations(diagnosis.extended_robot)), actuation)


def diagnose_dataset(
    dataset: Dataset,
    place: Workers = SERIAL,
    progress: bool = False,
    simulation: bool = True,
    budget_s: float = math.inf,
    search_anyway: bool = False,
) -> DiagnosisResult:
    """Return the diagnosis of a data set; where too little was measured to name any cause, that alone.

    Args:
        dataset: the measurements.
        place: where to fit.
        progress: show what is being done where standard error is a terminal.
        simulation: replay the held-out trials in MuJoCo at the end.
        budget_s: seconds after which the search for causes ends with the best so far.
        search_anyway: look for causes where too little was measured to name any, too.

    Raises:
        InputError: no scheduler answers, or processes were killed again and again.
    """
    read = readings_of(dataset)
    if read.lacking and not (search_anyway and read.can_be_fitted):
        return not_searched(read)
    with running(place, progress, budget_s) as run:
        run.say("calibrating")
        return investigate_prepared(run, _said(prepare(dataset, read), progress), simulation).diagnosis


@dataclass(frozen=True)
class Investigation:
    """A diagnosis with the hypotheses that it tried, for whoever plans what to measure next.

    `settled` is the hypothesis at which it ended, named or not; `equals` explain the data as well, another
    cause in a kept one's place; `hypotheses` has every set of causes that was fitted.
    """

    diagnosis: DiagnosisResult
    split: SplitProblem
    settled: Fit
    equals: tuple[Fit, ...]
    hypotheses: tuple[Scored, ...]


def investigate(
    dataset: Dataset,
    place: Workers = SERIAL,
    progress: bool = False,
    simulation: bool = True,
    budget_s: float = math.inf,
) -> Investigation:
    """Return the diagnosis of a data set with its hypotheses; arguments as of `diagnose_dataset`.

    It looks for causes where too little was measured to name any, too.

    Raises:
        InputError: no scheduler answers, or processes were killed again and again.
    """
    with running(place, progress, budget_s) as run:
        run.say("calibrating")
        return investigate_prepared(run, _said(prepare(dataset), progress), simulation)


def _said(prepared: Prepared, progress: bool) -> Prepared:
    """Return measurements, after a note on standard error of what is far beyond the robot or looks wrong."""
    if progress:
        beyond = [item.text for item in prepared.notes if item.code == BEYOND]
        for text in (*(item.words for item in prepared.faults), *beyond):
            note(f"diagnose: note: {text}")
    return prepared


def investigate_prepared(
    run: DiagnosisRun,
    prepared: Prepared,
    simulation: bool = True,
    most: int = MOST_CAUSES,
    chosen: Choice | None = None,
) -> Investigation:
    """Return the diagnosis of measurements that can be fitted, with its hypotheses.

    At most `most` causes may be named; 0: none is, whatever explains the data. `chosen`: the causes of these
    measurements, where they were looked for already, whatever `most` is.
    """
    split = split_problem(prepared)
    before = calibrate(split)
    faults = without_explained_faults(run, split, before, find_data_faults(split, before))
    choice = chosen or choose_causes(run, split, faults, most)
    split = choice.applied(split)
    attempt = Attempts()
    kept, examined, scores, verdict, replayed = _settle(
        run, split, before, choice, faults, simulation, attempt
    )
    conclusion = attempt(
        "What is said of the causes",
        lambda: conclude(split, before, choice, kept, examined, scores, verdict, replayed),
        lambda: concluded_plainly(split, before, kept, examined, scores, verdict),
    )
    following = attempt(
        "The next experiment",
        lambda: plan_next_experiment(run, split, conclusion, simulation),
        nothing_planned,
    )
    sure = attempt(
        "How sure the numbers are",
        lambda: widen_intervals(run, split, conclusion, replayed, verdict.more_is_wrong),
        lambda: conclusion,
    )
    found = assemble(prepared, split, faults, choice, kept, verdict, sure, following, scores, attempt)
    if found.has_too_little:
        found = replace(found, unproved=fit_unproved(split, choice, kept))
    return Investigation(found, split, kept.pruned.after, conclusion.equals, scores.hypotheses)


def _settle(
    run: DiagnosisRun,
    split: SplitProblem,
    before: Calibrated,
    choice: Choice,
    faults: Faults,
    simulation: bool,
    attempt: Attempts,
) -> tuple[HeldoutChoice, Examined, Scores, Verdict, Replayed]:
    """Return the hypothesis that stays, with what was found of it, the verdict and its replay.

    The replay may take a cause out. What is left is then another hypothesis, which is judged and replayed
    once more.
    """
    kept = attempt(
        "What the held-out data say of the causes",
        lambda: decide_on_heldout(run, split, before, choice),
        lambda: no_heldout_choice(run, split, before),
    )
    while True:
        found = _judged(run, split, before, choice, kept, faults, simulation, attempt)
        if found[0].pruned.after is kept.pruned.after:
            return found
        kept = found[0]


def _judged(
    run: DiagnosisRun,
    split: SplitProblem,
    before: Calibrated,
    choice: Choice,
    kept: HeldoutChoice,
    faults: Faults,
    simulation: bool,
    attempt: Attempts,
) -> tuple[HeldoutChoice, Examined, Scores, Verdict, Replayed]:
    """Return a hypothesis pruned beside its replay, what was found of it, the verdict and the replay."""
    examined = attempt(
        "On what the error depends",
        lambda: examine(split, before, kept),
        lambda: examined_plainly(split, before, kept),
    )
    scores = attempt(
        "How probable each cause is",
        lambda: score_hypotheses(run, split, choice, kept, examined, faults),
        unscored,
    )
    verdict = attempt(
        "The judgement of the causes",
        lambda: judge(split, before, kept, faults, examined, scores),
        lambda: unjudged(before, faults),
    )
    replayed = attempt(
        "The replay in MuJoCo", lambda: replay_in_mujoco(run, split, verdict, simulation), Replayed
    )
    if verdict.corrects:
        kept = attempt(
            "The weighing of the causes",
            lambda: prune_again(run, split, choice, kept, replayed),
            lambda: kept,
        )
    return kept, examined, scores, verdict, replayed


# ----------------------------------------------------------------------------------------------------
# The best next experiment after a diagnosis: hypotheses that are still alive, and what a bench can play.


def best_after(
    found: Investigation,
    ranges: Mapping[str, tuple[float, float]],
    longest_s: float,
    price: float = NATS_PER_MINUTE,
    pool: Workers = SERIAL,
) -> BestExperiment:
    """Return the experiment that tells most between the hypotheses that a diagnosis leaves alive.

    `ranges`: least and most of each input that can be played, in its column's unit; `longest_s`: of one
    programme [s]; `price`: of a minute of it [nat].
    """
    problem = found.split.train
    steps = np.concatenate([np.diff(trial.inputs.time_s) for trial in problem.trials])
    columns = input_channels(problem.robot, problem.trials[0].inputs.actuation)
    bench = bench_of(columns, ranges, float(np.median(steps)), longest_s)
    alive = alive_hypotheses(found.diagnosis.probabilities, found.settled, found.equals, found.hypotheses)
    noise = {unit: result.noise_floor for unit, result in found.diagnosis.by_unit.items()}
    return best_experiment(problem, alive, bench, noise, found.split.dataset.gravity_mps2, price, pool)
