"""All kinds of spoiled data, and data with nothing wrong."""

from __future__ import annotations

from collections.abc import Mapping

from catheter_sim.blind_bench.spoiled.kind import Kind
from catheter_sim.blind_bench.spoiled.kinds import columns, timing, tracker, trials

SOUND = Kind("sound", "nothing is wrong", sound=True)
KINDS: tuple[Kind, ...] = (SOUND, *tracker.KINDS, *columns.KINDS, *timing.KINDS, *trials.KINDS)
BY_NAME: Mapping[str, Kind] = {kind.name: kind for kind in KINDS}
