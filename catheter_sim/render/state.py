"""What must be remembered of a simulation to draw it later.

Joint positions alone do not say where a rolling-joint robot is: the simulation moves its hinges and
links in the model itself (`catheter_sim.simulation.rolling`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco

from catheter_sim.mjcf.rolling_links import TOP_PREFIX
from catheter_sim.robots.posture import Array
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.rolling_layout import rolling_joints
from catheter_sim.simulation.simulator import Simulator

_MOVED = ("jnt_pos", "body_pos", "site_pos", "geom_pos")  # fields of the model that a simulation writes


@dataclass(frozen=True)
class State:
    """A simulator's state as far as it is drawn.

    Attributes:
        qpos: joint positions, shape (nq,).
        moved: fields of the model by their names, shapes (..., 3) [m].
    """

    qpos: Array
    moved: Mapping[str, Array]


def state_of(simulator: Simulator) -> State:
    """Return what `simulator` shows now; tops of links that give way are where their faces are."""
    model = simulator.model
    moved = {name: getattr(model, name).copy() for name in _MOVED}
    if isinstance(simulator.robot, RollingRobot):
        for joint in rolling_joints(simulator.robot):
            top = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, f"{TOP_PREFIX}_{joint.index}")
            if top >= 0:
                face = model.site(f"face_{joint.index}").id
                moved["geom_pos"][top, 2] += model.site_pos[face, 2] - joint.link_length_m
    return State(simulator.data.qpos.copy(), moved)


def put(state: State, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Let `model` and `data` stand in `state`; kinematics and tendons' paths are up to date."""
    for name, values in state.moved.items():
        getattr(model, name)[:] = values
    data.qpos[:] = state.qpos
    mujoco.mj_fwdPosition(model, data)
