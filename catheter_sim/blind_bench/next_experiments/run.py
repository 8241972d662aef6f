"""Draws of the bench of next experiments, each in a file of its own: a run goes on where another stopped."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from catheter_sim.blind_bench.nature.code import commit, whole_code
from catheter_sim.blind_bench.next_experiments.draw import drawn
from catheter_sim.blind_bench.places import read_json, write_json


def drawn_once(root: Path, seed: int, robots: Sequence[str], index: int) -> dict[str, Any]:
    """Return the result of a draw; one that lies in `root` is not made again."""
    path = root / "draws" / f"draw_{index:03d}.json"
    known = read_json(path)
    if known is not None:
        return dict(known)
    result = drawn(seed, index, robots) | {"commit": commit(), "code": whole_code()}
    write_json(result, path)
    return result


def results_in(root: Path) -> list[dict[str, Any]]:
    """Return the draws that lie in a folder, in order."""
    found = [read_json(path) for path in sorted((root / "draws").glob("draw_*.json"))]
    return sorted((item for item in found if item is not None), key=lambda item: int(item["index"]))
