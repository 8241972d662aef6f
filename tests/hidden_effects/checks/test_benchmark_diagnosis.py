"""Claims about `scripts/benchmark_diagnosis.py`: its data are as it says, and an unknown robot is refused."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.lab.robots import bench_robot
from tests.scripts_as_modules import script_module


@pytest.fixture(scope="module")
def script() -> ModuleType:
    """The script as a module."""
    return script_module("benchmark_diagnosis")


@pytest.mark.slow
def test_data_have_the_rows_and_the_roles(script: ModuleType, tmp_path: Path) -> None:
    """Four trials of whole cycles, the last of them held out, and what is hidden shows in them."""
    generator = np.random.default_rng(1)
    rows = script._make(tmp_path, bench_robot("mitral_4dof", generator), 120, 4, generator)
    dataset = load_dataset(tmp_path)
    assert [trial.role for trial in dataset.trials] == ["train"] * 3 + ["heldout"]
    assert rows == sum(len(trial.inputs) for trial in dataset.trials)
    assert 0.7 * 120 < rows < 1.5 * 120
    assert not dataset.robot.effects


def test_unknown_robot_is_refused(
    script: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line, the choices in it, status 2."""
    monkeypatch.setattr(sys, "argv", ["benchmark_diagnosis", "--robots", "snake"])
    assert script.main() == 2
    line = capsys.readouterr().err
    assert "snake" in line
    assert "mitral_4dof" in line
    assert line.count("\n") == 1
