"""Claims about simulated rolling joints and the rods that pull and bend them."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from drive import rows_to_inputs

from catheter_sim.catalogue import load_robot
from catheter_sim.errors import InputError
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.validation.chest_tube import REFERENCE_MM, REFERENCE_N

NO_GRAVITY = np.zeros(3)
ONE_JOINT = ("segments.section.joints=1", "segments.section.length_mm=15", "friction.mu=0")


def exact_face(theta: float) -> np.ndarray:
    """Return the single link's face centre: an arc of radius R rolling on the base's flat [m].

    The arc's centre stands at the height R above the contact, which has moved by R theta; in the link's
    frame the centre lies at (line, R), the face at (0, L).
    """
    radius, line, length = (6.7e-3 if theta >= 0 else 2.275e-3), -1e-3, 15e-3
    cosine, sine = np.cos(theta), np.sin(theta)
    turned = np.array([[cosine, sine], [-sine, cosine]])
    centre = np.array([line + radius * theta, radius])
    return centre + turned @ (np.array([0.0, length]) - np.array([line, radius]))


@pytest.mark.parametrize("tension", [0.0, 10.0, 50.0])
@pytest.mark.parametrize("push", [0.6, -0.6, 0.0])
def test_one_joint_follows_the_cycloid(tension, push):
    """Both signs of the angle, at rest and on the way: at most 5 um from pure rolling, 1 ms step."""
    simulator = Simulator(load_robot("chest_tube_section", ONE_JOINT))
    assert simulator.model.opt.timestep == pytest.approx(1e-3)
    signs = set()
    for i in range(160):
        force = push if i < 80 else -push
        simulator.set_inputs(np.array([tension]), force_tip=(force, 0.0, 0.0))
        simulator.step(4)
        posture = simulator.posture()
        theta = float(posture.joint_angles[0])
        signs.add(np.sign(round(theta, 3)))
        assert posture.p_w[0][[0, 2]] == pytest.approx(exact_face(theta), abs=5e-6)
    if push and tension == 0.0:
        assert {-1.0, 1.0} <= signs


def test_velocity_of_a_rolling_link_is_that_about_its_contact():
    """The model's Jacobian of the face equals the derivative of the exact pose, both signs."""
    simulator = Simulator(load_robot("chest_tube_section", ONE_JOINT))
    step = 1e-6
    for theta in (-0.2, -0.05, 0.05, 0.25):
        simulator.data.qpos[0] = theta
        simulator.posture()
        mujoco.mj_fwdPosition(simulator.model, simulator.data)
        jacobian = np.zeros((3, 1))
        mujoco.mj_jacSite(simulator.model, simulator.data, jacobian, None, simulator.model.site("tip").id)
        exact = (exact_face(theta + step) - exact_face(theta - step)) / (2 * step)
        assert jacobian[[0, 2], 0] == pytest.approx(exact, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("weight", [0.0, 9.81])
def test_section_meets_the_independent_reference(weight):
    """Loading, unloading and a partial loop, with friction: every row within 0.1 mm (1 mm asked)."""
    run = simulate(
        load_robot("chest_tube_section"),
        rows_to_inputs(REFERENCE_N),
        np.array([0.0, 0.0, weight]),
    )
    tips = np.array([posture.p_w[-1][[0, 2]] * 1e3 for posture in run.postures])
    assert np.linalg.norm(tips - REFERENCE_MM[weight], axis=1).max() < 0.1


@pytest.mark.slow
def test_section_does_not_depend_on_the_step():
    """Half the time step moves no tip by more than 0.05 mm."""
    tips = []
    for step in (0.001, 0.0005):
        robot = load_robot("chest_tube_section", (f"dynamics.timestep_s={step}",))
        run = simulate(robot, rows_to_inputs([(5,), (20,), (50,), (20,)]), NO_GRAVITY)
        tips.append([posture.p_w[-1] for posture in run.postures])
    assert np.abs(np.array(tips[0]) - np.array(tips[1])).max() < 5e-5


def test_rods_know_no_displacement_and_no_nested_reference():
    """One line each."""
    robot = load_robot("chest_tube_section")
    with pytest.raises(InputError, match="choices: tension"):
        Simulator(robot, "displacement")
    with pytest.raises(InputError, match="nested"):
        Simulator(robot, friction="nested")


@pytest.mark.slow
def test_compressed_links_follow_the_complete_statics():
    """With the prototype's soft links, at the published tensions: within 0.25 mm of the statics."""
    robot = load_robot("chest_tube_section@prototype")
    inputs = rows_to_inputs([(2.815,), (22.522,), (47.859,), (22.522,)])
    ours = simulate(robot, inputs, NO_GRAVITY).postures
    theirs = STATIC_MODELS["complete"].solve(robot, inputs, NO_GRAVITY).postures
    rigid = load_robot("chest_tube_section@prototype", ("segments.section.link_modulus_Pa=inf",))
    stiff = simulate(rigid, inputs, NO_GRAVITY).postures
    far = [np.linalg.norm(a.p_w[-1] - b.p_w[-1]) for a, b in zip(ours, theirs, strict=True)]
    assert max(far) < 0.25e-3
    assert np.linalg.norm(ours[2].p_w[-1] - stiff[2].p_w[-1]) > 2e-3


def test_a_soft_mount_sinks_as_in_the_statics():
    """Tension and weight press a mount of 20 N/mm alike, 1 mm at 20 N, and the shape is the rigid one's."""
    robot = load_robot("chest_tube_section", ("mount.axial_stiffness_N_per_mm=20",))
    inputs, gravity = rows_to_inputs([(10,), (20,)]), np.array([0.0, 0.0, -9.81])
    ours = simulate(robot, inputs, gravity, ramp_s=1.0).postures
    theirs = STATIC_MODELS["complete"].solve(robot, inputs, gravity).postures
    rigid = STATIC_MODELS["complete"].solve(load_robot("chest_tube_section"), inputs, gravity).postures
    for mine, exact, unmoved in zip(ours, theirs, rigid, strict=True):
        assert mine.p_w == pytest.approx(exact.p_w, abs=5e-6)
        assert mine.joint_angles == pytest.approx(unmoved.joint_angles, abs=1e-5)
    sunk = ours[1].p_w[0, 2] - rigid[1].p_w[0, 2]
    assert sunk == pytest.approx(-(20.0 + 15 * 0.38e-3 * 9.81) / 20e3, rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize("mu", [0.0, 0.316])
def test_soft_links_carry_rods_that_end_before_the_tip(mu):
    """A rod presses the links up to the one that it ends in, and no others: within 0.02 mm of the statics."""
    soft = [f"segments.{name}.link_modulus_Pa=25e6" for name in ("base", "middle", "tip")]
    robot = load_robot("chest_tube", (*soft, f"friction.mu={mu}"))
    tension = np.zeros((1, len(robot.tendons)))
    tension[0, 0] = 20.0
    inputs = rows_to_inputs(tension)
    ours = simulate(robot, inputs, NO_GRAVITY).postures[0]
    theirs = STATIC_MODELS["complete"].solve(robot, inputs, NO_GRAVITY).postures[0]
    assert np.linalg.norm(ours.p_w[-1] - theirs.p_w[-1]) < 2e-5
    passed = np.isfinite(theirs.tendon_tension)
    assert (np.isfinite(ours.tendon_tension) == passed).all()
    assert not passed.all()
