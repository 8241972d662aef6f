"""Any robot as MJCF: what all kinds share; its kind adds the rest (`model.py`)."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

import mujoco

from catheter_sim.core.markers import elements_of, offsets_of
from catheter_sim.core.motion import IMPLICIT_SPRINGS, in_motion
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, RobotNote
from catheter_sim.kinds import face_of, kind_of
from catheter_sim.mjcf import names
from catheter_sim.mjcf.backend import mjcf
from catheter_sim.modelling.scene import add_scene

_LOAD_RADIUS_M = 1e-4  # of gyration of a load at the tip: nothing beside its distance from any hinge
_DEEP = Lock()  # Python's limit of calls within calls is one for all threads: one of them raises it at a time
_LEAST_KG = float(mujoco.mjMINVAL)  # MuJoCo takes no body of less mass
_LEAST_KG_M2 = 10.0 * float(mujoco.mjMINVAL)  # it takes a tenth, but does not move it
_NOTE = re.compile(r'<text name="raised" data="([^"]*)"')
_DEEPEST_CALLS = 5000  # a few for each of the 400 links that a robot may have


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
    root = mjcf.RootElement(model=robot.name.replace("/", "_"))
    root.compiler.angle = "radian"
    root.compiler.autolimits = True
    # For models that kinds compile on the way; what is raised in the end, `_raise` says.
    root.compiler.boundmass, root.compiler.boundinertia = _LEAST_KG, _LEAST_KG_M2
    root.option.timestep = robot.dynamics.timestep_s
    root.option.integrator = integrator
    root.option.gravity = (0.0, 0.0, 0.0)
    root.option.flag.contact = "disable"
    root.custom.add("numeric", name="friction_mu", data=[robot.friction.mu])
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
    with _deep_enough():
        text = root.to_xml_string(precision=12)
    try:
        mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        raise InputError(f"{robot.name}: MuJoCo refuses the model: {' '.join(str(error).split())}") from None
    tell_what_was_raised(robot, text)
    return text


def tell_what_was_raised(robot: RobotSpec, text: str) -> None:
    """Warn by a `RobotNote` where the model `text` of `robot` says what was raised in it."""
    found = _NOTE.search(text)
    if found:
        warnings.warn(f"{robot.name}: {found[1]}", RobotNote, stacklevel=3)


def _raise(root: mjcf.RootElement) -> None:
    """Raise inertias and masses to the least for MuJoCo, and write into the model how many.

    Such an inertia is nothing beside the hinges' armature; weight stays, but for masses below the least.
    """
    del root.compiler.boundmass, root.compiler.boundinertia
    inertias, masses = 0, 0
    for body in root.find_all("body"):
        own = body.inertial
        if own is None or own.diaginertia is None:
            continue
        if min(own.diaginertia) < _LEAST_KG_M2:
            own.diaginertia = [max(value, _LEAST_KG_M2) for value in own.diaginertia]
            inertias += 1
        if own.mass < _LEAST_KG:
            own.mass = _LEAST_KG
            masses += 1
    if inertias:  # so small a mass has a smaller inertia
        raised = f"inertias of {inertias} bodies raised to {_LEAST_KG_M2:g} kg m^2, the least for MuJoCo"
        weight = f"masses of {masses} to {_LEAST_KG:g} kg" if masses else "masses stay"
        root.custom.add("text", name="raised", data=f"{raised}; {weight}")


def _add_markers(root: mjcf.RootElement, robot: RobotSpec) -> None:
    """Add a site for each marker, in the body of its element's face."""
    offsets = offsets_of(robot.markers)
    for marker, element, offset in zip(robot.markers, elements_of(robot.markers), offsets, strict=True):
        face = root.find("site", names.face(element + 1))
        face.parent.add("site", name=names.marker(marker.name), pos=face.pos + offset, size=(1e-4,), group=5)


def _hang_on_tip(root: mjcf.RootElement, mass_kg: float) -> None:
    """Fix a load to the tip that has next to no extent."""
    tip = root.find("site", names.TIP)
    load = tip.parent.add("body", name=names.TIP_MASS, pos=tip.pos)
    around = mass_kg * _LOAD_RADIUS_M**2
    load.add("inertial", pos=(0.0, 0.0, 0.0), mass=mass_kg, diaginertia=(around, around, around))


def _resist(root: mjcf.RootElement, robot: RobotSpec, servo_lag_s: float) -> None:
    """Let pulled tendons resist in their channels, and actuators follow their controls by a lag."""
    damping = robot.dynamics.tendon_damping_N_s_per_m
    for actuator in root.find_all("actuator"):
        if actuator.tendon is not None and damping > 0.0:
            root.find("tendon", getattr(actuator.tendon, "name", actuator.tendon)).damping = damping
        if servo_lag_s > 0.0:
            _follow_by_lag(root, actuator, servo_lag_s)


def _follow_by_lag(root: mjcf.RootElement, actuator: mjcf.Element, lag_s: float) -> None:
    """Let an actuator follow its control by a first-order lag: MJCF gives a `motor` none, a `general` one."""
    if actuator.tag == "general":
        actuator.dyntype, actuator.dynprm = "filterexact", (lag_s,)
        return
    own = actuator.get_attributes()
    actuator.remove()
    root.actuator.add("general", dyntype="filterexact", dynprm=(lag_s,), **own)


@contextmanager
def _deep_enough() -> Iterator[None]:
    """Let Python call itself as deep as a robot's longest row of links: PyMJCF writes one inside another."""
    with _DEEP:
        before = sys.getrecursionlimit()
        sys.setrecursionlimit(max(before, _DEEPEST_CALLS))
        try:
            yield
        finally:
            sys.setrecursionlimit(before)
