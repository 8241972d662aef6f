"""The fitted series of trials as CSV files: their names and columns."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain, count
from pathlib import PurePath

from catheter_sim.channels import channel_inputs, drives_of
from catheter_sim.diagnosis.data.trials import Dataset
from catheter_sim.diagnosis.report.result import TrialFit
from catheter_sim.tables import Table

INPUT = "input_"  # before a channel's name, in the fitted series


def fit_files(fits: Sequence[TrialFit]) -> tuple[str, ...]:
    """Return the names of the CSV files that hold the fitted series of trials, no two alike.

    `fitted_<role>_<trial>.csv`: the trial's file without its ending, its folders before it with `_` between
    (`a/t.csv` held out: `fitted_heldout_a_t.csv`). Where two trials would still have one name, on a system
    that takes capitals for small letters too, those that `dataset.toml` lists later get `_2`, `_3` ….
    """
    names: list[str] = []
    for fit in fits:
        path = PurePath(fit.file)
        parts = [part for part in (*path.parent.parts, path.stem) if part not in (path.anchor, "..")]
        trial = "_".join(parts)
        while len(os.fsencode(trial)) > _LONGEST_NAME:
            trial = trial[1:]
        name = "_".join(("fitted", *filter(None, [fit.role]), trial))
        taken = {other.lower() for other in names}
        numbers = (f"{name}_{number}" for number in count(2))
        names.append(next(item for item in chain([name], numbers) if item.lower() not in taken))
    return tuple(f"{name}.csv" for name in names)


def fit_table(fit: TrialFit, dataset: Dataset) -> Table:
    """Return measured, before, after and what was commanded side by side.

    Columns `<output>`, `before_<output>`, `after_<output>` and `input_<channel>`, of a data set's trial.
    """
    columns = dict(fit.measured.columns)
    for prefix, table in (("before", fit.before), ("after", fit.after)):
        columns |= {f"{prefix}_{name}": table.columns[name] for name in fit.measured.columns}
    inputs = next(trial.inputs for trial in dataset.trials if trial.file == fit.file)
    rows = slice(0, len(fit.time_s))
    drives = drives_of(dataset.robot, inputs.actuation)
    given = channel_inputs(replace(dataset.robot, actuation=inputs.actuation), inputs)
    for drive, values in zip(drives, given.T, strict=True):
        columns[f"{INPUT}{drive.column}"] = values[rows] / drive.quantity.file_size
    loads = (("force", inputs.force_tip, "N"), ("moment", inputs.moment_tip, "Nm"))
    for kind, values, unit in loads:
        if values.any():
            columns |= {f"{INPUT}{kind}_tip_{axis}_{unit}": values[rows, k] for k, axis in enumerate("xyz")}
    return Table(fit.time_s, columns, fit.file)


_LONGEST_NAME = 200  # of a trial, in the name of a file [bytes]; systems allow some 255 in all
