"""The published robots of rolling joints, a file each."""

from collections.abc import Mapping

from catheter_sim.core.published import Drawn, Published
from catheter_sim.kinds.rolling.robots import chest_tube

PUBLISHED: tuple[Published, ...] = chest_tube.PUBLISHED
DRAWN: Mapping[str, Drawn] = {}
