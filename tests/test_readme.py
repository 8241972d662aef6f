"""The README's figures are those that its commands print."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from catheter_sim.validation.lines import Line
from catheter_sim.validation.run import CHECKS, validate

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def between(start: str, end: str) -> str:
    return README.split(f"<!-- {start}")[1].split("-->", 1)[1].split(f"<!-- {end}")[0]


def rows(text: str) -> list[list[str]]:
    lines = [line for line in text.strip().splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def shown(line: Line) -> list[str]:
    """Return the cells that the README shows of a line; errors far below a tolerance only in order."""
    compared = line.published if line.published is not None else line.analytic
    return [
        f"{line.robot}: {line.quantity}",
        "-" if line.ours is None else f"{line.ours:.3g}",
        "-" if compared is None else f"{compared:.3g}",
        f"{line.error:.1g} {line.unit}",
        f"{line.tolerance:.3g} {line.unit}",
        line.source,
    ]


def test_example_prints_what_the_readme_shows():
    """The Python example's output is the block below it."""
    blocks = re.findall(r"```(?:python)?\n(.*?)```", between("example: python", "example ends"), re.DOTALL)
    code, output = blocks
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == output.strip()


@pytest.mark.slow
@pytest.mark.parametrize("robot", CHECKS)
def test_validation_table_is_what_validate_prints(robot, tmp_path):
    """Every row of the README's table is a line of a fresh validation, to the digits shown; all pass."""
    validation = validate([robot], tmp_path)
    assert validation.passed, validation.table_text()
    lines = {f"{line.robot}: {line.quantity}": line for line in validation.lines}
    table = [row for row in rows(between("validation:", "validation ends")) if row[0].startswith(f"{robot}:")]
    assert table
    for row in table:
        assert row[0] in lines, f"no such check: {row[0]}"
        line = lines[row[0]]
        assert row[1:3] == shown(line)[1:3]
        assert row[4:] == shown(line)[4:]
        # An error that is mostly numerical noise is shown by its order and may move inside it.
        assert float(row[3].split()[0]) == pytest.approx(
            line.error, rel=0.5, abs=0.05 * (line.tolerance or 0)
        )


def test_every_row_of_the_table_is_of_a_checked_robot():
    """No row names a robot that `validate` does not check, and there are rows enough to judge by."""
    table = rows(between("validation:", "validation ends"))
    assert len(table) >= 10
    assert {row[0].split(":")[0] for row in table} <= set(CHECKS)


def test_opencr_figures_are_those_of_the_golden_run():
    """The README's tip errors are those of the diagnosis kept as a golden file."""
    golden = json.loads((ROOT / "tests" / "data" / "opencr_v4_diagnosis.json").read_text())
    section = README.split("## A real robot, diagnosed")[1].split("## What this does not model")[0]
    for key in ("before", "after"):
        assert f"{golden[f'heldout_tip_distance_rmse_{key}_mm']:.2f}" in section
        assert f"{golden[f'heldout_tip_distance_rmse_aligned_{key}_mm']:.2f}" in section
    assert f"{golden['heldout_tip_distance_rmse_aligned_after_mm_as_chosen_in_training']:.2f}" in section
