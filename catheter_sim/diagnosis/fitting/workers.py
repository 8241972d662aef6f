"""Where independent fits run: in this process, in others, or on a Dask cluster; finished results are kept.
The answer does not depend on where they run. With a folder to keep results in, a run that was stopped and is
started again takes over every call that had been finished; a result counts only once its file is whole. Files
are named after what was asked, the package's source included, so that another question never finds them. They
are data (`kept`): a file that is not what it must be is reported, and its result made again.

Processes of this machine end with the one that started them, however that ends.
"""

from __future__ import annotations

import math
import os
import re
import signal
import sys
import time
import warnings
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from threading import Thread
from typing import Any, TypeVar

import joblib
import mujoco
import numba
import numpy
import scipy
from tqdm import tqdm

import catheter_sim
from catheter_sim.diagnosis.fitting.kept import Unusable, packed, returned, unpacked
from catheter_sim.errors import InputError
from catheter_sim.tables import replaced_when_whole

T = TypeVar("T")

_ROUNDS = 3  # of calls whose process was killed
_LONGEST_WAIT_S = 10.0  # for a cluster to answer
_LOOK_EVERY_S = 0.5  # whether the process that started this one is still there
_SUFFIX = ".npz"
_OURS = re.compile(rf"[0-9a-f]{{40}}\{_SUFFIX}|\..*")  # files in the folder; with a dot: not yet whole
_LARGEST_BYTES = 1 << 30  # of one kept result


@dataclass(frozen=True)
class Workers:
    """Where calls run and where their results are kept.

    Attributes:
        jobs: processes of this machine; 1: none but this one.
        dask: address of a Dask scheduler, "" for none; `jobs` is not used then.
        kept: folder of finished results; None: nothing is kept.
        noted: what has been said of that folder: a folder full of bad files is one line, not a thousand.
    """

    jobs: int = 1
    dask: str = ""
    kept: Path | None = None
    noted: set[str] = field(default_factory=set, compare=False, repr=False)

    def note(self, what: str, line: str) -> None:
        """Report on standard error what is not as it should be, each kind once."""
        if what not in self.noted:
            self.noted.add(what)
            tqdm.write(f"note: {line}", file=sys.stderr)


SERIAL = Workers()


@contextmanager
def workers(place: Workers) -> Iterator[Workers]:
    """Give a place whose processes or cluster stay up for many calls of `map_calls`.

    Raises:
        InputError: no scheduler answers at the address, or Dask is not installed.
    """
    with ExitStack() as stack:
        if place.dask:
            stack.enter_context(_client(place.dask))
            stack.enter_context(joblib.parallel_config("dask"))
        elif place.jobs > 1:
            # The matrices are small: threads of the linear algebra would stand in one another's way.
            stack.enter_context(
                joblib.parallel_config(
                    "loky",
                    n_jobs=place.jobs,
                    inner_max_num_threads=1,
                    max_nbytes=None,  # no arrays in shared memory: a killed run would leave them there
                    temp_folder=_folder_for_joblib(place),
                    initializer=end_with,
                    initargs=(os.getpid(),),
                )
            )
        _note_others(place)
        yield place


class OutOfTime(Exception):
    """Time has run out before the last of several calls was done.

    Attributes:
        found: the results of those that were, by their place.
    """

    def __init__(self, found: Mapping[int, Any]) -> None:
        super().__init__(f"time ran out after {len(found)} calls")
        self.found = found


def map_calls(
    place: Workers,
    call: Callable[..., T],
    arguments: Sequence[tuple[Any, ...]],
    deadline: float = math.inf,
) -> list[T]:
    """Return the results of several calls, in order.

    Args:
        place: from `workers`.
        call: a function of a module.
        arguments: of each call.
        deadline: on the clock of `time.monotonic`, after which no call is waited for once one is done [s].

    Raises:
        InputError: processes were killed again and again.
        OutOfTime: the deadline has gone by, and some calls are not done.
    """
    names = _names(call, arguments) if place.kept else [""] * len(arguments)
    kind = returned(call)
    found: dict[int, T] = {}
    for index, name in enumerate(names):
        if place.kept:
            found.update((index, value) for value in _taken_over(place, place.kept / name, kind))
    for _ in range(_ROUNDS):
        missing = [index for index in range(len(arguments)) if index not in found]
        if not missing:
            break
        results = _run(place, call, arguments, names, missing)
        try:
            for index, result in results:
                if place.kept:
                    _keep(place, place.kept / names[index], result)
                # From its bytes, fresh or kept, so that what is built on it has one name too.
                found[index] = unpacked(result, names[index], kind)
                if len(found) < len(arguments) and time.monotonic() >= deadline:
                    raise OutOfTime(found)
        except BrokenProcessPool:
            continue
        finally:
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", ".*tasks which were still being processed")  # out of time
                results.close()
    else:
        if len(found) < len(arguments):
            raise InputError(
                f"--jobs {place.jobs}: processes were killed {_ROUNDS} times over (no memory left?); "
                "fewer need less"
            )
    return [found[index] for index in range(len(arguments))]


def end_with(starter: int) -> None:
    """Let this process end soon after the one with the id `starter`, its parent, is gone.

    Ctrl-C reaches every process of a terminal: it is left to the parent, which ends the others.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == starter:
            time.sleep(_LOOK_EVERY_S)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


def _folder_for_joblib(place: Workers) -> Path | None:
    """Return where joblib makes its temporary folders, None for the system's.

    Among the kept results they are deleted with these, also after a run that was killed with all its
    processes.
    """
    if place.kept is None or not place.kept.exists():
        return place.kept
    return place.kept if place.kept.is_dir() and os.access(place.kept, os.W_OK | os.X_OK) else None


def _run(
    place: Workers,
    call: Callable[..., T],
    arguments: Sequence[tuple[Any, ...]],
    names: Sequence[str],
    wanted: Sequence[int],
) -> Generator[tuple[int, bytes]]:
    """Yield the results of some of the calls as they come."""
    tasks = [(index, call, arguments[index], names[index]) for index in wanted]
    if place.jobs <= 1 and not place.dask:
        for task in tasks:
            yield _numbered(*task)
        return
    parallel = joblib.Parallel(return_as="generator_unordered", batch_size=1)
    yield from parallel(joblib.delayed(_numbered)(*task) for task in tasks)


def _numbered(index: int, call: Callable[..., T], arguments: tuple[Any, ...], name: str) -> tuple[int, bytes]:
    return index, packed(call(*arguments), name, returned(call))


def _keep(place: Workers, path: Path, result: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replaced_when_whole(path, binary=True) as file:
            file.write(result)
    except (InputError, OSError) as error:  # only a later run would be the poorer
        place.note("not kept", f"a finished result cannot be kept: {error}")


def _taken_over(place: Workers, path: Path, kind: Any) -> list[Any]:
    """Return the result in a file, none where there is none or the file cannot be used."""
    try:
        if not path.is_file():
            return []
        if path.stat().st_size > _LARGEST_BYTES:
            raise Unusable("larger than any result")
        return [unpacked(path.read_bytes(), path.name, kind)]
    except (Unusable, OSError) as error:
        words = "a kept result cannot be used and is made again, as are others like it"
        place.note("unusable", f"{words}: {path}: {error}")
        return []


def _note_others(place: Workers) -> None:
    """Report files among the kept results that this module did not write and does not read."""
    if place.kept is None:
        return
    try:
        files = [path for path in place.kept.iterdir() if not path.is_dir()]
    except OSError:  # no folder yet
        return
    others = sorted(path.name for path in files if not _OURS.fullmatch(path.name))
    if others:
        found = f"{len(others)} of its files are no kept results and are not read"
        place.note("others", f"{place.kept}: {found}, {others[0]!r} the first")


def _names(call: Callable[..., T], arguments: Sequence[tuple[Any, ...]]) -> list[str]:
    """Return the file names of calls' results."""
    hashes: dict[int, str] = {}  # by identity: the calls share their largest arguments, hashed once

    def hash_of(argument: Any) -> str:
        if id(argument) not in hashes:
            hashes[id(argument)] = _hash(argument)
        return hashes[id(argument)]

    asked = _source(), call.__module__, call.__qualname__
    return [f"{_hash((*asked, *map(hash_of, item)))}{_SUFFIX}" for item in arguments]


@cache
def _source() -> str:
    """Return a hash of what the package and its arithmetic are made of."""
    folder = Path(catheter_sim.__file__).parent
    texts = [path.read_bytes() for path in sorted(folder.rglob("*.py"))]
    return _hash((texts, *(library.__version__ for library in (numpy, scipy, numba, mujoco))))


def _hash(value: Any) -> str:
    return str(joblib.hash(value, hash_name="sha1"))


@contextmanager
def _client(address: str) -> Iterator[None]:
    try:
        from distributed import Client
    except ImportError:
        raise InputError("--dask: Dask is not installed; catheter_sim's extra 'dask' has it") from None
    try:
        client = Client(address, timeout=_LONGEST_WAIT_S, set_as_default=True)
    except (OSError, ValueError) as error:
        raise InputError(f"--dask {address}: no scheduler answers ({error})") from None
    with client:
        yield
