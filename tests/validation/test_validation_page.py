"""The documentation's table of the validation is what `validate` prints."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import pytest

from catheter_sim.validation.lines import Line
from catheter_sim.validation.report import CHECKS, validate
from tests.scripts_as_modules import script_module

page_script = script_module("validation_page")
PAGE = (Path(__file__).resolve().parents[2] / "docs" / "truth" / "validation.md").read_text(encoding="utf-8")


def rows() -> list[list[str]]:
    """Return the cells of the page's table, line by line."""
    text = PAGE.split("<!-- validation:")[1].split("-->", 1)[1].split("<!-- validation ends")[0]
    lines = [line for line in text.strip().splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def shown(line: Line) -> list[str]:
    """Return the cells that the page shows of a line; errors far below a tolerance only in order."""
    return page_script.cells(asdict(line))


def test_the_page_is_brought_up_to_a_validation() -> None:
    """A row is replaced in its place, one is added, one that is gone is kept, or dropped where asked for."""
    old = Line("robot", "tip", "mm", 0.1, None, "a test", ours=1.0)
    page = "top\n<!-- validation: lines -->\n| a |\n|---|\n| {} |\n| {} |\n<!-- validation ends -->\n".format(
        " | ".join(shown(old)), " | ".join(shown(replace(old, quantity="gone")))
    )
    lines = [
        asdict(replace(old, ours=2.0)),
        asdict(replace(old, quantity="new", kind="predicted", said="more")),
    ]
    kept = page_script.updated(page, lines, ["new"], drop=False)
    assert "| robot | tip | 2 | - | 0.1 mm | - | verified | a test |" in kept
    assert "| robot | new | 1 | more | 0.1 mm | - | predicted | a test |" in kept
    assert "| robot | gone |" in kept
    assert "| robot | gone |" not in page_script.updated(page, lines, [], drop=True)
    assert page_script.updated(page, [], [], drop=True) == page


@pytest.mark.long
@pytest.mark.parametrize("robot", CHECKS)
def test_validation_table_is_what_validate_prints(robot, tmp_path):
    """Every row of the page's table is a line of a fresh validation, to the digits shown; all pass."""
    validation = validate([robot], tmp_path)
    assert validation.passed, validation.table_text()
    lines = {line.quantity: line for line in validation.lines}
    table = [row for row in rows() if row[0] == robot]
    assert table
    for row in table:
        assert row[1] in lines, f"no such check: {row[1]}"
        line = lines[row[1]]
        assert row[2:4] == shown(line)[2:4]
        assert row[5:] == shown(line)[5:]
        # An error that is mostly numerical noise is shown by its order and may move inside it.
        assert float(row[4].split()[0]) == pytest.approx(
            line.error, rel=0.5, abs=0.05 * (line.tolerance or 0)
        )


def test_every_row_of_the_table_is_of_a_checked_robot():
    """No row names a robot that `validate` does not check, and there are rows enough to judge by."""
    table = rows()
    assert len(table) >= 10
    assert {row[0] for row in table} <= set(CHECKS)
