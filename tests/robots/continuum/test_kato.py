import math
from dataclasses import replace

import numpy as np
import pytest
from planar_cases import NO_GRAVITY, section, single, tensions, tips_mm

from catheter_sim.robots.continuum.kato import fkm, fkm_stick, pcca, tension_ratio
from catheter_sim.robots.continuum.published import CELL_STIFFNESS_N_M_PER_RAD, neuroendoscope

K, D = CELL_STIFFNESS_N_M_PER_RAD, 1.4e-3
MU = 0.3
PUBLISHED_STEPS = single(0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.4, 0.3, 0.2, 0.1, 0.0)


def profile(run, row, tendon=0):
    """Return a tendon's tension from cell to cell."""
    return run.postures[row].tendon_tension[tendon]


def opening(run, arching, extending):
    """Return the distance of two rows' tips [mm]."""
    tips = tips_mm(run)
    return float(np.linalg.norm(tips[arching] - tips[extending]))


def test_arching_is_equations_3_and_4_by_hand():
    """One row from rest: theta_i = d tau_i / K, tau_(i+1) = tau_i (1 - mu sin)/(1 + mu sin)."""
    run = fkm(section(), single(0.4), NO_GRAVITY)
    tau = 0.4
    for i in range(30):
        theta = D * tau / K
        assert run.postures[0].joint_angles[i] == pytest.approx(theta, rel=1e-13)
        assert profile(run, 0)[i] == pytest.approx(tau, rel=1e-13)
        tau *= (1 - MU * math.sin(theta / 2)) / (1 + MU * math.sin(theta / 2))


def test_antagonistic_tensions_change_in_opposite_senses():
    """Bending to the right, the right tension falls toward the tip and the left one rises (sgn d)."""
    run = fkm(section(), tensions([[0.12, 0.12], [0.48, 0.12]]), NO_GRAVITY)
    right, left = profile(run, 1, 0), profile(run, 1, 1)
    assert (np.diff(right) < 0).all()
    assert (np.diff(left) > 0).all()
    np.testing.assert_allclose(right * left, 0.48 * 0.12, rtol=1e-12)


def test_extending_shows_the_published_peak():
    """Back from 0.5 N in the paper's steps: rising from the base to a peak, then falling (Fig. 14)."""
    for model in (fkm, fkm_stick):
        run = model(section(), PUBLISHED_STEPS, NO_GRAVITY)
        now, old = profile(run, 6), profile(run, 5)
        peak = int(np.argmax(now))
        assert 3 < peak < 20
        assert (np.diff(now[: peak + 1]) > 0).all()
        assert (np.diff(now[peak:]) < 0).all()
        jump = (1 / tension_ratio(MU, D * now[peak] / K)) ** 2
        assert (now[peak + 1 :] / old[peak + 1 :] < jump * (1 + 1e-9)).all()


def test_sticking_cells_keep_their_tension_exactly():
    """With stick, beyond the peak the old distribution stands; as printed it is lifted."""
    stick = fkm_stick(section(), PUBLISHED_STEPS, NO_GRAVITY)
    printed = fkm(section(), PUBLISHED_STEPS, NO_GRAVITY)
    np.testing.assert_allclose(profile(stick, 6)[15:], profile(stick, 5)[15:], rtol=1e-12)
    assert (profile(printed, 6)[15:] > 1.02 * profile(printed, 5)[15:]).all()


def test_in_full_reversal_printed_and_sticking_agree():
    """Where Eq. 4 never contradicts itself the repair changes nothing: arching, and all let out."""
    inputs = single(0.4, 1.0, 0.3)
    printed, stick = (tips_mm(model(section(0.1), inputs, NO_GRAVITY)) for model in (fkm, fkm_stick))
    np.testing.assert_allclose(printed, stick, atol=1e-9)


def path(legs, rows_a_leg):
    """Return 0 -> 0.5 -> 0 N in so many equal rows a leg of 0.1 N, without the row at rest."""
    up = np.linspace(0, 0.5, legs * rows_a_leg + 1)
    return single(*up[1:], *up[-2::-1])


def test_printed_arching_does_not_depend_on_the_rows():
    """Going up, the number of rows between two tensions does not matter."""
    coarse, fine = fkm(section(), path(5, 1), NO_GRAVITY), fkm(section(), path(5, 50), NO_GRAVITY)
    np.testing.assert_allclose(tips_mm(coarse)[:5], tips_mm(fine)[49:250:50], atol=1e-9)


@pytest.mark.slow
def test_printed_extending_depends_on_the_rows():
    """Coming back to 0.4 N, 50 rows open the printed loop to 2.5 times that of one row.

    The printed sign has no zone of stick: every row that lets the tendon out lifts the tension
    beyond one more cell, by that eyelet's whole jump, however little the row lets out.
    """
    openings = [opening(fkm(section(), path(5, n), NO_GRAVITY), 4 * n - 1, 6 * n - 1) for n in (1, 10, 50)]
    assert openings[0] < openings[1] < openings[2]
    assert openings[2] > 2.4 * openings[0]
    fine = fkm(section(), path(5, 50), NO_GRAVITY)
    assert profile(fine, 299)[-1] > 1.2 * profile(fine, 249)[-1] > 1.2 * 0.25


@pytest.mark.slow
def test_sticking_extending_does_not_depend_on_the_rows():
    """With stick the loop is the same in 1, 10 and 50 rows a leg."""
    coarse = tips_mm(fkm_stick(section(), path(5, 1), NO_GRAVITY))
    for n in (10, 50):
        fine = tips_mm(fkm_stick(section(), path(5, n), NO_GRAVITY))
        np.testing.assert_allclose(fine[n - 1 :: n], coarse, atol=1e-6)


def test_printed_mapping_forgets_friction_while_held():
    """A tension held for 31 rows: sgn(0) takes the friction off one cell after another, to PCCA."""
    held = fkm(section(), single(*[0.4] * 31), NO_GRAVITY)
    uniform = pcca(section(), single(0.4), NO_GRAVITY)
    assert opening(held, 0, 30) > 8.0
    np.testing.assert_allclose(tips_mm(held)[-1], tips_mm(uniform)[0], atol=1e-9)
    stick = fkm_stick(section(), single(*[0.4] * 31), NO_GRAVITY)
    assert opening(stick, 0, 30) < 1e-9


def test_loop_opening_grows_from_zero_and_then_shrinks_with_friction():
    """At 0.4 N after 0.5 N the loop is closed without friction, widest near mu = 0.3, less beyond."""
    inputs = single(0.4, 0.5, 0.4)
    openings = [opening(fkm_stick(section(mu), inputs, NO_GRAVITY), 0, 2) for mu in (0.0, 0.1, 0.3, 0.8)]
    assert openings[0] < 1e-9
    assert openings[1] < openings[2] > openings[3]


@pytest.mark.parametrize("model", [fkm, fkm_stick])
def test_without_friction_the_mappings_are_pcca(model):
    """At mu = 0 tension is uniform, on the way up and back."""
    ours = tips_mm(model(section(0.0), PUBLISHED_STEPS, NO_GRAVITY))
    np.testing.assert_allclose(ours, tips_mm(pcca(section(), PUBLISHED_STEPS, NO_GRAVITY)), atol=1e-9)


def test_pcca_is_a_circle():
    """Uniform tension bends the section into one circular arc of angle n d T / K."""
    total = 30 * D * 0.4 / K
    tip = tips_mm(pcca(section(), single(0.4), NO_GRAVITY))[0]
    np.testing.assert_allclose(tip, 60 / total * np.array([1 - math.cos(total), math.sin(total)]), rtol=1e-12)


@pytest.mark.parametrize("model", [fkm, fkm_stick, pcca])
def test_one_row_of_zeros_is_straight(model):
    """A single row at rest gives the straight robot without any friction sign."""
    run = model(section(), single(0.0), NO_GRAVITY)
    np.testing.assert_allclose(tips_mm(run), [[0, 60]], atol=1e-12)


@pytest.mark.parametrize("model", [fkm, fkm_stick, pcca])
def test_two_sections_follow_the_moment_arm_matrix(model):
    """Beyond a tendon's end its moment arm is zero (Eq. 6): the distal section feels its own pair only."""
    inputs = tensions([[0.2, 0.0, 0.15, 0.15, 0.0, 0.0]])
    run = model(replace(neuroendoscope(), friction=section(0.0).friction), inputs, NO_GRAVITY)
    angles = run.postures[0].joint_angles
    proximal = D * (0.2 + 0.3 * math.cos(math.radians(35))) / K
    np.testing.assert_allclose(angles, [proximal] * 30 + [D * 0.2 / K] * 30, rtol=1e-12)
    assert np.isnan(run.postures[0].tendon_tension[2:, 30:]).all()


def test_large_cocontraction_stays_straight():
    """Equal tensions leave an exact zero, of which the sign function makes nothing."""
    run = fkm(section(), tensions([[100.0, 100.0]]), NO_GRAVITY)
    np.testing.assert_allclose(tips_mm(run), [[0, 60]], atol=1e-9)


def test_ratio_is_the_capstan_for_small_turns():
    """Eq. 4's ratio and exp(-mu theta) differ by less than 1e-5 at a cell's 4 deg."""
    assert tension_ratio(0.3, 0.07) == pytest.approx(math.exp(-0.3 * 0.07), abs=1e-5)
    with pytest.raises(ArithmeticError, match="no tension passes"):
        tension_ratio(2.0, 1.5)


def test_nonlinear_elastic_law_is_inverted():
    """With cubic and quintic terms the angle still balances d tau (Eq. 3, generalised)."""
    cubic, quintic = -2e-5, 1e-10
    segment = replace(section().segments[0], stiffness_cubic_m2=cubic, stiffness_quintic_m4=quintic)
    run = pcca(replace(section(), segments=(segment,)), single(0.4), NO_GRAVITY)
    k = run.postures[0].joint_angles / 2e-3
    np.testing.assert_allclose(K * 2e-3 * (k + cubic * k**3 + quintic * k**5), D * 0.4, rtol=1e-10)
    assert k[0] * 2e-3 > 1.01 * D * 0.4 / K
    assert run.residual.max() < 1e-12
