"""The backbone of an MJCF chain: its hinges on a line, and the frame that becomes the robot's."""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError

_OFF_SHARE = 1e-3  # of the chain's length: what is farther from the line of hinges is not on it
_ALIGNED = 1e-3  # sine of the angle below which two axes are one


@dataclass(frozen=True)
class Frame:
    """Where a chain begins and how it lies, in the world at the model's reference pose.

    Attributes:
        origin: of the first hinge [m], shape (3,).
        axes: x, y, z as columns, shape (3, 3); z along the chain.
        base: the body in whose frame the file has the chain: the one that carries the first that moves.
    """

    origin: Array
    axes: Array
    base: int

    def place(self, point: Array) -> Array:
        """Return a world point in the chain's axes, from its first hinge [m]."""
        return np.asarray(self.axes.T @ (point - self.origin))


@dataclass
class Hinge:
    """What bends at one place, by axis "x" (bend toward +x), "y" or "t" (twist).

    Attributes:
        body: the last body that it moves.
        joint: the last joint there.
        z_m: from the first hinge.
        stiffness: by axis [N m/rad].
        cubic: of the torque k3 q^3, by axis [N m/rad^3].
        rest: angle without torque, by axis [rad].
        damping: by axis [N m s/rad].
    """

    body: int
    joint: int
    z_m: float
    stiffness: dict[str, float] = field(default_factory=dict)
    cubic: dict[str, float] = field(default_factory=dict)
    rest: dict[str, float] = field(default_factory=dict)
    damping: dict[str, float] = field(default_factory=dict)


def hinges_of(model: mujoco.MjModel, data: mujoco.MjData, where: str) -> tuple[Frame, list[Hinge]]:
    """Return the chain's frame, and its hinges from base to tip, those at one place together.

    Raises:
        InputError: what moves is not a single row of hinges on a straight line.
    """
    joints = _in_a_row(model, where)
    frame = _frame(model, data, joints, where)
    found: list[Hinge] = []
    length = max(float(frame.place(data.xanchor[joints[-1]])[2]), 1e-9)
    for joint in joints:
        z_m = float(frame.place(data.xanchor[joint])[2])
        axis, sign = _axis(frame.axes.T @ data.xaxis[joint])
        if not found or z_m - found[-1].z_m > _OFF_SHARE * length:
            found.append(Hinge(int(model.jnt_bodyid[joint]), joint, z_m))
        hinge = found[-1]
        hinge.body, hinge.joint = int(model.jnt_bodyid[joint]), joint
        if axis in hinge.stiffness:
            raise InputError(f"{where}: two hinges turn about one axis at one place: {_name(model, joint)}")
        if model.jnt_stiffness[joint] <= 0.0:
            raise InputError(
                f"{where}: joint {_name(model, joint)} has no stiffness: nothing holds it straight"
            )
        address = int(model.jnt_qposadr[joint])
        hinge.stiffness[axis] = float(model.jnt_stiffness[joint])
        hinge.cubic[axis] = _cubic(model, joint)
        hinge.rest[axis] = sign * float(model.qpos_spring[address] - model.qpos0[address])
        hinge.damping[axis] = float(model.dof_damping[model.jnt_dofadr[joint]])
    return frame, found


def _in_a_row(model: mujoco.MjModel, where: str) -> list[int]:
    joints = list(range(model.njnt))
    if not joints:
        raise InputError(f"{where}: nothing moves: it has no joint")
    for joint in joints:
        if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
            raise InputError(
                f"{where}: joint {_name(model, joint)} is no hinge: only chains of hinges can be read"
            )
    moving = list(dict.fromkeys(int(model.jnt_bodyid[joint]) for joint in joints))
    for before, body in zip([0, *moving], moving, strict=False):
        above = int(model.body_parentid[body])
        while above and above not in moving:
            above = int(model.body_parentid[above])
        if above != before:
            name = model.body(body).name or f"number {body}"
            raise InputError(
                f"{where}: body {name} does not hang on the one before: only a single chain is read"
            )
    return joints


def _frame(model: mujoco.MjModel, data: mujoco.MjData, joints: list[int], where: str) -> Frame:
    """Return a frame whose z goes along the anchors, whose x and y bend as the hinges do.

    It is the base body's where that is one. A chain that points elsewhere bends toward x, if in one plane.
    """
    base = int(model.body_parentid[model.jnt_bodyid[joints[0]]])
    anchors, own = data.xanchor[joints], data.xmat[base].reshape(3, 3)
    origin, along = anchors[0], anchors[-1] - anchors[0]
    length = float(np.linalg.norm(along))
    if length == 0.0:
        raise InputError(f"{where}: all its hinges are at one place")
    z = along / length
    off = np.linalg.norm((anchors - origin) - np.outer((anchors - origin) @ z, z), axis=1)
    if off.max() > _OFF_SHARE * length:
        raise InputError(
            f"{where}: its hinges are up to {1e3 * off.max():.3g} mm off a line at the model's reference "
            "pose: only chains that are straight there can be read"
        )
    bending = [axis for axis in data.xaxis[joints] if abs(axis @ z) < 0.5]
    if not bending:
        raise InputError(f"{where}: no hinge turns across the chain: nothing bends")
    upright = z @ own[:, 2] > 1.0 - _ALIGNED**2
    for trial, y in enumerate((own[:, 1], np.array([0.0, 1.0, 0.0]), bending[0])):
        across = y - (y @ z) * z
        if np.linalg.norm(across) < 0.5:
            continue
        across /= np.linalg.norm(across)
        axes = np.stack([np.cross(across, z), across, z], axis=1)
        found = {_axis(axes.T @ axis)[0] for axis in data.xaxis[joints]}
        if "" not in found and ("x" in found or (upright and trial == 0)):
            return Frame(origin, axes, base)
    raise InputError(
        f"{where}: its hinges turn about axes that are neither at right angles nor along the chain"
    )


def _axis(axis: Array) -> tuple[str, float]:
    """Return what a hinge about an axis of the chain's frame bends, and its sign; "": something askew."""
    for name, toward in (("x", (0.0, 1.0, 0.0)), ("y", (-1.0, 0.0, 0.0)), ("t", (0.0, 0.0, 1.0))):
        share = float(np.dot(axis, toward))
        if 1.0 - abs(share) < _ALIGNED**2:
            return name, float(np.sign(share))
    return "", 0.0


def _cubic(model: mujoco.MjModel, joint: int) -> float:
    """Return the torque's cubic term; MuJoCo before 4 has none."""
    terms = getattr(model, "jnt_stiffnesspoly", None)
    return 0.0 if terms is None else float(np.atleast_2d(terms)[joint][-1])


def _name(model: mujoco.MjModel, joint: int) -> str:
    return model.joint(joint).name or f"number {joint}"
