"""Write docs/truth/papers_item_by_item.md from catheter_sim/validation/items/*.toml.

    python scripts/papers_page.py [--check]

With --check nothing is written; the exit status is 1 where the page is not what the files say.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from catheter_sim.errors import InputError
from catheter_sim.validation.report import checked_rows, load_papers, page_text

TRUTH = Path(__file__).resolve().parent.parent / "docs" / "truth"
PAGE = TRUTH / "papers_item_by_item.md"


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
