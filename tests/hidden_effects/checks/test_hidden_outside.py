"""Causes outside the list: nothing at size zero, and no effect's form."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.theory.static_models import STATIC_MODELS
from hidden_effects.first_draws import OUTSIDE, EccentricPulley, KinkedCell, RandomSlip

SLIP = {"seed": 3.0, "again": 0.0, "pulled": 1}
NUMBERS = {
    "kinked_cell": {"element": 5, "fold_from_rad": 0.05},
    "eccentric_pulley": {"period": 10.0, "phase_rad": 1.0, "wave": 1.0, "pulled": 1},
    "random_slip": SLIP,
}


def pulls(tensions_N) -> Inputs:
    """Return tensions of one rod, a second apart."""
    tension = np.array(tensions_N, dtype=float)[:, np.newaxis]
    zeros = np.zeros((len(tension), 3))
    return Inputs(np.arange(len(tension), dtype=float), "tension", tension, zeros, zeros)


def bent_tube():
    """Return the postures of the chest-tube section at 0, 5 and 30 N."""
    robot = load_robot("chest_tube_section")
    return STATIC_MODELS["complete"].solve(robot, pulls([0.0, 5.0, 30.0]), np.zeros(3)).postures


@pytest.mark.parametrize("name", OUTSIDE)
def test_nothing_of_it_does_nothing(name):
    """At size zero, inputs and postures stay as they are."""
    cause = OUTSIDE[name](0.0, NUMBERS[name])
    inputs = pulls([0.0, 10.0, 20.0])
    np.testing.assert_array_equal(cause.change_inputs(inputs).tendon, inputs.tendon)
    before = bent_tube()
    for one, other in zip(before, cause.change_postures(before), strict=True):
        np.testing.assert_array_equal(one.p_w, other.p_w)


def test_kink_turns_what_is_beyond_it():
    """What lies below the kinked cell stays, what lies beyond turns as one body; straight, nothing moves."""
    before = bent_tube()
    after = KinkedCell(2.0, {"element": 5, "fold_from_rad": 0.05}).change_postures(before)
    np.testing.assert_array_equal(after[0].p_w, before[0].p_w)
    np.testing.assert_array_equal(after[2].p_w[:5], before[2].p_w[:5])
    assert np.linalg.norm(after[2].p_w[-1] - before[2].p_w[-1]) > 5e-3
    for postures in (before, after):
        assert np.linalg.norm(postures[2].p_w[-1] - postures[2].p_w[5]) == pytest.approx(
            np.linalg.norm(before[2].p_w[-1] - before[2].p_w[5])
        )
    turn = after[2].R_w[5] @ before[2].R_w[5].T
    np.testing.assert_allclose(after[2].R_w[10], turn @ before[2].R_w[10], atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)


def test_pulley_repeats_with_its_period():
    """A period further on the eccentric pulley adds the same; at zero tension it adds nothing."""
    cause = EccentricPulley(0.5, NUMBERS["eccentric_pulley"])
    arriving = cause.change_inputs(pulls([0.0, 13.0, 23.0])).tendon[:, 0]
    assert arriving[0] == 0.0
    assert arriving[2] - arriving[1] == pytest.approx(10.0)
    assert abs(arriving[1] - 13.0) > 0.05


def test_slip_differs_when_a_trial_is_repeated():
    """A repeat of a trial slips elsewhere; the same trial slips the same; nothing slips at zero tension."""
    inputs = pulls(np.r_[0.0, np.full(60, 20.0)])
    first, same = (RandomSlip(0.2, SLIP).change_inputs(inputs).tendon for _ in range(2))
    again = RandomSlip(0.2, {**SLIP, "again": 1.0}).change_inputs(inputs).tendon
    np.testing.assert_array_equal(first, same)
    assert not np.array_equal(first, again)
    assert first[0] == 0.0
    assert np.abs(first - inputs.tendon).max() <= 4.0
