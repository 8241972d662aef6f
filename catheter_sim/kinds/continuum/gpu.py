"""A continuum robot's laws on a Warp device."""

from __future__ import annotations

from typing import Any

from catheter_sim.core.law import RobotInModel
from catheter_sim.kinds.continuum.forces.elastic_law import ElasticRemainder
from catheter_sim.kinds.continuum.forces.paths import HoleTurns
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.kinds.continuum.warp import turns_kernel
from catheter_sim.kinds.continuum.warp.elastic import Elastic
from catheter_sim.mechanics.device import Copies, DeviceLaw, DevicePulls, TurnsKernel


def laws(
    robot: ContinuumRobot, place: RobotInModel, copies: Copies, pulls: DevicePulls, tension: Any
) -> tuple[DeviceLaw, ...]:
    """Return the laws but friction; see `mechanics.device.Gpu`."""
    remainder = ElasticRemainder(robot, place)
    return (Elastic(copies, remainder),) if remainder.needed else ()


def turns(robot: ContinuumRobot, place: RobotInModel, copies: Copies, ends: Any) -> TurnsKernel:
    """Return what finds the turns at the holes."""
    own, data = HoleTurns(robot, place), copies.data
    if own.planar:
        return turns_kernel.planar_turns, (), [data.qpos, copies.whole(own.joints)]
    arguments = [data.site_xpos, copies.whole(own.sites), ends]
    return turns_kernel.spatial_turns, (len(own.sites),), arguments
