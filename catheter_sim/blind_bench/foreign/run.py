"""Draws of the bench of foreign models, each in a file of its own: a run goes on where another stopped."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from catheter_sim.blind_bench.foreign.draw import drawn
from catheter_sim.blind_bench.nature.code import commit, whole_code
from catheter_sim.blind_bench.places import read_json, write_json


def drawn_once(root: Path, models: Path, seed: int, index: int) -> dict[str, Any]:
    """Return the result of a draw; one that lies in `root` is not made again."""
    path = root / "draws" / f"draw_{index:03d}.json"
    known = read_json(path)
    if known is not None:
        return dict(known)
    result = drawn(models, seed, index, root / "data") | {"commit": commit(), "code": whole_code()}
    write_json(result, path)
    return result
