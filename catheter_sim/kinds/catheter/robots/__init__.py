"""The published catheters, a file each."""

from collections.abc import Mapping

from catheter_sim.core.published import Drawn, Published
from catheter_sim.kinds.catheter.robots import mitral

PUBLISHED: tuple[Published, ...] = mitral.PUBLISHED
DRAWN: Mapping[str, Drawn] = {}
