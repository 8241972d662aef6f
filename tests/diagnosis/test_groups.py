"""Claims about causes that data cannot tell apart: who is of a group, and what speaks for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_problem import gain_problem, trial_of
from planted import small_robot

from catheter_sim.diagnosis.comparison import only_mends
from catheter_sim.diagnosis.fit import Fit
from catheter_sim.diagnosis.hypotheses import Scored
from catheter_sim.diagnosis.probabilities import alike_groups, evidence, one_unlisted_form
from catheter_sim.diagnosis.problem import Problem, Term

BLOCKS, ROWS = 16, 8
BLOCK = np.repeat(np.arange(BLOCKS), ROWS)
PULL = np.tile(np.sin(np.pi * np.arange(ROWS) / ROWS), BLOCKS)


def hypothesis(causes: tuple[str, ...], train: np.ndarray, heldout: np.ndarray | None = None) -> Scored:
    """Return a hypothesis that leaves `train` on stretches left out and `heldout` on the held-out ones."""
    terms = tuple(Term(name, ()) for name in causes)
    nothing = np.zeros((len(train), 0))
    fitted = Fit(terms, (), np.zeros(0), train, nothing, np.zeros(0, bool), BLOCK, train)
    return Scored(fitted, train if heldout is None else heldout, BLOCK)


def errors(size: float, seed: int = 1) -> np.ndarray:
    """Return errors of a size that differ from stretch to stretch, white in each."""
    generator = np.random.default_rng(seed)
    return size * np.repeat(generator.uniform(0.8, 1.2, BLOCKS), ROWS) * generator.normal(size=BLOCKS * ROWS)


def grouped(*rivals: tuple[str, np.ndarray]) -> dict[str, dict[str, float]]:
    """Return the groups about a stiffness that leaves errors of size 1."""
    mine = hypothesis(("stiffness",), errors(1.0))
    others = [hypothesis((name,), left) for name, left in rivals]
    return alike_groups(
        [mine, *others], ("stiffness",), [("stiffness", item.causes[0], item.fit) for item in others]
    )


def test_what_explains_alike_is_a_group():
    """The same errors with other noise: a group; how surely one does better is within chance."""
    found = grouped(("actuation_gain", errors(1.0, seed=2)))
    assert list(found["stiffness"]) == ["actuation_gain"]
    assert abs(found["stiffness"]["actuation_gain"]) < 2.0


@pytest.mark.parametrize("left", [1.06 * errors(1.0), errors(1.3, seed=2)], ids=["surely worse", "far worse"])
def test_what_explains_less_is_in_no_group(left):
    """6 % more in every stretch is no chance, though little; 30 % more is too much, whatever the chance."""
    assert grouped(("actuation_gain", left)) == {}


def test_few_stretches_make_no_group_of_what_errs_more():
    """Three stretches may all be worse by chance, one time in eight; 30 % more is too much for a group."""
    few = BLOCK % 3
    mine, other = (
        Scored(replace(item.fit, block=few), item.heldout[few < 0], few[few < 0])
        for item in (hypothesis(("stiffness",), errors(1.0)), hypothesis(("rate",), 1.3 * errors(1.0)))
    )
    assert alike_groups([mine, other], ("stiffness",), [("stiffness", "rate", other.fit)]) == {}
    near = replace(other, fit=replace(other.fit, left_out=1.05 * errors(1.0)))
    assert alike_groups([mine, near], ("stiffness",), [("stiffness", "rate", near.fit)]) != {}


def test_a_group_has_three_members_at_most():
    """Of more, those that err least in the trials left out."""
    rivals = [(name, errors(1.0, seed)) for seed, name in enumerate(("rate", "drift", "twist", "payload"), 3)]
    (group,) = grouped(*rivals).values()
    assert len(group) == 2
    best = sorted(rivals, key=lambda pair: float(pair[1] @ pair[1]))[:2]
    assert set(group) == {name for name, _ in best}


@pytest.mark.parametrize(("share", "more", "mends"), [(0.35, 2, True), (0.35, 1, False), (0.0, 9, False)])
def test_more_numbers_only_mend_a_wrong_model(share: float, more: int, mends: bool):
    """Of a model that is known to be wrong a set with two more numbers says nothing against a chosen one."""
    problem = replace(made_problem(), model_share=share)
    chosen, other = (hypothesis((name,), errors(1.0)).fit for name in ("payload", "coupling"))
    other = replace(other, numbers=(("coupling", "a"),) * (len(chosen.numbers) + more))
    assert only_mends(problem, chosen, other) is mends


def made_problem() -> Problem:
    """Return a problem of one pulled tendon with the stretches of `BLOCK`."""
    return gain_problem((trial_of(PULL, {"tip_x_mm": PULL}),), 1.0, ("tip_x_mm",))


def test_a_group_is_held_against_what_has_no_member():
    """A rival as good takes all from a cause alone, and nothing from the group of both."""
    problem = made_problem()
    hypotheses = [
        hypothesis((), errors(5.0)),
        hypothesis(("stiffness",), errors(1.0)),
        hypothesis(("actuation_gain",), errors(1.0, seed=2)),
        hypothesis(("drift",), errors(2.0)),
    ]
    alone = evidence(problem, problem, hypotheses, ("stiffness",), {}, (5.0, 1.0)).causes["stiffness"]
    assert abs(alone.ratio) < 0.1
    group = {"stiffness": {"actuation_gain": 0.1}}
    found = evidence(problem, problem, hypotheses, ("stiffness",), group, (5.0, 1.0)).causes
    assert found["stiffness"].ratio == pytest.approx(np.log(2.0), abs=0.1)
    assert found["stiffness"].over_others > 3.0
    assert "actuation_gain" not in found  # it is asked about with the group
    assert not found["drift"].named
    assert found["drift"].ratio == pytest.approx(-np.log(2.0), abs=0.1)


def test_one_cause_in_an_unlisted_form_stands_beside_many_corrections():
    """A single cause that leaves a smooth function of the command is as good as three corrections; one that
    leaves noise twice as large is not."""
    problem = replace(made_problem(), robot=small_robot())
    wave = 3.0 * PULL**2
    three = hypothesis(("drift", "rate", "twist"), errors(1.0))
    smooth = hypothesis(("stiffness",), errors(1.0, seed=5) + wave)
    rough = hypothesis(("payload",), errors(4.0, seed=6))
    found = one_unlisted_form(problem, problem, [three, smooth, rough], three.causes)
    assert found is not None
    assert found.name == "stiffness"
    assert found.surer < 2.0
    poor = one_unlisted_form(problem, problem, [three, rough], three.causes)
    assert poor is not None
    assert poor.surer > 2.0
    assert one_unlisted_form(problem, problem, [three], three.causes) is None
