"""Results as data: what a call returned as bytes of an NPZ file, and back, to the last bit.

A folder of kept results may come from anywhere, so reading one runs nothing. Its arrays are NPZ members
without pickle; all else is JSON beside them. The only classes that are made are the dataclasses which the
call's own annotation says that it returns. The file also holds what was asked and a checksum; whatever is
not as expected is refused (`Unusable`).
"""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
import io
import json
import math
import struct
import types
import typing
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

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

    Args:
        value: numbers, text, NumPy arrays, tuples, lists, mappings, and dataclasses that `kind` names.
        asked: name of the question that it answers.
        kind: its annotation.

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
