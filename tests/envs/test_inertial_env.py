"""Environments in which a robot swings: `dynamics="inertial"` beside the quasi-static default."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.envs.reach_and_track import ReachEnv
from catheter_sim.envs.robots import Plant
from catheter_sim.errors import InputError
from tests.simulation.moving import swinging


def way_back(inertial: bool) -> np.ndarray:
    """Return the tip's x [m] after a pull has gone, every hundredth of a second."""
    plant = Plant(swinging(mu=0.0, damping_time_s=0.002), "tension", (0.0, 0.0, 9.81), inertial=inertial)
    level = np.zeros(len(plant.drives.names))
    level[0] = 0.5
    plant.move(level, 0.5)
    plant.settle()
    plant.move(np.zeros_like(level), 0.02)
    places = []
    for _ in range(60):
        plant.move(np.zeros_like(level), 0.01)
        places.append(plant.posture().p_w[-1, 0])
    return np.array(places)


def test_an_inertial_robot_swings_and_a_quasi_static_one_does_not() -> None:
    swing, creep = way_back(True), way_back(False)
    assert swing.min() < -0.3 * swing.max()  # through the middle and well beyond
    assert creep.min() > -0.02 * swing.max()


@pytest.mark.slow
def test_reset_begins_at_rest_and_the_same_actions_give_the_same_motion() -> None:
    env = ReachEnv("neuroendoscope_section", dynamics="inertial", hold_steps=1000)
    target = {"target": (0.03, 0.0, 0.045)}
    tips = []
    for _ in range(2):
        env.reset(seed=3, options=target)
        tips.append([env.step(np.array([1.0, -1.0], np.float32))[4]["tip_mm"] for _ in range(3)])
    assert np.array_equal(tips[0], tips[1])
    assert env.plant.simulator.moving


def test_other_dynamics_are_refused_with_the_choices() -> None:
    with pytest.raises(InputError, match="choices: quasi-static, inertial"):
        ReachEnv("neuroendoscope_section", dynamics="fast")
