"""The published continuum robots, a file each, and those that the bench of hidden effects draws."""

from collections.abc import Mapping

from catheter_sim.core.published import Drawn, Published
from catheter_sim.kinds.continuum.robots import drawn, neuroendoscope, spacer_disk

PUBLISHED: tuple[Published, ...] = (*neuroendoscope.PUBLISHED, *spacer_disk.PUBLISHED)
DRAWN: Mapping[str, Drawn] = {
    "file_displacement": drawn.one_segment,
    "file_tension": drawn.two_segments,
}
