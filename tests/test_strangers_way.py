"""A stranger's ways: from a wheel in an empty environment, by what the pages say alone, to what he wanted.

To a robot's named fault in at most eight commands; and by each tutorial, in at most twelve, to a picture of
their own robot, to a verdict on their own two files, to a policy. No source is opened, and no file is
changed that the page does not show. The environment has the package from the wheel alone; the libraries
that it depends on are lent to it by the environment of the tests, so that no network is needed
(`scripts/package.sh` installs them anew).
"""

from __future__ import annotations

import csv
import importlib.util
import json
import os
import re
import resource
import site
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import catheter_sim as cs
from tests.scripts_as_modules import script_module

run_pages = script_module("run_pages")
ROOT = Path(__file__).resolve().parent.parent
ROBOT = "mitral_transseptal"
SPOOL_MM = 12.0
WIDTH_MM = 0.55  # of the dead-band that is hidden in the data
NOISE_MM = 0.05
MOST_COMMANDS = 8
MOST_OF_A_TUTORIAL = 12
LEARNING_CPU_S = 1200.0  # ten minutes of two cores
TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")


def write_takes(folder: Path) -> list[str]:
    """Write three takes: metres, epoch stamps, y up, motors in degrees; return their names."""
    noise = np.random.default_rng(20261125)
    worn = cs.load_robot(ROBOT, {"effects.backlash.width_mm": WIDTH_MM})
    names = []
    for number, most_mm in enumerate((1.8, 2.1, 2.6)):
        clock = 0.5 * np.arange(36.0)
        pull = most_mm * np.sin(0.8 * clock)
        seen = cs.simulate(worn, {"time_s": clock, "displacement_bending_mm": pull}).to_table(TIP).columns
        x, y, z = (seen[name] + noise.normal(0.0, NOISE_MM, len(clock)) for name in TIP)
        columns = [1732500000.0 + 60.0 * number + clock, np.degrees(pull / SPOOL_MM)]
        columns += [0.31 + 1e-3 * x, 1.2 + 1e-3 * z, -0.4 - 1e-3 * y]
        names.append(f"mocap_{number}.csv")
        with (folder / names[-1]).open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["epoch_s", "bending motor (deg)", "tip X", "tip Y", "tip Z"])
            writer.writerows([f"{value:.7f}" for value in row] for row in zip(*columns, strict=True))
    return names


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel of the checkout."""
    if importlib.util.find_spec("hatchling") is None:
        pytest.skip("hatchling, of the extra dev, builds the wheel")
    folder = tmp_path_factory.mktemp("wheel")
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "-q",
        "--no-deps",
        "--no-build-isolation",
        "-w",
        folder,
        ROOT,
    ]
    subprocess.run(command, check=True, capture_output=True)
    (found,) = folder.glob("*.whl")
    return found


@dataclass
class Stranger:
    """Somebody who has the wheel, an empty folder and the pages, and runs commands there.

    Attributes:
        folder: where the commands run.
        variables: of their environment.
        most: as many commands are allowed.
        count: of commands so far.
    """

    folder: Path
    variables: dict[str, str]
    most: int = MOST_COMMANDS
    count: int = 0

    def __call__(self, *words: object) -> str:
        """Run a command; return what it prints."""
        self.count += 1
        assert self.count <= self.most
        command = [str(word) for word in words]
        ran = subprocess.run(command, cwd=self.folder, env=self.variables, capture_output=True, text=True)
        assert ran.returncode == 0, f"{command}\n{ran.stdout}{ran.stderr}"
        return ran.stdout

    def follow(self, page: str, until: str, replaced: Mapping[str, str] | None = None) -> list[str]:
        """Do what a tutorial says, down to the heading `until`; return what each command prints.

        Files are saved as the page shows them, and its Python blocks run as one script. `replaced` are words
        that the page tells its reader to replace by their own.
        """
        text = (ROOT / "docs" / "tutorials" / page).read_text(encoding="utf-8").split(f"\n## {until}\n")[0]
        for word, own in (replaced or {}).items():
            assert word in text
            text = text.replace(word, own)
        said, blocks = [], []
        for example in run_pages.examples_of(text):
            if example.kind == "file":
                (self.folder / example.name).write_text(example.code, encoding="utf-8")
            elif example.kind == "console":
                said.append(self("bash", "-ec", example.code))
            elif example.kind == "python":
                blocks.append(example.code)
        if blocks:
            (self.folder / "page.py").write_text("\n".join(blocks), encoding="utf-8")
            said.append(self("python", "page.py"))
        return said


@pytest.fixture
def stranger(wheel: Path, tmp_path: Path) -> Stranger:
    """Somebody in an environment that has nothing of the checkout; the wheel's installation is a command."""
    environment, folder = tmp_path / "environment", tmp_path / "work"
    folder.mkdir()
    subprocess.run([sys.executable, "-m", "venv", environment], check=True)
    (packages,) = (environment / "lib").glob("python*/site-packages")
    lent = [path for path in site.getsitepackages() if Path(path).is_dir()]
    (packages / "lent.pth").write_text("\n".join(lent) + "\n")  # on sys.path alone: no editable install
    variables = {
        name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")
    }
    variables["PATH"] = f"{environment / 'bin'}{os.pathsep}{variables['PATH']}"
    run = Stranger(folder, variables)
    run("pip", "install", "-q", "--no-deps", "--no-index", wheel)
    return run


@pytest.mark.slow
def test_a_strangers_way_ends_with_the_hidden_fault(stranger: Stranger, tmp_path: Path) -> None:
    """Seven commands, no file touched by hand: the dead-band is named, with its width in its interval."""
    work = tmp_path / "work"
    takes = write_takes(work)
    stranger("catheter-sim", "example", ROBOT)
    inputs = f"{ROBOT}/bend_and_advance.csv"
    stranger("catheter-sim", "simulate", ROBOT, "--inputs", inputs, "-o", "simulated.csv")
    stranger("catheter-sim", "render", ROBOT, "--inputs", inputs, "-o", "bent.png")
    stranger("catheter-sim", "import", *takes, "--robot", ROBOT, "--spool-radius", SPOOL_MM, "-o", "data")
    said = stranger("catheter-sim", "diagnose", "data", "-o", "report")
    assert (work / "bent.png").read_bytes().startswith(b"\x89PNG")
    assert "wrong about backlash" in said
    found = json.loads((work / "report" / "diagnosis.json").read_text())
    assert found["verdict"] == "cause_found"
    (cause,) = found["causes"]
    assert cause["name"] == "backlash"
    low, high = cause["parameters"]["width_mm"]["ci95"]
    assert low <= WIDTH_MM <= high
    assert found["heldout"]["rmse_after"] < 1.3 * NOISE_MM
    where = stranger("python", "-c", "import catheter_sim; print(catheter_sim.__file__)")
    assert where.startswith(str(tmp_path / "environment"))
    assert not where.startswith(str(ROOT))


@pytest.mark.slow
def test_a_drawing_becomes_a_picture(stranger: Stranger) -> None:
    """The tutorial's robot is saved, checked, bent and drawn; the tip goes where it is pulled."""
    stranger.most = MOST_OF_A_TUTORIAL
    said = stranger.follow("robot_from_drawings.md", "5. Measure it")
    assert (stranger.folder / "bent.png").read_bytes().startswith(b"\x89PNG")
    (table,) = [text for text in said if text.startswith("time_s,")]
    tip = [[float(cell) for cell in line.split(",")] for line in table.splitlines()[1:]]
    assert [row[1] for row in tip[:4]] == sorted(row[1] for row in tip[:4])  # to the right, the more it pulls
    assert tip[-1][2] > 5.0  # and to the front
    assert tip[0][1:] == [0.0, 0.0, 60.0]


def write_export_and_log(folder: Path, width_mm: float, spool_mm: float, per_turn: int) -> None:
    """Write a take of Motive in mm, z up, 2 m from the base, and a log of motors in counts, rest at 500."""
    time_s = 0.5 * np.arange(120.0)
    size = np.where(time_s < 30.0, 0.75, 1.0)
    pulls = {
        "bending": 2.4 * size * np.sin(2.0 * np.pi * time_s / 15.0),
        "torsion_proximal": 0.9 * size * np.sin(2.0 * np.pi * time_s / 30.0),
    }
    per_mm = per_turn / (2.0 * np.pi * spool_mm)
    counts = {name: np.round(500 + per_mm * pull) for name, pull in pulls.items()}
    worn = cs.load_robot(ROBOT, {"effects.backlash.width_mm": width_mm})
    table = {f"displacement_{name}_mm": (count - 500) / per_mm for name, count in counts.items()}
    seen = cs.simulate(worn, {"time_s": time_s, **table}).to_table(TIP).columns
    noise = np.random.default_rng(20261129)
    x, y, z = (seen[name] + noise.normal(0.0, NOISE_MM, len(time_s)) for name in TIP)
    places = (1200.0 - y, 1600.0 + x, 40.0 + z)  # a quarter turn about z
    head = [
        "Format Version,1.23,Length Units,Millimeters,Coordinate Space,Global",
        "",
        ",,Marker,Marker,Marker",
        ",,Tip,Tip,Tip",
        ",,1,1,1",
        ",,Position,Position,Position",
        "Frame,Time (Seconds),X,Y,Z",
    ]
    rows = zip(time_s, *places, strict=True)
    lines = [f"{frame},{t:.2f},{a:.3f},{b:.3f},{c:.3f}" for frame, (t, a, b, c) in enumerate(rows)]
    (folder / "take.csv").write_text("\n".join(head + lines) + "\n")
    log = [f"{t:.2f},{a:.0f},{b:.0f}" for t, a, b in zip(time_s, *counts.values(), strict=True)]
    (folder / "log.csv").write_text("\n".join([f"time_s,{','.join(counts)}", *log]) + "\n")


@pytest.mark.slow
def test_a_strangers_own_two_files_get_a_verdict(stranger: Stranger) -> None:
    """Another robot, origin, turn, encoder and fault than the tutorial's: its commands name the fault."""
    stranger.most = MOST_OF_A_TUTORIAL
    write_export_and_log(stranger.folder, WIDTH_MM, SPOOL_MM, 1000)
    replaced = {
        "$ catheter-sim example catheter_log\n": "$ true\n",
        "catheter_log/tracker.csv": "take.csv",
        "catheter_log/motors.csv": "log.csv",
        "my_data/tracker.csv": "my_data/take.csv",
        "mitral_4dof": ROBOT,
        "--counts-per-turn 4096": "--counts-per-turn 1000",
        "--spool-radius 8": f"--spool-radius {SPOOL_MM:g}",
    }
    stranger.follow("catheter_log.md", "5. Go on with the corrected robot", replaced)
    found = json.loads((stranger.folder / "my_report" / "diagnosis.json").read_text())
    assert found["verdict"] == "cause_found"
    (cause,) = found["causes"]
    assert cause["name"] == "backlash"
    low, high = cause["parameters"]["width_mm"]["ci95"]
    assert low <= WIDTH_MM <= high


@pytest.mark.slow
def test_a_first_policy_reaches_new_targets(stranger: Stranger) -> None:
    """The small learner of the tutorial: 90 of 100 new targets in ten minutes of two cores, and a film."""
    stranger.most = MOST_OF_A_TUTORIAL
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    said = stranger.follow("first_policy.md", "A larger policy: PPO")[-1]
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    reached = re.search(r"^(\d+) of 100 new targets reached$", said, re.MULTILINE)
    assert reached is not None
    assert int(reached[1]) >= 90
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < LEARNING_CPU_S
    with Image.open(stranger.folder / "policy.gif") as film:
        assert film.n_frames >= 6  # half a second at rest, and the way there
