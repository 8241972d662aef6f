"""Claims about numbers that nobody would believe."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_problem import gain_problem, noisy, pulls, trial_of

from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.problem import Term
from catheter_sim.diagnosis.pruning import Pruning, implausible, soaking_notes, with_shares, without_soaking

GAIN = Term("actuation_gain", ("scale",))


def gain_of(true: float) -> Fit:
    """Return the fit of a gain to data whose gain is `true`; its bounds are 0.5 and 2."""
    pull = pulls(seed=1)
    problem = gain_problem((trial_of(pull, {"tip_x_mm": noisy(true * pull, 2)}),), 0.01, ("tip_x_mm",))
    return fit(problem, (GAIN,), cross_validate=False)


@pytest.mark.parametrize(("true", "believed"), [(1.5, True), (0.8, True), (3.0, False), (0.3, False)])
def test_a_number_at_its_bound_is_not_believed(true: float, believed: bool) -> None:
    """A gain within its bounds is, one that wants to be beyond them is not."""
    found = gain_of(true)
    assert (implausible(found) == {}) is believed


def test_a_number_beyond_what_is_likely_is_not_believed() -> None:
    """A stiffness of three times the specified one lies within its bounds, and beyond what is likely."""
    found = gain_of(1.5)
    (number,) = found.numbers
    likely = replace(number, parameter=replace(number.parameter, likely=(0.9, 1.1)))
    assert implausible(replace(found, numbers=(likely,))) == {"actuation_gain": ("scale",)}


@pytest.mark.parametrize(("true", "believed"), [(1.5, True), (3.0, False)])
def test_what_soaks_up_is_no_part_of_the_corrected_robot(true: float, believed: bool) -> None:
    """A gain at its bound is taken out, however much it gains, and said; one within its bounds stays."""
    problem, test = (
        gain_problem((trial_of(pull, {"tip_x_mm": noisy(true * pull, seed)}),), 0.01, ("tip_x_mm",))
        for pull, seed in ((pulls(seed=1), 2), (pulls(seed=3), 4))
    )
    null, found = (fit(problem, terms, cross_validate=False) for terms in ((), (GAIN,)))
    pruning = Pruning(problem, test, null, {"mm": 0.01}, "mm", False)
    left, soaked = without_soaking(pruning, with_shares(pruning, found))
    assert left.after.causes == (("actuation_gain",) if believed else ())
    assert [cause.name for cause in soaked] == ([] if believed else ["actuation_gain"])
    assert not any(cause.plausible for cause in soaked)
    assert len(soaking_notes(soaked)) == len(soaked)
    assert np.isfinite(left.by_unit["mm"].rmse_after)
