"""What pays, and what is as good: by chance counted out by hand, and by size, each rule on both its sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted import small_robot

from catheter_sim.core.effect import Parameter
from catheter_sim.diagnosis import comparison
from catheter_sim.diagnosis.comparison import as_good, choose_on_heldout, pays
from catheter_sim.diagnosis.fit import Fit
from catheter_sim.diagnosis.fitted_sets import simplest
from catheter_sim.diagnosis.noise import chance_of_gain
from catheter_sim.diagnosis.problem import FittedNumber, Problem, Term
from catheter_sim.diagnosis.thresholds import EQUAL_FACTOR, PAYS_CHANCE, PAYS_SHARE

STRETCHES, ROWS = 8, 10
BLOCK = np.repeat(np.arange(STRETCHES), ROWS)
NOBODY_LOOKS = Problem(small_robot(), (), (), (), np.zeros(0), lambda *_: np.zeros(0))


def fit_with(sizes, count: int = 0, effect: str = "stiffness") -> Fit:
    """Return a fit of so many numbers with errors of these sizes on the stretches left out, (8,) or one."""
    left_out = np.broadcast_to(np.asarray(sizes, float), (STRETCHES,))[BLOCK]
    parameters = [Parameter(f"x{k}", 0.0, -1.0, 1.0, 1.0, 0.0) for k in range(count)]
    numbers = tuple(FittedNumber(effect, item) for item in parameters)
    terms = (Term(effect, tuple(item.name for item in parameters)),)
    nothing = np.zeros((len(left_out), count))
    x, held = np.zeros(count), np.zeros(count, bool)
    return Fit(terms, numbers, x, left_out, nothing, held, BLOCK, left_out)


@pytest.mark.parametrize(
    ("change", "ways", "of"),
    [
        ([1.0] * 5, 1, 32),  # only as it is
        ([4.0, 2.0, 1.0, 0.5, 0.25], 1, 32),
        ([1.0, -1.0], 3, 4),  # all but both turned to a loss
        ([2.0, 1.0, -1.0], 3, 8),  # 2: with the first kept, three of the four ways of the others
        ([-1.0, -1.0, -1.0], 8, 8),  # a loss
    ],
)
def test_chance_counts_the_ways_to_gain_as_much(change, ways, of):
    """Every sign is as likely: the ways that give the same gain or a larger one, over all ways.

    A loss as large is no gain; the gain itself is one of the ways.
    """
    assert chance_of_gain(np.array(change)) == pytest.approx(ways / of, abs=1e-12)


def test_chance_of_many_stretches_is_that_of_their_sum():
    """Beyond what can be counted it is drawn: of 40 equal stretches, 26 that gain are a chance of 4 %."""
    change = np.where(np.arange(40) < 26, 1.0, -1.0)
    exact = sum(np.prod([(40 - k) / (k + 1) for k in range(wins)]) for wins in range(26, 41)) / 2.0**40
    assert chance_of_gain(change) == pytest.approx(exact, abs=4.0 * np.sqrt(exact / 4096))


def test_gain_pays_from_three_percent_on():
    """In every stretch alike, so that it is no chance: a little more than `PAYS_SHARE`, not a little less."""
    before = fit_with(1.0)
    assert pays(before, fit_with(1.0 - 1.1 * PAYS_SHARE))
    assert not pays(before, fit_with(1.0 - 0.9 * PAYS_SHARE))


def test_gain_pays_only_if_its_chance_is_small():
    """Of eight stretches one may lose; where two lose as much as others gain it may be chance (37 of 256)."""
    before = fit_with(1.0)
    one, two = (np.where(np.arange(STRETCHES) < count, np.sqrt(1.5), np.sqrt(0.5)) for count in (0, 2))
    assert pays(before, fit_with(one))
    assert chance_of_gain(1.0 - two**2) == pytest.approx(37 / 256)
    assert not pays(before, fit_with(two))
    assert pays(before, fit_with(two), chance=0.2)


def test_much_larger_error_is_not_as_good_though_it_may_be_chance():
    """Two stretches of eight make the whole difference, 15 % of the error: chance cannot exclude it, yet a
    set so much worse is not taken in the other's place. One stretch, 7 %, is within the rule."""
    other = fit_with(1.0)
    two, one = (fit_with(np.where(np.arange(STRETCHES) < count, 0.0, 1.0)) for count in (2, 1))
    for best, ratio, equal in ((two, np.sqrt(8 / 6), False), (one, np.sqrt(8 / 7), True)):
        assert other.cross_validated_rms / best.cross_validated_rms == pytest.approx(ratio)
        assert bool(ratio <= EQUAL_FACTOR) is equal
        assert not pays(other, best)
        assert as_good(best, other) is equal


def test_surely_larger_error_is_not_as_good_though_it_is_near():
    """5 % more in every stretch is no chance: within the size that is allowed, and yet not as good."""
    best, other = fit_with(1.0), fit_with(1.05)
    assert other.cross_validated_rms < EQUAL_FACTOR * best.cross_validated_rms
    assert not as_good(best, other)
    assert as_good(other, best)


def test_a_rough_fit_is_never_taken():
    """Of errors that are known from below alone nothing is said for it, and what is better than it pays."""
    best = fit_with(1.0)
    better, worse = (replace(fit_with(size), rough=True) for size in (0.5, 1.05))
    assert not pays(best, better)
    assert not as_good(best, better)
    assert not as_good(best, worse)
    assert pays(worse, best)
    assert not pays(better, best)


def test_of_sets_as_good_the_one_of_fewest_numbers_is_taken():
    """2 % more error and one number less; 20 % more is too much for it; of as many numbers the better one."""
    best, simpler, poor = fit_with(1.0, 3), fit_with(1.02, 2), fit_with(1.2, 1)
    assert simplest(best, [best, simpler, poor]) is simpler
    assert simplest(best, [poor]) is best
    assert simplest(best, [fit_with(0.99, 3), poor]).cross_validated_rms == pytest.approx(0.99)


@pytest.mark.parametrize("others", [1, 8])
def test_rival_among_many_must_be_better_beyond_chance_among_so_many(others, monkeypatch):
    """A gain on held-out trials whose chance is 1 % takes the place of the chosen one if it is the only
    rival; the best of eight is as good by chance."""
    chosen = fit_with(1.0, 1, "backlash")
    # The way as it is, and the one in which the stretch that loses gains.
    sizes = np.sqrt(1.0 - np.array([0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.2, -0.15]))
    chance = chance_of_gain(1.0 - sizes**2)
    assert PAYS_CHANCE / 8 < chance < PAYS_CHANCE
    better, equal = fit_with(sizes, 1, "stiffness"), fit_with(1.0, 1, "twist")
    rivals = [better, *([equal] * (others - 1))]
    monkeypatch.setattr(comparison, "map_calls", lambda pool, function, arguments: rivals)
    monkeypatch.setattr(comparison, "with_heldout_residuals", lambda test, item: item)
    taken, _ = choose_on_heldout(NOBODY_LOOKS, NOBODY_LOOKS, chosen, rivals)
    assert taken is (better if others == 1 else chosen)
