from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.robots.continuum import kato
from catheter_sim.robots.continuum.exact_arm import fkm_exact_arm
from catheter_sim.robots.continuum.kato import (
    ANTAGONISTIC_LOOP,
    SINGLE_LOOP,
    fkm,
    fkm_stick,
    friction_from_opening,
    highest_tension_from_opening,
    identify,
    loop_opening,
)
from reference.arching_distances import friction_from_arching

pytestmark = pytest.mark.slow


def test_second_opening_follows_from_the_first():
    """With full reversal, mu from 9.8 mm predicts the published 13.2 mm to 3 % (printed mapping)."""
    found = identify(fkm)
    assert len(found.mu) == 1
    assert loop_opening(fkm, SINGLE_LOOP, found.mu[0], found.highest_N) == pytest.approx(9.8e-3, abs=1e-6)
    assert found.antagonistic_opening_m[0] == pytest.approx(ANTAGONISTIC_LOOP.opening_m, rel=0.03)


def test_after_full_reversal_the_start_does_not_matter():
    """From any start beyond full reversal the same mu comes out; from less bending a larger one."""
    (far,) = friction_from_opening(fkm, SINGLE_LOOP, 2.0)
    (near,) = friction_from_opening(fkm, SINGLE_LOOP, 1.0)
    assert near == pytest.approx(far, rel=1e-3)
    assert friction_from_opening(fkm, SINGLE_LOOP, 0.65)[0] > far + 5e-3


def test_a_start_just_above_the_loop_fits_no_friction():
    """From 0.5 N no mu opens the loop at 0.4 N to 9.8 mm: friction also bends the robot less."""
    assert friction_from_opening(fkm, SINGLE_LOOP, 0.5) == ()


def test_distances_in_arching_leave_an_interval():
    """The published distances agree with one another: they leave the printed mapping 0.26 to 0.34."""
    low, high = friction_from_arching(fkm)
    assert low == pytest.approx(0.26, abs=0.01)
    assert high == pytest.approx(0.34, abs=0.01)


def test_the_interval_holds_the_friction_at_the_printed_stiffness_alone(monkeypatch):
    """`@arching`'s 0.3 lies in it; with a backbone a tenth stiffer or softer in the mapping it does not."""
    nominal = kato.neuroendoscope_section()
    for scale, inside in ((1.0, True), (1.1, False), (0.9, False)):
        robot = replace(nominal, stiffness_scale=scale)
        monkeypatch.setattr(kato, "neuroendoscope_section", lambda robot=robot: robot)
        low, high = friction_from_arching(fkm)
        assert (low < nominal.friction.mu < high) is inside, (scale, low, high)


def test_identified_tension_gives_the_opening_back():
    """The maximum tension found for mu = 0.3 reproduces the published opening."""
    (highest,) = highest_tension_from_opening(fkm_stick, SINGLE_LOOP, 0.3)
    assert 0.5 < highest < 0.6
    assert loop_opening(fkm_stick, SINGLE_LOOP, 0.3, highest) == pytest.approx(9.8e-3, abs=2e-5)


@pytest.mark.long
def test_exact_arms_tell_the_same_story():
    """With exact arms both openings fit one mu as well, some 10 % smaller than the printed mapping's."""
    exact, printed = identify(fkm_exact_arm), identify(fkm)
    assert exact.antagonistic_opening_m[0] == pytest.approx(ANTAGONISTIC_LOOP.opening_m, rel=0.03)
    assert exact.mu[0] / printed.mu[0] == pytest.approx(0.9, abs=0.02)
    low, high = friction_from_arching(fkm_exact_arm)
    assert low == pytest.approx(0.29, abs=0.01)
    assert high == pytest.approx(0.35, abs=0.01)
    assert np.isfinite([low, high]).all()
