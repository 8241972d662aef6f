"""The tracker's frame is turned or shifted against the base, or its lengths or its point are not ours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Effect, Form, Parameter, Stage, Values
from catheter_sim.core.posture import Observed
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.shared import sizes

_ROTATION = ("rotation_x_deg", "rotation_y_deg", "rotation_z_deg")
_TRANSLATION = ("translation_x_mm", "translation_y_mm", "translation_z_mm")
_RIGID = (*_TRANSLATION, *_ROTATION)
_SCALE = "scale"
_LEVER = ("ahead_mm", "aside_x_mm", "aside_y_mm")
_LEVER_SHARE = 0.2  # of the robot's length, how far at most
_SHEAR = {(one, other): f"shear_{one}{other}" for one, other in ("xz", "zx", "xy", "yx", "yz", "zy")}
_SCALED = (Parameter(_SCALE, null=1.0, lower=0.5, upper=2.0, scale=0.01, start=1.0),)
_SHEARED = tuple(Parameter(name, 0.0, -0.5, 0.5, scale=0.01, start=0.0) for name in _SHEAR.values())
_PARAMETERS = (
    *(Parameter(name, 0.0, -50.0, 50.0, scale=1.0, start=0.0) for name in _TRANSLATION),
    *(Parameter(name, 0.0, -180.0, 180.0, scale=1.0, start=0.0) for name in _ROTATION),
)


def _lever(robot: RobotSpec) -> tuple[Parameter, ...]:
    most = round(_LEVER_SHARE * 1e3 * sizes(robot).length_m, 3)
    return tuple(Parameter(name, 0.0, -most, most, scale=1.0, start=0.0) for name in _LEVER)


def _carried(robot: RobotSpec, p_w: Array, R_w: Array, values: Values) -> tuple[Array, Array]:
    """Return the positions with the last one where a sensor is that turns with the last element."""
    ahead, aside_x, aside_y = (values.get(name, 0.0) * 1e-3 for name in _LEVER)
    moved = p_w.copy()
    moved[..., -1, :] += R_w[..., -1, :, :] @ np.array([aside_x, aside_y, ahead])
    return moved, R_w


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
    summary="measured positions are the true ones turned about the base by a rotation vector, shifted, times "
    "`scale`, sheared; the tip's sensor may lie `ahead` of it or aside",
    trace="an error that depends on where the tip is, not on how it came there",
    bench="Touch three known points of the base with the tracker and compare them with the drawing. "
    "Is its frame turned or shifted?",
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
            groups=lambda robot: ((_SCALE,), (*_RIGID, _SCALE)),
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
        Form(
            name="lever",
            equation="p_tip' = p_tip + R_tip (aside_x, aside_y, ahead): the sensor lies beside the tip and "
            "turns with it",
            stage=Stage.SHAPE,
            parameters=_lever,
            groups=lambda robot: (_LEVER[:1], (*_RIGID, *_LEVER[:1]), (*_RIGID, *_LEVER)),
            shape=_carried,
            further=True,
        ),
    ),
    advice={
        frozenset({"precurvature", "actuation_offset", "twist"}): "Track two points on the base and one in "
        "the middle of the robot. They separate the frame from the shape at rest.",
    },
)
