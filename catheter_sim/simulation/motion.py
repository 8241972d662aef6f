"""How a live model moves as its robot does: its numbers, servos that lag, states that diverge."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.law import RobotInModel

# ----------------------------------------------------------------------------------------------------
# The numbers by which a model moves as its robot does, or comes to rest soon: put into a live model.
#
# Both are written by `modelling.build`; what laws change between steps (places of joints, their springs) is
# not among them, so that a robot may be let go in the midst of a run, from any posture and with any
# history.

_FIELDS = (
    "dof_damping",
    "dof_armature",
    "dof_invweight0",
    "dof_M0",
    "body_mass",
    "body_subtreemass",
    "body_inertia",
    "body_invweight0",
    "tendon_damping",
    "tendon_invweight0",
    "jnt_solref",
    "jnt_solimp",
)


@dataclass(frozen=True)
class MotionNumbers:
    """What of a model decides how it moves between two equilibria.

    Attributes:
        fields: arrays of the model by their names.
        gravity: shape (3,) [m/s^2].
        timestep: [s].
        integrator: MuJoCo's number of it.
        meaninertia: by which the solver of constraints scales.
    """

    fields: dict[str, np.ndarray]
    gravity: np.ndarray
    timestep: float
    integrator: int
    meaninertia: float


def motion_numbers(model: mujoco.MjModel) -> MotionNumbers:
    """Return a copy of the numbers of `model`."""
    return MotionNumbers(
        {name: getattr(model, name).copy() for name in _FIELDS},
        model.opt.gravity.copy(),
        float(model.opt.timestep),
        int(model.opt.integrator),
        float(model.stat.meaninertia),
    )


def put_numbers(numbers: MotionNumbers, model: mujoco.MjModel) -> None:
    """Let `model` have `numbers`, in place; they are those of a model of the same robot."""
    for name, values in numbers.fields.items():
        getattr(model, name)[:] = values
    model.opt.gravity[:] = numbers.gravity
    model.opt.timestep, model.opt.integrator = numbers.timestep, numbers.integrator
    model.stat.meaninertia = numbers.meaninertia


# ----------------------------------------------------------------------------------------------------
# A servo that follows its command by a first-order lag, step by step.


class ServoLag:
    """What a servo does with commands that are set once a step."""

    def __init__(self, lag_s: float, step_s: float, start: Array | None = None) -> None:
        """Prepare; `start`: where the servo is, shape (t,); without a lag commands arrive at once."""
        self._left = math.exp(-step_s / lag_s) if lag_s > 0.0 else 0.0
        self._now = None if start is None else np.array(start, dtype=float)

    def arriving(self, command: Array) -> Array:
        """Return what arrives in the coming step of a command, shape (t,)."""
        if self._left == 0.0 or self._now is None:
            return command
        self._now = command + (self._now - command) * self._left
        return self._now


# ----------------------------------------------------------------------------------------------------
# When the state of a simulated robot is not to be trusted any more.

FARTHEST_RAD = 20.0  # a hinge beyond has wound up
FARTHEST_M = 10.0  # a slide beyond has flown off
LARGEST_INPUT = 1e10  # beyond it MuJoCo puts zeros in the place of all inputs, with no more than a warning
# What MuJoCo has to say of a step whose result is not to be trusted; it goes on all the same. Causes stand
# before what they lead to.
_COMPLAINTS = {
    mujoco.mjtWarning.mjWARN_BADCTRL: f"an input is not finite, or beyond {LARGEST_INPUT:g}; all ignored",
    mujoco.mjtWarning.mjWARN_INERTIA: "an inertia is singular",
    mujoco.mjtWarning.mjWARN_CONTACTFULL: "there are more contacts than it has room for",
    mujoco.mjtWarning.mjWARN_CNSTRFULL: "there are more constraints than it has room for",
    mujoco.mjtWarning.mjWARN_BADQPOS: "a position is not finite, or huge",
    mujoco.mjtWarning.mjWARN_BADQVEL: "a speed is not finite, or huge",
    mujoco.mjtWarning.mjWARN_BADQACC: "an acceleration is not finite, or huge",
}


def farthest(place: RobotInModel) -> Array:
    """Return how far each position may be from zero in a robot that has not come apart, shape (nq,) [rad, m].

    Positions of other joints than the robot's own hinges and slides may be anywhere.
    """
    model, own = place.model, place.joints()
    limit = np.full(model.nq, np.inf)
    for kind, most in (
        (mujoco.mjtJoint.mjJNT_HINGE, FARTHEST_RAD),
        (mujoco.mjtJoint.mjJNT_SLIDE, FARTHEST_M),
    ):
        limit[model.jnt_qposadr[own[model.jnt_type[own] == int(kind)]]] = most
    return limit


class Watch:
    """Looks whether a robot's state is to be trusted."""

    def __init__(self, place: RobotInModel, data: mujoco.MjData) -> None:
        self._data, self._farthest = data, farthest(place)
        self._warned = data.warning.number  # a view: MuJoCo counts on

    def complaint(self) -> str | None:
        """Return None where the state is to be trusted, else why not, "" where MuJoCo has not said.

        So it is not where a position is not finite, a hinge has wound up or a slide has flown off, and
        where MuJoCo has warned in any step since its data was reset. It warns and goes on, having put zeros
        in the place of an input that it finds too large, say.
        """
        reason = next((text for kind, text in _COMPLAINTS.items() if self._warned[int(kind)]), "")
        if reason:  # a scene with too many geoms to draw is warned of, too, and is no matter here
            return f" (MuJoCo: {reason})"
        if (np.abs(self._data.qpos) <= self._farthest).all():  # false of what is not a number
            return None
        return ""
