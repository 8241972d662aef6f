"""What a kind of robot answers about theory: its static models, what they return, and the twin for fits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, Quantity, quantity_of
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError

# ----------------------------------------------------------------------------------------------------
# What every static model returns: the postures, row by row, and the evidence that they balance.
#
# And what all of them refuse in the same words.


class NoEquilibrium(ArithmeticError):
    """No posture balances what acts; the caller knows the row and says so."""


@dataclass(frozen=True)
class StaticRun:
    """Postures of one static model along a history of inputs.

    Attributes:
        model: name of the static model.
        inputs: the inputs that it was given.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        postures: one per row of the inputs.
        residual: largest unbalanced moment at any element, per row, shape (r,) [N m]; of `pk` and
            `four_bar`, what they miss of the displacements [m].
    """

    model: str
    inputs: Inputs
    gravity_mps2: Array
    postures: tuple[Posture, ...]
    residual: Array


def require_tensions(inputs: Inputs, model: str, instead: str = "") -> None:
    """Raise `InputError` where the inputs are displacements; `instead` says what takes these."""
    if quantity_of(inputs.actuation) is not Quantity.TENSION:
        raise InputError(f"static model {model!r}: takes tension inputs only{instead}")


# ----------------------------------------------------------------------------------------------------
# What a kind of robot answers about theory: its static models, and the fast twin that fits go by.
#
# Both know a robot as it is and what arrives at it. Its effects and the columns of files are put around
# them once, for all kinds (`theory/static_models.py`, `theory/twins.py`).

R_in = TypeVar("R_in", bound=RobotSpec, contravariant=True)


def nothing(robot: RobotSpec) -> str:
    """Return that a model knows all of every robot of its kind."""
    return ""


def unless(fits: Callable[[Any], bool], words: str) -> Callable[[Any], str]:
    """Return what gives `words` for robots that do not fit, and "" for those that do; it can be pickled."""
    return partial(_unless, fits, words)


def _unless(fits: Callable[[Any], bool], words: str, robot: Any) -> str:
    return "" if fits(robot) else words


@dataclass(frozen=True)
class StaticModel(Generic[R_in]):
    """One analytic model of one kind of robot.

    Attributes:
        name: as on the command line; no other model of any kind has it.
        summary: what it is and where it comes from, one line.
        law: robot, arriving inputs and gravity (shape (3,) [m/s^2]) to the postures, row after row; the
            robot's `effects` are not read.
        lacks: what it does not know of a robot of its kind, whose effects are built in, and could not leave
            out, in words; "" if nothing: it carries the robot.
    """

    name: str
    summary: str
    law: Callable[[R_in, Inputs, Array], StaticRun]
    lacks: Callable[[R_in], str] = nothing


class Statics(Protocol[R_in]):
    """`statics.py`: which static models are there?"""

    @property
    def MODELS(self) -> Sequence[StaticModel[R_in]]:
        """The models, in the order in which they are listed."""


@dataclass(frozen=True)
class TwinStates:
    """Where B robots are at r rows of inputs, SI units; NaN of a row that has no balance.

    Attributes:
        p_w: centres of the k elements that were asked for, base frame, shape (B, r, k, 3) [m].
        R_w: their orientations, shape (B, r, k, 3, 3).
        joint_angles: gives the joints' angles in the order of `Outputs.joints`, shape (B, r, j) [rad]; few
            ask for them.
        tension: at the actuators, shape (B, r, t) [N].
    """

    p_w: Array
    R_w: Array
    joint_angles: Callable[[], Array]
    tension: Array


class Twin(Protocol[R_in]):
    """Many robots of one kind at once, along rows of inputs: what a fit asks thousands of times.

    It is a value, so that it can be sent to other processes.
    """

    @property
    def carries_load(self) -> bool:
        """Whether it knows a force and a moment on the tip, and the weight."""

    def solve(
        self,
        robots: Sequence[R_in],
        arriving: Sequence[Inputs],
        gravity_mps2: Array,
        elements: Sequence[int],
        every: int,
    ) -> TwinStates:
        """Return where robots are at each `every`-th row; the others still make the history.

        A robot of numbers that have no balance is NaN and no error: a fit must turn back from them.

        Args:
            robots: alike but for their numbers; their `effects` are not read.
            arriving: what arrives at each, all of the same rows.
            gravity_mps2: in the base frame, shape (3,) [m/s^2].
            elements: indices of those whose frames are wanted, rising, counted from 0.
            every: 1 or more.
        """


class Twins(Protocol[R_in]):
    """`twin.py`: which twin do fits go by?"""

    def twin(self, robot: R_in, actuation: str) -> Twin[R_in]:
        """Return the twin of robots like `robot` driven by "tension" or "displacement"."""


@dataclass(frozen=True)
class OneByOne(Generic[R_in]):
    """A twin by any static model, one robot after another.

    Attributes:
        model: the static model.
        joints: number of the robots' joints.
        carries_load: whether the model knows a load on the tip, and the weight.
    """

    model: StaticModel[R_in]
    joints: int
    carries_load: bool = True

    def solve(
        self,
        robots: Sequence[R_in],
        arriving: Sequence[Inputs],
        gravity_mps2: Array,
        elements: Sequence[int],
        every: int,
    ) -> TwinStates:
        """Return where robots are, as `Twin.solve` says."""
        shape = len(robots), len(arriving[0].time_s[::every])
        p_w, R_w = np.full((*shape, len(elements), 3), np.nan), np.full((*shape, len(elements), 3, 3), np.nan)
        angles = np.full((*shape, self.joints), np.nan)
        tension = np.full((*shape, arriving[0].tendon.shape[1]), np.nan)
        wanted = list(elements)
        for index, (robot, inputs) in enumerate(zip(robots, arriving, strict=True)):
            try:
                postures = self.model.law(robot, inputs, gravity_mps2).postures[::every]
            except InputError:
                continue
            p_w[index] = [posture.p_w[wanted] for posture in postures]
            R_w[index] = [posture.R_w[wanted] for posture in postures]
            angles[index] = [posture.joint_angles for posture in postures]
            tension[index] = [posture.actuator_tension for posture in postures]
        return TwinStates(p_w, R_w, lambda: angles, tension)
