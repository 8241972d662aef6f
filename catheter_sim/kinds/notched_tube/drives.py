"""What drives a notched tube, by its tendon's tension or displacement, and what it reports."""

from __future__ import annotations

from dataclasses import replace

from catheter_sim.core.drive import Drive, Outputs, of_tendons
from catheter_sim.kinds.notched_tube.closing import closing_displacement
from catheter_sim.kinds.notched_tube.layout import joint_names, notches
from catheter_sim.kinds.notched_tube.spec import NotchedTubeRobot

ACTUATIONS = ("tension", "displacement")
# Share of the displacement that closes all notches of a metal that the tendon does not compress: a closed
# tube gives way too little for the rest.
_LARGEST_SHARE = 0.98


def actuations(robot: NotchedTubeRobot) -> tuple[str, ...]:
    """Return the kinds of actuator inputs that `robot` takes."""
    return ACTUATIONS


def drives(robot: NotchedTubeRobot, actuation: str) -> tuple[Drive, ...]:
    """Return the tendon's column under `actuation`; a displacement is at most what its notches can close."""
    tendon = robot.tendons[0]
    (drive,) = of_tendons(((tendon.channel or tendon.name, robot.segments[-1].name, (1.0, 0.0)),), actuation)
    if actuation == "tension":
        return (drive,)
    return (replace(drive, most=largest_displacement_m(robot)),)


def largest_displacement_m(robot: NotchedTubeRobot) -> float:
    """Return the largest displacement that the tendon is asked for [m]; inf where it can stretch."""
    return _LARGEST_SHARE * closing_displacement(robot)


def outputs(robot: NotchedTubeRobot) -> Outputs:
    """Return what the output columns are: an element for each notch, the notches' angles, the tendon."""
    return Outputs(len(notches(robot)), tuple(joint_names(robot)), {0: robot.tendons[0].name})
