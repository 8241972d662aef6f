"""An earlier recording: a data set, or the folder of its finished report."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import read_inputs
from catheter_sim.diagnosis.data.dataset import load_dataset
from catheter_sim.diagnosis.data.trials import Dataset, Trial
from catheter_sim.diagnosis.report.fitted_series import INPUT
from catheter_sim.errors import InputError
from catheter_sim.tables import read_table

REPORT = "diagnosis.json"


@dataclass(frozen=True)
class Earlier:
    """An earlier recording.

    Attributes:
        dataset: its trials.
        is_of_report: its robot is the one that a finished report found, calibrated and with causes in it;
            otherwise the robot as specified.
    """

    dataset: Dataset
    is_of_report: bool = False


def earlier_recording(where: Dataset | Path, later: Dataset) -> Earlier:
    """Return an earlier recording.

    Args:
        where: a data set, its folder, or the folder of its finished report.
        later: the recording that is compared with it.

    Raises:
        InputError: there is no data set and no finished report, or it cannot be compared.
    """
    if isinstance(where, Dataset):
        return Earlier(where)
    if is_report(where):
        return Earlier(recording_of_report(where, later), is_of_report=True)
    return Earlier(load_dataset(where))


def is_report(folder: Path) -> bool:
    """Return whether a folder is a finished report's."""
    return (folder / REPORT).is_file() and not (folder / "dataset.toml").is_file()


def recording_of_report(folder: Path, later: Dataset) -> Dataset:
    """Return the recording that a report is about, with the robot that the report found.

    Args:
        folder: of the report.
        later: the recording that is compared with it; conditions and outputs are taken to be the same.

    Raises:
        InputError: the report is not complete, is of other outputs, or its tracker stood elsewhere than the
            base frame.
    """
    document = _document(folder / REPORT)
    if document.get("since", {}).get("backward"):
        raise InputError(f"{folder}: its series are of the recording before: give the data set itself")
    if document.get("registration", {}).get("applied"):
        raise InputError(
            f"{folder}: its measurements were moved into the robot's base frame: give the data set itself"
        )
    robot = load_robot(folder / "robot.toml")
    files = sorted(folder.glob("fitted_*.csv"))
    if not files:
        raise InputError(f"{folder}: no fitted_*.csv: not a finished report")
    trials = []
    for path in files:
        table = read_table(path)
        for name in later.output_channels:
            if name not in table.columns:
                raise InputError(f"{path}: no column {name}, which the later recording measures")
        given = {
            name.removeprefix(INPUT): values
            for name, values in table.columns.items()
            if name.startswith(INPUT)
        }
        if not given:
            raise InputError(f"{path}: no columns {INPUT}...: written by an earlier version, diagnose again")
        measured = {name: table.columns[name] for name in later.output_channels}
        role = "heldout" if path.name.startswith("fitted_heldout") else "train"
        trials.append(
            Trial(
                path.name,
                role,
                read_inputs(robot, replace(table, columns=given)),
                replace(table, columns=measured),
            )
        )
    return replace(
        later,
        folder=folder,
        name=str(document.get("dataset", folder.name)),
        robot=robot,
        trials=tuple(trials),
        calibration=(),
    )


def _document(path: Path) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    if not isinstance(document, dict) or "verdict" not in document:
        raise InputError(f"{path}: not the diagnosis.json of a finished report")
    return document
