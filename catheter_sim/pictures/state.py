"""What must be remembered of a simulation to draw it later.

Joint positions alone do not say where a rolling-joint robot is: the simulation moves its hinges and
links in the model itself (`catheter_sim.kinds.rolling.forces.rolling`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco

from catheter_sim.core.posture import Array
from catheter_sim.kinds import kind_of
from catheter_sim.pictures.tendon_paint import PulledTendons, stretch_tensions
from catheter_sim.simulation.simulator import Simulator

_MOVED = ("jnt_pos", "body_pos", "site_pos")  # fields of the model that a simulation writes


@dataclass(frozen=True)
class State:
    """A simulator's state as far as it is drawn.

    Attributes:
        qpos: joint positions, shape (nq,).
        moved: fields of the model by their names, shapes (..., 3) [m].
        tension: in every stretch of each pulled tendon [N], where the tendons are to be painted by it.
    """

    qpos: Array
    moved: Mapping[str, Array]
    tension: tuple[Array, ...] = ()


def state_of(simulator: Simulator, tendons: PulledTendons | None = None) -> State:
    """Return what `simulator` shows now, with the tensions of `tendons` if these are given."""
    model = simulator.model
    moved = {name: getattr(model, name).copy() for name in _MOVED}
    moved["geom_pos"] = kind_of(simulator.robot).picture.geom_places(simulator.robot, model)
    tension = stretch_tensions(simulator, tendons) if tendons is not None else ()
    return State(simulator.data.qpos.copy(), moved, tension)


def put(state: State, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Let `model` and `data` stand in `state`; kinematics and tendons' paths are up to date."""
    for name, values in state.moved.items():
        getattr(model, name)[:] = values
    data.qpos[:] = state.qpos
    mujoco.mj_fwdPosition(model, data)
