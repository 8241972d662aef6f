"""Claims about the choice of a static model for a robot and a tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.published import spacer_disk
from catheter_sim.robots.continuum.spec import Tendon
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.which_model import CANDIDATES, TIED, ModelError, best_of, pulled_sets, which_model

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("tdcr")]  # compiled once, half a minute


@pytest.fixture
def coarse():
    """The benchmark's robot with three disks a segment."""
    return replace(spacer_disk(), disks_per_segment=3)


def test_sets_turn_the_tip_as_far_as_asked(coarse):
    """All sixteen sets; the tension is Eq. 55's, and tendons 1 and 3 together turn the tip by 90 deg."""
    sets = pulled_sets(coarse)
    assert sets.tendon.shape == (16, 4)
    segment = coarse.segments[0]
    expected = math.pi / 2.0 * segment.bending_stiffness_N_m2 / (3.0 * 8e-3 * segment.length_m)
    assert sets.tendon.max() == pytest.approx(expected, rel=1e-12)
    helping = (sets.tendon > 0.0) == [True, False, True, False]
    row = int(np.flatnonzero(helping.all(axis=1))[0])
    posture = STATIC_MODELS["VC"].solve(coarse, sets, np.zeros(3)).postures[row]
    assert posture.R_w[-1][2, 2] == pytest.approx(0.0, abs=1e-6)


def test_many_tendons_are_drawn_at_random_and_the_same_each_time(coarse):
    """Eight tendons have 256 sets: sixty-four of them, reproducibly."""
    more = tuple(Tendon(f"{k}", 8e-3, k * math.pi / 4.0, "second") for k in range(8))
    sets = pulled_sets(replace(coarse, tendons=more))
    assert sets.tendon.shape == (64, 8)
    assert np.array_equal(sets.tendon, pulled_sets(replace(coarse, tendons=more)).tendon)


def test_what_is_chosen_keeps_the_tolerance_and_what_is_faster_does_not(coarse):
    """Whatever the clock says: what is faster by more than the margin misses the tolerance."""
    for percent in (10.0, 2.0, 0.1):
        choice = which_model(coarse, percent)
        by_name = {item.model: item for item in choice.errors}
        assert [item.ms for item in choice.errors] == sorted(item.ms for item in choice.errors)
        chosen = by_name[choice.model]
        assert chosen.position_percent <= percent
        faster = [item for item in choice.errors if TIED * item.ms < chosen.ms]
        assert all(item.position_percent > percent for item in faster)
        tied = [item for item in choice.errors if chosen.ms / TIED <= item.ms <= chosen.ms]
        assert all(not item.position_percent < chosen.position_percent for item in tied)
        assert by_name["VC_ref_noproj"].position_percent < 1e-10  # the reference itself, rounded otherwise


class Clock:
    """A clock under which the models take given times, in the order in which they are timed."""

    def __init__(self, of_round: Callable[[int], Mapping[str, float]]) -> None:
        self._of_round, self._reads, self._now = of_round, 0, 0.0

    def __call__(self) -> float:
        turn, after = divmod(self._reads, 2)
        self._reads += 1
        if after:
            lap, place = divmod(turn, len(CANDIDATES))
            self._now += self._of_round(lap)[CANDIDATES[place]]
        return self._now


SLOW = dict.fromkeys(CANDIDATES, 100.0)


def test_times_are_medians_of_rounds_in_which_models_take_turns(coarse):
    """A pause of the machine in one round, or in three of seven, changes no time; a row's share is given."""
    rows = len(pulled_sets(coarse))

    def of_round(lap):
        return {
            name: 1.0 + place + (1e3 if lap in (0, 3, 5) else 0.0) for place, name in enumerate(CANDIDATES)
        }

    choice = which_model(coarse, 1.0, clock=Clock(of_round))
    assert [item.model for item in choice.errors] == list(CANDIDATES)
    assert [item.ms for item in choice.errors] == pytest.approx(
        [1e3 * (1.0 + place) / rows for place in range(len(CANDIDATES))]
    )


@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_an_answer_does_not_flip_with_the_clock(coarse, noise):
    """Models as fast as one another to within the noise: the same answer each time, the most accurate."""
    answers = set()
    for seed in range(8):
        rng = np.random.default_rng(seed)

        def of_round(_, rng=rng):
            return {name: 1.0 + noise * rng.uniform(-1.0, 1.0) for name in CANDIDATES}

        answers.add(which_model(coarse, 2.0, clock=Clock(of_round)).model)
    assert answers == {"VC_ref_noproj"}  # the reference, off by nothing


@pytest.mark.parametrize(("disks", "percent"), [(3, 3.0), (3, 0.3), (10, 1.0), (10, 0.1)])
def test_an_answer_stays_under_this_machines_clock(disks, percent):
    """Six calls, one answer: solvers alone are timed, and no tolerance is asked about near which two tie."""
    robot = replace(spacer_disk(), disks_per_segment=disks)
    assert len({which_model(robot, percent).model for _ in range(6)}) == 1


def test_solvers_are_timed_alone(coarse):
    """CC's closed form takes less than a fifth of the next model's time: the paper's figure says a
    hundredth."""
    fastest, second, *_ = which_model(coarse, 1.0).errors
    assert fastest.model == "CC"
    assert fastest.ms < 0.2 * second.ms


def test_a_model_beyond_the_margin_is_not_taken_for_its_accuracy(coarse):
    """PRB keeps 1 %: alone within the margin it is chosen, and what is 1.6 times as slow is not."""
    fast = SLOW | {"PRB": 1.0, "VC_ref_noproj": 1.05 * TIED}
    assert which_model(coarse, 1.0, clock=Clock(lambda _: fast)).model == "PRB"
    fast = SLOW | {"PRB": 1.0, "VC_ref_noproj": 0.95 * TIED}
    assert which_model(coarse, 1.0, clock=Clock(lambda _: fast)).model == "VC_ref_noproj"


def test_of_equally_fast_and_equally_accurate_models_the_simplest_is_chosen():
    """Under equal times and errors the order of the candidates decides, in whatever order they come."""
    twins = [ModelError(name, 0.5, 0.1, 0.1, 1.0, ()) for name in reversed(CANDIDATES)]
    assert best_of(twins).model == "CC"


def test_coarse_robot_needs_straight_tendons(coarse):
    """With three disks, models with tendons held everywhere miss 1 % of the length, and PRB keeps it."""
    errors = {item.model: item for item in which_model(coarse, 1.0).errors}
    assert errors["VC"].position_percent > 1.0
    assert errors["CC"].position_percent > 1.0
    assert errors["PRB"].position_percent < 1.0


def test_lumens_are_their_own_reference(coarse):
    """Against VC, which holds tendons everywhere, CC is right to its stretch without load."""
    errors = {item.model: item for item in which_model(coarse, 1.0, reference="VC").errors}
    assert errors["CC"].position_percent < 0.03
    assert errors["VC_ref_noproj"].position_percent > 1.0


def test_what_no_one_can_answer_is_refused(coarse):
    """A tolerance of zero and an unknown reference get one line each."""
    with pytest.raises(InputError, match="above zero"):
        which_model(coarse, 0.0)
    with pytest.raises(InputError, match="VC_ref_noproj"):
        which_model(coarse, 1.0, reference="PRB")
