"""The quick model of catheters, against closed-form kinematics, differences and the simulated robot."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Friction
from catheter_sim.envs.robots import Plant, quick_model
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter.kinematics import input_range_m, pulled_m
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.robots.catheter.steering import CatheterModel
from catheter_sim.simulation.simulator import Simulator

ROBOTS = ("mitral_transseptal", "mitral_4dof")
STILL = (0.0, 0.0, 0.0)
STRAIGHT = np.zeros(4)


def catheter(name: str, *settings: str) -> CatheterRobot:
    robot = load_robot(name, settings)
    assert isinstance(robot, CatheterRobot)
    return robot


def model_of(robot: CatheterRobot) -> CatheterModel:
    model = quick_model(robot, "displacement")
    assert isinstance(model, CatheterModel)
    return model


def test_transseptal_tip_is_the_papers_equation_15_at_its_joint_angles() -> None:
    """At 50 random levels: r = bl (1 - cos b)/b + sin b (dt + h + advance) about the proximal torsion."""
    robot = catheter("mitral_transseptal")
    model = model_of(robot)
    level = np.random.default_rng(1).uniform([-1.0, -1.0, -1.0, 0.0], 1.0, (50, 4))
    tip, values = model.reach(level, STRAIGHT)
    turn, bend, advance, _ = values.T
    straight = 6e-3 + 4.5e-3 + advance
    arc = 31.84e-3
    across = arc * (1.0 - np.cos(bend)) / bend + np.sin(bend) * straight
    along = 15e-3 + arc * np.sin(bend) / bend + np.cos(bend) * straight
    expected = np.stack([across * np.cos(turn), across * np.sin(turn), along], axis=1)
    assert tip == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_levels_are_shares_of_the_displacement_and_not_of_the_angle(name: str) -> None:
    """Every angle needs, by the papers' lengths, just its level's share of the full displacement."""
    robot = catheter(name)
    model = model_of(robot)
    level = np.random.default_rng(2).uniform(model.drives.lowest, 1.0, (20, 4))
    values = model.reach(level, STRAIGHT)[1]
    for drive, segment in enumerate(model.moved):
        own = values[:, model.value[drive]]
        drawn = own if segment.joint == "prismatic" else pulled_m(segment, own)
        assert drawn == pytest.approx(level[:, drive] * model.drives.tendon[drive, drive], abs=1e-12)
        limit = segment.stroke_m or segment.limit_rad
        assert model.drives.bend[model.value[drive], drive] == pytest.approx(limit, rel=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_quick_model_is_the_simulated_robot(name: str) -> None:
    """At rest after a way to random levels: tips within 0.05 mm, joints within 0.02 deg and 1 um."""
    plant = Plant(load_robot(name), None, STILL)
    level = np.random.default_rng(3).uniform(plant.drives.lowest, 1.0, (4, 4))
    tips, values = plant.quick.reach(level, plant.rest_bends)
    for here, tip, value in zip(level, tips, values, strict=True):
        plant.reset()
        plant.move(here, 0.5)
        plant.settle()
        assert plant.posture().p_w[-1] == pytest.approx(tip, abs=0.05e-3)
        error = np.abs(plant.segment_bends() - value)
        assert error[[0, 1, 3]].max() < math.radians(0.02)
        assert error[2] < 1e-6


@pytest.mark.parametrize("name", ROBOTS)
def test_slopes_are_those_of_the_quick_models_own_tips(name: str) -> None:
    """At its own joint values the derivative of `reach`, to a millionth of the length."""
    model = model_of(catheter(name))
    for level in np.random.default_rng(4).uniform([-0.9, -0.9, -0.9, 0.1], 0.9, (5, 4)):
        slopes = model.tip_slopes(level, model.reach(level[np.newaxis], STRAIGHT)[1][0])
        step = 1e-5 * np.eye(4)
        above, below = (model.reach(level + sign * step, STRAIGHT)[0] for sign in (1.0, -1.0))
        assert slopes == pytest.approx((above - below).T / 2e-5, abs=1e-7)


def test_a_joint_that_is_bent_at_rest_has_the_same_range_to_both_sides_within_its_limits() -> None:
    """At 20 deg, toward +: level 1 is the limit of 120 deg, level -1 falls short of -120 deg."""
    robot = catheter("mitral_transseptal", "segments.bending.rest_deg=20")
    plant = Plant(robot, None, STILL)
    assert plant.rest_bends[1] == pytest.approx(math.radians(20.0), rel=1e-6)
    level = np.array([[1.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])
    bends = plant.quick.reach(level, plant.rest_bends)[1][:, 1]
    assert bends[0] == pytest.approx(math.radians(120.0), rel=1e-6)
    assert -math.radians(120.0) < bends[1] < -math.radians(70.0)
    assert bends[2] == pytest.approx(math.radians(20.0), rel=1e-6)


@pytest.mark.parametrize(
    "name",
    [
        *ROBOTS,
        pytest.param("mitral_transseptal@tube", marks=pytest.mark.slow),
        pytest.param("mitral_4dof@elongation", marks=pytest.mark.slow),
    ],
)
def test_ends_of_the_input_range_are_those_that_the_simulation_takes(name: str) -> None:
    """Each end is taken, a hundredth of a millimetre more is refused; endless where a pair stretches."""
    robot = replace(catheter(name), friction=Friction(0.0))
    simulator = Simulator(robot)
    least, most = input_range_m(robot)
    assert np.isfinite(most).sum() == (3 if name in ROBOTS else {"mitral_transseptal@tube": 2}.get(name, 1))
    for ends, beyond in ((least, -1e-5), (most, 1e-5)):
        for pair in np.flatnonzero(np.isfinite(ends)):
            inputs = np.zeros(4)
            inputs[pair] = ends[pair]
            simulator.set_inputs(inputs)
            inputs[pair] += beyond
            with pytest.raises(InputError, match="beyond its joint's range"):
                simulator.set_inputs(inputs)


def test_a_robot_of_bends_toward_x_only_is_planar_and_these_are_not() -> None:
    """Without its torsion joints the transseptal robot stays in the xz plane, a tube curved toward y not."""
    robot = catheter("mitral_transseptal")
    assert not model_of(robot).planar
    assert not model_of(catheter("mitral_4dof")).planar
    flat = replace(robot, segments=robot.segments[1:3], tendons=(robot.tendons[0], robot.tendons[3]))
    assert model_of(flat).planar
    bent = replace(flat.segments[1], tube_curvature_y_per_m=2.0)
    assert not model_of(replace(flat, segments=(flat.segments[0], bent))).planar
