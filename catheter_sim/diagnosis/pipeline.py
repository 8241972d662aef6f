"""From a folder of measurements to a diagnosis: a row of stages, each a file in `stages`.

Each stage takes values and returns one; none knows a kind of robot or the name of an effect.
"""

from __future__ import annotations

import math
import os
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

from catheter_sim.diagnosis.causes.scored import Scored
from catheter_sim.diagnosis.data.dataset import load_dataset
from catheter_sim.diagnosis.data.trials import Dataset
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.workers import SERIAL, Workers
from catheter_sim.diagnosis.report.result import Diagnosis
from catheter_sim.diagnosis.report.write import write_results
from catheter_sim.diagnosis.stages.acquit_trials import acquit_trials
from catheter_sim.diagnosis.stages.assemble import assemble
from catheter_sim.diagnosis.stages.calibrate import Calibrated, calibrate
from catheter_sim.diagnosis.stages.choose_causes import Choice, choose_causes
from catheter_sim.diagnosis.stages.conclude import conclude
from catheter_sim.diagnosis.stages.decide_on_heldout import Settled, decide_on_heldout
from catheter_sim.diagnosis.stages.find_data_faults import Faults, find_data_faults
from catheter_sim.diagnosis.stages.fit_unproved import fit_unproved
from catheter_sim.diagnosis.stages.judge import Verdict, judge
from catheter_sim.diagnosis.stages.name_in_part import name_in_part
from catheter_sim.diagnosis.stages.not_searched import not_searched
from catheter_sim.diagnosis.stages.plan_next_experiment import plan_next_experiment
from catheter_sim.diagnosis.stages.pose import Posed, pose
from catheter_sim.diagnosis.stages.prepare import Prepared, prepare, readings_of
from catheter_sim.diagnosis.stages.replay_in_mujoco import Replayed, replay_in_mujoco, weigh_again
from catheter_sim.diagnosis.stages.run import Run, running
from catheter_sim.diagnosis.stages.score_hypotheses import score_hypotheses
from catheter_sim.diagnosis.stages.widen_intervals import widen_intervals
from catheter_sim.diagnosis.thresholds import MOST_CAUSES
from catheter_sim.effects.apply import embodied
from catheter_sim.modelling.build import build_mjcf

UNFINISHED = ".unfinished"  # folder of finished fits in the output folder of a run that was stopped


def diagnose(
    dataset: Dataset | str | os.PathLike[str],
    output_folder: str | os.PathLike[str],
    jobs: int = 1,
    progress: bool = False,
    dask: str = "",
    budget_s: float = math.inf,
    search_anyway: bool = False,
) -> Diagnosis:
    """Diagnose a data set and write what was found to a folder.

    A run that was stopped left its finished fits in the output folder; the same run, started again,
    takes them over. They are gone when it is done.

    Args:
        dataset: the measurements, or the folder with their dataset.toml.
        output_folder: gets diagnosis.json, report.html, robot.toml, model.xml and the fitted series.
        jobs: processes of this machine to fit with.
        progress: show what is being done where standard error is a terminal.
        dask: address of a Dask scheduler to fit on instead, "" for none.
        budget_s: seconds after which the search for causes ends with the best so far.
        search_anyway: look for causes where too little was measured to name any, too.

    Raises:
        InputError: the data set is not what it must be, the output folder cannot be written, or no
            scheduler answers.
    """
    data = dataset if isinstance(dataset, Dataset) else load_dataset(dataset)
    unfinished = Path(output_folder) / UNFINISHED
    place = Workers(jobs, dask, unfinished)
    diagnosis = diagnose_dataset(data, place, progress, budget_s=budget_s, search_anyway=search_anyway)
    write_diagnosis(diagnosis, output_folder)
    shutil.rmtree(unfinished, ignore_errors=True)
    return diagnosis


def write_diagnosis(diagnosis: Diagnosis, folder: str | os.PathLike[str]) -> None:
    """Write report, diagnosis.json, the extended robot and its model, and the fitted series to `folder`.

    Raises:
        InputError: the folder cannot be made or written.
    """
    actuation = diagnosis.dataset.trials[0].inputs.actuation
    write_results(diagnosis, folder, build_mjcf(embodied(diagnosis.extended_robot), actuation))


def diagnose_dataset(
    dataset: Dataset,
    place: Workers = SERIAL,
    progress: bool = False,
    simulation: bool = True,
    budget_s: float = math.inf,
    search_anyway: bool = False,
) -> Diagnosis:
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
        return investigate_prepared(run, prepare(dataset, read), simulation).diagnosis


@dataclass(frozen=True)
class Investigation:
    """A diagnosis with the hypotheses that it weighed, for whoever plans what to measure next.

    Attributes:
        diagnosis: the answer.
        posed: the problem that hypotheses were fitted to.
        settled: the hypothesis at which it ended, named or not.
        equals: those that explain the data as well, another cause in a settled one's place.
        hypotheses: every set of causes that was fitted.
    """

    diagnosis: Diagnosis
    posed: Posed
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
        return investigate_prepared(run, prepare(dataset), simulation)


def investigate_prepared(
    run: Run,
    prepared: Prepared,
    simulation: bool = True,
    most: int = MOST_CAUSES,
    chosen: Choice | None = None,
) -> Investigation:
    """Return the diagnosis of measurements that can be fitted, with its hypotheses.

    Args:
        run: where to fit, and how to say what is being done.
        prepared: the measurements.
        simulation: replay the held-out trials in MuJoCo at the end.
        most: causes that may be named; 0: none is, whatever explains the data.
        chosen: the causes of these measurements, where they were looked for already, whatever `most` is.
    """
    posed = pose(prepared)
    before = calibrate(posed)
    faults = acquit_trials(run, posed, before, find_data_faults(posed, before))
    choice = chosen or choose_causes(run, posed, faults, most)
    settled, verdict, replayed = _settle(run, posed, before, choice, faults, simulation)
    scores = score_hypotheses(run, posed, choice, settled, verdict)
    part, in_part = settled, verdict
    if most > 0:
        part, in_part = name_in_part(run, posed, before, settled, verdict, scores)
    if in_part is not verdict:
        again = replay_in_mujoco(run, posed, in_part, simulation)
        if weigh_again(part, in_part, again).weighed.after is part.weighed.after:
            settled, verdict, replayed = part, in_part, again
    conclusion = conclude(run, posed, before, choice, settled, verdict, replayed)
    following = plan_next_experiment(run, posed, conclusion, simulation)
    numbers = widen_intervals(run, posed, conclusion, replayed, verdict.in_part)
    found = assemble(
        prepared, posed, faults, choice, settled, verdict, conclusion, following, numbers, scores
    )
    if found.has_too_little:
        found = replace(found, unproved=fit_unproved(posed, choice, settled))
    return Investigation(found, posed, settled.weighed.after, conclusion.equals, scores.hypotheses)


def _settle(
    run: Run, posed: Posed, before: Calibrated, choice: Choice, faults: Faults, simulation: bool
) -> tuple[Settled, Verdict, Replayed]:
    """Return the hypothesis that stays, with the verdict on it and its replay.

    The replay may take a cause out. What is left is then another hypothesis, which is judged and replayed
    anew.
    """
    settled = decide_on_heldout(run, posed, before, choice)
    while True:
        verdict = judge(posed, before, settled, faults)
        replayed = replay_in_mujoco(run, posed, verdict, simulation)
        again = weigh_again(settled, verdict, replayed)
        if again.weighed.after is settled.weighed.after:
            return again, verdict, replayed
        settled = again
