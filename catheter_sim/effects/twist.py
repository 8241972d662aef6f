"""Holes, or whole elements, turn about the backbone along the robot: out-of-plane motion that grows.

Tendons whose holes turn bend a robot of round section in planes that turn with them. One that bends in a
plane alone does so element by element, and each element may be turned between its faces. Its bends, which
are about its own axes, then stay what they are, and the shape leaves the plane.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.effects.shared import added_everywhere, places, sizes

_RATE, _CELLS = "rate_deg_per_m", "cells_rate_deg_per_m"


def _at(robot: RobotSpec, role: Role, name: str) -> tuple[Parameter, ...]:
    if not places(robot, role):
        return ()
    bound = 90.0 / sizes(robot).length_m
    return (Parameter(name, null=0.0, lower=-bound, upper=bound, scale=0.02 * bound, start=0.0),)


def _twisted(robot: R, values: Values) -> R:
    return added_everywhere(robot, Role.HOLE_TWIST, values[_RATE]) if _RATE in values else robot


def _turned(robot: RobotSpec, p_w: Array, R_w: Array, values: Values) -> tuple[Array, Array]:
    if not values.get(_CELLS, 0.0):
        return p_w, R_w
    each_deg = values[_CELLS] * sizes(robot).length_m / p_w.shape[-2]
    return stacked_anew(p_w, R_w, np.radians(each_deg))


def stacked_anew(p_w: Array, R_w: Array, turn_rad: float) -> tuple[Array, Array]:
    """Return where elements are when each is turned between its faces, half below its bend and half above.

    Args:
        p_w: centres of all elements' distal faces, base to tip, shape (..., n, 3) [m].
        R_w: their orientations, shape (..., n, 3, 3).
        turn_rad: of each, about its axis.
    """
    half = Rotation.from_rotvec([0.0, 0.0, 0.5 * turn_rad]).as_matrix()
    placed, turned = np.empty_like(p_w), np.empty_like(R_w)
    foot, frame = np.zeros_like(p_w[..., 0, :]), np.broadcast_to(np.eye(3), R_w[..., 0, :, :].shape)
    was_foot, was_frame = foot, frame
    for k in range(p_w.shape[-2]):
        back, seat = np.swapaxes(was_frame, -1, -2), frame @ half
        step = back @ (p_w[..., k, :] - was_foot)[..., np.newaxis]
        foot = foot + (seat @ step)[..., 0]
        frame = seat @ back @ R_w[..., k, :, :] @ half
        was_foot, was_frame = p_w[..., k, :], R_w[..., k, :, :]
        placed[..., k, :], turned[..., k, :, :] = foot, frame
    return placed, turned


EFFECT = Effect(
    name="twist",
    summary="the tendons' holes turn about the backbone at a constant rate along the robot; of a robot that "
    "bends in a plane, its elements do",
    trace="a bending plane that turns from segment to segment",
    bench="Look along the straight robot from its tip. Do the holes of all disks lie on straight "
    "lines? Check how the disks are fixed to the backbone.",
    forms=(
        Form(
            name="holes",
            equation="a tendon's holes lie at its angle + rate times the height along the backbone",
            stage=Stage.SPECIFICATION,
            parameters=lambda robot: _at(robot, Role.HOLE_TWIST, _RATE),
            specify=_twisted,
        ),
        Form(
            name="cells",
            equation="each of n elements is turned about its axis by rate * length / n, half below its bend "
            "and half above; bends are about its own axes, as they were",
            stage=Stage.SHAPE,
            parameters=lambda robot: _at(robot, Role.ELEMENT_TURN, _CELLS),
            shape=_turned,
            local=True,
        ),
    ),
    same_as=frozenset({Role.HOLE_TWIST}),
)
