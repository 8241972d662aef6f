"""The page of the papers' items is what their files say, and every place that an item names exists."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from catheter_sim.errors import InputError
from catheter_sim.validation.report import (
    FOLDER,
    NEED_A_PLACE,
    NEED_A_REASON,
    Paper,
    checked_rows,
    load_papers,
    page_text,
    row_of,
)

ROOT = Path(__file__).resolve().parents[2]
TRUTH = ROOT / "docs" / "truth"
ROWS = checked_rows((TRUTH / "validation.md").read_text(encoding="utf-8"))
MOST_MISSING = 8  # items, of all papers
ITEM = """
[paper]
name = "A paper"
reference = "A. Author"
year = 2000

[[items]]
number = 1
item = "Fig. 1"
status = "F"
kind = "predicted"
where = ["README.md"]
"""


@pytest.fixture(scope="module")
def papers() -> tuple[Paper, ...]:
    return load_papers()


def test_the_page_is_what_the_files_say(papers: tuple[Paper, ...]) -> None:
    """`python scripts/papers_page.py` would change nothing."""
    page = (TRUTH / "papers_item_by_item.md").read_text(encoding="utf-8")
    assert page == page_text(papers, ROWS)


def test_every_place_that_an_item_names_exists(papers: tuple[Paper, ...]) -> None:
    """Files are there, tests are defined in them, checks stand in the table of the validation."""
    for paper in papers:
        for item in paper.items:
            place = f"{paper.name}, item {item.number}"
            for check in item.checks:
                row_of(check, ROWS)
            for file, test in item.files:
                assert (ROOT / file).exists(), f"{place}: {file}"
                if test:
                    text = (ROOT / file).read_text(encoding="utf-8")
                    assert re.search(rf"^def {re.escape(test)}\(", text, re.MULTILINE), f"{place}: {test}"


def test_nothing_is_partial_or_missing_without_a_reason(papers: tuple[Paper, ...]) -> None:
    """And what works says where; few items are missing."""
    items = [item for paper in papers for item in paper.items]
    assert len(papers) == len(list(FOLDER.glob("*.toml")))
    assert all(item.reason for item in items if item.status in NEED_A_REASON)
    assert all(item.where for item in items if item.status in NEED_A_PLACE)
    assert sum(item.status == "M" for item in items) <= MOST_MISSING


def test_an_item_calls_a_checked_figure_what_validate_calls_it(papers: tuple[Paper, ...]) -> None:
    """No item says "predicted" of a figure that the named check says is not."""
    for paper in papers:
        for item in paper.items:
            kinds = {row_of(check, ROWS).kind for check in item.checks}
            if item.kind == "predicted" and kinds:
                assert "predicted" in kinds, f"{paper.name}, item {item.number}: {kinds}"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('status = "F"', 'status = "G"', "status"),
        ('kind = "predicted"', 'kind = "guessed"', "kind"),
        ("number = 1", "number = 2", "not numbered 1 to 1"),
        ('status = "F"', 'status = "P"', "status P without a reason"),
        ('where = ["README.md"]', "", "status F without a place"),
        ("[[items]]", "[[items]]\nprinting = 1", "printing"),
        ("[paper]", "[paper", "not valid TOML"),
    ],
)
def test_a_wrong_file_is_refused_with_its_place(old: str, new: str, message: str, tmp_path: Path) -> None:
    """One line that names the file and what is wrong."""
    (tmp_path / "paper.toml").write_text(ITEM.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=message) as error:
        load_papers(tmp_path)
    assert "paper.toml" in str(error.value)


def test_a_figure_comes_from_the_row_that_is_named(tmp_path: Path) -> None:
    """The page shows the row's cell; a row that is not there, or twice, is refused."""
    named = ITEM.replace('"README.md"', f'"validate: {ROWS[0].check}"') + 'ours = "{line[0].ours} mm"\n'
    (tmp_path / "paper.toml").write_text(named, encoding="utf-8")
    assert f"| {ROWS[0].ours} mm |" in page_text(load_papers(tmp_path), ROWS)
    with pytest.raises(InputError, match="begins 0 rows"):
        page_text(load_papers(tmp_path), ROWS[1:])
    with pytest.raises(InputError, match=f"begins {len(ROWS)} rows"):
        row_of("", ROWS)
