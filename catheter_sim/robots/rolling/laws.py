"""Which forces run beside the step of a robot of rolling joints: rolling, elastic rods, inertia, friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.core.law import (
    Controls,
    CopiesLaw,
    CopyArrays,
    Law,
    RobotInModel,
    Step,
    StraightControls,
    TendonPaths,
    Views,
)
from catheter_sim.mechanics.compiled import compiled_in_place
from catheter_sim.robots.rolling import kernels
from catheter_sim.robots.rolling.description import (
    RollingChain,
    last_joint,
    rods,
    rolling_chain,
    rolling_joints,
)
from catheter_sim.robots.rolling.kernels import (
    CUBIC,
    HIGH,
    LENGTH,
    LINE,
    LOW,
    QUINTIC,
    RADIUS_NEGATIVE,
    RADIUS_POSITIVE,
    REST,
    SLEEVE,
)
from catheter_sim.robots.rolling.spec import RollingRobot

# ----------------------------------------------------------------------------------------------------
# Inner loops of a rolling-joint robot's step, compiled: placing links, rods' moments and turns.
#
# The same as `catheter_sim.robots.rolling.complete` and `joint` in plain NumPy, which the tests hold it
# to, but without derivatives; `catheter_sim.robots.rolling.laws` says what the loops are for.
# Index k counts joints and links from 0 at the base, j rods, the pulled ones first.
#
# Arrays. `joint`, shape (n, 12), as in `kernels.PackedChain`, and `rod`, shape (n, m, 6): see `pack` and the
# columns' names below.

# Columns of `rod`: STIFFNESS is 0 where the rod does not pass, CLEARANCE has the sign of its side.
STIFFNESS, REST_CURVATURE, OFFSET, MOUTH, SINK, CLEARANCE = range(6)
ALONE: Index = np.zeros(1, dtype=np.int64)  # of copies, where there is one robot
SMALL = 0.1  # of t in atan(t): the first term that its series leaves out, t^15 / 15, is below 7e-17


@compiled_in_place
def place(
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
    """Move hinges and links in the models of many robots to where pure rolling has them.

    Args:
        copies: which of m robots.
        qpos: MuJoCo's positions, shape (m, nq); `qpos_index` picks the bend angles, shape (n,).
        joint: see `pack`.
        axis: 0: the joint bends toward +x, 1: toward +y, shape (n,).
        length: of the links as compressed, shape (n,) [m].
        joint_index, body_index: of the hinges and links in MuJoCo, shape (n,).
        jnt_pos, body_pos: out: MuJoCo's, shapes (m, njnt, 3) and (m, nbody, 3) [m].
    """
    for copy in copies:
        face = 0.0  # height of the flat below in the frame of the link below
        for k in range(joint.shape[0]):
            theta = qpos[copy, qpos_index[k]]
            radius = joint[k, RADIUS_POSITIVE] if theta >= 0.0 else joint[k, RADIUS_NEGATIVE]
            sine, rise = math.sin(theta), radius * (1.0 - math.cos(theta))
            jnt_pos[copy, joint_index[k], axis[k]] = joint[k, LINE] + radius * sine
            jnt_pos[copy, joint_index[k], 2] = rise
            body_pos[copy, body_index[k], axis[k]] = radius * (theta - sine)
            body_pos[copy, body_index[k], 2] = face - rise
            face = length[k]


@compiled_in_place
def resist(
    copies: Index, qpos: Array, qpos_index: Index, joint: Array, rod: Array, dof_index: Index, torque: Array
) -> None:
    """Take the moments with which rods and sleeve resist bending from `torque`, shape (m, nv) [N m].

    Of those of m robots that `copies` picks, at positions (m, nq). chest_tube_2025, Eq. 8, as in
    `complete.elastic_moments`. Beyond the angle at which the first gap closes they stay what they are there.
    """
    for copy in copies:
        for k in range(joint.shape[0]):
            theta = qpos[copy, qpos_index[k]]
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
            torque[copy, dof_index[k]] -= moment + joint[k, SLEEVE] * (theta - joint[k, REST])


@compiled_in_place
def turns(
    copies: Index,
    qpos: Array,
    qpos_index: Index,
    joint: Array,
    hole: Array,
    ends: Index,
    turn: Array,
    bent: Array,
) -> None:
    """Write the turn of each pulled rod before each gap into `turn`, shape (m, t, n) [rad].

    chest_tube_2025, Eqs 2-4, as in `joint.turn`: the size of the turn in the link below the gap. Nothing
    is written for the base's hole, nor beyond the last joint that a rod passes, `ends[j]` joints.

    Args:
        copies, qpos, qpos_index, joint: as in `place`.
        hole: see `pack_holes`.
        ends: shape (t,).
        turn: out.
        bent: workspace, shape (7, n).
    """
    sine, cosine, rolled = bent[0], bent[1], bent[2]
    across, along, cross, dot = bent[3], bent[4], bent[5], bent[6]
    for copy in copies:
        for k in range(joint.shape[0] - 1):
            theta = qpos[copy, qpos_index[k]]
            radius = joint[k, RADIUS_POSITIVE] if theta >= 0.0 else joint[k, RADIUS_NEGATIVE]
            below = joint[k - 1, LENGTH] if k > 0 else joint[0, LENGTH]
            sine[k], cosine[k], rolled[k] = math.sin(theta), math.cos(theta), radius * theta
            across[k] = (radius + below) * sine[k]
            along[k] = radius * (1.0 - cosine[k]) - below * cosine[k]
        for j in range(turn.shape[1]):
            near, far, mouth, top = hole[j, 0], hole[j, 1], hole[j, 2], hole[j, 3]
            own, gaps, large = turn[copy, j], ends[j] - 1, 0
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
                series = 1.0 + s * (
                    -1 / 3 + s * (1 / 5 + s * (-1 / 7 + s * (1 / 9 + s * (-1 / 11 + s / 13))))
                )
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


# ----------------------------------------------------------------------------------------------------
# A chain in the arrays of the loops above.


def pack(chain: RollingChain) -> tuple[Array, Array]:
    """Return `chain` in the loops' arrays: `joint`, shape (n, 12), and `rod`, shape (n, m, 6)."""
    rod = np.stack(
        [
            np.where(chain.passes, chain.stiffness[:, None], 0.0),
            chain.rest_curvature,
            chain.offset,
            chain.mouth,
            chain.countersink,
            chain.side * chain.clearance,
        ],
        axis=2,
    )
    return kernels.pack(chain).joint, np.ascontiguousarray(rod.transpose(1, 0, 2))


def pack_holes(chain: RollingChain) -> Array:
    """Return what the turns need of the pulled rods' holes, shape (t, 4, n) [m].

    That is the lines along which a rod lies in the bent and in the straight hole, `offset` plus and minus
    `clearance`. Besides, the mouth below the gap, and the countersink's depth below the next link's top.
    """
    joint, rod = pack(chain)
    pulled = rod[:, : chain.pulled]
    near = pulled[:, :, OFFSET] + pulled[:, :, CLEARANCE]
    far = pulled[:, :, OFFSET] - pulled[:, :, CLEARANCE]
    top = joint[:, LENGTH, np.newaxis] - pulled[:, :, SINK]
    return np.ascontiguousarray(np.stack([near, far, pulled[:, :, MOUTH], top]).transpose(2, 0, 1))


# ----------------------------------------------------------------------------------------------------
# The rods of rolling joints: how they and the sleeve resist bending, and where they rub.


def joint_ids(robot: RollingRobot, place: RobotInModel) -> Index:
    """Return MuJoCo's numbers of the hinges, base to tip, shape (n,)."""
    return np.array([place.joint(joint.name).id for joint in rolling_joints(robot)], dtype=np.int64)


class RodElasticity(Law):
    """The moments with which rods and sleeve resist bending (chest_tube_2025, Eq. 8)."""

    def __init__(self, robot: RollingRobot, place: RobotInModel) -> None:
        self._joint, self._rod = pack(rolling_chain(robot))
        model, ids = place.model, joint_ids(robot, place)
        self._qpos = model.jnt_qposadr[ids].astype(np.int64)
        self._dofs = model.jnt_dofadr[ids].astype(np.int64)
        self._state = Views("qpos", "qfrc_applied", one_copy=True)

    def arrays(self) -> tuple[Array, Array, Index]:
        """Return `joint` and `rod` of `pack`, and the hinges' degrees of freedom."""
        return self._joint, self._rod, self._dofs

    def between(self, step: Step) -> None:
        """Add the moments."""
        self.add_to_copies(ALONE, *self._state(step.data))

    def add_to_copies(self, copies: Index, qpos: Array, applied: Array) -> None:
        """`between` in some of m copies: positions (m, nq), applied forces (m, nv)."""
        resist(copies, qpos, self._qpos, self._joint, self._rod, self._dofs, applied)


class RodTurns:
    """The angles by which the pulled rods turn in the links (chest_tube_2025, Eqs 2-4)."""

    def __init__(self, robot: RollingRobot, place: RobotInModel) -> None:
        chain = rolling_chain(robot)
        self._joint, self._rod = pack(chain)
        self._ends = chain.last.astype(np.int64)
        self._qpos = place.model.jnt_qposadr[joint_ids(robot, place)].astype(np.int64)
        self._hole = pack_holes(chain)
        self._turn = np.zeros((1, chain.pulled, chain.joints))
        self._bent = np.zeros((7, chain.joints))
        self._state = Views("qpos", one_copy=True)

    def arrays(self) -> tuple[Array, Array, Index]:
        """Return `joint` and `rod` of `pack`, and where the hinges' angles are."""
        return self._joint, self._rod, self._qpos

    def __call__(self, data: mujoco.MjData, ends: Index | None = None) -> Array:
        """Return the turn before each gap, shape (t, n) [rad], in a reused array.

        That is the turn in the link below; none in the base, and none beyond a rod's end.

        Args:
            data: the state.
            ends: of each rod the gaps that matter, 0 where none does; default: all, shape (t,).
        """
        last = self._ends if ends is None else ends
        turns(ALONE, *self._state(data), self._qpos, self._joint, self._hole, last, self._turn, self._bent)
        return self._turn[0]

    def of_copies(self, copies: Index, qpos: Array, site_xpos: Array, turn: Array) -> None:
        """Write the turns of some of m copies into `turn`, (m, t, n); see `core.law.Turns`."""
        turns(copies, qpos, self._qpos, self._joint, self._hole, self._ends, turn, self._bent)


def paths(robot: RollingRobot, place: RobotInModel) -> TendonPaths:
    """Return where the pulled rods rub: in the links."""
    return TendonPaths(
        names=[f"{place.prefix}tendon_{rod.name}" for rod in robot.tendons],
        spans=len(rolling_joints(robot)),
        ends=span_ends(robot),
        span_of_dof={int(place.joint(j.name).dofadr[0]): j.index - 1 for j in rolling_joints(robot)},
        turns=RodTurns(robot, place),
    )


def span_ends(robot: RollingRobot) -> np.ndarray:
    """Return how many joints each pulled rod passes, shape (t,)."""
    return np.array([last_joint(robot, rod) for rod in robot.tendons], dtype=int)


# ----------------------------------------------------------------------------------------------------
# Inertia of links that roll: what a hinge that stands still for a step leaves out, compiled.
#
# MuJoCo takes a joint's hinge for fixed in the link below. A contact moves along the flat there at R
# theta', so that everything beyond it is accelerated by R theta'^2 more, along the flat's normal: as the
# point of a wheel that touches the road is, toward the wheel's centre. Without this, free motion would not
# keep its energy.


class RollingLinks(NamedTuple):
    """Links that roll on one another, base to tip, by their places in MuJoCo's arrays.

    Attributes:
        radius: of the arc where a joint leans to minus and to plus, shape (n, 2) [m].
        qpos, dof: of the bends, shape (n,).
        joint, body, below: the joint, the link and what it rolls on, shape (n,).
        mass: of all of MuJoCo's bodies [kg].
    """

    radius: Array
    qpos: Index
    dof: Index
    joint: Index
    body: Index
    below: Index
    mass: Array


class ContactMotion(Law):
    """Adds the forces of inertia that come from the contacts' own motion."""

    def __init__(self, robot: RollingRobot, place: RobotInModel) -> None:
        model, chain, ids = place.model, rolling_chain(robot), joint_ids(robot, place)
        body = np.array([place.body(f"link_{joint.index}").id for joint in rolling_joints(robot)], np.int64)
        self._links = RollingLinks(
            radius=np.stack([chain.radius_negative, chain.radius_positive], axis=1),
            qpos=model.jnt_qposadr[ids].astype(np.int64),
            dof=model.jnt_dofadr[ids].astype(np.int64),
            joint=ids,
            body=body,
            below=model.body_parentid[body].astype(np.int64),
            mass=model.body_mass,
        )

    def between(self, step: Step) -> None:
        """Add the forces where the robot moves."""
        if not step.moving:
            return
        data = step.data
        add_inertia_of_contacts(
            *(data.qpos, data.qvel, self._links, data.xipos, data.xmat, data.xanchor, data.xaxis),
            data.qfrc_applied,
        )


@compiled_in_place
def add_inertia_of_contacts(
    qpos: Array,
    qvel: Array,
    links: RollingLinks,
    centre: Array,
    turned: Array,
    anchor: Array,
    axis: Array,
    applied: Array,
) -> None:
    """Take m R theta'^2, along the normal of each flat below a link, from the forces on all beyond it.

    Args:
        qpos, qvel: MuJoCo's.
        links: what rolls on what.
        centre, turned: of MuJoCo's bodies: centre of mass and orientation in the world.
        anchor, axis: of MuJoCo's joints, in the world.
        applied: in and out: shape (nv,) [N m].
    """
    radius, qpos_index, dof, joint, body, below, mass = links
    # what all links together up to one are accelerated by, then forces and moments from the tip down
    ax, ay, az = 0.0, 0.0, 0.0
    for k in range(body.shape[0]):
        rate = qvel[dof[k]]
        size = radius[k, 1 if qpos[qpos_index[k]] >= 0.0 else 0] * rate * rate
        ax += size * turned[below[k], 2]
        ay += size * turned[below[k], 5]
        az += size * turned[below[k], 8]
    fx, fy, fz, mx, my, mz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(body.shape[0] - 1, -1, -1):
        b, j = body[k], joint[k]
        px, py, pz = -mass[b] * ax, -mass[b] * ay, -mass[b] * az
        x, y, z = centre[b, 0], centre[b, 1], centre[b, 2]
        fx, fy, fz = fx + px, fy + py, fz + pz
        mx, my, mz = mx + y * pz - z * py, my + z * px - x * pz, mz + x * py - y * px
        x, y, z = anchor[j, 0], anchor[j, 1], anchor[j, 2]
        applied[dof[k]] += (
            axis[j, 0] * (mx - y * fz + z * fy)
            + axis[j, 1] * (my - z * fx + x * fz)
            + axis[j, 2] * (mz - x * fy + y * fx)
        )
        rate = qvel[dof[k]]
        size = radius[k, 1 if qpos[qpos_index[k]] >= 0.0 else 0] * rate * rate
        ax -= size * turned[below[k], 2]
        ay -= size * turned[below[k], 5]
        az -= size * turned[below[k], 8]


# ----------------------------------------------------------------------------------------------------
# Rolling: keeps the hinges of a model at the contacts of its joints.
#
# With the arc's radius R (that of the side it leans to) and the bend angle theta, the contact lies at line
# + R theta on the flat below and at (line + R sin theta, R (1 - cos theta)) in the link's own frame; a link
# hung there on a hinge must be shifted by (R (theta - sin theta), -R (1 - cos theta)) against the flat for
# the hinge to put it where pure rolling does. See `catheter_sim.robots.rolling.model`.
#
# What runs at every step is compiled, above.


@dataclass(frozen=True)
class RollingArrays:
    """What rolling needs to know of a robot as plain arrays, for where it runs elsewhere.

    Attributes:
        axis, joint_index, body_index, qpos_index: as in `place`, shape (n,).
        ends: number of joints that each pulled rod passes, shape (t,).
        length: of the links without load, shape (n,) [m].
        compliance: of the links along their axes, shape (n,) [m/N].
        top_link, top_site, top_depth: as in `place_tops`, shape (s,).
    """

    axis: Index
    joint_index: Index
    body_index: Index
    qpos_index: Index
    ends: Index
    length: Array
    compliance: Array
    top_link: Index
    top_site: Index
    top_depth: Array


class Rolling(Law):
    """Keeps the hinges of a model at the contacts of its rolling joints.

    Attributes:
        compressible: whether any link gives way along its axis.
    """

    def __init__(self, robot: RollingRobot, place: RobotInModel) -> None:
        self._model = model = place.model
        chain = rolling_chain(robot)
        joints = rolling_joints(robot)
        ids, body = joint_ids(robot, place), [place.body(f"link_{joint.index}").id for joint in joints]
        self._length = chain.link_length.copy()
        compliance = 1.0 / chain.link_stiffness
        self.compressible = bool((compliance > 0.0).any())
        tops = [(joint.index, f"face_{joint.index}") for joint in joints] + [(joints[-1].index, "tip")]
        tops += [
            (k, f"hole_{rod.name}_{k}") for rod in rods(robot) for k in range(1, last_joint(robot, rod) + 1)
        ]
        top_link = np.array([k - 1 for k, _ in tops], dtype=np.int64)
        top_site = np.array([place.site(name).id for _, name in tops], dtype=np.int64)
        self._arrays = arrays = RollingArrays(
            axis=chain.axis.astype(np.int64),
            joint_index=ids,
            body_index=np.array(body, dtype=np.int64),
            qpos_index=model.jnt_qposadr[ids].astype(np.int64),
            ends=chain.last.astype(np.int64),
            length=chain.link_length,
            compliance=compliance,
            top_link=top_link,
            top_site=top_site,
            top_depth=self._length[top_link] - model.site_pos[top_site, 2],
        )
        self._hinges = arrays.qpos_index, pack(chain)[0], arrays.axis
        self._places = arrays.joint_index, arrays.body_index
        self._state = Views("qpos", one_copy=True)
        self._moved = Views("jnt_pos", "body_pos", one_copy=True)

    def layout(self) -> RollingArrays:
        """Return what it works on as plain arrays."""
        return self._arrays

    def reset(self) -> None:
        """Give the links their own lengths back."""
        self._length[:] = self._arrays.length
        self._place_tops()

    def before(self, step: Step) -> None:
        """Shorten the links as they are pressed together."""
        if self.compressible:
            self.compress(step.data, step.span_tension(), step.force_tip, step.force_on_element)

    def place(self, data: mujoco.MjData) -> None:
        """Put hinges and links where pure rolling has them at the present angles."""
        moved = self._moved(self._model)
        place(ALONE, *self._state(data), *self._hinges, self._length, *self._places, *moved)

    def place_copies(self, copies: Index, qpos: Array, jnt_pos: Array, body_pos: Array) -> None:
        """`place` in some of m copies of the model, without compression.

        Args:
            copies: which.
            qpos: all positions, shape (m, nq).
            jnt_pos, body_pos: out: their fields of the model, shapes (m, njnt, 3) and (m, nbody, 3) [m].
        """
        place(copies, qpos, *self._hinges, self._arrays.length, *self._places, jnt_pos, body_pos)

    def compress(
        self, data: mujoco.MjData, span_tension: Array, force_tip: Array, force_on_link: Array
    ) -> None:
        """Shorten the links as the present tensions and loads press them together.

        A link carries the mean of its rods' tensions below and above its holes' friction, and the
        weight and forces beyond it. It follows one step behind.

        Args:
            data: the state.
            span_tension: in the gap below each link, NaN beyond a rod's end, shape (t, n) [N].
            force_tip: on the tip, world frame, shape (3,) [N].
            force_on_link: other forces on each link, world frame, shape (n, 3) [N].
        """
        arrays, weight = self._arrays, (self._model.opt.gravity, self._model.body_mass)
        links = data.xmat, arrays.body_index, arrays.length, arrays.compliance, self._length
        compress(span_tension, arrays.ends, force_tip, force_on_link, *weight, *links)
        self._place_tops()

    def _place_tops(self) -> None:
        """Put the sites near the links' tops at their depths below them."""
        arrays = self._arrays
        place_tops(self._length, arrays.top_link, arrays.top_depth, arrays.top_site, self._model.site_pos)


class RollingCopies(CopiesLaw):
    """Rolling, without compression, and the rods' elasticity in many copies."""

    def __init__(self, rolling: Rolling, rods: RodElasticity, arrays: CopyArrays) -> None:
        self._rolling, self._rods, self._arrays = rolling, rods, arrays
        self._hinges, self._links = arrays.own("jnt_pos"), arrays.own("body_pos")
        self.moved = {"jnt_pos": self._hinges, "body_pos": self._links}

    def place(self, copies: Index) -> None:
        """Put hinges and links where pure rolling has them."""
        self._rolling.place_copies(copies, self._arrays.qpos, self._hinges, self._links)

    def between(self, copies: Index) -> None:
        """Add the moments with which rods and sleeve resist bending."""
        self._rods.add_to_copies(copies, self._arrays.qpos, self._arrays.applied)


# ----------------------------------------------------------------------------------------------------
# Which forces run beside the step of a robot of rolling joints: rolling, elastic rods, inertia, friction.


def controls(robot: RollingRobot, place: RobotInModel) -> Controls:
    """Return what stands between inputs and actuators: nothing."""
    return StraightControls(place, span_ends(robot))


def laws(robot: RollingRobot, place: RobotInModel) -> tuple[Law, ...]:
    """Return the laws but friction."""
    return Rolling(robot, place), RodElasticity(robot, place), ContactMotion(robot, place)


def tendon_paths(robot: RollingRobot, place: RobotInModel) -> TendonPaths:
    """Return where the pulled rods rub."""
    return paths(robot, place)


def sliding_joints(robot: RollingRobot) -> list[str]:
    """Return the joints that must stand still besides the hinges: none."""
    return []
