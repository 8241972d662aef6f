"""Plays, friction bands and slack against their limit cases."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.lab import memory

T = np.linspace(0.0, 3.0 * np.pi, 241)
U = np.column_stack([1.0 - np.cos(T), 0.4 * (1.0 - np.cos(2.0 * T))])


def test_play_of_no_width_is_nothing():
    """Every play follows exactly where its dead-band is zero."""
    assert np.array_equal(memory.play(U, 0.0), U)
    np.testing.assert_allclose(memory.smooth_play(U, 0.0), U, atol=1e-15)
    np.testing.assert_allclose(memory.soft_play(U, 0.0, 0.3), U, atol=1e-15)
    assert np.array_equal(memory.pressed(U, 0.0, 0.5), U)
    assert np.array_equal(memory.capstan(U, 0.0), U)
    assert np.array_equal(memory.slack(U, 0.0), U)


def test_play_stands_for_its_width_after_a_turn():
    """Going up it is half a width behind, coming down half a width ahead, and stands still in between."""
    found = memory.play(U[:, :1], 0.5)
    top = int(np.argmax(U[:81, 0]))
    assert found[top, 0] == pytest.approx(U[top, 0] - 0.25)
    stands = (np.arange(len(U)) > top) & (U[:, 0] > U[top, 0] - 0.5) & (np.arange(len(U)) < 120)
    assert np.ptp(found[stands, 0]) == 0.0
    low = int(np.argmin(U[81:161, 0])) + 81
    assert found[low, 0] == pytest.approx(U[low, 0] + 0.25)


def test_play_does_not_know_the_speed():
    """Rows between, on the same way, change nothing at the rows that were there."""
    fine = np.repeat(U, 2, axis=0)[:-1]
    fine[1::2] = 0.5 * (U[:-1] + U[1:])
    np.testing.assert_allclose(memory.play(fine, 0.3)[::2], memory.play(U, 0.3), atol=1e-12)


def test_smooth_play_has_the_loop_of_its_mean_and_round_corners():
    """Far from a turn it is as far behind as the play of the mean width; near it, some parts follow."""
    ramp = np.concatenate([np.linspace(0, 4, 81), np.linspace(4, 0, 81)[1:]])[:, np.newaxis]
    sharp, smooth = memory.play(ramp, 0.5), memory.smooth_play(ramp, 0.5)
    assert smooth[80, 0] == pytest.approx(sharp[80, 0])
    assert smooth[-1, 0] == pytest.approx(sharp[-1, 0])
    near = np.abs(ramp[:, 0] - 3.7) < 0.02
    assert smooth[81:][near[81:]].min() < sharp[81:][near[81:]].min() - 0.01


def test_soft_play_lets_a_share_through():
    """In the dead-band its slope is the share that passes."""
    small = 0.05 * np.sin(T)[:, np.newaxis]
    np.testing.assert_allclose(memory.soft_play(small, 0.5, 0.3), 0.3 * small, atol=1e-12)


def test_capstan_band_grows_with_the_tension_and_constant_loss_does_not():
    """Rising, Euler's loss is a share of the tension; a hole's constant one is the same everywhere."""
    rising = np.linspace(1.0, 5.0, 41)[:, np.newaxis]
    share = memory.capstan(rising, 0.2)[5:] / rising[5:]
    np.testing.assert_allclose(share, np.exp(-0.2))
    np.testing.assert_allclose(memory.hole_tensions(rising, 0.1, 3)[2, 5:], rising[5:] - 0.3)


def test_wall_does_nothing_before_it_is_touched():
    """Below the knee nothing is lost; beyond it half the band is in proportion."""
    rising = np.linspace(0.0, 2.0, 41)[:, np.newaxis]
    found = memory.pressed(rising, 0.25, 1.0)
    assert np.array_equal(found[rising <= 1.0], rising[rising <= 1.0])
    assert found[-1, 0] == pytest.approx(2.0 - 0.25)


def test_turning_points_are_counted():
    """Once at every reversal, never while the input stands."""
    u = np.array([0.0, 1.0, 1.0, 2.0, 1.0, 1.0, 0.0, 1.0])[:, np.newaxis]
    assert memory.turning_points(u)[:, 0].tolist() == [0, 0, 0, 0, 1, 1, 1, 2]
