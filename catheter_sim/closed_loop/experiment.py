"""What one experiment is: a programme, played in several sizes; part of it is held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.channels import input_channels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.dataset import dataset_of
from catheter_sim.diagnosis.thresholds import SURE_BELIEF
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.effects import EFFECTS
from catheter_sim.lab.rig import Rig
from catheter_sim.tables import Table

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

    Args:
        programme: inputs in file units, from rest.
        robot: its columns.
        name: of the experiment; the plays are called `name_1`, `name_2`, ...
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
