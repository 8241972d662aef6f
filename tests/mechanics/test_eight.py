"""Eight numbers at once: the same answers as one by one, for the arithmetic and for linear systems."""

from __future__ import annotations

from typing import Any

import numpy as np

from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.eight import (
    LANES,
    all_less,
    all_zero,
    eights,
    exponential,
    floats_of_eights,
    lane,
    larger,
    plane_angle,
    room,
    select_less,
    sine_cosine,
    solve_columns_of_any,
    take_lane,
)

RNG = np.random.default_rng(20)


@compiled
def _functions(a: Any, out: Any) -> None:
    x, y = eights(a), eights(out)
    y[0], y[1] = sine_cosine(x[0])
    y[2], y[3] = exponential(x[1]), plane_angle(x[0], x[1])
    y[4], y[5] = larger(x[0], x[1]), select_less(x[0], 1.0, x[1], 2.0)
    y[6] = -(3 * x[0] - x[1] / 2.0) + abs(x[1])
    made = room((2, 3), x)
    made[1, 2] = x[0]
    made[1, 2] *= x[0]
    y[7] = made[1, 2]


def test_functions_are_those_of_each_number() -> None:
    for size in (1e-3, 1.0, 30.0, 3000.0):
        a = RNG.uniform(-size, size, (2, LANES))
        a[1] = np.clip(a[1], -5.0, 5.0)
        out = np.zeros((8, LANES))
        _functions(a, out)
        x, y = a
        want = [
            np.sin(x),
            np.cos(x),
            np.exp(y),
            np.arctan2(x, y),
            np.maximum(x, y),
            np.where(x < 1.0, y, 2.0),
        ]
        want += [-(3 * x - y / 2) + abs(y), x * x]
        assert np.allclose(out, want, rtol=1e-15, atol=1e-15 * max(1.0, size))


def test_sine_and_cosine_at_whole_quarters() -> None:
    out = np.zeros((8, LANES))
    for first in (-40, -3, 0, 5, 400):
        x = (first + np.arange(LANES)) * np.pi / 4
        _functions(np.array([x, np.ones(LANES)]), out)
        assert np.allclose(out[:2], [np.sin(x), np.cos(x)], rtol=0.0, atol=2e-16)


@compiled
def _questions(a: Any) -> tuple[bool, bool, bool, float]:
    x = eights(a)
    return all_less(x[0], 1.0), all_zero(x[0]), all_zero(x[0] - x[0]), lane(x[0], 3)


def test_all_means_every_lane() -> None:
    a = np.zeros((1, LANES))
    assert _questions(a) == (True, True, True, 0.0)
    a[0, 3] = 1e-300
    assert _questions(a) == (True, False, True, 1e-300)
    a[0, 3] = 1.0
    assert _questions(a)[0] is False
    a[0, 3] = np.nan
    assert _questions(a)[:3] == (False, False, False)


@compiled
def _solved(matrix: Any, right: Any) -> None:
    solve_columns_of_any(eights(matrix), eights(right))


def test_each_lane_solves_its_own_system_with_its_own_exchange_of_rows() -> None:
    matrix = RNG.normal(size=(6, 6, LANES))
    for i in range(LANES):  # a zero first pivot wants an exchange, of another row in each lane
        matrix[: i % 6, 0, i] = 0.0
    right = RNG.normal(size=(6, 2, LANES))
    want = np.stack([np.linalg.solve(matrix[..., i], right[..., i]) for i in range(LANES)], axis=-1)
    _solved(matrix, right)
    assert np.allclose(right, want, rtol=1e-10, atol=1e-10)


def test_a_singular_lane_spoils_no_other() -> None:
    matrix = RNG.normal(size=(3, 3, LANES))
    matrix[..., 2] = 1.0
    right = RNG.normal(size=(3, 1, LANES))
    want = [np.linalg.solve(matrix[..., i], right[..., i]) for i in range(LANES) if i != 2]
    _solved(matrix, right)
    assert not np.isfinite(right[..., 2]).all()
    assert np.allclose(np.delete(right, 2, axis=-1), np.stack(want, axis=-1), rtol=1e-9)


def test_a_lane_is_taken_out() -> None:
    numbers, row = np.arange(2.0 * 3 * LANES).reshape(2, 3, LANES), np.zeros((2, 3))
    compiled(take_lane)(numbers, 5, row)
    assert np.array_equal(row, numbers[..., 5])


@compiled
def _new_floats() -> Any:
    return floats_of_eights((2, 3))


def test_new_floats_begin_with_a_line_of_the_processor() -> None:
    for _ in range(5):
        made = _new_floats()
        assert made.shape == (2, 3, LANES)
        assert made.ctypes.data % 64 == 0
