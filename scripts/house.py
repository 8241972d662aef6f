"""Count how the package is laid out: files, lines, imports, names, and how far a reader has to walk.

    python scripts/house.py            # of this checkout
    python scripts/house.py ../old     # of another one

Walks follow calls by their names, from a public function through every function of the package that it may
call, each once, in the order of the calls. A return is a step into a folder that the walk had left. A path
to a call holds the functions of such a walk that lead to it; methods are found by the classes of what they
are called on, where assignments and annotations tell these.
"""

from __future__ import annotations

import argparse
import ast
import itertools
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

PACKAGE = "catheter_sim"
MOST_PRIVATE_ARGUMENTS, MOST_KERNEL_ARGUMENTS = 9, 12
STEPS = frozenset({"mj_step", "mj_step1", "mj_step2"})
Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class File:
    """A file of the package.

    Attributes:
        name: of the module, with dots.
        path: below the checkout.
        tree: its syntax.
        lines: how many.
    """

    name: str
    path: Path
    tree: ast.Module
    lines: int

    @property
    def folder(self) -> str:
        """Return its folder below the checkout."""
        return self.path.parent.as_posix()


class House:
    """The package of a checkout, read and not imported."""

    def __init__(self, root: Path) -> None:
        self.files: dict[str, File] = {}
        for path in sorted((root / PACKAGE).rglob("*.py")):
            below = path.relative_to(root)
            parts = below.with_suffix("").parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            text = path.read_text(encoding="utf-8")
            self.files[name] = File(name, below, ast.parse(text), text.count("\n"))

    @property
    def lines(self) -> int:
        """Return all lines."""
        return sum(file.lines for file in self.files.values())

    @property
    def import_lines(self) -> int:
        """Return the lines of import statements."""
        return sum(
            (node.end_lineno or node.lineno) - node.lineno + 1
            for file in self.files.values()
            for node in ast.walk(file.tree)
            if isinstance(node, ast.Import | ast.ImportFrom)
        )

    @property
    def depth(self) -> int:
        """Return the levels of the deepest folder, the package's own being the first."""
        return max(len(file.path.parent.parts) for file in self.files.values())

    def imported(self, file: File) -> set[str]:
        """Return the modules of the package that a file imports as it is loaded."""
        found: set[str] = set()
        for node in file.tree.body:
            if isinstance(node, ast.ImportFrom) and node.module in self.files:
                for item in node.names:
                    inner = f"{node.module}.{item.name}"
                    found.add(inner if inner in self.files else node.module)
            elif isinstance(node, ast.Import):
                found |= {item.name for item in node.names if item.name in self.files}
        return found - {file.name}

    @cached_property
    def circles(self) -> list[list[str]]:
        """Return groups of files that import one another, as they are loaded."""
        waiting = {name: self.imported(file) for name, file in self.files.items()}
        while free := [name for name, needs in waiting.items() if not needs & set(waiting)]:
            for name in free:
                del waiting[name]
        return [sorted(waiting)] if waiting else []

    @property
    def imports_tests(self) -> list[str]:
        """Return files that import what lies in `tests`."""
        outside = {"hidden_effects", "tests"}
        return [
            file.name
            for file in self.files.values()
            for node in ast.walk(file.tree)
            if (isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in outside)
            or (
                isinstance(node, ast.Import)
                and any(item.name.split(".")[0] in outside for item in node.names)
            )
        ]

    @property
    def classes_twice(self) -> dict[str, int]:
        """Return names of classes that are defined more than once, with how often."""
        names = Counter(
            node.name
            for file in self.files.values()
            for node in ast.walk(file.tree)
            if isinstance(node, ast.ClassDef)
        )
        return {name: count for name, count in sorted(names.items()) if count > 1}

    @property
    def long_signatures(self) -> tuple[list[str], list[str]]:
        """Return private functions and kernels that take too many arguments."""
        private, kernels = [], []
        for file in self.files.values():
            for node in ast.walk(file.tree):
                if not isinstance(node, Function):
                    continue
                taken = node.args
                count = len(taken.posonlyargs) + len(taken.args) + len(taken.kwonlyargs)
                written = " ".join(ast.unparse(item) for item in node.decorator_list)
                if any(word in written for word in ("compiled", "njit", "wp.", "inlined")):
                    if count > MOST_KERNEL_ARGUMENTS:
                        kernels.append(f"{file.name}.{node.name}: {count}")
                elif is_private(node, self.owners.get(id(node), "")) and count > MOST_PRIVATE_ARGUMENTS:
                    private.append(f"{file.name}.{node.name}: {count}")
        return private, kernels

    @cached_property
    def functions(self) -> Mapping[str, tuple[File, Function]]:
        """Return functions and methods by module and name; a method also by its own name alone, if unique."""
        found: dict[str, tuple[File, Function]] = {}
        methods: dict[str, list[tuple[File, Function]]] = {}
        for file in self.files.values():
            for node in file.tree.body:
                if isinstance(node, Function):
                    found[f"{file.name}.{node.name}"] = (file, node)
                elif isinstance(node, ast.ClassDef):
                    for item in node.body:
                        if isinstance(item, Function):
                            found[f"{file.name}.{node.name}.{item.name}"] = (file, item)
                            methods.setdefault(item.name, []).append((file, item))
                    if f"{file.name}.{node.name}.__init__" in found:
                        found[f"{file.name}.{node.name}"] = found[f"{file.name}.{node.name}.__init__"]
        found |= {f".{name}": items[0] for name, items in methods.items() if len(items) == 1}
        return found

    def names_in(self, file: File, inside: ast.AST) -> Mapping[str, str]:
        """Return what names mean in a function or a class: those that its file and itself import."""
        names: dict[str, str] = {}
        for node in (*ast.walk(inside), *file.tree.body):
            if isinstance(node, ast.ImportFrom) and node.module:
                names |= {item.asname or item.name: f"{node.module}.{item.name}" for item in node.names}
        return names

    def calls(self, file: File, function: Function) -> Iterator[tuple[File, Function]]:
        """Yield the package's functions that a function calls by name, in the order of its text."""
        names = self.names_in(file, function)
        asked = [node for node in ast.walk(function) if isinstance(node, ast.Name | ast.Attribute)]
        called = {id(node.func) for node in ast.walk(function) if isinstance(node, ast.Call)}
        for node in sorted(asked, key=lambda node: (node.lineno, node.col_offset)):
            if isinstance(node, ast.Name):
                wanted = names.get(node.id, f"{file.name}.{node.id}")
            elif isinstance(node.value, ast.Name) and node.value.id in names:
                wanted = f"{names[node.value.id]}.{node.attr}"
            else:
                wanted = f".{node.attr}" if id(node) in called else ""
            if wanted in self.functions:
                yield self.functions[wanted]

    @cached_property
    def classes(self) -> Mapping[str, tuple[File, ast.ClassDef]]:
        """Return classes by module and name."""
        return {
            f"{file.name}.{node.name}": (file, node)
            for file in self.files.values()
            for node in file.tree.body
            if isinstance(node, ast.ClassDef)
        }

    @cached_property
    def owners(self) -> Mapping[int, str]:
        """Return the class of each method, by the method's node."""
        return {id(item): name for name, (_, node) in self.classes.items() for item in node.body}

    def method(self, owner: str, name: str) -> tuple[File, Function] | None:
        """Return a method of a class or of what it inherits from."""
        if f"{owner}.{name}" in self.functions:
            return self.functions[f"{owner}.{name}"]
        if owner not in self.classes:
            return None
        file, node = self.classes[owner]
        names = self.names_in(file, node)
        inherited = (self.method(self.class_meant(file, base, names), name) for base in node.bases)
        return next((item for item in inherited if item is not None), None)

    def class_meant(self, file: File, written: ast.expr | None, names: Mapping[str, str]) -> str:
        """Return the package's class that an annotation or a base names; "": none."""
        while isinstance(written, ast.Subscript | ast.BinOp):
            written = written.value if isinstance(written, ast.Subscript) else written.left
        if not isinstance(written, ast.Name):
            return ""
        meant = names.get(written.id, f"{file.name}.{written.id}")
        return meant if meant in self.classes else ""

    def calls_of_methods(self, file: File, function: Function) -> Iterator[tuple[File, Function]]:
        """Yield the methods that a function uses, by the classes of its arguments and variables."""
        names, taken = self.names_in(file, function), function.args
        classes = {
            item.arg: self.class_meant(file, item.annotation, names)
            for item in (*taken.posonlyargs, *taken.args, *taken.kwonlyargs)
        }
        classes["self"] = self.owners.get(id(function), "")

        def class_of(value: ast.expr) -> str:
            if isinstance(value, ast.Name):
                return classes.get(value.id, "")
            if not isinstance(value, ast.Call):
                return ""
            asked = value.func
            if isinstance(asked, ast.Name):
                meant = names.get(asked.id, f"{file.name}.{asked.id}")
                called = None if meant in self.classes else self.functions.get(meant)
                if called is None:
                    return meant if meant in self.classes else ""
            elif isinstance(asked, ast.Attribute):
                called = self.method(class_of(asked.value), asked.attr)
            else:
                called = None
            return (
                ""
                if called is None
                else self.class_meant(called[0], called[1].returns, self.names_in(*called))
            )

        for node in ast.walk(function):
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                classes[node.targets[0].id] = class_of(node.value)
            elif isinstance(node, ast.withitem) and isinstance(node.optional_vars, ast.Name):
                classes[node.optional_vars.id] = class_of(node.context_expr)
        for node in ast.walk(function):
            if isinstance(node, ast.Attribute):
                found = self.method(class_of(node.value), node.attr)
                if found is not None:
                    yield found

    def path(self, start: str, ends: frozenset[str]) -> list[tuple[File, Function]]:
        """Return the functions on a way of calls from one to where an attribute of such a name is used."""
        found: dict[int, tuple[File, Function]] = {}
        callers: dict[int, list[int]] = {}
        waiting = [self.functions[start]]
        while waiting:
            file, function = waiting.pop()
            if id(function) in found:
                continue
            found[id(function)] = (file, function)
            for called in (*self.calls(file, function), *self.calls_of_methods(file, function)):
                callers.setdefault(id(called[1]), []).append(id(function))
                waiting.append(called)
        leading = {
            key
            for key, (_, function) in found.items()
            if any(isinstance(node, ast.Attribute) and node.attr in ends for node in ast.walk(function))
        }
        newest = list(leading)
        while newest:
            newest = [
                key
                for key in dict.fromkeys(itertools.chain(*(callers.get(key, ()) for key in newest)))
                if key not in leading
            ]
            leading.update(newest)
        return [item for key, item in found.items() if key in leading]

    def walk(self, start: str) -> list[tuple[File, Function]]:
        """Return the functions that a function may call, itself first, each once, in the order of calls."""
        found: list[tuple[File, Function]] = []
        waiting = [self.functions[start]]
        seen: set[int] = set()
        while waiting:
            file, function = waiting.pop()
            if id(function) in seen:
                continue
            seen.add(id(function))
            found.append((file, function))
            waiting += reversed(list(self.calls(file, function)))
        return found


def is_private(function: Function, owner: str) -> bool:
    """Return whether a function is none of the public ones; a constructor is as public as its class."""
    name = owner.rsplit(".", 1)[-1] if function.name == "__init__" else function.name
    return name.startswith("_")


def returns(walk: list[tuple[File, Function]]) -> int:
    """Return how often a walk comes back to a folder that it had left."""
    count, left = 0, set[str]()
    for (before, _), (after, _) in itertools.pairwise(walk):
        if before.folder != after.folder:
            left.add(before.folder)
            count += after.folder in left
    return count


def main() -> int:
    """Print the counts; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    here = Path(__file__).resolve().parents[1]
    parser.add_argument("checkout", nargs="?", type=Path, default=here, metavar="DIR")
    root: Path = parser.parse_args().checkout
    if not (root / PACKAGE).is_dir():
        print(f"house: error: {root}: no {PACKAGE} there", file=sys.stderr)
        return 2
    house = House(root)
    whole = sum(
        path.read_text(encoding="utf-8").count("\n")
        for part in (PACKAGE, "tests", "scripts")
        for path in (root / part).rglob("*.py")
    )
    private, kernels = house.long_signatures
    print(f"files {len(house.files)}, lines {house.lines}, of all Python files {whole}")
    print(
        f"lines of imports {100.0 * house.import_lines / house.lines:.1f} %, levels of folders {house.depth}"
    )
    print(f"circles {house.circles or 'none'}, files that import tests {house.imports_tests or 'none'}")
    print(f"class names defined more than once: {len(house.classes_twice)}")
    print(f"private functions of more than {MOST_PRIVATE_ARGUMENTS} arguments: {len(private)}")
    print(f"compiled functions of more than {MOST_KERNEL_ARGUMENTS}: {len(kernels)}")
    for start in ("public.runs.simulate", "public.diagnoses.diagnose"):
        walk = house.walk(f"{PACKAGE}.{start}")
        files, folders = {file.name for file, _ in walk}, {file.folder for file, _ in walk}
        print(
            f"walk from {start}: {len(walk)} functions in {len(files)} files and {len(folders)} folders, "
            f"{returns(walk)} returns"
        )
    path = house.path(f"{PACKAGE}.public.runs.simulate", STEPS)
    print(
        f"path from public.runs.simulate to mj_step: {len(path)} functions in "
        f"{len({file.name for file, _ in path})} files"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
