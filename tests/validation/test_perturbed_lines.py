"""Judged lines can fail: the table of `scripts/perturb_validation.py` says by what."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from catheter_sim.robots.continuum.published import neuroendoscope_section
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.validation import neuroendoscope, spacer_disk
from catheter_sim.validation.lines import constant_of
from catheter_sim.validation.report import CHECKS
from tests.scripts_as_modules import script_module

TRUTH = Path(__file__).resolve().parents[2] / "docs" / "truth"
AS_IT_IS = "as it is"


def rows() -> list[dict[str, str]]:
    with (TRUTH / "perturbed_lines.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


SIDES = ("+10 %", "-10 %")


def red(row: dict[str, str], side: str) -> bool:
    return row[side] == "nan" or (
        row[side] not in ("", "-", "stopped") and float(row[side]) > float(row["tolerance"])
    )


def test_every_line_that_was_tried_is_green_as_it_is_and_fails_to_both_sides() -> None:
    """As it is no line is out; at least 95 % fail with their constant a tenth larger and a tenth smaller."""
    page = (TRUTH / "perturbed_lines.md").read_text(encoding="utf-8")
    tried = [row for row in rows() if all(row[side] for side in SIDES)]
    assert tried
    for row in rows():
        assert float(row[AS_IT_IS]) <= float(row["tolerance"]), row["quantity"]
        assert row["about"] == constant_of(row["robot"], row["quantity"])
        assert f"| {row['robot']} | {row['quantity']} | " in page
    both = [row for row in tried if all(red(row, side) for side in SIDES)]
    assert len(both) >= 0.95 * len(tried)
    assert f"{len(both)} of the {len(tried)} lines tried fail both ways" in page
    assert "**not said**" not in page  # each line that survives has its reason


def test_judged_lines_of_the_validations_table_stand_in_it() -> None:
    """All judged lines of the documentation's table are there, tried or not tried yet."""
    checks = {f"{row['robot']}: {row['quantity']}" for row in rows()}
    table = script_module("papers_page").checked_rows((TRUTH / "validation.md").read_text(encoding="utf-8"))
    judged = {row.check for row in table if row.tolerance != "-"}
    assert judged - checks == set()


def test_static_models_that_checks_import_are_changed() -> None:
    """A check that calls a static model by its name gets the changed one, and afterwards its own again."""
    script = script_module("perturb_validation")
    before = neuroendoscope.fkm_sliding, spacer_disk.constant_curvature
    with script.changed_statics(script.change_of("stiffness", 1.1), ["fkm_sliding"]):
        assert neuroendoscope.fkm_sliding is not before[0]
        assert spacer_disk.constant_curvature is before[1]
    assert (neuroendoscope.fkm_sliding, spacer_disk.constant_curvature) == before


@pytest.mark.parametrize("number", ["stiffness", "friction", "length", "damping"])
def test_a_number_and_no_other_is_changed(number: str) -> None:
    """Twice makes one of the four numbers twice as large."""
    script = script_module("perturb_validation")
    robot = neuroendoscope_section()
    changed = script.NUMBERS[number](robot, 2.0)

    def numbers(item: ContinuumRobot) -> dict[str, float]:
        return {
            "stiffness": item.stiffness_scale,
            "friction": item.friction.mu,
            "length": item.segments[0].length_m,
            "damping": item.dynamics.damping_time_s,
        }

    expected = numbers(robot)
    expected[number] *= 2.0
    assert numbers(changed) == pytest.approx(expected)


@pytest.mark.slow
def test_changes_are_made_and_turn_lines_red(tmp_path: Path) -> None:
    """Of two quick checks the table is made: all lines fail to both sides, and a run is not made again."""
    script = script_module("perturb_validation")
    results = script.Results(tmp_path / "table.csv")
    for robot, name in (
        ("mitral_4dof", "validate_elongation"),
        ("mitral_transseptal", "validate_transseptal"),
    ):
        (check,) = [item for item in CHECKS[robot] if item.__name__ == name]
        script.perturb(robot, check, results)
    assert len(results.rows) == 8
    assert all(script.is_red(row, side) for row in results.rows for side in script.SIDES)
    again = script.Results(tmp_path / "table.csv")
    assert again.rows == results.rows
