"""Help, usage errors, interruptions: before any verb does its work."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from cli_command import Run

import catheter_sim
from catheter_sim.cli import arguments
from catheter_sim.cli import main as main_module
from catheter_sim.cli.arguments import split_settings
from catheter_sim.cli.main import VERBS, main
from catheter_sim.errors import InputError

COMMAND = [sys.executable, "-m", "catheter_sim.cli.main"]
CONTRACT_VERBS = {
    *("list", "build", "export", "simulate", "statics", "render", "validate", "diagnose", "bench", "view"),
    *("ik", "sense", "workspace", "which-model", "control"),
    *("import", "new", "compare", "example", "lab"),
}


def test_verbs_are_those_promised() -> None:
    """The verbs are part of what users rely on."""
    assert set(VERBS) == CONTRACT_VERBS


@pytest.mark.parametrize("verb", sorted(CONTRACT_VERBS))
def test_help_has_an_example_and_units(verb: str, run: Run) -> None:
    """Each verb's help exits 0 and shows a command to copy; what has a unit names it."""
    ran = run(verb, "--help")
    assert ran.status == 0
    assert ran.err == ""
    assert f"  catheter-sim {verb}" in ran.out
    assert max(map(len, ran.out.splitlines())) <= 110
    units = {
        "list": "in the unit that the parameter's name ends in",
        "build": "SI units",
        "export": "SI units",
        "simulate": "time_s [s]",
        "statics": "units",
        "render": "pixels",
        "validate": "units",
        "diagnose": "mm or deg",
        "bench": "steps/s",
        "view": "tensions [N]",
        "ik": "tip_z_mm [mm]",
        "sense": "standard deviations of the readings",
        "workspace": "tip_z_mm [mm]",
        "which-model": "processor time of a row [ms]",
        "control": "time_s [s]",
        "import": "[m/s^2]",
        "new": "units",
        "compare": "[s]",
        "example": "units",
        "lab": "travel [mm]",
    }
    assert units[verb] in ran.out


def test_examples_in_help_parse() -> None:
    """Every command line that a help page shows is one that the parser takes."""
    for verb, module in VERBS.items():
        lines = [
            line.split()[1:] for line in (module.__doc__ or "").splitlines() if "  catheter-sim " in line
        ]
        assert lines, verb
        for words in lines:
            assert main_module.parser().parse_args(split_settings(words)).verb == verb


def test_top_help_and_version(run: Run) -> None:
    """--help names every verb; --version says which release this is."""
    ran = run("--help")
    assert ran.status == 0
    assert all(verb in ran.out for verb in VERBS)
    assert run("--version").out == f"catheter-sim {catheter_sim.__version__}\n"


@pytest.mark.slow
def test_help_imports_nothing_heavy() -> None:
    """Help answers at once: neither MuJoCo nor SciPy nor a plotting library is imported for it."""
    program = (
        "import sys; from catheter_sim.cli.main import main; main(['simulate', '--help']); "
        "heavy = {'scipy', 'mujoco', 'dm_control', 'numba', 'matplotlib', 'trimesh'} & set(sys.modules); "
        "sys.exit(repr(heavy) if heavy else 0)"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "a command is needed; choices: list, build"),
        (["fly"], "invalid choice: 'fly' (choose from"),
        (["list", "--yaml"], "unrecognized arguments: --yaml"),
        (["build"], "the following arguments are required: ROBOT, -o/--output"),
        (["build", "spacer_disk"], "required: -o/--output"),
        (["simulate", "spacer_disk", "-o", "out.csv"], "required: --inputs"),
        (["statics", "spacer_disk", "--inputs", "in.csv", "-o", "x.csv"], "required: --model"),
        (["simulate", "spacer_disk", "--inputs"], "--inputs: expected one argument"),
        (["render", "spacer_disk", "--inputs", "a", "-o", "a.mp4", "--width", "0"], "from 16 to 4096"),
        (["render", "spacer_disk", "--inputs", "a", "-o", "a.mp4", "--height", "x"], "'x': a whole number"),
        (["render", "spacer_disk", "--inputs", "a", "-o", "a.mp4", "--camera", "up"], "invalid choice: 'up'"),
        (["diagnose", "data", "-o", "out", "--jobs", "0"], "'0': a whole number from 1"),
        (["diagnose", "data", "-o", "out", "--jobs", "two"], "'two': a whole number from 1"),
        (["bench", "--turns", "-3"], "'-3': a whole number from 1"),
        (["bench", "a\nb"], "unrecognized arguments: a b"),
    ],
)  # fmt: skip
def test_wrong_usage_is_one_line(words: list[str], message: str, run: Run, folder: Path) -> None:
    """Bad usage ends in one line, exit 2, and leaves nothing behind."""
    assert message in run(*words).error()
    assert os.listdir(folder) == []


@pytest.mark.parametrize(
    ("given", "read"),
    [
        (["--set", "a=1"], ["--set=a=1"]),
        (["--set", "a=1", "b.c=2", "-o", "x"], ["--set=a=1", "--set=b.c=2", "-o", "x"]),
        (["--set", "a=1", "robot", "-o", "x"], ["--set=a=1", "robot", "-o", "x"]),
        (["--set", "a", "b"], ["--set=a", "b"]),
        (["--set"], ["--set"]),
        (["--set", "-o"], ["--set", "-o"]),
        (["--gravity", "-9.81,0,0"], ["--gravity=-9.81,0,0"]),
        (["--gravity", "--set", "a=1"], ["--gravity", "--set=a=1"]),
        (["--gravity"], ["--gravity"]),
    ],
)
def test_settings_may_follow_one_another(given: list[str], read: list[str]) -> None:
    """`--set A=1 B=2` sets both, and neither eats the robot; a vector may start with a minus sign."""
    assert split_settings(given) == read


@pytest.mark.parametrize(
    ("text", "vector"),
    [("0,0,-9.81", (0, 0, -9.81)), ("-1e1, 2 ,.5", (-10, 2, 0.5))],
)
def test_gravity_is_three_numbers(text: str, vector: tuple[float, ...]) -> None:
    """Three numbers, blanks allowed."""
    assert arguments.gravity(text) == vector


@pytest.mark.parametrize("text", ["", "1", "1,2", "1,2,3,4", "1,2,x", "nan,0,0", "0,inf,0", "1;2;3", ",,"])
def test_other_gravity_is_refused(text: str) -> None:
    """Anything else names --gravity and the unit."""
    with pytest.raises(InputError, match=r"--gravity .*m/s\^2"):
        arguments.gravity(text)


def test_columns_are_names_once() -> None:
    """Names keep their order, stand once, and time_s is written anyway."""
    assert arguments.columns(None) is None
    assert arguments.columns("time_s, b,a,b") == ["b", "a"]
    with pytest.raises(InputError, match="a name is empty"):
        arguments.columns("a,,b")


def test_a_defect_is_no_user_error(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """An exception that nobody foresaw is one line that says so, and a traceback when asked for."""

    def broken(_: object) -> int:
        raise ZeroDivisionError("of a\nkind")

    monkeypatch.setattr(VERBS["list"], "run", broken)
    assert main(["list"]) == 2
    assert capsys.readouterr().err == (
        "catheter-sim: error: internal error: ZeroDivisionError: of a kind "
        "(a defect: set CATHETER_SIM_TRACEBACK=1 to see where)\n"
    )
    monkeypatch.setenv(main_module.TRACEBACK_VARIABLE, "1")
    with pytest.raises(ZeroDivisionError):
        main(["list"])


def test_full_disk_is_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """A system error in the midst of work is one line, and not called a defect."""

    def full(_: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(VERBS["list"], "run", full)
    assert main(["list"]) == 2
    assert capsys.readouterr().err == "catheter-sim: error: OSError: [Errno 28] No space left on device\n"


def test_interruption_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ctrl-C ends with 130, as shells expect."""

    def interrupted(_: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(VERBS["list"], "run", interrupted)
    assert main(["list"]) == 128 + signal.SIGINT
    assert capsys.readouterr().err == "catheter-sim: error: interrupted\n"


@pytest.mark.slow
def test_broken_pipe_is_silent() -> None:
    """A reader that leaves early is no error to write about."""
    program = (
        "import sys; from catheter_sim.cli import main; "
        "main.VERBS['list'].run = lambda _: print('line\\n' * 100_000) or 0; "
        "sys.exit(main.main(['list']))"
    )
    reader, writer = os.pipe()
    os.close(reader)
    try:
        ended = subprocess.run(
            [sys.executable, "-c", program], stdout=writer, stderr=subprocess.PIPE, text=True, check=False
        )
    finally:
        os.close(writer)
    assert ended.stderr == ""
    assert ended.returncode == 128 + signal.SIGPIPE


@pytest.mark.slow
def test_an_unknown_graphics_backend_is_one_line() -> None:
    """MuJoCo refuses to be imported with a MUJOCO_GL that it does not know: that is the user's to mend."""
    ended = subprocess.run(
        [*COMMAND, "list"],
        env=os.environ | {"MUJOCO_GL": "bogus"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith("catheter-sim: error: ")
    assert ended.stderr.count("\n") == 1
    assert "MUJOCO_GL" in ended.stderr
    assert "internal error" not in ended.stderr


@pytest.mark.slow
def test_a_diverging_process_says_one_line(tmp_path: Path) -> None:
    """Neither MuJoCo nor NumPy adds a warning, and no log file stays behind."""
    (tmp_path / "in.csv").write_text("time_s,force_tip_x_N\n0,0\n1,1e9\n")
    words = ["simulate", "neuroendoscope_section", "--inputs", "in.csv", "-o", "out.csv"]
    ended = subprocess.run([*COMMAND, *words], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert ended.stderr.startswith("catheter-sim: error: in.csv: line 3: ")
    assert ended.stderr.count("\n") == 1
    assert sorted(os.listdir(tmp_path)) == ["in.csv", "out.csv"]


@pytest.mark.slow
def test_output_may_go_to_a_pipe(tmp_path: Path) -> None:
    """/dev/stdout is an output like any other."""
    (tmp_path / "in.csv").write_text("time_s,tension_right_N\n0,0\n")
    words = [
        "statics",
        "neuroendoscope_section",
        "--model",
        "pcca",
        "--inputs",
        "in.csv",
        "-o",
        "/dev/stdout",
    ]
    ended = subprocess.run(
        [*COMMAND, *words, "-o", "/dev/stdout"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.startswith("time_s,tip_x_mm,")


@pytest.mark.slow
def test_a_real_process_exits_2(tmp_path: Path) -> None:
    """The exit status and the line reach the shell, through a process of its own."""
    ended = subprocess.run(
        [*COMMAND, "build", "no_robot", "-o", "m.xml"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 2
    assert ended.stdout == ""
    assert ended.stderr.startswith("catheter-sim: error: unknown robot 'no_robot'; choices: neuroendoscope")
    assert ended.stderr.count("\n") == 1
    assert os.listdir(tmp_path) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("closed", "words", "said"),
    [
        (">&-", ["list"], "standard output is closed"),
        (">&-", ["build", "spacer_disk", "-o", "m.xml"], "standard output is closed"),
        (">&- 2>&-", ["list"], ""),
        ("2>&-", ["build", "no_robot", "-o", "m.xml"], ""),
        ("<&-", ["build", "no_robot", "-o", "m.xml"], "unknown robot 'no_robot'"),
    ],
)
def test_closed_streams_are_no_defect(closed: str, words: list[str], said: str, tmp_path: Path) -> None:
    """Exit 2 and at most one line, before a file takes the place of what is closed."""
    script = ["sh", "-c", f'exec "$@" {closed}', "sh", *COMMAND, *words]
    ended = subprocess.run(script, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert ended.stdout == ""
    assert said in ended.stderr
    assert ended.stderr.count("\n") == (1 if said else 0)
    assert "internal error" not in ended.stderr
    assert os.listdir(tmp_path) == []


def test_diagnose_help_tells_every_key() -> None:
    """The tables and keys of dataset.toml, the optional ones among them, and the limit on rows."""
    from catheter_sim.cli import diagnose
    from catheter_sim.diagnosis import dataset
    from catheter_sim.tables import MAX_ROWS

    text = diagnose.__doc__ or ""
    for table, keys in dataset._KEYS.items():
        assert f"[{table}]" in text
        assert all(key in text for key in keys)
    for word in ("[[trials]]", "file", "role", "[calibration]", f"{MAX_ROWS} rows", *dataset.ROLES):
        assert word in text


def test_known_noise_is_silenced_and_any_other_warning_is_a_line(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """MuJoCo's and NumPy's words about numbers that are not finite go; all else is seen; after it all is."""

    def warn(_: object) -> int:
        logging.getLogger("mujoco").warning("Nan, Inf or huge value in QACC at DOF 0.")
        warnings.warn("overflow encountered in multiply", RuntimeWarning, stacklevel=1)
        warnings.warn("the covariance\ncould not be estimated", UserWarning, stacklevel=1)
        logging.getLogger("somebody").warning("a disk is nearly full")
        return 0

    heard: list[str] = []
    handler = logging.Handler()
    handler.emit = lambda record: heard.append(record.getMessage())  # type: ignore[method-assign]
    logging.getLogger().addHandler(handler)
    monkeypatch.setattr(VERBS["list"], "run", warn)
    try:
        ran = run("list")
        logging.getLogger("mujoco").warning("outside")
    finally:
        logging.getLogger().removeHandler(handler)
    assert ran.status == 0
    assert heard == ["a disk is nearly full", "outside"]
    assert ran.err.startswith("catheter-sim: warning: the covariance could not be estimated\n")
    assert "overflow" not in ran.err
