"""Bring the rows of docs/truth/validation.md up to what `validate` wrote.

    python scripts/validation_page.py FOLDER [FOLDER ...] [--add PART ...] [--drop]

Each folder holds a `validation.json`. Rows that a file has are replaced, in their place. Of lines that have
no row yet those are added that contain a PART, behind the last row of their robot. Rows of the robots in the
files that no file has are named; with --drop they are taken out.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import astuple
from pathlib import Path
from typing import Any

from catheter_sim.validation.papers import checked

PAGE = Path(__file__).resolve().parent.parent / "docs" / "truth" / "validation.md"
START, END = "<!-- validation:", "<!-- validation ends"


def cells(line: Mapping[str, Any]) -> list[str]:
    """Return a line's cells: robot, check, ours, compared with, error, tolerance, kind, source."""
    return [line["robot"], line["quantity"], *astuple(checked(line))[1:]]


def updated(page: str, lines: Sequence[Mapping[str, Any]], parts: Sequence[str], drop: bool) -> str:
    """Return the page with the rows of `lines` replaced; see the head of this file."""
    top, rest = page.split(START)
    table, bottom = rest.split(END)
    old = table.strip().splitlines()
    head, rows = old[:3], [row for row in old[3:] if row.startswith("|")]
    new = {tuple(cells(line)[:2]): "| " + " | ".join(cells(line)) + " |" for line in lines}
    robots = {line["robot"] for line in lines}
    kept, seen = [], set()
    for row in rows:
        robot, check = (cell.strip() for cell in row.strip("|").split(" | ")[:2])
        if (robot, check) in new:
            kept.append(new[robot, check])
            seen.add((robot, check))
        elif robot in robots:
            print(f"no such line any more: {robot}: {check}", file=sys.stderr)
            kept += [] if drop else [row]
        else:
            kept.append(row)
    for (robot, check), row in new.items():
        if (robot, check) not in seen and any(part in f"{robot}: {check}" for part in parts):
            same = [k for k, other in enumerate(kept) if other.startswith(f"| {robot} |")]
            kept.insert(same[-1] + 1 if same else len(kept), row)
    return top + START + " " + "\n".join([*head, *kept]) + "\n" + END + bottom


def main() -> int:
    """Write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", nargs="+", type=Path, help="with a validation.json")
    parser.add_argument("--add", nargs="+", default=[], metavar="PART", help="lines to add")
    parser.add_argument("--drop", action="store_true", help="take out rows that no file has")
    options = parser.parse_args()
    files = [folder / "validation.json" for folder in options.folders]
    lines = [line for file in files for line in json.loads(file.read_text(encoding="utf-8"))["lines"]]
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(updated(page, lines, options.add, options.drop), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
