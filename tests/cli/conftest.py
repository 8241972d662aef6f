"""The command line run in this process, with what it printed and left behind."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli_command import Ran, Run

from catheter_sim.cli.main import main


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(folder: Path, capsys: pytest.CaptureFixture[str]) -> Run:
    """Run `catheter-sim` with the given arguments in `folder`."""

    def command(*arguments: object) -> Ran:
        capsys.readouterr()
        status = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return Ran(status, captured.out, captured.err)

    return command


@pytest.fixture
def inputs(folder: Path) -> str:
    """Name of a file of four rows that pull the right tendon of a neuroendoscope_section and let go."""
    (folder / "in.csv").write_text("time_s,tension_right_N\n0,0\n1,0.1\n2,0.2\n3,0.1\n")
    return "in.csv"
