"""How far a robot that was read from MJCF is from its source: both bent in MuJoCo, by the same tensions.

Each tendon in turn bends the chain by some 75 deg, with the file's gravity. A posture at rest is where
springs, tendons and weight balance: Newton's and Krylov's method on MuJoCo's own forces, the tension brought
on step by step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.optimize import NoConvergence, newton_krylov
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError
from catheter_sim.kinds.continuum.from_mjcf.hinges import Frame, Hinge
from catheter_sim.kinds.continuum.mjcf.chain import add_chain, add_tendons
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.mjcf import names
from catheter_sim.mjcf.document import Element

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
        _rest(ours)
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
        raise InputError(f"{where}: the robot would be {text}; at most 2 % is taken: {why}")
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


def _rest(chain: _Chain) -> None:
    chain.data.qpos[:] = chain.model.qpos_spring


def _bent(chain: _Chain, tendon: int, tension: Array) -> list[float]:
    """Bend a chain by one tendon by `_BEND_RAD`, or as far as it goes; return the tensions on the way [N]."""
    _rest(chain)
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
