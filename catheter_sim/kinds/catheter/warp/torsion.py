"""The pairs that turn the torsion joints of all copies' catheters."""

from __future__ import annotations

from catheter_sim.kinds.catheter.forces.torsion import TorsionPairs
from catheter_sim.kinds.catheter.warp import torsion_kernel
from catheter_sim.mechanics.device import Copies, DeviceLaw


class Torsion(DeviceLaw):
    """`kinds.catheter.forces.torsion.TorsionPairs` in every copy."""

    def __init__(self, copies: Copies, torsion: TorsionPairs) -> None:
        self._copies, pairs = copies, torsion.arrays()
        self._shape = pairs.actuators.shape
        self._fixed = [copies.whole(pairs.actuators), copies.whole(pairs.qpos)]
        numbers = pairs.radius, pairs.height, pairs.wrap, pairs.home, pairs.stiffness, pairs.gain
        self._fixed += [copies.real(item) for item in numbers]
        self._bias = copies.own("actuator_biasprm")

    def before(self) -> None:
        """Make the joints' actuators the tangents of their pairs."""
        data = self._copies.data
        self._copies.launch(
            torsion_kernel.turn_pairs, self._shape, *self._fixed, data.qpos, data.ctrl, self._bias
        )
