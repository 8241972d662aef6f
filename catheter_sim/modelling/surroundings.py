"""A robot in surroundings as MJCF: its base on a slide, what touches, what is touched, what is drawn.

The robot's model (`catheter_sim.modelling.build`) is not changed otherwise; names and order of its parts
stay, and what is added to its actuators comes last. The robot touches the surroundings, and nothing else
touches anything. Contacts have no friction: wet tissue.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from catheter_sim.core.robot import Dynamics
from catheter_sim.mjcf.parts import inline
from catheter_sim.mjcf.solids import Array

INSERTION, ROLL = "insertion", "roll"  # joints under the robot's base, and the actuators that move them
CARRIER = "catheter"  # the body that carries the robot
TOUCH = "touch_"  # what the names of the robot's geoms that touch begin with
SEEN_GROUP = "2"
NO_MASS = {"pos": "0 0 0", "mass": "1e-9", "diaginertia": "1e-13 1e-13 1e-13"}
_TOUCH_GROUP = "4"
_CONTACT = {"condim": "1", "mass": "0", "group": _TOUCH_GROUP}  # no friction
# Drives that nothing bends, and the scale of their damping: of the slide [N/m], of the roll [N m/rad].
_STIFFNESS = {INSERTION: (1e6, 1e3), ROLL: (1e2, 1e-1)}


def carry(root: ElementTree.Element, dynamics: Dynamics, base: Array, roll: bool = False) -> None:
    """Move what is the robot's into the body `catheter`, whose joints `insertion` and `roll` move it.

    `insertion` slides along the base's z axis and `roll`, if asked for, turns about it; each has an actuator
    of its own name, at the end of the list: control in m or rad from where the base stands in the model.

    Args:
        root: the robot's model; contacts are switched on, and cameras taken out, in it.
        dynamics: of the robot.
        base: where the base stands, shape (4, 4).
        roll: whether it can be turned.
    """
    part(root, "option/flag").set("contact", "enable")
    world = part(root, "worldbody")
    body = ElementTree.Element("body", name=CARRIER, pos=text(base[:3, 3]), quat=quaternion(base[:3, :3]))
    for name in (INSERTION, ROLL) if roll else (INSERTION,):
        drive, scale = _STIFFNESS[name]
        ElementTree.SubElement(
            body,
            "joint",
            name=name,
            type="slide" if name == INSERTION else "hinge",
            axis="0 0 1",
            damping=repr(scale * dynamics.relaxation_time_s),
            armature=repr(scale * dynamics.inertia_time_s**2),
        )
        ElementTree.SubElement(
            part(root, "actuator"),
            "general",
            name=name,
            joint=name,
            biastype="affine",
            gainprm=repr(drive),
            biasprm=f"0 {-drive!r} 0",
        )
    ElementTree.SubElement(body, "inertial", NO_MASS)
    for child in list(world):
        if child.tag == "camera":
            world.remove(child)  # they look at the robot where it would lie otherwise
        elif child.tag != "light":
            world.remove(child)
            body.append(child)
    world.append(body)


def touching(body: ElementTree.Element, **shape: str) -> None:
    """Add a geom of the robot."""
    ElementTree.SubElement(body, "geom", _CONTACT | shape, contype="1", conaffinity="0")


def touched(body: ElementTree.Element, **shape: str) -> ElementTree.Element:
    """Add a geom of the surroundings."""
    return ElementTree.SubElement(body, "geom", _CONTACT | shape, contype="0", conaffinity="1")


def touched_block(
    root: ElementTree.Element, name: str, corners: Array, facing: Array | None = None, **shape: str
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
    ElementTree.SubElement(part(root, "asset"), "mesh", name=name, vertex=text(corners))
    if facing is not None:
        shape["user"] = text(facing)
    touched(part(root, "worldbody"), name=name, type="mesh", mesh=name, **shape)


def add_mesh(root: ElementTree.Element, name: str, mesh: trimesh.Trimesh, rgba: str) -> None:
    """Add a fixed mesh that is only drawn."""
    vertex, face = inline(mesh)
    ElementTree.SubElement(part(root, "asset"), "mesh", name=name, vertex=vertex, face=face, inertia="shell")
    look = {"rgba": rgba, "group": SEEN_GROUP, "contype": "0", "conaffinity": "0", "mass": "0"}
    ElementTree.SubElement(part(root, "worldbody"), "geom", look, name=name, type="mesh", mesh=name)


def part(root: ElementTree.Element, path: str) -> ElementTree.Element:
    """Return the element at `path`, which is there."""
    found = root.find(path)
    assert found is not None, path
    return found


def text(values: Sequence[float] | Array) -> str:
    """Return numbers as MJCF has them."""
    return " ".join(f"{value:.9g}" for value in np.ravel(values))


def quaternion(R: Array) -> str:
    """Return a rotation matrix as MJCF has it."""
    return text(Rotation.from_matrix(R).as_quat(scalar_first=True))
