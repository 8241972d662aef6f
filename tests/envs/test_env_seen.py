"""What is seen of a moving robot: tensions of the posture that it is in, what is measured and not what is.

Tensions are worked out here from the way of each tendon through the disks' holes as the posture has them:
T = p + k (u + way - way of the straight robot), the pretension p with its sign.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.arrays import Array
from catheter_sim.core.robot import Friction
from catheter_sim.effects.apply import with_effects
from catheter_sim.envs.reach_and_track import ReachEnv
from catheter_sim.envs.robots import Plant, RobotAlone
from catheter_sim.envs.tip import TipState, look, observe
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon

STILL = (0.0, 0.0, 0.0)
LENGTH_M, DISKS, STIFFNESS, PRETENSION_N = 0.06, 6, 3e3, 1.2


def robot() -> ContinuumRobot:
    """Return a frictionless robot of three elastic tendons that are pulled by their length."""
    return ContinuumRobot(
        name="three",
        description="for the tests",
        segments=(Segment("arm", LENGTH_M, DISKS, 4e-3, 3e-3, 2e-3),),
        tendons=tuple(
            Tendon(
                f"t{k}",
                3e-3,
                math.radians(120.0 * k),
                "arm",
                stiffness_N_per_m=STIFFNESS,
                pretension_N=PRETENSION_N,
            )
            for k in range(3)
        ),
        friction=Friction(0.0),
        actuation="displacement",
    )


def seen(plant: Plant, before: TipState | None = None) -> TipState:
    """Return how a plant stands, one row; a control step after `before`."""
    return look(plant, RobotAlone(plant), np.arange(1), plant.level[np.newaxis], before)


def tensions_by_hand(plant: Plant, displacement_m: Array) -> Array:
    """Return the tensions that the tendons' ways through the holes of the present posture ask for, (t,)."""
    posture = plant.posture()
    p = np.concatenate([np.zeros((1, 3)), posture.p_w])
    R = np.concatenate([np.eye(3)[np.newaxis], posture.R_w])
    found = []
    for tendon, pulled in zip(robot().tendons, displacement_m, strict=True):
        hole = tendon.radius_m * np.array([math.cos(tendon.angle_rad), math.sin(tendon.angle_rad), 0.0])
        way = np.linalg.norm(np.diff(p + R @ hole, axis=0), axis=1).sum()
        found.append(max(PRETENSION_N + STIFFNESS * (pulled + way - LENGTH_M), 0.0))
    return np.array(found)


def test_a_robot_at_rest_bears_its_pretension() -> None:
    """As a tension, in every tendon; and an offset of the zero adds the tendon's stiffness times it."""
    plant = Plant(robot(), "displacement", STILL)
    assert plant.posture().actuator_tension == pytest.approx(np.full(3, PRETENSION_N), abs=1e-6)
    for offset_mm in (0.1, -0.2):
        tight = with_effects(robot(), {"actuation_offset": {"offset_mm": offset_mm}})
        expected = PRETENSION_N + STIFFNESS * offset_mm * 1e-3
        found = Plant(tight, "displacement", STILL).posture().actuator_tension
        assert found == pytest.approx(np.full(3, expected), abs=1e-3)


def test_tensions_are_those_of_the_posture_that_is_seen() -> None:
    """Amid a fast motion, where those of a step of the simulation before would be off; without friction they
    are the same from hole to hole."""
    plant = Plant(robot(), "displacement", STILL)
    plant.move(np.array([0.5, 0.0]), 0.02)
    before = seen(plant)
    assert before.tension[0] == pytest.approx(
        tensions_by_hand(plant, plant.drives.tendon @ plant.level), abs=1e-6
    )
    plant.simulator.step()
    spans = plant.posture().tendon_tension
    now = tensions_by_hand(plant, plant.drives.tendon @ plant.level)
    assert np.abs(now - before.tension).max() > 0.01
    assert seen(plant, before).tension[0] == pytest.approx(now, abs=1e-6)
    np.testing.assert_allclose(spans, np.tile(now[:, np.newaxis], spans.shape[1]), atol=1e-6)


def test_at_the_end_of_a_step_the_whole_command_has_arrived() -> None:
    """However short the step: the inputs are what the levels say, not what they were a moment before."""
    plant = Plant(robot(), "displacement", STILL)
    for level, duration_s in (([0.3, -0.1], 0.1), ([0.31, -0.1], 0.005), ([-0.2, 0.4], 0.02)):
        plant.move(np.array(level), duration_s)
        assert plant.simulator.data.ctrl[:3] == pytest.approx(plant.drives.tendon @ level, abs=1e-12)


def test_what_is_observed_is_as_measured() -> None:
    """A tracker turned and shifted: place, direction and velocity are seen through it, in robot lengths."""
    settings = ["effects.measurement_frame.translation_x_mm=6", "effects.measurement_frame.rotation_z_deg=90"]
    env = ReachEnv("neuroendoscope_section", settings)
    env.plant.move(np.array([0.5, 0.0]), 0.1)
    first = seen(env.plant)
    env.plant.move(np.array([0.6, 0.0]), 0.1)
    now = seen(env.plant, first)
    shown = observe(
        env.plant, now, {"target": np.zeros((1, 3))}, env.state_space, {"held": np.zeros((1, 1))}
    )[0]
    now, first = (TipState(*(part[0] for part in item)) for item in (now, first))
    part = {name: shown[place] for name, place in env.layout.items()}
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert abs(now.tip[0]) > 2e-3
    assert part["tip"] * 0.06 == pytest.approx(quarter @ now.tip + [6e-3, 0.0, 0.0], abs=1e-7)
    assert part["tip_direction"] == pytest.approx(quarter @ now.direction, abs=1e-6)
    velocity = quarter @ (now.tip - first.tip) / 0.1
    assert np.linalg.norm(velocity) > 1e-3
    assert part["tip_velocity"] * 0.06 == pytest.approx(velocity, abs=1e-6)
    assert now.velocity == pytest.approx((now.tip - first.tip) / 0.1)


def test_load_at_rest_is_there_before_the_first_action() -> None:
    """A payload across the tip: the robot stands bent from the start, and stays so while nothing moves."""
    loaded = with_effects(replace(robot(), actuation="tension"), {"payload": {"force_y_N": 0.05}})
    plant = Plant(loaded, "tension", STILL)
    start = plant.posture().p_w[-1]
    # F L^3 / 3 EI of a cantilever; a chain of six hinges bends a few percent otherwise
    assert start[1] == pytest.approx(0.05 * LENGTH_M**3 / 9e-3, rel=0.05)
    plant.move(plant.level, 0.5)
    assert plant.posture().p_w[-1] == pytest.approx(start, abs=1e-6)
