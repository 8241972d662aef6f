"""What must be remembered of a simulation to draw it later.

Joint positions alone do not say where a rolling-joint robot is: the simulation moves its hinges and
links in the model itself (`catheter_sim.robots.rolling.laws`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.pictures.tendon_paint import PulledTendons, stretch_tensions
from catheter_sim.robots import kind_of
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


def state_of(
    simulator: Simulator, tendons: PulledTendons | None = None, before: State | None = None
) -> State:
    """Return what `simulator` shows now.

    Args:
        simulator: the robot.
        tendons: whose tensions are shown, too.
        before: an earlier state; what has not moved since is held once for both.
    """
    model = simulator.model
    now = {name: getattr(model, name) for name in _MOVED}
    now["geom_pos"] = kind_of(simulator.robot).picture.geom_places(simulator.robot, model)
    known = {} if before is None else before.moved
    moved = {
        name: known[name] if name in known and np.array_equal(known[name], values) else values.copy()
        for name, values in now.items()
    }
    tension = stretch_tensions(simulator, tendons) if tendons is not None else ()
    return State(simulator.data.qpos.copy(), moved, tension)


def between(earlier: State, later: State, share: float) -> State:
    """Return the state that lies evenly between two: `share` 0 is the earlier one, 1 the later."""

    def at(first: Array, second: Array) -> Array:
        return first if first is second else (1.0 - share) * first + share * second

    return State(
        at(earlier.qpos, later.qpos),
        {name: at(values, later.moved[name]) for name, values in earlier.moved.items()},
        tuple(at(first, second) for first, second in zip(earlier.tension, later.tension, strict=True)),
    )


def put(state: State, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Let `model` and `data` stand in `state`; kinematics and tendons' paths are up to date."""
    for name, values in state.moved.items():
        getattr(model, name)[:] = values
    data.qpos[:] = state.qpos
    mujoco.mj_fwdPosition(model, data)
