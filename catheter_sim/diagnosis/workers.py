"""Fits by several processes, kept for a run that goes on, and cheap first looks at hypotheses."""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
import io
import json
import math
import os
import re
import signal
import struct
import sys
import time
import types
import typing
import warnings
from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from threading import Thread
from typing import Any, TypeVar

import joblib
import mujoco
import numba
import numpy
import numpy as np
import scipy
from tqdm import tqdm

import catheter_sim
from catheter_sim import platforms
from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.motion import motion_step_s
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.fit import Fit, FitTask, Linearised, damped_step, residuals
from catheter_sim.diagnosis.intervals import intervals, profile_interval
from catheter_sim.diagnosis.noise import noise_from_row_to_row
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.problem import (
    FittedNumber,
    Problem,
    Term,
    box_of,
    fitted_numbers,
    prior_of,
    start_of,
)
from catheter_sim.diagnosis.readings import resolution_of
from catheter_sim.diagnosis.result import FittedParameter
from catheter_sim.diagnosis.thresholds import DERIVATIVE_STEP
from catheter_sim.diagnosis.trials import Dataset, Trial, beginnings, measured_of
from catheter_sim.errors import InputError
from catheter_sim.simulation.moving_twin import MovingTwin
from catheter_sim.tables import replaced_when_whole
from catheter_sim.theory.twins import MovingPrediction, Prediction, moving_twin_for, twin_for

LONGER_STEPS = (2, 4)
"""[times the robot's own step in motion] These are tried for fits, in this order. Why: each halves the time.
Four times half a millisecond is still a hundredth of the period of a fast swing."""
STEP_SHARE = 0.1
"""[share of the noise, root mean square] Longer steps may change an output by this much. Why: assumed. A
tenth of the noise moves fitted numbers by a tenth of their intervals or less."""
SECONDS_TO_STEP_BY = 6.0
"""[s] Steps are compared on the trials' beginnings, together of this length. Why: assumed. It costs no more
than two robots of a choice do."""
PROBE_DAMPINGS = (1e-3, 0.3, 10.0)
"""[share of the normal matrix's diagonal] A probe's steps have these dampings. Why: they give a whole step,
one half as long, and a short one where the derivative misleads."""
PROBE_HALVINGS = 2
"""[halvings] A probe's step that makes things worse is halved at most this many times. Why: the play of a
robot in motion started four times too wide (draw 4 of the bench in motion, seed 12). It was not among the
hypotheses that were fitted, and the diagnosis took 25 minutes instead of one."""
SECANT_STEP = 1.0
"""[scales of the parameter] Step of the derivative that shows by how much a number may vary. Why: it is a
change that matters. A twentieth of it is lost in the friction of a tendon."""
SHORTLIST = 3
"""[hypotheses] Beyond those to be fitted, the full model computes the first step of this many. Why: their
derivatives rank them well but not surely."""

# ----------------------------------------------------------------------------------------------------
# Results as data: what a call returned as bytes of an NPZ file, and back, to the last bit.
#
# A folder of kept results may come from anywhere, so reading one runs nothing. Its arrays are NPZ members
# without pickle; all else is JSON beside them. The only classes that are made are the dataclasses which the
# call's own annotation says that it returns. The file also holds what was asked and a checksum; whatever is
# not as expected is refused (`Unusable`).

_NUMBERS = "biufc"  # kinds of dtype that are kept
_SKELETON, _CHECKSUM = "skeleton", "checksum"  # members beside the arrays
_PLAIN = (type(None), bool, int, str)


class Unusable(ValueError):
    """A kept result that is not what was asked; the message says why, in a few words."""


def returned(call: Callable[..., Any]) -> Any:
    """Return the annotation of what `call` returns, `Any` where it has none."""
    return typing.get_type_hints(call).get("return", Any) if inspect.isfunction(call) else Any


def packed(value: Any, asked: str, kind: Any = Any) -> bytes:
    """Return a result as the bytes of an NPZ file; equal results give equal bytes.

    It may hold numbers, text, bytes, NumPy arrays, tuples, lists, mappings, and dataclasses that its
    annotation `kind` names; `asked` is the name of the question that it answers.

    Raises:
        TypeError: it holds something else.
    """
    arrays: list[np.ndarray] = []
    skeleton = json.dumps(_plain(value, arrays, _classes(kind)))
    members = {f"array_{index}": array for index, array in enumerate(arrays)}
    members |= {_CHECKSUM: _checksum(asked, skeleton, members), _SKELETON: _bytes_array(skeleton.encode())}
    buffer = io.BytesIO()
    np.savez(buffer, **members)  # type: ignore[arg-type]
    return buffer.getvalue()


def unpacked(content: bytes, asked: str, kind: Any = Any) -> Any:
    """Return the result in the bytes that `packed` made for the same question.

    Raises:
        Unusable: they are not whole, answer another question, or are no result of this `kind`.
    """
    try:
        members = _members(content)
        skeleton = members.pop(_SKELETON).tobytes().decode()
        if members.pop(_CHECKSUM).tobytes() != _checksum(asked, skeleton, members).tobytes():
            raise Unusable("its checksum is that of something else")
        value = _made(json.loads(skeleton), members, _classes(kind))
        misfit = _misfit(value, kind)
    except Unusable:
        raise
    except Exception as error:  # bytes from anywhere: NumPy, zipfile and JSON have many ways to refuse them
        reason = " ".join(str(error).split()).partition(". ")[0][:80] or type(error).__name__
        raise Unusable(f"no kept result: {reason}") from None
    if misfit:
        raise Unusable(misfit)
    return value


def _members(content: bytes) -> dict[str, np.ndarray]:
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        items = archive.zip.infolist()
        if any(item.compress_type for item in items) or sum(item.file_size for item in items) > len(content):
            raise Unusable("its members claim more bytes than it has")
        return {name: archive[name] for name in archive.files}


def _checksum(asked: str, skeleton: str, members: Mapping[str, np.ndarray]) -> np.ndarray:
    digest = hashlib.sha256()
    for part in (asked, skeleton):
        digest.update(repr(part).encode())
    for name, array in sorted(members.items()):
        digest.update(repr((name, array.dtype.str, array.shape, array.flags.fnc)).encode())
        digest.update(array.tobytes())
    return _bytes_array(digest.digest())


def _bytes_array(content: bytes) -> np.ndarray:
    return np.frombuffer(content, dtype=np.uint8)


def _plain(value: Any, arrays: list[np.ndarray], classes: Mapping[str, type]) -> Any:
    """Return `value` as JSON has it; its arrays are put in `arrays`, and stand there by their number."""
    if type(value) in _PLAIN:
        return value
    if type(value) is float:
        return value if math.isfinite(value) else {"float": struct.pack(">d", value).hex()}
    if isinstance(value, np.generic) or type(value) in (np.ndarray, np.memmap):
        if value.dtype.kind not in _NUMBERS:
            raise TypeError(f"an array of {value.dtype} cannot be kept")
        arrays.append(np.asarray(value))
        return {"scalar" if isinstance(value, np.generic) else "array": len(arrays) - 1}
    if type(value) is bytes:
        arrays.append(_bytes_array(value))
        return {"bytes": len(arrays) - 1}
    if type(value) is list:
        return [_plain(item, arrays, classes) for item in value]
    if type(value) is tuple:
        return {"tuple": [_plain(item, arrays, classes) for item in value]}
    if type(value) is dict:
        return {"dict": [[_plain(part, arrays, classes) for part in item] for item in value.items()]}
    if classes.get(type(value).__name__) is type(value):
        held = {name: _plain(getattr(value, name), arrays, classes) for name in _fields(type(value))}
        return {"object": [type(value).__name__, held]}
    raise TypeError(f"a {type(value).__qualname__} cannot be kept: the call does not say that it returns one")


def _made(node: Any, members: Mapping[str, np.ndarray], classes: Mapping[str, type]) -> Any:
    """Return what `_plain` wrote down."""
    if type(node) in (*_PLAIN, float):
        return node
    if type(node) is list:
        return [_made(item, members, classes) for item in node]
    ((tag, content),) = node.items()
    if tag == "float":
        return struct.unpack(">d", bytes.fromhex(content))[0]
    if tag in ("array", "scalar"):
        array = members[f"array_{content}"]
        return array if tag == "array" else array[()]
    if tag == "bytes":
        return members[f"array_{content}"].tobytes()
    if tag == "tuple":
        return tuple(_made(item, members, classes) for item in content)
    if tag == "dict":
        return {_made(key, members, classes): _made(item, members, classes) for key, item in content}
    if tag == "object":
        name, held = content
        if list(held) != _fields(classes[name]):
            raise Unusable(f"a {name} of other parts")
        return classes[name](**{part: _made(item, members, classes) for part, item in held.items()})
    raise Unusable(f"{tag!r} is no part of a result")


def _fields(kind: Any) -> list[str]:
    return [field.name for field in dataclasses.fields(kind)]


@cache
def _hints(kind: type) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def _classes(kind: Any, found: dict[str, type] | None = None) -> dict[str, type]:
    """Return the dataclasses that an annotation names, and those that these hold, by name."""
    found = {} if found is None else found
    if isinstance(kind, type) and dataclasses.is_dataclass(kind) and kind.__name__ not in found:
        found[kind.__name__] = kind
        for part in _hints(kind).values():
            _classes(part, found)
    for part in typing.get_args(kind):
        _classes(part, found)
    return found


def _misfit(value: Any, kind: Any) -> str:
    """Return why `value` is not of an annotated kind, "" if it is."""
    kind = _written_out(kind)
    origin, parts = typing.get_origin(kind) or kind, typing.get_args(kind)
    if kind is Any:
        return ""
    if origin in (typing.Union, types.UnionType):
        return "" if any(not _misfit(value, part) for part in parts) else f"no {kind}"
    if not _is_a(value, origin):
        return f"a {type(value).__name__} where {getattr(kind, '__name__', kind)} is due"
    inside: list[tuple[Any, Any]] = []  # what it holds, and of what kind that must be
    if origin is np.ndarray:
        wanted = [scalar for part in parts[1:] for scalar in typing.get_args(part)]
        if not all(np.issubdtype(value.dtype, scalar) for scalar in wanted):
            return f"an array of {value.dtype}"
    elif dataclasses.is_dataclass(origin):
        hints = _hints(typing.cast(type, origin))
        inside = [(getattr(value, name), hints[name]) for name in _fields(origin)]
    elif origin is tuple and parts[1:] != (...,):
        if len(value) != len(parts):
            return f"a tuple of {len(value)}"
        inside = list(zip(value, parts, strict=True))
    elif origin in (dict, Mapping):
        inside = [pair for item in value.items() for pair in zip(item, parts, strict=True)]
    elif parts:
        inside = [(item, parts[0]) for item in value]
    found = filter(None, (_misfit(item, part) for item, part in inside))
    return next(found, "") or _shape_misfit(value)


def _written_out(kind: Any) -> Any:
    """Return what an alias stands for; from Python 3.12 on NumPy's `NDArray` is one of a class of its own."""
    origin = typing.get_origin(kind) or kind
    if not hasattr(origin, "__value__"):
        return kind
    parts = typing.get_args(kind)
    return _written_out(origin.__value__[parts] if parts else origin.__value__)


def _is_a(value: Any, origin: Any) -> bool:
    if origin is float:
        return isinstance(value, int | float | np.integer | np.floating) and type(value) is not bool
    return isinstance(value, types.NoneType if origin is None else origin)


def _shape_misfit(value: Any) -> str:
    """Return which part of a dataclass is not as long as its `SHAPES` says, "" if all are.

    `SHAPES` has a letter for each axis of a field, "jacobian:np residual:n": one letter is one length.
    """
    lengths: dict[str, int] = {}
    for item in getattr(value, "SHAPES", "").split():
        name, _, axes = item.partition(":")
        part = getattr(value, name)
        shape = part.shape if isinstance(part, np.ndarray) else (len(part),)
        if len(shape) != len(axes):
            return f"{name} of shape {shape}"
        for axis, length in zip(axes, shape, strict=True):
            if lengths.setdefault(axis, length) != length:
                return f"{name} of shape {shape}"
    return ""


# ----------------------------------------------------------------------------------------------------
# Which twin a data set is fitted by: analytic where rows were held, the simulation where the robot moved.
#
# In motion every simulated step costs time. A robot's own step is chosen for accuracy; a longer one is
# taken for fits if it changes the outputs by far less than the measurements' noise (`STEP_SHARE`). The
# replay at the end goes by the robot's own step.


@dataclass(frozen=True)
class ChosenTwin:
    """What fits go by.

    `predict` leads from robots and inputs to outputs; `notes` are what a reader must know of it.
    """

    predict: Prediction
    notes: tuple[Note, ...] = ()


def twin_of(dataset: Dataset, train: Sequence[Trial]) -> ChosenTwin:
    """Return what a data set's fits go by."""
    actuation = train[0].inputs.actuation
    robot, columns = replace(dataset.robot, actuation=actuation), dataset.output_channels
    if not dataset.motion.moving:
        return ChosenTwin(twin_for(robot, actuation, columns, dataset.gravity_mps2))
    own = moving_twin_for(robot, actuation, columns, dataset.gravity_mps2)
    return _with_longer_steps(own, robot, train, columns, resolution_of(dataset))


def _with_longer_steps(
    own: MovingPrediction,
    robot: RobotSpec,
    train: Sequence[Trial],
    columns: Sequence[str],
    resolution: Mapping[str, float],
) -> ChosenTwin:
    """Return the twin with the longest steps that change outputs by little beside the noise."""
    inputs = [trial.inputs for trial in beginnings(train, SECONDS_TO_STEP_BY)]
    exact, cost_s = _computed(own, robot, inputs)
    steps = [resolution.get(name, 0.0) for name in columns]
    noise = noise_from_row_to_row([measured_of(trial, columns) for trial in train], steps)
    own_s = motion_step_s(robot)
    chosen, change = own, 0.0
    for factor in LONGER_STEPS:
        longer = replace(own, twin=MovingTwin(factor * own_s, together=2))
        outputs, spent_s = _computed(longer, robot, inputs)
        apart = float(np.max(np.sqrt(np.mean((outputs - exact) ** 2, axis=0)) / noise))
        if not apart <= STEP_SHARE:  # True where it diverged
            break
        chosen, change, cost_s = longer, apart, spent_s
    step_s = chosen.twin.timestep_s or own_s
    length_s = float(sum(item.time_s[-1] - item.time_s[0] for item in inputs))
    said = f"The robot moves, so every fit runs MuJoCo in steps of {1e3 * step_s:g} ms. "
    said += f"A simulated second takes {cost_s / length_s:.2g} s of a processor."
    if step_s > own_s:
        said += (
            f" The robot's own steps, {1e3 * own_s:g} ms, would change outputs by {change:.2g} of the noise."
        )
    return ChosenTwin(chosen, (Note("moving_twin", said),))


def _computed(predict: MovingPrediction, robot: RobotSpec, inputs: Sequence[Inputs]) -> tuple[Array, float]:
    """Return a robot's outputs along all trials, shape (r, o), and this process's time for them [s]."""
    begun = time.process_time()
    outputs = [predict([robot], item)[0] for item in inputs]  # one at a time: in this process
    return np.concatenate(outputs), time.process_time() - begun


# ----------------------------------------------------------------------------------------------------
# Where independent fits run: in this process, in others, or on a Dask cluster; finished results are kept.
# The answer does not depend on where they run. With a folder to keep results in, a run that was stopped and
# is started again takes over every call that had been finished; a result counts only once its file is
# whole. Files are named after what was asked, the package's source included, so that another question never
# finds them. They are data (`kept`): a file that is not what it must be is reported, and its result made
# again.
#
# Processes of this machine end with the one that started them, however that ends.

T = TypeVar("T")

_ROUNDS = 3  # of calls whose process was killed
_LONGEST_WAIT_S = 10.0  # for a cluster to answer
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

    `found` has the results of those that were, by their place.
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

    `call` is a function of a module. After `deadline`, on the clock of `time.monotonic` [s], no call is
    waited for once one is done.

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
        platforms.wait_for_parents_end(starter)
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


# ----------------------------------------------------------------------------------------------------
# Calls whose results are kept as far as time allows.

K = TypeVar("K")
V = TypeVar("V")


def work_out(
    place: Workers,
    deadline: float,
    store: dict[K, V],
    keys: Sequence[K],
    call: Callable[..., V],
    arguments: Sequence[tuple[Any, ...]],
) -> None:
    """Put the results of calls into `store` by their keys.

    Arguments as of `map_calls`; `keys` has one of each call.

    Raises:
        OutOfTime: before the end; what is done by then is in `store`.
    """
    try:
        found = dict(enumerate(map_calls(place, call, arguments, deadline)))
    except OutOfTime as late:
        store |= {keys[index]: item for index, item in late.found.items()}
        raise
    store |= {keys[index]: item for index, item in found.items()}


# ----------------------------------------------------------------------------------------------------
# The calibrated numbers of a fit, with their intervals.


def calibrated_numbers(
    problem: Problem,
    result: Fit,
    along_valleys: bool,
    margin: Array | None = None,
    pool: Workers = SERIAL,
) -> dict[str, FittedParameter]:
    """Return the calibrated numbers of a fit, with intervals.

    `along_valleys`: intervals by refitting all other numbers (`profile_interval`), which needs a thorough
    fit; else `margin` is as for `intervals`.
    """
    numbers = [fitted.parameter for fitted in result.numbers if not fitted.effect]
    names = [item.name for item in numbers]
    if along_valleys:
        ends = map_calls(pool, profile_interval, [(problem, result, name) for name in names])
    else:
        bounds = intervals(result, margin)
        ends = [bounds["", name] for name in names]
    return {
        item.name: FittedParameter(result.values["", item.name], end, item.null)
        for item, end in zip(numbers, ends, strict=True)
    }


# ----------------------------------------------------------------------------------------------------
# How far one step from a fit toward a larger hypothesis gets: a cheap way to rank what is worth fitting.
#
# The derivative by a term's numbers beside a fit (`tangent`) is worked out once and serves every hypothesis
# that adds this term there. By it small matrices tell what a step reaches (`foreseen`). Of the few best the
# step is computed with the full model (`reached`).


@dataclass(frozen=True)
class Tangent:
    """What a change of a fit's hypothesis does, to first order: a term more, or one less.

    Attributes:
        error: the residual with the new numbers at their start, shape (n,).
        keys: the numbers that the fit does not have, by effect and parameter; k of them.
        columns: the derivative by these, shape (n, k).
    """

    error: Array
    keys: tuple[tuple[str, str], ...]
    columns: Array
    SHAPES = "error:n keys:k columns:nk"  # of what is read (`kept`)


@dataclass(frozen=True)
class Foreseen:
    """What a step toward a hypothesis reaches, by the derivative alone.

    `cost` is the least sum of squares; `points`, shape (3, p), are where it and the same with other dampings
    lead, the best first.
    """

    cost: float
    points: Array


def beside(terms: tuple[Term, ...], extra: Term) -> tuple[Term, ...]:
    """Return `terms` with `extra`, in the place of another variant of its effect; () if not new."""
    if extra in terms:
        return ()
    return (*(term for term in terms if term.effect != extra.effect), extra)


def tangent(problem: Problem, current: Fit, term: Term) -> Tangent:
    """Return what `term` does beside `current`, in the place of another variant of its effect there."""
    return _toward(problem, current, beside(current.terms, term))


def secant(problem: Problem, current: Fit, term: Term) -> Tangent:
    """Return the same from where `term` does nothing, by changes that matter.

    A drive's zero does nothing at first where friction holds, or on one side where a tendon is slack.
    """
    numbers = fitted_numbers(problem, (term,))
    idle = {fitted.key: fitted.parameter.null for fitted in numbers}
    return _toward(problem, current, beside(current.terms, term), SECANT_STEP, idle)


def without(problem: Problem, current: Fit, term: Term) -> Tangent:
    """Return what it does to take `term` from `current`. Known-uncertain numbers that it had superseded come
    back; the others stay as they are."""
    return _toward(problem, current, tuple(item for item in current.terms if item is not term))


def _toward(
    problem: Problem,
    current: Fit,
    terms: tuple[Term, ...],
    size: float = DERIVATIVE_STEP,
    known: Mapping[tuple[str, str], float] | None = None,
) -> Tangent:
    numbers = fitted_numbers(problem, terms)
    x, high = _start(current, terms, numbers)
    old = {fitted.key for fitted in current.numbers}
    new = [index for index, fitted in enumerate(numbers) if fitted.key not in old]
    if known is not None:
        x[new] = start_of([numbers[index] for index in new], dict(known))
    step = np.where(x + size > high, -size, size)
    beside_it = x + np.diag(step)[new]
    if _does_nothing(current, numbers, x):
        error, beside_error = current.residual, residuals(problem, numbers, beside_it)
    else:
        error, *others = residuals(problem, numbers, np.concatenate([x[None], beside_it]))
        beside_error = np.array(others).reshape(len(new), len(error))
    columns = ((beside_error - error) / step[new][:, None]).T
    return Tangent(error, tuple(numbers[index].key for index in new), columns)


def _does_nothing(current: Fit, numbers: Sequence[FittedNumber], x: Array) -> bool:
    """Return whether `numbers` at `x` (p,) are those of a fit, and others at the value that does nothing."""
    mine = {fitted.key: float(value) for fitted, value in zip(current.numbers, current.x, strict=True)}
    null = start_of(numbers, {fitted.key: fitted.parameter.null for fitted in numbers})
    same = [
        mine.pop(fitted.key, nothing) == value
        for fitted, nothing, value in zip(numbers, null, x, strict=True)
    ]
    return all(same) and not mine


def foreseen(problem: Problem, current: Fit, terms: Sequence[Term], changes: Sequence[Tangent]) -> Foreseen:
    """Return what a step from `current` to the hypothesis `terms` reaches, to first order.

    `changes` are the tangents of `current` without each of the terms that `terms` lacks, then of each further
    one beside `current`.
    """
    numbers = fitted_numbers(problem, terms)
    x, _ = _start(current, terms, numbers)
    box = box_of(numbers)
    error = current.residual
    columns = {fitted.key: column for fitted, column in zip(current.numbers, current.jacobian.T, strict=True)}
    for change in changes:
        columns |= dict(zip(change.keys, change.columns.T, strict=True))
        error = error + (change.error - current.residual)
    jacobian = np.stack([columns[fitted.key] for fitted in numbers], axis=-1)
    at, task = Linearised(x, error, jacobian), FitTask(problem, numbers, box, prior_of(numbers))
    points = np.array([np.clip(x + damped_step(task, at, damping), *box) for damping in PROBE_DAMPINGS])
    errors = error + (points - x) @ jacobian.T
    costs = [task.cost(item, point) for item, point in zip(errors, points, strict=True)]
    order = np.argsort(costs, kind="stable")
    return Foreseen(costs[order[0]], points[order])


def misled(ahead: Foreseen, current: Fit, terms: Sequence[Term]) -> bool:
    """Return whether a forecast says that it makes things worse to add a term to `current`.

    A term does nothing at some value, so that its derivative, where its numbers start, tells nothing.
    """
    return set(current.terms) <= set(terms) and ahead.cost > float(current.residual @ current.residual)


def shortlist(order: Sequence[int], count: int, unknown: Collection[int]) -> list[int]:
    """Return the first `count` and `SHORTLIST` more of the hypotheses, and the `unknown` ones of the others.

    `order`: of hypotheses, best foreseen first; `unknown`: of which the forecast tells nothing.
    """
    return [index for place, index in enumerate(order) if place < count + SHORTLIST or index in unknown]


def reached(
    problem: Problem, current: Fit, terms: Sequence[Term], points: Array
) -> tuple[float, dict[tuple[str, str], float]]:
    """Return the least sum of squares at any of `points` (k, p), and the values there by effect and
    parameter.

    Where a term is added to `current` and all points are worse than it, halfway back to it counts too. A
    number that starts far from what does nothing (a width of play) may have stepped beyond what is true.
    """
    numbers = fitted_numbers(problem, terms)
    costs = (residuals(problem, numbers, points) ** 2).sum(axis=1)
    best = int(np.argmin(costs))
    cost, x = float(costs[best]), points[best]
    if not set(current.terms) <= set(terms):
        return cost, values_at(problem, terms, x)
    worse = float(current.residual @ current.residual)
    nothing = {fitted.key: fitted.parameter.null for fitted in numbers} | carried_over(current, terms)
    back = np.clip(start_of(numbers, nothing), *box_of(numbers))
    nearer = x
    for _ in range(PROBE_HALVINGS):
        if cost < worse:
            break
        nearer = 0.5 * (back + nearer)
        (error,) = residuals(problem, numbers, nearer[None])
        if error @ error < cost:
            cost, x = float(error @ error), nearer
    return cost, values_at(problem, terms, x)


def values_at(problem: Problem, terms: Sequence[Term], x: Array) -> dict[tuple[str, str], float]:
    """Return the numbers of a hypothesis at `x` (p,) in the parameters' units, by effect and parameter."""
    return {
        fitted.key: fitted.parameter.from_fit(float(value) * fitted.parameter.scale)
        for fitted, value in zip(fitted_numbers(problem, terms), x, strict=True)
    }


def _start(current: Fit, terms: Sequence[Term], numbers: Sequence[FittedNumber]) -> tuple[Array, Array]:
    """Return where a step from `current` begins, and the upper bounds, each (p,)."""
    low, high = box_of(numbers)
    return np.clip(start_of(numbers, carried_over(current, terms)), low, high), high


def carried_over(current: Fit, terms: Sequence[Term]) -> dict[tuple[str, str], float]:
    """Return the values of `current`; a common parameter's value also for each parameter that details it.
    `offset_base_1_mm` details `offset_mm`: it has the same words in the same order, and others between.
    """
    values = dict(current.values)
    for term in terms:
        for name in term.free:
            if (term.effect, name) in values:
                continue
            for (effect, common), value in current.values.items():
                if effect == term.effect and details(name, common) and common not in term.free:
                    values[effect, name] = value
    return values


def details(name: str, common: str) -> bool:
    """Return whether a parameter says for one channel or segment what another, `common`, says for all."""
    words = iter(name.split("_"))
    return all(word in words for word in common.split("_"))
