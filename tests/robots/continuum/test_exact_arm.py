import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from planar_cases import NO_GRAVITY, SIDEWAYS, cell_angles, eyelets, section, single, tensions, tips_mm
from scipy.optimize import brentq, minimize

from catheter_sim.core.robot import Mount
from catheter_sim.robots.continuum import planar
from catheter_sim.robots.continuum.exact_arm import fkm_exact_arm
from catheter_sim.robots.continuum.kato import fkm, pcca
from catheter_sim.robots.continuum.published import CELL_MASS_KG, CELL_STIFFNESS_N_M_PER_RAD

pytestmark = pytest.mark.slow

K, D, A = CELL_STIFFNESS_N_M_PER_RAD, 1.4e-3, 1e-3

# The nominal specification's table, made with a model written independently of this one:
# right and left tension [N]; tip and body_15 x, z without gravity, tip x, z with +9.81 along x [mm].
NOMINAL = np.array(
    [
        [0.00, 0.00, 0.000, 60.000, 0.000, 30.000, 7.154, 59.509],
        [0.12, 0.12, 0.000, 60.000, 0.000, 30.000, 7.251, 59.496],
        [0.50, 0.12, 37.466, 41.676, 11.806, 26.767, 39.812, 39.085],
        [0.25, 0.12, 22.318, 53.690, 5.296, 29.349, 28.687, 49.627],
        [0.40, 0.12, 30.890, 48.279, 9.054, 28.151, 34.657, 44.945],
        [0.12, 0.12, 0.001, 60.000, 0.000, 30.000, 8.363, 59.307],
        [0.12, 0.45, -34.214, 45.392, -10.466, 27.497, -30.777, 48.147],
        [0.00, 0.00, 0.000, 60.000, 0.000, 30.000, 7.154, 59.509],
    ]
)


@pytest.fixture(scope="module")
def nominal_runs():
    """The nominal table's rows without and with gravity."""
    inputs = tensions(NOMINAL[:, :2])
    return fkm_exact_arm(section(), inputs, NO_GRAVITY), fkm_exact_arm(section(), inputs, SIDEWAYS)


def test_nominal_table_without_gravity(nominal_runs):
    """Tip and body 15 meet the nominal table within 5 um (its last digit is 1 um)."""
    faces = np.array([posture.p_w[[-1, 14]] for posture in nominal_runs[0].postures]) * 1e3
    np.testing.assert_allclose(faces[:, 0, [0, 2]], NOMINAL[:, 2:4], atol=5e-3)
    np.testing.assert_allclose(faces[:, 1, [0, 2]], NOMINAL[:, 4:6], atol=5e-3)


def test_nominal_table_with_gravity(nominal_runs):
    """The tip meets the nominal table with its weight sideways within 5 um."""
    np.testing.assert_allclose(tips_mm(nominal_runs[1]), NOMINAL[:, 6:], atol=5e-3)


def test_balance_recomputed_in_space(nominal_runs):
    """Forces of the straight tendons, weight and backbone balance about every hinge, from the poses alone.

    Everything beyond a hinge is cut free: each tendon pulls its eyelet in the cell's far face toward
    that in the near one, with the tension reported for the cell.
    """
    for run, gravity in zip(nominal_runs, (NO_GRAVITY, SIDEWAYS), strict=True):
        for posture in run.postures:
            angles = cell_angles(posture)
            holes = eyelets(section(), posture)
            hinges = posture.p_w - A * posture.R_w[:, :, 2]
            for k in range(30):
                moment = np.zeros(3)
                for j in range(2):
                    toward = holes[j, k] - holes[j, k + 1]
                    force = posture.tendon_tension[j, k] * toward / np.linalg.norm(toward)
                    moment += np.cross(holes[j, k + 1] - hinges[k], force)
                for face in posture.p_w[k:]:
                    moment += np.cross(face - hinges[k], CELL_MASS_KG * gravity)
                assert abs(moment[1] - K * angles[k]) < 1e-10 * K
        assert run.residual.max() < 1e-10 * K


@pytest.mark.parametrize("gravity", [NO_GRAVITY, SIDEWAYS, np.array([0.0, 0.0, -9.81])])
def test_without_friction_the_potential_is_least(gravity):
    """At mu = 0 the posture is the one that a minimiser of the total potential finds.

    The potential is written without any of the model's formulas: elastic energy, tension times the
    tendon's whole length, weight and tip force times height, all from points placed one by one.
    """
    force = np.array([2e-3, 0.0, -1e-3])

    def potential(angles):
        lean, face = 0.0, np.zeros(2)
        holes = {side: face + np.array([side * D, 0.0]) for side in (1, -1)}
        energy = 0.5 * K * np.sum(angles**2)
        for angle in angles:
            face = face + A * np.array([math.sin(lean), math.cos(lean)])
            lean += angle
            face = face + A * np.array([math.sin(lean), math.cos(lean)])
            for side, tension in ((1, 0.3), (-1, 0.12)):
                hole = face + side * D * np.array([math.cos(lean), -math.sin(lean)])
                energy += tension * np.linalg.norm(hole - holes[side])
                holes[side] = hole
            energy -= CELL_MASS_KG * (gravity[0] * face[0] + gravity[2] * face[1])
        return energy - force[0] * face[0] - force[2] * face[1]

    scale = 1e4  # the potential is of 1e-4 J
    least = minimize(
        lambda angles: scale * potential(angles),
        np.full(30, 0.03),
        method="L-BFGS-B",
        options={"ftol": 1e-15},
    )
    run = fkm_exact_arm(section(0.0), tensions([[0.3, 0.12]], [force]), gravity)
    np.testing.assert_allclose(run.postures[0].joint_angles, least.x, atol=2e-4)
    there, found = potential(run.postures[0].joint_angles), potential(least.x)
    assert there <= found + 1e-15


def test_one_cell_has_a_closed_form():
    """One cell: K t = T exp(-mu t/2) (d cos(t/2) + a sin(t/2)), solved by itself."""
    robot = section()
    segment = replace(robot.segments[0], disks=1, length_m=2 * A)
    robot = replace(robot, segments=(segment,))
    expected = brentq(
        lambda t: K * t - 2.0 * math.exp(-0.15 * t) * (D * math.cos(t / 2) + A * math.sin(t / 2)), 0.0, 1.2
    )
    run = fkm_exact_arm(robot, single(2.0), NO_GRAVITY)
    assert run.postures[0].joint_angles == pytest.approx([expected], rel=1e-12)


def test_equal_tensions_keep_the_robot_straight():
    """Co-contraction does not bend: cos carries the difference, and sin(0) the sum."""
    run = fkm_exact_arm(section(), tensions([[0.2, 0.2], [2.0, 2.0]]), NO_GRAVITY)
    np.testing.assert_allclose(tips_mm(run), [[0, 60], [0, 60]], atol=1e-9)


def test_friction_vanishes_with_mu():
    """mu = 1e-7 gives the frictionless posture, both ways; mu = 0 has no loop at all."""
    inputs = single(0.4, 0.5, 0.4, 0.0)
    tiny, none = (tips_mm(fkm_exact_arm(section(mu), inputs, NO_GRAVITY)) for mu in (1e-7, 0.0))
    np.testing.assert_allclose(tiny, none, atol=1e-4)
    np.testing.assert_allclose(none[0], none[2], atol=1e-9)


def test_mirrored_tensions_give_the_mirrored_robot():
    """Exchanging the tendons through a loop mirrors every posture."""
    rows = np.array([[0.12, 0.12], [0.5, 0.12], [0.3, 0.12], [0.1, 0.4]])
    ours = fkm_exact_arm(section(), tensions(rows), NO_GRAVITY)
    mirrored = fkm_exact_arm(section(), tensions(rows[:, ::-1]), NO_GRAVITY)
    np.testing.assert_allclose(tips_mm(ours), tips_mm(mirrored) * [-1, 1], atol=1e-9)


def turned(angles):
    """Total turn of a tendon from the actuator to the last cell."""
    return np.abs(angles).sum() - 0.5 * abs(angles[-1])


def test_monotone_arching_is_the_capstan():
    """Drawn in over all eyelets, the last cell's tension is the input times exp(-mu total turn)."""
    posture = fkm_exact_arm(section(), single(0.4), NO_GRAVITY).postures[0]
    expected = 0.4 * math.exp(-0.3 * turned(posture.joint_angles))
    assert posture.tendon_tension[0, -1] == pytest.approx(expected, rel=1e-12)


def test_full_reversal_is_the_inverse_capstan():
    """Let out over all eyelets, the last cell's tension is the input times exp(+mu total turn)."""
    posture = fkm_exact_arm(section(0.1), single(1.0, 0.2), NO_GRAVITY).postures[1]
    expected = 0.2 * math.exp(0.1 * turned(posture.joint_angles))
    assert posture.tendon_tension[0, -1] == pytest.approx(expected, rel=1e-12)


def test_partial_unloading_leaves_a_peak():
    """After 0.5 N, at 0.4 N: tension rises from the base to a peak and then is that of 0.5 N (Fig. 14)."""
    before, after = fkm_exact_arm(section(), single(0.5, 0.4), NO_GRAVITY).postures
    profile, old = after.tendon_tension[0], before.tendon_tension[0]
    peak = int(np.argmax(profile))
    assert 3 < peak < 20
    assert (np.diff(profile[: peak + 1]) > 0).all()
    np.testing.assert_allclose(profile[peak + 1 :], old[peak + 1 :], rtol=1e-9)
    assert (profile[:peak] < old[:peak]).all()


def test_history_is_wiped_out_by_a_larger_excursion():
    """A small loop inside leaves no trace once the input goes beyond where it began (single tendon)."""
    with_loop = fkm_exact_arm(section(), single(0.3, 0.2, 0.5), NO_GRAVITY)
    without = fkm_exact_arm(section(), single(0.5), NO_GRAVITY)
    np.testing.assert_allclose(tips_mm(with_loop)[-1], tips_mm(without)[-1], atol=1e-9)


def test_number_of_rows_does_not_matter():
    """The same path in 1 and in 20 rows a leg ends at the same posture, to 1 um."""
    corners = np.array([[0.12, 0.12], [0.5, 0.12], [0.25, 0.12], [0.4, 0.3]])
    fine = np.concatenate([corners[:1], *(np.linspace(a, b, 21)[1:] for a, b in itertools.pairwise(corners))])
    coarse_run = fkm_exact_arm(section(), tensions(corners), NO_GRAVITY)
    fine_run = fkm_exact_arm(section(), tensions(fine), NO_GRAVITY)
    np.testing.assert_allclose(tips_mm(fine_run)[::20], tips_mm(coarse_run), atol=1e-3)


@pytest.mark.parametrize("gravity", [NO_GRAVITY, pytest.param(SIDEWAYS, marks=pytest.mark.slow)])
def test_steps_between_rows_have_converged(gravity, nominal_runs, monkeypatch):
    """Halving the steps moves the tip by at most 5 um over the nominal rows."""
    monkeypatch.setattr(planar, "STEP_BEND_RAD", planar.STEP_BEND_RAD / 2)
    finer = fkm_exact_arm(section(), tensions(NOMINAL[:, :2]), gravity)
    np.testing.assert_allclose(tips_mm(finer), tips_mm(nominal_runs[int(gravity.any())]), atol=5e-3)


def test_tensions_and_stiffness_scale_together():
    """Twice the stiffness at twice the tension is the same shape."""
    inputs = single(0.4, 0.5, 0.3)
    doubled = replace(inputs, tendon=2 * inputs.tendon)
    stiff = replace(section(), stiffness_scale=2.0)
    plain = tips_mm(fkm_exact_arm(section(), inputs, NO_GRAVITY))
    np.testing.assert_allclose(tips_mm(fkm_exact_arm(stiff, doubled, NO_GRAVITY)), plain, atol=1e-9)


def test_elastic_law_and_rest_curvature():
    """A cell bends where EI (k + c3 k^3 + c5 k^5), k beyond the rest curvature, meets the tip moment."""
    cubic, quintic, rest = 2e-5, -3e-10, 4.0
    segment = replace(
        section().segments[0],
        stiffness_cubic_m2=cubic,
        stiffness_quintic_m4=quintic,
        rest_curvature_x_per_m=rest,
    )
    robot = replace(section(), segments=(segment,))
    moment = 6e-4
    run = fkm_exact_arm(robot, tensions([[0, 0], [0, 0]], None, [[0, 0, 0], [0, moment, 0]]), NO_GRAVITY)
    np.testing.assert_allclose(run.postures[0].joint_angles, rest * 2e-3, rtol=1e-12)
    k = run.postures[1].joint_angles / 2e-3 - rest
    assert k == pytest.approx(k[0])
    assert K * 2e-3 * (k[0] + cubic * k[0] ** 3 + quintic * k[0] ** 5) == pytest.approx(moment, rel=1e-9)
    assert k[0] * 2e-3 < 0.99 * moment / K  # it matters


def test_a_softening_law_is_left_on_the_way_it_was_entered():
    """Let out from just below the peak of a softening law, with a load, every cell unbends.

    Beyond the peak, at k = (-3 c3)^-1/2, the same tensions have a second balance, which no path reaches.
    """
    cubic = -5.5e-4
    segment = replace(section().segments[0], stiffness_cubic_m2=cubic)
    robot = replace(section(), segments=(segment,))
    inputs = tensions([[0.0, 0.0], [0.12, 0.3356], [0.12, 0.15]], [[0.0, 0.0, 1e-3]] * 3)
    run = fkm_exact_arm(robot, inputs, NO_GRAVITY)
    peak = 2e-3 / math.sqrt(-3.0 * cubic)
    assert 0.95 * peak < np.abs(run.postures[1].joint_angles).max() < peak
    assert (np.abs(run.postures[2].joint_angles) < np.abs(run.postures[1].joint_angles)).all()
    assert (np.abs(run.postures[2].joint_angles) < 0.5 * peak).all()


def test_a_soft_mount_gives_way_under_everything_that_presses_on_it():
    """All points sink by (tensions - axial force) / stiffness; the shape stays."""
    soft = replace(section(), mount=Mount(axial_stiffness_N_per_m=1000.0))
    inputs = tensions([[0.4, 0.12]], [[0.0, 0.0, 2e-3]])
    rigid, moved = (fkm_exact_arm(robot, inputs, NO_GRAVITY).postures[0] for robot in (section(), soft))
    np.testing.assert_allclose(moved.p_w - rigid.p_w, [[0, 0, -0.518e-3]] * 30, atol=1e-15)
    np.testing.assert_array_equal(moved.R_w, rigid.R_w)


def test_what_acts_across_the_plane_bends_nothing():
    """Force and gravity along y and moments about x and z leave a planar robot as it is."""
    plain = fkm_exact_arm(section(), single(0.4), NO_GRAVITY)
    across = fkm_exact_arm(
        section(), tensions([[0.4, 0]], [[0, 0.1, 0]], [[1e-3, 0, 1e-3]]), np.array([0, 9.81, 0])
    )
    np.testing.assert_allclose(tips_mm(across), tips_mm(plain), atol=1e-9)


def test_difference_to_the_printed_mapping_is_explained():
    """At 0.4 N the exact arm's tip is 0.45 mm off the printed one: arm, first eyelet, little else.

    A cascade written here switches each difference on alone: the arm bends the robot further by
    0.80 mm, the friction of the base eyelet with turns shared by neighbours bends it back by
    0.34 mm, hinges for arcs make 0.01 mm. Without friction the arm alone makes 1.2 mm.
    """

    def tip(arm, neighbours, hinges, mu=0.3):
        angles, tension, before = [], 0.4, 0.0
        for k in range(30):
            angle = 0.0
            for _ in range(60):
                if neighbours:
                    passed = math.exp(-mu * (before + angle) / 2)
                else:
                    sine = mu * math.sin(before / 2)
                    passed = (1 - sine) / (1 + sine) if k else 1.0
                lever = D * math.cos(angle / 2) + A * math.sin(angle / 2) if arm else D
                angle = tension * passed * lever / K
            tension, before = tension * passed, angle
            angles.append(angle)
        angles = np.array(angles)
        span = 2 * np.cos(angles / 2) if hinges else 2 * np.sinc(angles / 2 / np.pi)
        middle = np.cumsum(angles) - angles / 2
        return np.array([np.sum(span * np.sin(middle)), np.sum(span * np.cos(middle))])

    printed = tips_mm(fkm(section(), single(0.4), NO_GRAVITY))[0]
    exact = tips_mm(fkm_exact_arm(section(), single(0.4), NO_GRAVITY))[0]
    np.testing.assert_allclose(tip(0, 0, 0), printed, atol=1e-9)
    np.testing.assert_allclose(tip(1, 1, 1), exact, atol=1e-9)
    parts = {name: tip(*flags) - printed for name, flags in zip("ane", np.eye(3, dtype=int), strict=True)}
    sizes = {name: np.linalg.norm(part) for name, part in parts.items()}
    assert sizes == pytest.approx({"a": 0.80, "n": 0.34, "e": 0.012}, abs=0.01)
    np.testing.assert_allclose(sum(parts.values()), exact - printed, atol=0.02)
    frictionless = tips_mm(fkm_exact_arm(section(0.0), single(0.4), NO_GRAVITY))
    uniform = tips_mm(pcca(section(0.0), single(0.4), NO_GRAVITY))
    assert np.linalg.norm(frictionless - uniform) == pytest.approx(1.23, abs=0.02)
