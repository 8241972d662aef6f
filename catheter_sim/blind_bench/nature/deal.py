"""Which story a draw tells, about which robot, by which cause: dealt so that shares hold for any number."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.blind_bench.robots import BENCH_ROBOTS

# Of 45 draws; of 450, so: 150, 200, 60 and 40.
STORIES = ("none",) * 15 + ("single",) * 20 + ("pair",) * 6 + ("outside",) * 4
FOREIGN = 0.4  # share of the effects that have a foreign form, where a cause has one
# Tuning never sees what judging draws: the purpose is part of every key.
_PURPOSE = {"tune": 0, "judge": 1}
_STORY, _ROBOT, _CONTENT = 11, 12, 13


def story_of(purpose: str, seed: int, index: int) -> str:
    """Return which kind of story a draw tells."""
    block, place = divmod(index, len(STORIES))
    order = np.random.default_rng((_STORY, _PURPOSE[purpose], seed, block)).permutation(len(STORIES))
    return STORIES[int(order[place])]


def robot_of(purpose: str, seed: int, index: int, names: Sequence[str] = tuple(BENCH_ROBOTS)) -> str:
    """Return which of the bench's robots a draw is about."""
    block, place = divmod(index, len(names))
    order = np.random.default_rng((_ROBOT, _PURPOSE[purpose], seed, block)).permutation(len(names))
    return names[int(order[place])]


def generator_of(purpose: str, seed: int, index: int, attempt: int) -> np.random.Generator:
    """Return what draws the rest of a draw."""
    return np.random.default_rng((_CONTENT, _PURPOSE[purpose], seed, index, attempt))
