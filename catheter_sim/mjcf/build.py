"""Any robot as MJCF: what all kinds share, and which part writes which kind."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

from catheter_sim.errors import InputError
from catheter_sim.mjcf._backend import mjcf
from catheter_sim.mjcf.catheter import add_catheter, add_catheter_tendons
from catheter_sim.mjcf.catheter_drive import add_catheter_actuators
from catheter_sim.mjcf.catheter_implant import add_implant
from catheter_sim.mjcf.chain import add_chain, add_displacement_actuators, add_tendons
from catheter_sim.mjcf.friction_tails import add_friction_tails
from catheter_sim.mjcf.rolling import add_rods, add_rolling_chain
from catheter_sim.mjcf.scene import add_scene
from catheter_sim.mjcf.visuals import add_visuals
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.specification import ContinuumRobot

_DEEPEST_CALLS = 5000  # a few for each of the 400 links that a robot may have
MAX_TENSION_N = 100.0  # control range of a tension actuator


def build_mjcf(robot: Robot, actuation: str | None = None, friction_tails: bool = False) -> str:
    """Return a self-contained MJCF model of `robot` as text.

    An actuator's control is the tendon's tension [N], or its displacement [m] from just taut at rest
    (pull positive); neither can push. Names are explained in `mjcf.chain`, `mjcf.rolling`
    and `mjcf.catheter`.

    Args:
        robot: the robot; its `effects` are not read.
        actuation: "tension" or "displacement"; default: the robot's own.
        friction_tails: carry the elements of the reference friction law. The shipped law needs none:
            it runs beside the model (`catheter_sim.simulation.friction`).

    Raises:
        InputError: MuJoCo refuses the model, or the robot knows no such actuation.
    """
    actuation = actuation or robot.actuation
    root = mjcf.RootElement(model=robot.name.replace("/", "_"))
    root.compiler.angle = "radian"
    root.compiler.autolimits = True
    root.option.timestep = robot.dynamics.timestep_s
    root.option.integrator = "discrete"
    root.option.gravity = (0.0, 0.0, 0.0)
    root.option.flag.contact = "disable"
    root.custom.add("numeric", name="friction_mu", data=[robot.friction.mu])
    if isinstance(robot, RollingRobot) and actuation != "tension":
        raise InputError(f"{robot.name}: its rods are pulled by tension; choices: tension")
    if isinstance(robot, CatheterRobot) and actuation != "displacement":
        raise InputError(f"{robot.name}: its pulleys are turned by a displacement; choices: displacement")
    add_scene(root, robot)
    if isinstance(robot, RollingRobot):
        add_visuals(root, robot, add_rolling_chain(root, robot))
        add_rods(root, robot)
    elif isinstance(robot, CatheterRobot):
        bodies = add_catheter(root, robot)
        add_visuals(root, robot, bodies)
        add_catheter_tendons(root, robot)
        add_catheter_actuators(root, robot)
        add_implant(root, robot, bodies[-1])
    else:
        add_visuals(root, robot, add_chain(root, robot))
        add_tendons(root, robot)
        if friction_tails:
            add_friction_tails(root, robot)
    if actuation == "tension":
        for tendon in robot.tendons:
            name = f"tendon_{tendon.name}"
            root.actuator.add("motor", name=name, tendon=name, gear=(-1,), ctrlrange=(0, MAX_TENSION_N))
    elif isinstance(robot, ContinuumRobot):
        add_displacement_actuators(root, robot)
    with _deep_enough():
        text = root.to_xml_string(precision=9)
    try:
        mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        raise InputError(f"{robot.name}: MuJoCo refuses the model: {' '.join(str(error).split())}") from None
    return text


@contextmanager
def _deep_enough() -> Iterator[None]:
    """Let Python call itself as deep as a robot's longest row of links: PyMJCF writes one inside another."""
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(max(before, _DEEPEST_CALLS))
    try:
        yield
    finally:
        sys.setrecursionlimit(before)
