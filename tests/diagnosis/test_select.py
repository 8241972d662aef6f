"""Claims about what pays: stretches that all gain, whatever their size, are no chance."""

from __future__ import annotations

import numpy as np

from catheter_sim.diagnosis.evidence import chance_of_gain
from catheter_sim.diagnosis.fit import Fit
from catheter_sim.diagnosis.select import as_good, pays

BLOCK = np.repeat(np.arange(8), 10)


def fit_with(left_out):
    """Return a fit of which only the errors on left-out stretches matter."""
    nothing = np.zeros((len(left_out), 0))
    return Fit((), (), np.zeros(0), left_out, nothing, np.zeros(0, bool), BLOCK, np.asarray(left_out, float))


BEFORE = fit_with(np.ones(80))


def chance(after):
    """Return the probability of the gain over `BEFORE` by chance."""
    return chance_of_gain(np.bincount(BLOCK, weights=1.0 - after.left_out**2))


def test_uneven_gain_in_every_stretch_pays():
    """One stretch gains a hundred times what the others do: their mean is uncertain, its sign is not."""
    share = np.where(BLOCK == 0, 0.05, 0.99)
    assert chance(fit_with(share)) < 0.01
    assert pays(BEFORE, fit_with(share))


def test_gain_in_half_of_the_stretches_does_not_pay():
    """As much lost as won, and a little more won: chance."""
    after = np.sqrt(np.where(BLOCK % 2 == 0, 0.4, 1.4))
    assert chance(fit_with(after)) > 0.2
    assert not pays(BEFORE, fit_with(after))


def test_gain_too_small_to_matter_does_not_pay():
    """A hundredth in every stretch is certain, and not worth a cause; the two are as good."""
    after = fit_with(np.full(80, 0.99))
    assert chance(after) < 0.01
    assert not pays(BEFORE, after)
    assert as_good(after, BEFORE)
