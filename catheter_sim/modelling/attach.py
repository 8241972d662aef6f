"""A robot in somebody else's scene, and surroundings for a robot."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias, get_args

import mujoco
import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.catalogue import robot_of
from catheter_sim.channels import checked_actuation
from catheter_sim.core.inputs import driven_by
from catheter_sim.core.law import BASE
from catheter_sim.core.robot import Dynamics, RobotSpec
from catheter_sim.effects.apply import wholly_built_in
from catheter_sim.errors import InputError, cut, require_type
from catheter_sim.mjcf import parts
from catheter_sim.mjcf.document import Element
from catheter_sim.modelling.build import remembered_mjcf

# ----------------------------------------------------------------------------------------------------
# A robot in surroundings as MJCF: its base on a slide, what touches, what is touched, what is drawn.
#
# The robot's model (`catheter_sim.modelling.build`) is not changed otherwise; names and order of its parts
# stay, and what is added to its actuators comes last. The robot touches the surroundings, and nothing else
# touches anything. Contacts have no friction: wet tissue.

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

    `insertion` slides along the base's z axis and `roll`, if asked for, turns about it. Each has an actuator
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


# ----------------------------------------------------------------------------------------------------
# Puts a robot into somebody else's MuJoCo model: onto a moving arm, or beside another robot.
#
#     spec = mujoco.MjSpec.from_file("arm.xml")               # timestep and integrator as the robot's
#     attach(spec, robot, spec.site("flange"), "scope_")
#     model = spec.compile()
#     data = mujoco.MjData(model)
#     scope = Simulator(robot, model=model, data=data, prefix="scope_")
#
# All names of the robot's elements begin with the prefix. They hang on a body `<prefix>base_frame`, whose
# frame is the robot's base frame: z along the robot's axis, origin in the middle of its base. Its geoms
# touch nothing, as in the robot's own model; its lights, cameras and background stay behind.

Place: TypeAlias = mujoco.MjsFrame | mujoco.MjsBody | mujoco.MjsSite


def attach(
    spec: mujoco.MjSpec,
    robot: RobotSpec | str | os.PathLike[str],
    frame: Place,
    prefix: str,
    actuation: str | None = None,
) -> None:
    """Attach `robot` to a model that is not compiled yet.

    A model without joints takes the robot's time step and integrator over. Any other must have the robot's
    integrator, and a time step that is not longer than the robot's: the laws that run beside a step are made
    for these.

    The robot touches nothing: its geoms have no contacts. A Python warning says so where other geoms of the
    model collide.

    Args:
        spec: the model; changed in place.
        robot: the robot, its id or its file; such of its `effects` as act on the robot itself are built in.
        frame: a frame, body or site of `spec` that becomes the robot's base frame.
        prefix: of the names of all its elements; no name in `spec` may begin with it.
        actuation: "tension" or "displacement"; default: the robot's own.

    Raises:
        InputError: an argument is of another kind, the prefix is empty or taken, the model's time step or
            integrator does not fit, or an effect acts on inputs or outputs.

    Examples:
        >>> import catheter_sim as cs
        >>> import mujoco
        >>> robot, spec = cs.load_robot("neuroendoscope_section"), mujoco.MjSpec()
        >>> spec.option.gravity = [0.0, 0.0, 0.0]
        >>> cs.attach(spec, robot, spec.worldbody.add_frame(pos=[0.0, 0.0, 0.2]), "scope_")
        >>> scope = cs.Simulator(robot, model=spec.compile(), prefix="scope_")
        >>> scope.set_inputs([0.4, 0.0])
        >>> scope.settle()
        True
        >>> (1e3 * scope.posture().p_w[-1]).round(1)
        array([40.5,  0. , 36. ])
    """
    robot = robot_of(robot)
    require_type("spec", spec, mujoco.MjSpec, "a mujoco.MjSpec that is not compiled yet")
    require_type("frame", frame, get_args(Place), "a frame, body or site of the spec")
    require_type("prefix", prefix, str, "a text")
    _require_free(spec, prefix)
    actuation = checked_actuation(robot, actuation)
    if robot.effects:
        robot = wholly_built_in(driven_by(robot, actuation))
    child = mujoco.MjSpec.from_string(remembered_mjcf(robot, actuation))
    _fit_options(spec, child, robot)
    _leave_behind(child)
    _take_settings(child, spec)
    base = _base_at(frame)
    base.name = prefix + BASE
    # A body of its own, so that no frame is worked into the links' places, which laws move.
    spec.attach(child, prefix=prefix, frame=base.add_frame())
    colliding = [geom.name for geom in spec.geoms if geom.contype or geom.conaffinity]
    if colliding:
        named = ", ".join(name for name in colliding if name) or "they have no names"
        warnings.warn(
            "attach: robots touch nothing: this one goes through every geom of the scene that collides "
            f"({cut(named, 100)})",
            stacklevel=2,
        )


def _require_free(spec: mujoco.MjSpec, prefix: str) -> None:
    """Raise `InputError` where elements of two robots could not be told apart."""
    if not prefix:
        raise InputError("prefix: must not be empty: the names of the robot's elements begin with it")
    bodies = [body.name for body in spec.bodies]
    others = [name.removesuffix(BASE) for name in bodies if name.endswith(BASE)]
    kinds = spec.bodies, spec.joints, spec.sites, spec.tendons, spec.actuators, spec.geoms
    taken = [item.name for items in kinds for item in items if item.name.startswith(prefix)]
    inside = [other for other in others if prefix.startswith(other)]
    if taken or inside:
        shown = taken[0] if taken else inside[0] + BASE
        raise InputError(f"prefix {prefix!r}: not to be told apart from {shown!r} of the model")


def _fit_options(spec: mujoco.MjSpec, child: mujoco.MjSpec, robot: RobotSpec) -> None:
    """Let the model's time step and integrator be such as the robot needs, or raise `InputError`."""
    if not spec.joints:
        spec.option.timestep, spec.option.integrator = child.option.timestep, child.option.integrator
        return
    wanted = mujoco.mjtIntegrator(child.option.integrator)
    if spec.option.integrator != wanted:
        name = wanted.name.removeprefix("mjINT_").lower()
        raise InputError(f"{robot.name}: needs the integrator {name!r}: set spec.option.integrator")
    if spec.option.timestep > child.option.timestep:
        raise InputError(
            f"{robot.name}: needs a time step of at most {child.option.timestep:g} s, not "
            f"{spec.option.timestep:g} s: set spec.option.timestep"
        )


def _leave_behind(child: mujoco.MjSpec) -> None:
    """Take out of a robot's own model what belongs to its scene, and let its geoms touch nothing."""
    skies = [item for item in child.textures if item.type == mujoco.mjtTexture.mjTEXTURE_SKYBOX]
    for item in [*child.lights, *child.cameras, *skies]:
        child.delete(item)
    for geom in child.geoms:
        geom.contype = geom.conaffinity = 0


def _take_settings(child: mujoco.MjSpec, spec: mujoco.MjSpec) -> None:
    """Give a robot's own model the settings of `spec`, which hold for all: MuJoCo warns of others."""
    child.option.timestep, child.option.gravity = spec.option.timestep, spec.option.gravity
    child.visual.map.zfar = spec.visual.map.zfar


def _base_at(place: Place) -> mujoco.MjsBody:
    """Return a new body whose frame is that of `place`."""
    if isinstance(place, mujoco.MjsBody):
        return place.add_body()
    body = place.parent.add_body()
    if isinstance(place, mujoco.MjsFrame):
        body.set_frame(place)
        return body
    if place.frame is not None:
        body.set_frame(place.frame)
    body.pos, body.quat = place.pos, place.quat
    for name in ("type", "axisangle", "xyaxes", "zaxis", "euler"):  # other ways to say how it is turned
        setattr(body.alt, name, getattr(place.alt, name))
    return body
