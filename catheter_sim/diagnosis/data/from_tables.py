"""Measured data from tables that lie in no folder, checked as those in one are."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import output_channels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.checks import check_outputs
from catheter_sim.diagnosis.data.copies import refuse_copies
from catheter_sim.diagnosis.data.dataset import (
    ROLES,
    channel_list,
    check_channels,
    trial_of_columns,
)
from catheter_sim.diagnosis.data.motion import HELD, motion_named
from catheter_sim.diagnosis.data.nuisance import calibration_numbers
from catheter_sim.diagnosis.data.passed_over import known_inputs, notes_on_ignored, refuse_misspelled
from catheter_sim.diagnosis.data.trials import Dataset, Trial
from catheter_sim.diagnosis.data.warm_up import judged_late
from catheter_sim.errors import InputError, cut, unknown
from catheter_sim.tables import Table


def dataset_of(
    robot: RobotSpec,
    reference: str,
    tables: Sequence[tuple[str, str, Table]],
    outputs: Sequence[str] | None,
    gravity_mps2: Array,
    calibration: Mapping[str, Sequence[float] | Mapping[str, Any]],
    name: str,
    motion: str = HELD.name,
    warm_up_s: float = 0.0,
) -> Dataset:
    """Return measured data that lie in no folder, checked as those in one are.

    Args:
        robot, reference: the robot as specified, and its id or name.
        tables: of each trial its name, its role ("train", "heldout" or "") and its columns.
        outputs: columns that were measured; None: every output column that all tables have.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        calibration, motion, warm_up_s: as `[calibration]` and `[conditions]` of a `dataset.toml`.
        name: of the data.

    Raises:
        InputError: a trial or a column is missing, unknown or impossible.
    """
    if not tables:
        raise InputError(f"{name}: at least one trial is needed")
    inputs = tuple(
        column for column in known_inputs(robot) if any(column in table.columns for _, _, table in tables)
    )
    if outputs is None:
        measured = _measured_by_all(robot, tables, inputs, name)
    else:
        measured = channel_list(_listed(outputs), f"{name}: outputs")
    _check_tables(robot, tables, inputs, measured, name)
    read = [_trial_of(robot, trial, role, table, inputs, measured) for trial, role, table in tables]
    trials = judged_late([trial for trial, _ in read], warm_up_s, f"{name}: warm_up_s")
    check_outputs(robot, trials, measured, name)
    bounds = {key: _listed(item) for key, item in calibration.items()}
    dataset = Dataset(
        folder=Path(name),
        name=name,
        robot=robot,
        robot_reference=reference,
        source="",
        licence="",
        gravity_mps2=gravity_mps2,
        input_channels=inputs,
        output_channels=measured,
        trials=trials,
        motion=motion_named(motion, f"{name}: motion"),
        calibration=calibration_numbers(bounds, robot, name) or None,
        notes=notes_on_ignored(
            robot,
            {trial.file: ignored for trial, ignored in read if ignored},
            "no channel that every trial has," if outputs is None else "not among the outputs",
            output_channels(robot) if outputs is None else (),
        ),
    )
    refuse_copies(dataset, {trial.file: _content(trial) for trial in trials}, name)
    return dataset


def _check_tables(
    robot: RobotSpec,
    tables: Sequence[tuple[str, str, Table]],
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    name: str,
) -> None:
    """Raise `InputError` where a column or role is unknown, no trial trains, or an input is misspelled."""
    check_channels(robot, inputs, outputs, name)
    for trial, role, table in tables:
        if role and role not in ROLES:
            raise unknown("role", str(role), ROLES, f"{name}: {trial}")
        refuse_misspelled(robot, table)
    if all(role == "heldout" for _, role, _ in tables):
        raise InputError(f"{name}: every trial is held out; at least one must train")


def _measured_by_all(
    robot: RobotSpec, tables: Sequence[tuple[str, str, Table]], inputs: Sequence[str], where: str
) -> tuple[str, ...]:
    """Return the output columns that all of `tables` have and that are no inputs, in the robot's order."""
    measured = tuple(
        name
        for name in output_channels(robot)
        if name not in inputs and all(name in table.columns for _, _, table in tables)
    )
    if not measured:
        raise InputError(f"{where}: no output column that every trial has; choices: tip_x_mm ...")
    return measured


def _trial_of(
    robot: RobotSpec, file: str, role: str, table: Table, inputs: Sequence[str], outputs: Sequence[str]
) -> tuple[Trial, tuple[str, ...]]:
    """Return the trial in `table`, and the names of columns that are passed over."""
    for name in outputs:
        if name not in table.columns:
            columns = ", ".join(("time_s", *table.columns, *table.ignored))
            raise InputError(f"{table.where}: no column {name}; columns: {cut(columns, 250)}")
    passed_over = tuple(name for name in table.columns if name not in (*inputs, *outputs))
    commanded = tuple(name for name in inputs if name in table.columns)
    return trial_of_columns(robot, file, role, table, commanded, outputs), (*table.ignored, *passed_over)


def _listed(value: Any) -> Any:
    """Return a sequence as a list, as files hold it, in a mapping too; what is none stays what it is."""
    if isinstance(value, Mapping):
        return {key: _listed(item) for key, item in value.items()}
    return value if isinstance(value, str) or not isinstance(value, Iterable) else list(value)


def _content(trial: Trial) -> bytes:
    """Return a digest of a trial's numbers."""
    inputs, columns = trial.inputs, trial.outputs.columns.values()
    parts = (inputs.time_s, inputs.tendon, inputs.force_tip, inputs.moment_tip, *columns)
    return hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in parts)).digest()
