"""The page of the papers' items is what their files say, and every place that an item names exists."""

from __future__ import annotations

import csv
import os
import re
from pathlib import Path

import pytest
from scripts_as_modules import script_module

from catheter_sim.errors import InputError
from catheter_sim.validation import papers as kept
from catheter_sim.validation import report
from catheter_sim.validation.lines import Line, Validation

papers_page = script_module("papers_page")
ROOT = Path(__file__).resolve().parents[2]
TRUTH = ROOT / "docs" / "truth"
ROWS = papers_page.checked_rows((TRUTH / "validation.md").read_text(encoding="utf-8"))
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
def papers() -> tuple:
    return kept.load_papers()


def test_the_page_is_what_the_files_say(papers: tuple) -> None:
    """`python scripts/papers_page.py` would change nothing."""
    page = (TRUTH / "papers_item_by_item.md").read_text(encoding="utf-8")
    assert page == papers_page.page_text(papers, ROWS)


def test_every_place_that_an_item_names_exists(papers: tuple) -> None:
    """Files are there, tests are defined in them, checks stand in the table of the validation."""
    for paper in papers:
        for item in paper.items:
            place = f"{paper.name}, item {item.number}"
            for check in item.checks:
                kept.row_of(check, ROWS)
            for file, test in item.files:
                assert (ROOT / file).exists(), f"{place}: {file}"
                if test:
                    text = (ROOT / file).read_text(encoding="utf-8")
                    assert re.search(rf"^def {re.escape(test)}\(", text, re.MULTILINE), f"{place}: {test}"


def test_nothing_is_partial_or_missing_without_a_reason(papers: tuple) -> None:
    """And what works says where; few items are missing."""
    items = [item for paper in papers for item in paper.items]
    assert len(papers) == len(list(kept.FOLDER.glob("*.toml")))
    assert all(item.reason for item in items if item.status in kept.NEED_A_REASON)
    assert all(item.where for item in items if item.status in kept.NEED_A_PLACE)
    assert sum(item.status == "M" for item in items) <= MOST_MISSING


def test_an_item_calls_a_checked_figure_what_validate_calls_it(papers: tuple) -> None:
    """No item says "predicted" of a figure that the named check says is not."""
    for paper in papers:
        for item in paper.items:
            kinds = {kept.row_of(check, ROWS).kind for check in item.checks}
            if item.kind == "predicted":
                assert "predicted" in kinds, f"{paper.name}, item {item.number}: {kinds}"


TEXTS = os.environ.get("CATHETER_SIM_PAPERS", "")


@pytest.mark.skipif(not TEXTS, reason="CATHETER_SIM_PAPERS names no folder with the papers' texts")
def test_printed_figures_stand_in_the_papers() -> None:
    """Every figure of the `printed` column, in digits, and the kept table says where."""
    script = script_module("check_printed")
    found = list(script.rows(Path(TEXTS)))
    assert [row for row in found if not row["how"]] == []
    with script.OUT.open(newline="", encoding="utf-8") as file:
        assert found == list(csv.DictReader(file))


def test_the_kept_table_has_every_printed_figure(papers: tuple) -> None:
    """Digits and place of each figure that an item prints, in the items' order; none without a place."""
    script = script_module("check_printed")
    with script.OUT.open(newline="", encoding="utf-8") as file:
        kept = list(csv.DictReader(file))
    printed = sorted(
        digits for paper in papers for item in paper.items for digits in script.figures(item.printed)
    )
    assert sorted(row["figure"] for row in kept) == printed
    assert all(row["how"] for row in kept)


def test_a_figure_is_found_by_its_own_digits_alone() -> None:
    """1.4 stands neither in 11.4 nor in 1.45; powers of ten as they are typeset; names are no figures."""
    script = script_module("check_printed")
    assert script.place("1.4", "11.4 and 1.45\nand -1.4 deg") == 2
    assert script.place("8.6e-3", "8.6 \\times 10^{-3} N") == 1
    assert script.place("1.4", "11.4 and 1.45") == 0
    assert script.figures("Fig. 10 has 9.12 % of Table 3, n = 1; R^2 0.995") == ["9.12", "1", "0.995"]


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
        kept.load_papers(tmp_path)
    assert "paper.toml" in str(error.value)


def test_a_figure_comes_from_the_row_that_is_named(tmp_path: Path) -> None:
    """The page shows the row's cell; a row that is not there, or twice, is refused."""
    named = ITEM.replace('"README.md"', f'"validate: {ROWS[0].check}"') + 'ours = "{line[0].ours} mm"\n'
    (tmp_path / "paper.toml").write_text(named, encoding="utf-8")
    assert f"| {ROWS[0].ours} mm |" in papers_page.page_text(kept.load_papers(tmp_path), ROWS)
    with pytest.raises(InputError, match="begins 0 rows"):
        papers_page.page_text(kept.load_papers(tmp_path), ROWS[1:])
    with pytest.raises(InputError, match=f"begins {len(ROWS)} rows"):
        kept.row_of("", ROWS)


def test_a_paper_is_redrawn_with_the_figures_of_the_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The report of `--paper` has each printed figure, ours of this run and DOI; the rest says why not."""
    paper = kept.load_paper("chest_tube_2025")
    assert set(paper.robots) == {"chest_tube_section", "chest_tube"}
    named = next(item for item in paper.items if "{line[0].error}" in item.ours and item.printed != "-")
    robot, _, quantity = named.checks[0].partition(": ")
    line = Line(robot, quantity, "mm", error=0.0321, tolerance=1.0, source="Fig. 9")
    run = Validation((line,), ())
    monkeypatch.setattr(report, "CHECKS", {name: (lambda folder: run,) for name in paper.robots[:1]})
    monkeypatch.setattr(report, "CHECKS", report.CHECKS | {paper.robots[1]: ()})
    report.validate([], tmp_path, paper="chest_tube_2025")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert 'href="https://doi.org/10.1109/LRA.2025.3597860"' in page
    assert "validate\n--paper chest_tube_2025 -o DIR" in page
    rows = {row["number"]: row for row in kept.printed_and_ours(paper, run.lines)}
    assert "0.03 mm" in rows[str(named.number)]["ours"]
    assert len(rows) == sum(item.printed != "-" for item in paper.items)
    assert any(row["ours"].startswith("not computed") for row in rows.values())
    with pytest.raises(InputError, match="unknown paper 'kato'; choices: neuroendoscope_2016, "):
        report.validate([], tmp_path, paper="kato")


def test_figure_6s_predictions_are_those_of_their_page() -> None:
    """Items 10 and 11 of Nayar 2023 type the four predictions, with the generated page's digits."""
    page = (TRUTH / "figure_6.md").read_text(encoding="utf-8")
    rows = [line.split(" | ") for line in page.splitlines() if re.match(r"\| (PK|TE)", line)]
    typed = " ".join(item.ours for item in kept.load_paper("mitral_4dof_2023").items[9:11])
    assert len(rows) == 4
    for row in rows:
        assert f"{row[0].removeprefix('| ')} {row[5]}" in typed
