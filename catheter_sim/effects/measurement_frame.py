"""The tracker's frame is rotated or shifted against the robot's base."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array, Posture

_ROTATION = ("rotation_x_deg", "rotation_y_deg", "rotation_z_deg")
_TRANSLATION = ("translation_x_mm", "translation_y_mm", "translation_z_mm")
_PARAMETERS = (
    *(Parameter(name, 0.0, -50.0, 50.0, scale=1.0, start=0.0) for name in _TRANSLATION),
    *(Parameter(name, 0.0, -180.0, 180.0, scale=1.0, start=0.0) for name in _ROTATION),
)


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    return _PARAMETERS


def _change_frames(values: Values, p_w: Array, R_w: Array) -> tuple[Array, Array]:
    turn = Rotation.from_rotvec([values[name] for name in _ROTATION], degrees=True).as_matrix()
    shift = np.array([values[name] for name in _TRANSLATION]) * 1e-3
    return p_w @ turn.T + shift, turn @ R_w


def _change_postures(robot: Robot, postures: tuple[Posture, ...], values: Values) -> tuple[Posture, ...]:
    changed = []
    for posture in postures:
        p_w, R_w = _change_frames(values, posture.p_w, posture.R_w)
        changed.append(replace(posture, p_w=p_w, R_w=R_w))
    return tuple(changed)


EFFECT = Effect(
    name="measurement_frame",
    summary="measured positions are the true ones turned about the base by a rotation vector, then shifted",
    trace="an error that depends on where the tip is, not on how it came there",
    parameters=_parameters,
    change_postures=_change_postures,
    change_frames=_change_frames,
)
