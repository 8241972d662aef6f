"""A foreign model with what was found, as MJCF: what the file can carry, and what it cannot."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.foreign import causes
from catheter_sim.foreign.causes import Number
from catheter_sim.foreign.model import ForeignModel
from catheter_sim.foreign.twin import masses_of

_LABEL = "found"  # of the body that carries a payload
_CARRIED = (causes.DAMPING, causes.FRICTION, causes.STIFFNESS, causes.PAYLOAD)


def extended_spec(
    model: ForeignModel, values: Mapping[Number, float]
) -> tuple[mujoco.MjSpec, tuple[str, ...]]:
    """Return the file's model with numbers in it, and the names of those that it cannot carry.

    Damping, friction, stiffness and masses are the file's own; gains and offsets go into actuators whose
    force is linear in the control. Delays, play, the tracker's frame and muscles' controls stay outside.
    """
    spec = model.spec.copy()
    spec.compile()  # its elements then have the numbers of the model's
    folder = model.path.resolve().parent  # where the file's meshes and pictures are, seen from anywhere
    spec.meshdir, spec.texturedir = (str(folder / own) for own in (spec.meshdir, spec.texturedir))
    if model.gravity_mps2 is not None:
        spec.option.gravity = model.gravity_mps2
    for body, mass_kg, place_m in masses_of(values):
        _hang(model, spec, body, mass_kg, place_m)
    left = [number.name for number, value in values.items() if not _carried(model, spec, number, value)]
    return spec, tuple(left)


def _carried(model: ForeignModel, spec: mujoco.MjSpec, number: Number, value: float) -> bool:
    """Put one number into a model, masses apart; return whether it is there."""
    if number.cause == causes.DAMPING:
        joint = _numbered(spec.joints, number.of[0])
        joint.damping = _first_plus(joint.damping, value)
    elif number.cause == causes.FRICTION:
        _numbered(spec.joints, number.of[0]).frictionloss += value
    elif number.cause == causes.STIFFNESS and number.of:
        for actuator in (_numbered(spec.actuators, k) for k in number.of):
            gain, bias = np.array(actuator.gainprm), np.array(actuator.biasprm)
            gain[0] *= value
            bias[:2] *= value
            actuator.gainprm, actuator.biasprm = gain, bias
    elif number.cause == causes.STIFFNESS:
        for item in (*spec.joints, *spec.tendons):
            item.stiffness = np.asarray(item.stiffness) * value
    elif number.cause in (causes.GAIN, causes.OFFSET):
        return _commanded(model, spec, number, value)
    return number.cause in _CARRIED


def _numbered(elements: Iterable[Any], number: int) -> Any:
    """Return the element that has a number in the compiled model."""
    return next(item for item in elements if item.id == number)


def _first_plus(damping: object, value: float) -> object:
    """Return a joint's damping with more of its linear part: a number, or a polynomial's coefficients."""
    if np.ndim(damping) == 0:  # type: ignore[arg-type]
        return float(damping) + value  # type: ignore[arg-type]
    found = np.array(damping, dtype=float)
    found[0] += value
    return found


def _hang(model: ForeignModel, spec: mujoco.MjSpec, body: int, mass_kg: float, place_m: Array) -> None:
    """Weld a point-like mass [kg] to a body, a place from its centre of mass, shape (3,) [m]."""
    at = np.array(model.compiled.body_ipos[body]) + place_m
    hung = _numbered(spec.bodies, body).add_body(name=f"{_LABEL}_{body}", pos=at)
    hung.mass, hung.inertia, hung.explicitinertial = mass_kg, [1e-12, 1e-12, 1e-12], True
    hung.ipos = [0.0, 0.0, 0.0]  # without it MuJoCo puts the centre of mass where the body is in its parent


def _commanded(model: ForeignModel, spec: mujoco.MjSpec, number: Number, value: float) -> bool:
    """Put a gain or an offset of a control into its actuator; False where it is no linear one."""
    k = number.of[0]
    actuator = _numbered(spec.actuators, k)
    fixed = int(model.compiled.actuator_gaintype[k]) == int(mujoco.mjtGain.mjGAIN_FIXED)
    if not fixed or int(model.compiled.actuator_dyntype[k]) != int(mujoco.mjtDyn.mjDYN_NONE):
        return False
    gain, bias = np.array(actuator.gainprm), np.array(actuator.biasprm)
    if number.cause == causes.GAIN:
        gain[0] *= value
    else:
        bias[0] += float(model.compiled.actuator_gainprm[k, 0]) * value
        actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    actuator.gainprm, actuator.biasprm = gain, bias
    return True
