"""Piecewise constant curvature for a rolling-joint robot, the comparison of chest_tube_2025, Fig. 11.

One bend angle for each segment and bending plane: its joints of that plane all bend alike, and the
segment is drawn as one arc. The angle balances the sum of its joints' moments by virtual work, with
each rod's tension the same everywhere: no friction, no weight, no tip load. The paper states neither
how its PCC model finds the angle nor its parameters; this is the closest to the printed statics.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.posture import Posture
from catheter_sim.core.statics import StaticRun, require_tensions
from catheter_sim.errors import InputError
from catheter_sim.robots.rolling import complete
from catheter_sim.robots.rolling.complete import NotBalanced, balanced
from catheter_sim.robots.rolling.description import RollingChain, rolling_chain
from catheter_sim.robots.rolling.spec import RollingRobot

MODEL = "pcc"
_STEPS = 8  # from rest to each row


def pcc(robot: RollingRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures under piecewise constant curvature; every row stands alone.

    Args:
        robot: a robot of rolling joints.
        inputs: tensions of its rods; no tip force or moment.
        gravity_mps2: none, shape (3,) [m/s^2].

    Raises:
        InputError: displacement inputs, a load that the model does not have, or no balance.
    """
    require_tensions(inputs, MODEL)
    gravity = np.asarray(gravity_mps2, dtype=float)
    if gravity.any():
        raise InputError(f"static model {MODEL!r}: has no weight, so gravity must be 0; take 'complete'")
    loaded = inputs.force_tip.any(axis=1) | inputs.moment_tip.any(axis=1)
    if loaded.any():
        row = row_name(inputs, int(np.argmax(loaded)))
        raise InputError(f"{row}: static model {MODEL!r}: has no tip force or moment; take 'complete'")
    chain = rolling_chain(robot)
    member = groups(chain)
    try:
        share, residual = _bend(chain, member, inputs.tendon)
    except NotBalanced as error:
        raise InputError(f"{row_name(inputs, error.index)}: static model {MODEL!r}: {error}") from None
    found = tuple(_posture(chain, member, share[row], inputs.tendon[row]) for row in range(len(inputs)))
    return StaticRun(MODEL, inputs, gravity, found, residual)


def groups(chain: RollingChain) -> Array:
    """Return which joints bend alike: one row for each segment and bending plane, shape (g, n) of 0, 1."""
    segment = np.repeat(np.arange(len(chain.robot.segments)), [item.joints for item in chain.robot.segments])
    keys = list(dict.fromkeys(zip(segment.tolist(), chain.axis.tolist(), strict=True)))
    return np.array([(segment == s) & (chain.axis == a) for s, a in keys], dtype=float)


def _bend(chain: RollingChain, member: Array, drive: Array) -> tuple[Array, Array]:
    """Return the angle of each group's joints, shape (r, g) [rad], and the moment left, (r,) [N m]."""
    t = chain.pulled
    # The joint that closes first limits its group.
    low = np.where(member > 0.0, chain.low, -np.inf).max(axis=1)
    high = np.where(member > 0.0, chain.high, np.inf).min(axis=1)
    count = member.sum(axis=1)
    share = np.tile((member @ chain.rest_angle) / count, (len(drive), 1))
    left = np.zeros(share.shape)
    for part in np.linspace(0.0, 1.0, _STEPS + 1):

        def moments(angle: Array, part: float = part) -> tuple[Array, Array]:
            nonlocal left
            theta = angle @ member
            span = complete.spans(chain, theta)
            elastic, stiffness = complete.elastic_moments(chain, theta, span)
            pulls = np.where(chain.passes[:t], part * drive[:, :, None], 0.0)
            left = (-(pulls * span.slope[:, :t]).sum(axis=1) - elastic) @ member.T
            slope = (-(pulls * span.second[:, :t]).sum(axis=1) - stiffness) @ member.T
            return left, slope[:, :, None] * np.eye(len(member))

        share = balanced(moments, share, low, high)
    return share, np.abs(left).max(axis=1)


def _posture(chain: RollingChain, member: Array, share: Array, drive: Array) -> Posture:
    """Return one row: each segment an arc, its links' tops evenly spaced on it."""
    theta = share @ member
    R, p = np.eye(3), np.zeros(3)
    faces, turns = [], []
    first = 0
    for segment in chain.robot.segments:
        joints = slice(first, first + segment.joints)
        bend = np.array([theta[joints][chain.axis[joints] == axis].sum() for axis in (0, 1)])
        for part in np.arange(1, segment.joints + 1) / segment.joints:
            place, turn = _arc(part * bend, part * segment.length_m)
            faces.append(p + R @ place)
            turns.append(R @ turn)
        p, R = faces[-1], turns[-1]
        first += segment.joints
    pressed = float(-drive.sum()) / chain.robot.mount.axial_stiffness_N_per_m
    inside = np.where(chain.passes[: chain.pulled], drive[:, None], np.nan)
    return Posture(
        p_w=np.array(faces) + np.array([0.0, 0.0, pressed]),
        R_w=np.array(turns),
        joint_angles=theta,
        actuator_tension=drive,
        tendon_tension=inside,
    )


def _arc(bend: Array, length: float) -> tuple[Array, Array]:
    """Return the end of an arc along +z that bends by `bend` toward +x and +y, and its rotation."""
    angle = float(np.hypot(*bend))
    direction = bend / angle if angle > 0.0 else np.array([1.0, 0.0])
    half = 0.5 * angle
    chord = length * np.sinc(half / np.pi)
    place = chord * np.array([*(np.sin(half) * direction), np.cos(half)])
    e = np.array([*direction, 0.0])
    z = np.array([0.0, 0.0, 1.0])
    side = np.cross(z, e)
    e_turned = np.cos(angle) * e - np.sin(angle) * z
    z_turned = np.sin(angle) * e + np.cos(angle) * z
    turn = np.outer(e_turned, e) + np.outer(side, side) + np.outer(z_turned, z)
    return place, turn
