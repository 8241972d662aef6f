"""Claims about how probable a cause is told to be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_problem import gain_problem, noisy, pulls, trial_of

from catheter_sim.diagnosis.causes.choose import select
from catheter_sim.diagnosis.causes.scored import scored, surety
from catheter_sim.diagnosis.report.result import CAUSE_FOUND, DATA_SUSPECT, NO_DISCREPANCY, UNEXPLAINED
from catheter_sim.diagnosis.verdict.evidence import (
    CauseEvidence,
    Evidence,
    as_numbers,
    evidence,
    from_numbers,
)
from catheter_sim.diagnosis.verdict.probabilities import NONE, OUTSIDE, probabilities
from catheter_sim.effects import EFFECTS

CLEAR = Evidence(
    causes={
        "backlash": CauseEvidence(True, 5.0, 3.0),
        "rate": CauseEvidence(False, -0.2),
        "drift": CauseEvidence(False, -5.0),
    },
    over_none=5.5,
    number=40,
    times_noise=1.05,
    unknown=0.0,
    unknown_share=0.0,
)


def test_every_cause_has_a_probability() -> None:
    """Each name of the list, none and outside have one, strictly between 0 and 1."""
    found = probabilities(CLEAR, CAUSE_FOUND)
    assert set(found) == {*EFFECTS, NONE, OUTSIDE}
    assert all(0.0 < value < 1.0 for value in found.values())


def test_more_evidence_makes_a_cause_more_probable() -> None:
    """What is clear is near 1; less sure is what another cause explains as well, or what leaves much."""
    clear = probabilities(CLEAR, CAUSE_FOUND)
    assert clear["backlash"] > 0.9
    assert clear["drift"] < clear["rate"] < clear["backlash"]
    rival = replace(CLEAR, causes={**CLEAR.causes, "backlash": CauseEvidence(True, 0.2, 3.0)})
    assert probabilities(rival, CAUSE_FOUND)["backlash"] < clear["backlash"]
    much_left = replace(CLEAR, times_noise=20.0, unknown=4.0, unknown_share=0.6)
    assert probabilities(much_left, UNEXPLAINED)["backlash"] < clear["backlash"]
    assert probabilities(much_left, UNEXPLAINED)[OUTSIDE] > 0.5 > clear[OUTSIDE]


def test_what_is_not_believed_speaks_for_something_outside() -> None:
    """A cause with implausible numbers keeps little of its probability; "outside" gets it, no other does."""
    believed, doubted = probabilities(CLEAR, CAUSE_FOUND), probabilities(CLEAR, CAUSE_FOUND, ["backlash"])
    assert believed["backlash"] > 0.9 > 0.5 > believed[OUTSIDE]
    assert doubted["backlash"] < 0.2
    assert doubted[OUTSIDE] > 0.75
    assert {name: value for name, value in doubted.items() if name not in ("backlash", OUTSIDE)} == {
        name: value for name, value in believed.items() if name not in ("backlash", OUTSIDE)
    }


def test_without_a_discrepancy_none_is_probable() -> None:
    """Then no cause is; where one is found, none is improbable."""
    nothing = Evidence({}, 0.5, 20, 1.0, 0.0, 0.0)
    found = probabilities(nothing, NO_DISCREPANCY)
    assert found[NONE] > 0.8
    assert max(found[name] for name in EFFECTS) < 0.1
    assert probabilities(CLEAR, CAUSE_FOUND)[NONE] < 0.1


def test_data_that_look_wrong_say_nothing_of_the_robot() -> None:
    """No cause is probable, nor that there is none: the data are outside the list."""
    found = probabilities(None, DATA_SUSPECT)
    assert found[OUTSIDE] == 1.0
    assert not any(found[name] for name in (*EFFECTS, NONE))


def test_evidence_survives_its_document() -> None:
    """What is written can be read back, so that the weights can be fitted to finished diagnoses."""
    assert from_numbers(as_numbers(CLEAR)) == CLEAR


def test_surety_has_the_spread_of_chance() -> None:
    """Of hypotheses of which neither is better it has mean 0 and variance 1, whatever the errors' sizes."""
    generator = np.random.default_rng(3)
    draws = []
    for _ in range(2000):
        size = np.exp(generator.normal(size=30))
        draws.append(surety(size * generator.chisquare(3, 30), size * generator.chisquare(3, 30)))
    assert abs(np.mean(draws)) < 0.1
    assert np.var(draws) == pytest.approx(1.0, abs=0.1)
    assert surety(np.full(16, 2.0), np.full(16, 1.0)) == pytest.approx(4.0)


def test_a_planted_gain_is_surer_than_a_smooth_error() -> None:
    """A true gain does better than none, and a smooth error beside it does no better than it alone."""
    parts = []
    for seed, file in ((1, "a.csv"), (2, "b.csv")):
        pull = pulls(seed=seed)
        parts.append(trial_of(pull, {"tip_x_mm": noisy(1.2 * pull, seed)}, file))
    train = gain_problem(tuple(parts[:1]), 0.01, ("tip_x_mm",))
    test = replace(train, trials=tuple(parts[1:]))
    selection = select(train, ("actuation_gain",))
    hypotheses = scored(train, test, selection, selection.chosen)
    found = evidence(train, test, hypotheses, selection.chosen.causes, 1.0)
    assert found.causes["actuation_gain"].named
    assert found.causes["actuation_gain"].over_others > 3.0
    assert abs(found.unknown) < 2.0
