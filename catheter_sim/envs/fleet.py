"""Many copies of one robot on a pool of threads, and what is drawn for them ahead."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from catheter_sim.arrays import Index
from catheter_sim.envs.plant import Plant
from catheter_sim.envs.robots import Robots, Together

T = TypeVar("T")


class Fleet:
    """Copies of a plant, a part of them for each thread; numbers from 0 choose among them, rising."""

    def __init__(self, plant: Plant, count: int, threads: int) -> None:
        """Make `count` copies on at most so many threads."""
        threads = min(threads, count)
        ends = np.linspace(0, count, threads + 1).astype(int)
        self._first = ends[:-1]
        self._parts: list[Together] = [Together(plant, size) for size in np.diff(ends)]
        self._part_of = np.repeat(np.arange(threads), np.diff(ends))
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None

    @property
    def native_s(self) -> float:
        """Time of the processors spent in MuJoCo and compiled loops since the beginning [s]."""
        return sum(part.native_s for part in self._parts)

    def each(self, chosen: Index, act: Callable[[Robots, Index, Index], T]) -> list[T]:
        """Call `act` for the chosen copies of each thread at once, and return what they return.

        Args:
            chosen: shape (k,).
            act: gets a thread's robots, the numbers of the chosen ones among them, and their places in
                `chosen`.
        """
        tasks: list[Callable[[], T]] = []
        for part, (robots, first) in enumerate(zip(self._parts, self._first, strict=True)):
            places = np.flatnonzero(self._part_of[chosen] == part)
            if len(places):
                own = chosen[places] - first
                tasks.append(lambda robots=robots, own=own, places=places: act(robots, own, places))  # type: ignore[misc]
        if self._pool is None or len(tasks) == 1:
            return [task() for task in tasks]
        return [future.result() for future in [self._pool.submit(task) for task in tasks]]

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()


@dataclass(frozen=True)
class _Drawn(Generic[T]):
    """What was drawn ahead: the generator's state before, the generator after, and the thing."""

    before: object
    after: np.random.Generator
    thing: T


class Supply(Generic[T]):
    """What is drawn by simulation at each reset: many at once, and ahead, on copies of the robots.

    A single copy that ends its episode would leave all threads but one idle. So what is drawn then is drawn
    for every copy that has none in stock. Each copy's things are those that its own generator gives.
    """

    def __init__(
        self,
        plant: Plant,
        count: int,
        threads: int,
        draw: Callable[[Robots, Index, Sequence[np.random.Generator]], list[T]],
    ) -> None:
        """Build the robots that draw."""
        self._fleet = Fleet(plant, count, threads)
        self._draw = draw
        self._stock: dict[int, _Drawn[T]] = {}

    def take(self, chosen: Index, rngs: list[np.random.Generator | None]) -> list[T]:
        """Return a thing for each of the chosen copies, and let their generators have gone on.

        Args:
            chosen: shape (k,).
            rngs: the copies' generators; those of the chosen are replaced.
        """
        for one, stored in list(self._stock.items()):
            rng = rngs[one]
            if rng is None or rng.bit_generator.state != stored.before:  # seeded anew, or used by others
                del self._stock[one]
        if any(int(one) not in self._stock for one in chosen):
            empty = [one for one, rng in enumerate(rngs) if rng is not None and one not in self._stock]
            self._fill(np.array(empty), rngs)
        things = []
        for one in chosen:
            stored = self._stock.pop(int(one))
            rngs[int(one)] = stored.after
            things.append(stored.thing)
        return things

    def close(self) -> None:
        """End the threads."""
        self._fleet.close()

    def _fill(self, empty: Index, rngs: Sequence[np.random.Generator | None]) -> None:
        drawing = [copy.deepcopy(rngs[one]) for one in empty]
        before = [rng.bit_generator.state for rng in drawing if rng is not None]

        def act(robots: Robots, own: Index, places: Index) -> tuple[Index, list[T]]:
            return places, self._draw(robots, own, [rng for k in places if (rng := drawing[k]) is not None])

        for places, things in self._fleet.each(empty, act):
            for place, thing in zip(places, things, strict=True):
                after = drawing[place]
                assert after is not None
                self._stock[int(empty[place])] = _Drawn(before[place], after, thing)
