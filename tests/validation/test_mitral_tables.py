"""Claims about the transseptal catheter's tip errors by column, for both of its tips (Nayar 2022)."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.robots.catheter.picture import IMPLANT_LENGTH_M, IMPLANT_M, holder_length_m
from catheter_sim.robots.catheter.published import RIGID_END_M
from catheter_sim.validation import mitral_tables
from catheter_sim.validation.lines import NO_GRAVITY, tips_mm
from tests.scripts_as_modules import script_module

TRUTH = Path(__file__).resolve().parents[2] / "docs" / "truth"


@pytest.fixture(scope="module")
def straight() -> dict[str, mitral_tables.SetTables]:
    """Table III for both sets."""
    found = {}
    for name in mitral_tables.SETS:
        robot = mitral_tables.SETS[name]()
        loops = {
            joint: mitral_tables.loops_of(robot, joint, by_statics=True) for joint in mitral_tables.JOINTS
        }
        bench = mitral_tables.TipModels(robot, mitral_tables.calibrated(robot, loops))
        found[name] = mitral_tables.set_tables(name, "straight", bench)
    return found


def test_the_rigid_end_is_20_mm_and_holds_the_implant() -> None:
    """Module and holder are 20 mm; 9.5 mm of the printed 13 mm of implant stand free, at its end."""
    robot = load_robot("mitral_transseptal@rigid_end")
    module, holder = robot.segments[-2:]
    assert module.length_m + holder.length_m == pytest.approx(RIGID_END_M, abs=1e-12)
    assert module.length_m + holder_length_m(robot) + IMPLANT_M == pytest.approx(RIGID_END_M, abs=1e-12)
    assert holder_length_m(robot) == pytest.approx(4.5e-3)  # Table I, TM
    assert 0.0 < IMPLANT_LENGTH_M - IMPLANT_M < holder_length_m(robot)  # what is left sits in the holder


def test_both_sets_move_alike_and_differ_by_their_tips() -> None:
    """The same joints and orientation; the tips are 9.5 mm apart along the tool's axis, in every row."""
    robots = [make() for make in mitral_tables.SETS.values()]
    inputs = mitral_tables.trajectory(robots[0], 10.0)
    near, far = (mitral_tables.balance(robot, inputs, NO_GRAVITY).postures for robot in robots)
    axis = np.array([posture.R_w[-1][:, 2] for posture in near])
    assert tips_mm(far) - tips_mm(near) == pytest.approx(9.5 * axis, abs=1e-9)


def test_the_nominal_tip_cannot_have_the_printed_error() -> None:
    """With 10.5 mm PK's and MK's tips are never more than 35.2 mm apart along z; with MK's own 2.52 mm that
    stays below the printed 38.37 mm, and with 20 mm it does not."""
    most = {name: mitral_tables.farthest_mm(name) for name in mitral_tables.SETS}
    assert most["@tube"] == pytest.approx(35.21, abs=0.01)
    pk, mk = (mitral_tables.TABLE_3_MM[0.0][model][2] for model in ("PK", "MK"))
    assert most["@tube"] + mk < pk
    assert most["@rigid_end"] > pk


def test_one_amplitude_gives_one_row_and_predicts_the_others(
    straight: dict[str, mitral_tables.SetTables],
) -> None:
    """None reaches PK's error with the nominal tip; with 20 mm PK's and PI's other rows come within 6 %."""
    assert straight["@tube"].amplitude is None
    assert all(row.fitted_mm is None for row in straight["@tube"].rows)
    rows = [row for row in straight["@rigid_end"].rows if row.printed_mm is not None]
    (fitted,) = [row for row in rows if row.kind == "fitted to it"]
    assert fitted.fitted_mm is not None
    assert fitted.fitted_mm[3] == pytest.approx(45.47, abs=0.02)
    predicted = [row for row in rows if row.kind == "predicted"]
    assert len(predicted) == 5
    for row in predicted:
        assert row.fitted_mm is not None
        assert row.fitted_mm[3] == pytest.approx(row.printed_mm[3], rel=0.06)  # type: ignore[index]


def test_the_kept_table_is_fresh(straight: dict[str, mitral_tables.SetTables]) -> None:
    """Every figure of Table III in docs/truth/tip_tables.csv is what the statics say, to a digit."""
    with (TRUTH / "tip_tables.csv").open(newline="", encoding="utf-8") as file:
        kept = {
            (r["set"], r["path"], r["advance_mm"], r["model"], r["column"]): r for r in csv.DictReader(file)
        }
    for name, item in straight.items():
        for row in item.rows:
            for k, column in enumerate(mitral_tables.COLUMNS):
                cell = kept[name, "straight", f"{row.advance_mm:g}", row.model, column]
                assert float(cell["chosen"]) == pytest.approx(row.chosen_mm[k], abs=0.02)


def test_the_page_is_of_the_kept_table() -> None:
    """`scripts/tip_tables.py` would change nothing."""
    script = script_module("tip_tables")
    page = "\n".join(script.page(script.read(script.KEPT))).rstrip("\n") + "\n"
    assert script.PAGE.read_text(encoding="utf-8") == page


def test_the_tortuous_path_asks_for_a_larger_input() -> None:
    """By more than a tenth; without friction along the path by nothing."""
    robot = mitral_tables.SETS["@rigid_end"]()
    rubbed = mitral_tables.tortuous(robot)
    smooth = load_robot("mitral_transseptal@rigid_end", ("friction.mu=0", "path_deg=180"))
    free = load_robot("mitral_transseptal@rigid_end", ("friction.mu=0",))
    way = [mitral_tables.displacement_at_mm(item, 60.0) for item in (robot, rubbed, smooth, free)]
    assert way[1] > 1.1 * way[0]
    assert way[2] == pytest.approx(way[3], abs=1e-6)
