"""A robot as PyMJCF has it: attached to somebody's arena it moves as alone."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

import mujoco
import numpy as np
import pytest

import catheter_sim as cs

pytest.importorskip("dm_control", reason="dm-control has no release for this Python")

ROBOT = "neuroendoscope_section"


def with_control(model: mujoco.MjModel, seconds: float = 0.1) -> mujoco.MjData:
    """Return the state after a while under half the range of the first actuator."""
    data = mujoco.MjData(model)
    data.ctrl[0] = 0.2
    mujoco.mj_step(model, data, round(seconds / model.opt.timestep))
    return data


@pytest.mark.slow
def test_in_an_arena_the_robot_moves_as_alone() -> None:
    """On a turned flange, beside a floor: as plain MuJoCo moves what `cs.build` gives, in the base frame."""
    from dm_control import mjcf

    arena = mjcf.RootElement(model="arena")
    arena.option.gravity = (0.0, 0.0, 0.0)
    arena.worldbody.add("geom", name="floor", type="plane", size=(1.0, 1.0, 0.1))
    flange = arena.worldbody.add("site", pos=(0.1, 0.2, 0.3), quat=(0.5, 0.5, 0.5, 0.5))
    flange.attach(cs.to_pymjcf(ROBOT))
    model = mujoco.MjModel.from_xml_string(arena.to_xml_string())
    alone = cs.build(ROBOT).compile()
    ours, theirs = with_control(alone), with_control(model)
    base = theirs.body(f"{ROBOT}/base_frame")
    tip = base.xmat.reshape(3, 3).T @ (theirs.site(f"{ROBOT}/tip").xpos - base.xpos)
    assert np.linalg.norm(ours.site("tip").xpos - (0.0, 0.0, 0.06)) > 1e-3
    assert tip == pytest.approx(ours.site("tip").xpos, abs=1e-9)
    assert model.opt.disableflags == 0  # contacts of the arena's own
    assert (model.nlight, model.ncam, model.ntex) == (0, 0, 0)
    assert not model.geom_contype[model.geom("floor").id + 1 :].any()
    scope = cs.Simulator(ROBOT, model=model, prefix=f"{ROBOT}/")
    scope.set_inputs([0.2, 0.0])
    scope.step(100)
    assert scope.posture().p_w[-1, 0] > 1e-3


@pytest.mark.slow
@pytest.mark.skipif(
    mujoco.mj_version() >= 4000000,
    reason="dm_control 1.0.50 has no physics for MuJoCo 4: flex_vertedge is gone",
)
def test_a_task_of_ones_own_holds_the_robot() -> None:
    """As a `composer.Entity` in an environment of dm_control: an action bends it, the task sees it."""
    from dm_control import composer

    class Scope(composer.Entity):
        def _build(self) -> None:
            self._model = cs.to_pymjcf(ROBOT)

        @property
        def mjcf_model(self) -> Any:
            return self._model

    class Bend(composer.Task):
        def __init__(self) -> None:
            self._arena, self.scope = composer.Arena(), Scope()
            self._arena.attach(self.scope)
            self.set_timesteps(control_timestep=0.02, physics_timestep=0.0005)

        @property
        def root_entity(self) -> Any:
            return self._arena

        def get_reward(self, physics: Any) -> float:
            return float(physics.bind(self.scope.mjcf_model.find("site", "tip")).xpos[0])

    environment = composer.Environment(Bend())
    environment.reset()
    rewards = [environment.step(np.array([0.2, 0.0])).reward for _ in range(20)]
    assert environment.action_spec().shape == (2,)
    assert rewards[-1] > 1e-3


@pytest.mark.parametrize("setting", [None, "egl"])
@pytest.mark.slow
def test_the_backend_is_left_alone(setting: str | None) -> None:
    """No word on standard error without a screen, and `MUJOCO_GL` is afterwards what it was."""
    environment = {key: value for key, value in os.environ.items() if key not in ("MUJOCO_GL", "DISPLAY")}
    if setting is not None:
        environment["MUJOCO_GL"] = setting
    program = (
        f"import os; import catheter_sim as cs; cs.to_pymjcf({ROBOT!r}); print(os.environ.get('MUJOCO_GL'))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == str(setting)
    assert done.stderr == ""


def test_without_dm_control_a_line_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where it is not installed, as on Python 3.13."""
    monkeypatch.setitem(sys.modules, "dm_control", None)
    with pytest.raises(cs.InputError, match="dm_control cannot be imported: pip install dm-control"):
        cs.to_pymjcf(ROBOT)


@pytest.mark.slow
def test_a_chain_that_pymjcf_does_not_read_is_told() -> None:
    """Its parser takes 255 elements inside one another, MuJoCo's more."""
    robot = cs.load_robot("spacer_disk", {"disks_per_segment": 40, "links_per_subsegment": 4})
    with pytest.raises(cs.InputError, match="dm_control does not read the model"):
        cs.to_pymjcf(robot)
