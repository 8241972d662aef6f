import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from catheter_sim.mechanics.hysteresis import tensions_behind

tension = st.floats(0.0, 1.0)
capstan = st.floats(1.0, 1.5)
D = 1.4e-3


def nominal_pair(before, kept, capstan):
    """The rule for a right and a left tendon in the words of the nominal specification."""
    (t_right, t_left), (k_right, k_left), e = before, kept, capstan
    difference = k_right - k_left
    if difference <= t_right / e - t_left * e:
        return t_right / e, t_left * e
    if difference >= t_right * e - t_left / e:
        return t_right * e, t_left / e
    lowest = max(t_right / e, t_left / e + difference)
    highest = min(t_right * e, t_left * e + difference)
    right = min(max(k_right, lowest), highest)
    return right, right - difference


@given(tension, tension, tension, tension, capstan)
def test_an_antagonistic_pair_follows_the_specification(t_right, t_left, k_right, k_left, e):
    """For one pair the rule is the specification's, written there with differences and limits."""
    ours = tensions_behind([t_right, t_left], [k_right, k_left], [D, -D], e)
    np.testing.assert_allclose(ours, nominal_pair((t_right, t_left), (k_right, k_left), e), atol=1e-12)


@given(tension, tension, capstan, st.sampled_from([D, -D, 0.0]))
def test_one_tendon_keeps_its_tension_unless_pushed(before, kept, e, offset):
    """A single tendon's tension is the one it had, clipped to the capstan's interval, on either side."""
    ours = tensions_behind([before], [kept], [offset], e)
    assert ours == pytest.approx([min(max(kept, before / e), before * e)], abs=1e-15)


@given(st.lists(st.tuples(tension, tension, st.floats(-2e-3, 2e-3)), min_size=1, max_size=5), capstan)
def test_every_tension_stays_within_friction(tendons, e):
    """No tendon changes at an eyelet by more than the capstan allows."""
    before, kept, offset = (list(values) for values in zip(*tendons, strict=True))
    behind = tensions_behind(before, kept, offset, e)
    for after, t in zip(behind, before, strict=True):
        assert t / e - 1e-12 <= after <= t * e + 1e-12


@given(st.lists(st.tuples(tension, tension, st.floats(-2e-3, 2e-3)), min_size=1, max_size=5))
def test_without_friction_tensions_pass(tendons):
    """At E = 1 every tension passes the eyelet unchanged."""
    before, kept, offset = (list(values) for values in zip(*tendons, strict=True))
    assert tensions_behind(before, kept, offset, 1.0) == pytest.approx(before, abs=1e-12)


def test_eyelets_hardly_off_the_axis_slip_as_others_do():
    """The scale of places changes nothing, down to the smallest number; beside others they are neutral."""
    before, kept = [0.25, 0.25], [0.0, 0.5]
    as_others = tensions_behind(before, kept, [1e-3, 1e-3], 1.5)
    assert tensions_behind(before, kept, [2e-311, 2e-311], 1.5) == as_others
    assert tensions_behind([0.4, 0.2], [0.1, 0.2], [D, 1e-311], 1.5) == tensions_behind(
        [0.4, 0.2], [0.1, 0.2], [D, 0.0], 1.5
    )


def test_sticking_tendons_take_the_nearest_tensions_with_the_same_moment():
    """With four tendons the sticking tensions are a constrained least-squares fit to the kept ones."""
    before, offset, e = [0.4, 0.3, 0.3, 0.2], [1.4, 0.9, -0.9, -1.4], 1.2
    kept = [0.5, 0.31, 0.29, 0.18]
    behind = tensions_behind(before, kept, offset, e)
    moment = np.dot(offset, kept)
    fit = minimize(
        lambda t: np.sum((t - kept) ** 2),
        before,
        bounds=[(t / e, t * e) for t in before],
        constraints={"type": "eq", "fun": lambda t: np.dot(offset, t) - moment},
        options={"ftol": 1e-16},
    )
    assert behind != pytest.approx(kept, abs=1e-3)
    np.testing.assert_allclose(behind, fit.x, atol=1e-6)
    assert np.dot(offset, behind) == pytest.approx(moment, rel=1e-12)


@given(tension, tension, tension, tension, capstan)
def test_mirrored_tendons_give_mirrored_tensions(t_right, t_left, k_right, k_left, e):
    """Exchanging the sides exchanges the tensions."""
    ours = tensions_behind([t_right, t_left], [k_right, k_left], [D, -D], e)
    mirrored = tensions_behind([t_left, t_right], [k_left, k_right], [D, -D], e)
    np.testing.assert_allclose(ours, mirrored[::-1], atol=1e-12)


def test_a_tendon_in_the_neutral_plane_is_left_alone():
    """A tendon that bends nothing keeps its tension while its neighbours slip."""
    e = math.exp(0.3 * 0.1)
    behind = tensions_behind([0.4, 0.2], [0.1, 0.2], [D, 0.0], e)
    assert behind == pytest.approx([0.4 / e, 0.2])
