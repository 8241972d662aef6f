"""A robot in surroundings as MJCF: its base on a slide, what touches, what is touched, what is drawn.

The robot's model (`catheter_sim.modelling.build`) is not changed otherwise; names and order of its parts
stay, and what is added to its actuators comes last. The robot touches the surroundings, and nothing else
touches anything. Contacts have no friction: wet tissue.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.robot import Dynamics
from catheter_sim.mjcf import parts
from catheter_sim.mjcf.document import Element

INSERTION, ROLL = "insertion", "roll"  # joints under the robot's base, and the actuators that move them
CARRIER = "catheter"  # the body that carries the robot
TOUCH = "touch_"  # what the names of the robot's geoms that touch begin with
NO_MASS: Mapping[str, Any] = {"pos": (0, 0, 0), "mass": 1e-9, "diaginertia": (1e-13, 1e-13, 1e-13)}
_TOUCH_GROUP = 4
_CONTACT: Mapping[str, Any] = {"condim": 1, "mass": 0, "group": _TOUCH_GROUP}  # no friction
# Drives that nothing bends, and the scale of their damping: of the slide [N/m], of the roll [N m/rad].
_STIFFNESS = {INSERTION: (1e6, 1e3), ROLL: (1e2, 1e-1)}


def carry(root: Element, dynamics: Dynamics, base: Array, roll: bool = False) -> None:
    """Move what is the robot's into the body `catheter`, whose joints `insertion` and `roll` move it.

    `insertion` slides along the base's z axis and `roll`, if asked for, turns about it; each has an actuator
    of its own name, at the end of the list: control in m or rad from where the base stands in the model.

    Args:
        root: the robot's model; contacts are switched on, and cameras taken out, in it.
        dynamics: of the robot.
        base: where the base stands, shape (4, 4).
        roll: whether it can be turned.
    """
    root.part("option").part("flag").set(contact="enable")
    world = root.part("worldbody")
    body = Element("body", name=CARRIER, pos=text(base[:3, 3]), quat=quaternion(base[:3, :3]))
    for name in (INSERTION, ROLL) if roll else (INSERTION,):
        drive, scale = _STIFFNESS[name]
        body.add(
            "joint",
            name=name,
            type="slide" if name == INSERTION else "hinge",
            axis=(0, 0, 1),
            damping=scale * dynamics.relaxation_time_s,
            armature=scale * dynamics.inertia_time_s**2,
        )
        drives = root.part("actuator")
        bias = (0, -drive, 0)
        drives.add("general", name=name, joint=name, biastype="affine", gainprm=drive, biasprm=bias)
    body.add("inertial", **NO_MASS)
    for child in list(world.children):
        if child.tag == "camera":
            child.remove()  # they look at the robot where it would lie otherwise
        elif child.tag != "light":
            body.append(child)
    world.append(body)


def touching(body: Element, **shape: Any) -> None:
    """Add a geom of the robot."""
    body.add("geom", **{**_CONTACT, **shape}, contype=1, conaffinity=0)


def touched(body: Element, **shape: Any) -> Element:
    """Add a geom of the surroundings."""
    return body.add("geom", **{**_CONTACT, **shape}, contype=0, conaffinity=1)


def touched_block(
    root: Element, name: str, corners: Array, facing: Array | None = None, **shape: Any
) -> None:
    """Add a fixed convex block of the surroundings, not drawn.

    Args:
        root: the model.
        name: of the geom and its mesh.
        corners: shape (n, 3) [m].
        facing: unit normal of its free face, where the others lie against other blocks, shape (3,); it goes
            into the geom's user data.
        shape: further attributes of the geom.
    """
    # the vertices alone: the compiler takes their convex hull
    root.part("asset").add("mesh", name=name, vertex=text(corners))
    if facing is not None:
        shape["user"] = text(facing)
    touched(root.part("worldbody"), name=name, type="mesh", mesh=name, **shape)


def add_mesh(root: Element, name: str, mesh: trimesh.Trimesh, rgba: str) -> None:
    """Add a fixed mesh that is only drawn."""
    parts.add_mesh(root, name, mesh, shell=True)
    root.part("worldbody").add("geom", name=name, mesh=name, rgba=rgba, **parts.SEEN)


def text(values: Sequence[float] | Array) -> str:
    """Return numbers as surroundings have them, with nine digits."""
    return " ".join(f"{value:.9g}" for value in np.ravel(values))


def quaternion(R: Array) -> str:
    """Return a rotation matrix as MJCF has it."""
    return text(Rotation.from_matrix(R).as_quat(scalar_first=True))
