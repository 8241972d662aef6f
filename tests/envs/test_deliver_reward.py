"""What a delivery costs and when it counts: the target is put where the implant's error is known."""

from __future__ import annotations

import math
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catheter_sim.envs.clinical.deliver import HELD_STEPS, DeliverEnv, from_valve, stream


@pytest.fixture(scope="module")
def env() -> DeliverEnv:
    made = gymnasium.make("catheter_sim/MitralTransseptalDeliver-v0").unwrapped
    assert isinstance(made, DeliverEnv)
    made.reset(seed=0, options={"anatomy": made.anatomy})
    return made


def moved(
    axis_m: tuple[float, float, float] = (0.0, 0.0, 0.0), turn_deg: np.ndarray | None = None
) -> np.ndarray:
    """Return a motion in a body's own frame, shape (4, 4)."""
    result = np.eye(4)
    result[:3, 3] = axis_m
    if turn_deg is not None:
        result[:3, :3] = Rotation.from_rotvec(turn_deg, degrees=True).as_matrix()
    return result


def aimed(env: DeliverEnv, off_m: tuple[float, float, float], turn_deg: np.ndarray) -> None:
    """Put the target where the implant's middle is off by `off_m`, in its own frame, and turned."""
    site = env.plant.simulator.data.site("tip")
    here = np.eye(4)
    here[:3, :3], here[:3, 3] = site.xmat.reshape(3, 3), site.xpos
    ahead = moved((0.0, 0.0, env.middle_ahead_m))
    error = moved(off_m) @ moved(turn_deg=turn_deg)
    env.target = here @ ahead @ error @ np.linalg.inv(ahead) @ env._mount  # mounted turned about the axis


@pytest.mark.slow
@pytest.mark.parametrize("off_mm", [(0.0, 0.0, 0.0), (3.0, -4.0, 12.0)])
@pytest.mark.parametrize(
    "turn_deg", [(0.0, 0.0, 0.0), (0.0, 0.0, 18.0), (0.0, 90.0, 0.0), (60.0, -80.0, 75.0)]
)
def test_reward_is_the_way_in_lengths_and_a_tenth_of_the_angle_in_half_turns(
    env: DeliverEnv, off_mm: tuple[float, float, float], turn_deg: tuple[float, float, float]
) -> None:
    """Of the implant's middle; 13 mm and 125 deg alone and together, a tilt as a turn about its axis."""
    aimed(env, (off_mm[0] * 1e-3, off_mm[1] * 1e-3, off_mm[2] * 1e-3), np.array(turn_deg))
    reward, _ = env.judge()
    way, angle = np.linalg.norm(off_mm) * 1e-3, np.linalg.norm(turn_deg)
    assert reward == pytest.approx(-(way / 117.34e-3 + 0.1 * angle / 180.0), abs=1e-9)


@pytest.mark.parametrize(("off_mm", "turn_deg"), [(0.9, 0.0), (0.0, 2.9), (0.9, 2.9)])
def test_held_for_nine_steps_in_a_row(env: DeliverEnv, off_mm: float, turn_deg: float) -> None:
    """Within 1 mm and 3 deg; eight steps, one outside, and it takes nine again."""
    env.begin()
    near = (off_mm * 1e-3, 0.0, 0.0), np.array([turn_deg, 0.0, 0.0])
    done = []
    for step in range(2 * HELD_STEPS):
        aimed(env, *(near if step != HELD_STEPS - 1 else ((1.1e-3, 0.0, 0.0), np.zeros(3))))
        done.append(env.judge()[1])
    assert done == [False] * (2 * HELD_STEPS - 1) + [True]


@pytest.mark.parametrize(("off_mm", "turn_deg"), [(1.1, 0.0), (0.0, 3.1), (1.1, 3.1)])
def test_place_without_turn_is_nothing_and_turn_without_place(
    env: DeliverEnv, off_mm: float, turn_deg: float
) -> None:
    """A little outside of either tolerance, however long: not held."""
    env.begin()
    for _ in range(3 * HELD_STEPS):
        aimed(env, (0.0, off_mm * 1e-3, 0.0), np.array([0.0, turn_deg, 0.0]))
        assert env.judge()[1] is False


def test_depth_counts_beyond_the_place(env: DeliverEnv) -> None:
    """An implant 2 mm too deep is told so, with a plus; one 2 mm short with a minus."""
    env.begin()
    depths = []
    for ahead_m in (-2e-3, 2e-3):
        aimed(env, (0.0, 0.0, ahead_m), np.zeros(3))
        env.judge()
        depths.append(next(value for name, value in env._info().items() if name.startswith("depth")))
    assert depths[0] > 0.0
    assert depths == pytest.approx([-depths[1], -depths[0]])


@pytest.mark.parametrize("apart_deg", [0.0, 25.0])
def test_flow_goes_along_the_valve(env: DeliverEnv, apart_deg: float) -> None:
    """A flow that is so far from the valve's axis is so in the sheath's frame, where it pushes the tip."""
    apart = math.radians(apart_deg)
    flow = replace(env.anatomy.flow, direction=np.array([math.sin(apart), 0.0, math.cos(apart)]))
    case = replace(env.anatomy, flow=flow)
    forces = [stream(case)(time_s, np.array([0.0, 0.0, 0.05])) for time_s in np.linspace(0.0, 0.8, 7)]
    force = max(forces, key=lambda item: float(np.linalg.norm(item)))
    axis = from_valve(case)[:3, 2]
    along = abs(force @ axis) / np.linalg.norm(force)
    assert np.linalg.norm(force) > 1e-3
    assert math.degrees(math.acos(min(along, 1.0))) == pytest.approx(apart_deg, abs=1e-3)
