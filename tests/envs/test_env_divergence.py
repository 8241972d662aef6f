"""An episode in which MuJoCo ignores the inputs ends as diverged, in every kind of environment."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest

from catheter_sim.envs.tip import DIVERGED_REWARD
from catheter_sim.envs.vector import OneByOneEnv, TogetherEnv

REACH = "catheter_sim/NeuroendoscopeSectionReach-v0"
TOUGH = ("stiffness_scale=1e14",)  # whose tensions are beyond what MuJoCo takes
TOUGH_ONE_BY_ONE = (*TOUGH, "effects.backlash.width_N=1e-6")  # a history on the inputs
TARGET = {"target": (0.0, 0.0, 0.06)}


def test_an_episode_ends_as_diverged() -> None:
    """Not as a robot that stays straight whatever is pulled; the next episode begins at rest."""
    env = gymnasium.make(REACH, settings=TOUGH)
    env.reset(options=TARGET)
    _, reward, terminated, _, info = env.step(np.array([1.0, 0.0], dtype=np.float32))
    assert (reward, terminated, info["diverged"], info["is_success"]) == (DIVERGED_REWARD, True, True, False)
    _, info = env.reset(options=TARGET)
    assert not info["diverged"]


@pytest.mark.slow
@pytest.mark.parametrize(("settings", "kind"), [(TOUGH, TogetherEnv), (TOUGH_ONE_BY_ONE, OneByOneEnv)])
def test_copies_end_as_diverged(settings: tuple[str, ...], kind: type) -> None:
    """Together on a batch, and one by one in threads: those that pull, and only those."""
    env: Any = gymnasium.make_vec(REACH, 2, "vector_entry_point", threads=2, settings=settings)
    assert isinstance(env, kind)
    env.reset(options=TARGET)
    _, reward, terminated, _, info = env.step(np.array([[1.0, 0.0], [0.0, 0.0]], dtype=np.float32))
    assert terminated.tolist() == [True, False]
    assert reward[0] == DIVERGED_REWARD
    assert np.asarray(info["diverged"]).tolist() == [True, False]
    env.close()
