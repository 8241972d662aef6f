"""Claims about `scripts/random_steps.py`: planted faults are found, and where there are none it is quiet."""

from __future__ import annotations

import importlib
import math
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"
SECTION = "NeuroendoscopeSectionReach"


@pytest.fixture(scope="module")
def script() -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(SCRIPTS))
        return importlib.import_module("random_steps")


@pytest.fixture(scope="module")
def section() -> Any:
    return gymnasium.make(f"catheter_sim/{SECTION}-v0", max_episode_steps=4)


class Planted(gymnasium.Wrapper):
    """Does something to the third of all steps, or to all resets."""

    def __init__(self, env: gymnasium.Env, fault: str) -> None:
        super().__init__(env)
        self.fault, self.steps = fault, 0

    def reset(self, **arguments: Any) -> Any:
        if self.fault == "reset":
            model = mujoco.MjModel.from_xml_string(
                "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
            )
            data = mujoco.MjData(model)
            data.qvel[0] = math.nan
            mujoco.mj_step(model, data)
        return self.env.reset(**arguments)

    def step(self, action: Any) -> Any:
        self.steps += 1
        now = self.steps == 3
        if now and self.fault == "engine":
            self.unwrapped.plant.simulator.data.qvel[3] = math.nan
        observation, reward, terminated, truncated, info = self.env.step(action)
        if now:
            plants: dict[str, Callable[[], Any]] = {
                "observation": lambda: observation.__setitem__(0, math.nan),
                "info": lambda: info.__setitem__("force_N", {"wall": math.inf, "lung": 0.0}),
                "python": lambda: warnings.warn("take care", stacklevel=1),
            }
            plants.get(self.fault, lambda: None)()
            reward = math.nan if self.fault == "reward" else reward
        return observation, reward, terminated, truncated, info


@pytest.mark.parametrize(
    ("fault", "lines"),
    [
        ("none", []),
        ("observation", ["the observation lies outside its space"]),
        ("reward", ["reward nan"]),
        ("info", ["info force_N.wall is not finite"]),
        ("python", ["Python warns: take care"]),
        (
            "engine",
            [
                "MuJoCo: Nan, Inf or huge value in QVEL",
                "the simulation diverged",
                "engine's counters of warn",
            ],
        ),
    ],
)
def test_a_planted_fault_is_found_where_it_was_planted(
    script: Any, section: Any, fault: str, lines: list[str]
) -> None:
    """In the third step only, which ends its episode; six steps are taken all the same."""
    walk = script.walk(Planted(section, fault), 6, 0)
    assert (walk.steps, walk.episodes) == (6, 2)
    for line in lines:
        (found,) = [item for item in walk.faults if line in item]
        assert found.startswith("episode 1, seed 0, after step 3: ")
    assert bool(walk.faults) == bool(lines)


def test_what_the_engine_says_during_a_reset_is_found(script: Any, section: Any) -> None:
    """Also of a simulation whose counters nobody can read any more."""
    walk = script.walk(Planted(section, "reset"), 1, 0)
    assert "episode 1, seed 0, after step 0: MuJoCo: Nan, Inf or huge value in QVEL" in walk.faults[0]


def test_exit_status_tells_whether_there_was_a_fault(
    script: Any, section: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Steps are counted for each environment, shared by a turn with the robot as it is and one drawn anew."""
    asked: list[dict[str, Any]] = []
    monkeypatch.setattr(sys, "argv", ["random_steps", "--steps", "7", "--environments", SECTION])
    for fault, status, count in (("none", 0, 0), ("reward", 1, 2)):

        def make(name: str, fault: str = fault, **arguments: Any) -> gymnasium.Env:
            asked.append(arguments)
            return Planted(section, fault)

        monkeypatch.setattr(gymnasium, "make", make)
        assert script.main() == status
        out = capsys.readouterr().out
        assert f"7 of 7 steps, {count} faults" in out
        assert out.splitlines()[-1].startswith(f"{SECTION},7,")
        assert out.count("reward nan") == count
    assert asked[0] == {}
    assert set(asked[1]["randomised"]) == {
        "friction.mu",
        "effects.stiffness.scale",
        "effects.actuation_gain.scale",
    }


def test_unknown_environment_is_refused(
    script: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line with the choices, exit status 2."""
    monkeypatch.setattr(sys, "argv", ["random_steps", "--environments", "NeuroendoscopeFly"])
    assert script.main() == 2
    error = capsys.readouterr().err
    assert error.startswith("random_steps: error: --environments: unknown environment 'NeuroendoscopeFly'")
    assert "NeuroendoscopeTumour" in error


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ChestTubeInsert", "Mitral4dofReach"])
def test_robots_drawn_anew_stay_finite(script: Any, name: str) -> None:
    """A few random steps of other robots than the neuroendoscope's, with all that is drawn."""
    walk = script.turn(name, 10, 3, True)
    assert (walk.steps, walk.faults) == (10, ())


def test_actions_go_to_the_ends_of_ranges(script: Any, section: Any) -> None:
    """Uniform in their space, each for up to twenty steps: drives reach the ends of their ranges."""
    seen: list[np.ndarray] = []

    class Still(gymnasium.Wrapper):
        def step(self, action: Any) -> Any:
            seen.append(np.array(action))
            return self.observation, 0.0, False, False, self.info

        def reset(self, **arguments: Any) -> Any:
            self.observation, self.info = self.env.reset(**arguments)
            return self.observation, self.info

    script.walk(Still(section), 400, 0)
    moved = np.abs(np.diff(seen, axis=0)).max(axis=1) > 0.0
    kept = np.diff(np.flatnonzero(moved))
    assert kept.min() >= 1
    assert 10 < kept.max() <= 20
    assert -1.0 <= np.min(seen) < -0.8
    assert 0.8 < np.max(seen) <= 1.0
