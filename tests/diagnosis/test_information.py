"""Claims about what an experiment is expected to tell, and about who is asked."""

from __future__ import annotations

import math

import numpy as np
import pytest

from catheter_sim.diagnosis.next_experiment import MOST_OF_STRETCH, Predictive, from_refits, information

STRETCHES = np.repeat(np.arange(20), 5)
ALTERNATING = np.where(np.arange(100) % 2, 1.0, -1.0)
NONE = np.zeros((100, 0))


def between(first: Predictive, second: Predictive, weights=(0.5, 0.5)):
    return information(weights, [first, second], STRETCHES, seed=1)


def test_the_same_prediction_tells_nothing() -> None:
    """No data part hypotheses that say the same; nobody becomes sure who was not."""
    found = between(Predictive(ALTERNATING, NONE), Predictive(ALTERNATING, NONE))
    assert found.nats == pytest.approx(0.0, abs=1e-9)
    assert found.decided == 0.0


def test_far_predictions_tell_all_there_is_to_know() -> None:
    """As much as the weights leave open, their entropy, and it is settled."""
    for weights in ((0.5, 0.5), (0.8, 0.2)):
        found = between(Predictive(0.0 * ALTERNATING, NONE), Predictive(5.0 * ALTERNATING, NONE), weights)
        entropy = -sum(w * math.log(w) for w in weights)
        assert found.nats == pytest.approx(entropy, abs=0.02)
        assert found.decided == 1.0


def test_more_apart_tells_more() -> None:
    """Information rises with the distance."""
    told = [
        between(Predictive(0.0 * ALTERNATING, NONE), Predictive(size * ALTERNATING, NONE)).nats
        for size in (0.1, 0.3, 0.6, 1.5)
    ]
    assert told == sorted(told)
    assert told[0] < 0.2 < 0.6 < told[-1]


def test_what_a_rival_can_follow_tells_nothing() -> None:
    """A difference along a number that is open in both is no difference; across it, it is one."""
    number = 3.0 * ALTERNATING[:, None]
    across = np.where(np.arange(100) % 4 < 2, 1.0, -1.0)
    along = between(Predictive(5.0 * ALTERNATING, number), Predictive(0.0 * ALTERNATING, number))
    other = between(Predictive(5.0 * across, number), Predictive(0.0 * across, number))
    assert along.nats < 0.1
    assert other.nats > 0.65


def test_more_numbers_are_no_merit_and_no_fault() -> None:
    """Where one hypothesis can follow whatever the other says, data of that other one tell nothing.

    Only half of the truths can be told then, and none is told by the number of its numbers.
    """
    number = 3.0 * ALTERNATING[:, None]
    narrow, wide = Predictive(5.0 * ALTERNATING, NONE), Predictive(0.0 * ALTERNATING, number)
    assert between(narrow, wide).nats <= 0.5 * math.log(2.0) + 0.02
    assert between(narrow, wide, (0.999, 0.001)).nats < 0.01


def test_one_stretch_settles_nothing() -> None:
    """However far the hypotheses are apart there: rows of one stretch may err together."""
    alone = np.where(STRETCHES == 7, 50.0, 0.0)
    found = between(Predictive(0.0 * alone, NONE), Predictive(alone, NONE))
    at_most = 1.0 / (1.0 + math.exp(-MOST_OF_STRETCH))
    assert found.decided == 0.0
    assert found.nats <= math.log(2.0 * at_most) + 0.05


def test_fits_that_follow_everywhere_tell_nothing() -> None:
    """And those that err in every stretch tell all; in one direction alone half of it."""
    none, much = np.zeros(20), np.full(20, 9.0)
    assert from_refits((0.5, 0.5), [[none, none], [none, none]]).nats == 0.0
    both = from_refits((0.5, 0.5), [[none, much], [much, none]])
    one = from_refits((0.5, 0.5), [[none, much], [none, none]])
    assert both.nats == pytest.approx(math.log(2.0), abs=0.01)
    assert one.nats == pytest.approx(0.5 * both.nats, abs=0.01)
