"""The diagnosis is a row of stages: values below, writers above, short functions."""

from __future__ import annotations

import ast
from pathlib import Path

import catheter_sim.diagnosis

FOLDER = Path(catheter_sim.diagnosis.__file__).parent
PACKAGE = "catheter_sim.diagnosis."
# Each file may import those before it in this list, and its neighbours in a line.
ORDER = (
    ("mapping", "notes", "nuisance", "thresholds"),
    ("trials",),
    ("dataset", "frame", "problem", "readings", "result"),
    ("document", "fit", "programmes", "residuals"),
    ("intervals", "noise", "words"),
    ("faults_of_columns", "pictures", "shapes", "workers"),
    ("variations",),
    ("comparison", "faults_of_readings", "faults_of_trials", "floor", "report", "verdict"),
    ("fitted_sets",),
    ("prepare", "varying", "pruning"),
    ("recording", "search"),
    ("choose", "hypotheses"),
    ("next_experiment", "probabilities"),
    ("conclude",),
    ("pipeline",),
    ("changes/differences",),
    ("changes/compare",),
    ("changes/series",),
    ("changes/report",),
)


def place_of(name: str) -> int:
    """Return the place in `ORDER` of a file by its path below the package, without suffix."""
    (found,) = [index for index, files in enumerate(ORDER) if name in files]
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


def test_functions_are_short() -> None:
    """No function of the diagnosis has more than 60 lines."""
    for path in FOLDER.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef):
                assert node.end_lineno is not None
                assert node.end_lineno - node.lineno < 60, f"{path.name}: {node.name}"
