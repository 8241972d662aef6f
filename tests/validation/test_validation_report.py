"""The validation's page: read on a telephone, what is out stands first, every line and picture is in it."""

from __future__ import annotations

import ast
import math
from dataclasses import replace
from pathlib import Path

import pytest
from page_checks import read_page
from PIL import Image

from catheter_sim.validation import report
from catheter_sim.validation.lines import ASSUMED, VERIFIED, Line, Validation
from catheter_sim.validation.report import CAPTIONS, caption, validation_html

NEAR = Line("chest_tube_section", "tip_x_mm at 5 N", "mm", 0.3, 0.4, "Eq. 9 (fkm_sliding)", 1.0, 1.3, None)
FAR = Line("mitral_4dof", "bend <in degrees>", "deg", 0.1, 1.0, "Table III", 2.0, None, 2.1)
TOLD = replace(FAR, quantity="mass", tolerance=None, kind=ASSUMED)
SOURCES = Path(report.__file__).parent


def test_the_page_is_read_on_a_telephone_and_says_what_agrees(tmp_path: Path) -> None:
    """Counts, the largest share of a tolerance, findings, every line and picture; texts are escaped."""
    Image.new("RGB", (4, 4)).save(tmp_path / "neuroendoscope_section_loops.png")
    html = validation_html(Validation((NEAR, FAR, TOLD), ("It holds.",)), list(tmp_path.iterdir()))
    page = read_page(html)
    assert page.problems == []
    assert "2 of 2 judged lines within their tolerance" in page.seen
    assert "75 % tip x at 5 N" in page.seen
    assert "all 2 lines that are judged are within" in page.seen
    assert "bend <in degrees>" in page.seen
    assert "It holds." in page.seen
    assert html.count("data:image/png;base64,") == 1
    assert caption(Path("neuroendoscope_section_loops.png")).endswith("(neuroendoscope section)")


@pytest.mark.parametrize("error", [2.0, math.nan])
def test_what_is_out_stands_first(error: float) -> None:
    """With its error and its tolerance, before all tables; undefined counts as out."""
    page = read_page(validation_html(Validation((NEAR, replace(FAR, error=error)), ())))
    assert page.problems == []
    assert "verdict: out of tolerance" in page.seen
    assert "1 of 2 judged lines are out" in page.seen
    assert page.seen.index("Out of tolerance") < page.seen.index("By robot")
    assert f"error {error:.4g} deg, tolerance 1 deg" in page.seen
    assert "no agreement" in read_page(validation_html(Validation((), ()))).seen


def test_pictures_of_an_earlier_run_are_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only what this run has drawn is in its page; it stands beside table and JSON."""
    Image.new("RGB", (4, 4)).save(tmp_path / "old_loops.png")

    def check(folder: Path) -> Validation:
        Image.new("RGB", (5, 5)).save(folder / "new_shapes.png")
        return Validation((replace(NEAR, kind=VERIFIED),), ())

    monkeypatch.setattr(report, "CHECKS", {"chest_tube_section": (check,)})
    report.validate(["chest_tube_section"], tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert "Backbones in the bending plane" in page
    assert page.count("data:image/png;base64,") == 1
    assert {"report.html", "validation.json", "validation.txt"} <= {item.name for item in tmp_path.iterdir()}


def test_every_picture_that_a_check_draws_has_its_words() -> None:
    """By the ends of all names of PNG files in the checks' code."""
    names = {
        node.value
        for path in SOURCES.glob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.endswith(".png")
    } - {"*.png"}
    assert len(names) >= 12
    for name in names:
        assert Path(name).stem.endswith(tuple(CAPTIONS)), name
