"""The package stays one that a stranger can read: what `scripts/house.py` counts of it, and its bounds."""

from __future__ import annotations

from pathlib import Path

import pytest
from scripts_as_modules import script_module

ROOT = Path(__file__).parent.parent
house = script_module("house")
pytestmark = pytest.mark.xdist_group("layers")  # whose worker reads every file once


@pytest.fixture(scope="module")
def package():
    """Return the package as it is counted."""
    return house.House(ROOT)


def made(folder: Path, **files: str):
    """Return a package of some files, by module name with double underscores for dots."""
    for name, text in files.items():
        path = folder / "catheter_sim" / (name.replace("__", "/") + ".py")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return house.House(folder)


def test_the_package_has_few_files_of_few_imports(package) -> None:
    """Topics, not splinters: at most 350 files, 7 % of the lines imports, folders four levels deep."""
    assert 200 < len(package.files) <= 350
    assert 0.02 < package.import_lines / package.lines <= 0.07
    assert package.depth <= 4


def test_imports_make_no_circle_and_reach_no_test(package) -> None:
    """Files can be read one after another, and the wheel needs nothing of the tests."""
    assert package.circles == []
    assert package.imports_tests == []


def test_a_class_name_stands_once(package) -> None:
    """Whoever reads a name knows which class is meant."""
    assert package.classes_twice == {}


def test_a_circle_a_test_and_a_name_twice_are_seen(tmp_path: Path) -> None:
    """Each count notices what it is for."""
    found = made(
        tmp_path,
        a="from catheter_sim.b import B\nclass A: ...\n",
        b="from catheter_sim.a import A\nimport hidden_effects\nclass B: ...\nclass A: ...\n",
    )
    assert found.circles == [["catheter_sim.a", "catheter_sim.b"]]
    assert found.imports_tests == ["catheter_sim.b"]
    assert found.classes_twice == {"A": 2}
    assert found.import_lines == 3


def test_a_walk_counts_each_function_once_and_every_return(tmp_path: Path) -> None:
    """From `start` in one folder to another, back, and there again: one return to each folder."""
    found = made(
        tmp_path,
        one__a="from catheter_sim.two.b import there, last\ndef start():\n    there()\n    last()\n"
        "def back(): ...\n",
        two__b="from catheter_sim.one import a\ndef there():\n    a.back()\ndef last(): ...\n",
    )
    walk = found.walk("catheter_sim.one.a.start")
    assert [function.name for _, function in walk] == ["start", "there", "back", "last"]
    assert house.returns(walk) == 2


def test_argument_lists_are_short(package) -> None:
    """At most nine arguments of a private function, twelve of a compiled one."""
    assert package.long_signatures == ([], [])


def test_few_files_lie_between_simulate_and_a_step_of_the_engine(package) -> None:
    """A reader who wants to know how a row of inputs becomes a step opens at most twelve files."""
    path = package.path("catheter_sim.public.runs.simulate", house.STEPS)
    files = {file.name for file, _ in path}
    assert {"catheter_sim.public.runs", "catheter_sim.simulation.simulator"} <= files
    assert len(files) <= 12


def test_a_path_follows_methods_by_their_classes_and_leaves_out_what_leads_nowhere(tmp_path: Path) -> None:
    """Two classes have a `go`; only the one whose object is made here steps the engine."""
    found = made(
        tmp_path,
        a="from catheter_sim.b import Runner, made\ndef start():\n    made().go()\n    aside()\n"
        "def aside(): ...\n",
        b="import mujoco\nclass Base:\n    def go(self):\n        self._one()\n    def _one(self):\n"
        "        mujoco.mj_step(1, 2)\nclass Runner(Base): ...\nclass Other:\n    def go(self): ...\n"
        "def made() -> Runner: ...\n",
    )
    path = found.path("catheter_sim.a.start", house.STEPS)
    assert [function.name for _, function in path] == ["start", "go", "_one"]


def test_a_walk_follows_fields_and_leaves_names_of_python_alone(tmp_path: Path) -> None:
    """Of two classes with a `go` it takes that of the field; a `copy` of what is not known is nobody's."""
    found = made(
        tmp_path,
        a="from catheter_sim.b import Holder\ndef start(held: Holder, other):\n    held.runner.go()\n"
        "    other.copy()\n    other.alone()\n",
        b="class Runner:\n    def go(self): ...\nclass Other:\n    def go(self): ...\n"
        "    def copy(self): ...\n    def alone(self): ...\nclass Holder:\n    runner: Runner\n",
    )
    walk = found.walk("catheter_sim.a.start")
    owners = [found.owners.get(id(function), "") for _, function in walk]
    assert [function.name for _, function in walk] == ["start", "go", "alone"]
    assert owners == ["", "catheter_sim.b.Runner", "catheter_sim.b.Other"]


def test_long_signatures_are_counted(tmp_path: Path) -> None:
    """A private function of ten arguments, a private class's constructor, and a kernel of thirteen."""
    ten, thirteen = (", ".join(f"a{k}" for k in range(count)) for count in (10, 13))
    found = made(
        tmp_path,
        a=f"def _long({ten}): ...\n@compiled\ndef kernel({thirteen}): ...\ndef wide({ten}): ...\n"
        f"class Open:\n    def __init__({ten}): ...\nclass _Own:\n    def __init__({ten}): ...\n",
    )
    private = ["catheter_sim.a._long: 10", "catheter_sim.a.__init__: 10"]
    assert found.long_signatures == (private, ["catheter_sim.a.kernel: 13"])
