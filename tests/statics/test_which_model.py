"""Claims about the choice of a static model for a robot and a tolerance."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.errors import InputError
from catheter_sim.robots.spacer_disk import spacer_disk
from catheter_sim.robots.specification import Tendon
from catheter_sim.statics.models import STATIC_MODELS
from catheter_sim.statics.which_model import pulled_sets, which_model

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
    """Whatever the clock says: the choice is the first in order of time within the tolerance."""
    for percent in (10.0, 2.0, 0.1):
        choice = which_model(coarse, percent)
        by_name = {item.model: item for item in choice.errors}
        assert [item.ms for item in choice.errors] == sorted(item.ms for item in choice.errors)
        assert by_name[choice.model].position_percent <= percent
        faster = [item for item in choice.errors if item.ms < by_name[choice.model].ms]
        assert all(item.position_percent > percent for item in faster)
        assert by_name["VC_ref_noproj"].position_percent == 0.0


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
