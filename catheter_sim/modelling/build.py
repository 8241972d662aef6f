"""Any robot as MJCF: what all kinds share, the scene around it, and models that are kept."""

from __future__ import annotations

import logging
import math
import re
import warnings
from dataclasses import dataclass
from threading import Lock

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.motion import IMPLICIT_SPRINGS, in_motion
from catheter_sim.core.posture import elements_of, offsets_of
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, RobotNote
from catheter_sim.mjcf import names
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.parts import add_site
from catheter_sim.robots import face_of, kind_of

# ----------------------------------------------------------------------------------------------------
# How a robot's model is lit and seen: materials, light, background and cameras, sized to the robot.

FOVY_DEG = 20.0  # narrow: little perspective, so that what is near is hardly larger than what is far
SIDE_FOVY_DEG = 6.0  # almost parallel rays, to measure in the picture
LARGEST_IMAGE = (1920, 1080)  # of the offscreen buffer in the model file


@dataclass(frozen=True)
class View:
    """A camera that stands still.

    Attributes:
        name: the camera's name in the model.
        target: the point in the middle of its picture, base frame [m].
        backward: unit vector from the target to the camera.
        height: how much the picture shows from top to bottom, at the target [m].
        fovy_deg: angle between the picture's top and bottom edge [deg].
    """

    name: str
    target: Array
    backward: Array
    height: float
    fovy_deg: float = FOVY_DEG

    @property
    def position(self) -> Array:
        """Where the camera stands, base frame, shape (3,) [m]."""
        return self.target + self.backward * self.height / 2.0 / math.tan(math.radians(self.fovy_deg / 2.0))

    @property
    def axes(self) -> Array:
        """The picture's right and up directions, base frame, shape (2, 3); +z points up."""
        right = np.cross((0.0, 0.0, 1.0), self.backward)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(self.backward, right)])


def robot_length(robot: RobotSpec) -> float:
    """Return the length of the straight robot, its tubes fully advanced [m]."""
    return kind_of(robot).model.length_m(robot)


def views(robot: RobotSpec) -> tuple[View, ...]:
    """Return the cameras: `side` on the xz plane, `overview` from above its front, `detail` of the base.

    `side` and `overview` hold everything that the robot reaches up to a half circle to either side.
    """
    length = robot_length(robot)
    radius = max(segment.outer_radius_m for segment in robot.segments)
    middle = np.array([0.0, 0.0, 0.46 * length])
    oblique = np.array([0.55, -1.0, 0.38])
    level, close = kind_of(robot).model.close_up(robot)
    return (
        View("side", middle, np.array([0.0, -1.0, 0.0]), 1.14 * length + 4.0 * radius, SIDE_FOVY_DEG),
        View("overview", middle, oblique / np.linalg.norm(oblique), 1.2 * length + 4.0 * radius),
        View("detail", np.array([0.0, 0.0, level]), oblique / np.linalg.norm(oblique), close),
    )


def add_scene(root: Element, robot: RobotSpec) -> None:
    """Add visual settings, materials, background, lights and cameras for `robot` to the model `root`."""
    length = robot_length(robot)
    root.add("statistic", extent=1.2 * length, center=(0.0, 0.0, 0.46 * length))
    visual = root.add("visual")
    width, height = LARGEST_IMAGE
    visual.add("global", fovy=FOVY_DEG, offwidth=width, offheight=height)  # fovy: of the free camera
    # Slices of a tendon's round: tendons are many, and thin.
    visual.add("quality", offsamples=4, numslices=12, numstacks=4)
    visual.add("headlight", ambient=[0.38] * 3, diffuse=[0.25] * 3, specular=[0.0] * 3)
    # The nearest is 0.01 of the extent away: near enough for a close look at one cell.
    visual.add("map", znear=0.01, zfar=20.0)
    sky = {"builtin": "gradient", "rgb1": (0.98, 0.985, 0.99), "rgb2": (0.80, 0.84, 0.88)}
    asset = root.part("asset")
    asset.add("texture", name="background", type="skybox", width=256, height=1536, **sky)
    asset.add("material", name="metal", specular=0.9, shininess=0.7, rgba=[0.60, 0.63, 0.68, 1.0])
    asset.add("material", name="plastic", specular=0.25, shininess=0.2, rgba=[0.86, 0.76, 0.60, 1.0])
    for name, direction, strength in (("key", (0.5, 0.9, -0.9), 0.55), ("fill", (-0.9, 0.6, 0.3), 0.2)):
        toward = np.array(direction) / np.linalg.norm(direction)
        root.part("worldbody").add(
            "light",
            name=name,
            directional=True,
            castshadow=False,  # at this scale the shadow map is coarse and slow
            pos=np.array([0.0, 0.0, 0.5 * length]) - 1.5 * length * toward,
            dir=toward,
            diffuse=[strength] * 3,
            specular=[0.3 * strength] * 3,
            ambient=[0.0] * 3,
        )
    for view in views(robot):
        root.part("worldbody").add(
            "camera", name=view.name, pos=view.position, xyaxes=view.axes.ravel(), fovy=view.fovy_deg
        )


# ----------------------------------------------------------------------------------------------------
# Any robot as MJCF: what all kinds share; its kind adds the rest (`model.py`).

_LOAD_RADIUS_M = 1e-4  # of gyration of a load at the tip: nothing beside its distance from any hinge
_LEAST_KG = float(mujoco.mjMINVAL)  # MuJoCo takes no body of less mass
_LEAST_KG_M2 = 10.0 * float(mujoco.mjMINVAL)  # it takes a tenth, but does not move it
_NOTE = re.compile(r'<text name="raised" data="([^"]*)"')
# On its own MuJoCo would write warnings into a file in the folder where the user works.
mujoco.set_mju_user_warning(logging.getLogger("mujoco").warning)


def build_mjcf(
    robot: RobotSpec, actuation: str | None = None, friction_tails: bool = False, motion: bool = False
) -> str:
    """Return a self-contained MJCF model of `robot` as text.

    An actuator's control is the tendon's tension [N], or its displacement [m] from just taut at rest
    (pull positive); neither can push. Names are explained in `mjcf.names` and in the
    module `mjcf.chain` of each kind.

    Args:
        robot: the robot; its `effects` are not read.
        actuation: "tension" or "displacement"; default: the robot's own.
        friction_tails: carry the elements of the reference friction law. The shipped law needs none:
            it runs beside the model (`catheter_sim.simulation.friction`).
        motion: let the model move as the robot does, with its masses' inertia and its physical damping
            (`core.motion`); otherwise it comes to rest soon, by the aids of `core.robot.Dynamics`.

    Raises:
        InputError: MuJoCo refuses the model, or the robot knows no such actuation.

    Warns:
        RobotNote: inertias or masses were raised to the least that MuJoCo takes.
    """
    actuation = actuation or robot.actuation
    integrator, servo_lag_s = IMPLICIT_SPRINGS, 0.0
    if motion:
        integration = kind_of(robot).model.integration(robot, actuation)
        integrator, servo_lag_s = integration.integrator, robot.dynamics.servo_lag_s
        robot = in_motion(robot, integration)
    root = Element("mujoco", model=robot.name)
    # Bounds for models that kinds compile on the way; what is raised in the end, `_raise` says.
    root.add("compiler", angle="radian", autolimits=True, boundmass=_LEAST_KG, boundinertia=_LEAST_KG_M2)
    timestep_s = robot.dynamics.timestep_s
    option = root.add("option", timestep=timestep_s, integrator=integrator, gravity=(0.0, 0.0, 0.0))
    option.add("flag", contact="disable")
    root.part("custom").add("numeric", name="friction_mu", data=[robot.friction.mu])
    add_scene(root, robot)
    kind_of(robot).model.add(root, robot, actuation)
    _add_markers(root, robot)
    if robot.tip_mass_kg > 0.0:
        _hang_on_tip(root, robot.tip_mass_kg)
    if friction_tails:
        face_of(robot, "friction_tails", "reference friction law").add(root, robot)
    if motion:
        _resist(root, robot, servo_lag_s)
    _raise(root)
    text = taken_by_mujoco(root, robot)
    tell_what_was_raised(robot, text)
    return text


def taken_by_mujoco(root: Element, robot: RobotSpec) -> str:
    """Return the text of a model of `robot`.

    Raises:
        InputError: MuJoCo refuses it.
    """
    text = root.text()
    try:
        mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        raise InputError(f"{robot.name}: MuJoCo refuses the model: {' '.join(str(error).split())}") from None
    return text


def tell_what_was_raised(robot: RobotSpec, text: str) -> None:
    """Warn by a `RobotNote` where the model `text` of `robot` says what was raised in it."""
    found = _NOTE.search(text)
    if found:
        warnings.warn(f"{robot.name}: {found[1]}", RobotNote, stacklevel=3)


def _raise(root: Element) -> None:
    """Raise inertias and masses to the least for MuJoCo, and write into the model how many.

    Such an inertia is nothing beside the hinges' armature; weight stays, but for masses below the least.
    """
    root.part("compiler").set(boundmass=None, boundinertia=None)
    inertias, masses = 0, 0
    for own in root.every("inertial"):
        about, mass_kg = own.get("diaginertia"), own.get("mass")
        if min(about) < _LEAST_KG_M2:
            own.set(diaginertia=[max(value, _LEAST_KG_M2) for value in about])
            inertias += 1
        if mass_kg < _LEAST_KG:
            own.set(mass=_LEAST_KG)
            masses += 1
    if inertias:  # so small a mass has a smaller inertia
        raised = f"inertias of {inertias} bodies raised to {_LEAST_KG_M2:g} kg m^2, the least for MuJoCo"
        weight = f"masses of {masses} to {_LEAST_KG:g} kg" if masses else "masses stay"
        root.part("custom").add("text", name="raised", data=f"{raised}; {weight}")


def _add_markers(root: Element, robot: RobotSpec) -> None:
    """Add a site for each marker, in the body of its element's face."""
    offsets = offsets_of(robot.markers)
    for marker, element, offset in zip(robot.markers, elements_of(robot.markers), offsets, strict=True):
        face = root.find("site", names.face(element + 1))
        add_site(face.parent, names.marker(marker.name), offset + face.get("pos"))


def _hang_on_tip(root: Element, mass_kg: float) -> None:
    """Fix a load to the tip that has next to no extent."""
    tip = root.find("site", names.TIP)
    load = tip.parent.add("body", name=names.TIP_MASS, pos=tip.get("pos"))
    around = mass_kg * _LOAD_RADIUS_M**2
    load.add("inertial", pos=(0.0, 0.0, 0.0), mass=mass_kg, diaginertia=(around, around, around))


def _resist(root: Element, robot: RobotSpec, servo_lag_s: float) -> None:
    """Let pulled tendons resist in their channels, and actuators follow their controls by a lag."""
    damping = robot.dynamics.tendon_damping_N_s_per_m
    pulled = {actuator.get("tendon") for actuator in root.part("actuator").children}
    for tendon in root.part("tendon").children:
        if tendon.get("name") in pulled and damping > 0.0:
            tendon.set(damping=damping)
    for actuator in root.part("actuator").children if servo_lag_s > 0.0 else ():
        actuator.tag = "general"  # MJCF gives a `motor` no lag
        actuator.set(dyntype="filterexact", dynprm=servo_lag_s)


# ----------------------------------------------------------------------------------------------------
# The models written last: to write one takes five times as long as to set up its simulation.

KEPT = 8
_written: list[tuple[RobotSpec, str, bool, bool, str]] = []  # the newest first
_lock = Lock()


def remembered_mjcf(
    robot: RobotSpec, actuation: str | None = None, friction_tails: bool = False, motion: bool = False
) -> str:
    """Return `build_mjcf` of the same arguments, from memory where it was among the last `KEPT`."""
    wanted = (robot, actuation or robot.actuation, friction_tails, motion)
    with _lock:
        last = tuple(_written)
    found = next((item for item in last if item[:4] == wanted), None)
    if found is None:
        found = (*wanted, build_mjcf(*wanted))
    else:
        tell_what_was_raised(robot, found[4])
    with _lock:  # other threads may have written since
        _written[:] = [found, *(item for item in _written if item is not found)][:KEPT]
    return found[4]
