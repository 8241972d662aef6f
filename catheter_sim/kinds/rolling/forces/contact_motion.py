"""Inertia of links that roll: what a hinge that stands still for a step leaves out, compiled.

MuJoCo takes a joint's hinge for fixed in the link below. A contact moves along the flat there at R theta', so
that everything beyond it is accelerated by R theta'^2 more, along the flat's normal: as the point of a wheel
that touches the road is, toward the wheel's centre. Without this, free motion would not keep its energy.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.core.law import Law, RobotInModel, Step
from catheter_sim.kinds.rolling.forces.rods import joint_ids
from catheter_sim.kinds.rolling.layout import rolling_joints
from catheter_sim.kinds.rolling.spec import RollingRobot
from catheter_sim.kinds.rolling.theory.chain import rolling_chain
from catheter_sim.mechanics.compiled import compiled_in_place


class ContactMotion(Law):
    """Adds the forces of inertia that come from the contacts' own motion."""

    def __init__(self, robot: RollingRobot, place: RobotInModel) -> None:
        model, chain, ids = place.model, rolling_chain(robot), joint_ids(robot, place)
        self._model, self._joint = model, ids
        self._radius = np.stack([chain.radius_negative, chain.radius_positive], axis=1)
        self._qpos = model.jnt_qposadr[ids].astype(np.int64)
        self._dof = model.jnt_dofadr[ids].astype(np.int64)
        links = [f"link_{joint.index}" for joint in rolling_joints(robot)]
        self._body = np.array([place.body(name).id for name in links], np.int64)
        self._below = model.body_parentid[self._body].astype(np.int64)

    def between(self, step: Step) -> None:
        """Add the forces where the robot moves."""
        if not step.moving:
            return
        data = step.data
        add_inertia_of_contacts(
            data.qpos,
            data.qvel,
            self._radius,
            self._qpos,
            self._dof,
            self._joint,
            self._body,
            self._below,
            self._model.body_mass,
            data.xipos,
            data.xmat,
            data.xanchor,
            data.xaxis,
            data.qfrc_applied,
        )


@compiled_in_place
def add_inertia_of_contacts(
    qpos: Array,
    qvel: Array,
    radius: Array,
    qpos_index: Index,
    dof: Index,
    joint: Index,
    body: Index,
    below: Index,
    mass: Array,
    centre: Array,
    turned: Array,
    anchor: Array,
    axis: Array,
    applied: Array,
) -> None:
    """Take m R theta'^2, along the normal of each flat below a link, from the forces on all beyond it.

    Args:
        qpos, qvel: MuJoCo's; `qpos_index` and `dof` pick the bends, base to tip, shape (n,).
        radius: of the arc where a joint leans to minus and to plus, shape (n, 2) [m].
        joint, body, below: of each the joint, the link and what it rolls on, in MuJoCo, shape (n,).
        mass, centre, turned: of MuJoCo's bodies: mass, centre of mass and orientation in the world.
        anchor, axis: of MuJoCo's joints, in the world.
        applied: in and out: shape (nv,) [N m].
    """
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
