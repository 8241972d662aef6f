"""Many catheters in compiled loops against `pure`, `balance` and the frames of `kinematics`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.robots.catheter.description import bent_by, elements
from catheter_sim.robots.catheter.kinematics import batch_frames, pk
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.robots.catheter.statics import balance, has_laws
from catheter_sim.robots.catheter.twin import batch_joints

NO_GRAVITY = np.zeros(3)


def varied(robot: CatheterRobot, generator: np.random.Generator, stretching: bool) -> CatheterRobot:
    """Return a robot with other numbers: play, slack, rest, a curved tube, and springs in the tendons."""
    segments = []
    for segment in robot.segments:
        if segment.joint == "bending":
            segment = replace(segment, rest_rad=0.1 * generator.normal())
        if segment.joint == "prismatic":
            x, y = 3.0 * generator.normal(size=2)
            segment = replace(segment, tube_curvature_x_per_m=x, tube_curvature_y_per_m=y)
        segments.append(replace(segment, length_m=segment.length_m * generator.uniform(1.0, 1.1)))
    pairs = []
    for pair in robot.tendons:
        pair = replace(pair, play_m=1e-4 * generator.uniform(0.0, 4.0))
        if pair.name in bent_by(robot):
            pair = replace(pair, slack_m=1e-4 * generator.uniform(0.0, 2.0))
            pair = replace(pair, stiffness_N_per_m=2e4 if stretching else np.inf)
        pairs.append(pair)
    return replace(robot, segments=tuple(segments), tendons=tuple(pairs))


def history(robot: CatheterRobot, generator: np.random.Generator, rows: int = 25) -> Inputs:
    """Return a wandering history of displacements, the tube pushed out."""
    ways = np.cumsum(0.3e-3 * generator.normal(size=(rows, len(robot.tendons))), axis=0)
    for k, pair in enumerate(robot.tendons):
        if next(item for item in robot.segments if item.name == pair.moves).joint == "prismatic":
            ways[:, k] = np.abs(10.0 * ways[:, k])
    zeros = np.zeros((rows, 3))
    return Inputs(np.arange(float(rows)), "displacement", ways, zeros, zeros)


@pytest.mark.parametrize("name", ["mitral_transseptal", "mitral_4dof"])
@pytest.mark.parametrize("stretching", [False, True])
@pytest.mark.parametrize("mu", [0.0, 0.1])
def test_a_batch_is_the_static_models_one_by_one(name, stretching, mu):
    """Tensions and the frames of all elements agree to 1e-12 with `pk` or, where it must be, `balance`."""
    generator = np.random.default_rng(21)
    base = load_robot(name)
    robots = [replace(varied(base, generator, stretching), friction=Friction(mu)) for _ in range(4)]
    inputs = [history(robot, generator) for robot in robots]
    assert has_laws(robots[0]) == (stretching and mu > 0.0)
    values, tension, _ = batch_joints(robots, inputs, NO_GRAVITY)
    last = len(elements(base)) - 1
    wanted = sorted({*range(0, last, 3), last})
    p_w, R_w = batch_frames(robots, values, wanted)
    for index, robot in enumerate(robots):
        model = balance if has_laws(robot) else pk
        for row, posture in enumerate(model(robot, inputs[index], NO_GRAVITY).postures):
            np.testing.assert_allclose(p_w[index, row], posture.p_w[wanted], rtol=0, atol=1e-12)
            np.testing.assert_allclose(R_w[index, row], posture.R_w[wanted], atol=1e-12)
            np.testing.assert_allclose(tension[index, row], posture.actuator_tension, rtol=1e-10, atol=1e-10)


def test_a_robot_out_of_range_is_nan_and_leaves_the_others():
    """A displacement beyond a joint's range, or a force beside a measured law, is NaN, each alone."""
    generator = np.random.default_rng(22)
    robot = load_robot("mitral_transseptal")
    good = history(robot, generator)
    far = replace(good, tendon=good.tendon + np.array([0.1, 0.0, 0.0, 0.0]))
    pushed = replace(good, force_tip=np.ones((len(good), 3)))
    robots = [
        robot,
        robot,
        load_robot("mitral_transseptal", ["tendons.bending.law=uhmwpe", "tendons.bending.length_mm=350"]),
    ]
    values, tension, _ = batch_joints(robots, [good, far, pushed], NO_GRAVITY)
    p_w, _ = batch_frames(robots, values, [0, len(elements(robot)) - 1])
    for found in (values, tension, p_w):
        assert np.isfinite(found[0]).all()
    for found in (values, tension, p_w[:, :, 1]):
        assert np.isnan(found[1:]).all()
