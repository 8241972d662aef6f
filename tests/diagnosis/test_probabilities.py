"""Claims about how probable a cause is told to be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_problem import gain_problem, noisy, pulls, trial_of

from catheter_sim.diagnosis.hypotheses import scored, surety
from catheter_sim.diagnosis.probabilities import (
    CauseEvidence,
    Evidence,
    as_numbers,
    beliefs,
    evidence,
)
from catheter_sim.diagnosis.result import NONE, OUTSIDE
from catheter_sim.diagnosis.search import select
from catheter_sim.effects import EFFECTS
from tests.scripts_as_modules import script_module

CLEAR = Evidence(
    causes={
        "backlash": CauseEvidence(True, 5.0, 3.0, 1.2, 0),
        "rate": CauseEvidence(False, -0.2, 0.0, -0.05),
        "drift": CauseEvidence(False, -5.0, 0.0, -1.2),
    },
    over_none=5.5,
    number=40,
    times_noise=1.05,
    unknown=0.0,
    unknown_share=0.0,
    times_before=12.0,
    values=400,
)


def with_backlash(**changes: object) -> Evidence:
    """Return the clear evidence with other numbers for its one cause."""
    return replace(CLEAR, causes={**CLEAR.causes, "backlash": replace(CLEAR.causes["backlash"], **changes)})


def test_every_cause_has_a_probability() -> None:
    """Each name of the list, none and outside have one, strictly between 0 and 1."""
    found = beliefs(CLEAR).each
    assert set(found) == {*EFFECTS, NONE, OUTSIDE}
    assert all(0.0 < value < 1.0 for value in found.values())


def test_more_evidence_makes_a_cause_more_probable() -> None:
    """What is clear is near 1; less sure is what another cause explains as well, or what leaves much."""
    clear = beliefs(CLEAR).each
    assert clear["backlash"] > 0.9
    assert clear["drift"] < clear["rate"] < clear["backlash"]
    assert beliefs(with_backlash(over_others=0.2, ratio=0.02)).each["backlash"] < 0.5
    much_left = beliefs(replace(CLEAR, times_noise=20.0, unknown=4.0, unknown_share=0.6)).each
    assert much_left["backlash"] < clear["backlash"]
    assert much_left[OUTSIDE] > 0.5 > clear[OUTSIDE]


def test_a_group_shares_its_probability() -> None:
    """Two causes that explain alike share one probability; the surer one has more; a poor one has no part."""
    alike = beliefs(with_backlash(members={"tendon_friction": 0.0}))
    assert set(alike.members["backlash"]) == {"backlash", "tendon_friction"}
    assert alike.each["backlash"] == pytest.approx(alike.each["tendon_friction"])
    assert alike.each["backlash"] + alike.each["tendon_friction"] == pytest.approx(alike.groups["backlash"])
    assert alike.groups["backlash"] == pytest.approx(beliefs(CLEAR).each["backlash"])
    surer = beliefs(with_backlash(members={"tendon_friction": 1.0}))
    assert surer.each["backlash"] > alike.each["backlash"]
    assert next(iter(surer.members["backlash"])) == "backlash"
    worse = beliefs(with_backlash(members={"tendon_friction": -1.0}))
    assert list(worse.members["backlash"]) == ["backlash", "tendon_friction"]  # its numbers are reported
    alone = beliefs(with_backlash(members={"tendon_friction": 9.0}))
    assert alone.members == {}
    assert alone.each["backlash"] == pytest.approx(alone.groups["backlash"])


def test_what_is_not_believed_speaks_for_something_outside() -> None:
    """A cause with implausible numbers keeps little of its probability; "outside" gets it, no other does."""
    believed, doubted = beliefs(CLEAR).each, beliefs(CLEAR, ["backlash"]).each
    assert believed["backlash"] > 0.9 > 0.5 > believed[OUTSIDE]
    assert doubted["backlash"] < 0.2
    assert doubted[OUTSIDE] > 0.75
    assert {name: value for name, value in doubted.items() if name not in ("backlash", OUTSIDE)} == {
        name: value for name, value in believed.items() if name not in ("backlash", OUTSIDE)
    }


def test_without_a_discrepancy_none_is_probable() -> None:
    """Then no cause is; where one is found, none is improbable."""
    found = beliefs(Evidence({}, 0.5, 20, 1.0, 0.0, 0.0, 1.0)).each
    assert found[NONE] > 0.8
    assert max(found[name] for name in EFFECTS) < 0.1
    assert beliefs(CLEAR).each[NONE] < 0.1


def test_data_that_look_wrong_say_nothing_of_the_robot() -> None:
    """No cause is probable, nor that there is none: the data are outside the list."""
    found = beliefs(None).each
    assert found[OUTSIDE] == 1.0
    assert not any(found[name] for name in (*EFFECTS, NONE))


def test_evidence_survives_its_document() -> None:
    """What is written can be read back, so that the weights can be fitted to finished diagnoses."""
    grouped = with_backlash(members={"tendon_friction": 0.3, "rate": -0.1})
    script = script_module("calibrate_probabilities")
    for item in (CLEAR, grouped, replace(CLEAR, structure=0.4, harmful=True)):
        assert script.from_numbers(as_numbers(item)) == item


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
    chosen = selection.chosen
    hypotheses = scored(train, test, selection, chosen.terms, chosen.values)
    found = evidence(train, test, hypotheses, chosen.causes, {}, (20.0, 1.0))
    assert found.causes["actuation_gain"].named
    assert found.causes["actuation_gain"].over_others > 3.0
    assert found.causes["actuation_gain"].ratio > 1.0
    assert abs(found.unknown) < 2.0
