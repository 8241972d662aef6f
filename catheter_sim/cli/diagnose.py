"""Say what a simulation gets wrong, given measured data, and extend the model by it.

example:
  catheter-sim diagnose assets/examples/opencr_v4 -o results/diagnosis --jobs 2

DATASET is a folder with dataset.toml (robot, conditions, channels, trials) and one CSV per trial:
time_s [s] and channels whose names end in their unit; an empty cell is a missing value.
dataset.toml needs (texts, unless said otherwise):
  [dataset]     name, robot (an id, or the path of a robot .toml beside it), source, licence
  [conditions]  gravity_mps2: three numbers in the base frame [m/s^2]
  [channels]    inputs, outputs: lists of column names; other columns are ignored, with a note
  [[trials]]    file: one such entry for each CSV
and may have:
  [conditions]  motion: "held", each row was held until the robot rested, or "dynamic": it moved as time_s
                says, from rest under each trial's first row; fits then go by the simulation, which takes
                minutes. warm_up_s: the time for which each trial is played and not judged, as a stretch
                of a longer recording does not begin at rest
  [[trials]]    role: "train" or "heldout". If no trial is held out, the last trials without a role are,
                about 30 % of the rows; a single trial is cut between two of its cycles
  [calibration] numbers of the robot with bounds, friction.mu = [0.0, 0.5] say: fitted within them
                before anything is called wrong; their 95 % intervals are reported. Several as one:
                NAME = { keys = [...], range = [lower, upper] }, or factor = [lower, upper] on each
  [map]         which column of a tracker's or a logger's own file is which channel; `catheter-sim import`
                proposes it, docs/reference/dataset_toml.md has its keys

The robot may be somebody's MJCF (arm.xml), with its actuators' controls as inputs (control_<actuator>). Then
causes are tried that any model may have: gain, offset, play, delay, damping, dry friction, stiffness,
payload, the tracker's frame. Outputs are joint_<name>_deg or _mm, site_<name>_x_mm, body_<name>_x_mm and
sensor_<name>; motion = "dynamic"; [conditions] settle_s: the first row is held so long before a trial begins.
A file has at most 100000 rows. Stamps in epoch seconds will do: each trial's clock starts at its first row.
The output folder gets diagnosis.json, report.html (opens without a network), model.xml and
robot.toml (the corrected robot, accepted wherever a robot id is), and the fitted series as CSV.
Errors are in mm or deg on held-out trials.
Too little may be measured to name any cause: fewer than 60 values to learn from, held-out data of fewer than
5 stretches or without motion. That is said at once, and no cause is looked for.
Several DATASETs are diagnosed one after the other, each into a folder of its own name in DIR.
A run that was stopped continues when it is started again with the same DIR.
Standard error says what is being done, with the time since the start.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from catheter_sim.cli import arguments
from catheter_sim.diagnosis.thresholds import COMPARING_BUDGET_S
from catheter_sim.errors import InputError
from catheter_sim.files import check_output_folder

if TYPE_CHECKING:
    from catheter_sim.diagnosis.result import Cause, DiagnosisResult


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.add_argument("datasets", metavar="DATASET", nargs="+", help="folder of a measured data set")
    arguments.add_output(parser, "DIR", "folder to write, made where it does not exist")
    arguments.add_jobs(parser)
    parser.add_argument(
        "--dask",
        metavar="ADDRESS",
        default="",
        help="scheduler of a Dask cluster to fit on, tcp://host:8786 say; needs the extra 'dask'",
    )
    parser.add_argument(
        "--since",
        metavar="OLD",
        action="append",
        help="an earlier data set of the same robot, or the folder of its finished report. Say only what "
        "changed since then. Give it again for a series, the first one first",
    )
    parser.add_argument(
        "--budget",
        metavar="SECONDS",
        type=arguments.positive,
        help="time after which the search for causes ends with the best so far; default "
        f"{COMPARING_BUDGET_S:g} with --since, none without",
    )
    parser.add_argument(
        "--search-anyway",
        action="store_true",
        help="look for causes where too little was measured to name any, too, and say what fits",
    )


def run(options: argparse.Namespace) -> int:
    """Diagnose, then print what was found."""
    folder = check_output_folder(options.output)
    if len(options.datasets) == 1:
        return _run_one(options, options.datasets[0], folder)
    if options.since:
        raise InputError("--since compares one data set with earlier ones: give one DATASET")
    names = [Path(name).resolve().name for name in options.datasets]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{name}: two data sets of this name would be written to one folder")
    _check_all(options.datasets)
    for name, dataset in zip(names, options.datasets, strict=True):
        print(f"{name}:")
        _run_one(options, dataset, folder / name)
    return 0


def _check_all(datasets: Iterable[str]) -> None:
    """Read every data set, before hours are spent on the first one.

    Raises:
        InputError: one of them cannot be read.
    """
    from catheter_sim.diagnosis.dataset import load_dataset
    from catheter_sim.foreign.model import is_foreign

    for name in datasets:
        if not is_foreign(name):
            load_dataset(name)


def _run_one(options: argparse.Namespace, dataset: str, folder: Path) -> int:
    """Diagnose one data set into a folder, then print what was found."""
    from catheter_sim.foreign.model import is_foreign

    if is_foreign(dataset):
        return _run_foreign(options, dataset, folder)
    if options.since:
        return _run_since(options, dataset, folder)
    from catheter_sim.diagnosis.pipeline import diagnose

    diagnosis = diagnose(
        dataset,
        folder,
        jobs=options.jobs,
        progress=True,
        dask=options.dask,
        budget_s=options.budget or math.inf,
        command=options.command_line,
        search_anyway=options.search_anyway,
    )
    print("\n".join(_lines(diagnosis)).replace("−", "-"))  # a minus sign that programs read
    print(f"wrote {folder / 'report.html'}, diagnosis.json, model.xml, robot.toml and the fitted series")
    return 0


def _run_foreign(options: argparse.Namespace, dataset: str, folder: Path) -> int:
    """Say what somebody's MJCF gets wrong."""
    for name in ("since", "budget", "dask", "search_anyway"):
        if getattr(options, name):
            option = name.replace("_", "-")
            raise InputError(f"{dataset}: --{option} is not for robots from somebody's MJCF")
    from catheter_sim.foreign.diagnose import diagnose_foreign, lines, write_foreign

    found = diagnose_foreign(dataset, options.jobs, progress=True)
    left = write_foreign(found, folder)
    print("\n".join(lines(found)))
    if left:
        print(f"not in model.xml, which cannot carry it: {', '.join(left)}")
    print(f"wrote {folder / 'report.html'}, diagnosis.json, model.xml and the fitted series")
    return 0


def _run_since(options: argparse.Namespace, dataset: str, folder: Path) -> int:
    """Say what changed since one earlier data set or several."""
    from catheter_sim.diagnosis.changes.compare import earlier_recording
    from catheter_sim.diagnosis.changes.report import (
        PICTURE_FILE,
        TABLE_FILE,
        comparison_sentence,
        mass_lines,
        series_lines,
        write_comparison,
    )
    from catheter_sim.diagnosis.changes.series import compare_series
    from catheter_sim.diagnosis.dataset import load_dataset
    from catheter_sim.diagnosis.document import stamped
    from catheter_sim.diagnosis.workers import Workers

    after = load_dataset(dataset)
    series = compare_series(
        [earlier_recording(Path(name), after) for name in options.since],
        after,
        Workers(options.jobs, options.dask),
        progress=True,
        budget_s=options.budget or COMPARING_BUDGET_S,
        search_anyway=options.search_anyway,
    )
    found, several = series.last, len(series.comparisons) > 1
    found = replace(found, diagnosis=stamped(found.diagnosis, options.command_line))
    write_comparison(found, folder, series if several else None)
    shown = replace(found.diagnosis, causes=found.changes)
    lines = [comparison_sentence(found), f"verdict: {found.verdict}", *list(_lines(shown, "change"))[2:]]
    lines.insert(2, f"rows that pair with the earlier recording: {found.paired_rows} of {found.rows}")
    lines += (*mass_lines(found), *(series_lines(series) if several else ()))
    print("\n".join(lines).replace("−", "-"))
    also = f", {TABLE_FILE}, {PICTURE_FILE}" if several else ""
    print(
        f"wrote {folder / 'report.html'}, diagnosis.json, model.xml, robot.toml{also} and the fitted series"
    )
    return 0


def _lines(diagnosis: DiagnosisResult, noun: str = "cause") -> Iterator[str]:
    """Yield the verdict in words, then the figures behind it; `noun`: what its causes are called."""
    from catheter_sim.diagnosis.document import tip_mm
    from catheter_sim.diagnosis.report import sentence
    from catheter_sim.diagnosis.thresholds import LEAST_SHOWN_PROBABILITY, NEAR_NOISE
    from catheter_sim.diagnosis.words import asks_of, figure_words, floor_words, heldout_error, rounded

    yield sentence(diagnosis)
    yield f"verdict: {diagnosis.verdict}"
    tip, error = tip_mm(diagnosis), heldout_error(diagnosis)
    if tip is not None:
        simulated = "" if math.isnan(error.simulated) else f"; {rounded(error.simulated)} in MuJoCo"
        simulated = simulated if error.what == "tip error" else ""
        yield (
            f"held out, tip error in space, RMS [mm]: {rounded(tip['before'])} before, "
            f"{rounded(tip['after'])} after{simulated}"
        )
    for unit, result in diagnosis.by_unit.items() if diagnosis.was_fitted else ():
        low, high = (rounded(end, 5.0) for end in result.gain_percent_ci95)
        before, after = rounded(result.rmse_before), rounded(result.rmse_after)
        yield (
            f"held out, RMSE [{unit}]: {before} before, {after} after; row-to-row noise "
            f"{rounded(result.noise_floor)}; gain {rounded(result.gain_percent, 5.0)} % "
            f"(95 %: {low} to {high})"
        )
    for unit, value in diagnosis.repeatability.items():
        yield f"repeatability at the same commands and history [{unit}]: {rounded(value)}"
    for cause in diagnosis.causes:
        yield from _cause_lines(cause, noun)
    for cause in diagnosis.corrections:
        yield from _cause_lines(cause, "correction, not established")
    for cause in diagnosis.absorbs:
        yield f"not believed, a number at a bound or unlikely: {cause.name}"
    if diagnosis.probabilities:
        yield "probabilities: " + ", ".join(
            f"{name} {value:.2f}"
            for name, value in sorted(diagnosis.probabilities.items(), key=lambda item: -item[1])
            if value >= LEAST_SHOWN_PROBABILITY
        )
    for unit, item in diagnosis.residual.items():
        on = f", depends on {', '.join(item.structure)}" if item.structure else ""
        if item.times_noise <= NEAR_NOISE:
            on = ", as little as a right model leaves"
        yield f"left, held out [{unit}]: {item.times_noise:.2g} times the row-to-row noise{on}"
    if said := floor_words(heldout_error(diagnosis)):
        yield f"what could be learned: {said}"
    for group in diagnosis.indistinguishable:
        yield f"these data cannot tell apart: {', '.join(group)}"
    for name, value in diagnosis.extra.items():
        yield f"{name} = {rounded(value)} ({figure_words(name)[0]})"
    for note in dict.fromkeys((*diagnosis.dataset.notes, *diagnosis.notes)):
        yield f"note: {note}"
    if noun == "cause":
        yield f"what to do: {asks_of(diagnosis)}"
    yield f"next experiment: {diagnosis.next_experiment.words}"


def _cause_lines(cause: Cause, noun: str) -> Iterator[str]:
    """Yield a cause, a correction or a change, and its numbers."""
    from catheter_sim.core.variation import said_of
    from catheter_sim.diagnosis.words import interval, rounded

    members = ", ".join(f"{name} {value:.2f}" for name, value in cause.members.items())
    probable = "" if math.isnan(cause.probability) else f", probability {cause.probability:.2f}"
    yield (
        f"{noun}: {' or '.join(cause.one_of)}{probable}{f' ({members})' if members else ''}, "
        f"{rounded(cause.gain_percent, 5.0)} % of the error before"
    )
    for name, parameter in cause.parameters.items():
        half = abs(parameter.ci95[1] - parameter.ci95[0]) / 2.0
        bounds = interval(parameter.value, parameter.ci95)
        of = f"{cause.name}: " if members else ""
        yield f"  {of}{said_of(name)} = {rounded(parameter.value, half)} (95 %: {bounds})"
