"""Tendons in the colours of their tension, stretch by stretch: friction shows as it falls along them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.mjcf.names import tendon as tendon_name
from catheter_sim.simulation.simulator import Simulator

TENSION_COLOURS = ((0.45, 0.50, 0.58), (0.98, 0.78, 0.10), (0.82, 0.05, 0.08))  # slack, half, full
_WIDER = 1.6  # what is drawn over a tendon's own drawing


def tension_colours(share: ArrayLike) -> NDArray[np.float32]:
    """Return a colour for each tension, shape (*, 4): red, green, blue, opacity from 0 to 1.

    From grey through yellow to red.

    Args:
        share: tensions over what counts as full, shape (*); below 0 is shown as 0, above 1 as 1, NaN as 0.
    """
    place = np.clip(np.nan_to_num(np.asarray(share, float), nan=0.0), 0.0, 1.0)
    stops = np.linspace(0.0, 1.0, len(TENSION_COLOURS))
    channels = [np.interp(place, stops, column) for column in zip(*TENSION_COLOURS, strict=True)]
    return np.stack([*channels, np.ones_like(place)], axis=-1).astype(np.float32)


@dataclass(frozen=True)
class PulledTendons:
    """The tendons of a model that actuators pull and that are drawn as straight stretches.

    Attributes:
        pulls: actuator and tendon of each.
        rows: each one's place among the robot's tendons; -1: none of them (a pair's antagonist).
    """

    pulls: tuple[tuple[int, int], ...]
    rows: tuple[int, ...]


def pulled_tendons(model: mujoco.MjModel, robot: RobotSpec) -> PulledTendons:
    """Return the pulled tendons of a robot's model."""
    pulling = np.flatnonzero(model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_TENDON))
    sites = model.wrap_type[model.tendon_adr] == int(mujoco.mjtWrap.mjWRAP_SITE)
    pulls = tuple(
        (int(actuator), int(model.actuator_trnid[actuator, 0]))
        for actuator in pulling
        if sites[model.actuator_trnid[actuator, 0]]
    )
    names = [tendon_name(tendon.name) for tendon in robot.tendons]
    rows = tuple(
        names.index(name) if name in names else -1
        for name in (model.tendon(tendon).name for _, tendon in pulls)
    )
    return PulledTendons(pulls, rows)


def stretch_tensions(simulator: Simulator, pulled: PulledTendons) -> tuple[Array, ...]:
    """Return the tension in every straight stretch of each pulled tendon, base to tip [N]."""
    model, data = simulator.model, simulator.data
    spans = simulator.span_tension()
    result = []
    for (actuator, tendon), row in zip(pulled.pulls, pulled.rows, strict=True):
        stretches = int(model.tendon_num[tendon]) - 1
        known = spans[row][np.isfinite(spans[row])] if row >= 0 else np.zeros(0)
        if not len(known):
            pull = -model.actuator_gear[actuator, 0] * data.actuator_force[actuator]
            known = np.array([max(0.0, float(pull))])
        # More stretches than spans: a run before the base, or two stretches at each joint.
        result.append(known[np.arange(stretches) * len(known) // stretches])
    return tuple(result)


def paint_tendons(
    scene: mujoco.MjvScene,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    pulled: PulledTendons,
    tensions: Sequence[Array],
    full_N: Sequence[float],
) -> None:
    """Add the tendons to `scene` over their own drawing, as far as it has room.

    Args:
        scene: what is drawn.
        model, data: the robot, its tendons' sites up to date.
        pulled: its tendons.
        tensions: of `stretch_tensions`.
        full_N: what is drawn in the last colour, of each tendon [N].
    """
    for (_, tendon), full, tension in zip(pulled.pulls, full_N, tensions, strict=True):
        first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
        path = data.site_xpos[model.wrap_objid[first : first + count]]
        width = _WIDER * float(model.tendon_width[tendon])
        for k, colour in enumerate(tension_colours(tension / full)):
            if scene.ngeom >= scene.maxgeom:
                return
            geom = scene.geoms[scene.ngeom]
            capsule = mujoco.mjtGeom.mjGEOM_CAPSULE
            mujoco.mjv_initGeom(geom, capsule, np.zeros(3), np.zeros(3), np.eye(3).ravel(), colour)
            mujoco.mjv_connector(geom, capsule, width, path[k], path[k + 1])
            scene.ngeom += 1
