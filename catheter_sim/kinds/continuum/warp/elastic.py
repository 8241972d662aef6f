"""The elastic law of all copies' continuum robots, beyond what MuJoCo's hinges have of it."""

from __future__ import annotations

from catheter_sim.kinds.continuum.forces.elastic_law import ElasticRemainder
from catheter_sim.kinds.continuum.warp import elastic_kernel
from catheter_sim.mechanics.device import Copies, DeviceLaw


class Elastic(DeviceLaw):
    """`kinds.continuum.forces.elastic_law.ElasticRemainder` in every copy."""

    def __init__(self, copies: Copies, remainder: ElasticRemainder) -> None:
        places, numbers = remainder.arrays()
        self._copies, self._shape = copies, places[0].shape
        self._fixed = [copies.whole(item) for item in places] + [copies.real(item) for item in numbers]

    def between(self) -> None:
        """Add the torques."""
        data = self._copies.data
        self._copies.launch(elastic_kernel.resist, self._shape, *self._fixed, data.qpos, data.qfrc_applied)
