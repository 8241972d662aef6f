"""The disks' poses of a rod model as postures and as a run."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.posture import Posture
from catheter_sim.core.static_run import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.kinds.continuum.theory.tdcr.problem import Load, Problem


class Solved(Protocol):
    """What the solvers of all models return, row by row."""

    @property
    def load(self) -> Load:
        """What was balanced."""

    @property
    def p_w(self) -> Array:
        """Of disks 0 to n, shape (r, n + 1, 3) [m]."""

    @property
    def R_w(self) -> Array:
        """Of the same disks, shape (r, n + 1, 3, 3)."""

    @property
    def span_tension(self) -> Array:
        """Of every tendon in every subsegment, shape (r, t, n) [N]."""

    @property
    def reached(self) -> Array:
        """Share of the load that is balanced, 1 where all of it is, shape (r,)."""


def run_of(
    model: str,
    robot: ContinuumRobot,
    rod: Problem,
    inputs: Inputs,
    gravity_mps2: Array,
    found: Solved,
    residual: Array,
) -> StaticRun:
    """Return what a solver found as a run.

    Args:
        model: its name.
        robot, rod: the robot, and the same as arrays.
        inputs, gravity_mps2: as they were given.
        found: of all rows.
        residual: largest unbalanced moment, shape (r,) [N m].

    Raises:
        InputError: a row whose load was not reached.
    """
    lost = found.reached < 1.0
    if lost.any():
        row = int(np.argmax(lost))
        raise InputError(
            f"{robot.name}: {model} finds no equilibrium at {row_name(inputs, row)}: from rest it gets to "
            f"{100.0 * found.reached[row]:.3g} % of the load"
        )
    shapes = postures(robot, rod, found.p_w, found.R_w, found.load.tension_N, found.span_tension)
    return StaticRun(model, inputs, gravity_mps2, shapes, residual)


def postures(
    robot: ContinuumRobot, rod: Problem, p_w: Array, R_w: Array, actuator_tension: Array, span_tension: Array
) -> tuple[Posture, ...]:
    """Return r postures of `robot`.

    Args:
        robot: the robot.
        rod: the same robot as arrays.
        p_w, R_w: of disks 0 to n, shapes (r, n + 1, 3) [m] and (r, n + 1, 3, 3).
        actuator_tension: shape (r, t) [N].
        span_tension: in every subsegment, shape (r, t, n) [N]; NaN is put in beyond a tendon's end.
    """
    angles = hinge_angles(robot, rod, R_w)
    runs = np.arange(len(rod.length_m)) < rod.last_disk[:, None]
    spans = np.where(runs, span_tension, np.nan)
    return tuple(
        Posture(p_w[row, 1:], R_w[row, 1:], angles[row], actuator_tension[row], spans[row])
        for row in range(len(p_w))
    )


def hinge_angles(robot: ContinuumRobot, rod: Problem, R_w: Array) -> Array:
    """Return the hinges' angles in the order of `joint_names`, shape (r, m) [rad].

    The turn from disk to disk, as a rotation vector, is shared equally by the hinges between them.

    Args:
        robot: the robot.
        rod: the same robot as arrays.
        R_w: orientations of disks 0 to n, shape (r, n + 1, 3, 3).
    """
    columns, signs = [], []
    for j in range(len(rod.length_m)):
        segment = robot.segments[rod.segment[j]]
        hinge = [(3 * j + 1, 1.0)]  # bending toward +x turns about +y, toward +y about -x
        if segment.bending_axes == "xy":
            hinge.append((3 * j, -1.0))
        if math.isfinite(segment.torsion_stiffness_N_m2):
            hinge.append((3 * j + 2, 1.0))
        for column, sign in hinge * robot.links_per_subsegment:
            columns.append(column)
            signs.append(sign / robot.links_per_subsegment)
    relative = np.swapaxes(R_w[:, :-1], -1, -2) @ R_w[:, 1:]
    return _rotation_vectors(relative).reshape(len(R_w), -1)[:, columns] * np.array(signs)


def _rotation_vectors(R: Array) -> Array:
    """Return rotations as vectors, shape (..., 3) [rad]; those near half a turn by way of quaternions."""
    twice = np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1
    )
    sine = 0.5 * np.sqrt((twice**2).sum(axis=-1))
    cosine = 0.5 * (R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2] - 1.0)
    straight = sine < 1e-8
    angle = np.arctan2(sine, cosine)
    vectors = twice * (0.5 * np.where(straight, 1.0, angle / np.where(straight, 1.0, sine)))[..., None]
    flipped = angle > 3.0
    if flipped.any():
        vectors[flipped] = Rotation.from_matrix(R[flipped]).as_rotvec()
    return vectors
