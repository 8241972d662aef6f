"""Claims about the verdict: when a cause is named, and when what it leaves speaks against it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.core.effect import Parameter
from catheter_sim.diagnosis.fit import Fit
from catheter_sim.diagnosis.intervals import cause_intervals
from catheter_sim.diagnosis.problem import FittedNumber, Term
from catheter_sim.diagnosis.pruning import needed, not_significant, weakest_cause, without_support
from catheter_sim.diagnosis.result import Cause, StructureTest, UnitResult
from catheter_sim.diagnosis.verdict import (
    gains_surely,
    most_error_remains,
    remainder_note,
    structured_remainder,
)

RESULT = UnitResult("mm", 0.1, 5.0, 0.6, 88.0, (85.0, 90.0))
HANGING = StructureTest("input", "tension_right_N", 45.0, 0.001)


def test_structure_left_well_above_the_noise_speaks_against_the_causes():
    """Six times the noise, 12 % of the error before, nearly half of it hanging on the input."""
    assert structured_remainder(RESULT, [HANGING], 1) is HANGING


@pytest.mark.parametrize(
    ("result", "test"),
    [
        (replace(RESULT, rmse_after=0.18), HANGING),
        (replace(RESULT, rmse_after=0.3), HANGING),
        (RESULT, replace(HANGING, p_value=0.2)),
        (RESULT, replace(HANGING, share_percent=8.0)),
    ],
    ids=["near the noise", "small beside the error before", "chance", "hangs on nothing much"],
)
def test_what_is_left_may_be_left(result, test):
    """Noise, a small rest of a large error, and a rest without much structure are no objection."""
    assert structured_remainder(result, [test], 1) is None


def test_strongest_dependence_is_told():
    """Of several, the one that most of the rest hangs on."""
    weaker = StructureTest("position", "each output's own", 30.0, 0.001)
    assert structured_remainder(RESULT, [weaker, HANGING], 1) is HANGING


def test_several_causes_must_come_nearer_to_the_noise_than_one():
    """Together they imitate more: 1.8 times the noise, hanging on the input, is one's own but not theirs."""
    result = replace(RESULT, rmse_before=1.0, rmse_after=0.18)
    assert structured_remainder(result, [HANGING], 1) is None
    assert structured_remainder(result, [HANGING], 2) is HANGING
    assert structured_remainder(replace(result, rmse_after=0.14), [HANGING], 2) is None


@pytest.mark.parametrize(
    ("rmse_after", "most"),
    [(2.6, True), (2.4, False), (0.45, False)],
    ids=["less than half taken", "more than half taken", "near the noise"],
)
def test_most_of_a_large_error_left_speaks_against_the_causes(rmse_after, most):
    """Causes that take the smaller part of an error and leave five times the noise are not what is wrong."""
    result = replace(RESULT, rmse_before=5.0 if rmse_after > 1.0 else 0.5, rmse_after=rmse_after)
    assert most_error_remains(result) is most


def test_what_is_left_is_told():
    """How much, how far above the noise, and what it hangs on where it hangs on something."""
    after, result = fitted(2.0, 2.0), replace(RESULT, rmse_after=3.0)
    said = str(remainder_note(after, result, None))
    assert "from 5 to 3 mm. The error left is 30.0 times the row-to-row noise" in said
    assert "and it is 60 % of the error before." in said
    assert "and 45 % of it depends on" in remainder_note(after, result, HANGING).text


def test_cause_without_which_the_error_is_as_small_is_not_named():
    """Beside others; a cause that stands alone is judged by the gain's interval."""
    strong, weak = Cause("backlash", {}, 60.0), Cause("actuation_gain", {}, 0.1)
    assert without_support([strong, weak]) == ("actuation_gain",)
    assert without_support([strong, replace(weak, gain_percent=0.3)], ["backlash"]) == ()
    assert without_support([strong, replace(weak, gain_percent=0.3)], ["actuation_gain"]) == (
        "actuation_gain",
    )
    assert without_support([strong, replace(weak, gain_percent=0.0)], ["backlash"]) == ("actuation_gain",)
    assert without_support([weak]) == ()
    assert without_support([strong]) == ()


@pytest.mark.parametrize(
    ("result", "sure"),
    [
        (RESULT, True),
        (replace(RESULT, gain_percent_ci95=(-5.0, 99.0)), True),
        (replace(RESULT, gain_percent=12.0, gain_percent_ci95=(-5.0, 30.0)), False),
        (replace(RESULT, gain_percent=12.0, gain_percent_ci95=(3.0, 20.0)), True),
        (replace(RESULT, gain_percent=12.0, gain_percent_ci95=(float("nan"), float("nan"))), True),
        (replace(RESULT, chance=0.3), False),
        (replace(RESULT, gain_percent=-2.0), False),
    ],
    ids=[
        "sure",
        "few trials",
        "small and may not come back",
        "small and sure",
        "not known",
        "by chance",
        "a loss",
    ],
)
def test_gain_is_sure(result, sure):
    """On the held-out trials, and on others where something is known of them."""
    assert gains_surely(result) is sure


def fitted(backlash: float, gain: float) -> Fit:
    """Return a fit of a dead-band (nothing at 0) and a scale (nothing at 1), each sure to 0.28."""
    parameters = {
        "backlash": Parameter("width_mm", null=0.0, lower=0.0, upper=9.0, scale=1.0, start=1.0),
        "actuation_gain": Parameter("scale", null=1.0, lower=0.1, upper=9.0, scale=1.0, start=1.0),
    }
    rows = 400
    error = np.where(np.arange(rows) % 2, 1.0, -1.0)
    jacobian = np.zeros((rows, 2))
    jacobian[: rows // 2, 0] = jacobian[rows // 2 :, 1] = 1.0
    numbers = tuple(FittedNumber(name, parameter) for name, parameter in parameters.items())
    terms = tuple(Term(name, (parameter.name,)) for name, parameter in parameters.items())
    x = np.array([backlash, gain])
    return Fit(terms, numbers, x, error, jacobian, np.zeros(2, bool), np.arange(rows) // 10, error)


@pytest.mark.parametrize(
    ("backlash", "gain", "unsure"),
    [
        (2.0, 2.0, ()),
        (0.1, 2.0, ("backlash",)),
        (0.2, 2.0, ("backlash",)),  # the noise alone reaches to 0.14
        (0.35, 2.0, ()),
        (2.0, 0.95, ("actuation_gain",)),
        (0.1, 1.1, ("backlash", "actuation_gain")),
    ],
)
def test_cause_that_could_be_nothing_is_known(backlash, gain, unsure):
    """Half of the interval is the noise, half what the model may err."""
    result = fitted(backlash, gain)
    assert not_significant(result, cause_intervals(result)) == unsure


def test_number_at_a_bound_is_as_sure_as_the_data_before_it():
    """Far from the value that does nothing, or near to it: the bound itself makes no cause unsure."""
    stuck = np.array([True, False])
    far, near = replace(fitted(2.0, 2.0), held=stuck), replace(fitted(0.1, 2.0), held=stuck)
    assert not_significant(far, cause_intervals(far)) == ()
    assert not_significant(near, cause_intervals(near)) == ("backlash",)


def test_what_the_simulation_adds_to_an_interval_decides_too():
    """A number that noise alone makes sure is not, where the simulation would move it by as much."""
    result = fitted(2.0, 2.0)
    assert not_significant(result, cause_intervals(result, np.array([-2.0, 0.0]))) == ("backlash",)
    assert not_significant(result, cause_intervals(result, np.array([-0.5, 0.5]))) == ()


def test_cause_without_which_much_is_lost_is_needed():
    """88 % of the error are gone with it, and 60 or 80 % without."""
    assert needed({"mm": RESULT}, {"mm": replace(RESULT, gain_percent=60.0)})
    assert not needed({"mm": RESULT}, {"mm": replace(RESULT, gain_percent=80.0)})


def test_of_causes_that_could_be_nothing_the_least_goes_first():
    """Two that trade against one another are unsure together, and one of them is sure alone."""
    causes = [Cause("backlash", {}, 60.0), Cause("coupling", {}, 30.0), Cause("actuation_gain", {}, 10.0)]
    assert weakest_cause(causes, ("backlash", "coupling")) == ("coupling",)
    assert weakest_cause(causes, ()) == ()
