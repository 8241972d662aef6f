"""Kept results are data: they come back to the last bit, and nothing else comes out of a file."""

from __future__ import annotations

import io
import json
import math
import os
import pickle
import struct
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catheter_sim.core.effect import Parameter
from catheter_sim.diagnosis import workers
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.intervals import profile_interval
from catheter_sim.diagnosis.next_experiment import _refitted
from catheter_sim.diagnosis.problem import FittedNumber, Term
from catheter_sim.diagnosis.verdict import Replay, replay
from catheter_sim.diagnosis.workers import Unusable, packed, reached, returned, unpacked

ASKED = "0" * 40 + ".npz"
NOT_A_NUMBER = struct.unpack(">d", bytes.fromhex("fff8000000000123"))[0]  # with a sign and a message in it


def a_fit() -> Fit:
    """Return a fit of two numbers to five residuals, with every awkward number in it."""
    free = FittedNumber(
        "backlash", Parameter("width_mm", -0.0, 0.1, math.inf, 1e-300, 0.1 + 0.2, True), math.inf
    )
    jacobian = np.array([[1.0, -0.0, np.nan, np.inf, 5e-324], [0.0, 1.0, 2.0, 3.0, 4.0]]).T
    return Fit(
        terms=(Term("backlash", ("width_mm",)),),
        numbers=(FittedNumber("", replace(free.parameter, null=NOT_A_NUMBER)), free),
        x=np.array([0.1, -0.0]),
        residual=np.arange(5.0),
        jacobian=jacobian,
        held=np.array([True, False]),
        block=np.arange(5),
        left_out=np.arange(10.0)[::2],
    )


def same(one: Any, other: Any) -> bool:
    """Return whether two values are one: types, bits, the order of keys, how arrays lie in memory."""
    return pickle.dumps(_bits(one)) == pickle.dumps(_bits(other))


def _bits(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return type(value).__name__, value.dtype.str, value.shape, value.flags.fnc, value.tobytes()
    if isinstance(value, float):
        return "float", struct.pack(">d", value)
    if isinstance(value, dict):
        return "dict", [(_bits(key), _bits(item)) for key, item in value.items()]
    if isinstance(value, list | tuple):
        return type(value).__name__, [_bits(item) for item in value]
    if hasattr(value, "__dataclass_fields__"):
        return type(value).__name__, [(name, _bits(getattr(value, name))) for name in vars(value)]
    return type(value).__name__, repr(value)


def there_and_back(value: Any, kind: Any = Any) -> Any:
    return unpacked(packed(value, ASKED, kind), ASKED, kind)


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (a_fit(), returned(fit)),
        ((a_fit(), 2.5), returned(_refitted)),
        ((0.1 + 0.2, {("b", "y"): -0.0, ("a", "x"): math.inf, ("", "z"): 1e-320}), returned(reached)),
        ((-math.inf, 3), returned(profile_interval)),
        (Replay(np.full((3, 2), np.nan), np.ones((3, 2), order="F"), "why", 1), returned(replay)),
        (Replay(np.zeros((0, 2)), np.zeros((0, 2)), None, 0), returned(replay)),
        ([Replay(np.zeros((1, 1)), np.zeros((1, 1)), None, 0)], list[Replay]),
    ],
    ids=["fit", "refitted", "probe", "interval", "replay", "no rows", "replays"],
)
def test_what_is_kept_comes_back_to_the_last_bit(value: Any, kind: Any) -> None:
    """Every kind of result that a diagnosis keeps; made again, the file is the same."""
    again = there_and_back(value, kind)
    assert same(again, value)
    assert packed(again, ASKED, kind) == packed(value, ASKED, kind)


_NUMBERS = st.one_of(st.integers(), st.floats(width=64), st.booleans(), st.none(), st.text(), st.binary())
_VALUES = st.recursive(
    _NUMBERS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.lists(inner, max_size=3).map(tuple),
        st.dictionaries(st.one_of(st.text(), st.tuples(st.text(), st.integers())), inner, max_size=3),
    ),
    max_leaves=8,
)


@settings(max_examples=40, deadline=None)
@given(value=_VALUES)
def test_plain_values_come_back_as_they_were(value: Any) -> None:
    """A call that does not say what it returns may return numbers, text, bytes and what holds them."""
    assert same(there_and_back(value), value)


@pytest.mark.parametrize("dtype", ["f8", "f4", "i8", "u1", "?", "c16", ">f8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_arrays_keep_type_and_layout(dtype: str, order: Any) -> None:
    """Sums depend on how an array lies in memory: Fortran's order stays Fortran's; scalars stay scalars."""
    array = np.asarray(np.arange(24).reshape(2, 3, 4) % 5, dtype=dtype, order=order)
    for value in (array, array[1, 2, 3], array[0, 0, 0].reshape(()), array[:, :0]):
        assert same(there_and_back(value), value)
    assert there_and_back(array).flags.writeable


@pytest.mark.parametrize("value", [object(), {1, 2}, np.array([None]), np.array(["a"]), a_fit(), len])
def test_what_no_annotation_names_is_not_kept(value: Any) -> None:
    """A call that returns something else is a defect, found when it is made, not when it is read."""
    with pytest.raises(TypeError, match="cannot be kept"):
        packed(value, ASKED)


class Trap:
    """What a pickle may do: it makes a folder when it is read."""

    def __init__(self, path: str) -> None:
        self.path = path

    def __reduce__(self) -> Any:
        return os.mkdir, (self.path,)


def object_archive(trap: Trap) -> bytes:
    """Return an NPZ file that holds a pickle in an array of objects, where a result has its skeleton."""
    buffer = io.BytesIO()
    np.savez(buffer, skeleton=np.array([trap], dtype=object), checksum=np.array([trap], dtype=object))
    return buffer.getvalue()


def object_array(trap: Trap) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.array([trap], dtype=object), allow_pickle=True)
    return buffer.getvalue()


@pytest.mark.parametrize("hostile", [pickle.dumps, object_archive, object_array])
def test_a_file_runs_nothing(hostile: Any, tmp_path: Any) -> None:
    """Pickles, bare or in arrays of objects, are refused unread."""
    content = hostile(Trap(str(tmp_path / "ran")))
    with pytest.raises(Unusable):
        unpacked(content, ASKED, returned(fit))
    assert list(tmp_path.iterdir()) == []


def test_a_file_cut_short_or_changed_is_refused() -> None:
    """Cut at any byte, or with any byte changed, it is no result, or (an unread byte) still the same one."""
    value, kind = (1.5, {("a", "b"): 2.5}), returned(reached)
    content = packed(value, ASKED, kind)
    for end in range(len(content)):
        with pytest.raises(Unusable):
            unpacked(content[:end], ASKED, kind)
    for place in range(0, len(content), 3):
        changed = bytearray(content)
        changed[place] ^= 0x15
        with suppress(Unusable):
            assert same(unpacked(bytes(changed), ASKED, kind), value)


def test_the_answer_to_another_question_is_refused() -> None:
    """A whole file under another name is no answer to that name's question."""
    with pytest.raises(Unusable, match="checksum"):
        unpacked(packed(1.5, ASKED), "1" + ASKED[1:])


def forged(skeleton: Any, arrays: Mapping[str, np.ndarray], compress: bool = False) -> bytes:
    """Return a file with a right checksum around any content."""
    text = skeleton if isinstance(skeleton, str) else json.dumps(skeleton)
    checksum = workers._checksum(ASKED, text, arrays)
    members = {**arrays, "skeleton": workers._bytes_array(text.encode()), "checksum": checksum}
    buffer = io.BytesIO()
    (np.savez_compressed if compress else np.savez)(buffer, **members)
    return buffer.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        forged("[" * 100_000, {}),
        forged("not JSON", {}),
        forged({"array": 0}, {}),
        forged({"object": ["Parameter", {}]}, {}),
        forged({"object": ["Path", {"x": 1}]}, {}),
        forged({"object": ["Term", {"effect": "backlash"}]}, {}),
        forged({"call": ["os.system", "true"]}, {}),
        forged({"float": "00"}, {}),
        forged({"tuple": 3}, {}),
        forged({"dict": [[[], 1]]}, {}),
        forged({"tuple": [1.0, {"dict": []}], "list": []}, {}),
        forged({"array": 0}, {"array_0": np.zeros(100_000)}, compress=True),
        b"",
        b"PK\x05\x06" + bytes(18),
    ],
)
def test_a_file_made_to_deceive_is_refused(content: bytes) -> None:
    """The checksum is no secret: what it covers is looked at too."""
    with pytest.raises(Unusable):
        unpacked(content, ASKED, returned(fit))


def test_a_small_file_cannot_ask_for_much_memory() -> None:
    """A header may claim any shape: what is not in the file is not made."""
    buffer = io.BytesIO()
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }"
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in ("skeleton", "checksum", "array_0"):
            start = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header) + 1)
            archive.writestr(f"{name}.npy", start + header + b"\n")
    with pytest.raises(Unusable):
        unpacked(buffer.getvalue(), ASKED)


def misshapen() -> list[Fit]:
    """Return fits whose parts do not belong together."""
    whole = a_fit()
    return [
        replace(whole, x=np.zeros(3)),
        replace(whole, jacobian=whole.jacobian.T),
        replace(whole, jacobian=whole.jacobian[:, 0]),
        replace(whole, left_out=np.zeros(4)),
        replace(whole, numbers=whole.numbers[:1]),
        replace(whole, residual=np.arange(5)),
        replace(whole, terms=[*whole.terms]),  # type: ignore[arg-type]
        replace(whole, terms=(Term("backlash", (1.5,)),)),  # type: ignore[arg-type]
        replace(whole, x="far"),  # type: ignore[arg-type]
    ]


@pytest.mark.parametrize("value", [*misshapen(), 1.5, None, (a_fit(), 1.0), [a_fit()]])
def test_another_kind_of_result_is_refused(value: Any) -> None:
    """What is read is of the kind that the call returns, down to the types and shapes of its arrays."""
    content = packed(value, ASKED, tuple[Fit, float])
    with pytest.raises(Unusable):
        unpacked(content, ASKED, returned(fit))
    assert same(unpacked(packed(a_fit(), ASKED, Fit), ASKED, returned(fit)), a_fit())


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        ((1.0, "x"), tuple[float, float]),
        ((1.0,), tuple[float, float]),
        (True, float),
        (None, float),
        ({("a", 1): 1.0}, dict[tuple[str, str], float]),
        ({("a", "b"): "1"}, dict[tuple[str, str], float]),
        (["a"], list[float]),
        (1.5, str | None),
        (1.5, int),
    ],
)
def test_other_numbers_than_those_promised_are_refused(value: Any, kind: Any) -> None:
    """Tuples by their length, mappings by keys and values."""
    content = packed(value, ASKED, kind)
    with pytest.raises(Unusable):
        unpacked(content, ASKED, kind)


def test_what_an_alias_stands_for_is_kept() -> None:
    """From Python 3.12 on NumPy's `NDArray` is an alias whose meaning is its `__value__`."""

    class Alias:
        __value__ = np.ndarray

    array = np.arange(3.0)
    kept = unpacked(packed(array, "asked", Alias()), "asked", Alias())
    np.testing.assert_array_equal(kept, array)
    with pytest.raises(Unusable, match="where ndarray is due"):
        unpacked(packed("text", "asked", Alias()), "asked", Alias())
