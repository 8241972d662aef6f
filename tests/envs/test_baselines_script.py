"""Claims about `scripts/baselines.py`: what it counts, and what it refuses."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "scripts" / "baselines.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_unknown_environment_is_refused(tmp_path):
    """One line with the choices, exit status 2, nothing written."""
    ran = run("--environments", "NeuroendoscopeFly", "-o", str(tmp_path / "out.csv"))
    assert ran.returncode == 2
    assert ran.stderr.startswith("baselines: error: --environments: unknown environment 'NeuroendoscopeFly'")
    assert "NeuroendoscopeTrack" in ran.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_table_counts_controller_and_chance(tmp_path):
    """A row for each environment; the controller follows both ways of the section, chance none."""
    ran = run(
        "--environments", "NeuroendoscopeSectionTrack", "--episodes", "2", "-o", str(tmp_path / "out.csv")
    )
    assert ran.returncode == 0, ran.stderr
    table = "environment,controller,chance,episodes\nNeuroendoscopeSectionTrack,2,0,2\n"
    assert (tmp_path / "out.csv").read_text() == table


@pytest.mark.slow
def test_an_episode_is_drawn_as_the_files_name_says(tmp_path):
    """Another ending, and an unknown environment, are refused in one line with the choices."""
    ran = run("--show", "NotchedWristReach", "-o", str(tmp_path / "a.png"), "--width", "320")
    assert ran.returncode == 0, ran.stderr
    assert "320 x 180 pixels" in ran.stdout
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    for name, file, words in (("NotchedWristReach", "a.jpg", ".png, .mp4"), ("Fly", "b.png", "'Fly'")):
        ran = run("--show", name, "-o", str(tmp_path / file))
        assert ran.returncode == 2
        assert ran.stderr.startswith("baselines: error: ")
        assert words in ran.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
