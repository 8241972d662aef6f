"""Inputs beyond what a robot can follow get a line for each column; those that it can follow get none."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.catalogue import ROBOTS, load_robot
from catheter_sim.channels import channel_inputs, drives_of, read_inputs
from catheter_sim.cli.main import main
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.errors import InputError
from catheter_sim.planning.bounded import beyond_limits
from catheter_sim.planning.models import inputs_at, plan_drives
from catheter_sim.resources import assets_folder
from catheter_sim.tables import read_table

EXAMPLES = assets_folder() / "examples"
FILES = sorted(path for path in EXAMPLES.glob("*/*.csv") if path.parent.name in ROBOTS)
SETS = sorted(path.parent for path in EXAMPLES.rglob("dataset.toml"))
SECTION = "neuroendoscope_section"
CIRCLE_N = 2.0 * math.pi * 17.2 / (1.4 * 60.0)  # T r L = EI 2 pi: 1.287 N


def tenfold(inputs: Inputs) -> Inputs:
    return replace(inputs, tendon=10.0 * inputs.tendon)


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_example_inputs_are_followed_and_ten_times_them_are_not(path: Path) -> None:
    """Where the reading of a file does not refuse them already."""
    robot, table = load_robot(path.parent.name), read_table(path)
    assert beyond_limits(robot, read_inputs(robot, table)) == ""
    more = replace(table, columns={name: 10.0 * values for name, values in table.columns.items()})
    try:
        read = read_inputs(robot, more)
    except InputError:
        return
    assert beyond_limits(robot, read)


@pytest.mark.parametrize("folder", SETS, ids=lambda path: path.name)
def test_what_was_measured_was_followed(folder: Path) -> None:
    data = load_dataset(folder)
    for trial in data.trials:
        assert beyond_limits(data.robot, trial.inputs) == ""
    assert any(beyond_limits(data.robot, tenfold(trial.inputs)) for trial in data.trials)


@pytest.mark.parametrize("reference", [*ROBOTS, *sorted(map(str, EXAMPLES.glob("*.toml")))])
def test_what_tasks_ask_of_a_robot_is_followed_and_ten_times_that_is_not(reference: str) -> None:
    """Each drive at the end of its range, one after the other, and at ten times that, each named once."""
    robot = load_robot(reference)
    drives = plan_drives(robot)
    levels = np.diag(drives.most)
    asked = inputs_at(drives, levels, np.arange(float(len(levels))))
    assert beyond_limits(robot, asked) == ""
    more = replace(asked, tendon=10.0 * (levels @ drives.tendon.T))
    moved = np.abs(channel_inputs(robot, more)).max(axis=0) > 0.0
    columns = [drive.column for drive, own in zip(drives_of(robot), moved, strict=True) if own]
    line = beyond_limits(robot, more)
    first, others = line.partition(": ")[2].partition(" = ")[0], line.partition("; beyond theirs, too: ")[2]
    named = [first, *filter(None, others.partition(" and ")[0].split(", "))]
    assert set(named) <= set(columns)
    assert len(set(named)) == len(named)


def test_short_thick_segments_end_where_their_elements_touch() -> None:
    """The trunk's: 105 mm long, 30 mm thick; its inner side is gone at 3.5 rad, not at a full circle."""
    robot = load_robot(EXAMPLES / "trunk" / "trunk.toml")
    ends_mm = 22.0 * 105.0 / 30.0
    for share, beyond in ((0.99, False), (1.01, True)):
        pulled = cs.inputs(robot, {"time_s": [0.0], "displacement_motor_3_in_mm": [share * ends_mm]})
        assert bool(beyond_limits(robot, pulled)) is beyond


def test_the_line_names_row_column_value_limit_and_why() -> None:
    """The first row beyond the tension that bends the section to a full circle, T = 2 pi EI / (r L)."""
    pull = {"time_s": [0.0, 1.0, 2.0, 3.0], "tension_right_N": [0.0, 0.98 * CIRCLE_N, 1.02 * CIRCLE_N, 90.0]}
    robot = load_robot(SECTION)
    assert beyond_limits(robot, cs.inputs(robot, pull)) == (
        f"row 3 (time_s = 2): tension_right_N = {1.02 * CIRCLE_N:.4g} is beyond {CIRCLE_N:.4g}: "
        "there this pull alone would bend a segment to a full circle"
    )


def test_a_pull_is_beyond_where_every_segment_is_a_circle() -> None:
    """2 pi r of the section, r = 1.4 mm; a tendon that is let out is slack, whatever its length."""
    robot = load_robot(SECTION)
    for pull_mm, beyond in ((8.7, False), (8.9, True), (-50.0, False)):
        table = {"time_s": [0.0], "displacement_right_mm": [pull_mm]}
        assert bool(beyond_limits(robot, cs.inputs(robot, table))) is beyond


def test_the_library_warns_once_of_all_columns() -> None:
    """A plain warning, at the caller's line, that names the second column, too."""
    pull = {"time_s": [0.0, 1.0], "tension_right_N": [1.5, 1.5], "tension_left_N": [1.5, 0.0]}
    with pytest.warns(
        UserWarning, match=f"{SECTION}: row 1 .*tension_right_N.*; beyond theirs, too: tension_left_N"
    ) as caught:
        cs.statics(SECTION, pull, model="pcca")
    assert [item.filename for item in caught] == [__file__]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cs.statics(SECTION, {"time_s": [0.0], "tension_right_N": [0.65]}, model="pcca")


@pytest.mark.parametrize("verb", [["simulate"], ["statics", "--model", "pcca"]])
def test_the_command_line_says_it_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: list[str]
) -> None:
    """With the file and its line; the rows are written all the same."""
    given, written = tmp_path / "in.csv", tmp_path / "out.csv"
    given.write_text("time_s,tension_right_N\n0,0\n1,90\n2,90\n")
    arguments = [verb[0], SECTION, *verb[1:], "--inputs", str(given), "-o", str(written)]
    assert main([*arguments, "--columns", "tip_x_mm"]) == 0
    (line,) = [text for text in capsys.readouterr().err.splitlines() if "warning" in text]
    assert line.startswith(f"catheter-sim: warning: {given}: line 3 (time_s = 1): tension_right_N = 90 is ")
    assert len(read_table(written).time_s) == 3
