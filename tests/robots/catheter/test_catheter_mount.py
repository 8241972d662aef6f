"""A mount that gives way under a catheter: statics against the simulation, by hand, and who refuses it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Mount
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter.description import bent_by, joint_stiffness
from catheter_sim.robots.catheter.kinematics import batch_frames, pk, pulled_m, sunk_by
from catheter_sim.robots.catheter.measured import mk, te
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.robots.catheter.statics import balance
from catheter_sim.robots.catheter.twin import batch_joints
from catheter_sim.simulation.replay import simulate

NO_GRAVITY = np.zeros(3)
ROBOTS = ["mitral_transseptal", "mitral_4dof"]


def on_mount(name: str, stiffness_N_per_mm: float) -> CatheterRobot:
    """Return a robot on a mount that gives way."""
    robot: CatheterRobot = load_robot(name)
    return replace(robot, mount=Mount(stiffness_N_per_mm * 1e3))


def driven(robot: CatheterRobot, rows: list[list[float]]) -> Inputs:
    """Return displacements of the pairs by row [mm], from rest."""
    ways = 1e-3 * np.array([[0.0] * len(robot.tendons), *rows])
    zeros = np.zeros((len(ways), 3))
    return Inputs(np.arange(float(len(ways))), "displacement", ways, zeros, zeros)


@pytest.mark.parametrize("stiffness_N_per_mm", [20.0, 2.0])
@pytest.mark.parametrize("name", ROBOTS)
def test_it_is_the_simulations(name: str, stiffness_N_per_mm: float) -> None:
    """Tips agree to 6 um, joints pulled singly and together, either way; a rigid mount differs by 1 mm."""
    robot = on_mount(name, stiffness_N_per_mm)
    inputs = driven(robot, [[1, 0, 0, 0], [1, 1, 0, 0], [-2, 2, 1, 0], [-2, 1, 1, 10]])
    simulated = np.array([item.p_w[-1] for item in simulate(robot, inputs, NO_GRAVITY).postures])
    static = np.array([item.p_w[-1] for item in balance(robot, inputs, NO_GRAVITY).postures])
    rigid = balance(replace(robot, mount=Mount()), inputs, NO_GRAVITY).postures
    np.testing.assert_allclose(static, simulated, rtol=0, atol=6e-6)
    assert np.linalg.norm(static[-1] - rigid[-1].p_w[-1]) > 1e-3


@pytest.mark.parametrize("name", ROBOTS)
def test_what_is_left_over_is_rounding(name: str) -> None:
    """Ways, tensions by the lever at the angle and the base's way meet, worked out anew."""
    robot = on_mount(name, 3.0)
    inputs = driven(robot, [[0.5, 0, 0, 0], [2, 1, 0, 0], [-1, 3, 2, 20]])
    run = balance(robot, inputs, NO_GRAVITY)
    assert run.residual.max() < 1e-12
    sunk = sunk_by(robot, inputs.tendon)
    angles = batch_joints([robot], [inputs], NO_GRAVITY)[0][0]
    for row in range(1, len(inputs)):
        tension = 0.0
        for pair, item in enumerate(robot.tendons):
            if item.name not in bent_by(robot):
                continue
            segment, angle, step = bent_by(robot)[item.name], angles[row, pair], 1e-6
            turned = pulled_m(segment, np.array([angle - step, angle + step]))
            arm = (turned[1] - turned[0]) / (2.0 * step)
            tension += joint_stiffness(robot, segment) * abs(angle - segment.rest_rad) / arm
            drawn = abs(inputs.tendon[row, pair]) - sunk[row]
            assert abs(float(pulled_m(segment, angle))) == pytest.approx(max(drawn, 0.0), abs=1e-12)
        assert sunk[row] == pytest.approx(tension / 3e3, rel=1e-6)
        rigid = balance(replace(robot, mount=Mount()), inputs, NO_GRAVITY).postures[0].p_w[0, 2]
        assert run.postures[row].p_w[0, 2] < rigid or sunk[row] == 0.0


def test_a_small_bend_is_springs_in_series() -> None:
    """Of one joint bent little, the mount takes K / a^2 / (k + K / a^2) of the way."""
    robot = on_mount("mitral_transseptal", 5.0)
    inputs = driven(robot, [[0.01, 0, 0, 0]])
    (segment,) = bent_by(robot).values()
    joint = joint_stiffness(robot, segment) / segment.arm_m**2
    assert sunk_by(robot, inputs.tendon)[1] == pytest.approx(1e-5 * joint / (5e3 + joint), rel=2e-3)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_stiff_mount_is_a_rigid_one(name: str) -> None:
    """At 1e9 N/mm nothing is left of it, and the batch is the model, one by one."""
    soft, stiff = on_mount(name, 3.0), on_mount(name, 1e9)
    inputs = driven(soft, [[1, 0, 0, 0], [1, 1, 0, 0], [-2, 2, 1, 5]])
    rigid = replace(soft, mount=Mount())
    robots = [soft, stiff, rigid]
    values, tension, sunk = batch_joints(robots, [inputs] * 3, NO_GRAVITY)
    places, _ = batch_frames(robots, values, [0, 3])
    places[..., 2] -= sunk[:, :, np.newaxis]
    np.testing.assert_allclose(places[1], places[2], atol=1e-12)
    for index, robot in enumerate(robots):
        for row, posture in enumerate(pk(robot, inputs, NO_GRAVITY).postures):
            np.testing.assert_allclose(places[index, row], posture.p_w[[0, 3]], rtol=0, atol=1e-12)
            np.testing.assert_allclose(tension[index, row], posture.actuator_tension, atol=1e-10)
        for row, posture in enumerate(balance(robot, inputs, NO_GRAVITY).postures):
            np.testing.assert_allclose(places[index, row], posture.p_w[[0, 3]], rtol=0, atol=1e-12)


def test_models_that_do_not_know_it_refuse() -> None:
    """Printed models, and `balance` beside friction or a measured law; none leaves it out silently."""
    transseptal, four_dof = on_mount("mitral_transseptal", 2.0), on_mount("mitral_4dof@elongation", 2.0)
    inputs = driven(transseptal, [[1, 0, 0, 0]])
    with pytest.raises(InputError, match=r"mount\.axial_stiffness_N_per_mm = 2: static model 'mk'"):
        mk(transseptal, inputs, NO_GRAVITY)
    with pytest.raises(InputError, match=r"static model 'te' has no mount that gives way"):
        te(on_mount("mitral_4dof", 2.0), inputs, NO_GRAVITY)
    with pytest.raises(InputError, match=r"not beside friction"):
        balance(four_dof, inputs, NO_GRAVITY)
    assert np.isnan(batch_joints([four_dof], [inputs], NO_GRAVITY)[0]).all()
