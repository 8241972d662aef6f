"""Write docs/truth/papers_item_by_item.md from catheter_sim/validation/items/*.toml.

    python scripts/papers_page.py [--check]

With --check nothing is written; the exit status is 1 where the page is not what the files say.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from catheter_sim.errors import InputError
from catheter_sim.validation.papers import STATUSES, Checked, Paper, PaperItem, load_papers, ours_of, row_of

TRUTH = Path(__file__).resolve().parent.parent / "docs" / "truth"
PAGE = TRUTH / "papers_item_by_item.md"

_COUNTS = "| paper | items | " + " | ".join(STATUSES) + " |"
_HEAD = (
    "| # | item | status | kind | printed | ours | where | what is missing, and why |\n" + "|---" * 8 + "|"
)
_TOP = """\
# The papers, item by item

This page has every figure, equation and claim of the five papers that the package rests on, beside what the
package gives. The notched wrist of York 2015 is not gone through item by item.

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

**Where** names checks of `validate` first, then files and tests. A check has its robot's name in front
([all checks](validation.md)). A figure of ours that `validate` prints is taken from there.
"""
_TOP_END = "\nA hyphen in `printed` says that the paper prints no figure of it."


def checked_rows(page: str) -> tuple[Checked, ...]:
    """Return the rows of the table of the validation in the text of its page."""
    text = page.split("<!-- validation:")[1].split("-->", 1)[1].split("<!-- validation ends")[0]
    lines = [line for line in text.strip().splitlines() if line.startswith("|")]
    rows = ([cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:])
    return tuple(Checked(f"{robot}: {check}", *others) for robot, check, *others in rows)


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
        yield f"\n## {paper.name}\n\n{_linked(paper)}\n"
        yield _HEAD
        for item in sorted(paper.items, key=lambda item: not item.headline):
            yield _row(item, rows)


def _linked(paper: Paper) -> str:
    link = f"[doi {paper.doi}](https://doi.org/{paper.doi})"
    return paper.reference.replace(f"doi {paper.doi}", link) if paper.doi else paper.reference


def _row(item: PaperItem, rows: Sequence[Checked]) -> str:
    lines = [row_of(check, rows) for check in item.checks]
    name = f"**{item.item}**" if item.headline else item.item
    places = [f"`{row.check}`" for row in lines]
    places += [f"`{file}::{test}`" if test else f"`{file}`" for file, test in item.files]
    cells = (
        str(item.number),
        name,
        item.status,
        item.kind,
        item.printed,
        ours_of(item, rows),
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
