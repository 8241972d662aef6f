"""Inner loops of a rolling-joint robot's step, compiled: placing links, rods' moments and turns.

The same as `catheter_sim.kinds.rolling.theory.rods` and `joint` in plain NumPy, which the tests hold it to,
but without derivatives; `catheter_sim.kinds.rolling.forces.rolling` says what the loops are for. Index k
counts joints and links from 0 at the base, j rods, the pulled ones first.

Arrays. `joint`, shape (n, 10), and `rod`, shape (n, m, 6): see `rolling_pack.pack` and the columns' names
below.
"""

from __future__ import annotations

import math

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled_in_place

# Columns of `joint`: as in `RollingChain`.
RADIUS_POSITIVE, RADIUS_NEGATIVE, LINE, LENGTH = range(4)
REST, SLEEVE, CUBIC, QUINTIC, LOW, HIGH = range(4, 10)
# Columns of `rod`: STIFFNESS is 0 where the rod does not pass, CLEARANCE has the sign of its side.
STIFFNESS, REST_CURVATURE, OFFSET, MOUTH, SINK, CLEARANCE = range(6)
SMALL = 0.1  # of t in atan(t): the first term that its series leaves out, t^15 / 15, is below 7e-17


@compiled_in_place
def place(
    qpos: Array,
    qpos_index: Index,
    joint: Array,
    axis: Index,
    length: Array,
    joint_index: Index,
    body_index: Index,
    jnt_pos: Array,
    body_pos: Array,
) -> None:
    """Move hinges and links in the model to where pure rolling has them.

    Args:
        qpos: MuJoCo's positions; `qpos_index` picks the bend angles, shape (n,).
        joint: see `rolling_pack.pack`.
        axis: 0: the joint bends toward +x, 1: toward +y, shape (n,).
        length: of the links as compressed, shape (n,) [m].
        joint_index, body_index: of the hinges and links in MuJoCo, shape (n,).
        jnt_pos, body_pos: out: MuJoCo's, shapes (njnt, 3) and (nbody, 3) [m].
    """
    face = 0.0  # height of the flat below in the frame of the link below
    for k in range(joint.shape[0]):
        theta = qpos[qpos_index[k]]
        radius = joint[k, RADIUS_POSITIVE] if theta >= 0.0 else joint[k, RADIUS_NEGATIVE]
        sine, rise = math.sin(theta), radius * (1.0 - math.cos(theta))
        jnt_pos[joint_index[k], axis[k]] = joint[k, LINE] + radius * sine
        jnt_pos[joint_index[k], 2] = rise
        body_pos[body_index[k], axis[k]] = radius * (theta - sine)
        body_pos[body_index[k], 2] = face - rise
        face = length[k]


@compiled_in_place
def resist(qpos: Array, qpos_index: Index, joint: Array, rod: Array, dof_index: Index, torque: Array) -> None:
    """Take the moments with which rods and sleeve resist bending from `torque`, shape (nv,) [N m].

    chest_tube_2025, Eq. 8, as in `rods.elastic_moments`. Beyond the angle at which the first gap closes
    they stay what they are there.
    """
    for k in range(joint.shape[0]):
        theta = qpos[qpos_index[k]]
        if theta < joint[k, LOW]:
            theta = joint[k, LOW]
        elif theta > joint[k, HIGH]:
            theta = joint[k, HIGH]
        radius = joint[k, RADIUS_POSITIVE] if theta >= 0.0 else joint[k, RADIUS_NEGATIVE]
        sine, cosine = math.sin(theta), math.cos(theta)
        rise = radius * (1.0 - cosine)
        moment = 0.0
        for j in range(rod.shape[1]):
            if rod[k, j, STIFFNESS] != 0.0:
                height = rise - rod[k, j, OFFSET] * sine + rod[k, j, MOUTH] * cosine + rod[k, j, SINK]
                moment += rod[k, j, STIFFNESS] * (sine / height - rod[k, j, REST_CURVATURE])
        mean = (theta - joint[k, REST]) / joint[k, LENGTH]
        square = mean * mean
        moment *= 1.0 + square * (joint[k, CUBIC] + square * joint[k, QUINTIC])
        torque[dof_index[k]] -= moment + joint[k, SLEEVE] * (theta - joint[k, REST])


@compiled_in_place
def turns(
    qpos: Array, qpos_index: Index, joint: Array, hole: Array, ends: Index, turn: Array, bent: Array
) -> None:
    """Write the turn of each pulled rod before each gap into `turn`, shape (t, n) [rad].

    chest_tube_2025, Eqs 2-4, as in `joint.turn`: the size of the turn in the link below the gap. Nothing
    is written for the base's hole, nor beyond the last joint that a rod passes, `ends[j]` joints.

    Args:
        qpos, qpos_index, joint: as in `place`.
        hole: see `rolling_pack.pack_holes`.
        ends: shape (t,).
        turn: out.
        bent: workspace, shape (7, n).
    """
    sine, cosine, rolled, across, along, cross, dot = (
        bent[0],
        bent[1],
        bent[2],
        bent[3],
        bent[4],
        bent[5],
        bent[6],
    )
    for k in range(joint.shape[0] - 1):
        theta = qpos[qpos_index[k]]
        radius = joint[k, RADIUS_POSITIVE] if theta >= 0.0 else joint[k, RADIUS_NEGATIVE]
        below = joint[k - 1, LENGTH] if k > 0 else joint[0, LENGTH]
        sine[k], cosine[k], rolled[k] = math.sin(theta), math.cos(theta), radius * theta
        across[k] = (radius + below) * sine[k]
        along[k] = radius * (1.0 - cosine[k]) - below * cosine[k]
    for j in range(turn.shape[0]):
        near, far, mouth, top = hole[j, 0], hole[j, 1], hole[j, 2], hole[j, 3]
        own, gaps, large = turn[j], ends[j] - 1, 0
        for k in range(gaps):
            reach = near[k] - rolled[k]
            x3, z3 = across[k] + reach * cosine[k], along[k] + reach * sine[k]
            x1, z1 = near[k] - x3, top[k] - z3
            x2, z2 = far[k] - x3, mouth[k] - z3
            cross[k], dot[k] = x1 * z2 - z1 * x2, x1 * x2 + z1 * z2
            large += abs(cross[k]) >= SMALL * dot[k]
        if large > 0:
            for k in range(gaps):
                own[k + 1] = 2.0 * abs(math.atan2(cross[k], dot[k]))
            continue
        for k in range(gaps):  # nearly always: the same by its series, several at once
            t = cross[k] / dot[k]
            s = t * t
            series = 1.0 + s * (-1 / 3 + s * (1 / 5 + s * (-1 / 7 + s * (1 / 9 + s * (-1 / 11 + s / 13)))))
            own[k + 1] = 2.0 * abs(t * series)


@compiled_in_place
def place_tops(length: Array, link: Index, depth: Array, site_index: Index, site_pos: Array) -> None:
    """Move what lies at fixed depths below the links' tops, shapes (s,) [m], in MuJoCo's `site_pos`."""
    for i in range(link.shape[0]):
        site_pos[site_index[i], 2] = length[link[i]] - depth[i]


@compiled_in_place
def compress(
    span_tension: Array,
    ends: Index,
    force_tip: Array,
    force_on_link: Array,
    gravity: Array,
    body_mass: Array,
    xmat: Array,
    body_index: Index,
    free_length: Array,
    compliance: Array,
    length: Array,
) -> None:
    """Write the lengths that the links have under tensions and loads into `length`, shape (n,) [m].

    Args:
        span_tension: in the gap below each link, NaN beyond a rod's end, shape (t, n) [N].
        force_tip: base frame, shape (3,) [N].
        force_on_link: base frame, shape (n, 3) [N].
        gravity: base frame, shape (3,) [m/s^2].
        body_mass: MuJoCo's, shape (nbody,) [kg].
        xmat: MuJoCo's orientations, shape (nbody, 9).
        body_index: of the links, shape (n,).
        free_length: of the links without load, shape (n,) [m].
        compliance: of the links along their axes, shape (n,) [m/N].
        length: out.
    """
    last = length.shape[0] - 1
    x, y, z = force_tip[0], force_tip[1], force_tip[2]  # all forces on this link and beyond
    for k in range(last, -1, -1):
        body = body_index[k]
        x += body_mass[body] * gravity[0] + force_on_link[k, 0]
        y += body_mass[body] * gravity[1] + force_on_link[k, 1]
        z += body_mass[body] * gravity[2] + force_on_link[k, 2]
        inside = -(x * xmat[body, 2] + y * xmat[body, 5] + z * xmat[body, 8])
        for j in range(span_tension.shape[0]):
            if k < ends[j]:
                above = span_tension[j, k + 1] if k + 1 < ends[j] else span_tension[j, k]
                inside += 0.5 * (span_tension[j, k] + above)
        length[k] = free_length[k] - inside * compliance[k]


@compiled_in_place
def place_copies(
    copies: Index,
    qpos: Array,
    qpos_index: Index,
    joint: Array,
    axis: Index,
    length: Array,
    joint_index: Index,
    body_index: Index,
    jnt_pos: Array,
    body_pos: Array,
) -> None:
    """`place` many robots' hinges: `qpos`, `jnt_pos`, `body_pos` with an axis more; `copies` picks some."""
    for i in copies:
        place(qpos[i], qpos_index, joint, axis, length, joint_index, body_index, jnt_pos[i], body_pos[i])


@compiled_in_place
def resist_copies(
    copies: Index, qpos: Array, qpos_index: Index, joint: Array, rod: Array, dof_index: Index, torque: Array
) -> None:
    """`resist` of many robots: `qpos` (m, nq) and `torque` (m, nv); `copies` picks some of them."""
    for i in copies:
        resist(qpos[i], qpos_index, joint, rod, dof_index, torque[i])


@compiled_in_place
def turns_of(
    copies: Index,
    qpos: Array,
    qpos_index: Index,
    joint: Array,
    hole: Array,
    ends: Index,
    turn: Array,
    bent: Array,
) -> None:
    """`turns` of many robots: `qpos` (m, nq) and `turn` (m, t, n); `copies` picks some of them."""
    for i in copies:
        turns(qpos[i], qpos_index, joint, hole, ends, turn[i], bent)
