"""Claims about numbers that nobody would believe."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_problem import gain_problem, noisy, pulls, trial_of

from catheter_sim.diagnosis.causes.plausible import implausible, implausible_notes, parted
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.problem import Term
from catheter_sim.diagnosis.report.result import UNEXPLAINED, Cause, FittedParameter, UnitResult
from catheter_sim.diagnosis.verdict.rules import verdict_of

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
    cause = Cause("actuation_gain", {"scale": FittedParameter(true, (true, true), 1.0)}, 50.0)
    named, absorbing = parted([cause], found)
    assert (len(named), len(absorbing)) == ((1, 0) if believed else (0, 1))
    assert all(item.plausible for item in named)
    assert not any(item.plausible for item in absorbing)
    assert len(implausible_notes(found)) == (0 if believed else 1)


def test_a_number_beyond_what_is_likely_is_not_believed() -> None:
    """A stiffness of three times the specified one lies within its bounds, and beyond what is likely."""
    found = gain_of(1.5)
    (number,) = found.numbers
    likely = replace(number, parameter=replace(number.parameter, likely=(0.9, 1.1)))
    assert implausible(replace(found, numbers=(likely,))) == {"actuation_gain": ("scale",)}


def test_nothing_is_found_by_a_cause_that_is_not_believed() -> None:
    """Errors that only such a cause lowers end as unexplained, however much it gains."""
    found, gains = gain_of(3.0), {"mm": UnitResult("mm", 0.01, 1.0, 0.011, 98.9, (97.0, 99.5))}
    pull = pulls(seed=1)
    problem = gain_problem((trial_of(pull, {"tip_x_mm": noisy(3.0 * pull, 2)}),), 0.01, ("tip_x_mm",))
    null = fit(problem, (), cross_validate=False)
    assert verdict_of(problem, null, found, gains, "mm", None) == UNEXPLAINED
    assert verdict_of(problem, null, gain_of(1.5), gains, "mm", None) == "cause_found"
    assert verdict_of(problem, null, gain_of(1.5), gains, "mm", None, harmful=True) == UNEXPLAINED
    assert np.isfinite(found.x).all()
