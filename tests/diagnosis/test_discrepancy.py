"""Claims about the smooth error of unknown cause that stands beside every hypothesis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from made_problem import gain_problem, noisy, pulls, trial_of

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.fit import fit, residuals
from catheter_sim.diagnosis.probabilities import explained
from catheter_sim.diagnosis.problem import Problem

COLUMN = ("tip_x_mm",)


def left_share(error: Array, other_error: Array, pull: Array, other_pull: Array) -> float:
    """Return the share of the other trial's squared errors that the smooth error leaves."""
    train = gain_problem((trial_of(pull, {"tip_x_mm": pull + error}),), 0.01, COLUMN)
    test = replace(train, trials=(trial_of(other_pull, {"tip_x_mm": other_pull + other_error}),))
    found = fit(train, (), cross_validate=False)
    smooth = explained(train, found.residual, found.block, test)
    left = residuals(test, (), np.zeros((1, 0)))[0]
    return float(((left - smooth) ** 2).sum() / (left**2).sum())


def test_what_depends_on_the_input_is_predicted_on_other_trials() -> None:
    """Of an error that goes with the square of the input less than a twentieth is left."""
    pull, other = pulls(seed=1), pulls(seed=2)
    share = left_share(noisy(pull**2, 3), noisy(other**2, 4), pull, other)
    assert share < 0.05


def test_what_depends_on_the_direction_is_predicted_too() -> None:
    """Likewise of a loop."""
    pull, other = pulls(seed=1), pulls(seed=2)
    sides = [np.sign(np.gradient(item)) for item in (pull, other)]
    assert left_share(noisy(0.2 * sides[0], 3), noisy(0.2 * sides[1], 4), pull, other) < 0.2


def test_noise_is_not_predicted() -> None:
    """Of noise alone all is left, to within two percent."""
    pull, other = pulls(seed=1), pulls(seed=2)
    for seed in range(5):
        share = left_share(noisy(0 * pull, seed), noisy(0 * other, seed + 50), pull, other)
        assert 0.98 < share < 1.05


def test_held_out_measurements_play_no_part() -> None:
    """What is predicted for a trial does not depend on what was measured there."""
    pull, other = pulls(seed=1), pulls(seed=2)
    train = gain_problem((trial_of(pull, {"tip_x_mm": noisy(pull + pull**2, 3)}),), 0.01, COLUMN)
    found = fit(train, (), cross_validate=False)

    def predicted(measured: Array) -> Array:
        test: Problem = replace(train, trials=(trial_of(other, {"tip_x_mm": measured}),))
        return explained(train, found.residual, found.block, test)

    np.testing.assert_array_equal(predicted(other), predicted(other + 5.0))
