"""What a simulation does beside MuJoCo's own step: a row of laws, for one robot or many copies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec

if TYPE_CHECKING:
    import mujoco

# ----------------------------------------------------------------------------------------------------
# What a simulation does beside MuJoCo's own step: a row of laws, for robots of any kind.
#
# A kind's face `laws.py` returns its laws in the order of their turns. One step of a robot is
#
#     before(step)     of every law: springs and lengths as the last step left them
#     place(data)      of every law: joints of the model moved to where the positions have them
#     mj_step1         positions and velocities are known
#     actuate(step)    of every law: actuators as they are at these positions
#     between(step)    of every law: forces added to `data.qfrc_applied`; friction comes last
#     mj_step2         forces move the robot
#
# A law overrides what it needs of `Law`; what it leaves alone costs nothing.

R_in = TypeVar("R_in", bound=RobotSpec, contravariant=True)
BASE = "base_frame"  # body that carries a robot in a model that is not its own


class Views:
    """Arrays of a MuJoCo model or state, which its bindings make at every access, each made once."""

    def __init__(self, *names: str, one_copy: bool = False) -> None:
        """Prepare; `one_copy`: an axis of one copy goes before the others, for loops over many."""
        self._names, self._one_copy = names, one_copy
        self._owner: Any = None
        self._arrays: tuple[Any, ...] = ()

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy takes over: it looks its own arrays up."""
        return {"_names": self._names, "_one_copy": self._one_copy, "_owner": None, "_arrays": ()}

    def __call__(self, owner: mujoco.MjModel | mujoco.MjData) -> tuple[Any, ...]:
        """Return the arrays of `owner`, which it writes to as it always does."""
        if owner is not self._owner:
            arrays = tuple(getattr(owner, name) for name in self._names)
            self._arrays = tuple(item[np.newaxis] for item in arrays) if self._one_copy else arrays
            self._owner = owner
        return self._arrays


class RobotInModel:
    """A robot's own elements in a MuJoCo model, which may hold more than this robot.

    Attributes:
        model: MuJoCo's.
        prefix: of the names of all its elements; empty: the model is the robot's own.
        base: number of the body whose frame is the base frame; None: the base frame is the world's.
    """

    def __init__(self, model: mujoco.MjModel, prefix: str = "") -> None:
        """Find the robot.

        Raises:
            KeyError: there is a prefix, and no body `<prefix>base_frame`.
        """
        self.model, self.prefix = model, prefix
        self.base: int | None = int(self.body(BASE).id) if prefix else None

    def joint(self, name: str) -> Any:
        """Return MuJoCo's view of the joint `name`; KeyError: there is none. So the next four."""
        return self.model.joint(self.prefix + name)

    def body(self, name: str) -> Any:
        return self.model.body(self.prefix + name)

    def site(self, name: str) -> Any:
        return self.model.site(self.prefix + name)

    def tendon(self, name: str) -> Any:
        return self.model.tendon(self.prefix + name)

    def actuator(self, name: str) -> Any:
        return self.model.actuator(self.prefix + name)

    def has_joint(self, name: str) -> bool:
        """Return whether there is a joint `name`."""
        try:
            self.joint(name)
        except KeyError:
            return False
        return True

    def actuators(self) -> np.ndarray:
        """Return the numbers of its actuators in their order, shape (k,)."""
        return self._own(self.model.nu, self.model.actuator)

    def joints(self) -> np.ndarray:
        """Return the numbers of its joints in their order, shape (k,)."""
        return self._own(self.model.njnt, self.model.joint)

    def positions(self) -> np.ndarray:
        """Return the places of its joints in the positions, hinges and slides, shape (k,)."""
        return self.model.jnt_qposadr[self.joints()]

    def dofs(self) -> np.ndarray:
        """Return the degrees of freedom of its joints, hinges and slides, shape (k,)."""
        return self.model.jnt_dofadr[self.joints()]

    def tendons(self) -> np.ndarray:
        """Return the numbers of its tendons in their order, shape (k,)."""
        return self._own(self.model.ntendon, self.model.tendon)

    def _own(self, count: int, view: Callable[[int], Any]) -> np.ndarray:
        if not self.prefix:
            return np.arange(count)
        return np.array([k for k in range(count) if view(k).name.startswith(self.prefix)], dtype=int)


@dataclass
class Pulls:
    """The actuators that pull a robot's tendons: force = gain control + bias + length_gain length.

    Attributes:
        actuators, tendons: their numbers, and those of the tendons that they pull, shape (k,).
        given: whether their controls are tensions.
        gain, bias, length_gain: shape (k,); laws may change them as in the model.
    """

    actuators: np.ndarray
    tendons: np.ndarray
    given: bool
    gain: Array
    bias: Array
    length_gain: Array

    def tension(self, data: mujoco.MjData) -> Array:
        """Return the tendons' tensions now, below zero where a driven tendon is slack, shape (k,) [N]."""
        if self.given:
            return data.ctrl[self.actuators]
        force = (
            self.gain * data.ctrl[self.actuators]
            + self.bias
            + self.length_gain * data.ten_length[self.tendons]
        )
        return -force

    def drive_stiffness(self) -> Array:
        """Return the actuators' stiffness against lengthening, 0 where tensions are given, (k,) [N/m]."""
        return np.zeros(len(self.actuators)) if self.given else -self.length_gain


@dataclass
class Step:
    """What laws see of a step, and what they tell each other.

    Attributes:
        data: the state.
        pulls: the actuators of the robot's tendons.
        force_tip: on the tip, world frame, shape (3,) [N].
        force_on_element: other forces on each element, world frame, shape (n, 3) [N].
        span_tension: returns the tension of every tendon between its holes, as the last step left it, NaN
            beyond its end, shape (t, n) [N].
        joints_changed: a law has changed the stiffness of joints; the friction of tendons then learns it.
        pulls_changed: a law has changed `pulls`; the same.
        moving: whether the masses have inertia that counts.
    """

    data: mujoco.MjData
    pulls: Pulls
    force_tip: Array
    force_on_element: Array
    span_tension: Callable[[], Array]
    joints_changed: bool = False
    pulls_changed: bool = False
    moving: bool = False


class Law:
    """One law, which does nothing; others override what they do (see the module's text)."""

    def reset(self) -> None:
        """Forget the history; what the law has changed in the model is as at first."""

    def before(self, step: Step) -> None:
        """Act before a step."""

    def place(self, data: mujoco.MjData) -> None:
        """Move joints of the model to where `data.qpos` has them; also before a posture is read."""

    def actuate(self, step: Step) -> None:
        """Make actuators what they are at the present positions and controls."""

    def between(self, step: Step) -> None:
        """Add forces to `step.data.qfrc_applied` [N m, N]."""


class Turns(Protocol):
    """The angles by which tendons turn at their holes."""

    def __call__(self, data: mujoco.MjData, ends: np.ndarray | None = None) -> Array:
        """Return the turn at the hole before each span, shape (t, n) [rad], in a reused array.

        Args:
            data: the state.
            ends: of each tendon the spans that matter, 0 where none does; default: all, shape (t,).
        """

    def of_copies(self, copies: np.ndarray, qpos: Array, site_xpos: Array, turn: Array) -> None:
        """Write the turns of some of m copies of the model.

        Args:
            copies: which of the m.
            qpos: their positions, shape (m, nq).
            site_xpos: their sites, shape (m, s, 3) [m].
            turn: out, zero at first, shape (m, t, n) [rad].
        """


@dataclass(frozen=True)
class TendonPaths:
    """What friction needs to know of the tendons that rub, in the order of the actuators that pull them.

    Attributes:
        names: of the model's tendons, with the robot's prefix.
        spans: n, the most spans between holes that a tendon could have.
        ends: number of spans of each, shape (t,).
        span_of_dof: the span (from 0) whose length each hinge's degree of freedom changes.
        turns: at the holes before the spans.
    """

    names: list[str]
    spans: int
    ends: np.ndarray
    span_of_dof: dict[int, int]
    turns: Turns


class FrictionLaw(Protocol):
    """Pulls a model's tendons as friction lets them: a law that also knows the tensions in their spans."""

    def reset(self) -> None:
        """Forget the history."""

    def before(self, step: Step) -> None: ...
    def place(self, data: mujoco.MjData) -> None: ...
    def actuate(self, step: Step) -> None: ...
    def between(self, step: Step) -> None: ...

    def span_tension(self, data: mujoco.MjData, actuator_tension: Array) -> Array:
        """Return the tension of every tendon in every span after a step, shape (t, n) [N].

        Args:
            data: the state.
            actuator_tension: tensions now, shape (t,) [N].
        """


class Controls(Protocol):
    """From a robot's inputs to its controls, and back to tensions. Arrays may have axes before the last.

    Attributes:
        actuators: numbers of those whose controls the inputs set, shape (c,).
        pulls: numbers of those that pull tendons, shape (k,).
        spans: number of spans between holes of each input's tendon, 0 of what is no single tendon, (t,).
    """

    actuators: np.ndarray
    pulls: np.ndarray
    spans: np.ndarray

    def arriving(self, before: Array, inputs: Array) -> Array:
        """Return what arrives at the tendons, (..., t), of `inputs`, (..., t), where `before` did last.

        Raises:
            InputError: an input that the robot cannot follow.
        """

    def controls(self, arriving: Array) -> Array:
        """Return the controls of `actuators`, shape (..., c), for what arrives, shape (..., t)."""

    def tension(self, qpos: Array, ctrl: Array, pulled: Array) -> Array:
        """Return the tension of each input at the actuator, shape (..., t) [N].

        Args:
            qpos, ctrl: all positions and controls, shapes (..., nq) and (..., nu).
            pulled: tensions of the tendons of `pulls`, shape (..., k) [N].
        """


class StraightControls:
    """Each input is the control of one tendon's own actuator: `Controls` of most robots."""

    def __init__(self, place: RobotInModel, spans: np.ndarray) -> None:
        """Take the robot's first actuators, which pull its tendons in order; `spans` as of `Controls`."""
        self.actuators = self.pulls = place.actuators()[: len(spans)]
        self.spans = spans

    def arriving(self, before: Array, inputs: Array) -> Array:
        return inputs

    def controls(self, arriving: Array) -> Array:
        return arriving

    def tension(self, qpos: Array, ctrl: Array, pulled: Array) -> Array:
        return pulled


class Laws(Protocol[R_in]):
    """`laws.py`: which forces run beside a step?

    `controls` is asked first, then `laws`, then `tendon_paths`; each may read what the ones before have
    changed in the model. A kind that has a reference law of friction offers one function more:
    `reference_friction(robot, place) -> FrictionLaw`.
    """

    def controls(self, robot: R_in, place: RobotInModel) -> Controls:
        """Return what stands between the robot's inputs and its actuators."""

    def laws(self, robot: R_in, place: RobotInModel) -> tuple[Law, ...]:
        """Return the robot's laws, friction apart, in the order of their turns."""

    def tendon_paths(self, robot: R_in, place: RobotInModel) -> TendonPaths:
        """Return where tendons rub."""

    def sliding_joints(self, robot: R_in) -> list[str]:
        """Return the joints, besides those of `Outputs.joints`, that stand still where the robot rests."""


# ----------------------------------------------------------------------------------------------------
# The laws of many copies of one robot, stepped together by `mujoco.batch`: as `core.law`, for copies.
#
# Index i picks among the m copies; `copies` names those that a call is for, rising, shape (k,).


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
