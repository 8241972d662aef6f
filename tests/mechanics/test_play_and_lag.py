"""The play, and what comes late: compiled series against steps, and against what defines them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catheter_sim.mechanics.hysteresis import Past, lagged, late_step, play, play_step, played, plays

TIME_S = np.array([0.0, 0.2, 0.9, 1.0, 4.0, 4.1])
ROWS = np.array([[0.5, 0.0], [0.7, 1.0], [-0.2, 1.0], [-0.3, -1.0], [0.4, 0.2], [0.4, 0.0]])

widths = st.floats(0.0, 3.0)


@given(st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=30), widths, widths)
@settings(max_examples=60, deadline=None)
def test_two_plays_in_a_row_are_one_of_the_summed_width(
    values: list[float], first: float, second: float
) -> None:
    """Of the summed width, whatever the way, from rest in the middle."""
    rows = np.array(values)[:, None]
    np.testing.assert_allclose(play(play(rows, first), second), play(rows, first + second), atol=1e-12)


@given(st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=30), widths, st.floats(-1.0, 1.0))
@settings(max_examples=60, deadline=None)
def test_steps_of_a_play_are_its_series(values: list[float], width: float, rest: float) -> None:
    """The compiled series, steps of arrays and the kernels' scalar step, each from rest anywhere."""
    rows = np.array(values)[:, None]
    now, scalar, found = np.array([rest]), rest, []
    for row in rows:
        now = play_step(now, row, width)
        scalar = played(scalar, row[0], 0.5 * width)
        assert scalar == now[0]
        found.append(now)
    np.testing.assert_array_equal(found, play(rows, width, np.array([rest])))


def test_plays_of_one_input() -> None:
    """Several thresholds at once: out by less the threshold, and back after twice of it."""
    got = plays(np.array([1.0, 3.0, 2.0, -3.0]), np.array([0.0, 1.0, 5.0]))
    np.testing.assert_array_equal(got.T, [[1.0, 3.0, 2.0, -3.0], [0.0, 2.0, 2.0, -2.0], [0.0, 0.0, 0.0, 0.0]])


@pytest.mark.parametrize("lag_s", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("delay_s", [0.0, 0.05, 0.85, 2.5, 20.0])
def test_steps_of_what_comes_late_are_its_series(lag_s: float, delay_s: float) -> None:
    """By steps as along the whole history, from a rest that is not zero."""
    rest = np.array([0.1, -0.4])
    series = lagged(TIME_S, ROWS, lag_s, delay_s, rest)
    past, before, found = Past(lag_s, delay_s, rest), rest, []
    for row, dt in zip(ROWS, np.diff(TIME_S, prepend=0.0), strict=True):
        past, now = late_step(past, before, row, float(dt))
        before = row
        found.append(now)
    np.testing.assert_allclose(found, series, atol=1e-14)
    if delay_s == 20.0:
        np.testing.assert_array_equal(series, np.tile(rest, (len(TIME_S), 1)))


def test_the_past_is_forgotten_as_the_delay_allows() -> None:
    """A thousand steps keep no more rows than the delay spans, and without delay the last one."""
    for delay_s, most in ((0.0, 1), (1.0, 12)):
        past, before = Past(0.5, delay_s, np.zeros(1)), np.zeros(1)
        for k in range(1000):
            row = np.array([np.sin(0.1 * k)])
            past, _ = late_step(past, before, row, 0.1)
            before = row
        assert len(past.values) <= most


def test_rest_is_where_it_stays() -> None:
    """What rests at a value and does not move stays there, however late."""
    held = np.full((6, 2), 0.7)
    np.testing.assert_allclose(lagged(TIME_S, held, 0.8, 0.3, held[0]), held, atol=1e-15)
