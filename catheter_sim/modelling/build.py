"""Any robot as MJCF: what all kinds share; its kind adds the rest (`model.py`)."""

from __future__ import annotations

import re
import warnings

import mujoco

from catheter_sim.core.markers import elements_of, offsets_of
from catheter_sim.core.motion import IMPLICIT_SPRINGS, in_motion
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, RobotNote
from catheter_sim.mjcf import names
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.tendons import add_site
from catheter_sim.modelling.scene import add_scene
from catheter_sim.robots import face_of, kind_of

_LOAD_RADIUS_M = 1e-4  # of gyration of a load at the tip: nothing beside its distance from any hinge
_LEAST_KG = float(mujoco.mjMINVAL)  # MuJoCo takes no body of less mass
_LEAST_KG_M2 = 10.0 * float(mujoco.mjMINVAL)  # it takes a tenth, but does not move it
_NOTE = re.compile(r'<text name="raised" data="([^"]*)"')


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
