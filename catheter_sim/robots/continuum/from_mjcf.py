"""A continuum robot from somebody's MJCF: a chain of hinges with tendons becomes a robot of this package."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
from scipy.optimize import NoConvergence, newton_krylov, nnls
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.robot import Dynamics, Friction
from catheter_sim.errors import InputError, RobotNote
from catheter_sim.mjcf import names
from catheter_sim.mjcf.document import Element
from catheter_sim.robots.continuum.description import check
from catheter_sim.robots.continuum.model import add_chain, add_tendons
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon

# ----------------------------------------------------------------------------------------------------
# The backbone of an MJCF chain: its hinges on a line, and the frame that becomes the robot's.

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
        hinge.cubic[axis] = _cubic_of_hinge(model, joint)
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


def _cubic_of_hinge(model: mujoco.MjModel, joint: int) -> float:
    """Return the torque's cubic term; MuJoCo before 4 has none."""
    terms = getattr(model, "jnt_stiffnesspoly", None)
    return 0.0 if terms is None else float(np.atleast_2d(terms)[joint][-1])


def _name(model: mujoco.MjModel, joint: int) -> str:
    return model.joint(joint).name or f"number {joint}"


# ----------------------------------------------------------------------------------------------------
# The tendons of an MJCF chain: where their sites lie, where they end, and what pulls them.

_ASIDE_SHARE = 0.02  # of a tendon's distance from the axis: holes off by less are in place


@dataclass(frozen=True)
class Routed:
    """A tendon through sites.

    Attributes:
        name: letters, digits and _.
        number: the tendon's in the model.
        radius_m, angle_rad: of its holes about the chain's z.
        holes: the hinge, from 1, that carries each hole, 0 for the base, and its height from the first hinge
            [m]; of the base's the last one alone.
        stiffness_N_per_m: of a position servo that draws it; None: a tension pulls it.
        notes: what is not as a robot's file has it.
    """

    name: str
    number: int
    radius_m: float
    angle_rad: float
    holes: tuple[tuple[int, float], ...]
    stiffness_N_per_m: float | None
    notes: tuple[str, ...]


def tendons_of(
    model: mujoco.MjModel, data: mujoco.MjData, frame: Frame, hinges: Sequence[Hinge], where: str
) -> list[Routed]:
    """Return the chain's spatial tendons.

    Raises:
        InputError: a tendon wraps around geoms, or has no site on the chain.
    """
    found: list[Routed] = []
    for tendon in range(model.ntendon):
        name = _plain(model.tendon(tendon).name or f"tendon_{tendon + 1}")
        first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
        kinds = set(model.wrap_type[first : first + count].tolist())
        if kinds == {int(mujoco.mjtWrap.mjWRAP_JOINT)}:
            continue  # a fixed tendon couples joints; it has no way
        if kinds != {int(mujoco.mjtWrap.mjWRAP_SITE)}:
            raise InputError(f"{where}: tendon {name} does not go from site to site alone: it cannot be read")
        sites = model.wrap_objid[first : first + count].tolist()
        found.append(_routed(model, data, frame, hinges, name, tendon, sites, where))
    return found


def hinge_of(model: mujoco.MjModel, hinges: Sequence[Hinge], body: int) -> int:
    """Return the number, from 1, of the hinge that carries a body; 0: none."""
    number = {hinge.body: k + 1 for k, hinge in enumerate(hinges)}
    while body and body not in number:
        body = int(model.body_parentid[body])
    return number.get(body, 0)


def _routed(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    frame: Frame,
    hinges: Sequence[Hinge],
    name: str,
    tendon: int,
    sites: Sequence[int],
    where: str,
) -> Routed:
    places = np.array([frame.place(data.site_xpos[site]) for site in sites])
    links = [hinge_of(model, hinges, int(model.site_bodyid[site])) for site in sites]
    if not any(links):
        raise InputError(f"{where}: tendon {name} has no site on the chain")
    if links[0] > links[-1]:  # from its end to the base
        places, links = places[::-1], links[::-1]
    if any(links[k + 1] < link for k, link in enumerate(links[:-1])):
        raise InputError(f"{where}: tendon {name} goes to and fro along the chain: it cannot be read")
    begin = max(sum(link == 0 for link in links) - 1, 0)
    places, links = places[begin:], links[begin:]
    notes = [] if links[0] == 0 else [f"tendon {name}: it has no site on the base, and begins there"]
    turn = np.unwrap(np.arctan2(places[:, 1], places[:, 0]))
    radii = np.linalg.norm(places[:, :2], axis=1)
    radius, angle = float(np.median(radii)), float(np.median(turn))
    if radius <= 0.0:
        raise InputError(f"{where}: tendon {name} goes along the axis: it bends nothing")
    off = np.linalg.norm(places[:, :2] - radius * np.array([np.cos(angle), np.sin(angle)]), axis=1)
    if off.max() > _ASIDE_SHARE * radius:
        notes.append(
            f"tendon {name}: holes up to {1e3 * off.max():.3g} mm from their median place, which is taken"
        )
    holes = tuple((link, float(place[2])) for link, place in zip(links, places, strict=True))
    return Routed(
        name, tendon, radius, math.remainder(angle, 2.0 * math.pi), holes,
        _servo_stiffness(model, tendon), tuple(notes),
    )  # fmt: skip


def _servo_stiffness(model: mujoco.MjModel, tendon: int) -> float | None:
    for k in range(model.nu):
        on_it = (
            model.actuator_trntype[k] == mujoco.mjtTrn.mjTRN_TENDON and model.actuator_trnid[k, 0] == tendon
        )
        if on_it and model.actuator_biastype[k] == mujoco.mjtBias.mjBIAS_AFFINE:
            return abs(float(model.actuator_biasprm[k, 1])) * float(model.actuator_gear[k, 0]) ** 2
    return None


def _plain(name: str) -> str:
    return re.sub(r"\W+", "_", name).strip("_").removeprefix("tendon_") or "tendon"


# ----------------------------------------------------------------------------------------------------
# How far a robot that was read from MJCF is from its source: both bent in MuJoCo, by the same tensions.
#
# Each tendon in turn bends the chain by some 75 deg, with the file's gravity. A posture at rest is where
# springs, tendons and weight balance: Newton's and Krylov's method on MuJoCo's own forces, the tension
# brought on step by step.

LARGEST_DIFFERENCE = 0.02  # of the bend, and of the length: what differs by more is another robot
_BEND_RAD = math.radians(75.0)
_STEP_RAD = math.radians(15.0)  # by which a step of the tension bends the chain, about
_MOST_STEPS, _MOST_ROUNDS = 12, 30
_NO_BEND_RAD = 1e-3
_TIE = 1e-5  # shares that differ by less: the first tendon is named
_TOLD_TWIST_RAD = math.radians(0.1)
_BALANCED_RAD = 1e-7  # unbalanced torques over the stiffness of their joints


@dataclass(frozen=True)
class _Chain:
    """A chain in MuJoCo, and where to look at it.

    Attributes:
        model, data: the chain, and its state.
        bodies: what each hinge carries, from base to tip.
        joints: one of each hinge.
        origin, axes: of the base frame in the model's world, shapes (3,) [m] and (3, 3).
        tip: in the last body [m], shape (3,).
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    bodies: Sequence[int]
    joints: Sequence[int]
    origin: Array
    axes: Array
    tip: Array


@dataclass(frozen=True)
class _Difference:
    """Between two chains that one tendon bends.

    Attributes:
        tendon: its name.
        bend_rad: of the file's tip.
        of_bend: the largest angle between two links' axes, of that.
        twist_rad: the largest turn of a link about its axis.
        off_m: the largest distance of two hinges, or of the tips.
        length_m: of the chain.
    """

    tendon: str
    bend_rad: float
    of_bend: float
    twist_rad: float
    off_m: float
    length_m: float

    @property
    def share(self) -> float:
        """The larger of both, of the bend and of the length."""
        return max(self.of_bend, self.off_m / self.length_m)


def compare(
    model: mujoco.MjModel,
    frame: Frame,
    hinges: Sequence[Hinge],
    tendons: Sequence[int],
    robot: ContinuumRobot,
    base_m: float,
    tip_m: float,
    moved: Sequence[str],
    where: str,
) -> list[str]:
    """Return in a line how far `robot` is from the model that it was read from; nothing where nothing pulls.

    Args:
        model: the source; changed: only springs, weight and tendons act in it from now on.
        frame, hinges: of its chain.
        tendons: numbers of those that became the robot's, in its order.
        robot: what was read.
        base_m, tip_m: where the robot's base and tip are along the chain, from its first hinge.
        moved: what is not as the file has it, to be named where that is too much.
        where: what to call the model.

    Raises:
        InputError: they differ by more than 2 %.
    """
    length_m = tip_m - base_m
    source = _source(model, frame, hinges, base_m, tip_m)
    ours = _ours(robot, frame.axes.T @ model.opt.gravity)
    worst: _Difference | None = None
    for number, tendon in zip(tendons, robot.tendons, strict=True):
        tension = np.zeros(model.ntendon)
        steps = _bent(source, number, tension)
        places, turns = _frames(source)
        _at_rest(ours)
        own = ours.model.tendon(names.tendon(tendon.name)).id
        pull = np.zeros(ours.model.ntendon)
        for value in steps:
            pull[own] = value
            if not _settle(ours, pull):
                break
        our_places, our_turns = _frames(ours)
        bend = float((turns[-1]).magnitude())
        off_rad, twist_rad = _between(turns, our_turns)
        off_m = float(np.linalg.norm(places - our_places, axis=1).max())
        one = _Difference(tendon.name, bend, off_rad / max(bend, _NO_BEND_RAD), twist_rad, off_m, length_m)
        worst = one if worst is None or one.share > worst.share + _TIE else worst
    if worst is None:
        return []
    twist = f", {math.degrees(worst.twist_rad):.2g} deg of twist" * (worst.twist_rad > _TOLD_TWIST_RAD)
    text = (
        f"{round(100.0 * worst.of_bend, 2):g} % of bend and {round(1e3 * worst.off_m, 3):g} mm{twist} off "
        f"the file in MuJoCo{' in its gravity' * bool(model.opt.gravity.any())}, bent by "
        f"{math.degrees(worst.bend_rad):.0f} deg by tendon {worst.tendon}"
    )
    if worst.share > LARGEST_DIFFERENCE:
        why = "; ".join(moved) or "the file holds more than links, holes and springs"
        raise InputError(f"{where}: the robot would be {text}, but at most 2 % is taken: {why}")
    return [text]


def _source(
    model: mujoco.MjModel, frame: Frame, hinges: Sequence[Hinge], base_m: float, tip_m: float
) -> _Chain:
    bits = mujoco.mjtDisableBit
    model.opt.disableflags |= int(bits.mjDSBL_CONSTRAINT) | int(bits.mjDSBL_ACTUATION)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    z, last = frame.axes[:, 2], hinges[-1].body
    tip = data.xmat[last].reshape(3, 3).T @ (frame.origin + tip_m * z - data.xpos[last])
    return _Chain(
        model, data, [item.body for item in hinges], [item.joint for item in hinges],
        frame.origin + base_m * z, frame.axes, tip,
    )  # fmt: skip


def _ours(robot: ContinuumRobot, gravity: Array) -> _Chain:
    root = Element("mujoco")
    root.add("compiler", angle="radian", boundmass=1e-14, boundinertia=1e-14)
    add_chain(root, robot)
    add_tendons(root, robot)
    model = mujoco.MjModel.from_xml_string(root.text())
    model.opt.gravity[:] = gravity
    bodies = [body for body in range(model.nbody) if model.body_jntnum[body]]
    joints = [int(model.body_jntadr[body]) for body in bodies]
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    tip = data.site(names.TIP).xpos - data.xpos[bodies[-1]]
    return _Chain(model, data, bodies, joints, np.zeros(3), np.eye(3), tip)


def _frames(chain: _Chain) -> tuple[Array, list[Rotation]]:
    """Return the hinges' and the tip's places, shape (n + 1, 3) [m], and the links' turns, as of the base."""
    data, model = chain.data, chain.model
    last = chain.bodies[-1]
    tip = data.xpos[last] + data.xmat[last].reshape(3, 3) @ chain.tip
    places = (np.vstack([data.xanchor[list(chain.joints)], tip]) - chain.origin) @ chain.axes
    straight = mujoco.MjData(model)
    mujoco.mj_kinematics(model, straight)
    turns = [
        Rotation.from_matrix(
            chain.axes.T @ data.xmat[body].reshape(3, 3) @ straight.xmat[body].reshape(3, 3).T @ chain.axes
        )
        for body in chain.bodies
    ]
    return places, turns


def _between(one: Sequence[Rotation], other: Sequence[Rotation]) -> tuple[float, float]:
    """Return the largest angle between axes of links that belong together, and the largest twist [rad]."""
    left = [(a.inv() * b).as_matrix() for a, b in zip(one, other, strict=True)]
    angle = max(math.atan2(math.hypot(R[0, 2], R[1, 2]), R[2, 2]) for R in left)
    return angle, max(abs(math.atan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])) for R in left)


def _at_rest(chain: _Chain) -> None:
    chain.data.qpos[:] = chain.model.qpos_spring


def _bent(chain: _Chain, tendon: int, tension: Array) -> list[float]:
    """Bend a chain by one tendon by `_BEND_RAD`, or as far as it goes; return the tensions on the way [N]."""
    _at_rest(chain)
    steps = [0.0] if _settle(chain, tension) else []
    bend = 0.0
    rate = float(np.abs(np.cumsum(_moments(chain, tendon) / chain.model.jnt_stiffness)).max())
    while steps and rate > 0.0 and len(steps) < _MOST_STEPS and bend < _BEND_RAD - 0.3 * _STEP_RAD:
        before = chain.data.qpos.copy()
        tension[tendon] += min(_STEP_RAD, _BEND_RAD - bend) / rate
        if not _settle(chain, tension):
            chain.data.qpos[:] = before
            break
        steps.append(float(tension[tendon]))
        bend = float(_frames(chain)[1][-1].magnitude())
        rate = max(bend, _NO_BEND_RAD) / steps[-1]
    _unbalanced(chain, tension)
    return steps


def _moments(chain: _Chain, tendon: int) -> Array:
    """Return how a tendon's length falls with the joints, shape (nv,) [m/rad]."""
    start, count = int(chain.model.ten_J_rowadr[tendon]), int(chain.model.ten_J_rownnz[tendon])
    row = slice(start, start + count)
    out = np.zeros(chain.model.nv)
    out[chain.model.ten_J_colind[row]] = -chain.data.ten_J[row]
    return out


def _unbalanced(chain: _Chain, tension: Array) -> Array:
    """Return the torques at the joints that nothing balances, shape (nv,) [N m]."""
    model, data = chain.model, chain.data
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_tendon(model, data)
    mujoco.mj_passive(model, data)
    mujoco.mj_rne(model, data, 0, data.qfrc_bias)
    pulls = sum((tension[k] * _moments(chain, int(k)) for k in np.flatnonzero(tension)), np.zeros(model.nv))
    return np.asarray(data.qfrc_passive - data.qfrc_bias + pulls)


def _settle(chain: _Chain, tension: Array) -> bool:
    """Move a chain to the balance next to where it is; return whether it is there."""

    def left(turns: Array) -> Array:
        chain.data.qpos[:] = turns
        return _unbalanced(chain, tension) / chain.model.jnt_stiffness

    try:
        chain.data.qpos[:] = newton_krylov(
            left, chain.data.qpos.copy(), f_tol=_BALANCED_RAD, maxiter=_MOST_ROUNDS
        )
    except (NoConvergence, ValueError):  # a chain that buckles
        return False
    return bool(np.isfinite(left(chain.data.qpos.copy())).all())


# ----------------------------------------------------------------------------------------------------
# A continuum robot from somebody's MJCF: a chain of hinges with tendons becomes a robot of this package.
#
# A disk stands wherever a tendon has a hole, and a hinge anywhere between two disks
# (`Segment.hinge_share`), so that holes stay where they are; where no hinge is between, a stretch is stiff.
# What MJCF does not say (friction at the holes, what is a segment, what a hinge stands for) is worked out
# of places and stiffnesses or assumed, and said in notes. What the robot is like beside the file, MuJoCo
# says (`compared`).

_ALIKE = 0.02  # share by which numbers of one segment may differ
_WIDER = 1.25  # than its outermost holes a robot is taken to be, where no geom says
_SAME_SHARE = 1e-3  # of the mean distance of hinges: heights that differ by less are one
_LEFT_OUT = "left out"
_MASS_SHARE = 1e-3  # of the chain's length: masses that are nearer are in place
_LEAST_MASS_KG = 1e-9  # of a stretch that weighs nothing


@dataclass(frozen=True)
class ReadChain:
    """A robot that was read.

    Attributes:
        robot: the robot.
        notes: what was assumed, left out or moved, a line each; the robot's description has them, too.
    """

    robot: ContinuumRobot
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _ChainCell:
    """What is between two disks that follow one another.

    Attributes:
        low_m, high_m: heights of the disks, from the first hinge.
        hinges: between them, from base to tip.
        ends: whether a tendon ends at the disk above.
    """

    low_m: float
    high_m: float
    hinges: tuple[Hinge, ...]
    ends: bool

    @property
    def length_m(self) -> float:
        """From disk to disk."""
        return self.high_m - self.low_m

    @property
    def places(self) -> tuple[float, ...]:
        """Of the hinges, shares of the length."""
        return tuple((item.z_m - self.low_m) / self.length_m for item in self.hinges)


def read_chain(path: Path | str, name: str | None = None) -> ReadChain:
    """Return a chain of hinges with spatial tendons as a continuum robot.

    Its base frame is the file's own, of the body that carries the chain, where that lies on the chain's axis
    and the chain points along its z. Otherwise it is shifted and turned, which a note says. `load_robot`
    takes such a file, too, and `catheter_sim.catalogue.robot_toml` makes a robot's file of it.

    Args:
        path: of an MJCF file, or a model saved as one.
        name: of the robot; None: the file's.

    Raises:
        InputError: no such file, not MJCF, not a straight chain of hinges, or one that the robot would differ
            from by more than 2 %.

    Warns:
        RobotNote: how far the robot is from the file in MuJoCo, and how its base frame lies in the file's.
    """
    path = Path(path)
    where = str(path)
    if not path.is_file():
        raise InputError(f"{where}: no such file")
    try:
        model = mujoco.MjModel.from_xml_path(where)
    except ValueError as error:
        raise InputError(f"{where}: MuJoCo cannot read it: {error}") from None
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    frame, hinges = hinges_of(model, data, where)
    routed = tendons_of(model, data, frame, hinges, where)
    notes = [note for item in routed for note in item.notes]
    cells, every = _cells(model, data, frame, hinges, routed, notes, where)
    spread = _spread(cells, every, notes)
    segments, numbers = _segments(model, cells, every, routed, notes)
    segments, masses, off_m = _with_masses(model, data, frame, hinges, segments, cells, numbers)
    if off_m > _MASS_SHARE * (cells[-1].high_m - cells[0].low_m):
        notes.append(f"masses: {1e3 * off_m:.2g} mm along the chain from where the file has them, on average")
    servos = [item.stiffness_N_per_m is not None for item in routed]
    if any(servos) != all(servos):
        raise InputError(f"{where}: servos draw some tendons and tensions pull others: all must be alike")
    orders = {tuple(axis for axis in item.stiffness if axis in "xy") for item in hinges}
    if len(hinges) > 1 and len(orders) == 1 and len(orders.pop()) == 2:
        notes.append("two hinges at one place: about x and about y come first in turn, which lessens twist")
    moved = list(notes)
    dynamics = _dynamics(hinges, notes)
    left_out = _left_out(model)
    read = f"read from {path.name}, {len(hinges)} hinges, {len(routed)} tendons"
    robot = ContinuumRobot(
        name=name or path.stem,
        description="",
        segments=segments,
        tendons=tuple(_tendon(item, segments, cells, numbers) for item in routed),
        friction=Friction(mu=0.0),
        dynamics=dynamics,
        actuation="displacement" if servos and all(servos) else "tension",
        links_per_subsegment=every,
        hinges=spread,
        masses=masses,
    )
    check(robot, where)
    measured = compare(
        model, frame, hinges, [item.number for item in routed], robot, cells[0].low_m, cells[-1].high_m,
        [*moved, *(note for note in left_out if note.startswith(_LEFT_OUT))], where,
    )  # fmt: skip
    said = [*measured, _frame_note(model, data, frame, cells[0].low_m)]
    warnings.warn(f"{where}: {'; '.join(said)}", RobotNote, stacklevel=2)
    notes = [*said, *notes, *left_out]
    return ReadChain(replace(robot, description="; ".join([read, *notes])), tuple(notes))


def _cells(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    frame: Frame,
    hinges: Sequence[Hinge],
    routed: Sequence[Routed],
    notes: list[str],
    where: str,
) -> tuple[list[_ChainCell], int]:
    """Return what is between the disks, from the base to the tip, and how many hinges each cell has."""
    count, places = len(hinges), [item.z_m for item in hinges]
    apart = float(np.mean(np.diff(places))) if count > 1 else max(abs(places[0]), 1e-3)
    same = _SAME_SHARE * apart
    holes = sorted(hole for item in routed for hole in item.holes)
    if not routed:  # a rod: a disk half way between two hinges
        holes = [(k, 0.5 * (places[k - 1] + places[k])) for k in range(1, count)]
    disks: list[tuple[int, float]] = []
    for link, z_m in holes:
        if not disks or disks[-1][0] != link or z_m - disks[-1][1] > same:
            disks.append((link, z_m))
    first_m = disks[0][1] if disks and disks[0][0] == 0 else places[0] - 0.5 * apart
    own = frame.place(data.xpos[frame.base])
    on_axis = float(np.hypot(own[0], own[1])) <= same and first_m - places[-1] <= own[2] <= first_m + same
    base_m = min(float(own[2]), first_m) if on_axis else first_m
    if not disks or disks[0][0] > 0 or disks[0][1] - base_m > same:
        disks.insert(0, (0, base_m))
    tip_m = _tip(model, data, frame, hinges, disks[-1], apart, same, notes)
    if disks[-1][0] < count or tip_m - disks[-1][1] > same:
        disks.append((count, tip_m))
    between = [len(range(low[0], high[0])) for low, high in pairwise(disks)]
    every = max(between)
    if set(between) - {0, every} or not _alike_within(hinges, disks):
        every = 1
        disks = _with_disks_between(disks, places, notes)
    for (_, low), (link, high) in pairwise(disks):
        if high - low <= same:
            raise InputError(
                f"{where}: the holes of link {link} lie {1e3 * (low - high):.3g} mm below those before them: "
                "holes must rise from link to link"
            )
    last = {_nearest(disks, item.holes[-1]) for item in routed}
    for item in routed:
        passed, there = len(item.holes), _nearest(disks, item.holes[-1]) + (item.holes[0][0] == 0)
        if passed < there and any(abs(item.holes[0][1] - low) <= same for _, low in disks[:1]):
            notes.append(f"tendon {item.name}: it passes {passed} of {there} disks, and is led through all")
    return [
        _ChainCell(low[1], high[1], tuple(hinges[low[0] : high[0]]), k + 1 in last)
        for k, (low, high) in enumerate(pairwise(disks))
    ], every


def _nearest(disks: Sequence[tuple[int, float]], hole: tuple[int, float]) -> int:
    """Return the number of the disk in which a hole is."""
    return min(range(len(disks)), key=lambda k: (abs(disks[k][0] - hole[0]), abs(disks[k][1] - hole[1])))


def _alike_within(hinges: Sequence[Hinge], disks: Sequence[tuple[int, float]]) -> bool:
    """Return whether hinges between two disks are alike."""
    return all(
        _alike(before, after)
        for low, high in pairwise(disks)
        for before, after in pairwise(hinges[low[0] : high[0]])
    )


def _with_disks_between(
    disks: Sequence[tuple[int, float]], places: Sequence[float], notes: list[str]
) -> list[tuple[int, float]]:
    """Return disks, one more half way between two hinges that have none between them."""
    found = [disks[0]]
    for low, high in pairwise(disks):
        found += [(k, 0.5 * (places[k - 1] + places[k])) for k in range(low[0] + 1, high[0])]
        found.append(high)
    added = len(found) - len(disks)
    notes.append(f"tendons are led through {added} more disks between hinges that have no hole between them")
    return found


def _tip(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    frame: Frame,
    hinges: Sequence[Hinge],
    disk: tuple[int, float],
    apart: float,
    same: float,
    notes: list[str],
) -> float:
    """Return the tip's height: of the file's highest site on the axis, the last disk, or a link's end."""
    threaded = set(model.wrap_objid[model.wrap_type == int(mujoco.mjtWrap.mjWRAP_SITE)].tolist())
    heights = []
    for site in range(model.nsite):
        x, y, z = frame.place(data.site_xpos[site])
        carried = hinge_of(model, hinges, int(model.site_bodyid[site])) == len(hinges)
        if carried and site not in threaded and np.hypot(x, y) <= same:
            heights.append(float(z))
    least = disk[1] if disk[0] == len(hinges) else hinges[-1].z_m
    if heights and max(heights) > least - same:
        return max(*heights, least)
    if least > hinges[-1].z_m + same:
        return least
    half = 1.0 if disk[0] == len(hinges) else 0.5  # of a rod's last stretch
    tip_m = hinges[-1].z_m + half * apart
    notes.append(f"tip: {1e3 * half * apart:.3g} mm beyond the last hinge, as no site says where")
    return tip_m


def _segments(
    model: mujoco.MjModel,
    cells: Sequence[_ChainCell],
    every: int,
    routed: Sequence[Routed],
    notes: list[str],
) -> tuple[tuple[Segment, ...], list[int]]:
    """Return stretches of equal cells, cut where a tendon ends, and the segment's number of each cell."""
    radius_m = _outer_radius(model, routed)
    groups: list[list[_ChainCell]] = []
    for k, cell in enumerate(cells):
        if k == 0 or cells[k - 1].ends or not _same_cells(groups[-1][0], cell):
            groups.append([])
        groups[-1].append(cell)
    stiff = next(item for item in cells if item.hinges).hinges[0]
    found: list[Segment] = []
    for group in groups:
        length = sum(cell.length_m for cell in group)
        part = [hinge for cell in group for hinge in cell.hinges]
        axes = "".join(axis for axis in "xy" if part and axis in part[0].stiffness)
        bending = len([item for item in found if item.name.startswith("segment_")]) + 1
        each = length / len(group) / every
        if not part:
            place = "base" if group[0] is cells[0] else "tip" if group[-1] is cells[-1] else "stiff"
            place = place if place != "stiff" else f"stiff_{len(found) + 1}"
            found.append(
                Segment(place, _round(length), len(group), _round(radius_m),
                        _round(max(stiff.stiffness.values()) * each), _LEAST_MASS_KG, bending_axes="none")
            )  # fmt: skip
            continue
        main = axes[:1] or "t"
        stiffness = _mean(part, main)
        if axes == "xy" and abs(_mean(part, "y") - stiffness) > _ALIKE * stiffness:
            notes.append(
                f"segment_{bending}: {stiffness:.3g} N m/rad toward x, taken for both, "
                f"{_mean(part, 'y'):.3g} toward y"
            )
        found.append(
            Segment(
                name=f"segment_{bending}",
                length_m=_round(length),
                disks=len(group),
                outer_radius_m=_round(radius_m),
                bending_stiffness_N_m2=_round(stiffness * each),
                mass_kg=_LEAST_MASS_KG,
                bending_axes=axes or "none",
                torsion_stiffness_N_m2=_round(_mean(part, "t") * each)
                if "t" in part[0].stiffness
                else math.inf,
                stiffness_cubic_m2=_round(_cubic(part, main) / stiffness * each**2) if axes else 0.0,
                rest_curvature_x_per_m=_round(_rest(part, "x") / each),
                rest_curvature_y_per_m=_round(_rest(part, "y") / each),
                hinge_share=_share(group) if every == 1 else 0.5,
            )
        )
    return tuple(found), [k for k, group in enumerate(groups) for _ in group]


def _share(group: Sequence[_ChainCell]) -> float:
    share = float(np.mean([cell.places[0] for cell in group]))
    return 0.5 if abs(share - 0.5) < _SAME_SHARE else _round(share)


def _spread(cells: Sequence[_ChainCell], every: int, notes: list[str]) -> str:
    """Return how several hinges a cell stand there, "even" or "rod" (`layout.hinge_places`)."""
    if every == 1:
        return "even"
    for name, end in (("even", 0.5 / every), ("rod", 0.5 / (every + 1))):
        wanted = np.linspace(end, 1.0 - end, every)
        if all(np.allclose(cell.places, wanted, atol=_SAME_SHARE) for cell in cells if cell.hinges):
            return name
    notes.append(f"the {every} hinges between two holes are put at even distances")
    return "even"


def _same_cells(one: _ChainCell, other: _ChainCell) -> bool:
    """Return whether two cells may be of one segment."""
    if len(one.hinges) != len(other.hinges) or abs(one.length_m / other.length_m - 1.0) > _SAME_SHARE:
        return False
    if not np.allclose(one.places, other.places, atol=_SAME_SHARE):
        return False
    return all(_alike(a, b) for a, b in zip(one.hinges, other.hinges, strict=True))


def _alike(before: Hinge, after: Hinge) -> bool:
    """Return whether two hinges have the same axes, springs and angles at rest."""
    if before.stiffness.keys() != after.stiffness.keys():
        return False
    pairs = ((before.stiffness[axis], after.stiffness[axis]) for axis in before.stiffness)
    bent = all(abs(before.rest[axis] - after.rest[axis]) < 1e-6 for axis in before.rest)
    return bent and all(abs(one - other) <= _ALIKE * max(one, other) for one, other in pairs)


def _mean(part: Sequence[Hinge], axis: str) -> float:
    return float(np.mean([item.stiffness.get(axis, 0.0) for item in part]))


def _rest(part: Sequence[Hinge], axis: str) -> float:
    return float(np.mean([item.rest.get(axis, 0.0) for item in part]))


def _cubic(part: Sequence[Hinge], axis: str) -> float:
    return float(np.mean([item.cubic.get(axis, 0.0) for item in part]))


def _round(value: float) -> float:
    """Return a number without the dust of its arithmetic."""
    return float(f"{value:.9g}")


def _tendon(
    routed: Routed, segments: Sequence[Segment], cells: Sequence[_ChainCell], numbers: Sequence[int]
) -> Tendon:
    last = min(
        (k for k, cell in enumerate(cells) if cell.ends),
        key=lambda k: abs(cells[k].high_m - routed.holes[-1][1]),
    )
    return Tendon(
        routed.name,
        _round(routed.radius_m),
        _round(routed.angle_rad),
        segments[numbers[last]].name,
        stiffness_N_per_m=math.inf if routed.stiffness_N_per_m is None else routed.stiffness_N_per_m,
    )


def _with_masses(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    frame: Frame,
    hinges: Sequence[Hinge],
    segments: tuple[Segment, ...],
    cells: Sequence[_ChainCell],
    numbers: Sequence[int],
) -> tuple[tuple[Segment, ...], str, float]:
    """Return segments with masses, where these are, and how far they are off what each hinge carries [m]."""
    own = np.zeros((len(hinges), 2))  # mass [kg], and its moment about the first hinge [kg m]
    for body in range(1, model.nbody):
        link = hinge_of(model, hinges, body)
        if link:
            mass = float(model.body_mass[body])
            own[link - 1] += mass, mass * float(frame.place(data.xipos[body])[2])
    heights = [item.z_m for item in hinges]
    lengths = np.array([segment.length_m for segment in segments])
    tries = []
    for where in ("along", "faces"):
        share = np.zeros((*own.shape, len(segments)))
        link = 0
        for cell, number in zip(cells, numbers, strict=True):
            parts = len(cell.hinges) or 1
            for part in range(parts):
                low, high = (cell.low_m + cell.length_m * (part + k) / parts for k in (0, 1))
                link += bool(cell.hinges)
                carried = [link - 1] if where == "faces" else range(len(hinges))
                for k in carried:
                    if k < 0:
                        continue
                    if where == "faces":
                        length, middle = high - low, high
                    else:
                        end = heights[k + 1] if k + 1 < len(hinges) else cells[-1].high_m
                        bottom, top = max(low, heights[k]), min(high, end)
                        length, middle = max(top - bottom, 0.0), 0.5 * (top + bottom)
                    share[k, :, number] += length / lengths[number] * np.array([1.0, middle])
        mass_kg, _ = nnls(share[:, 0], own[:, 0])
        off = np.abs(share @ mass_kg - own) @ (np.ptp(heights), 1.0)
        tries.append((float(off.sum()), where, mass_kg))
    total = max(float(own[:, 0].sum()), _LEAST_MASS_KG)
    best = min(tries, key=lambda item: round(item[0] / (total * lengths.sum()), 9))
    kept = [
        replace(segment, mass_kg=max(_round(float(mass)), _LEAST_MASS_KG))
        for segment, mass in zip(segments, best[2], strict=True)
    ]
    return tuple(kept), best[1], best[0] / total


def _outer_radius(model: mujoco.MjModel, routed: Sequence[Routed]) -> float:
    kinds = (mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_SPHERE)
    moving = model.body_weldid[model.geom_bodyid] > 0
    round_ones = np.isin(model.geom_type, [int(kind) for kind in kinds]) & moving
    sizes = model.geom_size[round_ones, 0]
    holes = _WIDER * max((item.radius_m for item in routed), default=1e-3)
    return float(max(sizes.max(initial=0.0), holes))


def _dynamics(hinges: Sequence[Hinge], notes: list[str]) -> Dynamics:
    """Return the damping as the material's, which acts in motion; rows that are held come to rest as ever."""
    times = [item.damping[axis] / item.stiffness[axis] for item in hinges for axis in item.stiffness]
    time_s = float(np.median(times))
    if max(times) > 0.0:
        notes.append(f"damping: {time_s:.3g} s of the stiffness, as the material's, in motion")
    return Dynamics(damping_time_s=time_s)


def _left_out(model: mujoco.MjModel) -> list[str]:
    gravity = ", ".join(f"{value:g}" for value in model.opt.gravity)
    notes = [
        "inputs are tensions or displacements of the tendons, not the file's controls",
        f"gravity is not a robot's: the file has {gravity} m/s^2",
        "friction.mu = 0: MJCF knows none at holes",
    ]
    for what, there in (
        ("friction of joints", bool(model.dof_frictionloss.any())),
        ("limits of joints", bool(model.jnt_limited.any())),
        ("quadratic terms of springs", _has_terms(model, "jnt_stiffnesspoly")),
        ("plastic springs", _has_terms(model, "jnt_springyield")),
        ("springs of tendons", bool(model.tendon_stiffness.any())),
        ("tendons that couple joints", model.ntendon > 0 and bool((model.wrap_type == 1).any())),
        ("equality constraints", bool(model.neq)),
    ):
        if there:
            notes.append(f"{_LEFT_OUT}: {what}")
    return notes


def _has_terms(model: mujoco.MjModel, name: str) -> bool:
    """Return whether joints have such a term, of several the first; MuJoCo before 4 has none."""
    terms = getattr(model, name, None)
    return terms is not None and bool(np.any(terms[:, 0] if np.ndim(terms) > 1 else terms))


def _frame_note(model: mujoco.MjModel, data: mujoco.MjData, frame: Frame, base_m: float) -> str:
    """Return how the robot's base frame lies in that of the body that carries the chain."""
    own = data.xmat[frame.base].reshape(3, 3)
    shift_m = own.T @ (frame.origin + base_m * frame.axes[:, 2] - data.xpos[frame.base])
    turn = Rotation.from_matrix(own.T @ frame.axes).as_rotvec(degrees=True)
    at_world = not data.xpos[frame.base].any() and np.allclose(own, np.eye(3))
    text = (
        "base = file's" if at_world else f"base = file's (body {model.body(frame.base).name or frame.base})"
    )
    if np.linalg.norm(shift_m) > 1e-6:
        text += f", shifted by ({', '.join(f'{value:g}' for value in (1e3 * shift_m).round(3) + 0.0)}) mm"
    angle = float(np.linalg.norm(turn))
    if angle > 0.01:
        axis = (turn / angle).round(3) + 0.0
        along = np.flatnonzero(np.abs(axis) > 0.999)
        if len(along):
            return f"{text}, turned by {angle * axis[along[0]]:.3g} deg about {'xyz'[along[0]]}"
        return f"{text}, turned by {angle:.3g} deg about ({', '.join(f'{value:g}' for value in axis)})"
    return text


# ----------------------------------------------------------------------------------------------------
# A continuum robot from somebody's MJCF: a chain of hinges with tendons becomes a robot of this package.
