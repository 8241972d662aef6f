"""Writes a draw and reads it back: the data set, the answer, the third set of trials."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.draw import truth
from catheter_sim.blind_bench.make import Made
from catheter_sim.blind_bench.places import ANSWER, Folders, write_json, write_tables
from catheter_sim.blind_bench.robots import BenchRobot
from catheter_sim.catalogue import read_toml, robot_toml
from catheter_sim.channels import channel_inputs, input_channels, read_inputs
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.trials import Trial, unit_of
from catheter_sim.robots.documents import complete_document, robot_from_document
from catheter_sim.tables import Table, read_table, write_table
from catheter_sim.units import si_factor

TRUTH = "truth.toml"


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
    tables = [(_table(bench.robot, inputs, columns, outputs), role) for inputs, outputs, role in trials]
    write_tables(folder, name, bench, columns, gravity_mps2, tables)


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
