import itertools

import numpy as np
import pytest
from planar_cases import NO_GRAVITY, SIDEWAYS, cell_angles, eyelets, section, single, tensions, tips_mm

from catheter_sim.robots.continuum import exact_arm
from catheter_sim.robots.continuum.exact_arm import fkm_exact_arm, fkm_sliding
from catheter_sim.robots.continuum.published import CELL_STIFFNESS_N_M_PER_RAD, neuroendoscope

pytestmark = pytest.mark.slow

K = CELL_STIFFNESS_N_M_PER_RAD
PRE_SLIDING_M = 1e-4 * 1.4e-3

LOOP = [[0.12, 0.12], [0.5, 0.12], [0.25, 0.12], [0.4, 0.12], [0.12, 0.12], [0.12, 0.45], [0.0, 0.0]]


def test_motion_and_tension_rules_agree_for_one_tendon(monkeypatch):
    """Without weight one tendon sticks by its motion where it sticks by its tension.

    The rules meet as the slip stiffens: 10 um apart in a loop with partial returns as shipped, and
    1 um with ten times the stiffness.
    """
    inputs = single(0.2, 0.5, 0.35, 0.45, 0.3, 0.1, 0.4, 0.0)
    tension = tips_mm(fkm_exact_arm(section(), inputs, NO_GRAVITY))
    np.testing.assert_allclose(tips_mm(fkm_sliding(section(), inputs, NO_GRAVITY)), tension, atol=1e-2)
    monkeypatch.setattr(exact_arm, "PRE_SLIDING_RAD", exact_arm.PRE_SLIDING_RAD / 10)
    np.testing.assert_allclose(tips_mm(fkm_sliding(section(), inputs, NO_GRAVITY)), tension, atol=1e-3)


def test_motion_and_tension_rules_agree_for_a_pair():
    """For a pair the rules differ in the sum of two stuck tendons' tensions only: 0.1 mm."""
    motion, tension = (
        tips_mm(model(section(), tensions(LOOP), NO_GRAVITY)) for model in (fkm_sliding, fkm_exact_arm)
    )
    np.testing.assert_allclose(motion, tension, atol=0.1)


def test_motion_and_tension_rules_stay_close_under_a_steady_weight():
    """Weight sideways, the rules differ by at most 0.2 mm on the nominal rows."""
    motion, tension = (
        tips_mm(model(section(), tensions(LOOP), SIDEWAYS)) for model in (fkm_sliding, fkm_exact_arm)
    )
    np.testing.assert_allclose(motion, tension, atol=0.2)


def test_a_pushed_tip_slips_though_its_tendons_are_held():
    """Tendons held, tip pushed to and fro by 4 mN: by motion the loop is open by 2 mm and more.

    The tension rule cannot know that the tendons move, and is millimetres away from it.
    """
    force = [[0, 0, 0], [4e-3, 0, 0], [-4e-3, 0, 0], [4e-3, 0, 0], [0, 0, 0]]
    inputs = tensions([[0.4, 0.12]] * 5, force)
    motion, tension = (
        tips_mm(model(section(), inputs, NO_GRAVITY)) for model in (fkm_sliding, fkm_exact_arm)
    )
    assert np.linalg.norm(motion[4] - motion[0]) > 2.0
    assert np.linalg.norm(motion[2] - tension[2]) > 3.0


def fine_loop(corners, rows_a_leg):
    """Return the corners with rows between them."""
    legs = [np.linspace(a, b, rows_a_leg + 1)[1:] for a, b in itertools.pairwise(corners)]
    return np.concatenate([np.array(corners[:1], dtype=float), *legs])


@pytest.mark.parametrize(
    ("robot", "corners", "gravity"),
    [
        (section(), [[0.12, 0.12], [0.5, 0.12], [0.3, 0.12]], SIDEWAYS),
        (
            neuroendoscope(),
            [[0.12, 0.12, 0, 0, 0, 0], [0.3, 0.12, 0, 0, 0, 0], [0.3, 0.12, 0.1, 0.1, 0.02, 0.02]],
            NO_GRAVITY,
        ),
    ],
)
def test_slip_follows_the_motion_read_off_the_poses(robot, corners, gravity):
    """Wherever a tendon's length beyond an eyelet changes, its tension is at the capstan's limit there.

    Lengths, turns and tension ratios come from the reported poses and tensions alone. A tendon that
    shortens beyond the eyelet is drawn in and loses exp(-mu turn), one that lengthens gains it, and
    between no ratio leaves these limits.
    """
    # So many rows that each is one step of the model: no eyelet turns back within a row.
    run = fkm_sliding(robot, tensions(fine_loop(corners, 100)), gravity)
    checked = 0
    for old, new in itertools.pairwise(run.postures):
        angles = cell_angles(new)
        turns = np.abs(0.5 * (angles + np.concatenate([[0.0], angles[:-1]])))
        spans = [np.linalg.norm(np.diff(eyelets(robot, item), axis=1), axis=2) for item in (old, new)]
        for j in range(len(robot.tendons)):
            end = int(np.isfinite(new.tendon_tension[j]).sum())
            if new.actuator_tension[j] == 0.0:
                continue
            beyond = [np.cumsum(span[j, :end][::-1])[::-1] for span in spans]
            drawn_in = beyond[0] - beyond[1]
            tension = np.concatenate([[new.actuator_tension[j]], new.tendon_tension[j, :end]])
            loss = -np.log(tension[1:] / tension[:-1])
            limit = robot.friction.mu * turns[:end]
            assert (np.abs(loss) <= limit + 1e-12).all()
            sliding_there = np.abs(drawn_in) > 4 * PRE_SLIDING_M
            np.testing.assert_allclose(
                loss[sliding_there], (np.sign(drawn_in) * limit)[sliding_there], atol=1e-12
            )
            checked += int(sliding_there.sum())
    assert checked > 5000


def test_loop_area_is_the_friction_s_heat():
    """Over a closed loop the actuator's work is what friction turns to heat, eyelet by eyelet.

    Work: tension times tendon drawn in at the base. Heat: jump in tension times sliding at each
    eyelet. Both from poses and tensions; trapezoids over fine rows, 0.5 %.
    """
    rows = fine_loop([[0.12, 0.12], [0.5, 0.12], [0.12, 0.12], [0.12, 0.4], [0.12, 0.12]], 60)
    run = fkm_sliding(section(), tensions(rows), NO_GRAVITY)
    spans = np.array(
        [np.linalg.norm(np.diff(eyelets(section(), item), axis=1), axis=2) for item in run.postures]
    )
    beyond = np.cumsum(spans[:, :, ::-1], axis=2)[:, :, ::-1]
    tension = np.array(
        [np.column_stack([item.actuator_tension, item.tendon_tension]) for item in run.postures]
    )
    drawn_in = -np.diff(beyond, axis=0)

    def middle(values):
        return 0.5 * (values[1:] + values[:-1])

    work = np.sum(middle(tension[:, :, 0]) * drawn_in[:, :, 0])
    heat = np.sum(middle(tension[:, :, :-1] - tension[:, :, 1:]) * drawn_in)
    assert work > 1e-5
    assert heat == pytest.approx(work, rel=5e-3)


def test_pre_sliding_is_small_enough(monkeypatch):
    """A slip three times softer moves the tip by less than 20 um on a pair's partial loop."""
    usual = tips_mm(fkm_sliding(section(), tensions(LOOP), NO_GRAVITY))
    monkeypatch.setattr(exact_arm, "PRE_SLIDING_RAD", 3 * exact_arm.PRE_SLIDING_RAD)
    softer = tips_mm(fkm_sliding(section(), tensions(LOOP), NO_GRAVITY))
    np.testing.assert_allclose(softer, usual, atol=0.02)


def test_every_row_balances():
    """Unbalanced moments stay below 1e-10 of a cell's stiffness, with weight and tip load."""
    inputs = tensions(LOOP, [[1e-3, 0, -1e-3]] * len(LOOP), [[0, 1e-5, 0]] * len(LOOP))
    run = fkm_sliding(section(), inputs, SIDEWAYS)
    assert run.residual.max() < 1e-10 * K


def test_distal_tendons_slip_through_the_proximal_section():
    """Pulling the proximal section drags the distal pair: its tensions part on the way to the distal one.

    The distal tendons do not move at the actuator's command, but the bending proximal section slides
    over them, so the distal section leans back although its own tensions are equal at the base.
    """
    inputs = tensions([[0.12, 0.12, 0, 0, 0, 0], [0.12, 0.12, 0.2, 0.2, 0, 0]])
    posture = fkm_exact_arm(neuroendoscope(), inputs, NO_GRAVITY).postures[1]
    right, left = posture.tendon_tension[0], posture.tendon_tension[1]
    assert right[30] < 0.12 < left[30]
    assert posture.joint_angles[:30].sum() > 0.5
    assert posture.joint_angles[30:].sum() < -0.1


def test_two_sections_take_the_motion_rule():
    """`fkm_exact_arm` solves robots whose tendons end in several segments by motion, under its own name."""
    inputs = tensions([[0.2, 0.1, 0.05, 0.05, 0.0, 0.0]])
    ours = fkm_exact_arm(neuroendoscope(), inputs, NO_GRAVITY)
    np.testing.assert_array_equal(tips_mm(ours), tips_mm(fkm_sliding(neuroendoscope(), inputs, NO_GRAVITY)))
    assert ours.model == "fkm_exact_arm"


@pytest.mark.long
def test_an_upright_robot_that_buckles_is_followed():
    """Two sections standing upright buckle under weight and tension; every row still balances."""
    rows = [
        [0.12, 0.12, 0, 0, 0, 0],
        [0.4, 0.12, 0.05, 0.05, 0.05, 0.05],
        [0.4, 0.12, 0.05, 0.05, 0.25, 0.25],
        [0.3, 0.12, 0.05, 0.05, 0.25, 0.25],
    ]
    run = fkm_sliding(neuroendoscope(), tensions(rows), np.array([0.0, 0.0, -9.81]))
    assert run.residual.max() < 1e-10 * K
    tips = tips_mm(run)
    assert tips[2, 0] > 50 > 0 > tips[3, 0]  # from one side through to the other
