"""What changes in a draw, which commands the two recordings have, and whether both hide something unknown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.blind_bench.nature import deal
from catheter_sim.blind_bench.robots import BENCH_ROBOTS

# Of 20 draws; of 200, so: 100, 20 and 80; 70, 70 and 60; 100 and 100.
STORIES = ("single",) * 10 + ("pair",) * 2 + ("none",) * 8
COMMANDS = ("same",) * 7 + ("partly",) * 7 + ("other",) * 6
SHARED = ("foreign",) * 10 + ("",) * 10
FOREIGN = 0.2  # share of the changes that have a foreign form, where a cause has one
_STORY, _ROBOT, _CONTENT, _COMMANDS, _SHARED = 21, 22, 23, 24, 25


def story_of(purpose: str, seed: int, index: int) -> str:
    """Return how much changes: "single", "pair" or "none"."""
    return deal.dealt(_STORY, purpose, seed, index, STORIES)


def commands_of(purpose: str, seed: int, index: int) -> str:
    """Return whether the later recording has the earlier one's commands: "same", "partly" or "other"."""
    return deal.dealt(_COMMANDS, purpose, seed, index, COMMANDS)


def shares_unknown(purpose: str, seed: int, index: int) -> bool:
    """Return whether both recordings hide one and the same thing that no diagnosis knows."""
    return bool(deal.dealt(_SHARED, purpose, seed, index, SHARED))


def robot_of(purpose: str, seed: int, index: int, names: Sequence[str] = tuple(BENCH_ROBOTS)) -> str:
    """Return which of the bench's robots a draw is about."""
    return deal.dealt(_ROBOT, purpose, seed, index, names)


def generator_of(purpose: str, seed: int, index: int, attempt: int) -> np.random.Generator:
    """Return what draws the rest of a draw."""
    return deal.generator_of(purpose, seed, index, attempt, _CONTENT)
