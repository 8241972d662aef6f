"""What each paper prints, item by item, beside what this package gives: one file a paper in `items`.

A figure of ours that `validate` prints is not typed a second time: an item names the check, and takes the
figure from it.
"""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from catheter_sim.errors import InputError, unknown
from catheter_sim.validation.lines import KINDS, Line

FOLDER = Path(__file__).parent / "items"
STATUSES = {
    "F": "works; tied to a printed number or a closed form",
    "I": "works; checked against a second model or independent code, no printed number",
    "P": "partial, for the reason beside it: weak, circular, or far from print",
    "M": "missing",
    "X": "not possible without the authors' measurements",
}
NEED_A_REASON = ("P", "M", "X")
NEED_A_PLACE = ("F", "I", "P")
CHECK = "validate: "  # how a place names a check of `validate`
_KEYS = {"number", "item", "status", "kind", "printed", "ours", "where", "reason", "headline"}
_DOI = re.compile(r"\bdoi (?P<doi>10\.\S+?)\.?$")


@dataclass(frozen=True)
class Checked:
    """One line of a validation as the documentation's table has it, as text.

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


def checked(line: Mapping[str, Any]) -> Checked:
    """Return a line, by the names of `Line`, as a row of the table."""
    compared = line["published"] if line["published"] is not None else line["analytic"]
    error = float("nan") if line["error"] is None else line["error"]
    unit = "" if line["unit"] == "-" else f" {line['unit']}"
    return Checked(
        check=f"{line['robot']}: {line['quantity']}",
        ours="-" if line["ours"] is None else f"{line['ours']:.3g}",
        published=line["said"] or ("-" if compared is None else f"{compared:.3g}"),
        error=f"{error:.1g}{unit}",
        tolerance="-" if line["tolerance"] is None else f"{line['tolerance']:.3g}{unit}",
        kind=line["kind"],
        source=line["source"],
    )


@dataclass(frozen=True)
class PaperItem:
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
        key: its file's name, without the ending.
        name: short, as the page's headings have it.
        reference: in full, with its DOI last.
        items: in their order.
    """

    key: str
    name: str
    reference: str
    items: tuple[PaperItem, ...]

    @property
    def doi(self) -> str:
        """The DOI, "" where the reference has none."""
        found = _DOI.search(self.reference)
        return found["doi"] if found else ""

    @property
    def robots(self) -> tuple[str, ...]:
        """The robots whose checks its items name, in their order."""
        checks = (check for item in self.items for check in item.checks)
        return tuple(dict.fromkeys(check.partition(":")[0] for check in checks))

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
        found.append((about["year"], Paper(path.stem, about["name"], about["reference"], items)))
    return tuple(paper for _, paper in sorted(found, key=lambda pair: pair[0]))


def load_paper(key: str) -> Paper:
    """Return one paper.

    Raises:
        InputError: there is none of that name.
    """
    papers = {paper.key: paper for paper in load_papers()}
    if key not in papers:
        raise unknown("paper", key, papers)
    return papers[key]


def _item(row: Mapping[str, Any], place: str) -> PaperItem:
    for key in row:
        if key not in _KEYS:
            raise unknown("key", key, sorted(_KEYS), place)
    item = PaperItem(
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


def ours_of(item: PaperItem, rows: Sequence[Checked]) -> str:
    """Return what this package gives for an item, with the figures of the validation's rows.

    Raises:
        InputError: the item names a row or a cell that there is not.
    """
    lines = [row_of(check, rows) for check in item.checks]
    try:
        return item.ours.format(line=lines)
    except (IndexError, AttributeError, KeyError) as error:
        raise InputError(f"item {item.number}, {item.item}: `ours` names no cell: {error}") from None


def printed_and_ours(paper: Paper, lines: Sequence[Line]) -> list[dict[str, str]]:
    """Return each item that prints something, what is printed, ours by `lines` and its kind, headlines first.

    What rests on a line that was not computed says so.
    """
    rows = [checked(asdict(line)) for line in lines]
    found = []
    for item in sorted(paper.items, key=lambda item: not item.headline):
        if item.printed == "-":
            continue
        try:
            ours = ours_of(item, rows)
        except InputError as error:
            ours = f"not computed: {error}"
        row = {
            "number": str(item.number),
            "item": item.item,
            "printed": item.printed,
            "ours": ours,
            "kind": item.kind,
            "reason": item.reason,
        }
        found.append({name: text.replace("`", "") for name, text in row.items()})
    return found
