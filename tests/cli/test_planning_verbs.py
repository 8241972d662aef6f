"""ik, sense, workspace, which-model, control: files in and out, bad input in one line."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from cli_command import Run

from catheter_sim.tables import read_table

ROBOT = "mitral_transseptal"
GOOD = "tip_x_mm,tip_y_mm,tip_z_mm\n20,5,70\n0,0,300\n"


def rows_of(path: str) -> list[dict[str, str]]:
    """Return the rows of a CSV file as texts."""
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_ik_writes_inputs_that_simulate_takes(run: Run, folder: Path) -> None:
    """The inputs lead the simulation to the target that is reachable; the report names the other's limit."""
    (folder / "t.csv").write_text(GOOD)
    ran = run("ik", ROBOT, "--targets", "t.csv", "-o", "in.csv", "--plot", "ik.png")
    assert ran.status == 0
    assert "reached: 1 of 2 targets" in ran.out
    assert (folder / "ik.png").stat().st_size > 1000
    good, far = rows_of("in_report.csv")
    assert (good["ik_reachable"], good["ik_limit"]) == ("1", "")
    assert (far["ik_reachable"], far["ik_limit"]) == ("0", "advance_mm<=60")
    assert run("simulate", ROBOT, "--inputs", "in.csv", "-o", "out.csv").status == 0
    seen = read_table("out.csv").columns
    for axis, value in zip("xyz", (20.0, 5.0, 70.0), strict=True):
        assert seen[f"tip_{axis}_mm"][0] == pytest.approx(value, abs=0.117)


@pytest.mark.parametrize(
    ("content", "words", "message"),
    [
        (None, (), "t.csv: no such file"),
        ("tip_x_mm\n", (), "t.csv: a header without rows"),
        ("tip_w_mm\n1\n", (), "t.csv: unknown target 'tip_w_mm'; choices: tip_x_mm"),
        ("tip_qw\n1\n", (), "t.csv: unknown target 'tip_qw'"),
        ("tip_x_mm,tip_z_mm\n1,2\n,\n", (), "t.csv: line 3: no target"),
        ("tip_x_mm\na\n", (), "t.csv: line 2: tip_x_mm = 'a': not a number"),
        ("tip_direction_x\n1\n", (), "t.csv: a direction has three columns"),
        ("tip_direction_x,tip_direction_y,tip_direction_z\n0,0,0\n", (), "line 2: tip_direction: three"),
        ("time_s,tip_x_mm\n1,0\n0,0\n", (), "t.csv: line 3: time_s = 0 does not come after 1"),
        (GOOD, ("--limit", "advance_mm"), "--limit advance_mm: INPUT=LEAST,MOST is needed"),
        (GOOD, ("--limit", "advance_mm=5,9"), "LEAST,MOST with 0 between them"),
        (GOOD, ("--limit", "advance_mm=-5,9"), "must not be below 0"),
        (GOOD, ("--limit", "tension_N=0,9"), "--limit: unknown input 'tension_N'; choices: displacement"),
        (GOOD, ("--tolerance-mm", "0"), "a number above zero is needed"),
        (GOOD, ("--plot", "a.pdf"), "--plot a.pdf: a picture's ending is needed; choices: .png"),
        (GOOD, ("--gravity", "1,2"), "--gravity 1,2: three numbers"),
    ],
)
def test_bad_targets_are_one_line(
    content: str | None, words: tuple[str, ...], message: str, run: Run, folder: Path
) -> None:
    """The line names file and row or the option, and nothing is written."""
    if content is not None:
        (folder / "t.csv").write_text(content)
    before = sorted(path.name for path in folder.iterdir())
    assert message in run("ik", ROBOT, "--targets", "t.csv", "-o", "in.csv", *words).error()
    assert sorted(path.name for path in folder.iterdir()) == before


def test_ik_needs_a_csv_to_write(run: Run, folder: Path) -> None:
    """The report's name is made of the inputs' name."""
    (folder / "t.csv").write_text(GOOD)
    assert "choices: .csv" in run("ik", ROBOT, "--targets", "t.csv", "-o", "in.txt").error()


@pytest.mark.slow
def test_sense_writes_regions_around_the_posture(run: Run, folder: Path) -> None:
    """The posture is that of `statics` under the same inputs, between the ends of its region."""
    (folder / "r.csv").write_text("time_s,displacement_bending_mm\n0,1\n1,2\n")
    words = ("--noise-displacement", "0.02", "--columns", "tip_x_mm,angle_bending_deg", "--plot", "s.png")
    ran = run("sense", ROBOT, "--readings", "r.csv", "-o", "s.csv", *words)
    assert ran.status == 0, ran.err
    assert "tip_x_mm: 95 % within +-" in ran.out
    sensed = read_table("s.csv").columns
    assert list(sensed)[:3] == ["tip_x_mm", "tip_x_mm_low", "tip_x_mm_high"]
    run("statics", ROBOT, "--model", "pk", "--inputs", "r.csv", "-o", "pk.csv")
    exact = read_table("pk.csv").columns
    np.testing.assert_allclose(sensed["tip_x_mm"], exact["tip_x_mm"], atol=0.02)
    assert (sensed["tip_x_mm_low"] < exact["tip_x_mm"]).all()
    assert (sensed["tip_x_mm_high"] > exact["tip_x_mm"]).all()


@pytest.mark.parametrize(
    ("content", "words", "message"),
    [
        ("time_s,tension_bend\n0,1\n", (), "r.csv: unknown input channel 'tension_bend'"),
        ("time_s,advance_mm\n0,90\n", (), "r.csv: line 2: advance_mm = 90: must lie in 0 to the stroke"),
        (
            "time_s,angle_bending_deg\n0,9\n",
            (),
            "angle_bending_deg: a measured output needs a noise above zero",
        ),
        ("time_s,advance_mm\n0,9\n", ("--noise-tension", "-1"), "a number not below zero is needed"),
        ("time_s,advance_mm\n0,9\n", ("--uncertain", "friction.mu"), "KEY=HALF, or none alone, is needed"),
        ("time_s,advance_mm\n0,9\n", ("--uncertain", "mu=0.1"), "unknown number 'mu'"),
        ("time_s,advance_mm\n0,9\n", ("--columns", "tip"), "--columns: unknown output column 'tip'"),
    ],
)
def test_bad_readings_are_one_line(
    content: str, words: tuple[str, ...], message: str, run: Run, folder: Path
) -> None:
    """The line names file and row or the option."""
    (folder / "r.csv").write_text(content)
    assert message in run("sense", ROBOT, "--readings", "r.csv", "-o", "s.csv", *words).error()
    assert not (folder / "s.csv").exists()


@pytest.mark.slow
def test_workspace_writes_points_and_a_picture(run: Run, folder: Path) -> None:
    """A row a point; the range of an input is kept."""
    words = ("--samples", "50", "--limit", "advance_mm=0,5", "--plot", "w.png")
    ran = run("workspace", ROBOT, "-o", "p.csv", *words)
    assert ran.status == 0, ran.err
    points = rows_of("p.csv")
    assert len(points) == 50
    assert max(float(row["advance_mm"]) for row in points) <= 5.0
    assert (folder / "w.png").stat().st_size > 1000
    assert "a whole number from 1" in run("workspace", ROBOT, "-o", "p.csv", "--samples", "0").error()


@pytest.mark.slow
def test_which_model_names_the_fastest_that_is_accurate(run: Run, folder: Path) -> None:
    """Against the exact model piecewise constant curvature is out, and with no tolerance all but itself."""
    (folder / "in.csv").write_text("time_s,tension_active_N\n0,5\n1,20\n2,5\n")
    words = ("which-model", "chest_tube_section", "--inputs", "in.csv", "--reference", "complete_sliding")
    ran = run(*words, "--tolerance-percent", "0.1", "-o", "m.csv")
    assert ran.status == 0, ran.err
    within = {row["model"]: row["within"] for row in rows_of("m.csv")}
    assert within["complete_sliding"] == "1"
    assert within["pcc"] == "0"
    assert "fastest within 0.1 % of complete_sliding: complete" in ran.out
    assert "unknown reference 'pk'; choices: simulation" in run(*words[:-1], "pk").error()


def test_which_model_says_what_a_model_does_not_know(run: Run, folder: Path) -> None:
    """Of a moment on the tip beside measured laws, which no model of catheters has; the row is named."""
    (folder / "in.csv").write_text(
        "time_s,displacement_bending_proximal_mm,moment_tip_x_Nm\n0,0,0\n1,1,0.01\n"
    )
    ran = run("which-model", "mitral_4dof@elongation", "--inputs", "in.csv")
    assert ran.status == 1
    assert "pk solves no row: row 2 (time_s = 1): static model 'pk'" in ran.out
    assert "no model is within 1 % of simulation" in ran.out


@pytest.mark.slow
def test_control_writes_every_way(run: Run, folder: Path) -> None:
    """Runs over time, a summary and a picture; feedback lessens the error of a slack tendon's feedforward."""
    (folder / "t.csv").write_text("time_s,angle_bending_proximal_deg\n0,0\n3,25\n6,25\n")
    ran = run("control", "mitral_4dof@elongation", "--trajectory", "t.csv", "-o", "out", "--noise", "0.2")
    assert ran.status == 0, ran.err
    names = {path.name for path in (folder / "out").iterdir()}
    assert names == {"summary.csv", "ratios.csv", "pk.csv", "te.csv", "te_pid.csv", "control.png"}
    error = {row["run"]: float(row["rmse_deg"]) for row in rows_of("out/summary.csv")}
    assert error["PK"] > error["TE"] > error["TE+PID"]
    series = read_table("out/te_pid.csv").columns
    assert np.abs(series["controller_bending_proximal_mm"]).max() > 0.1
    assert np.all(series["controller_torsion_mm"] == 0.0)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("neuroendoscope",), "no joint control for robots of kind 'continuum'"),
        (("mitral_transseptal",), "a trajectory is needed; only mitral_4dof has one of its own"),
        (("mitral_4dof", "--trajectory", "t.csv"), "t.csv: unknown joint 'angle_tip_deg'; choices: angle_b"),
        (("mitral_4dof", "--model", "xx"), "unknown way of control 'xx'; choices: pk, pk+pid"),
        (("mitral_4dof", "--pid", "1,2"), "three numbers KP, KI, KD are needed"),
        (("mitral_4dof", "--pid", "a"), "--pid a: three numbers KP,KI,KD are needed"),
        (("mitral_4dof", "--dead-band", "torsion"), "--dead-band torsion: PAIR=MM is needed"),
        (("mitral_4dof", "--noise", "-1"), "a number not below zero is needed"),
        (("mitral_4dof", "--rate", "37"), "must be a whole number of"),
    ],
)
def test_bad_control_is_one_line(words: tuple[str, ...], message: str, run: Run, folder: Path) -> None:
    """The line names what is wrong and the choices; no folder is made."""
    (folder / "t.csv").write_text("time_s,angle_tip_deg\n0,0\n1,2\n")
    assert message in run("control", *words, "-o", "out").error()
    assert not (folder / "out").exists()
