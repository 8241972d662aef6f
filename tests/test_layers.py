"""The tree shows the order of knowledge: imports run one way, and only a kind's folder knows its robots.

The lists of what is still permitted only shrink: whoever mends an entry takes it out.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from catheter_sim.robots import KINDS

pytestmark = pytest.mark.xdist_group("layers")  # whose worker reads every file once

ROOT = Path(__file__).parent.parent / "catheter_sim"
FILES = tuple(sorted(ROOT.rglob("*.py")))

# Lower may not import from higher; packages of one rank may know each other.
RANK = {
    **dict.fromkeys(("arrays", "errors", "units", "tables", "files", "platforms", "progress"), 0),
    **dict.fromkeys(("page", "resources"), 0),
    "core": 1,
    **dict.fromkeys(("mechanics", "mjcf"), 2),
    "robots": 3,
    **dict.fromkeys(("channels", "catalogue", "effects"), 4),
    **dict.fromkeys(("modelling", "simulation", "theory"), 5),
    **dict.fromkeys(
        ("pictures", "planning", "controllers", "envs", "diagnosis", "anatomy", "procedure", "viewer"), 6
    ),
    **dict.fromkeys(("examples", "exporting", "foreign", "gpu"), 6),
    **dict.fromkeys(("importing", "validation", "speed", "public", "lab", "closed_loop"), 7),
    **dict.fromkeys(("cli", "__main__", "__init__"), 8),
}
SPECS = "ContinuumRobot|RollingRobot|CatheterRobot|NotchedTubeRobot"

HOLDERS = (ast.stmt, ast.excepthandler, ast.match_case)  # what statements stand in

# Still permitted: importer -> what it imports from above, or from another kind.
UPWARD: dict[str, set[str]] = {
    "diagnosis/workers.py": {"__init__"},
}

MOST_LINES = 1200  # of a file: a topic that takes more is two


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


def top(module: str) -> str:
    part = module.split(".")[1] if "." in module else "__init__"
    return "__init__" if part.startswith("__") else part


def kind_of(module: str) -> str:
    parts = module.split(".")
    return parts[2] if parts[1:2] == ["robots"] and len(parts) > 3 else ""


def imports(node: ast.AST) -> Iterator[str]:
    """Yield the package's modules that are imported below `node`, but for mypy alone."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, HOLDERS):  # no import stands within an expression
            continue
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            continue
        if isinstance(child, ast.ImportFrom) and (child.module or "").startswith("catheter_sim"):
            for item in child.names:
                yield f"{child.module}.{item.name}"
        elif isinstance(child, ast.Import):
            yield from (item.name for item in child.names if item.name.startswith("catheter_sim"))
        else:
            yield from imports(child)


def upward(path: Path) -> set[str]:
    name = name_of(path)
    own = name.split("/")[0].removesuffix(".py")
    folder = name.split("/")[1] if name.startswith("robots/") and name.count("/") > 1 else ""
    found = set()
    for module in imports(tree_of(path)):
        if RANK[top(module)] > RANK[own]:
            found.add(top(module))
        elif folder and kind_of(module) not in ("", folder):
            found.add(f"robots.{kind_of(module)}")
    return found


def test_every_part_has_a_rank() -> None:
    """A new package is given its place."""
    parts = {name_of(path).split("/")[0].removesuffix(".py") for path in FILES}
    assert parts <= set(RANK)


@pytest.mark.slow
def test_imports_run_one_way() -> None:
    """Nothing imports from above, and no kind imports another's folder."""
    wrong = {name_of(path): upward(path) - UPWARD.get(name_of(path), set()) for path in FILES}
    assert {name: modules for name, modules in wrong.items() if modules} == {}


def matching(pattern: str, outside: tuple[str, ...]) -> set[str]:
    """Return the files in which a line matches, comments left out, but for some folders and files."""
    found = set()
    for path in FILES:
        code = re.sub(r"#.*", "", path.read_text())
        if not name_of(path).startswith(outside) and re.search(pattern, code):
            found.add(name_of(path))
    return found


def test_nobody_asks_of_which_class_a_robot_is() -> None:
    """Outside its folder a robot's class is tested nowhere; its kind answers."""
    tests = rf"(isinstance\([^)]*({SPECS})|require_(continuum|no_catheter|rolling|catheter)\()"
    assert matching(tests, tuple(f"robots/{kind}/" for kind in KINDS)) == set()


def test_nothing_dispatches_on_a_robots_class() -> None:
    """`singledispatch` has no list of what a kind must answer."""
    assert matching("singledispatch", ()) == set()


def test_nobody_compares_an_actuation() -> None:
    """What an input column is, its drive says."""
    compared = (
        r"(==|!=)\s*\"(tension|displacement)\"|(?<!for )actuation (==|!=|in) |(==|!=) [\w.]*actuation\b"
    )
    assert matching(compared, ("robots/", "channels.py", "core/inputs.py")) == set()


def test_a_file_is_one_topic() -> None:
    """None has more lines than a topic takes."""
    lines = {name_of(path): len(path.read_text().splitlines()) for path in FILES}
    assert {name: count for name, count in lines.items() if count > MOST_LINES} == {}


@pytest.mark.slow
def test_functions_take_few_arguments() -> None:
    """At most 12, but for compiled kernels."""
    found = set()
    for path in FILES:
        if re.search("kernel|rod_balance|rod_sections|^gpu/", name_of(path)):
            continue
        for node in ast.walk(tree_of(path)):
            if not isinstance(node, ast.FunctionDef):
                continue
            arguments = node.args
            count = len(arguments.posonlyargs) + len(arguments.args) + len(arguments.kwonlyargs)
            written = [ast.unparse(item) for item in node.decorator_list] if count > 12 else []
            if count > 12 and not any("compiled" in item or "njit" in item for item in written):
                found.add(f"{name_of(path)}: {node.name}")
    assert found == set()


def test_an_import_from_above_is_seen() -> None:
    """The lines above would notice a wrong import: by either form of statement, inside a function, too."""
    for line in ("from catheter_sim.cli import main", "import catheter_sim.cli.main"):
        tree = ast.parse(f"def late():\n    {line}\n")
        (module,) = imports(tree)
        assert RANK[top(module)] > RANK["robots"]
    hidden = ast.parse("if TYPE_CHECKING:\n    from catheter_sim.cli import main\n")
    assert not list(imports(hidden))
    assert kind_of("catheter_sim.robots.rolling.spec.Rod") == "rolling"
    assert kind_of("catheter_sim.robots.kind_of") == ""
