"""Lags, delays, slow drives and creep against closed forms and limits."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.lab import memory

T = np.concatenate([np.linspace(0.0, 5.0, 26), np.linspace(5.5, 30.0, 50)])
U = np.sin(0.4 * T)[:, np.newaxis]
STEP = np.where(T > 5.0, 1.0, 0.0)[:, np.newaxis]


@pytest.mark.parametrize("late", [memory.lag, memory.two_lags, memory.delay])
def test_no_time_is_no_lateness(late):
    """With its time to zero each of them does nothing."""
    np.testing.assert_allclose(late(T, U, 1e-7), U, atol=1e-5)


def test_unlimited_drive_follows():
    """A speed limit beyond the input's speed, or no loss, changes nothing."""
    np.testing.assert_allclose(memory.slew(T, U, 10.0), U, atol=1e-12)
    np.testing.assert_allclose(memory.viscous_loss(T, U, 0.0, 1.0), U)
    np.testing.assert_allclose(memory.stribeck(T, U, 0.0, 1.0), U)


def test_lag_answers_a_ramp_in_closed_form():
    """y = s (t - tau (1 - exp(-t / tau))): behind by tau in the end."""
    ramp = 0.3 * T[:, np.newaxis]
    expected = 0.3 * (T - 2.0 * (1.0 - np.exp(-T / 2.0)))
    np.testing.assert_allclose(memory.lag(T, ramp, 2.0)[:, 0], expected, atol=1e-12)


def test_delay_shifts():
    """A ramp arrives as much later as the delay; before it begins nothing arrives."""
    ramp = 0.3 * T[:, np.newaxis]
    np.testing.assert_allclose(memory.delay(T, ramp, 1.5)[:, 0], 0.3 * np.maximum(T - 1.5, 0.0))


def test_two_lags_are_as_late_as_one_and_start_without_slope():
    """On a long ramp both are tau behind; at its start the second order has moved less."""
    ramp = np.maximum(T - 5.0, 0.0)[:, np.newaxis]
    one, two = memory.lag(T, ramp, 2.0), memory.two_lags(T, ramp, 2.0)
    assert two[-1, 0] == pytest.approx(ramp[-1, 0] - 2.0, abs=0.02)
    start = (T > 5.0) & (T < 6.5)
    assert (two[start] < one[start]).all()


def test_slow_drive_moves_at_its_limit():
    """After a jump it goes at the speed limit, until it is there."""
    found = memory.slew(T, STEP, 0.1)
    moving = (T >= 6.0) & (T < 15.0)
    np.testing.assert_allclose(np.diff(found[moving, 0]) / np.diff(T[moving]), 0.1, atol=1e-9)
    assert found[-1, 0] == pytest.approx(1.0)


def test_stribeck_band_is_wide_when_slow_and_narrow_when_fast():
    """A slow way lags by half the width, a fast one by a fifth of that."""
    t = np.arange(0.0, 50.0, 0.5)
    for speed, share in ((0.001, 1.0), (10.0, 0.2)):
        u = speed * t[:, np.newaxis] + 1.0
        lag = u[-1, 0] - memory.stribeck(t, u, 0.4, 0.1)[-1, 0]
        assert lag == pytest.approx(0.2 * share, rel=1e-3)


def test_viscous_loss_thins():
    """At ten times the speed the loss is 10^0.6 as large, and it changes sign with the way."""
    t = np.arange(0.0, 10.0)
    slow, fast = (u - memory.viscous_loss(t, u, 0.5, 1.0) for u in (0.1 * t[:, None], t[:, None]))
    assert fast[-1, 0] / slow[-1, 0] == pytest.approx(10.0**0.6)
    back = -t[:, np.newaxis] - memory.viscous_loss(t, -t[:, np.newaxis], 0.5, 1.0)
    assert back[-1, 0] == pytest.approx(-fast[-1, 0])


def test_log_creep_goes_on_by_the_logarithm():
    """Under a held input equal factors of time add about equal amounts, over a decade and a half."""
    t = np.concatenate([[0.0, 1e-3], np.geomspace(0.5, 200.0, 60)])
    u = np.where(t > 0.0, 1.0, 0.0)[:, np.newaxis]
    found = memory.log_creep(t, u, 1.0)[:, 0]
    gains = np.diff(np.interp(np.log([1.0, 4.0, 16.0, 64.0]), np.log(t[1:]), found[1:]))
    assert gains.max() / gains.min() < 1.35
    assert memory.creep(t, u, [5.0])[-1, 0] == pytest.approx(1.0, abs=1e-6)
