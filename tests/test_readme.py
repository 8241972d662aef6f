"""The README's figures are those that its commands print."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def between(start: str, end: str) -> str:
    return README.split(f"<!-- {start}")[1].split("-->", 1)[1].split(f"<!-- {end}")[0]


@pytest.mark.slow
def test_example_prints_what_the_readme_shows():
    """The Python example's output is the block below it."""
    blocks = re.findall(r"```(?:python)?\n(.*?)```", between("example: python", "example ends"), re.DOTALL)
    code, output = blocks
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == output.strip()


def test_opencr_figures_are_those_of_the_golden_run():
    """The README's tip errors are those of the diagnosis kept as a golden file."""
    golden = json.loads((ROOT / "tests" / "data" / "opencr_v4_diagnosis.json").read_text())
    section = README.split("## A real robot, diagnosed")[1].split("## What this does not model")[0]
    for key in ("before", "after"):
        assert f"{golden[f'heldout_tip_distance_rmse_{key}_mm']:.2f}" in section
        assert f"{golden[f'heldout_tip_distance_rmse_aligned_{key}_mm']:.2f}" in section
    assert f"{golden['heldout_tip_distance_rmse_aligned_after_mm_as_chosen_in_training']:.2f}" in section
