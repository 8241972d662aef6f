"""Claims about what is named: only what is likely, the most probable first, nothing that soaks up errors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import pytest
from made_problem import gain_problem, noisy, pulls, trial_of

from catheter_sim.diagnosis.conclude import by_probability, judge
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.probabilities import Beliefs
from catheter_sim.diagnosis.problem import Problem, Term
from catheter_sim.diagnosis.result import DATA_SUSPECT, Cause, UnitResult

GAIN = UnitResult("mm", 0.01, 1.0, 0.011, 98.9, (97.0, 99.5), 0.001)
NO_GAIN = UnitResult("mm", 0.01, 0.01, 0.01, 0.0, (-2.0, 2.0), 0.5)
TERMS = (Term("actuation_gain", ("scale",)), Term("stiffness", ()), Term("drift", ()))


@dataclass(frozen=True)
class Case:
    """A hypothesis of three causes, with the model that has none."""

    problem: Problem
    before: Fit
    after: Fit


@pytest.fixture(scope="module")
def case() -> Case:
    """Return a gain of 1.5 with two idle causes beside it."""
    pull = pulls(seed=1)
    problem = gain_problem((trial_of(pull, {"tip_x_mm": noisy(1.5 * pull, 2)}),), 0.01, ("tip_x_mm",))
    null, one = fit(problem, (), cross_validate=False), fit(problem, TERMS[:1], cross_validate=False)
    return Case(problem, null, replace(one, terms=TERMS))


def verdict(
    case: Case,
    chances: tuple[float, float, float],
    harms: int = 0,
    faults: int = 0,
    lacking: int = 0,
    gains: UnitResult = GAIN,
):
    """Return the verdict where the three causes have these probabilities."""
    names = [term.effect for term in TERMS]
    return judge(
        SimpleNamespace(train=case.problem, lacking=(0,) * lacking),
        SimpleNamespace(fit=case.before),
        SimpleNamespace(pruned=SimpleNamespace(after=case.after, by_unit={"mm": gains})),
        SimpleNamespace(found=(0,) * faults),
        SimpleNamespace(remainder=None, much_left=False, harms=(0,) * harms, structure={"before": ()}),
        SimpleNamespace(beliefs=Beliefs({}, dict(zip(names, chances, strict=True)), {})),
    )


def test_named_means_likely(case: Case):
    """Those of at least one half are named, whichever has the larger share of the gain."""
    found = verdict(case, (0.3, 0.5, 0.9))
    assert (found.name, found.established) == ("cause_found", ("stiffness", "drift"))
    assert found.shown is case.after


def test_a_model_may_be_improved_without_a_name(case: Case):
    """None reaches one half: the corrections stay in the model, and none is named."""
    found = verdict(case, (0.3, 0.49, 0.2))
    assert (found.name, found.established) == ("improved", ())
    assert found.shown is case.after


def test_what_does_harm_or_comes_of_wrong_data_corrects_nothing(case: Case):
    """However probable: the calibrated model is shown."""
    for found in (verdict(case, (0.9, 0.9, 0.9), harms=1), verdict(case, (0.9, 0.9, 0.9), faults=1)):
        assert not found.corrects
        assert found.established == ()
        assert found.shown is case.before
    assert verdict(case, (0.9, 0.9, 0.9), faults=1).name == DATA_SUSPECT
    assert verdict(case, (0.9, 0.9, 0.9), lacking=1).name == DATA_SUSPECT


def test_what_the_heldout_trials_do_not_show_is_said(case: Case):
    """A probable cause without a held-out gain: nothing is named, and the data are not called right."""
    found = verdict(case, (0.9, 0.3, 0.2), gains=NO_GAIN)
    assert (found.name, found.established, found.unproved) == ("unexplained", (), ("actuation_gain",))
    assert found.shown is case.before
    nothing = verdict(case, (0.3, 0.3, 0.2), gains=NO_GAIN)
    assert (nothing.name, nothing.unproved) == ("no_discrepancy", ())
    assert verdict(case, (0.9, 0.3, 0.2)).unproved == ()
    assert verdict(case, (0.9, 0.3, 0.2), harms=1).unproved == ()


def test_causes_stand_in_the_order_of_their_probabilities():
    """Not of their shares; a group is one cause with its members."""
    causes = (Cause("rate", {}, 60.0), Cause("drift", {}, 20.0), Cause("stiffness", {}, 20.0))
    groups = {"rate": 0.4, "drift": 0.6, "stiffness": 0.9}
    members = {"stiffness": {"stiffness": 0.6, "actuation_gain": 0.3}}
    found = by_probability(causes, Beliefs({}, groups, members))
    assert [cause.name for cause in found] == ["stiffness", "drift", "rate"]
    assert [cause.probability for cause in found] == [0.9, 0.6, 0.4]
    assert found[0].one_of == ("stiffness", "actuation_gain")
    assert found[1].one_of == ("drift",)
