"""Diagnose, propose, measure, diagnose all together, kept in a folder to go on from."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from catheter_sim.catalogue import FILES, robot_toml
from catheter_sim.channels import channel_inputs, input_channels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.dataset import dataset_of
from catheter_sim.diagnosis.pipeline import Investigation, best_after, investigate, write_diagnosis
from catheter_sim.diagnosis.programmes import bench_of, programmes_within
from catheter_sim.diagnosis.report import sentence
from catheter_sim.diagnosis.result import DATA_SUSPECT
from catheter_sim.diagnosis.thresholds import NATS_PER_MINUTE, SURE_BELIEF
from catheter_sim.diagnosis.trials import Dataset, split_trials
from catheter_sim.diagnosis.workers import SERIAL, Workers
from catheter_sim.effects import EFFECTS
from catheter_sim.errors import InputError
from catheter_sim.lab.rig import Rig
from catheter_sim.tables import Table, read_table, replaced_when_whole, write_table
from catheter_sim.units import si_factor

# ----------------------------------------------------------------------------------------------------
# What one experiment is: a programme, played in several sizes; part of it is held out.

# Sizes of the plays of one experiment, with their roles: another size is another path, which tests what the
# first one taught. With the first four alone, one in ten experiments that tell enough ends just below sure.
PLAYS: tuple[tuple[float, str], ...] = (
    (1.0, "train"),
    (0.6, "train"),
    (0.8, "heldout"),
    (0.45, "heldout"),
    (0.9, "train"),
    (0.7, "heldout"),
)

Recording = tuple[str, str, Table]  # file, role ("train" or "heldout"), commands and readings


def plays_of(programme: Table, robot: RobotSpec, name: str) -> tuple[tuple[str, str, Table], ...]:
    """Return the plays of an experiment: name, role and inputs of each, every input column in them.

    `programme`: inputs in file units, from rest; the plays are called `name_1`, `name_2`, ...
    """
    none = np.zeros(len(programme.time_s))
    columns = {column: programme.columns.get(column, none) for column in input_channels(robot)}
    columns |= {column: values for column, values in programme.columns.items() if column not in columns}
    found = []
    for number, (size, role) in enumerate(PLAYS, start=1):
        scaled = {column: np.round(size * values, 5) for column, values in columns.items()}
        play = f"{name}_{number}"
        found.append((play, role, replace(programme, columns=scaled, where=f"{play}_inputs.csv")))
    return tuple(found)


def minutes_of(programme: Table) -> float:
    """Return how long an experiment with a programme takes [min]."""
    return len(PLAYS) * float(programme.time_s[-1] - programme.time_s[0]) / 60.0


def recorded(rig: Rig, name: str, role: str, inputs: Table) -> Recording | None:
    """Play inputs on a bench and return the recording; None where it has not arrived.

    Raises:
        InputError: the bench cannot play them, or what has arrived is no recording of them.
    """
    rig.reset()
    rig.play(inputs, name)
    found = rig.read()
    return None if found is None else (f"{name}.csv", role, found)


def dataset_from(rig: Rig, recordings: Sequence[Recording], name: str) -> Dataset:
    """Return recordings of one bench as one data set; a column that one of them lacks was zero, if an input.

    Raises:
        InputError: the recordings are not what a data set needs.
    """
    columns = dict.fromkeys(column for _, _, table in recordings for column in table.columns)
    inputs = [column for column in columns if column not in rig.columns]
    tables = []
    for file, role, table in recordings:
        none = np.zeros(len(table.time_s))
        filled = {column: table.columns.get(column, none) for column in inputs}
        tables.append((file, role, replace(table, columns={**table.columns, **filled})))
    return dataset_of(rig.robot, rig.reference, tables, rig.columns, rig.gravity_mps2, {}, name)


def sure_causes(believed: Mapping[str, float]) -> tuple[str, ...]:
    """Return the causes that stand at `SURE_BELIEF` or more, most believed first."""
    names = [name for name in EFFECTS if believed.get(name, 0.0) >= SURE_BELIEF]
    return tuple(sorted(names, key=lambda name: -believed[name]))


# ----------------------------------------------------------------------------------------------------
# What a closed loop keeps in its folder, to go on where it was: recordings as a data set, and its steps.
#
# `data/` is a data set that `diagnose` takes; `steps.json` holds what was believed and what was proposed,
# step by step; `experiments/` the programmes. Everything is written whole or not at all.

STEPS, DATA, EXPERIMENTS, REPORT = "steps.json", "data", "experiments", "diagnosis"
_ROBOT_FILE = "robot.toml"


@dataclass(frozen=True)
class LoopFinding:
    """What a diagnosis said.

    Attributes:
        verdict: the diagnosis's.
        believed: probability of every cause, "none" and "outside" (`diagnosis.probabilities`).
        sentence: what was found, in one sentence.
        sure: causes that stand at `SURE_BELIEF` or more.
        numbers: of the named causes: cause, parameter, value, and the ends of its 95 % interval, in the
            parameter's unit; an end may be infinite.
        alike: groups of causes that the data cannot tell apart.
    """

    verdict: str
    believed: Mapping[str, float]
    sentence: str
    sure: Sequence[str]
    numbers: Sequence[tuple[str, str, float, float, float]] = ()
    alike: Sequence[Sequence[str]] = ()


@dataclass(frozen=True)
class Proposed:
    """An experiment that was proposed.

    Attributes:
        name: of the experiment, and of its file.
        words: what is played.
        minutes: how long it takes, all plays.
        nats: the information that is expected; None of the first experiment, which nothing was asked of.
        settles: probability that it settles the matter, as far as the hypotheses go.
        tried: number of programmes that it was chosen from.
        alive: hypotheses that it is to tell apart, with their weights.
        off: by how many times the noise each rival, refitted, would be off if the first one were right.
        sensors: what one more sensor would be worth a word.
    """

    name: str
    words: str
    minutes: float
    nats: float | None = None
    settles: float | None = None
    tried: int = 0
    alive: Mapping[str, float] = field(default_factory=dict)
    off: Mapping[str, float] = field(default_factory=dict)
    sensors: Sequence[str] = ()


@dataclass(frozen=True)
class LoopStep:
    """A diagnosis, and what was proposed after it.

    `found` is None where there was nothing to diagnose, `proposed` where the loop ends here; `end` says why
    it ended, "" where it goes on.
    """

    recordings: int
    found: LoopFinding | None
    proposed: Proposed | None
    end: str = ""


@dataclass(frozen=True)
class LoopFolder:
    """The folder of a closed loop."""

    root: Path

    @property
    def data(self) -> Path:
        """The data set of all recordings so far."""
        return self.root / DATA

    @property
    def report(self) -> Path:
        """The report of the last diagnosis."""
        return self.root / REPORT

    def programme_file(self, name: str) -> Path:
        """Return the file of an experiment's inputs."""
        return self.root / EXPERIMENTS / f"{name}.csv"

    def programme(self, name: str) -> Table:
        """Return an experiment's inputs."""
        return read_table(self.programme_file(name))

    def keep_programme(self, name: str, table: Table) -> None:
        """Write an experiment's inputs."""
        self.programme_file(name).parent.mkdir(parents=True, exist_ok=True)
        write_table(table, self.programme_file(name))

    def steps(self, about: Mapping[str, Any]) -> list[LoopStep]:
        """Return the steps so far.

        `about`: robot, gravity and columns of the bench.

        Raises:
            InputError: the folder holds another bench's loop, or a file that is none.
        """
        path = self.root / STEPS
        if not path.is_file():
            return []
        try:
            document = json.loads(path.read_text(encoding="utf-8"))
            steps = [_step_of(item) for item in document["steps"]]
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(f"{path}: is no loop's file ({error}); give another folder") from None
        for key, value in about.items():
            if document["about"].get(key) != value:
                raise InputError(
                    f"{path}: {key} is {document['about'].get(key)}, not {value}: the folder holds another "
                    "bench's loop. Give another folder"
                )
        return steps

    def keep(self, steps: Sequence[LoopStep], about: Mapping[str, Any]) -> None:
        """Write the steps so far."""
        self.root.mkdir(parents=True, exist_ok=True)
        document = {"about": dict(about), "steps": [_document_of(step) for step in steps]}
        with replaced_when_whole(self.root / STEPS) as file:
            file.write(json.dumps(document, indent=1, allow_nan=False) + "\n")

    def recordings(self) -> list[Recording]:
        """Return the recordings so far, in the order in which they were made."""
        path = self.data / "recordings.json"
        if not path.is_file():
            return []
        entries = json.loads(path.read_text(encoding="utf-8"))
        return [(file, role, read_table(self.data / file)) for file, role in entries]

    def keep_recordings(self, rig: Rig, recordings: Sequence[Recording]) -> None:
        """Write recordings as a data set; those that lie there already are not written again."""
        self.data.mkdir(parents=True, exist_ok=True)
        columns = dict.fromkeys(name for _, _, table in recordings for name in table.columns)
        inputs = [name for name in columns if name not in rig.columns]
        for name, _, table in recordings:
            none = np.zeros(len(table.time_s))
            whole = {column: table.columns.get(column, none) for column in inputs} | dict(table.columns)
            if not (self.data / name).is_file() or len(whole) > len(table.columns):
                write_table(Table(table.time_s, whole, name), self.data / name)
        own_file = rig.reference.endswith(FILES)
        document = {
            "dataset": {
                "name": "recordings of a closed loop",
                "robot": _ROBOT_FILE if own_file else rig.reference,
                "source": "catheter-sim lab",
                "licence": "as its recordings",
            },
            "conditions": {"gravity_mps2": [float(value) for value in rig.gravity_mps2]},
            "channels": {"inputs": inputs, "outputs": list(rig.columns)},
            "trials": [{"file": name, "role": role} for name, role, _ in recordings],
        }
        if own_file:
            (self.data / _ROBOT_FILE).write_text(robot_toml(rig.robot), encoding="utf-8")
        with replaced_when_whole(self.data / "dataset.toml") as file:
            file.write(tomli_w.dumps(document))
        with replaced_when_whole(self.data / "recordings.json") as file:
            file.write(json.dumps([[name, role] for name, role, _ in recordings]) + "\n")


def begun_with(rig: Rig, dataset: Dataset, where: str) -> list[Recording]:
    """Return the recordings of a data set with which a loop begins; `where` is what errors call it.

    Raises:
        InputError: it is of another robot than the bench's, or measures other columns.
    """
    if dataset.robot_reference != rig.reference and dataset.robot != rig.robot:
        raise InputError(f"{where}: is of {dataset.robot_reference}, the bench holds {rig.reference}")
    if dataset.output_channels != rig.columns:
        measured = ", ".join(dataset.output_channels)
        raise InputError(f"{where}: measures {measured}; the bench {', '.join(rig.columns)}")
    return recordings_of(dataset)


def recordings_of(dataset: Dataset) -> list[Recording]:
    """Return the trials of a data set as recordings, each with its role, the ones that train first."""
    found: list[Recording] = []
    columns = input_channels(dataset.robot, dataset.trials[0].inputs.actuation)
    unit = np.array([1.0 / si_factor(name) for name in columns])
    for number, trial in enumerate((item for part in split_trials(dataset) for item in part), start=1):
        commands = channel_inputs(dataset.robot, trial.inputs) * unit
        table = {name: commands[:, index] for index, name in enumerate(columns)} | dict(trial.outputs.columns)
        found.append((f"first_{number}.csv", trial.role, Table(trial.inputs.time_s, table, trial.file)))
    return found


def _document_of(step: LoopStep) -> dict[str, Any]:
    """Return a step as JSON holds it: an end without bound in words, as JSON has no infinity."""
    document = asdict(step)
    if step.found is not None:
        document["found"]["numbers"] = [
            (cause, name, *(part if math.isfinite(part) else str(part) for part in parts))
            for cause, name, *parts in step.found.numbers
        ]
    return document


def _step_of(document: Mapping[str, Any]) -> LoopStep:
    found, proposed = document["found"], document["proposed"]
    if found is not None:
        numbers = [(cause, name, *map(float, parts)) for cause, name, *parts in found["numbers"]]
        found = found | {"numbers": numbers}
    return LoopStep(
        document["recordings"],
        None if found is None else LoopFinding(**found),
        None if proposed is None else Proposed(**proposed),
        document["end"],
    )


# ----------------------------------------------------------------------------------------------------
# Diagnose, propose, measure, diagnose all together: until one cause is sure, or the budget ends.

SURE, NO_MORE, SUSPECT, NOTHING, WAITING = "sure", "budget", "suspect", "nothing to ask", "waiting"
LEAST_WORTH = 0.02  # nat: an experiment that promises less is none
_ROW_S = 1.0  # from row to row of the first experiment
_POLL_S = 0.5  # between two looks for a recording


@dataclass(frozen=True)
class Budget:
    """How much may be spent.

    Attributes:
        experiments: most experiments after the first data.
        minutes: of the bench's time, all plays.
        price: of a minute [nat].
        wait_s: how long to wait for a recording before the loop stops to be gone on with [s].
    """

    experiments: int = 5
    minutes: float = math.inf
    price: float = NATS_PER_MINUTE
    wait_s: float = 0.0


@dataclass(frozen=True)
class LoopOutcome:
    """How a loop ended, or where it waits.

    Attributes:
        steps: diagnoses and proposals, in order.
        end: `SURE`, `NO_MORE` (the budget), `SUSPECT` (the data look wrong), `NOTHING` (no programme would
            tell anything), or `WAITING`.
        causes: the causes that are sure.
        words: what it waits for, or why it ended.
    """

    steps: tuple[LoopStep, ...]
    end: str
    causes: tuple[str, ...]
    words: str


def run_loop(
    rig: Rig,
    folder: Path,
    first: Sequence[Recording] = (),
    budget: Budget | None = None,
    place: Workers = SERIAL,
    progress: bool = False,
    say: Callable[[str], None] = lambda line: None,
) -> LoopOutcome:
    """Run a closed loop, or go on with one whose folder is given.

    Without `first`, recordings that there are already, the loops of each channel are played first. `say` is
    called with a line where something was found, proposed or measured.

    Raises:
        InputError: the folder holds another bench's loop, a recording is not what it must be, or the bench
            cannot do what is asked.
    """
    spend, kept = budget or Budget(), LoopFolder(folder)
    about = {
        "robot": rig.reference,
        "gravity_mps2": [float(value) for value in rig.gravity_mps2],
        "columns": list(rig.columns),
    }
    steps = kept.steps(about)
    if not steps:
        if first:
            kept.keep_recordings(rig, first)
        else:
            steps.append(LoopStep(0, None, _first_experiment(rig, kept)))
            kept.keep(steps, about)
    while True:
        if steps and steps[-1].end:
            if steps[-1].end != NO_MORE or _spent(steps, spend):
                return _outcome(steps, steps[-1].end)
            steps.pop()  # the budget is larger now: what to do next is asked again
        if steps and steps[-1].proposed is not None:
            waits = _measure(rig, kept, steps[-1].proposed, spend.wait_s, say)
            if waits:
                return LoopOutcome(tuple(steps), WAITING, (), waits)
        steps.append(_next_step(rig, kept, steps, spend, place, progress, say))
        kept.keep(steps, about)


def _outcome(steps: Sequence[LoopStep], end: str) -> LoopOutcome:
    found = steps[-1].found
    words = {
        SURE: f"one cause stands at {SURE_BELIEF:g} or more",
        NO_MORE: "the budget is spent",
        SUSPECT: "the data look wrong",
        NOTHING: "no programme that the bench can play would tell more",
    }
    return LoopOutcome(tuple(steps), end, tuple(found.sure) if found is not None else (), words[end])


def _spent(steps: Sequence[LoopStep], budget: Budget) -> bool:
    """Return whether no further experiment may be made."""
    made = [step.proposed for step in steps if step.proposed is not None and step.found is not None]
    return len(made) >= budget.experiments or sum(item.minutes for item in made) >= budget.minutes


def _first_experiment(rig: Rig, kept: LoopFolder) -> Proposed:
    """Return what is played where nothing is known: the loops of each channel."""
    library = programmes_within(
        bench_of(input_channels(rig.robot), rig.limits.inputs, _ROW_S, rig.limits.duration_s)
    )
    if not library:
        raise InputError(f"lab: no programme takes less than {rig.limits.duration_s:g} s; allow more time")
    loops = [item for item in library if "loops" in item.words]
    chosen = next(
        (item for item in loops if item.words.startswith("each channel alone")), (loops or library)[0]
    )
    kept.keep_programme("first", chosen.table)
    return Proposed("first", chosen.words, minutes_of(chosen.table), tried=1)


def _measure(
    rig: Rig, kept: LoopFolder, proposed: Proposed, wait_s: float, say: Callable[[str], None]
) -> str:
    """Record the plays of an experiment that are missing; return what the bench waits for, "" for nothing."""
    recordings, programme = kept.recordings(), kept.programme(proposed.name)
    there = {file for file, _, _ in recordings}
    waits = ""
    for name, role, inputs in plays_of(programme, rig.robot, proposed.name):
        if f"{name}.csv" in there:
            continue
        until = time.monotonic() + wait_s
        found = recorded(rig, name, role, inputs)
        while found is None and time.monotonic() < until:
            time.sleep(_POLL_S)
            table = rig.read()
            found = None if table is None else (f"{name}.csv", role, table)
        if found is None:  # the others may have arrived, in whatever order
            waits = waits or rig.waiting()
            continue
        recordings.append(found)
        kept.keep_recordings(rig, recordings)
        say(f"measured {name}: {len(found[2].time_s)} rows")
    return waits


def _next_step(
    rig: Rig,
    kept: LoopFolder,
    steps: Sequence[LoopStep],
    budget: Budget,
    place: Workers,
    progress: bool,
    say: Callable[[str], None],
) -> LoopStep:
    """Diagnose all that was recorded; return what was found and what to do next."""
    recordings = kept.recordings()
    say(f"diagnosing {len(recordings)} recordings")
    found = investigate(dataset_from(rig, recordings, "recordings of a closed loop"), place, progress)
    write_diagnosis(found.diagnosis, kept.report)
    finding = _finding(found)
    say(f"{found.diagnosis.verdict}: {_open_words(finding)}")
    if finding.sure:
        return LoopStep(len(recordings), finding, None, SURE)
    if found.diagnosis.verdict == DATA_SUSPECT:
        return LoopStep(len(recordings), finding, None, SUSPECT)
    if _spent(steps, budget):
        return LoopStep(len(recordings), finding, None, NO_MORE)
    proposed = _propose(rig, kept, found, steps, budget, place)
    if proposed is None:
        return LoopStep(len(recordings), finding, None, NOTHING)
    say(f"proposed {proposed.name}, {proposed.minutes:.3g} min: {proposed.words}")
    return LoopStep(len(recordings), finding, proposed)


def _propose(
    rig: Rig,
    kept: LoopFolder,
    found: Investigation,
    steps: Sequence[LoopStep],
    budget: Budget,
    place: Workers,
) -> Proposed | None:
    best = best_after(found, rig.limits.inputs, rig.limits.duration_s, budget.price, place)
    spent = sum(
        step.proposed.minutes for step in steps if step.proposed is not None and step.found is not None
    )
    played = {step.proposed.words for step in steps if step.proposed is not None}
    fits = [
        item
        for item in best.ranking
        if item.programme.words not in played
        and item.information.nats >= LEAST_WORTH
        and minutes_of(item.programme.table) <= budget.minutes - spent
    ]
    if not fits:
        return None
    chosen = fits[0]
    name = f"experiment_{sum(step.proposed is not None and step.found is not None for step in steps) + 1}"
    kept.keep_programme(name, chosen.programme.table)
    return Proposed(
        name,
        chosen.programme.words,
        minutes_of(chosen.programme.table),
        chosen.information.nats,
        chosen.information.decided,
        len(best.ranking),
        {item.about: item.belief for item in best.hypotheses},
        best.off if chosen is best.best else {},
        [item.words for item in best.sensors] if chosen is best.best else [],
    )


def _finding(found: Investigation) -> LoopFinding:
    diagnosis = found.diagnosis
    beliefs = diagnosis.probabilities
    numbers = [
        (cause.name, name, float(item.value), float(item.ci95[0]), float(item.ci95[1]))
        for cause in diagnosis.causes
        for name, item in cause.parameters.items()
    ]
    return LoopFinding(
        diagnosis.verdict,
        {name: float(value) for name, value in beliefs.items()},
        sentence(diagnosis),
        list(sure_causes(beliefs)),
        numbers,
        [list(group) for group in diagnosis.indistinguishable],
    )


def _open_words(found: LoopFinding) -> str:
    shown = sorted(found.believed.items(), key=lambda item: -item[1])
    return ", ".join(f"{name} {value:.2f}" for name, value in shown if value >= 0.1) or "nothing above 0.1"
