"""Count how the package is laid out: files, lines, imports, names, and how far a reader has to walk.

    python scripts/house.py            # of this checkout
    python scripts/house.py ../old     # of another one

Walks follow calls by their names, from a public function through every function of the package that it may
call, each once, in the order of the calls. Methods are found by the classes of what they are called on, where
assignments and annotations tell these; else by their name, if only one class has it and none of Python's own.
A return is a step into a folder that the walk had left. A path to a call holds the functions of such a walk
that lead to it.
"""

from __future__ import annotations

import argparse
import ast
import builtins
import itertools
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from io import StringIO
from pathlib import Path

PACKAGE = "catheter_sim"
MOST_PRIVATE_ARGUMENTS, MOST_KERNEL_ARGUMENTS = 9, 12
STEPS = frozenset({"mj_step", "mj_step1", "mj_step2"})
Function = ast.FunctionDef | ast.AsyncFunctionDef
ELSEWHERE = "?"  # a class that is none of the package's
ARRAY = f"{PACKAGE}.arrays.Array"
UNKNOWN = frozenset({"typing.Any", "object", "collections.abc.Callable"})  # what may hold the package's, too
LITERALS = (ast.Constant, ast.JoinedStr, ast.List, ast.Dict, ast.Set, ast.Tuple, ast.ListComp, ast.DictComp)
OF_PYTHON = frozenset(
    name for kind in (str, bytes, list, tuple, dict, set, Path, StringIO) for name in dir(kind)
)


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
        self.names: dict[int, dict[str, str]] = {}  # `names_in`, by what they stand in
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
        if id(inside) in self.names:
            return self.names[id(inside)]
        names = self.names[id(inside)] = dict[str, str]()
        for node in (*ast.walk(inside), *file.tree.body):
            if isinstance(node, ast.ImportFrom) and node.module:
                names |= {item.asname or item.name: f"{node.module}.{item.name}" for item in node.names}
            elif isinstance(node, ast.Import):
                names |= {item.asname or item.name: item.name for item in node.names}
        return names

    def calls(self, file: File, function: Function) -> Iterator[tuple[File, Function]]:
        """Yield the package's functions that a function uses, in the order of its text.

        A method is that of the class of what it is called on; where no class is known, the only one of its
        name, if it is called.
        """
        names, class_of = self.names_in(file, function), self.reader(file, function)
        asked = [node for node in ast.walk(function) if isinstance(node, ast.Name | ast.Attribute)]
        called = {id(node.func) for node in ast.walk(function) if isinstance(node, ast.Call)}
        for node in sorted(asked, key=lambda node: (node.end_lineno or 0, node.end_col_offset or 0)):
            found: tuple[File, Function] | None = None
            if isinstance(node, ast.Name):
                found = self.functions.get(names.get(node.id, f"{file.name}.{node.id}"))
            elif isinstance(node.value, ast.Name) and node.value.id in names:
                found = self.functions.get(f"{names[node.value.id]}.{node.attr}")
            elif owner := class_of(node.value):
                found = self.method(owner, node.attr)
            elif id(node) in called and node.attr not in OF_PYTHON:
                found = self.functions.get(f".{node.attr}")
            if found is not None:
                yield found

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
        """Return the class that an annotation or a base names; "": it is not known."""
        while isinstance(written, ast.Subscript | ast.BinOp):
            written = written.value if isinstance(written, ast.Subscript) else written.left
        if isinstance(written, ast.Attribute) and isinstance(written.value, ast.Name):
            return ELSEWHERE if written.value.id in names and written.attr != "Any" else ""
        if not isinstance(written, ast.Name):
            return ""
        meant = names.get(written.id, f"{file.name}.{written.id}")
        if meant in self.classes:
            return meant
        ours = meant.split(".")[0] == PACKAGE
        foreign = written.id in vars(builtins) or (written.id in names and (not ours or meant == ARRAY))
        return ELSEWHERE if foreign and meant not in UNKNOWN else ""

    def field(self, owner: str, name: str) -> str:
        """Return the class of a field or a property of a class, by its annotation; "": it is not known."""
        if owner not in self.classes:
            return owner and ELSEWHERE
        found = self.method(owner, name)
        if found is not None:
            is_property = any("property" in ast.unparse(item) for item in found[1].decorator_list)
            return self.class_meant(found[0], found[1].returns, self.names_in(*found)) if is_property else ""
        file, node = self.classes[owner]
        names = self.names_in(file, node)
        for item in node.body:
            if isinstance(item, ast.AnnAssign) and ast.unparse(item.target) == name:
                return self.class_meant(file, item.annotation, names)
        inherited = (self.field(self.class_meant(file, base, names), name) for base in node.bases)
        return next((item for item in inherited if item not in ("", ELSEWHERE)), "")

    def reader(self, file: File, function: Function) -> Callable[[ast.expr], str]:
        """Return what tells an expression's class in a function, by its arguments and its assignments."""
        names, taken = self.names_in(file, function), function.args
        classes = {
            item.arg: self.class_meant(file, item.annotation, names)
            for item in (*taken.posonlyargs, *taken.args, *taken.kwonlyargs)
        }
        classes["self"] = self.owners.get(id(function), "")

        def class_of(value: ast.expr) -> str:
            if isinstance(value, LITERALS):
                return ELSEWHERE
            if isinstance(value, ast.Name):
                return classes.get(value.id, "")
            if isinstance(value, ast.Attribute):
                return self.field(class_of(value.value), value.attr)
            return class_made(value.func) if isinstance(value, ast.Call) else ""

        def class_made(asked: ast.expr) -> str:
            called = None
            if isinstance(asked, ast.Name):
                meant = names.get(asked.id, f"{file.name}.{asked.id}")
                if meant in self.classes:
                    return meant
                called = self.functions.get(meant)
            elif isinstance(asked, ast.Attribute):
                module = names.get(asked.value.id, "") if isinstance(asked.value, ast.Name) else ""
                if module and module.split(".")[0] != PACKAGE:
                    return ELSEWHERE
                owner = class_of(asked.value)
                if owner == ELSEWHERE:
                    return ELSEWHERE
                called = self.functions.get(f"{module}.{asked.attr}") or self.method(owner, asked.attr)
            return "" if called is None else self.class_meant(*self.returned(called))

        for node in ast.walk(function):
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                classes[node.targets[0].id] = class_of(node.value)
            elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                classes[node.target.id] = self.class_meant(file, node.annotation, names)
            elif isinstance(node, ast.withitem) and isinstance(node.optional_vars, ast.Name):
                classes[node.optional_vars.id] = class_of(node.context_expr)
        return class_of

    def returned(self, called: tuple[File, Function]) -> tuple[File, ast.expr | None, Mapping[str, str]]:
        """Return a function's file, what it says that it returns, and what names mean there."""
        return called[0], called[1].returns, self.names_in(*called)

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
            for called in self.calls(file, function):
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
