"""Every number by which a diagnosis decides stands in one file, with its unit and its reason."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import catheter_sim.diagnosis
from catheter_sim.diagnosis import thresholds

FOLDER = Path(catheter_sim.diagnosis.__file__).parent
OWN = "thresholds.py"
# What decides nothing: factors between units, sizes of files and pictures, waiting times, scales of numbers.
NO_THRESHOLDS = {
    "document.py": {"_DIGITS"},
    "faults_of_columns.py": {"INPUT_FACTORS", "METRES", "MISREAD", "OUTPUT_FACTORS"},
    "frame.py": {"_MM_PER_M"},
    "mapping.py": {"MAX_RAW_ROWS", "SECONDS", "UNITS", "_HEAD_ROWS", "_MOST_EVERY"},
    "noise.py": {"_MAD_TO_SIGMA"},
    "nuisance.py": {"_RANGE_PARTS", "_SCALE"},
    "pictures.py": {
        "_DOTS",
        "_LARGEST_HEIGHT",
        "_LEAST_HEIGHT",
        "_MOST_COLUMNS",
        "_MOST_LINES",
        "_MOST_POINTS",
        "_WIDTH",
    },
    "programmes.py": {"_LOOP", "_PULL"},
    "readings.py": {"_DIGITS"},
    "report.py": {"_LONGEST_NAME", "_MOST_CANDIDATES"},
    "trials.py": {"_ALIKE", "_LOADS_ALIKE", "_MOST_LISTED", "_MOST_NEAREST"},
    "words.py": {"_MOST_CHECKS"},
    "workers.py": {"_LARGEST_BYTES", "_LONGEST_WAIT_S", "_ROUNDS"},
}


def constants(path: Path) -> dict[str, ast.stmt]:
    """Return the module-level constants of a file that hold a number, by name."""
    found: dict[str, ast.stmt] = {}
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        names = [item.id for target in targets for item in ast.walk(target) if isinstance(item, ast.Name)]
        numbers = [
            item
            for item in ast.walk(node.value)
            if isinstance(item, ast.Constant)
            and isinstance(item.value, int | float)
            and not isinstance(item.value, bool)
        ]
        found |= {name: node for name in names if numbers and name == name.upper()}
    return found


def test_no_other_file_holds_a_threshold() -> None:
    """A constant that holds a number stands in `thresholds`, or is listed here as none."""
    elsewhere: dict[str, set[str]] = {}
    for path in FOLDER.rglob("*.py"):
        name = path.relative_to(FOLDER).as_posix()
        if name != OWN and constants(path):
            elsewhere[name] = set(constants(path))
    assert elsewhere == NO_THRESHOLDS


def test_thresholds_say_their_unit_what_they_decide_and_why() -> None:
    """The text after each constant: "[unit] what it decides. Why: the reason."."""
    path = FOLDER / OWN
    body = ast.parse(path.read_text(encoding="utf-8")).body
    names = list(constants(path))
    assert len(names) > 100
    for name in names:
        after = body[body.index(next(node for node in body if is_assignment_of(node, name))) + 1]
        assert isinstance(after, ast.Expr), name
        assert isinstance(after.value, ast.Constant), name
        text = " ".join(str(after.value.value).split())
        assert re.fullmatch(r"\[[^\]]+\] .*\bWhy: .+\.", text), f"{name}: {text}"


def is_assignment_of(node: ast.stmt, name: str) -> bool:
    """Return whether a statement gives a value to `name`."""
    return isinstance(node, ast.Assign) and any(
        isinstance(target, ast.Name) and target.id == name for target in node.targets
    )


def test_every_threshold_is_used() -> None:
    """By a file of the diagnosis other than their own."""
    words: set[str] = set()
    for path in FOLDER.rglob("*.py"):
        if path.name != OWN:
            words.update(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    unused = [
        name
        for name in vars(thresholds)
        if name == name.upper() and not name.startswith("_") and name not in words
    ]
    assert unused == []
