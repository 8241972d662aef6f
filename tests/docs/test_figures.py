"""The README's figures are known to a script that says which of them are stale."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import pytest

from catheter_sim.validation.lines import Line, Validation

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

import figures  # type: ignore[import-not-found]  # noqa: E402


@pytest.mark.parametrize("name", figures.FIGURES)
def test_every_figure_stands_on_its_page(name: str) -> None:
    """The page shows the very text, and the program whose imports count is there."""
    item = figures.FIGURES[name]
    assert item.shows in (ROOT / item.page).read_text(encoding="utf-8")
    assert (ROOT / item.program).is_file()


def test_a_measured_value_counts_to_the_digits_shown() -> None:
    """0.0170 and 0.0174 are 0.017 %; 0.0176 is not, nor is what the page does not show."""
    item = figures.FIGURES["rod_shapes"]
    assert figures.agrees(item, 0.0170)
    assert figures.agrees(item, 0.0174)
    assert not figures.agrees(item, 0.0176)
    assert not figures.agrees(figures.Figure("7.77 km", "", item.program, ""), 7.77)


def test_a_figure_is_stale_where_what_it_imports_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file two imports away counts, one that is not imported does not; a value that moved is wrong."""
    package = tmp_path / "catheter_sim"
    package.mkdir()
    (tmp_path / "README.md").write_text("right to 1.5 mm")
    for name, text in (
        ("__init__", ""),
        ("near", "from catheter_sim.far import LENGTH\n"),
        ("far", "LENGTH = 1.0\n"),
        ("other", "WIDTH = 1.0\n"),
    ):
        (package / f"{name}.py").write_text(text)
    program = "import sys\nfrom catheter_sim.near import LENGTH\nprint('off by 1.5 mm')\n"
    (tmp_path / "run.py").write_text(program)
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    monkeypatch.setattr(figures, "RESULTS", tmp_path / "figures.json")
    item = figures.Figure("1.5 mm", "python run.py", "run.py", r"off by ([\d.]+)")
    monkeypatch.setattr(figures, "FIGURES", {"one": item})
    assert figures.state("one") == "stale"
    kept = {"value": 1.5, "digest": figures.digest(item), "commit": "0" * 40, "date": "", "seconds": 1.0}
    for value, expected in ((1.5, "fresh"), (1.6, "wrong")):
        (tmp_path / "figures.json").write_text(figures.json.dumps({"one": kept | {"value": value}}))
        assert figures.state("one") == expected
    (package / "other.py").write_text("WIDTH = 2.0\n")
    assert figures.state("one") == "wrong"
    (package / "far.py").write_text("LENGTH = 2.0\n")
    assert figures.state("one") == "stale"


@pytest.mark.parametrize(
    ("name", "line", "wanted"),
    [
        (
            "friction_of_tendons",
            {"quantity": "tip pushed: shipped friction, tip, largest", "unit": "mm", "error": 0.0211},
            [0.0211],
        ),
        (
            "benchmark_vc",
            {"quantity": "scenario 1, 10 disks, VC: mean tip position error", "unit": "%", "ours": 0.148},
            [0.148],
        ),
        (
            "benchmark_vc",
            {"quantity": "scenario 1, 10 disks, VC: mean tip position error over 16 sets", "unit": "%"},
            [],
        ),
    ],
)
def test_a_figure_is_read_from_the_table_that_validate_prints(
    name: str, line: dict[str, Any], wanted: list[float]
) -> None:
    """Its own cell, not a number of the line's name or of the next line."""
    given = {"robot": "a_robot", "error": 0.5, "tolerance": 0.1, "source": "16 sets, 2021"} | line
    text = Validation((Line(**given), Line(**(given | {"quantity": "0.40 N"}))), ()).table_text()
    read = [float(value) for value in re.findall(figures.FIGURES[name].reads, text, re.MULTILINE | re.DOTALL)]
    assert read == wanted
