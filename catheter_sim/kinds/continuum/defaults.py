"""What a continuum robot's file may leave out, as it follows from the rest: links of its chain, stiffness."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from catheter_sim.kinds.continuum.links import with_enough_links
from catheter_sim.kinds.continuum.material import with_stiffness
from catheter_sim.kinds.continuum.spec import ContinuumRobot

_LINKS = "links_per_subsegment"


def complete(robot: ContinuumRobot, given: Collection[str]) -> ContinuumRobot:
    """Return `robot` with enough links (`links.with_enough_links`) where the file's keys say none."""
    return robot if _LINKS in given else with_enough_links(robot)


def expanded(document: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return a file's document with what other keys stand for: a backbone's stiffness by its material."""
    return with_stiffness(document, where)
