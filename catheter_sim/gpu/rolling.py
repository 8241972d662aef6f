"""The laws of a robot of rolling joints on a Warp device."""

from __future__ import annotations

from typing import Any

from catheter_sim.core.law import RobotInModel
from catheter_sim.gpu.device import DeviceCopies, DeviceLaw, DevicePulls, TurnsKernel
from catheter_sim.gpu.rolling_kernels import (
    LinksOnDevice,
    compress,
    place,
    pull_evenly,
    resist,
    turns_of_copies,
)
from catheter_sim.robots.rolling.laws import RodElasticity, RodTurns
from catheter_sim.robots.rolling.laws import Rolling as OneRolling
from catheter_sim.robots.rolling.spec import RollingRobot

# ----------------------------------------------------------------------------------------------------
# The rolling joints and rods of all copies.


class DeviceRolling(DeviceLaw):
    """`robots.rolling.laws.Rolling` and `RodElasticity` in every copy."""

    def __init__(
        self, copies: DeviceCopies, rolling: OneRolling, rods: RodElasticity, pulls: DevicePulls, tension: Any
    ) -> None:
        """Prepare from the simulator's own laws.

        `pulls` knows the tensions at the actuators; `tension` is that in the gaps, as friction leaves it, (m,
        t, n) [N]; None: without friction.
        """
        self._copies, self._pulls = copies, pulls
        layout = rolling.layout()
        joint, rod, dofs = rods.arrays()
        self._shape = (len(joint),)
        self._qpos, self._dofs = copies.whole(layout.qpos_index), copies.whole(dofs)
        self._joint, self._rod = copies.real(joint), copies.real(rod)
        self._axis = copies.whole(layout.axis)
        self._length, self._free = copies.each(layout.length), copies.each(layout.length)
        self._joint_index, self._body_index = (
            copies.whole(layout.joint_index),
            copies.whole(layout.body_index),
        )
        self._hinges, self._links = copies.own("jnt_pos"), copies.own("body_pos")
        self._even = tension is None
        self._pulled = (pulls.entering.shape[1], len(joint))
        self._compressible = rolling.compressible
        if self._compressible:
            self._tension = copies.room(*self._pulled) if tension is None else tension
            stiff = copies.real(layout.length), copies.real(layout.compliance)
            tops = copies.whole(layout.top_link), copies.real(layout.top_depth), copies.whole(layout.top_site)
            self._compressed = copies.filled(
                LinksOnDevice, copies.whole(layout.ends), self._body_index, *stiff, *tops
            )
            self._sites = copies.own("site_pos")
            self._home = copies.wp.clone(self._sites)

    def before(self) -> None:
        """Shorten the links and put the hinges where they have rolled to."""
        copies, model, data = self._copies, self._copies.model, self._copies.data
        if self._compressible:
            if self._even:
                self._pulls.between()
                copies.launch(pull_evenly, self._pulled, self._pulls.entering, self._tension)
            loads = self._tension, model.opt.gravity, model.body_mass, data.xmat
            copies.launch(compress, (), self._compressed, *loads, self._length, self._sites)
        joints = data.qpos, self._qpos, self._joint, self._axis, self._length
        places = self._joint_index, self._body_index, self._hinges, self._links
        copies.launch(place, (), *joints, *places)

    def between(self) -> None:
        """Add the moments with which rods and sleeve resist bending."""
        data = self._copies.data
        joints = data.qpos, self._qpos, self._joint, self._rod, self._dofs
        self._copies.launch(resist, self._shape, *joints, data.qfrc_applied)

    def reset(self) -> None:
        """Give the links their own lengths back."""
        self._length.assign(self._free)
        if self._compressible:
            self._sites.assign(self._home)


# ----------------------------------------------------------------------------------------------------
# The laws of a robot of rolling joints on a Warp device.


def laws(
    robot: RollingRobot, place: RobotInModel, copies: DeviceCopies, pulls: DevicePulls, tension: Any
) -> tuple[DeviceLaw, ...]:
    """Return the laws but friction; see `gpu.device.Gpu`."""
    return (DeviceRolling(copies, OneRolling(robot, place), RodElasticity(robot, place), pulls, tension),)


def turns(robot: RollingRobot, place: RobotInModel, copies: DeviceCopies, ends: Any) -> TurnsKernel:
    """Return what finds the turns in the links."""
    joint, rod, qpos = RodTurns(robot, place).arrays()
    arguments = [copies.data.qpos, copies.whole(qpos), copies.real(joint), copies.real(rod), ends]
    return turns_of_copies, (len(qpos) - 1,), arguments
