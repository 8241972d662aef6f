"""Published notched tubes, one a file."""

from collections.abc import Mapping

from catheter_sim.core.published import Drawn, Published
from catheter_sim.kinds.notched_tube.robots import notched_wrist

PUBLISHED: tuple[Published, ...] = notched_wrist.PUBLISHED
DRAWN: Mapping[str, Drawn] = {}
