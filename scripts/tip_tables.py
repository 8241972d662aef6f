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

Nayar 2022, Tables III and IV: RMSE of four models' tips, in mm, printed, and ours for two sets. `@tube` has
its tip 10.5 mm beyond the bending joint, as Table I's two modules give it (the nominal robot's reading).
`@rigid_end` has it at 20 mm: "a rigid distal end length of 20 mm" is printed, and the tool frame "is attached
to the end tip of the robot". That the measured point is that end is inferred: where on the holder the tracker
sat is not printed.

No trajectory is printed. *Chosen*: ours along one that was chosen. *Fitted*: the same with one amplitude,
fitted to PK's 3D error at no advance; the other rows and columns of PK and PI are then predicted. MK and
hybrid know the dead-bands of the very robot, and are no predictions. "none": no amplitude gives that error.
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
        yield ""
        for name in ("@tube", "@rigid_end"):
            yield _summary(
                name, [row for row in printed if row["set"] == name and row["kind"] == "predicted"]
            )
        yield ""


def _summary(name: str, rows: Sequence[Mapping[str, str]]) -> str:
    if any(not row["fitted"] for row in rows):
        return (
            f"- `{name}`: no amplitude gives PK's printed error at no advance, so that nothing is predicted."
        )
    told = []
    for column in COLUMNS:
        off = [
            abs(float(row["fitted"]) / float(row["printed"]) - 1.0) for row in rows if row["column"] == column
        ]
        told.append(f"{column} {100.0 * sum(off) / len(off):.0f} % ({100.0 * max(off):.0f} % at most)")
    return f"- `{name}`: predicted rows off on average by: {', '.join(told)}."


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
