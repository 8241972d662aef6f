"""The diagnosis is a row of stages: values below, writers above, short files and functions."""

from __future__ import annotations

import ast
from pathlib import Path

import catheter_sim.diagnosis

FOLDER = Path(catheter_sim.diagnosis.__file__).parent
PACKAGE = "catheter_sim.diagnosis."
# Each part may import those before it in this list, and itself. `report` holds the values of a result too,
# which others fill: they stand below everything that writes them.
VALUES = ("report/next_experiment", "report/result", "report/wording")
ORDER = (
    ("notes", "thresholds"),
    ("data",),
    VALUES,
    ("fitting",),
    ("base_frame",),
    ("data_faults",),
    ("residuals",),
    ("causes", "verdict"),
    ("next_experiment",),
    ("report",),
    ("stages",),
    ("pipeline",),
    ("best_experiment",),
    ("since",),
)


def place_of(name: str) -> int:
    """Return the place in `ORDER` of a file by its path below the package, without suffix."""
    (found,) = [
        index
        for index, parts in enumerate(ORDER)
        if name in parts or (name.partition("/")[0] in parts and name not in VALUES)
    ]
    return found


def test_imports_run_one_way() -> None:
    """A file imports only what stands before it, or beside it in its own part."""
    for path in FOLDER.rglob("*.py"):
        name = path.relative_to(FOLDER).with_suffix("").as_posix()
        if name.endswith("__init__"):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(PACKAGE):
                assert node.module is not None
                other = node.module.removeprefix(PACKAGE).replace(".", "/")
                assert place_of(other) <= place_of(name), f"{name} imports {other}"


def test_no_file_imports_itself_by_way_of_others() -> None:
    """Files can be taken away one by one, each after those that import it."""
    imports = {}
    for path in FOLDER.rglob("*.py"):
        name = path.relative_to(FOLDER).with_suffix("").as_posix()
        tree = ast.parse(path.read_text(encoding="utf-8"))
        imports[name] = {
            (node.module or "").removeprefix(PACKAGE).replace(".", "/")
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom)
        }
    while imports:
        free = [name for name in imports if not any(name in others for others in imports.values())]
        assert free, sorted(imports)
        for name in free:
            del imports[name]


def test_functions_and_files_are_short() -> None:
    """No function of the diagnosis has more than 60 lines, no file more than 300 but the thresholds'."""
    for path in FOLDER.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if path.name != "thresholds.py":
            assert text.count("\n") <= 300, path
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef):
                assert node.end_lineno is not None
                assert node.end_lineno - node.lineno < 60, f"{path.name}: {node.name}"
