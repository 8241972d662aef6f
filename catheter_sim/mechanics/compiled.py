"""Compiled loops: their types, where they are kept between runs, how they are compiled."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
from numba.core import event
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, _CacheLocator

from catheter_sim.progress import compilation_begins, compilation_ends

# ----------------------------------------------------------------------------------------------------
# Where compiled kernels are kept on disk: a folder for each state of the sources that a kernel is made of.
#
# Numba renews what it keeps of a function when the function's own file changes. A kernel that calls another
# file's kernel, or holds another file's constant, would then keep the old one. Here a kernel is kept under
# a hash of its file and of every file of this package that this one imports, directly or not. Trees with
# the same sources share what is kept. A tree forgets the oldest of its own states; a state that another
# tree has used within `_USED_DAYS` stays.

_SOURCES = Path(__file__).resolve().parents[2]  # the folder in which the package lies
_PACKAGE = "catheter_sim"
_IMPORT = re.compile(rf"^\s*from {_PACKAGE}([\w.]*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)
_KEPT_STATES = 4  # of each file's kernels in a tree: what an editor goes back and forth between
_MARK = ".used-"  # begins the name of an empty file in a state's folder: of a tree, changed when that used it
_USED_DAYS = 30.0  # after which a tree that has not used a state again has no part in it


def store_folders() -> Iterator[Path]:
    """Yield the folders that may hold compiled kernels, the best first.

    `NUMBA_CACHE_DIR` where it is set, then the user's cache, then the package's own folder.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        yield Path(chosen) / _PACKAGE
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    yield Path(home) / _PACKAGE / "kernels"
    yield Path(__file__).resolve().parent / "__pycache__" / "kernels"


@lru_cache(maxsize=1)
def _store() -> Path | None:
    """Return the first folder in which files can be written; None: there is none."""
    for folder in store_folders():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
        except OSError:
            continue
        return folder
    return None


def _imported(text: str) -> Iterator[Path]:
    """Yield the files of this package from which a source imports."""
    for match in _IMPORT.finditer(text):
        module = _SOURCES.joinpath(_PACKAGE, *match[1].split(".")[1:])
        names = re.findall(r"^\s*(\w+)|[,(]\s*(\w+)", match[2])
        candidates = [module / f"{first or second}.py" for first, second in names]
        for file in (*candidates, module.with_suffix(".py"), module / "__init__.py"):
            if file.is_file():
                yield file


def sources_of(file: Path) -> list[Path]:
    """Return `file` and every file of this package that it imports, directly or not, sorted."""
    found, waiting = {file}, [file]
    while waiting:
        for other in _imported(waiting.pop().read_text(encoding="utf-8")):
            if other not in found:
                found.add(other)
                waiting.append(other)
    return sorted(found)


@lru_cache(maxsize=256)
def state_of(file: Path) -> str:
    """Return the hash of the sources of `file`."""
    digest = hashlib.sha256()
    for source in sources_of(file):
        digest.update(source.name.encode() + b"\0" + source.read_bytes() + b"\0")
    return digest.hexdigest()[:20]


def _users(folder: Path) -> dict[str, float]:
    """Return the trees that use a state, by their marks, and when last; "" where none has marked it."""
    return {item.name: _changed(item) for item in folder.glob(f"{_MARK}*")} or {"": _changed(folder)}


def _changed(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:  # another process has just removed it
        return 0.0


class _Locator(_CacheLocator):
    def __init__(self, folder: Path, file: Path, function: Callable[..., Any]) -> None:
        self._state = state_of(file)
        self._folder = folder / f"{file.parent.name}.{file.stem}-{self._state}"
        self._line = function.__code__.co_firstlineno
        self._mark = f"{_MARK}{hashlib.sha256(str(_SOURCES).encode()).hexdigest()[:12]}"
        if self._folder.is_dir():
            self._use()

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> _Locator | None:
        store = _store()
        if store is None or not os.path.exists(py_file):
            return None
        return cls(store, Path(py_file).resolve(), py_func)

    def ensure_cache_path(self) -> None:
        if not self._folder.exists():
            self._forget_old_states()
        self._folder.mkdir(parents=True, exist_ok=True)
        self._use()

    def _use(self) -> None:
        with suppress(OSError):  # of another user
            (self._folder / self._mark).touch()

    def _forget_old_states(self) -> None:
        """Forget the oldest states of this tree, and any that no tree has used for long."""
        stem, since = self._folder.name.rsplit("-", 1)[0], time.time() - 86400.0 * _USED_DAYS
        users = {item: _users(item) for item in self._folder.parent.glob(f"{stem}-*") if item.is_dir()}
        mine = sorted((used[self._mark], item) for item, used in users.items() if self._mark in used)
        old = {item for _, item in mine[: max(0, len(mine) - _KEPT_STATES + 1)]}
        for folder, used in users.items():
            if not any(
                when > since for mark, when in used.items() if mark != self._mark or folder not in old
            ):
                shutil.rmtree(folder, ignore_errors=True)

    def get_cache_path(self) -> str:
        return str(self._folder)

    def get_source_stamp(self) -> str:
        return self._state

    def get_disambiguator(self) -> str:
        return str(self._line)


class _Implementation(CompileResultCacheImpl):
    _locator_classes: list[Any] = [_Locator]  # noqa: RUF012 - as Numba declares it


class _CacheFile(IndexDataCacheFile):
    def _load_index(self) -> dict[Any, str]:
        """Return what is kept by argument types; nothing where the list cannot be read.

        It can be cut short, and it can hold types of another version of the package, which called this
        function, itself unchanged, with arguments that do not exist here.
        """
        try:
            kept: dict[Any, str] = super()._load_index()
        except Exception:  # whatever unpickling may raise: it is a list of files, to be made anew
            return {}
        return kept


class KernelCache(FunctionCache):
    """What is kept of one compiled function.

    Raises:
        RuntimeError: there is no folder to keep it in.
    """

    _impl_class = _Implementation

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._cache_file = _CacheFile(
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=self._impl.locator.get_source_stamp(),
        )


# ----------------------------------------------------------------------------------------------------
# How numerical kernels are compiled, and how it gets known that one is (`progress.compilations_told`).


def compiled(function: Callable[..., Any]) -> Any:
    """Return `function` compiled, kept on disk where there is a folder for it.

    What is kept is renewed when the function's own file changes or one that this file imports
    (`mechanics.compiled`): compiled functions may call those of other files and use their constants.
    """
    return _compiled(function)


def compiled_in_place(function: Callable[..., Any]) -> Any:
    """Return `function`, which makes no arrays of its own, compiled as by `compiled`.

    The arrays that it is given, and rows of these, are then used without counting who holds them, which
    costs a function of short loops a quarter of its time. It may call none but others of its kind.

    Raises:
        numba.core.errors.NumbaError: at the first call, if it does make an array.
    """
    return _compiled(function, _nrt=False)


def inlined(function: Callable[..., Any]) -> Any:
    """Return `function` to be written out in the compiled functions that call it, before these are compiled.

    For parts of a loop where a call would count, and for long functions with one caller each. A compiled
    function is optimized once by itself and once more in each function that calls it, directly or not,
    which can be most of the time that compiling takes.
    """
    return numba.njit(inline="always")(function)


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    dispatcher = numba.njit(error_model="numpy", nogil=True, **options)(function)
    with suppress(RuntimeError):  # no folder to keep it in: compiled anew in every process
        dispatcher._cache = KernelCache(function)
    return dispatcher


class _Compilations(event.Listener):
    """Hears of every compilation; what is found on disk is none."""

    def on_start(self, event: event.Event) -> None:
        compilation_begins()

    def on_end(self, event: event.Event) -> None:
        kernel = (event.data or {}).get("dispatcher")
        module = getattr(getattr(kernel, "py_func", None), "__module__", None) or ""
        of = module.rpartition(".")[2] if module.startswith("catheter_sim.") else ""
        compilation_ends(not module.startswith("numba."), of)


event.register("numba:compile", _Compilations())
