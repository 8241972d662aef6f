"""Measured data from memory are those from a folder, checked in the same way."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.catalogue import ROBOTS
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.tables import Table, write_table

ROBOT = "neuroendoscope_section"
CALIBRATION = {"friction.mu": (0.0, 0.5)}


def trial(seed: int, rows: int = 12) -> dict[str, Any]:
    """Return a trial whose tip follows the pull, with seeded noise; one value is missing."""
    noise = np.random.default_rng(seed)
    pull = np.round(0.4 * np.abs(np.sin(0.5 * np.arange(rows))), 6)
    tip = np.round(80.0 * pull + noise.normal(0.0, 0.1, rows), 6)
    tip[3] = np.nan
    load = np.linspace(0.0, 0.011, rows).round(6)
    return {
        "time_s": np.arange(rows, dtype=float),
        "tension_right_N": pull,
        "force_tip_x_N": load,
        "tip_x_mm": tip,
        "tip_z_mm": 60.0 - 0.5 * pull,
    }


def written(folder: Path, tables: dict[str, dict[str, Any]], roles: dict[str, str]) -> Path:
    """Write trials as a data set of a folder."""
    entries = ""
    for name, table in tables.items():
        columns = {key: values for key, values in table.items() if key != "time_s"}
        write_table(Table(table["time_s"], columns), folder / name)
        role = f'role = "{roles[name]}"\n' if name in roles else ""
        entries += f'[[trials]]\nfile = "{name}"\n{role}'
    (folder / "dataset.toml").write_text(
        f'[dataset]\nname = "pulls"\nrobot = "{ROBOT}"\nsource = "-"\nlicence = "-"\n'
        "[conditions]\ngravity_mps2 = [0.0, 0.0, -9.81]\n"
        '[channels]\ninputs = ["tension_right_N", "force_tip_x_N"]\noutputs = ["tip_x_mm", "tip_z_mm"]\n'
        f"[calibration]\nfriction.mu = [0.0, 0.5]\n{entries}"
    )
    return folder


def test_data_from_memory_equal_those_from_a_folder(tmp_path: Path) -> None:
    """The same numbers give the same data set, whether they come from tables or from files."""
    tables = {"a.csv": trial(1), "b.csv": trial(2), "c.csv": trial(3)}
    roles = {"c.csv": "heldout", "a.csv": "train"}
    read = cs.load_dataset(written(tmp_path, tables, roles))
    made = cs.dataset(
        ROBOT, tables, gravity_mps2=(0, 0, -9.81), roles=roles, calibration=CALIBRATION, name="pulls"
    )
    other = {"folder", "source", "licence", "trials", "gravity_mps2", "calibration"}
    same = {item.name for item in fields(Dataset)} - other
    assert [item.parameter for item in made.calibration] == [item.parameter for item in read.calibration]
    assert [item.parameter.name for item in made.calibration] == ["friction.mu"]
    for name in same:
        assert getattr(made, name) == getattr(read, name), name
    np.testing.assert_array_equal(made.gravity_mps2, read.gravity_mps2)
    assert [item.role for item in made.trials] == ["train", "", "heldout"]
    for ours, theirs in zip(made.trials, read.trials, strict=True):
        assert (ours.file, ours.role) == (theirs.file, theirs.role)
        for name in ("time_s", "actuation", "tendon", "force_tip", "moment_tip"):
            np.testing.assert_array_equal(getattr(ours.inputs, name), getattr(theirs.inputs, name))
        np.testing.assert_array_equal(ours.outputs.time_s, theirs.outputs.time_s)
        assert list(ours.outputs.columns) == list(theirs.outputs.columns)
        for name, values in theirs.outputs.columns.items():
            np.testing.assert_array_equal(ours.outputs.columns[name], values)


def test_one_table_is_one_trial() -> None:
    """A single table needs no list around it."""
    (only,) = cs.dataset(ROBOT, trial(1)).trials
    assert only.file == "trial_1"


def test_columns_of_no_use_may_hold_anything_and_are_noted() -> None:
    """A column that the robot does not know is ignored with a note, as in a file."""
    with pytest.warns(UserWarning, match="who"):
        data = cs.dataset(ROBOT, [trial(1) | {"who": ["me"] * 12}, trial(2)])
    assert data.output_channels == ("tip_x_mm", "tip_z_mm")
    (note,) = data.notes
    assert "trial_1" in note.text
    assert "who" in note.text


@pytest.mark.parametrize(
    ("column", "nearest"), [("tip_x_m", "tip_x_mm for tip_x_m"), ("Tip_Y_mm", "tip_y_mm"), ("room_C", "")]
)
def test_unknown_columns_are_warned_of(column: str, nearest: str, tmp_path: Path) -> None:
    """By name, with the nearest column if there is one; from tables and from a folder, at the user's line."""
    tables = {name: trial(seed) | {column: np.ones(12)} for name, seed in (("a.csv", 1), ("b.csv", 2))}
    with pytest.warns(UserWarning, match=f"a.csv, b.csv: .*ignored: {column}") as made:
        cs.dataset(ROBOT, tables)
    folder = written(tmp_path, tables, {})
    with pytest.warns(UserWarning, match=f"not listed in dataset.toml and ignored: {column}") as read:
        cs.load_dataset(folder)
    for (warning,) in (made.list, read.list):
        assert warning.filename == __file__
        assert nearest in str(warning.message)
        assert ("Nearest" in str(warning.message)) == bool(nearest)


def test_columns_left_out_on_purpose_are_not_warned_of(
    tmp_path: Path, recwarn: pytest.WarningsRecorder
) -> None:
    """Outputs that `outputs` or dataset.toml does not list are not; one that only some trials have is."""
    more = {name: trial(seed) | {"tip_y_mm": np.ones(12)} for name, seed in (("a.csv", 1), ("b.csv", 2))}
    cs.dataset(ROBOT, more, outputs=["tip_x_mm"])
    assert cs.load_dataset(written(tmp_path, more, {})).notes
    assert not recwarn.list
    with pytest.warns(UserWarning, match="trial_1: no channel that every trial has, and ignored: tip_y_mm"):
        cs.dataset(ROBOT, [more["a.csv"], trial(2)])


@pytest.mark.parametrize(
    ("column", "meant"),
    [
        ("tension_left_n", "tension_left_N"),
        ("tension_leftt_N", "tension_left_N"),
        ("tnsion_left_N", "tension_left_N"),
        ("left_tension_N", "tension_left_N"),
        ("tension_left_kN", "tension_left_N"),
        ("tension_up_N", "tension_left_N"),
        ("force_tip_y_mN", "force_tip_y_N"),
        ("force_body_3_x_N", "force_tip_x_N"),
    ],
)
def test_an_input_that_is_misspelled_is_an_error(column: str, meant: str) -> None:
    """Its name is nearly that of an input that the table lacks, or begins as the inputs do."""
    with pytest.raises(cs.InputError, match=rf"trial_1: .*{column}.*{meant}"):
        cs.dataset(ROBOT, [trial(1) | {column: np.ones(12)}, trial(2)])


@pytest.mark.parametrize(
    "column", ["tension_right_measured_N", "force_z_N", "displacement_laser_mm", "tip_x_m"]
)
def test_a_log_beside_the_inputs_is_no_misspelled_one(column: str) -> None:
    """It is like an input that is there, or like none that can be."""
    with pytest.warns(UserWarning, match=column):
        cs.dataset(ROBOT, trial(1) | {column: np.ones(12)})


def test_a_data_set_shows_itself_on_a_screen() -> None:
    """Name, robot, trials with rows and roles, channels and conditions, in a few lines."""
    tables = {f"trial_{k}": trial(k) for k in range(12)}
    data = cs.dataset(ROBOT, tables, gravity_mps2=(0, 0, -9.81), roles={"trial_1": "heldout"}, name="pulls")
    lines = repr(data).splitlines()
    assert lines == [
        "<Dataset 'pulls' of neuroendoscope_section: 12 trials, 144 rows",
        "  inputs: tension_right_N, force_tip_x_N",
        "  outputs: tip_x_mm, tip_z_mm",
        "  trials: trial_0 (12 rows), trial_1 (12 rows, heldout), trial_2 (12 rows) and 9 more",
        "  conditions: held, gravity 0, 0, -9.81 m/s^2>",
    ]
    shown = data._repr_html_()
    assert "trial_1 (12 rows, heldout)" in shown
    assert shown.count("\n") == len(lines) - 1


@pytest.mark.parametrize("name", ROBOTS)
def test_a_saved_robot_reads_back_equal(name: str, tmp_path: Path) -> None:
    """Every robot and parameter set: as it is, and with other numbers and every effect, to the last bit."""
    draw, plain = np.random.default_rng(7), cs.load_robot(name)
    numbers = {
        "friction.mu": draw.uniform(0.1, 0.3),
        "stiffness_scale": draw.uniform(0.9, 1.1),
        "tip_mass_g": draw.uniform(1.0, 2.0),
        "mount.axial_stiffness_N_per_mm": draw.uniform(10.0, 20.0),
    }
    for row in cs.list_effects(name):
        low, high = max(row["lower"], -1.0), min(row["upper"], 1.0)
        numbers[f"effects.{row['effect']}.{row['parameter']}"] = draw.uniform(low, max(low, high))
    changed = cs.load_robot(name, numbers)
    assert len(changed.effects) > 5
    for robot in (plain, changed):
        cs.save_robot(robot, tmp_path / "robot.toml")
        assert cs.load_robot(tmp_path / "robot.toml") == robot
    assert plain != changed


def test_a_tension_that_is_commanded_is_no_output() -> None:
    """`tension_right_N` names an input and an output; in a table of measurements it is the input."""
    assert cs.dataset(ROBOT, trial(1)).input_channels == ("tension_right_N", "force_tip_x_N")


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: cs.dataset(ROBOT, []), "data: at least one trial is needed"),
        (lambda: cs.dataset(ROBOT, 5), "data: tables, one a trial, are needed, not 5"),
        (lambda: cs.dataset(ROBOT, [5]), "trial_1: a mapping or a data frame of columns is needed, not 5"),
        (lambda: cs.dataset(ROBOT, ["time_s"]), "trial_1: a mapping or a data frame of columns is needed"),
        (lambda: cs.dataset(ROBOT, trial(1), outputs=["tip_a_mm"]), "unknown output column 'tip_a_mm'"),
        (lambda: cs.dataset(ROBOT, trial(1), outputs=["tip_y_mm"]), "trial_1: no column tip_y_mm"),
        (lambda: cs.dataset(ROBOT, trial(1), outputs="tip_x_mm"), "outputs: a list of channel names"),
        (lambda: cs.dataset(ROBOT, trial(1), outputs=5), "outputs: a list of channel names"),
        (lambda: cs.dataset(ROBOT, {"time_s": [0.0], "a": [1.0]}), "no output column that every trial has"),
        (lambda: cs.dataset(ROBOT, trial(1), gravity_mps2=5), "gravity_mps2 = 5: three finite numbers"),
        (lambda: cs.dataset(ROBOT, [trial(1)], roles=["training"]), "unknown role 'training'"),
        (lambda: cs.dataset(ROBOT, [trial(1)], roles=["train", "train"]), "one for each of 1 trials"),
        (lambda: cs.dataset(ROBOT, [trial(1)], roles="train"), "roles = 'train': one for each"),
        (lambda: cs.dataset(ROBOT, [trial(1)], roles={"b": "train"}), "roles: unknown trial 'b'"),
        (lambda: cs.dataset(ROBOT, [trial(1)], roles=["heldout"]), "every trial is held out"),
        (lambda: cs.dataset(ROBOT, trial(1), calibration={"friction.nu": (0, 1)}), "'friction.nu'"),
        (lambda: cs.dataset(ROBOT, trial(1), calibration={"friction.mu": 1}), "[lower, upper] is needed"),
        (
            lambda: cs.dataset(ROBOT, [trial(1), trial(1)], roles=["train", "heldout"]),
            "'trial_2' is a copy of 'trial_1'",
        ),
        (lambda: cs.dataset(ROBOT, trial(1) | {"tip_x_mm": np.full(12, np.nan)}), "tip_x_mm has no value"),
        (lambda: cs.dataset(ROBOT, trial(1) | {"tip_x_mm": "a"}), "trial_1: tip_x_mm: numbers are needed"),
        (lambda: cs.dataset("nothing", trial(1)), "unknown robot 'nothing'"),
        (lambda: cs.save_robot(ROBOT, "robot.txt"), "robot.txt: a robot is saved as a table; choices: .toml"),
        (lambda: cs.load_dataset("nowhere"), "nowhere: no such folder"),
        (lambda: cs.load_dataset(5), "dataset: a path is needed, not 5"),
        (lambda: cs.diagnose("nowhere"), "nowhere: no such folder"),
        (lambda: cs.diagnose(5), "dataset: a path is needed, not 5"),
        (lambda: cs.diagnose(cs.dataset(ROBOT, trial(1)), out=5), "out: a path is needed, not 5"),
        (lambda: cs.diagnose(cs.dataset(ROBOT, trial(1)), jobs=0), "jobs = 0: a whole number of 1 to"),
        (lambda: cs.diagnose(cs.dataset(ROBOT, trial(1)), budget_s=0), "budget_s = 0: a number of seconds"),
        (lambda: cs.compare([], cs.dataset(ROBOT, trial(1)), budget_s=True), "budget_s = True: a number of"),
        (lambda: cs.diagnose(cs.dataset(ROBOT, trial(1)), out=__file__), "cannot be made a folder"),
    ],
)
def test_bad_argument_is_one_line(call: Any, told: str) -> None:
    """What a user gets wrong is an `InputError` of one line that names it."""
    with pytest.raises(cs.InputError) as error:
        call()
    assert told in str(error.value)
    assert "\n" not in str(error.value)
