"""What a closed loop keeps in its folder, to go on where it was: recordings as a data set, and its steps.

`data/` is a data set that `diagnose` takes; `steps.json` holds what was believed and what was proposed, step
by step; `experiments/` the programmes. Everything is written whole or not at all.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from catheter_sim.catalogue import FILES, robot_toml
from catheter_sim.channels import channel_inputs, input_channels
from catheter_sim.closed_loop.experiment import Recording
from catheter_sim.diagnosis.trials import Dataset, split
from catheter_sim.errors import InputError
from catheter_sim.lab.rig import Rig
from catheter_sim.tables import Table, read_table, replaced_when_whole, write_table
from catheter_sim.units import si_factor

STEPS, DATA, EXPERIMENTS, REPORT = "steps.json", "data", "experiments", "diagnosis"
_ROBOT_FILE = "robot.toml"


@dataclass(frozen=True)
class Found:
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
        off: by how many times the noise each rival, fitted anew, would be off if the first one were right.
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
class Step:
    """A diagnosis, and what was proposed after it.

    Attributes:
        recordings: how many there were.
        found: what the diagnosis said; None: there were none to diagnose.
        proposed: the experiment that follows; None: the loop ends here.
        end: why the loop ended; "" where it goes on.
    """

    recordings: int
    found: Found | None
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

    def steps(self, about: Mapping[str, Any]) -> list[Step]:
        """Return the steps so far.

        Args:
            about: robot, gravity and columns of the bench.

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
                    "bench's loop; give another folder"
                )
        return steps

    def keep(self, steps: Sequence[Step], about: Mapping[str, Any]) -> None:
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
    for number, trial in enumerate((item for part in split(dataset) for item in part), start=1):
        commands = channel_inputs(dataset.robot, trial.inputs) * unit
        table = {name: commands[:, index] for index, name in enumerate(columns)} | dict(trial.outputs.columns)
        found.append((f"first_{number}.csv", trial.role, Table(trial.inputs.time_s, table, trial.file)))
    return found


def _document_of(step: Step) -> dict[str, Any]:
    """Return a step as JSON holds it: an end without bound in words, as JSON has no infinity."""
    document = asdict(step)
    if step.found is not None:
        document["found"]["numbers"] = [
            (cause, name, *(part if math.isfinite(part) else str(part) for part in parts))
            for cause, name, *parts in step.found.numbers
        ]
    return document


def _step_of(document: Mapping[str, Any]) -> Step:
    found, proposed = document["found"], document["proposed"]
    if found is not None:
        numbers = [(cause, name, *map(float, parts)) for cause, name, *parts in found["numbers"]]
        found = found | {"numbers": numbers}
    return Step(
        document["recordings"],
        None if found is None else Found(**found),
        None if proposed is None else Proposed(**proposed),
        document["end"],
    )
