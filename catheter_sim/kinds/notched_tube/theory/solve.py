"""The kinetostatic model along rows of inputs, for many robots at once, as the fits of a diagnosis ask."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.kinds.notched_tube.spec import NotchedTubeRobot
from catheter_sim.kinds.notched_tube.theory.chain import Chains, chains
from catheter_sim.kinds.notched_tube.theory.kernels import columns
from catheter_sim.kinds.notched_tube.theory.kernels.geometry import faces
from catheter_sim.kinds.notched_tube.theory.kernels.march import march

# A step's change of inputs would bend the unbent tube by at most this much. Without a load, inputs that move
# one way between rows make the same history in one step (to 1e-9 rad).
STEP_BEND_RAD = 0.2
_MOST_STEPS = 500  # between two rows


@dataclass(frozen=True)
class TubeStates:
    """Equilibria of B robots that differ in numbers only, along r rows; NaN from where none was found.

    Attributes:
        chains: the robots.
        w: rotation vector of each notch, from its lower edge to its upper one, shape (B, r, n, 3) [rad].
        stretch: of the notches' centroid lines, share of their height, shape (B, r, n).
        tension: at the actuator, shape (B, r) [N].
        notch_tension: in each notch, shape (B, r, n) [N].
        shift: of the whole tube along z, by its mount, shape (B, r) [m].
        residual: largest moment that no balance accounts for, shape (B, r) [N m].
    """

    chains: Chains
    w: Array
    stretch: Array
    tension: Array
    notch_tension: Array
    shift: Array
    residual: Array

    def every(self, step: int) -> TubeStates:
        """Return the states at each `step`-th row."""
        shown = slice(None, None, step)
        w, stretch, residual = self.w[:, shown], self.stretch[:, shown], self.residual[:, shown]
        tensions = self.tension[:, shown], self.notch_tension[:, shown]
        return TubeStates(self.chains, w, stretch, *tensions, self.shift[:, shown], residual)

    def faces(self) -> tuple[Array, Array]:
        """Return the elements' distal faces in the base frame, (B, r, n, 3) [m] and (B, r, n, 3, 3)."""
        p_w, R_w = np.empty(self.w.shape), np.empty((*self.w.shape, 3))
        faces(self.chains.notch, self.w, self.stretch, p_w, R_w)
        p_w[..., 2] += self.shift[..., None]
        return p_w, R_w

    def joint_angles(self) -> Array:
        """Return the notches' angles, shape (B, r, j) [rad], in the order of `layout.joint_names`.

        Toward +x; of a tube that bends any way then toward +y, and about the tube.
        """
        x, y, twist = self.w[..., 1], -self.w[..., 0], self.w[..., 2]
        return np.concatenate([x, y, twist], axis=2) if self.chains.spatial else x


@dataclass(frozen=True)
class FaceLoads:
    """Forces and moments on elements' distal faces besides those on the tip, in the base frame, row by row.

    Attributes:
        element: counted from 1 at the base, shape (p,).
        force, moment: of B robots, shape (B, r, p, 3) [N, N m].
    """

    element: NDArray[np.intp]
    force: Array
    moment: Array


def solve_rows(
    robots: Sequence[NotchedTubeRobot],
    inputs: Sequence[Inputs],
    gravity_mps2: Array,
    loads: FaceLoads | None = None,
    step_bend_rad: float = STEP_BEND_RAD,
) -> TubeStates:
    """Return the equilibria of `robots` along their inputs, each from rest under its weight.

    Args:
        robots: alike but for their numbers.
        inputs: tensions or displacements, of the same rows and kind, one per robot.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        loads: further loads.
        step_bend_rad: see `STEP_BEND_RAD`.
    """
    gravity = np.asarray(gravity_mps2, dtype=float)
    planar = all(robot.bending_axes == "x" for robot in robots) or (
        all(_rests_in_plane(robot) for robot in robots) and _acts_in_plane(inputs, gravity, loads)
    )
    axes = 1 if planar else 3
    made = chains(robots, axes)
    if inputs[0].actuation == "displacement":
        made.drive[:, columns.DISPLACEMENT] = 0.0
    count, rows = made.mass.shape[1], len(inputs[0])
    element, force, moment = _face_loads(inputs, loads, count)
    drives = np.array([np.concatenate([[0.0], item.tendon[:, 0]]) for item in inputs])
    weight = made.mass[:, :, None] * gravity
    pressed = weight[:, :, 2].sum(axis=1)[:, None] + force[:, :, :, 2].sum(axis=2)  # besides the tendon
    if inputs[0].actuation == "displacement":  # a mount that gives way takes its part of the tendon's path
        drives = drives + pressed / made.mount_stiffness[:, None]
    shape = (len(robots), rows)
    w, stretch = np.empty((*shape, count, 3)), np.empty((*shape, count))
    tension, residual = np.empty((*shape, count + 1)), np.empty(shape)
    march(
        *(made.notch, made.fibre, made.metal, axes, made.mu, made.drive, drives, weight),
        *(element, force, moment),
        _steps(made, drives, force, moment, step_bend_rad),
        *(w, stretch, tension, residual),
    )
    shift = (pressed[:, 1:] - tension[:, :, 0]) / made.mount_stiffness[:, None]
    return TubeStates(made, w, stretch, tension[:, :, 0], tension[:, :, 1:], shift, residual)


def _rests_in_plane(robot: NotchedTubeRobot) -> bool:
    return all(item.rest_curvature_y_per_m == 0 == item.rest_twist_rad_per_m for item in robot.segments)


def _acts_in_plane(inputs: Sequence[Inputs], gravity: Array, loads: FaceLoads | None) -> bool:
    forces = [item.force_tip[:, 1] for item in inputs] + [gravity[1:2]]
    moments = [item.moment_tip[:, [0, 2]] for item in inputs]
    if loads is not None:
        forces.append(loads.force[..., 1])
        moments.append(loads.moment[..., [0, 2]])
    return not any(np.any(part) for part in (*forces, *moments))


def _face_loads(
    inputs: Sequence[Inputs], loads: FaceLoads | None, count: int
) -> tuple[NDArray[np.intp], Array, Array]:
    """Return loaded elements from 0, and what acts on them, nothing first, (B, r + 1, p, 3)."""
    element = [count - 1]
    force = np.array([item.force_tip for item in inputs])[:, :, None]
    moment = np.array([item.moment_tip for item in inputs])[:, :, None]
    if loads is not None:
        element += [int(k) - 1 for k in loads.element]
        force = np.concatenate([force, loads.force], axis=2)
        moment = np.concatenate([moment, loads.moment], axis=2)
    nothing = np.zeros((force.shape[0], 1, *force.shape[2:]))
    return (
        np.array(element),
        np.concatenate([nothing, force], axis=1),
        np.concatenate([nothing, moment], axis=1),
    )


def _steps(
    made: Chains, drives: Array, force: Array, moment: Array, step_bend_rad: float
) -> NDArray[np.int64]:
    """Return how many steps each row takes, the weight's first, shape (r + 1,); the same for all robots."""
    notch = made.notch
    arm = float((notch[:, :, columns.TENDON] + notch[:, :, columns.CENTROID]).max())
    by_length = not math.isnan(made.drive[0, columns.DISPLACEMENT])
    softness = (1.0 / made.drive[:, columns.SCALE]).max() / arm**2  # [rad/(N m)]
    per_drive = 1.0 / arm if by_length else arm * softness
    bend = (
        per_drive * np.abs(np.diff(drives, axis=1))
        + notch[:, :, columns.PITCH].sum(axis=1).max()
        * softness
        * np.linalg.norm(np.diff(force, axis=1), axis=3).sum(axis=2)
        + softness * np.linalg.norm(np.diff(moment, axis=1), axis=3).sum(axis=2)
    ).max(axis=0)
    wanted = np.nan_to_num(bend / step_bend_rad, nan=1.0)  # what is no number has no balance in one step
    counted = np.clip(np.ceil(wanted), 1, _MOST_STEPS).astype(np.int64)
    return np.concatenate([[1], counted])
