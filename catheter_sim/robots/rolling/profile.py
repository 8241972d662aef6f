"""The profile of a joint, seen closely: its two arcs, the face on which they roll, and the gap between."""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.kind import CloseUp
from catheter_sim.mjcf.names import face, link
from catheter_sim.mjcf.solids import Colour
from catheter_sim.robots.rolling.description import rolling_joints
from catheter_sim.robots.rolling.picture import profile_height
from catheter_sim.robots.rolling.spec import RollingRobot

_SEEN = 3.0  # from top to bottom, over the links' outer radius
_ARC_POINTS = 24  # of each arc's line
_LARGER: Colour = (0.45, 0.10, 0.55, 1.0)
_SMALLER: Colour = (0.0, 0.45, 0.30, 1.0)
_FLAT: Colour = (0.10, 0.11, 0.13, 1.0)


def close_up(robot: RollingRobot, model: mujoco.MjModel, data: mujoco.MjData, qpos: Array) -> CloseUp:
    """Return the joint that has turned most at `qpos`, seen along its axis, with its profile as lines.

    The upper link's lower face is its two arcs, each in its colour; the lower link's face is flat.
    """
    joints = rolling_joints(robot)
    turned = [abs(float(qpos[model.joint(joint.name).qposadr[0]])) for joint in joints]
    joint = joints[int(np.argmax(turned))]
    upper = model.body(link(joint.index)).id
    lower = int(model.body_parentid[upper])
    flat_m = float(model.site(face(joint.index - 1)).pos[2]) if joint.index > 1 else 0.0
    outer = joint.segment.outer_radius_m
    positive, negative = (np.linspace(joint.line_m, end, _ARC_POINTS) for end in (outer, -outer))

    def line(body: int, u: Array, z: Array, colour: Colour) -> tuple[Array, Colour]:
        local = np.zeros((len(u), 3))
        local[:, joint.axis], local[:, 2] = u, z
        return np.asarray(local @ data.xmat[body].reshape(3, 3).T + data.xpos[body]), colour

    radii = joint.radius_positive_m, joint.radius_negative_m
    colours = (_LARGER, _SMALLER) if radii[0] >= radii[1] else (_SMALLER, _LARGER)
    shown = " and ".join(f"{1e3 * radius:.3g}" for radius in sorted(set(radii), reverse=True))
    return CloseUp(
        middle=data.xpos[upper].copy(),
        across=data.xmat[upper].reshape(3, 3)[:, 1 - joint.axis].copy(),
        height_m=_SEEN * outer,
        lines=(
            line(upper, positive, profile_height(joint, positive), colours[0]),
            line(upper, negative, profile_height(joint, negative), colours[1]),
            line(lower, np.array([-outer, outer]), np.full(2, flat_m), _FLAT),
        ),
        words=(f"joint {joint.index}", f"arcs of {shown} mm"),
    )
