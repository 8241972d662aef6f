"""Write docs/truth/tip_tables.md: Tables III and IV of Nayar 2022 by column, beside both sets.

    python scripts/tip_tables.py [VALIDATED]

VALIDATED is a folder into which `validate mitral_transseptal` wrote `mitral_tables.csv`; it is kept as
docs/truth/tip_tables.csv. Without it the page is written from the kept file.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from catheter_sim.validation.mitral_tables import COLUMNS, TABLES

TRUTH = Path(__file__).resolve().parent.parent / "docs" / "truth"
KEPT, PAGE = TRUTH / "tip_tables.csv", TRUTH / "tip_tables.md"
_TOP = """\
# Tip errors of the transseptal catheter, by column

Tables III and IV of Nayar 2022 print how far four models' tips are off, as RMSE in mm. Here they stand
beside ours for two sets:

- `@tube`: the tip is 10.5 mm beyond the bending joint. Table I's two modules give this length, and the
  nominal robot uses it.
- `@rigid_end`: the tip is 20 mm beyond the bending joint. The paper prints "a rigid distal end length of
  20 mm". Its tool frame "is attached to the end tip of the robot".

That the measured point is this end tip is inferred. Where on the holder the tracker sat is not printed.

The paper prints no trajectory. Ours are:

- *chosen*: a trajectory that we chose
- *fitted*: the same trajectory with one amplitude, fitted to PK's 3D error at no advance. This predicts the
  other rows and columns of PK and PI.

A cell is "none" where no amplitude gives that error. MK and hybrid know the dead-bands of the robot itself,
so they predict nothing.
"""


def page(rows: Sequence[Mapping[str, str]]) -> Iterator[str]:
    """Yield the page's lines."""
    yield _TOP
    for path, (title, _) in TABLES.items():
        printed = [row for row in rows if row["path"] == path and row["printed"]]
        yield f"## {title}, {path} path\n"
        head = [f"{name} {how}" for name in ("@tube", "@rigid_end") for how in ("chosen", "fitted")]
        yield "| advance, model, column | printed | " + " | ".join(head) + " | kind |"
        yield "|---" * (3 + len(head)) + "|"
        by_place = {(row["set"], row["advance_mm"], row["model"], row["column"]): row for row in printed}
        for name, advance, model, column in by_place:
            if name != "@tube":
                continue
            found = [by_place[which, advance, model, column] for which in ("@tube", "@rigid_end")]
            cells = [row[how] or "none" for row in found for how in ("chosen", "fitted")]
            place = f"{advance} mm, {model}, {column}"
            yield "| " + " | ".join([place, found[0]["printed"], *cells, found[0]["kind"]]) + " |"
        yield "\nHow far the predicted rows are off, on average (and at most):\n"
        yield "| set | " + " | ".join(COLUMNS) + " |"
        yield "|---" * (1 + len(COLUMNS)) + "|"
        for name in ("@tube", "@rigid_end"):
            predicted = [row for row in printed if row["set"] == name and row["kind"] == "predicted"]
            yield f"| {name} | {' | '.join(_off(predicted))} |"
        if any(not row["fitted"] for row in printed):
            yield f"\n{_NOTHING_PREDICTED}"
        yield ""


_NOTHING_PREDICTED = (
    'A set with "none" predicts nothing, since no amplitude gives PK\'s printed error at no advance.'
)


def _off(rows: Sequence[Mapping[str, str]]) -> list[str]:
    """Return how far the rows of one set are off, by column; "none" where nothing is predicted."""
    if any(not row["fitted"] for row in rows):
        return ["none"] * len(COLUMNS)
    told = []
    for column in COLUMNS:
        off = [
            abs(float(row["fitted"]) / float(row["printed"]) - 1.0) for row in rows if row["column"] == column
        ]
        told.append(f"{100.0 * sum(off) / len(off):.0f} % ({100.0 * max(off):.0f} %)")
    return told


def read(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table of both sets."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def main() -> int:
    """Keep the table and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("validated", nargs="?", type=Path, help="folder with mitral_tables.csv")
    options = parser.parse_args()
    if options.validated is not None:
        KEPT.write_text(
            (options.validated / "mitral_tables.csv").read_text(encoding="utf-8"), encoding="utf-8"
        )
    PAGE.write_text("\n".join(page(read(KEPT))).rstrip("\n") + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
