"""A compiled kernel is renewed when any source that it is made of changes, and only then."""

from __future__ import annotations

import importlib.util
import os
import pickle
import sys
import time
from pathlib import Path
from types import ModuleType

import pytest

from catheter_sim.mechanics import compiled

_COMPILED = "from catheter_sim.mechanics.compiled import compiled"
INNER = f"{_COMPILED}\n\nFACTOR = {{}}\n\n\n@compiled\ndef scaled(x):\n    return FACTOR * x\n"
OUTER = (
    f"{_COMPILED}\nfrom catheter_sim.inner_of_test import scaled\n\n\n"
    "@compiled\ndef twice_scaled(x):\n    return 2.0 * scaled(x)\n"
)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A source tree of its own, whose kernels are kept in a store of its own."""
    folder = tmp_path / "catheter_sim"
    folder.mkdir()
    (folder / "outer_of_test.py").write_text(OUTER)
    monkeypatch.setattr(compiled, "_SOURCES", tmp_path)
    # Python's own store tells files by size and second: of two within a second it would load the first.
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "store"))
    compiled._store.cache_clear()
    yield folder
    compiled._store.cache_clear()
    compiled.state_of.cache_clear()
    sys.modules.pop("catheter_sim.inner_of_test", None)


def load(file: Path) -> ModuleType:
    """Return the module in `file`, loaded anew, as part of the package."""
    compiled.state_of.cache_clear()
    name = f"catheter_sim.{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def result(package: Path, factor: float) -> tuple[float, int]:
    """Return 2 * factor * 3 by the kernels, and how many of the outer one were found on disk."""
    (package / "inner_of_test.py").write_text(INNER.format(factor))
    load(package / "inner_of_test.py")
    kernel = load(package / "outer_of_test.py").twice_scaled
    value = kernel(3.0)
    return value, sum(kernel.stats.cache_hits.values())


@pytest.mark.slow
def test_kernel_follows_the_constants_of_the_file_that_it_calls(package: Path) -> None:
    """A changed inner file gives the new number; nothing changed gives what was kept."""
    assert result(package, 2.0) == (12.0, 0)
    assert result(package, 2.0) == (12.0, 1)
    assert result(package, 5.0) == (30.0, 0)
    assert result(package, 2.0) == (12.0, 1)


def test_sources_are_followed_through_other_files(package: Path) -> None:
    """What a file imports by way of another one counts; what nothing imports does not."""
    (package / "inner_of_test.py").write_text("from catheter_sim.deep import (\n    a,\n    b,\n)\n")
    (package / "deep").mkdir()
    (package / "deep" / "b.py").write_text("")
    (package / "deep" / "c.py").write_text("")
    found = compiled.sources_of(package / "outer_of_test.py")
    assert [file.name for file in found if "_of_test" in file.name or file.parent.name == "deep"] == [
        "b.py",
        "inner_of_test.py",
        "outer_of_test.py",
    ]


@pytest.mark.slow
def test_only_the_last_states_are_kept(package: Path) -> None:
    """An editor's tenth version does not leave ten folders."""
    for factor in range(1, 8):
        result(package, float(factor))
    folders = list((package.parent / "store" / "catheter_sim").glob("*inner_of_test-*"))
    assert len(folders) <= 4


@pytest.mark.slow
@pytest.mark.parametrize("rest", [b"cno_such_module_here\ntype_of_arguments\n.", b"\x80\x05", b""])
def test_a_list_that_cannot_be_read_is_made_anew(package: Path, rest: bytes) -> None:
    """Types that this version does not have, or a file cut short: compiled again, and then kept again."""
    assert result(package, 2.0) == (12.0, 0)
    for index in (package.parent / "store").rglob("*.nbi"):
        with index.open("rb") as file:
            pickle.load(file)  # which Numba wrote it
            version = index.read_bytes()[: file.tell()]
        index.write_bytes(version + rest)
    assert result(package, 2.0) == (12.0, 0)
    assert result(package, 2.0) == (12.0, 1)


def states(folder: Path) -> set[str]:
    return {item.name for item in folder.iterdir()}


def test_a_tree_forgets_its_own_states_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Many versions of one tree leave four, and what another tree has or uses, until that is long ago."""
    store = tmp_path / "store"

    def kept(tree: str, text: str) -> str:
        """Keep a version of a tree's file, and return its state's name."""
        file = tmp_path / tree / "catheter_sim" / "kernel.py"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        monkeypatch.setattr(compiled, "_SOURCES", tmp_path / tree)
        compiled.state_of.cache_clear()
        locator = compiled._Locator(store, file, kept)
        locator.ensure_cache_path()
        time.sleep(0.002)  # files are told apart by when they were changed
        return Path(locator.get_cache_path()).name

    other = kept("other", "0")
    mine = [kept("mine", str(number)) for number in range(1, 8)]
    assert states(store) == {other, *mine[-4:]}
    assert kept("other", "4") == mine[3]  # in both trees
    mine += [kept("mine", str(number)) for number in range(8, 12)]
    assert states(store) == {other, mine[3], *mine[-4:]}
    long_ago = time.time() - 86400.0 * (compiled._USED_DAYS + 1.0)
    for mark in (store / other).iterdir():
        os.utime(mark, (long_ago, long_ago))
    mine.append(kept("mine", "12"))
    assert states(store) == {mine[3], *mine[-4:]}


def test_what_another_version_has_kept_stays_for_a_while(tmp_path: Path) -> None:
    """Without marks the folder's own time counts."""
    file = tmp_path / "kernel.py"
    file.write_text("")
    for name, days in (("new", 1.0), ("old", compiled._USED_DAYS + 1.0)):
        folder = tmp_path / f"{tmp_path.name}.kernel-{name}"
        folder.mkdir()
        os.utime(folder, (time.time() - 86400.0 * days,) * 2)
    locator = compiled._Locator(tmp_path, file, states)
    locator.ensure_cache_path()
    left = {item for item in states(tmp_path) if item.startswith(tmp_path.name)}
    assert left == {f"{tmp_path.name}.kernel-new", Path(locator.get_cache_path()).name}
