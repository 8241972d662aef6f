"""The laws of many copies of one robot, stepped together by `mujoco.batch`: as `core.law`, for copies.

Index i picks among the m copies; `copies` names those that a call is for, rising, shape (k,).
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Protocol, TypeVar

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.law import RobotInModel
from catheter_sim.core.robot import RobotSpec

R_in = TypeVar("R_in", bound=RobotSpec, contravariant=True)


class CopyArrays:
    """The arrays of a batch's copies, free to be written.

    Attributes:
        qpos, ctrl, applied: positions, controls, applied forces, shapes (m, nq), (m, nu), (m, nv).
    """

    def __init__(self, batch: Any) -> None:
        self._batch = batch
        self.qpos, self.ctrl = batch.bind("qpos"), batch.bind("ctrl")
        self.applied = batch.bind("qfrc_applied")
        self._own: dict[str, Array] = {}

    def own(self, name: str) -> Array:
        """Give each copy its own values of a field of the model, and return them, shape (m, ...)."""
        if name not in self._own:
            self._own[name] = self._batch.expand(name)
        return self._own[name]


class CopiesLaw:
    """One law of all copies, which does nothing; others override what they do.

    Attributes:
        compiled: whether it runs without Python's lock.
        moved: fields of the model that `place` makes each copy's own, by their names, shapes (m, ...).
    """

    compiled = True
    moved: Mapping[str, Array] = MappingProxyType({})

    def reset(self, copies: np.ndarray) -> None:
        """Forget the history."""

    def before(self, copies: np.ndarray, tension: Array) -> None:
        """Do what comes before a step.

        Args:
            copies: which.
            tension: of each tendon in each span as the last step left it, shape (m, t, n) [N].
        """

    def place(self, copies: np.ndarray) -> None:
        """Move joints of the model to where the positions have them."""

    def actuate(self, copies: np.ndarray) -> None:
        """Make actuators what they are at the present positions and controls."""

    def between(self, copies: np.ndarray) -> None:
        """Add forces to the copies' applied ones."""


class CopiesControls(Protocol):
    """From the inputs of many copies to their controls."""

    def reset(self, copies: np.ndarray) -> None:
        """Forget what arrived."""

    def set(self, copies: np.ndarray, start: Array, change: Array, share: float) -> None:
        """Set inputs that have moved from `start` by a share of `change`, shapes (k, t)."""


class StraightCopies:
    """Each input is the control of one actuator: `CopiesControls` of most robots."""

    def __init__(self, arrays: CopyArrays) -> None:
        self._ctrl = arrays.ctrl

    def reset(self, copies: np.ndarray) -> None:
        """There is nothing to forget."""

    def set(self, copies: np.ndarray, start: Array, change: Array, share: float) -> None:
        self._ctrl[copies] = start + change * share


class Batched(Protocol[R_in]):
    """`batched.py`: the laws of many copies at once. The model is the robot's own; a kind may lack it."""

    def covers(self, robot: R_in) -> bool:
        """Return whether the functions below know all laws of `robot` but friction."""

    def rubs(self, robot: R_in) -> bool:
        """Return whether `Turns.of_copies` is there for friction."""

    def laws(self, robot: R_in, place: RobotInModel, arrays: CopyArrays) -> tuple[CopiesLaw, ...]:
        """Return the laws in the order of their turns; none: a step needs no middle but for friction."""

    def controls(self, robot: R_in, place: RobotInModel, arrays: CopyArrays) -> CopiesControls:
        """Return what stands between inputs and controls."""
