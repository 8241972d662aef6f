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


def dealt(kind: int, purpose: str, seed: int, index: int, values: Sequence[str]) -> str:
    """Return one of `values`: of as many draws as there are values each gets another one.

    Args:
        kind: what is dealt, a number of its own.
        purpose, seed, index: of the draw.
        values: to deal.
    """
    block, place = divmod(index, len(values))
    order = np.random.default_rng((kind, _PURPOSE[purpose], seed, block)).permutation(len(values))
    return values[int(order[place])]


def story_of(purpose: str, seed: int, index: int) -> str:
    """Return which kind of story a draw tells."""
    return dealt(_STORY, purpose, seed, index, STORIES)


def robot_of(purpose: str, seed: int, index: int, names: Sequence[str] = tuple(BENCH_ROBOTS)) -> str:
    """Return which of the bench's robots a draw is about."""
    return dealt(_ROBOT, purpose, seed, index, names)


def generator_of(
    purpose: str, seed: int, index: int, attempt: int, kind: int = _CONTENT
) -> np.random.Generator:
    """Return what draws the rest of a draw."""
    return np.random.default_rng((kind, _PURPOSE[purpose], seed, index, attempt))
