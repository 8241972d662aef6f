"""Several equal robots that one thread moves: each by itself, or all together on a batch.

Both ways give the same numbers, and each copy those of a `plant.Plant` alone, but for rounding, which
friction amplifies over an episode (`vector`). `together` says which it can be; what it cannot be for,
`simulation.copies.copied_together` names.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.envs.plant import START_S, Plant
from catheter_sim.errors import SimulationDiverged
from catheter_sim.pictures.state import State, state_of
from catheter_sim.simulation.copies import Copies, copied_together


class Robots(Protocol):
    """Robots that are chosen by their numbers from 0, rising, an array of shape (k,).

    Those that have diverged stay so until they are reset; nothing is raised.

    Attributes:
        native_s: time of the processor spent outside Python since the beginning [s], where it is known.
    """

    native_s: float

    def reset(self, chosen: Index) -> None:
        """Return to rest, as `Plant.reset`."""

    def move(self, chosen: Index, level: Array, duration_s: float) -> None:
        """Move the drives to `level`, shape (k, d), as `Plant.move`."""

    def settle(self, chosen: Index) -> None:
        """Wait until each is at rest, as `Plant.settle`."""

    def finite(self, chosen: Index) -> np.ndarray:
        """Return which have not diverged, shape (k,)."""

    def tips(self, chosen: Index) -> tuple[Array, Array, Array]:
        """Return the tips' places (k, 3) [m] and orientations (k, 3, 3), and tensions (k, t) [N]."""

    def bends(self, chosen: Index) -> Array:
        """Return their bends, shape (k, *b), as `Plant.segment_bends`."""

    def state(self, one: int) -> State:
        """Return what a picture of one of them needs."""


class OneByOne:
    """Plants, one after another: `Robots` of any kind."""

    native_s = 0.0

    def __init__(self, plants: Sequence[Plant]) -> None:
        self._plants = plants
        self._finite = np.ones(len(plants), dtype=bool)

    def reset(self, chosen: Index) -> None:
        self._finite[chosen] = True
        self._each(chosen, lambda plant, _: plant.reset())

    def move(self, chosen: Index, level: Array, duration_s: float) -> None:
        self._each(chosen, lambda plant, place: plant.move(level[place], duration_s))

    def settle(self, chosen: Index) -> None:
        self._each(chosen, lambda plant, _: plant.settle())

    def finite(self, chosen: Index) -> np.ndarray:
        return self._finite[chosen]

    def tips(self, chosen: Index) -> tuple[Array, Array, Array]:
        seen = [self._plants[one].posture() for one in chosen]
        return (
            np.array([item.p_w[-1] for item in seen]),
            np.array([item.R_w[-1] for item in seen]),
            np.array([item.actuator_tension for item in seen]),
        )

    def bends(self, chosen: Index) -> Array:
        return np.array([self._plants[one].segment_bends() for one in chosen])

    def state(self, one: int) -> State:
        return state_of(self._plants[one].simulator)

    def _each(self, chosen: Index, act: Callable[[Plant, int], None]) -> None:
        for place, one in enumerate(chosen):
            if self._finite[one]:
                try:
                    act(self._plants[one], place)
                except SimulationDiverged:
                    self._finite[one] = False


class Together:
    """Copies of a plant on a batch: `Robots` that `together` affirms."""

    def __init__(self, plant: Plant, count: int) -> None:
        self._plant, self._copies = plant, Copies(plant.simulator, count)
        self._inputs = np.zeros((count, len(plant.specified.tendons)))
        plant.reset()  # its simulator has been reset alone
        rest = plant.inputs_at(np.zeros((1, len(plant.drives.names))))
        assert rest is not None
        self._rest = rest[0]
        self._state = state_of(plant.simulator)

    @property
    def native_s(self) -> float:
        return self._copies.native_s

    def reset(self, chosen: Index) -> None:
        self._copies.reset(chosen)
        self._inputs[chosen] = 0.0
        if self._rest.any():
            self._ramp(chosen, np.tile(self._rest, (len(chosen), 1)), START_S)
        self.settle(chosen)

    def move(self, chosen: Index, level: Array, duration_s: float) -> None:
        inputs = self._plant.inputs_at(level)
        assert inputs is not None
        self._ramp(chosen, inputs, duration_s)

    def settle(self, chosen: Index) -> None:
        self._copies.settle(chosen)

    def finite(self, chosen: Index) -> np.ndarray:
        return self._copies.finite(chosen)

    def tips(self, chosen: Index) -> tuple[Array, Array, Array]:
        return self._copies.tips(chosen)

    def bends(self, chosen: Index) -> Array:
        return self._plant.bends_at(self._copies.qpos[chosen])

    def state(self, one: int) -> State:
        return State(self._copies.qpos[one].copy(), {**self._state.moved, **self._copies.moved(one)})

    def _ramp(self, chosen: Index, inputs: Array, duration_s: float) -> None:
        self._copies.ramp(chosen, self._inputs[chosen], inputs, duration_s)
        self._inputs[chosen] = inputs


def together(plant: Plant) -> bool:
    """Whether copies of `plant` can be moved `Together`."""
    plain = plant.inputs_at(plant.level[np.newaxis]) is not None and not plant.sees_the_past
    return plain and not plant.inertial and copied_together(plant.simulator)
