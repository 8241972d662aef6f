"""Every number by which a diagnosis decides stands in the file that needs it, with its unit and reason."""

from __future__ import annotations

import ast
import itertools
import re
from pathlib import Path

import catheter_sim.diagnosis

FOLDER = Path(catheter_sim.diagnosis.__file__).parent
PACKAGE = FOLDER.parent
SHARED = "thresholds.py"
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
    "shapes.py": {"_PER_ERROR_MM", "_PER_MM", "_PER_S", "_ROUNDS"},
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


def test_thresholds_say_their_unit_what_they_decide_and_why() -> None:
    """The text after each: "[unit] what it decides. Why: the reason."; others are listed as no thresholds."""
    silent: dict[str, set[str]] = {}
    found = 0
    for path in FOLDER.rglob("*.py"):
        body = ast.parse(path.read_text(encoding="utf-8")).body
        texts = {before.lineno: after for before, after in itertools.pairwise(body)}
        for name, node in constants(path).items():
            after = texts.get(node.lineno)
            text = ""
            if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
                text = " ".join(str(after.value.value).split())
            if re.fullmatch(r"\[[^\]]+\] .*\bWhy: .+\.", text):
                found += 1
            else:
                silent.setdefault(path.relative_to(FOLDER).as_posix(), set()).add(name)
    assert silent == NO_THRESHOLDS
    assert found > 200


def test_thresholds_stand_where_they_are_used() -> None:
    """One that a single file needs stands in it and is used there; what files share, two of them use."""
    used = {path: names_used(path) for path in PACKAGE.rglob("*.py")}
    for path in FOLDER.rglob("*.py"):
        for name in constants(path):
            if path.name == SHARED:
                assert sum(name in names for other, names in used.items() if other != path) > 1, name
            elif not name.startswith("_"):
                assert name in used[path], f"{path.name}: {name}"


def names_used(path: Path) -> set[str]:
    """Return the names that a file reads."""
    return {
        node.id
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
    }
