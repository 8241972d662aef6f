"""A continuum robot's laws on a Warp device."""

from __future__ import annotations

from typing import Any

from catheter_sim.core.law import RobotInModel
from catheter_sim.errors import InputError
from catheter_sim.gpu.continuum_kernels import planar_turns, resist, spatial_turns
from catheter_sim.gpu.device import DeviceCopies, DeviceLaw, DevicePulls, TurnsKernel
from catheter_sim.robots.continuum.laws import ElasticRemainder, HoleTurns
from catheter_sim.robots.continuum.spec import ContinuumRobot

# ----------------------------------------------------------------------------------------------------
# The elastic law of all copies' continuum robots, beyond what MuJoCo's hinges have of it.


class Elastic(DeviceLaw):
    """`robots.continuum.laws.ElasticRemainder` in every copy."""

    def __init__(self, copies: DeviceCopies, remainder: ElasticRemainder) -> None:
        places, numbers = remainder.arrays()
        self._copies, self._shape = copies, places[0].shape
        self._fixed = [copies.whole(item) for item in places] + [copies.real(item) for item in numbers]

    def between(self) -> None:
        """Add the torques."""
        data = self._copies.data
        self._copies.launch(resist, self._shape, *self._fixed, data.qpos, data.qfrc_applied)


# ----------------------------------------------------------------------------------------------------
# A continuum robot's laws on a Warp device.


def laws(
    robot: ContinuumRobot, place: RobotInModel, copies: DeviceCopies, pulls: DevicePulls, tension: Any
) -> tuple[DeviceLaw, ...]:
    """Return the laws but friction; see `gpu.device.Gpu`.

    Raises:
        InputError: a part of the backbone yields.
    """
    if any(segment.plastic_share for segment in robot.segments):
        raise InputError(f"{robot.name}: plastic_share: a backbone that yields is not simulated on a GPU")
    remainder = ElasticRemainder(robot, place)
    return (Elastic(copies, remainder),) if remainder.needed else ()


def turns(robot: ContinuumRobot, place: RobotInModel, copies: DeviceCopies, ends: Any) -> TurnsKernel:
    """Return what finds the turns at the holes."""
    own, data = HoleTurns(robot, place), copies.data
    if own.planar:
        return planar_turns, (), [data.qpos, copies.whole(own.joints)]
    arguments = [data.site_xpos, copies.whole(own.sites), ends]
    return spatial_turns, (len(own.sites),), arguments
