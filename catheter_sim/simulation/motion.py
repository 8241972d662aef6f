"""The numbers by which a model moves as its robot does, or comes to rest soon: put into a live model.

Both are written by `modelling.build`; what laws change between steps (places of joints, their springs) is not
among them, so that a robot may be let go in the midst of a run, from any posture and with any history.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

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
