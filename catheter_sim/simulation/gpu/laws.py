"""The laws of a simulator for its copies on a device, in the order of their turns; friction comes last."""

from __future__ import annotations

from typing import Any

from catheter_sim.kinds import face_of
from catheter_sim.mechanics.device import Copies, DeviceLaw, Gpu
from catheter_sim.simulation.friction import CapstanFriction
from catheter_sim.simulation.simulator import Simulator


def laws_of(simulator: Simulator, copies: Copies) -> list[DeviceLaw]:
    """Return the laws of a simulator for its copies.

    Args:
        simulator: at rest.
        copies: where they run.

    Raises:
        InputError: its kind has no laws for a device.
    """
    # Their kernels need Warp, which is an extra.
    from catheter_sim.simulation.gpu.drive import Drive
    from catheter_sim.simulation.gpu.friction import Friction

    robot, place = simulator.robot, simulator.place
    face: Gpu[Any] = face_of(robot, "gpu", "simulation on MuJoCo Warp")
    drive = Drive(copies, simulator.model, simulator.pulls)
    friction: Friction | None = None
    if isinstance(simulator.laws.friction, CapstanFriction):
        friction = Friction(copies, simulator.model, simulator.laws.friction, drive)
        friction.find_turns = face.turns(robot, place, copies, friction.ends)
    tension = None if friction is None else friction.tension
    laws = list(face.laws(robot, place, copies, drive, tension))
    changed = any(law.changes_joints for law in laws)
    if friction is not None or not simulator.pulls.given:
        laws.append(drive)
    if friction is not None:
        friction.joints_change = changed
        laws.append(friction)
    return laws
