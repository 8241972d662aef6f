"""A foreign model with what was found, as MJCF: what the file can carry, and what it cannot."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import mujoco
import numpy as np

from catheter_sim.foreign import causes
from catheter_sim.foreign.causes import Number
from catheter_sim.foreign.model import ForeignModel

_LABEL = "found"  # of the body that carries a payload


def extended_spec(
    model: ForeignModel, values: Mapping[Number, float]
) -> tuple[mujoco.MjSpec, tuple[str, ...]]:
    """Return the file's model with numbers in it, and the names of those that it cannot carry.

    Damping, friction, stiffness and masses are the file's own; gains and offsets go into actuators whose
    force is linear in the control. Delays, play, the tracker's frame and muscles' controls stay outside.
    """
    spec = model.spec.copy()
    spec.compile()  # its elements then have the numbers of the model's
    if model.gravity_mps2 is not None:
        spec.option.gravity = model.gravity_mps2
    left = []
    for number, value in values.items():
        if not _carried(model, spec, number, value, values):
            left.append(number.name)
    return spec, tuple(left)


def _carried(
    model: ForeignModel, spec: mujoco.MjSpec, number: Number, value: float, values: Mapping[Number, float]
) -> bool:
    """Put one number into a model; return whether it is there."""
    if number.cause == causes.DAMPING:
        joint = _numbered(spec.joints, _joint_of(model, number, "damping_"))
        joint.damping = _first_plus(joint.damping, value)
    elif number.cause == causes.FRICTION:
        joint = _numbered(spec.joints, _joint_of(model, number, "friction_"))
        joint.frictionloss = joint.frictionloss + value
    elif number.name == "scale_springs":
        for item in (*spec.joints, *spec.tendons):
            item.stiffness = np.asarray(item.stiffness) * value
    elif number.cause == causes.STIFFNESS:
        holds = causes.servos(model.compiled)
        for actuator in spec.actuators:
            names = ("scale_servos", f"scale_servo_{model.actuators[actuator.id]}")
            if holds[actuator.id] and number.name in names:
                gain, bias = np.array(actuator.gainprm), np.array(actuator.biasprm)
                gain[0] *= value
                bias[:2] *= value
                actuator.gainprm, actuator.biasprm = gain, bias
    elif number.cause == causes.PAYLOAD:
        if number.name.startswith("mass_"):
            _hang(model, spec, number, value, {item.name: own for item, own in values.items()})
    elif number.cause in (causes.GAIN, causes.OFFSET):
        return _commanded(model, spec, number, value)
    else:
        return False
    return True


def _numbered(elements: Iterable[Any], number: int) -> Any:
    """Return the element that has a number in the compiled model."""
    return next(item for item in elements if item.id == number)


def _joint_of(model: ForeignModel, number: Number, prefix: str) -> int:
    name = number.name.removeprefix(prefix)
    return next(k for k in range(model.compiled.njnt) if name in (model.compiled.joint(k).name, str(k + 1)))


def _first_plus(damping: object, value: float) -> object:
    """Return a joint's damping with more of its linear part: a number, or a polynomial's coefficients."""
    if np.ndim(damping) == 0:  # type: ignore[arg-type]
        return float(damping) + value  # type: ignore[arg-type]
    found = np.array(damping, dtype=float)
    found[0] += value
    return found


def _hang(
    model: ForeignModel, spec: mujoco.MjSpec, number: Number, grams: float, named: Mapping[str, float]
) -> None:
    """Weld a ball with a mass to a body, as small as a point to what moves it."""
    label = number.name.removeprefix("mass_").removesuffix("_g")
    body = next(k for k in range(model.compiled.nbody) if label in (model.compiled.body(k).name, str(k)))
    place = [1e-3 * named.get(f"place_{label}_{axis}_mm", 0.0) for axis in "xyz"]
    at = np.array(model.compiled.body_ipos[body]) + np.array(place)
    hung = _numbered(spec.bodies, body).add_body(name=f"{_LABEL}_{label}", pos=at)
    hung.mass, hung.inertia, hung.explicitinertial = 1e-3 * grams, [1e-12, 1e-12, 1e-12], True
    hung.ipos = [0.0, 0.0, 0.0]  # without it MuJoCo puts the centre of mass where the body is in its parent


def _commanded(model: ForeignModel, spec: mujoco.MjSpec, number: Number, value: float) -> bool:
    """Put a gain or an offset of a control into its actuator; False where it is no linear one."""
    name = number.name.removeprefix("scale_").removeprefix("offset_")
    k = model.actuators.index(name)
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
