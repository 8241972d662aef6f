"""Bad input through the real command line: one line, exit 2, nothing half-written."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from cli_command import Run

from catheter_sim.catalogue import ROBOTS, robot_toml

ROBOT = "neuroendoscope_section"
DRIVEN = (
    ["simulate"],
    ["statics", "--model", "fkm_exact_arm"],
    ["render"],
)
GOOD = "time_s,tension_right_N\n0,0\n1,0.1\n"


def contents(folder: Path) -> dict[str, bytes]:
    """Return every file below `folder`, whole, and every folder."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else b"<folder>"
        for path in folder.rglob("*")
    }


def output_of(words: list[str]) -> list[str]:
    """Return the -o of a verb, with a file name that the verb takes."""
    return ["-o", "out.png" if words[0] == "render" else "out.csv"]


@pytest.mark.parametrize("words", DRIVEN, ids=lambda words: words[0])
@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "in.csv: no such file"),
        ("", "in.csv: the file is empty; a header with time_s is needed"),
        ("time_s,tension_right_N\n", "in.csv: a header without rows"),
        ("tension_right_N\n0\n", "in.csv: no column time_s"),
        ("time_s,tension_right_N\n0,0\n1\n", "in.csv: line 3: 1 cells where the header has 2"),
        ("time_s,tension_right_N\n0,0\n1,2,3\n", "in.csv: line 3: 3 cells where the header has 2"),
        (
            "time_s,tension_right_N\n0,0\n1,NaN\n",
            "line 3: tension_right_N = NaN: not a finite number",
        ),
        ("time_s,tension_right_N\n0,0\n1,\n", "in.csv: line 3: tension_right_N: a number is needed"),
        ("time_s,tension_right_N\n0,0\n1,inf\n", "line 3: tension_right_N = inf: not a finite number"),
        ("time_s,tension_right_N\n0,0\n1,a\n", "line 3: tension_right_N = 'a': not a number"),
        ("time_s,tension_right_N\n1,0\n0,0\n", "in.csv: line 3: time_s = 0 does not come after 1"),
        ("time_s,tension_right_N\n0,0\n0,0\n", "in.csv: line 3: time_s = 0 does not come after 0"),
        ("time_s,tension_right_N\n0,0\n1,-0.1\n", "line 3: tension_right_N = -0.1: a tendon cannot push"),
        ("time_s,tension_middle_N\n0,0\n", "in.csv: unknown input channel 'tension_middle_N'; choices: tens"),
        ("time_s,tension_right_N,tension_right_N\n0,0,0\n", "column 'tension_right_N' stands twice"),
        ("time_s,tension_right_N,displacement_left_mm\n0,0,0\n", "tension and displacement channels cannot"),
        ("time_s;tension_right_N\n0;0\n", "in.csv: no column time_s; columns: time_s;tension_right_N"),
    ],
)
def test_bad_inputs(words: list[str], content: str | None, message: str, run: Run, folder: Path) -> None:
    """What is wrong with a file of inputs is said with its line, by every verb that takes one."""
    if content is not None:
        (folder / "in.csv").write_text(content)
    before = contents(folder)
    assert message in run(*words, ROBOT, "--inputs", "in.csv", *output_of(words)).error()
    assert contents(folder) == before


@pytest.mark.parametrize("words", DRIVEN, ids=lambda words: words[0])
@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"robot": "endoscope"}, "unknown robot 'endoscope'; choices: neuroendoscope"),
        ({"robot": "no.toml"}, "no.toml: no such file"),
        ({"robot": "broken.toml"}, "broken.toml: not valid TOML"),
        ({"robot": "flat.toml"}, "flat.toml: segments.section.length_mm = 0: must be above zero"),
        ({"robot": "outside.toml"}, "outside.toml: tendons.right.radius_mm = 5: the tendon lies outside"),
        ({"--set": "friction.nu=0"}, "--set friction.nu: unknown key 'nu'; choices: mu"),
        ({"--set": "mu"}, "--set mu: KEY=VALUE is needed"),
        ({"--set": "friction.mu=-1"}, "friction.mu = -1: must lie in 0 to 10"),
        ({"--set": "segments.section.length_mm=0"}, "segments.section.length_mm = 0: must be above zero"),
        ({"--set": "effects.gremlins.size_mm=1"}, "unknown effect 'gremlins'; choices: "),
        ({"--set": "effects.tendon_friction.my=1"}, "'my'; choices: "),
        ({"--set": "effects.tendon_friction.mu=1e9"}, "mu"),
        ({"--gravity": "0,0"}, "--gravity 0,0: three numbers gx,gy,gz in m/s^2 are needed"),
        ({"--gravity": "nan,0,0"}, "--gravity nan,0,0: three finite numbers"),
        ({"--gravity": "-9.81"}, "--gravity -9.81: three numbers"),
        ({"-o": "no/folder/out"}, "cannot be written: no folder no/folder"),
        ({"-o": "in.csv/out"}, "cannot be written: no folder in.csv"),
        ({"-o": "here"}, "is a folder, a file name is needed"),
    ],
    ids=lambda item: str(item)[:40],
)
def test_bad_arguments(
    words: list[str], changed: dict[str, str], message: str, run: Run, folder: Path
) -> None:
    """What is wrong with an argument names it and the choices, in every verb that drives a robot."""
    text = robot_toml(ROBOTS[ROBOT]())
    assert "length_mm = 60.0" in text
    assert "radius_mm = 1.4\n" in text
    (folder / "broken.toml").write_text("name = [")
    (folder / "flat.toml").write_text(text.replace("length_mm = 60.0", "length_mm = 0.0"))
    (folder / "outside.toml").write_text(text.replace("radius_mm = 1.4\n", "radius_mm = 5.0\n"))
    (folder / "in.csv").write_text(GOOD)
    suffix = Path(output_of(words)[1]).suffix
    (folder / f"here{suffix}").mkdir()
    options = {"robot": ROBOT, "--inputs": "in.csv", "-o": "out"} | changed
    options["-o"] += suffix
    robot = options.pop("robot")
    before = contents(folder)
    pairs = [word for pair in options.items() for word in pair]
    assert message in run(*words, robot, *pairs).error()
    assert contents(folder) == before


@pytest.mark.parametrize("verb", ["simulate", "statics"])
def test_unknown_column(verb: str, run: Run, folder: Path, inputs: str) -> None:
    """A column that the robot has not is named, with what it has, before anything runs."""
    model = ["--model", "fkm"] if verb == "statics" else []
    words = [verb, ROBOT, *model, "--inputs", inputs, "-o", "out.csv", "--columns"]
    assert (
        "--columns: unknown output column 'tip_x'; choices: tip_x_mm" in run(*words, "tip_z_mm,tip_x").error()
    )
    assert "--columns tip_x_mm,: a name is empty" in run(*words, "tip_x_mm,").error()
    assert os.listdir(folder) == ["in.csv"]


@pytest.mark.slow
def test_unknown_static_model(run: Run, folder: Path, inputs: str) -> None:
    """The choices are this robot's models, not every model there is."""
    words = ["statics", ROBOT, "--inputs", inputs, "-o", "out.csv", "--model"]
    for name in ("abaqus", "complete"):
        message = run(*words, name).error()
        assert message.startswith(f"{ROBOT}: unknown static model '{name}'; choices: ")
        assert "fkm_exact_arm" in message
        assert "complete" not in message.partition("choices")[2]
    assert os.listdir(folder) == ["in.csv"]


@pytest.mark.parametrize("name", ["out.avi", "out", "out.csv", ".mp4x"])
def test_unknown_picture_format(name: str, run: Run, folder: Path, inputs: str) -> None:
    """A picture is .png and a video .mp4; anything else is refused before rendering."""
    message = run("render", ROBOT, "--inputs", inputs, "-o", name).error()
    assert f"{name}: " in message
    assert ".mp4" in message
    assert ".png" in message
    assert os.listdir(folder) == ["in.csv"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["build", "no_robot", "-o", "model.xml"], "unknown robot 'no_robot'; choices: "),
        (["build", ROBOT, "-o", "no/model.xml"], "no/model.xml: cannot be written: no folder no"),
        (
            ["build", ROBOT, "-o", "model.xml", "--set", "segments.section.mass_g=0"],
            "mass_g = 0: must be",
        ),
        (["build", ROBOT, "-o", "model.xml", "--set", "effects.x.y=1"], "unknown effect 'x'; choices: "),
        (["validate", "no_robot", "-o", "out"], "'no_robot'; choices: neuroendoscope"),
        (["validate", "-o", "file"], "file: cannot be made a folder"),
        (["validate", "-o", "file/below"], "file/below: cannot be made a folder"),
        (["diagnose", "no_folder", "-o", "out"], "no_folder: no such folder"),
        (["diagnose", "file", "-o", "out"], "file: no such folder"),
        (["diagnose", "empty", "-o", "out"], "empty/dataset.toml: no such file"),
        (["diagnose", "broken", "-o", "out"], "broken/dataset.toml: not valid TOML"),
        (["diagnose", "broken", "-o", "file"], "file: cannot be made a folder"),
    ],
    ids=lambda item: " ".join(item)[:40] if isinstance(item, list) else "",
)
def test_bad_arguments_of_other_verbs(words: list[str], message: str, run: Run, folder: Path) -> None:
    """The other verbs, likewise: no folder is made for a result that cannot come."""
    (folder / "file").write_text("a file")
    (folder / "empty").mkdir()
    (folder / "broken").mkdir()
    (folder / "broken" / "dataset.toml").write_text("[dataset")
    before = contents(folder)
    assert message in run(*words).error()
    assert contents(folder) == before


def test_old_output_survives_bad_input(run: Run, folder: Path, inputs: str) -> None:
    """A result of an earlier run is not touched by a run that fails."""
    (folder / "out.csv").write_text("precious")
    run("simulate", ROBOT, "--inputs", inputs, "-o", "out.csv", "--set", "friction.mu=-1").error()
    run("simulate", ROBOT, "--inputs", "missing.csv", "-o", "out.csv").error()
    assert (folder / "out.csv").read_text() == "precious"


def test_divergence_names_row_and_time_and_keeps_the_rows_before(run: Run, folder: Path) -> None:
    """A simulation that leaves the finite numbers says where, and its good rows are written."""
    (folder / "in.csv").write_text("time_s,force_tip_x_N\n0,0\n0.5,0.01\n\n2,1e9\n3,0\n")
    (folder / "good.csv").write_text("time_s,force_tip_x_N\n0,0\n0.5,0.01\n")
    message = run("simulate", ROBOT, "--inputs", "in.csv", "-o", "out.csv").error()
    assert message.startswith("in.csv: line 5: ")  # the empty line counts
    assert "diverged" in message
    assert "time_s = 2" in message
    assert run("simulate", ROBOT, "--inputs", "good.csv", "-o", "good_out.csv").status == 0
    assert (folder / "out.csv").read_text() == (folder / "good_out.csv").read_text()
    assert sorted(os.listdir(folder)) == ["good.csv", "good_out.csv", "in.csv", "out.csv"]


def test_divergence_at_the_first_row_leaves_a_header(run: Run, folder: Path) -> None:
    """With no good row at all the output holds its header alone."""
    (folder / "in.csv").write_text("time_s,force_tip_x_N\n0,1e9\n")
    message = run("simulate", ROBOT, "--inputs", "in.csv", "-o", "out.csv", "--columns", "tip_x_mm").error()
    assert message.startswith("in.csv: line 2: ")
    assert (folder / "out.csv").read_text() == "time_s,tip_x_mm\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    "words", [["simulate"], ["statics", "--model", "pk"], ["statics", "--model", "balance"], ["render"]]
)
def test_a_catheters_command_out_of_range_is_named_with_its_line(
    words: list[str], run: Run, folder: Path
) -> None:
    """The file, its line (empty ones counted) and its own time stand before what is wrong."""
    (folder / "in.csv").write_text("time_s,displacement_bending_mm\n1700000000.001,0\n\n1700000001.5,100\n")
    message = run(*words, "mitral_transseptal", "--inputs", "in.csv", *output_of(words)).error()
    assert message.startswith("in.csv: line 4 (time_s = 1700000001.5): ")
    assert "displacement_bending_mm" in message
    assert "beyond" in message
    assert "row" not in message
    assert os.listdir(folder) == ["in.csv"]


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (["--row", "3"], "--row 3: in.csv has rows 1 to 2"),
        (["--row", "0"], "'0': a whole number from 1"),
        (["--row", "last"], "'last': a whole number from 1"),
        (["--time", "-0.1"], "--time -0.1: in.csv runs from time_s = 0 to 1"),
        (["--time", "1.01"], "--time 1.01: in.csv runs from time_s = 0 to 1"),
        (["--time", "nan"], "'nan': a finite number is needed"),
        (["--time", "1", "--row", "1"], "not allowed with argument"),
        (["--row", "1", "-o", "out.mp4"], "--row, --rows and --time choose what a picture shows; choices:"),
    ],
)  # fmt: skip
def test_a_row_or_time_that_is_not_there(option: list[str], message: str, run: Run, folder: Path) -> None:
    """What a picture cannot show is refused with what there is."""
    (folder / "in.csv").write_text(GOOD)
    assert message in run("render", ROBOT, "--inputs", "in.csv", "-o", "out.png", *option).error()
    assert os.listdir(folder) == ["in.csv"]


LONG = "x" * 100_000


@pytest.mark.parametrize(
    "words",
    [
        [LONG],
        ["list", LONG],
        ["list", LONG + ".toml"],
        ["list", "--" + LONG],
        ["build", ROBOT, "-o", LONG],
        ["build", ROBOT, "-o", "m.xml", "--set", LONG],
        ["build", ROBOT, "-o", "m.xml", "--set", f"{LONG}=1"],
        ["build", ROBOT, "-o", "m.xml", "--set", f"friction.{LONG}=1"],
        ["build", ROBOT, "-o", "m.xml", "--set", f"friction.mu={LONG}"],
        ["build", ROBOT, "-o", "m.xml", "--set", f"friction.mu={'1' * 100_000}"],
        ["build", ROBOT, "-o", "m.xml", "--set", f"effects.{LONG}.a=1"],
        ["build", ROBOT, "-o", "m.xml", "--set", f"tendons.0.name={LONG}"],
        ["build", ROBOT, "-o", "m.xml", "--set", f"name={LONG}"],
        ["simulate", ROBOT, "--inputs", LONG, "-o", "o.csv"],
        ["simulate", ROBOT, "--inputs", "in.csv", "-o", "o.csv", "--gravity", LONG],
        ["simulate", ROBOT, "--inputs", "in.csv", "-o", "o.csv", "--columns", LONG],
        ["statics", ROBOT, "--inputs", "in.csv", "-o", "o.csv", "--model", LONG],
        ["render", ROBOT, "--inputs", "in.csv", "-o", "o.png", "--width", LONG],
        ["diagnose", LONG, "-o", "out"],
    ],
    ids=lambda words: " ".join(words).replace(LONG, "LONG")[:60],
)
def test_no_message_is_endless(words: list[str], run: Run, folder: Path) -> None:
    """A hundred thousand characters in, some hundred out, on one line."""
    (folder / "in.csv").write_text(GOOD)
    assert len(run(*words).error()) <= 500
    assert os.listdir(folder) == ["in.csv"]


def test_a_dynamic_run_of_years_is_refused(run: Run, folder: Path) -> None:
    """Time that would take days to step through is named before the first step; held rows do not care."""
    (folder / "in.csv").write_text("time_s,tension_right_N\n0,0\n1e9,0.1\n")
    words = ["simulate", ROBOT, "--inputs", "in.csv", "-o", "out.csv"]
    message = run(*words, "--dynamic").error()
    assert message.startswith("in.csv: time_s runs over 1e+09 s, with --dynamic at most 5000 s")
    assert os.listdir(folder) == ["in.csv"]
    assert run(*words).status == 0


def test_a_budget_of_steps_is_what_the_user_sets(run: Run, folder: Path) -> None:
    """Of 400 steps 399 are too few; the line names the option."""
    (folder / "in.csv").write_text("time_s,tension_right_N\n0,0\n0.2,0.1\n")
    words = ["simulate", ROBOT, "--inputs", "in.csv", "-o", "out.csv", "--dynamic"]
    message = run(*words, "--most-steps", "399").error()
    assert "2 rows, 400 steps of 0.0005 s; the budget is 399." in message
    assert message.endswith("Is time_s in seconds? If so, raise --most-steps")
    assert run(*words, "--most-steps", "400").status == 0


def test_an_input_that_no_number_can_square_is_refused(run: Run, folder: Path) -> None:
    """It is named with its line, not met as a matrix without singular values."""
    (folder / "in.csv").write_text("time_s,tension_1_N,force_tip_x_N\n0,0,0\n1,0,1e308\n")
    words = ["statics", "spacer_disk", "--model", "CC", "--inputs", "in.csv", "-o", "out.csv"]
    assert run(*words).error() == "in.csv: line 3: force_tip_x_N = 1e+308: must lie within 1e+15"
