"""Where independent fits run: here, in other processes, or on a Dask cluster; what was done is kept.

The answer does not depend on where. With a folder to keep results in, a run that was stopped and is started
again takes over every call that had been finished; a result counts only once its file is whole. Files are
named after what was asked, the package's source included, so that another question never finds them.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import joblib
import numpy
import scipy

import catheter_sim
from catheter_sim.errors import InputError
from catheter_sim.tables import replaced_when_whole

T = TypeVar("T")

_ROUNDS = 3  # of calls whose process was killed
_LONGEST_WAIT_S = 10.0  # for a cluster to answer


@dataclass(frozen=True)
class Workers:
    """Where calls run and where their results are kept.

    Attributes:
        jobs: processes of this machine; 1: none but this one.
        dask: address of a Dask scheduler, "" for none; `jobs` is not used then.
        kept: folder of finished results; None: nothing is kept.
    """

    jobs: int = 1
    dask: str = ""
    kept: Path | None = None


HERE = Workers()


@contextmanager
def workers(place: Workers) -> Iterator[Workers]:
    """Give a place whose processes or cluster stay up for many calls of `each`.

    Raises:
        InputError: no scheduler answers at the address, or Dask is not installed.
    """
    with ExitStack() as stack:
        if place.dask:
            stack.enter_context(_client(place.dask))
            stack.enter_context(joblib.parallel_config("dask"))
        elif place.jobs > 1:
            # The matrices are small: threads of the linear algebra would stand in one another's way.
            stack.enter_context(joblib.parallel_config("loky", n_jobs=place.jobs, inner_max_num_threads=1))
        yield place


def each(place: Workers, call: Callable[..., T], arguments: Sequence[tuple[Any, ...]]) -> list[T]:
    """Return the results of several calls, in order.

    Args:
        place: from `workers`.
        call: a function of a module.
        arguments: of each call.

    Raises:
        InputError: processes were killed again and again.
    """
    names = _names(call, arguments) if place.kept else [""] * len(arguments)
    found: dict[int, bytes] = {}
    for index, name in enumerate(names):
        whole = place.kept / name if place.kept else None
        if whole is not None and whole.is_file():
            found[index] = whole.read_bytes()
    for _ in range(_ROUNDS):
        missing = [index for index in range(len(arguments)) if index not in found]
        if not missing:
            break
        try:
            for index, result in _run(place, call, arguments, missing):
                found[index] = result
                if place.kept:
                    _keep(place.kept / names[index], result)
        except BrokenProcessPool:
            continue
    else:
        if len(found) < len(arguments):
            raise InputError(
                f"--jobs {place.jobs}: processes were killed {_ROUNDS} times over (no memory left?); "
                "fewer need less"
            )
    # All results come from their bytes, fresh or kept, so that what is built on them has one name too.
    return [pickle.loads(found[index]) for index in range(len(arguments))]


def _run(
    place: Workers, call: Callable[..., T], arguments: Sequence[tuple[Any, ...]], wanted: Sequence[int]
) -> Iterator[tuple[int, bytes]]:
    """Yield the results of some of the calls as they come."""
    if place.jobs <= 1 and not place.dask:
        for index in wanted:
            yield _numbered(index, call, arguments[index])
        return
    parallel = joblib.Parallel(return_as="generator_unordered", batch_size=1)
    yield from parallel(joblib.delayed(_numbered)(index, call, arguments[index]) for index in wanted)


def _numbered(index: int, call: Callable[..., T], arguments: tuple[Any, ...]) -> tuple[int, bytes]:
    return index, pickle.dumps(call(*arguments))


def _keep(path: Path, result: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replaced_when_whole(path, binary=True) as file:
        file.write(result)


def _names(call: Callable[..., T], arguments: Sequence[tuple[Any, ...]]) -> list[str]:
    """Return the file names of calls' results."""
    hashes: dict[int, str] = {}  # by identity: the calls share their largest arguments, hashed once

    def hash_of(argument: Any) -> str:
        if id(argument) not in hashes:
            hashes[id(argument)] = _hash(argument)
        return hashes[id(argument)]

    asked = _source(), call.__module__, call.__qualname__
    return [f"{_hash((*asked, *map(hash_of, item)))}.pickle" for item in arguments]


@cache
def _source() -> str:
    """Return a hash of what the package and its arithmetic are made of."""
    folder = Path(catheter_sim.__file__).parent
    texts = [path.read_bytes() for path in sorted(folder.rglob("*.py"))]
    return _hash((texts, numpy.__version__, scipy.__version__))


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
