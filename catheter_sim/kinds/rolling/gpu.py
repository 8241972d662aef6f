"""The laws of a robot of rolling joints on a Warp device."""

from __future__ import annotations

from typing import Any

from catheter_sim.core.law import RobotInModel
from catheter_sim.kinds.rolling.forces.rods import RodElasticity, RodTurns
from catheter_sim.kinds.rolling.forces.rolling import Rolling as OneRolling
from catheter_sim.kinds.rolling.spec import RollingRobot
from catheter_sim.kinds.rolling.warp import rolling_kernel
from catheter_sim.kinds.rolling.warp.rolling import Rolling
from catheter_sim.mechanics.device import Copies, DeviceLaw, DevicePulls, TurnsKernel


def laws(
    robot: RollingRobot, place: RobotInModel, copies: Copies, pulls: DevicePulls, tension: Any
) -> tuple[DeviceLaw, ...]:
    """Return the laws but friction; see `mechanics.device.Gpu`."""
    return (Rolling(copies, OneRolling(robot, place), RodElasticity(robot, place), pulls, tension),)


def turns(robot: RollingRobot, place: RobotInModel, copies: Copies, ends: Any) -> TurnsKernel:
    """Return what finds the turns in the links."""
    joint, rod, qpos = RodTurns(robot, place).arrays()
    arguments = [copies.data.qpos, copies.whole(qpos), copies.real(joint), copies.real(rod), ends]
    return rolling_kernel.turns, (len(qpos) - 1,), arguments
