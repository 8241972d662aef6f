"""What a continuum robot's file may leave out, as it follows from the rest: how many links its chain has."""

from __future__ import annotations

from collections.abc import Collection

from catheter_sim.kinds.continuum.links import with_enough_links
from catheter_sim.kinds.continuum.spec import ContinuumRobot

_LINKS = "links_per_subsegment"


def complete(robot: ContinuumRobot, given: Collection[str]) -> ContinuumRobot:
    """Return `robot` with enough links (`links.with_enough_links`) where the file's keys say none."""
    return robot if _LINKS in given else with_enough_links(robot)
