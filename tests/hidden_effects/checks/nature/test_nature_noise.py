"""Noise is what its name says."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.lab import specimen

SIZE = np.array([0.2, 0.5])


@pytest.mark.parametrize("kind", specimen.KINDS)
def test_noise_has_about_its_size(kind):
    """The middle of its spread is that of white noise of the stated size, whatever the kind."""
    clean = np.zeros((6000, 2))
    found = specimen.measured(clean, SIZE, kind, np.random.default_rng(3))
    if kind == "quantised":  # rounding adds step / sqrt(12): up to 10 %
        np.testing.assert_allclose(np.nanstd(found, axis=0), 1.05 * SIZE, rtol=0.07)
    else:
        np.testing.assert_allclose(np.nanquantile(np.abs(found), 0.6827, axis=0), SIZE, rtol=0.05)
    assert np.isnan(found).mean() <= specimen.MOST_MISSING


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.7])
def test_coloured_noise_is_correlated_from_row_to_row(rho):
    """Its autocorrelation is rho, then rho squared; its variance stays one."""
    found = specimen.coloured(np.random.default_rng(5).normal(size=(20000, 2)), rho)
    for lag, expected in ((1, rho), (2, rho**2)):
        measured = np.mean(found[lag:] * found[:-lag])
        assert measured == pytest.approx(expected, abs=0.03)
    assert found.var() == pytest.approx(1.0, abs=0.03)


def test_outliers_are_rare_and_far():
    """About one row in a hundred lies far beyond what white noise does."""
    found = specimen.standard((20000, 1), "outliers", np.random.default_rng(7))
    far = np.abs(found) > 4.5
    assert 0.002 < far.mean() < 0.012


def test_quantised_readings_are_multiples_of_a_step():
    """There are few values, evenly spaced."""
    found = specimen.measured(np.zeros((2000, 1)), SIZE[:1], "quantised", np.random.default_rng(9))
    values = np.unique(np.round(found[np.isfinite(found)], 9))
    assert len(values) < 14
    assert np.ptp(np.diff(values)) < 1e-6
