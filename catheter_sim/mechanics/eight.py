"""Eight numbers at once in compiled loops, and linear equations of them."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import (
    intrinsic,
    lower_builtin,
    lower_cast,
    models,
    overload,
    register_jitable,
    register_model,
)
from numba.np.arrayobj import make_array, populate_array

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled_in_place
from catheter_sim.mechanics.vectors import solve_columns

# ----------------------------------------------------------------------------------------------------
# Eight numbers as one in compiled code: each sum, product or root is one of the processor's vectors.
#
# A loop written for arrays of numbers works on eight problems side by side where its arrays hold `eight`s:
# an array of floats with a last axis of 8 becomes one by `eights`. The functions below are written for
# both, for floats and eights, in place of the comparisons that eight numbers answer differently.
#
# What a kernel makes for itself has its arguments' type: `room((3,), x)`.

LANES = 8
_DOUBLE, _INT = ir.DoubleType(), ir.IntType(32)
_VECTOR = ir.VectorType(_DOUBLE, LANES)
_NONE = ir.Constant(_VECTOR, ir.Undefined)
_SINGLE = (types.Float, types.Integer)  # what becomes eight equal numbers


class _Eight(types.Type):
    """The type of eight numbers in the compiler."""

    def __init__(self) -> None:
        super().__init__(name="eight")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        return Conversion.safe if isinstance(other, _SINGLE) else None


eight = _Eight()


@register_model(_Eight)
class _EightModel(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: Any) -> None:
        super().__init__(manager, fe_type, _VECTOR)


def _vector(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Return a value as a vector."""
    if kind == eight:
        return value
    number = context.cast(builder, value, kind, types.float64)
    first = builder.insert_element(_NONE, number, ir.Constant(_INT, 0))
    return builder.shuffle_vector(first, _NONE, ir.Constant(ir.VectorType(_INT, LANES), [0] * LANES))


@lower_cast(types.Float, eight)
@lower_cast(types.Integer, eight)
def _as_eight(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    return _vector(context, builder, fromty, value)


def _add_operator(symbol: Callable[..., Any], instruction: str) -> None:
    """Let an operator take eights, or one of them and a number."""

    @infer_global(symbol)
    class _Typed(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            known = all(kind == eight or isinstance(kind, _SINGLE) for kind in args)
            return signature(eight, *args) if len(args) == 2 and eight in args and known else None

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pair = (_vector(context, builder, kind, value) for kind, value in zip(sig.args, args, strict=True))
        # A product and a sum after it may become one instruction, which rounds once in the place of twice.
        return getattr(builder, instruction)(*pair, flags=("contract",))

    for kinds in ((eight, eight), *((eight, one) for one in _SINGLE), *((one, eight) for one in _SINGLE)):
        lower_builtin(symbol, *kinds)(lowered)


for _symbols, _instruction in (
    ((operator.add, operator.iadd), "fadd"),
    ((operator.sub, operator.isub), "fsub"),
    ((operator.mul, operator.imul), "fmul"),
    ((operator.truediv, operator.itruediv), "fdiv"),
):
    for _symbol in _symbols:
        _add_operator(_symbol, _instruction)


@infer_global(operator.neg)
class _NegativeTyped(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(eight, eight) if args == (eight,) else None


@lower_builtin(operator.neg, eight)
def _negative(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fneg(args[0])


def _built_in(function: Callable[..., Any]) -> Any:
    """Return a function of the compiler; callers leave its first argument out."""
    return intrinsic(function)


@_built_in
def eights(typingctx: Any, array: Any) -> Any:
    """Return an array of floats, shape (..., 8), as one of eights, shape (...); they share their numbers."""
    out = types.Array(eight, array.ndim - 1, "C", aligned=False)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        source, view = make_array(array)(context, builder, args[0]), make_array(out)(context, builder)
        populate_array(
            view,
            data=builder.bitcast(source.data, view.data.type),
            shape=cgutils.unpack_tuple(builder, source.shape)[:-1],
            strides=cgutils.unpack_tuple(builder, source.strides)[:-1],
            itemsize=context.get_constant(types.intp, 8 * LANES),
            meminfo=source.meminfo,
            parent=None,
        )
        return impl_ret_borrowed(context, builder, out, view._getvalue())

    return out(array), codegen


@register_jitable
def floats_in_line(size: int) -> Any:
    """Return `size` new floats that begin where one of the processor's lines of 64 bytes does.

    Vectors that lie across two lines take twice as long to fetch. The floats' values are any.
    """
    flat = np.empty(size + LANES - 1)
    first = (-(flat.ctypes.data // 8)) % LANES
    return flat[first : first + size]


@register_jitable
def floats_of_eights(shape: Any) -> Any:
    """Return new floats, shape (..., 8), for `eights`; their values are any."""
    size = LANES
    for length in shape:
        size *= length
    return floats_in_line(size).reshape((*shape, LANES))


@register_jitable
def take_lane(source: Any, i: int, row: Any) -> None:
    """Write what lane i of floats, shape (..., 8), holds into `row`, shape (...)."""
    flat, to = source.reshape(-1, LANES), row.reshape(-1)
    for k in range(len(flat)):
        to[k] = flat[k, i]


def room(shape: Any, like: Any) -> Any:
    """Return a new array of a shape, a tuple, of what `like` holds, floats or eights; its numbers are any."""
    return np.empty(shape, like.dtype)


@overload(room, strict=False)
def _overload_room(shape: Any, like: Any) -> Any:
    if like.dtype != eight:
        return lambda shape, like: np.empty(shape)

    def of_eight(shape: Any, like: Any) -> Any:
        return eights(floats_of_eights(shape))

    return of_eight


def _of_one(name: str) -> Any:
    """Return a function of eights that LLVM knows by a name."""

    @_built_in
    def function(typingctx: Any, a: Any) -> Any:
        def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            kind = ir.FunctionType(_VECTOR, [_VECTOR])
            return builder.call(
                cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64"), args
            )

        return eight(eight), codegen

    return function


_sqrt, _abs, _rint = _of_one("sqrt"), _of_one("fabs"), _of_one("rint")


@overload(math.sqrt, strict=False)
def _overload_sqrt(x: Any) -> Any:
    return (lambda x: _sqrt(x)) if x == eight else None


@overload(abs, strict=False)
def _overload_abs(x: Any) -> Any:
    return (lambda x: _abs(x)) if x == eight else None


@_built_in
def _select_less(typingctx: Any, a: Any, b: Any, x: Any, y: Any) -> Any:
    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b, x, y = (
            _vector(context, builder, kind, value) for kind, value in zip(sig.args, args, strict=True)
        )
        return builder.select(builder.fcmp_ordered("<", a, b), x, y)

    return eight(a, b, x, y), codegen


@_built_in
def lane(typingctx: Any, a: Any, index: Any) -> Any:
    """Return one of eight numbers."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.extract_element(args[0], builder.trunc(args[1], _INT))

    return types.float64(eight, types.intp), codegen


@_built_in
def _with_lane(typingctx: Any, a: Any, index: Any, value: Any) -> Any:
    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.insert_element(args[0], args[2], builder.trunc(args[1], _INT))

    return eight(eight, types.intp, types.float64), codegen


def select_less(a: Any, b: Any, x: Any, y: Any) -> Any:
    """Return `x` where a < b, else `y`."""
    return x if a < b else y


@overload(select_less, strict=False)
def _overload_select_less(a: Any, b: Any, x: Any, y: Any) -> Any:
    if eight in (a, b, x, y):
        return lambda a, b, x, y: _select_less(a, b, x, y)
    return lambda a, b, x, y: x if a < b else y


@register_jitable
def larger(a: Any, b: Any) -> Any:
    """Return the larger of two numbers."""
    return select_less(a, b, b, a)


def all_less(a: Any, b: float) -> bool:
    """Return whether all of `a` is less than `b`."""
    return bool(a < b)


@overload(all_less, strict=False)
def _overload_all_less(a: Any, b: Any) -> Any:
    if a != eight:
        return lambda a, b: a < b

    def of_eight(a: Any, b: Any) -> bool:
        result = True
        for i in range(LANES):
            result = result and lane(a, i) < b
        return result

    return of_eight


@register_jitable
def all_zero(a: Any) -> bool:
    """Return whether all of `a` is zero."""
    return all_less(abs(a), 5e-324)


def plane_angle(y: Any, x: Any) -> Any:
    """Return atan2(y, x)."""
    return math.atan2(y, x)


@overload(plane_angle, strict=False)
def _overload_plane_angle(y: Any, x: Any) -> Any:
    if eight not in (y, x):
        return lambda y, x: math.atan2(y, x)

    def of_eight(y: Any, x: Any) -> Any:
        result = y
        for i in range(LANES):
            result = _with_lane(result, i, math.atan2(lane(y, i), lane(x, i)))
        return result

    return of_eight


def exponential(x: Any) -> Any:
    """Return exp(x)."""
    return math.exp(x)


@overload(exponential, strict=False)
def _overload_exponential(x: Any) -> Any:
    if x != eight:
        return lambda x: math.exp(x)

    def of_eight(x: Any) -> Any:
        result = x
        for i in range(LANES):
            result = _with_lane(result, i, math.exp(lane(x, i)))
        return result

    return of_eight


def sine_cosine(x: Any) -> tuple[Any, Any]:
    """Return sin(x) and cos(x); of eights within 1e-15 for angles below 1e4 rad."""
    return math.sin(x), math.cos(x)


# pi / 2 in two parts, the first of 26 bits so that a whole number times it is exact.
_QUARTER = math.floor(math.pi / 2 * 2**25) / 2**25
_QUARTER_REST = math.pi / 2 - _QUARTER + 6.123233995736766e-17  # and what a float leaves of pi / 2


@overload(sine_cosine, strict=False)
def _overload_sine_cosine(x: Any) -> Any:
    if x != eight:
        return lambda x: (math.sin(x), math.cos(x))

    def of_eight(x: Any) -> Any:
        quarters = _rint(x * (2.0 / math.pi))
        r = (x - quarters * _QUARTER) - quarters * _QUARTER_REST
        s = r * r
        # Taylor's series: the next terms are below 1e-16 of the sum for |r| <= pi / 4.
        sine = 1.0 - s * (1.0 / 210.0)
        sine = 1.0 - s * (1.0 / 156.0) * sine
        sine = 1.0 - s * (1.0 / 110.0) * sine
        sine = 1.0 - s * (1.0 / 72.0) * sine
        sine = 1.0 - s * (1.0 / 42.0) * sine
        sine = 1.0 - s * (1.0 / 20.0) * sine
        sine = r - r * (s * (1.0 / 6.0) * sine)
        cosine = 1.0 - s * (1.0 / 240.0)
        cosine = 1.0 - s * (1.0 / 182.0) * cosine
        cosine = 1.0 - s * (1.0 / 132.0) * cosine
        cosine = 1.0 - s * (1.0 / 90.0) * cosine
        cosine = 1.0 - s * (1.0 / 56.0) * cosine
        cosine = 1.0 - s * (1.0 / 30.0) * cosine
        cosine = 1.0 - s * (1.0 / 12.0) * cosine
        cosine = 1.0 - s * (1.0 / 2.0) * cosine
        # Turn by whole quarters: (sine, cosine) -> (cosine, -sine) each.
        halves = _rint(quarters * 0.5 - 0.25)
        odd = quarters - 2.0 * halves
        sign = 1.0 - 2.0 * abs(halves - 2.0 * _rint(halves * 0.5))
        turned_sine = select_less(0.5, odd, cosine, sine)
        turned_cosine = select_less(0.5, odd, -sine, cosine)
        return sign * turned_sine, sign * turned_cosine

    return of_eight


# ----------------------------------------------------------------------------------------------------
# Linear systems of eights: eight small dense systems solved side by side.


@compiled_in_place
def _solve_columns_of_eights(matrix: Array, right: Array) -> bool:
    """Solve as `solve_columns` does; each of the eight systems has its own exchange of rows.

    A singular one gives numbers that are not finite. Returns True.
    """
    size, columns = right.shape
    for i in range(size):
        for k in range(i + 1, size):  # the largest pivot comes up to row i
            own, other = abs(matrix[i, i]), abs(matrix[k, i])
            for j in range(i, size):
                upper, lower = matrix[i, j], matrix[k, j]
                matrix[i, j] = select_less(own, other, lower, upper)
                matrix[k, j] = select_less(own, other, upper, lower)
            for j in range(columns):
                upper, lower = right[i, j], right[k, j]
                right[i, j] = select_less(own, other, lower, upper)
                right[k, j] = select_less(own, other, upper, lower)
        inverse = 1.0 / matrix[i, i]
        for k in range(i + 1, size):
            factor = matrix[k, i] * inverse
            for j in range(i + 1, size):
                matrix[k, j] -= factor * matrix[i, j]
            for j in range(columns):
                right[k, j] -= factor * right[i, j]
        matrix[i, i] = inverse
    for i in range(size - 1, -1, -1):
        for j in range(columns):
            total = right[i, j]
            for k in range(i + 1, size):
                total -= matrix[i, k] * right[k, j]
            right[i, j] = total * matrix[i, i]
    return True


def solve_columns_of_any(matrix: Any, right: Any) -> bool:
    """Solve matrix @ x = right for floats or eights; x replaces `right`; see `linear.solve_columns`."""
    return bool(solve_columns(matrix, right))


@overload(solve_columns_of_any, strict=False)
def _overload_solve_columns(matrix: Any, right: Any) -> Any:
    if matrix.dtype == eight:
        return lambda matrix, right: _solve_columns_of_eights(matrix, right)
    return lambda matrix, right: solve_columns(matrix, right)
