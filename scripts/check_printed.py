"""Look up every figure of the items' `printed` column in the papers' texts, and keep digits and place.

    python scripts/check_printed.py TEXTS [-o docs/truth/printed_figures.csv]

TEXTS is a folder with a text a paper, named as the files in catheter_sim/validation/items. Of each item the
numbers of `printed` are taken, in their order; a number is found where the text has these digits standing by
themselves. Its place is the text's line. What cannot be found so is listed in `OTHERWISE`, with how it stands
there; exit status 1 where a number is neither found nor listed.
"""

from __future__ import annotations

import argparse
import csv
import re
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

import catheter_sim

ITEMS = Path(catheter_sim.__file__).parent / "validation" / "items"
OUT = Path(__file__).resolve().parent.parent / "docs" / "truth" / "printed_figures.csv"
COLUMNS = ("paper", "item", "figure", "line", "how")
_NUMBER = re.compile(r"(?<![\w.^])\d+(?:\.\d+)?(?:e-?\d+)?(?![\w]|\.\d)")
# Names of figures, tables, equations and sections are no figures.
_NAMES = re.compile(
    r"(Figs?|Tables?|Eqs?|Sections?|Algorithms?)\.? [\dIVX]+(\(?[a-zA-Z-]*\)?)?"
    r"|tan[h]?\^-1|[RAn]\d? ?(?==)|\d+[DA-F]\b|III-A|28F|R\^2"
)
# Figures that the text has otherwise: (paper, item, digits) and how.
OTHERWISE: Mapping[tuple[str, int, str], str] = {}


def figures(printed: str) -> list[str]:
    """Return the numbers of a `printed` column, names of figures and equations left out."""
    return _NUMBER.findall(_NAMES.sub(" ", printed))


def place(digits: str, text: str) -> int:
    """Return the first line on which these digits stand by themselves, 0 if none."""
    plain, _, power = digits.partition("e")
    wanted = rf"(?<![\d.]){re.escape(plain)}(?!\d|\.\d)"
    if power:
        wanted += rf".{{0,20}}10.{{0,6}}{re.escape(power.lstrip('-'))}"
    found = re.search(wanted, text)
    return text.count("\n", 0, found.start()) + 1 if found else 0


def rows(texts: Path) -> Iterator[dict[str, str]]:
    """Yield a row for each figure: paper, item, digits, line and how it was found; line "" where it was not.

    Raises:
        FileNotFoundError: a paper has no text in the folder.
    """
    for path in sorted(ITEMS.glob("*.toml")):
        text = (texts / f"{path.stem}.txt").read_text(encoding="utf-8", errors="replace")
        for item in tomllib.loads(path.read_text(encoding="utf-8"))["items"]:
            for digits in figures(item.get("printed", "-")):
                key = (path.stem, item["number"], digits)
                line = place(digits, text)
                how = "these digits" if line else OTHERWISE.get(key, "")
                values = (path.stem, str(item["number"]), digits, str(line or ""), how)
                yield dict(zip(COLUMNS, values, strict=True))


def main() -> int:
    """Write the table; return 1 where a figure is not in its paper."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("texts", type=Path, help="folder with a text a paper")
    parser.add_argument("-o", "--out", type=Path, default=OUT, help="CSV file")
    options = parser.parse_args()
    try:
        found = list(rows(options.texts))
    except FileNotFoundError as error:
        print(f"check_printed: {error.filename}: no such text", file=sys.stderr)
        return 2
    with options.out.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(found)
    missing = [row for row in found if not row["how"]]
    for row in missing:
        print(f"not in the text: {row['paper']}, item {row['item']}: {row['figure']}")
    print(f"{len(found) - len(missing)} of {len(found)} figures found")
    return int(bool(missing))


if __name__ == "__main__":
    sys.exit(main())
