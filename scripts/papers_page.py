"""Write docs/truth/papers_item_by_item.md from catheter_sim/validation/items/*.toml.

    python scripts/papers_page.py [--check]

With --check nothing is written; the exit status is 1 where the page is not what the files say.
"""

from __future__ import annotations

import argparse
import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import catheter_sim
from catheter_sim.errors import InputError, unknown
from catheter_sim.validation.lines import KINDS

TRUTH = Path(__file__).resolve().parent.parent / "docs" / "truth"
PAGE = TRUTH / "papers_item_by_item.md"

# ----------------------------------------------------------------------------------------------------
# What each paper prints, item by item, beside what this package gives: one file a paper, one page for all.
#
# A figure of ours that `validate` prints is not typed a second time: an item names the check and takes the
# figure from the documentation's table of the validation, which a test holds to what `validate` prints.

FOLDER = Path(catheter_sim.__file__).parent / "validation" / "items"
STATUSES = {
    "F": "works; tied to a printed number or a closed form",
    "I": "works; checked against a second model or independent code, no printed number",
    "P": "partial: weak, circular, or far from print; the reason stands beside it",
    "M": "missing",
    "X": "not possible without the authors' measurements",
}
NEED_A_REASON = ("P", "M", "X")
NEED_A_PLACE = ("F", "I", "P")
CHECK = "validate: "  # how a place names a check of `validate`
_KEYS = {"number", "item", "status", "kind", "printed", "ours", "where", "reason", "headline"}
_COUNTS = "| paper | items | " + " | ".join(STATUSES) + " |"
_HEAD = (
    "| # | item | status | kind | printed | ours | where | what is missing, and why |\n" + "|---" * 8 + "|"
)
_TOP = """\
# The papers, item by item

This page has every figure, equation and claim of the five papers that the package rests on, beside what the
package gives. The notched wrist of York 2015 is not gone through item by item. `validate` prints the checks
that are named here ([all of them](validation.md)). A figure of ours that it prints is taken from there.

**Status.**

{statuses}

**Kind**, what a figure of ours is worth:

- `implemented`: an equation or an input of the paper, coded
- `verified`: two models that share no code, or a model and a closed form, against each other
- `predicted`: a printed figure or claim, by a model that knows nothing of it
- `fitted to it`: a number was chosen so that it comes out
- `read back`: it went in and comes out
- `assumed`: it rests on a number that nobody prints
- `not reproduced`: ours lies elsewhere, and nobody knows why
- `refuted`: ours or theirs is shown to be wrong
- `out of reach`: what would make it comparable is not printed or not modelled

`validate` judges what is verified or predicted. Every printed figure was looked up in the paper's text. The
script `scripts/check_printed.py` does it, and keeps [digits and places](printed_figures.csv).
Each paper's headline figures stand first.
"""
_DOI, _LINK = re.compile(r"\bdoi (10\.\S+?)(?=\.?$)"), r"[doi \1](https://doi.org/\1)"
_TOP_END = "\nA hyphen in `printed` says that the paper prints no figure of it."


@dataclass(frozen=True)
class Checked:
    """One row of the documentation's table of the validation, as text.

    Attributes:
        check: robot and quantity.
        ours, published, error, tolerance, kind, source: the row's other cells.
    """

    check: str
    ours: str
    published: str
    error: str
    tolerance: str
    kind: str
    source: str


@dataclass(frozen=True)
class Item:
    """One item of a paper.

    Attributes:
        number: in the paper's list, from 1.
        item: what it is.
        status: of `STATUSES`.
        kind: what our figure is worth, of `KINDS`.
        printed: what the paper prints, "-" where nothing.
        ours: what this package gives; `{line[0].ours}` stands for a cell of the first check in `where`.
        where: files, tests (`FILE::NAME`) and checks of `validate` (`CHECK` and how the row begins).
        reason: what is missing and why, empty where nothing is.
        headline: whether it is one of the figures that the paper's abstract or conclusion rests on.
    """

    number: int
    item: str
    status: str
    kind: str
    printed: str
    ours: str
    where: tuple[str, ...]
    reason: str
    headline: bool

    @property
    def checks(self) -> tuple[str, ...]:
        """How the rows of the validation begin that the item names."""
        return tuple(place.removeprefix(CHECK) for place in self.where if place.startswith(CHECK))

    @property
    def files(self) -> tuple[tuple[str, str], ...]:
        """Files that the item names, and the test in each, "" for none."""
        named = [place for place in self.where if not place.startswith(CHECK)]
        return tuple((place.partition("::")[0], place.partition("::")[2]) for place in named)


@dataclass(frozen=True)
class Paper:
    """A paper and its items.

    Attributes:
        name: short, as the page's headings have it.
        reference: in full.
        items: in their order.
    """

    name: str
    reference: str
    items: tuple[Item, ...]

    def count(self) -> Counter[str]:
        """Return how many items have each status."""
        return Counter(item.status for item in self.items)


def load_papers(folder: Path = FOLDER) -> tuple[Paper, ...]:
    """Return the papers of all files in `folder`, by their year and file.

    Raises:
        InputError: a file is no TOML, a key or choice is unknown, or an item lacks a place or a reason.
    """
    found = []
    for path in sorted(folder.glob("*.toml")):
        try:
            document = tomllib.loads(path.read_text(encoding="utf-8"))
        except tomllib.TOMLDecodeError as error:
            raise InputError(f"{path}: not valid TOML: {error}") from None
        items = tuple(_item(row, f"{path}: item {k}") for k, row in enumerate(document["items"], 1))
        if [item.number for item in items] != list(range(1, len(items) + 1)):
            raise InputError(f"{path}: items are not numbered 1 to {len(items)} in order")
        about = document["paper"]
        found.append((about["year"], Paper(about["name"], about["reference"], items)))
    return tuple(paper for _, paper in sorted(found, key=lambda pair: pair[0]))


def _item(row: Mapping[str, Any], place: str) -> Item:
    for key in row:
        if key not in _KEYS:
            raise unknown("key", key, sorted(_KEYS), place)
    item = Item(
        number=row["number"],
        item=row["item"],
        status=row["status"],
        kind=row["kind"],
        printed=row.get("printed", "-"),
        ours=row.get("ours", "-"),
        where=tuple(row.get("where", ())),
        reason=row.get("reason", ""),
        headline=row.get("headline", False),
    )
    if item.status not in STATUSES:
        raise unknown("status", item.status, STATUSES, place)
    if item.kind not in KINDS:
        raise unknown("kind", item.kind, KINDS, place)
    if item.status in NEED_A_REASON and not item.reason:
        raise InputError(f"{place}: status {item.status} without a reason")
    if item.status in NEED_A_PLACE and not item.where:
        raise InputError(f"{place}: status {item.status} without a place where it can be seen")
    return item


def checked_rows(page: str) -> tuple[Checked, ...]:
    """Return the rows of the table of the validation in the text of its page."""
    text = page.split("<!-- validation:")[1].split("-->", 1)[1].split("<!-- validation ends")[0]
    lines = [line for line in text.strip().splitlines() if line.startswith("|")]
    return tuple(Checked(*(cell.strip() for cell in line.strip("|").split("|"))) for line in lines[2:])


def row_of(check: str, rows: Sequence[Checked]) -> Checked:
    """Return the row that `check` names, whole or by how it begins.

    Raises:
        InputError: none begins so, or several.
    """
    whole = [row for row in rows if row.check == check]
    found = whole or [row for row in rows if row.check.startswith(check)]
    if len(found) != 1:
        raise InputError(f"{check!r} begins {len(found)} rows of the table of the validation, not one")
    return found[0]


def page_text(papers: Sequence[Paper], rows: Sequence[Checked]) -> str:
    """Return the page: how many items have which status, then a table for each paper.

    Raises:
        InputError: an item names a check that the validation's table does not have.
    """
    return "\n".join(_page(papers, rows)) + "\n"


def _page(papers: Sequence[Paper], rows: Sequence[Checked]) -> Iterator[str]:
    yield _TOP.format(statuses="\n".join(f"- **{key}** {text}" for key, text in STATUSES.items()))
    yield _COUNTS
    yield "|---" * (2 + len(STATUSES)) + "|"
    counts = [(paper.name, paper.count()) for paper in papers]
    for name, count in [*counts, ("all", sum((count for _, count in counts), Counter[str]()))]:
        cells = (name, str(count.total()), *(str(count[key]) for key in STATUSES))
        yield f"| {' | '.join(cells)} |"
    yield _TOP_END
    for paper in papers:
        yield f"\n## {paper.name}\n\n{_DOI.sub(_LINK, paper.reference)}\n"
        yield _HEAD
        for item in sorted(paper.items, key=lambda item: not item.headline):
            yield _row(item, rows)


def _row(item: Item, rows: Sequence[Checked]) -> str:
    lines = [row_of(check, rows) for check in item.checks]
    try:
        ours = item.ours.format(line=lines)
    except (IndexError, AttributeError, KeyError) as error:
        raise InputError(f"item {item.number}, {item.item}: `ours` names no cell: {error}") from None
    name = f"**{item.item}**" if item.headline else item.item
    places = [f"`validate`: {row.check}" for row in lines]
    places += [f"`{file}::{test}`" if test else f"`{file}`" for file, test in item.files]
    cells = (
        str(item.number),
        name,
        item.status,
        item.kind,
        item.printed,
        ours,
        "<br>".join(places) or "-",
        item.reason or "-",
    )
    return "| " + " | ".join(cell.replace("|", "/") for cell in cells) + " |"


def text() -> str:
    """Return the page as the files and the table of the validation have it."""
    return page_text(load_papers(), checked_rows((TRUTH / "validation.md").read_text(encoding="utf-8")))


def main() -> int:
    """Write the page, or say that it is stale."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 where it is stale")
    options = parser.parse_args()
    try:
        new = text()
    except InputError as error:
        print(f"papers_page: {error}", file=sys.stderr)
        return 2
    if options.check:
        stale = not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != new
        print(f"{PAGE.name} is {'stale' if stale else 'as the files say'}")
        return int(stale)
    PAGE.write_text(new, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
