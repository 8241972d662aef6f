"""A stranger's way: from a wheel in an empty environment to a robot's named fault, in at most eight commands.

The environment has the package from the wheel alone; the libraries that it depends on are lent to it by the
environment of the tests, so that no network is needed (`scripts/package.sh` installs them anew).
"""

from __future__ import annotations

import csv
import importlib.util
import json
import os
import site
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import catheter_sim as cs

ROOT = Path(__file__).resolve().parent.parent
ROBOT = "mitral_transseptal"
SPOOL_MM = 12.0
WIDTH_MM = 0.55  # of the dead-band that is hidden in the data
NOISE_MM = 0.05
MOST_COMMANDS = 8
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


@pytest.fixture
def stranger(wheel: Path, tmp_path: Path) -> Callable[..., str]:
    """Run commands in an environment that has nothing of the checkout, in a folder of its own; count them."""
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
    count = 0

    def run(*words: object) -> str:
        nonlocal count
        count += 1
        assert count <= MOST_COMMANDS
        command = [str(word) for word in words]
        ran = subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True)
        assert ran.returncode == 0, f"{command}\n{ran.stdout}{ran.stderr}"
        return ran.stdout

    run("pip", "install", "-q", "--no-deps", "--no-index", wheel)
    return run


@pytest.mark.slow
def test_a_strangers_way_ends_with_the_hidden_fault(stranger: Callable[..., str], tmp_path: Path) -> None:
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
