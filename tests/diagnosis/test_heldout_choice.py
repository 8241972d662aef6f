"""Claims about held-out trials that tell apart what the training trials cannot."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from planted import as_inputs, small_robot

from catheter_sim.diagnosis.comparison import (
    also_equal_on_heldout,
    choose_on_heldout,
    heldout_choice_note,
    rival_groups,
    rivals_of,
)
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.problem import Problem, Term
from catheter_sim.diagnosis.search import equals_of
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.effects import EFFECTS
from catheter_sim.tables import Table

STRETCHES, ROWS = 16, 12
EVERYWHERE, FORWARD = Term("nonlinear_stiffness", ("cubic_mm2",)), Term("twist", ("rate_deg_per_m",))


def problem_with(turned: bool, seed: int) -> Problem:
    """Return a trial in which the first effect acts, of size 3; the second can do the same in one direction.

    Args:
        turned: whether the input goes in the other direction in every second stretch.
        seed: of the noise.
    """
    robot = small_robot()
    scale = {
        term.effect: next(p.scale for p in EFFECTS[term.effect].parameters(robot) if p.name == term.free[0])
        for term in (EVERYWHERE, FORWARD)
    }
    side = np.where(turned & (np.arange(STRETCHES) % 2 == 1), -1.0, 1.0)
    pull = np.tile(np.sin(np.pi * np.arange(ROWS) / ROWS), STRETCHES) * np.repeat(side, ROWS)

    def twin(robots, inputs, every):
        moved = inputs.tendon[:, 0]
        found = []
        for item in robots:
            first, second = (
                item.effects.get(term.effect, {}).get(term.free[0], 0.0) / scale[term.effect]
                for term in (EVERYWHERE, FORWARD)
            )
            found.append(first * moved + second * np.maximum(moved, 0.0))
        return np.array(found)[:, ::every, None]

    inputs = as_inputs(np.stack([pull, 0 * pull, 0 * pull], axis=1), "displacement")
    noise = 0.1 * np.random.default_rng(seed).normal(size=len(pull))
    trial = Trial("a.csv", "train", inputs, Table(inputs.time_s, {"tip_x_mm": 3.0 * pull + noise}, "made"))
    return Problem(robot, (), (trial,), ("tip_x_mm",), np.full(1, 0.1), twin)


@pytest.mark.parametrize(("chosen", "other"), [(EVERYWHERE, FORWARD), (FORWARD, EVERYWHERE)])
def test_held_out_trials_decide_where_they_can(chosen, other):
    """Trials with turned inputs show which one acts; the other is then no longer alike."""
    train = problem_with(False, 1)
    first, second = fit(train, (chosen,)), fit(train, (other,))
    taken, equals = choose_on_heldout(train, problem_with(True, 2), first, [second])
    assert taken.causes == (EVERYWHERE.effect,)
    assert equals == ()
    if chosen is FORWARD:
        note = heldout_choice_note(first, taken).text
        assert "twist and nonlinear stiffness do equally well" in note
        assert note.count("nonlinear stiffness") == 2


def test_what_no_trial_tells_apart_stays_alike():
    """Held-out trials like the training trials: the one that was chosen stays, and the other beside it."""
    train = problem_with(False, 1)
    first, second = fit(train, (FORWARD,)), fit(train, (EVERYWHERE,))
    taken, equals = choose_on_heldout(train, problem_with(False, 2), first, [second])
    assert taken.causes == first.causes
    assert rival_groups(taken, equals) == ((FORWARD.effect, EVERYWHERE.effect),)


def test_one_that_loses_on_other_trials_is_not_taken():
    """However well it does on the training trials."""
    train = problem_with(False, 1)
    spoilt = replace(train, twin=lambda robots, inputs, every: train.twin(robots, inputs, every) + 5.0)
    first = fit(train, (EVERYWHERE,))
    assert choose_on_heldout(train, problem_with(True, 2), first, [fit(spoilt, (FORWARD,))])[0] is first


@pytest.mark.parametrize("turned", [False, True])
def test_what_stands_in_the_place_of_a_set_that_was_reduced_is_looked_for(turned):
    """A set that the search did not end at: its rival is fitted, and kept if they cannot tell it."""
    train = problem_with(False, 1)
    chosen = fit(train, (EVERYWHERE,), cross_validate=False)
    found = equals_of(train, chosen, [EVERYWHERE.effect, FORWARD.effect])
    assert rival_groups(chosen, found) == ((EVERYWHERE.effect, FORWARD.effect),)
    kept = also_equal_on_heldout(train, problem_with(turned, 2), chosen, found)
    assert len(kept) == (0 if turned else 1)


def test_a_chosen_cause_with_other_numbers_may_do_another_ones_work_too():
    """Offsets of all channels for a bent joint and a common offset: both names are given."""
    bent, common = Term("precurvature", ("bending_deg",)), Term("actuation_offset", ("offset_mm",))
    each_own = Term("actuation_offset", ("offset_bending_mm", "offset_advance_mm"))
    frame = Term("measurement_frame", ("translation_x_mm",))

    def of(*terms):
        return SimpleNamespace(terms=terms, causes=tuple(term.effect for term in terms))

    chosen, rival = of(bent, common), of(each_own)
    assert rivals_of(chosen, [rival, of(common), of(bent, common, frame), chosen]) == [
        ("precurvature", "actuation_offset", rival)
    ]
    assert rival_groups(chosen, [rival, of(frame, common)]) == (
        ("precurvature", "actuation_offset", "measurement_frame"),
    )
    assert "precurvature, actuation offset and actuation offset do equally well" in str(
        heldout_choice_note(chosen, rival)
    )
