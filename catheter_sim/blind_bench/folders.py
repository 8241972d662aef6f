"""Where a draw lies: the data set in one folder, the answer in another, each whole or not there."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from catheter_sim.blind_bench.draw import truth
from catheter_sim.blind_bench.make import Made
from catheter_sim.blind_bench.robots import BenchRobot
from catheter_sim.catalogue import read_toml, robot_toml
from catheter_sim.channels import channel_inputs, input_channels, read_inputs
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.kinds.documents import complete_document, robot_from_document
from catheter_sim.tables import Table, read_table, replaced_when_whole, write_table
from catheter_sim.units import si_factor

ANSWER = "answer.json"
TRUTH = "truth.toml"


@dataclass(frozen=True)
class Folders:
    """The places of one draw below the bench's folder.

    Attributes:
        root: the bench's folder.
        index: of the draw.
    """

    root: Path
    index: int

    @property
    def name(self) -> str:
        """The draw's name, which says nothing about it."""
        return f"draw_{self.index:03d}"

    @property
    def data(self) -> Path:
        """The data set: all that the diagnosis is given."""
        return self.root / "data" / self.name

    @property
    def answer(self) -> Path:
        """The answer and the third set of trials."""
        return self.root / "answers" / self.name

    @property
    def found(self) -> Path:
        """What the diagnosis wrote."""
        return self.root / "found" / self.name

    @property
    def score(self) -> Path:
        """The score, written last."""
        return self.root / "scores" / f"{self.name}.json"

    def clear(self) -> None:
        """Remove whatever an interrupted run left of this draw."""
        for folder in (self.data, self.answer, self.found):
            shutil.rmtree(folder, ignore_errors=True)
        self.score.unlink(missing_ok=True)


def write_json(document: Any, path: Path) -> None:
    """Write a JSON file whole or not at all, its folder made if need be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replaced_when_whole(path) as file:
        file.write(json.dumps(document, indent=1, default=_plain) + "\n")


def read_json(path: Path) -> Any:
    """Return a JSON file's document; None where there is none, or half of one."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def write_draw(made: Made, folders: Folders) -> None:
    """Write the data set and the answer; the answer's own file last."""
    setting = made.setting
    folders.answer.mkdir(parents=True, exist_ok=True)
    write_dataset(
        folders.data,
        folders.name,
        setting.bench,
        setting.columns,
        setting.gravity_mps2,
        list(zip(setting.trials, made.outputs, setting.roles, strict=True)),
    )
    (folders.answer / TRUTH).write_text(robot_toml(truth(setting, made.hidden.effects)), encoding="utf-8")
    for number, (inputs, outputs) in enumerate(zip(setting.aside, made.aside, strict=True), start=1):
        table = _table(setting.bench.robot, inputs, setting.columns, outputs)
        write_table(table, folders.answer / f"aside_{number:02d}.csv")
    write_json(_answer(made), folders.answer / ANSWER)


def write_dataset(
    folder: Path,
    name: str,
    bench: BenchRobot,
    columns: Sequence[str],
    gravity_mps2: Array,
    trials: Sequence[tuple[Inputs, Array, str]],
) -> None:
    """Write a data set of made trials.

    Args:
        folder: to write.
        name: of the data set.
        bench: the robot as specified.
        columns: of the outputs.
        gravity_mps2: shape (3,).
        trials: inputs, outputs of shape (r, o) in file units, and role, "" for none.
    """
    folder.mkdir(parents=True, exist_ok=True)
    entries = []
    for number, (inputs, outputs, role) in enumerate(trials, start=1):
        file = f"trial_{number:02d}.csv"
        write_table(_table(bench.robot, inputs, columns, outputs), folder / file)
        entries.append({"file": file, "role": role} if role else {"file": file})
    document = {
        "dataset": {
            "name": name,
            "robot": bench.reference,
            "source": "made for the hidden-effect bench",
            "licence": "CC0-1.0",
        },
        "conditions": {"gravity_mps2": gravity_mps2.tolist()},
        "channels": {"inputs": input_channels(bench.robot), "outputs": list(columns)},
        "trials": entries,
    }
    (folder / "dataset.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    if bench.reference.endswith(".toml"):
        (folder / bench.reference).write_text(robot_toml(bench.robot), encoding="utf-8")


def robot_as_written(path: Path) -> RobotSpec:
    """Return the robot in a `.toml` without asking whether such a robot is possible.

    A specimen's calibrated numbers may lie a little beyond what the checks of a specification allow.
    """
    robot: RobotSpec = robot_from_document(complete_document(read_toml(path), str(path)), str(path))
    return robot


def read_aside(folders: Folders, columns: Sequence[str]) -> tuple[Trial, ...]:
    """Return the third set of trials."""
    robot = robot_as_written(folders.answer / TRUTH)
    trials = []
    for path in sorted(folders.answer.glob("aside_*.csv")):
        table = read_table(path)
        inputs = {name: values for name, values in table.columns.items() if name not in columns}
        outputs = {name: table.columns[name] for name in columns}
        trials.append(
            Trial(
                path.name,
                "heldout",
                read_inputs(robot, Table(table.time_s, inputs, str(path))),
                Table(table.time_s, outputs, str(path)),
            )
        )
    return tuple(trials)


def _answer(made: Made) -> dict[str, Any]:
    setting, hidden = made.setting, made.hidden
    noise = {unit_of(name): float(size) for name, size in zip(setting.columns, setting.noise, strict=True)}
    return {
        "seed": made.seed,
        "index": made.index,
        "story": made.story,
        "robot": made.robot,
        "effects": hidden.effects,
        "outside": hidden.outside_name,
        "outside_size": None if hidden.outside is None else hidden.outside.size,
        "outside_numbers": {} if hidden.outside is None else hidden.outside.numbers,
        "sizes_over_noise": hidden.sizes,
        "simulated_size_over_noise": made.size,
        "noise": noise,
        "gap": made.gap,
        "gap_with": made.gap_with,
        "calibration": setting.factors,
        "rows": sum(len(inputs) for inputs in setting.trials),
        "refused": made.refused,
    }


def _table(robot: RobotSpec, inputs: Inputs, columns: Sequence[str], outputs: Array) -> Table:
    """Return a trial as a file's table: channels' inputs, then outputs."""
    values = channel_inputs(robot, inputs)
    names = input_channels(robot)
    found = {name: values[:, index] * (1.0 / si_factor(name)) for index, name in enumerate(names)}
    found |= {name: outputs[:, index] for index, name in enumerate(columns)}
    return Table(inputs.time_s, found)


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{value!r} has no place in a JSON file")
