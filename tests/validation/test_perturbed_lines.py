"""Judged lines can fail: the table of `scripts/perturb_validation.py` says by what."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from catheter_sim.validation import neuroendoscope, spacer_disk
from catheter_sim.validation.report import CHECKS
from tests.scripts_as_modules import script_module

TRUTH = Path(__file__).resolve().parents[2] / "docs" / "truth"
AS_IT_IS = "as it is"


def rows() -> list[dict[str, str]]:
    with (TRUTH / "perturbed_lines.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def errors(row: dict[str, str]) -> dict[str, float]:
    """Return a line's error in each run that gave one."""
    runs = [name for name in row if name == AS_IT_IS or ": " in name]
    return {name: float(row[name]) for name in runs if row[name] not in ("", "-", "stopped")}


def test_every_line_that_was_tried_is_green_as_it_is_and_most_turn_red() -> None:
    """As it is no line is out; the page names those that no change turned red, and how many there are."""
    page = (TRUTH / "perturbed_lines.md").read_text(encoding="utf-8")
    never = 0
    for row in rows():
        found, most = errors(row), float(row["tolerance"])
        assert found[AS_IT_IS] <= most, row["quantity"]
        red = [name for name, error in found.items() if not error <= most]
        never += not red
        assert f"| {row['robot']}: {row['quantity']} | " in page
    assert f"{len(rows()) - never} of {len(rows())} lines turn red" in page
    assert page.count("**nothing**") == never


def test_judged_lines_of_the_validations_table_were_tried() -> None:
    """All judged lines of the documentation's table are there: each can fail."""
    checks = {f"{row['robot']}: {row['quantity']}" for row in rows()}
    table = script_module("papers_page").checked_rows((TRUTH / "validation.md").read_text(encoding="utf-8"))
    judged = {row.check for row in table if row.tolerance != "-"}
    assert judged - checks == set()


def test_static_models_that_checks_import_are_changed() -> None:
    """A check that calls a static model by its name gets the changed one, and afterwards its own again."""
    script = script_module("perturb_validation")
    before = neuroendoscope.fkm_sliding, spacer_disk.constant_curvature
    change = next(iter(script.CHANGES.values()))
    with script.changed_statics(change, ["fkm_sliding"], []):
        assert neuroendoscope.fkm_sliding is not before[0]
        assert spacer_disk.constant_curvature is before[1]
    assert (neuroendoscope.fkm_sliding, spacer_disk.constant_curvature) == before


@pytest.mark.slow
def test_changes_are_made_and_turn_lines_red(tmp_path: Path) -> None:
    """Of three quick checks the table is made anew: no line stays green, the page prints what turned it."""
    script = script_module("perturb_validation")
    results = script.Results(tmp_path / "table.csv")
    wanted = {"validate_elongation", "validate_flow", "validate_transseptal"}
    for robot in ("mitral_4dof", "mitral_transseptal"):
        for check in CHECKS[robot]:
            if check.__name__ in wanted:
                script.perturb(robot, check, results, every=False)
    page = script.page(results)
    print(page)
    assert len(results.rows) == 9
    assert "9 of 9 lines turn red" in page
