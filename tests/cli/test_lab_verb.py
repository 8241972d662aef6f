"""The verb `lab`: what it writes, and bad input in one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli_command import Run

from catheter_sim.closed_loop.loop import PLAYS
from catheter_sim.tables import read_table

ROBOT, COLUMN = "mitral_4dof", "displacement_bending_proximal_mm"
REAL = ["--recordings", "inbox", "--columns", "tip_x_mm,tip_z_mm", "--limit", f"{COLUMN}=-1,1", "--loop"]


@pytest.fixture
def pull(folder: Path) -> str:
    """Name of a file of inputs."""
    (folder / "in.csv").write_text(f"time_s,{COLUMN}\n0,0\n1,0.5\n2,1.4\n3,0\n")
    (folder / "inbox").mkdir()
    return "in.csv"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([ROBOT, "-o", "x"], "one of the arguments --play --loop is required"),
        ([ROBOT, "--play", "no.csv", "-o", "x.csv"], "no.csv: no such file"),
        ([ROBOT, "--play", "in.csv", "-o", "no/x.csv"], "no/x.csv: cannot be written: no folder no"),
        ([ROBOT, "--hide", "rust", "--play", "in.csv", "-o", "x.csv"], "--hide: unknown cause 'rust'"),
        ([ROBOT, "--limit", f"{COLUMN}=1", "--loop", "-o", "x"], "INPUT=LEAST,MOST is needed"),
        ([ROBOT, "--gravity", "0,0,1", "--loop", "-o", "x"], "--gravity: of a real bench alone"),
        ([ROBOT, "--data", "d", "--play", "in.csv", "-o", "x.csv"], "--data: is where --loop begins"),
        ([ROBOT, "--recordings", "inbox", "--loop", "-o", "x"], "--columns and --limit are needed"),
        (
            [ROBOT, *REAL, "--hide", "backlash", "-o", "x"],
            "--hide: a real bench (--recordings) hides nothing",
        ),
        ([ROBOT, *REAL, "--data", "no", "-o", "x"], "no: no such folder"),
        ([ROBOT, *REAL[2:], "--recordings", "no", "-o", "x"], "no: no such folder; recordings arrive in"),
        ([ROBOT, "--limit", f"{COLUMN}=-1,1", "--play", "in.csv", "-o", "x.csv"], "in.csv: line 4"),
        (["no.toml", "--loop", "-o", "x"], "no.toml: no such file"),
    ],
)
def test_bad_input_is_one_line(words: list[str], message: str, run: Run, pull: str, folder: Path) -> None:
    """It names what is wrong, and nothing is written."""
    before = sorted(path.name for path in folder.iterdir())
    assert message in run("lab", *words).error()
    assert sorted(path.name for path in folder.iterdir()) == before


@pytest.mark.slow
def test_one_play_is_recorded(run: Run, pull: str, folder: Path) -> None:
    """Commands and readings, row by row; the same seed gives the same file; what is hidden is revealed."""
    words = ["lab", ROBOT, "--hide", "backlash.play=8", "--seed", "3", "--play", pull, "-o"]
    assert run(*words, "a.csv", "--reveal", "hidden.json").out.startswith("wrote a.csv: 4 rows")
    assert run(*words, "b.csv").status == 0
    assert (folder / "a.csv").read_text() == (folder / "b.csv").read_text()
    table = read_table("a.csv")
    np.testing.assert_array_equal(table.columns[COLUMN], [0.0, 0.5, 1.4, 0.0])
    assert "tip_x_mm" in table.columns
    (hidden,) = json.loads((folder / "hidden.json").read_text())["hidden"]
    assert (hidden["cause"], hidden["form"]) == ("backlash", "play")


@pytest.mark.slow
def test_a_real_bench_is_waited_for(run: Run, pull: str, folder: Path) -> None:
    """The inputs lie in its folder, the story says what is missing, and it can be started again."""
    for _ in range(2):
        ran = run("lab", ROBOT, *REAL, "-o", "out")
        assert ran.status == 0
        assert "first_1.csv: not there yet" in ran.out
    assert len(list((folder / "inbox").glob("*_inputs.csv"))) == len(PLAYS)
    assert "waited for" in (folder / "out" / "story.md").read_text()
