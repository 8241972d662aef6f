"""The tracker's frame is rotated or shifted against the robot's base, or its lengths are not ours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.core.effect import Effect, Form, Parameter, Stage, Values
from catheter_sim.core.posture import Observed

_ROTATION = ("rotation_x_deg", "rotation_y_deg", "rotation_z_deg")
_TRANSLATION = ("translation_x_mm", "translation_y_mm", "translation_z_mm")
_SCALE = "scale"
_SHEAR = {(one, other): f"shear_{one}{other}" for one, other in ("xz", "zx", "xy", "yx", "yz", "zy")}
_SCALED = (Parameter(_SCALE, null=1.0, lower=0.5, upper=2.0, scale=0.01, start=1.0),)
_SHEARED = tuple(Parameter(name, 0.0, -0.5, 0.5, scale=0.01, start=0.0) for name in _SHEAR.values())
_PARAMETERS = (
    *(Parameter(name, 0.0, -50.0, 50.0, scale=1.0, start=0.0) for name in _TRANSLATION),
    *(Parameter(name, 0.0, -180.0, 180.0, scale=1.0, start=0.0) for name in _ROTATION),
)


def _seen(observed: Observed, values: Values) -> Observed:
    turned = [values.get(name, 0.0) for name in _ROTATION]
    turn = Rotation.from_rotvec(turned, degrees=True).as_matrix()
    shift = np.array([values.get(name, 0.0) for name in _TRANSLATION]) * 1e-3
    return replace(observed, p_w=observed.p_w @ turn.T + shift, R_w=turn @ observed.R_w)


def _stretched(observed: Observed, values: Values) -> Observed:
    return replace(observed, p_w=values.get(_SCALE, 1.0) * observed.p_w)


def _sheared(observed: Observed, values: Values) -> Observed:
    share = np.eye(3)
    for (one, other), name in _SHEAR.items():
        share["xyz".index(one), "xyz".index(other)] = values.get(name, 0.0)
    return replace(observed, p_w=observed.p_w @ share.T)


EFFECT = Effect(
    name="measurement_frame",
    summary="measured positions are the true ones turned about the base by a rotation vector, then shifted, "
    "then `scale` times as far from the tracker's zero, then sheared",
    trace="an error that depends on where the tip is, not on how it came there",
    bench="Touch three known points of the base with the tracker and compare them with the drawing. "
    "Is its frame turned or shifted?",
    varies=("time",),
    forms=(
        Form(
            name="rigid",
            equation="p' = R p + t, R the turn by a rotation vector; orientations turn by R too",
            stage=Stage.OBSERVATION,
            parameters=lambda robot: _PARAMETERS,
            observe=_seen,
        ),
        Form(
            name="scale",
            equation="p' = scale * p, as of a camera that is nearer than it was calibrated for",
            stage=Stage.OBSERVATION,
            parameters=lambda robot: _SCALED,
            groups=lambda robot: ((_SCALE,), (*(item.name for item in _PARAMETERS), _SCALE)),
            observe=_stretched,
            further=True,
        ),
        Form(
            name="sheared",
            equation="p_i' = p_i + shear_ij * p_j, as of a tracker whose axes are not at right angles",
            stage=Stage.OBSERVATION,
            parameters=lambda robot: _SHEARED,
            observe=_sheared,
            further=True,
        ),
    ),
    advice={
        frozenset({"precurvature", "actuation_offset", "twist"}): "Track two points on the base and one in "
        "the middle of the robot. They separate the frame from the shape at rest.",
    },
)
