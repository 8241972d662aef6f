"""Verbs for a user's own files: `import`, `new`, `compare`, `example`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cli_command import Run

from catheter_sim.catalogue import load_robot
from catheter_sim.cli import new
from catheter_sim.core.document import to_document
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.examples import examples
from catheter_sim.resources import assets_folder
from catheter_sim.robots import KINDS
from catheter_sim.tables import read_table


def test_examples_are_those_that_are_shipped(run: Run, folder: Path) -> None:
    """Each is listed with what it is; a copy is the shipped one to the byte, and names the next command."""
    listed = run("example").out
    shipped = {path.name for path in (assets_folder() / "examples").iterdir()}
    assert set(examples()) == shipped
    for name, item in examples().items():
        assert f"{name:26} {item.says}" in listed
    ran = run("example", "neuroendoscope_section")
    assert (
        "next: catheter-sim simulate neuroendoscope_section --inputs neuroendoscope_section/loops.csv"
        in ran.out
    )
    original = assets_folder() / "examples" / "neuroendoscope_section" / "loops.csv"
    assert (folder / "neuroendoscope_section" / "loops.csv").read_bytes() == original.read_bytes()


def test_an_example_overwrites_nothing(run: Run, folder: Path) -> None:
    """What is there stays; an unknown name has the choices."""
    (folder / "mine").mkdir()
    assert "mine: is there already" in run("example", "opencr_v4", "-o", "mine").error()
    assert "unknown example 'opencr'; choices: " in run("example", "opencr").error()
    assert "a name is needed" in run("example", "-o", "mine").error()


def test_the_worn_catheter_is_imported_as_it_lies(run: Run, folder: Path) -> None:
    """The command that is printed works: metres, epoch stamps, y up and motor degrees are all found."""
    said = run("example", "worn_catheter").out.splitlines()[-1]
    ran = run(*said.removeprefix("next: catheter-sim ").split())
    assert ran.status == 0, ran.err
    assert "the file's x, -z, y" in ran.out
    lines = [line for line in ran.out.splitlines() if line.startswith("UNSURE")]
    assert [line.split()[1] for line in lines] == ["conditions.gravity_mps2:", "conditions.motion:"]
    data = load_dataset(folder / "my_data")
    assert len(data.trials) == 3
    assert np.abs(data.trials[0].inputs.tendon).max() == pytest.approx(1.6e-3, rel=1e-2)
    ran = run("simulate", "mitral_transseptal", "--inputs", "my_data", "--trial", "take_3", "-o", "out.csv")
    assert "it sees at (412" in ran.out + ran.err  # a metre away; the errors are the fault's
    errors = np.stack([read_table("out.csv").columns[f"error_tip_{axis}_mm"] for axis in "xyz"])
    assert 1.0 < np.sqrt((errors**2).sum(axis=0).mean()) < 5.0


@pytest.mark.parametrize("kind", KINDS)
def test_new_robot_is_a_robot_of_its_kind(kind: str, run: Run, folder: Path) -> None:
    """It loads under its own name; nothing in it speaks of the file that it was made from."""
    ran = run("new", "robot", "my_own", "--kind", kind)
    assert ran.status == 0, ran.err
    robot = load_robot("my_own.toml")
    assert robot.name == "my_own"
    assert to_document(robot).get("kind", "continuum") == kind
    assert kind in new._KINDS
    assert "assets/" not in (folder / "my_own.toml").read_text()
    assert "my_own.toml: is there already" in run("new", "robot", "my_own").error()


def test_new_dataset_wants_only_what_was_measured(run: Run, folder: Path) -> None:
    """All of it reads but for the empty columns, which the error names; filled in, it is a data set."""
    assert run("new", "robot", "my_own").status == 0
    assert run("new", "dataset", "my_data", "--robot", "my_own.toml").status == 0
    assert (
        "trial_01.csv: every value of the outputs is missing" in run("diagnose", "my_data", "-o", "r").error()
    )
    trial = folder / "my_data" / "trial_01.csv"
    head, *rows = trial.read_text().splitlines()
    filled = [row.removesuffix(",,,") + f",{k},{2 * k},{100 - k}" for k, row in enumerate(rows)]
    trial.write_text("\n".join([head, *filled]) + "\n")
    assert len(load_dataset(folder / "my_data").trials[0].inputs) == len(rows)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["new", "world", "x"], "unknown thing to write 'world'; choices: robot, dataset"),
        (["new", "robot", "my robot"], "a name of letters, digits and _ is needed"),
        (["new", "dataset", "x"], "--robot is needed"),
        (["new", "dataset", "x", "--robot", "none"], "unknown robot 'none'"),
        (["import", "no.csv", "--robot", "mitral_4dof", "-o", "d"], "no.csv: no such file"),
        (
            ["import", "no.csv", "--robot", "mitral_4dof", "--spool-radius", "-1", "-o", "d"],
            "must be above 0",
        ),
        (["compare", "no.csv", "in.csv"], "no.csv: no such file"),
        (
            ["compare", "in.csv", "in.csv", "--columns", "tip_x_mm"],
            "unknown column 'tip_x_mm'; choices: tension",
        ),
        (["compare", "in.csv", "in.csv", "-o", "out.txt"], "out.txt: choices: .png, .pdf, .svg"),
        (["compare", "in.csv", "late.csv"], "no column in common but time_s"),
    ],
    ids=lambda item: " ".join(item)[:40] if isinstance(item, list) else "",
)
def test_bad_arguments(words: list[str], message: str, run: Run, folder: Path, inputs: str) -> None:
    """One line says what is wrong and what may stand there; nothing is written."""
    (folder / "late.csv").write_text("time_s,other\n0,1\n")
    before = sorted(folder.rglob("*"))
    assert message in run(*words).error()
    assert sorted(folder.rglob("*")) == before


def test_compare_matches_rows_by_time(run: Run, folder: Path) -> None:
    """Clocks start at their first rows; a row between two of the other's meets the line between them."""
    (folder / "a.csv").write_text(
        "time_s,tip_x_mm,tip_y_mm,tip_z_mm,only\n0,0,0,0,1\n1,10,0,0,1\n2,20,0,0,1\n9,0,0,0,1\n"
    )
    (folder / "b.csv").write_text(
        "time_s,tip_x_mm,tip_y_mm,tip_z_mm\n100,3,4,0\n100.5,8,4,0\n101.5,18,4,0\n102,23,4,\n"
    )
    ran = run("compare", "a.csv", "b.csv", "-o", "apart.png")
    assert ran.status == 0, ran.err
    lines = ran.out.splitlines()
    assert (
        lines[0] == "3 rows matched by time (1 between two rows of the second); 1 rows of the first left out"
    )
    x, y = lines[2].split(), lines[3].split()
    assert x[:2] == ["tip_x_mm", "3"]  # by 3 throughout: at 1 s between 8 and 18
    assert y[:3] == ["tip_y_mm", "4", "4"]
    assert "tip, distance in space: rms 5 mm, largest 5 mm" in ran.out
    assert (folder / "apart.png").read_bytes().startswith(b"\x89PNG")
