"""Claims about hypotheses that make something worse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from made_problem import gain_problem, noisy, pulls, trial_of

from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.problem import Problem, Term
from catheter_sim.diagnosis.verdict import harm_note, harms

COLUMNS = ("tip_x_mm", "tip_y_mm")
GAIN = Term("actuation_gain", ("scale",))


def fitted(second: float) -> tuple[Problem, Fit, Fit]:
    """Return the held-out problem and the fits without and with a gain.

    The first output follows the input 1.5 times, with a hundred times the weight of the second, which follows
    it `second` times.
    """
    parts = []
    for seed, file in ((1, "a.csv"), (2, "b.csv")):
        pull = pulls(seed=seed)
        outputs = {"tip_x_mm": noisy(1.5 * pull, seed), "tip_y_mm": noisy(second * pull, seed + 10)}
        parts.append(trial_of(pull, outputs, file))
    train = replace(gain_problem(tuple(parts[:1]), 0.01, COLUMNS), weight=np.array([0.01, 1.0]))
    test = replace(train, trials=tuple(parts[1:]))
    return test, fit(train, (), cross_validate=False), fit(train, (GAIN,), cross_validate=False)


def test_an_output_that_gets_worse_is_found() -> None:
    """A gain that is right for the first output and wrong for the second does harm there, and there alone."""
    test, before, after = fitted(second=1.0)
    found = harms(test, before, after, {"mm": 0.01})
    assert [item.what for item in found] == ["tip_y_mm"]
    assert found[0].after > 10 * found[0].before
    assert "tip_y_mm" in harm_note(after, found).text


def test_a_right_hypothesis_does_no_harm() -> None:
    """Where both outputs follow 1.5 times, nothing gets worse."""
    test, before, after = fitted(second=1.5)
    assert harms(test, before, after, {"mm": 0.01}) == ()


def test_a_rise_within_the_noise_is_no_harm() -> None:
    """The same rise is none where the noise is as large."""
    test, before, after = fitted(second=1.0)
    assert harms(test, before, after, {"mm": 1.0}) == ()
