"""A trial's own file drives what drives a robot: by its data set, with what was measured beside it."""

from __future__ import annotations

import argparse
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.catalogue import load_robot
from catheter_sim.cli import arguments
from catheter_sim.cli.driven import drive
from catheter_sim.cli.main import main
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.recording import recording_of
from catheter_sim.errors import InputError
from catheter_sim.tables import read_table

EXAMPLES = Path(__file__).resolve().parents[2] / "assets" / "examples"
SETS = sorted(path.parent for path in EXAMPLES.rglob("dataset.toml"))
SECTION = "neuroendoscope_section"
PLAIN = "time_s,tension_right_N,tip_x_mm\n0,0,0.1\n1,0.2,18\n2,0.4,\n"
MAPPED = """\
[dataset]
name = "a winch's log"
robot = "neuroendoscope_section"
source = "made up for a test"
licence = "MIT"
[conditions]
gravity_mps2 = [0.0, 9.81, 0.0]
warm_up_s = 0.5
[channels]
inputs = ["tension_right_N"]
outputs = ["tip_x_mm", "tip_z_mm"]
[map]
time_s = { column = "t" }
tension_right_N = { column = "winch", unit = "mN" }
tip_x_mm = { column = "X", unit = "m", sign = -1 }
tip_z_mm = { column = "Z", unit = "m" }
[[trials]]
file = "log.csv"
[[trials]]
file = "more.csv"
"""
LOG = "t,winch,X,Z\n0,0,0,0.06\n1,200,-0.018,0.056\n2,400,-0.030,0.047\n3,200,-0.020,0.055\n"


@pytest.fixture
def mapped(tmp_path: Path) -> Path:
    """A data set whose file is not in the contract's columns."""
    (tmp_path / "dataset.toml").write_text(MAPPED)
    (tmp_path / "log.csv").write_text(LOG)
    (tmp_path / "more.csv").write_text(LOG.replace("-0.030", "-0.031"))
    return tmp_path


def ran(*words: str | Path) -> int:
    return main([str(word) for word in words])


@pytest.mark.parametrize("folder", SETS, ids=lambda path: path.name)
def test_every_trial_of_every_example_is_a_file_of_inputs(folder: Path) -> None:
    """With the numbers, the gravity and the motion that `diagnose` takes."""
    data = load_dataset(folder)
    for trial in data.trials:
        for found in (
            recording_of(data.robot, folder / trial.file),
            recording_of(data.robot, folder, Path(trial.file).stem),
        ):
            assert found.conditions is not None
            np.testing.assert_array_equal(found.conditions[0], data.gravity_mps2)
            assert found.conditions[1] is data.motion.moving
            np.testing.assert_array_equal(found.inputs.tendon, trial.inputs.tendon)
            for name in data.output_channels:
                np.testing.assert_array_equal(
                    found.measured.columns[name], trial.outputs.columns[name], strict=True
                )


def test_a_logs_columns_units_signs_and_gravity_are_taken(
    mapped: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Measured and error stand beside the computed columns; the warm-up has no measured value."""
    out = tmp_path / "out.csv"
    words = ("--model", "pcca", "--columns", "tip_x_mm,tip_qw", "-o", out)
    assert ran("statics", SECTION, "--inputs", mapped / "log.csv", *words) == 0
    said = capsys.readouterr().out
    assert f'{mapped / "log.csv"}: a trial of "a winch\'s log": held, gravity 0,9.81,0 m/s^2' in said
    table = read_table(out)
    assert list(table.columns) == ["tip_x_mm", "tip_qw", "measured_tip_x_mm", "error_tip_x_mm"]
    np.testing.assert_allclose(table.columns["measured_tip_x_mm"], [np.nan, 18.0, 30.0, 20.0])
    left = table.columns["tip_x_mm"] - table.columns["measured_tip_x_mm"]
    np.testing.assert_allclose(table.columns["error_tip_x_mm"], left, atol=1e-6)
    pull = {"time_s": [0.0, 1.0, 2.0, 3.0], "tension_right_N": [0.0, 0.2, 0.4, 0.2]}
    own = cs.statics(SECTION, pull, "pcca").to_table()
    np.testing.assert_allclose(table.columns["tip_x_mm"], own.columns["tip_x_mm"], atol=1e-6)


@pytest.mark.parametrize(
    ("given", "taken"), [((), [0.0, 9.81, 0.0]), (("--gravity=1,0,0",), [1.0, 0.0, 0.0])]
)
def test_gravity_is_the_data_sets_unless_given(
    mapped: Path, given: tuple[str, ...], taken: list[float]
) -> None:
    parser = argparse.ArgumentParser()
    arguments.add_robot(parser)
    arguments.add_inputs(parser)
    options = parser.parse_args([SECTION, "--inputs", str(mapped), "--trial", "log", *given])
    np.testing.assert_array_equal(drive(options).gravity_mps2, taken)


def test_a_trial_in_motion_is_simulated_in_motion(mapped: Path, tmp_path: Path) -> None:
    """As with --dynamic; held rows rest elsewhere."""
    text = MAPPED.replace("warm_up_s = 0.5", 'motion = "dynamic"')
    (mapped / "dataset.toml").write_text(text)
    found = {}
    for name, words in {"as_said": (), "asked": ("--dynamic",)}.items():
        out = tmp_path / f"{name}.csv"
        assert ran("simulate", SECTION, "--inputs", mapped / "log.csv", "-o", out, *words) == 0
        found[name] = read_table(out).columns["tip_x_mm"]
    np.testing.assert_array_equal(found["as_said"], found["asked"])
    (mapped / "dataset.toml").write_text(MAPPED)
    assert ran("simulate", SECTION, "--inputs", mapped / "log.csv", "-o", out) == 0
    assert np.abs(read_table(out).columns["tip_x_mm"] - found["asked"]).max() > 1e-4


def test_measured_columns_of_a_plain_file_pass(tmp_path: Path) -> None:
    """In Python, too; an empty cell is a missing value."""
    given, out = tmp_path / "in.csv", tmp_path / "out.csv"
    given.write_text(PLAIN)
    assert ran("statics", SECTION, "--model", "pcca", "--inputs", given, "-o", out) == 0
    errors = read_table(out).columns["error_tip_x_mm"]
    assert np.isfinite(errors).tolist() == [True, True, False]
    np.testing.assert_allclose(cs.read_inputs(SECTION, given).tendon[:, 0], [0.0, 0.2, 0.4])
    assert len(cs.statics(SECTION, given, model="pcca")) == 3


@pytest.mark.parametrize(
    ("column", "said"),
    [
        ("tip_w_mm", "unknown input channel 'tip_w_mm'"),
        ("body_99_x_mm", "unknown input channel 'body_99_x_mm'"),
        ("tension_rigth_N", "unknown input channel 'tension_rigth_N'"),
    ],
)
def test_a_column_that_the_robot_cannot_have_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], column: str, said: str
) -> None:
    given = tmp_path / "in.csv"
    given.write_text(PLAIN.replace("tip_x_mm", column))
    assert ran("simulate", SECTION, "--inputs", given, "-o", tmp_path / "out.csv") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line


def test_a_trial_of_another_robot_is_refused_unless_asked_for(
    mapped: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = tmp_path / "own.toml"
    cs.save_robot(replace(load_robot(SECTION), name="another"), own)
    words = ("--model", "pcca", "--inputs", mapped / "log.csv", "-o", tmp_path / "out.csv")
    assert ran("statics", own, *words) == 2
    assert (
        f"measured on {SECTION}, not on another; give {SECTION}, or say --other-robot"
        in capsys.readouterr().err
    )
    assert ran("statics", own, *words, "--other-robot") == 0
    with pytest.raises(InputError, match="measured on"):
        cs.read_inputs(own, mapped / "log.csv")


def test_a_folder_needs_its_trial(mapped: Path, tmp_path: Path) -> None:
    robot = load_robot(SECTION)
    with pytest.raises(InputError, match="--trial is needed; choices: log, more"):
        recording_of(robot, mapped)
    with pytest.raises(
        InputError, match=r"unknown trial 'lug'; nearest: log|unknown trial 'lug'; choices: log"
    ):
        recording_of(robot, mapped, "lug")
    with pytest.raises(InputError, match="--trial chooses a trial of a folder"):
        recording_of(robot, mapped / "log.csv", "log")
    shutil.copytree(mapped, tmp_path / "none", ignore=lambda folder, names: ["dataset.toml"])
    with pytest.raises(InputError, match=r"a folder without dataset\.toml"):
        recording_of(robot, tmp_path / "none", "log")


def test_compare_takes_a_trial_as_its_data_set_says(
    mapped: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The table has the written errors' size; the picture a panel of the difference."""
    out = tmp_path / "out.csv"
    assert ran("statics", SECTION, "--model", "pcca", "--inputs", mapped / "log.csv", "-o", out) == 0
    capsys.readouterr()
    assert ran("compare", out, mapped / "log.csv", "--columns", "tip_x_mm", "-o", tmp_path / "a.png") == 0
    line = next(row for row in capsys.readouterr().out.splitlines() if row.startswith("tip_x_mm"))
    errors = read_table(out).columns["error_tip_x_mm"]
    assert float(line.split()[1]) == pytest.approx(np.sqrt(np.nanmean(errors**2)), rel=1e-3)
    assert (tmp_path / "a.png").stat().st_size > 10_000


def test_a_file_is_known_however_the_data_set_names_it(mapped: Path, tmp_path: Path) -> None:
    """By ./, in a folder below, from another working folder; two of one name are told by their folders."""
    for day in ("one", "two"):
        (tmp_path / day).mkdir()
        (tmp_path / day / "log.csv").write_text(LOG)
    text = MAPPED.replace('file = "log.csv"', 'file = "one/log.csv"')
    text = text.replace('file = "more.csv"', 'file = "two/log.csv"\n[[trials]]\nfile = "./more.csv"')
    (tmp_path / "dataset.toml").write_text(text)
    robot = load_robot(SECTION)
    for place in ("one/log.csv", "more.csv", "two/../two/log.csv"):
        found = recording_of(robot, tmp_path / place)
        assert found.conditions is not None
        assert found.conditions[0].tolist() == [0.0, 9.81, 0.0]
        assert "measured" in found.said or "a trial of" in found.said
    assert recording_of(robot, tmp_path, "one/log").said != recording_of(robot, tmp_path, "two/log").said
    with pytest.raises(InputError, match="choices: one/log, two/log, more"):
        recording_of(robot, tmp_path, "log")
    (tmp_path / "dataset.toml").write_text("no table")  # another's, above
    (tmp_path / "one" / "plain.csv").write_text(PLAIN)
    assert recording_of(robot, tmp_path / "one" / "plain.csv").conditions is None


def test_compare_moves_a_trackers_positions_as_simulate_does(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The errors that `simulate` writes are the differences that `compare` prints."""
    example = EXAMPLES / "worn_catheter"
    takes = [example / f"take_{k}.csv" for k in (1, 2, 3)]
    words = ("--robot", "mitral_transseptal", "--spool-radius", "10", "-o", tmp_path / "d")
    assert ran("import", *takes, *words) == 0
    file = tmp_path / "d" / "take_1.csv"
    assert ran("simulate", "mitral_transseptal", "--inputs", file, "-o", tmp_path / "o.csv") == 0
    capsys.readouterr()
    assert ran("compare", tmp_path / "o.csv", file) == 0
    said = capsys.readouterr().out
    error = np.stack([read_table(tmp_path / "o.csv").columns[f"error_tip_{axis}_mm"] for axis in "xyz"])
    assert f"rms {np.sqrt((error**2).sum(axis=0).mean()):.4g} mm" in said
    assert "moved to the base" in said
    assert ran("compare", tmp_path / "d", file) == 2
    assert "a folder; give a CSV file" in capsys.readouterr().err
