"""The published catheters, a file each."""

from collections.abc import Mapping

from catheter_sim.core.published import Drawn, Published
from catheter_sim.kinds.catheter.robots import materials, mitral, mitral_measured

PUBLISHED: tuple[Published, ...] = (
    *mitral.PUBLISHED,
    *materials.PUBLISHED,
    *mitral_measured.PUBLISHED,
)
DRAWN: Mapping[str, Drawn] = {}
