"""How a notched tube is steered in environments, and what its speed test plays."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.quick_model import LARGEST_BEND_RAD, InputLimits, SpeedCase, pulled_in_turn
from catheter_sim.kinds.notched_tube.drives import largest_displacement_m
from catheter_sim.kinds.notched_tube.layout import notches
from catheter_sim.kinds.notched_tube.notch_model import NotchModel, notch_model
from catheter_sim.kinds.notched_tube.spec import NotchedTubeRobot
from catheter_sim.kinds.notched_tube.springs import bending_seen_from_tendon
from catheter_sim.kinds.notched_tube.theory.section import section

_BEND_RAD = 0.5  # that the speed test asks of the unbent tube's stiffness: the plateau adds to it


def quick_model(robot: NotchedTubeRobot, actuation: str, largest_bend_rad: float | None) -> NotchModel:
    """Return the frictionless statics by which an environment steers; see `core.kind.Steering`."""
    return notch_model(robot, actuation, LARGEST_BEND_RAD if largest_bend_rad is None else largest_bend_rad)


def input_range(robot: NotchedTubeRobot) -> tuple[Array, Array]:
    """Return the least and largest input that the simulation takes, shape (1,) each.

    A displacement that the notches cannot close tears at the tube; any tension is far above it as a number.
    """
    most = largest_displacement_m(robot) if robot.actuation == "displacement" else math.inf
    return np.array([-math.inf]), np.array([most])


def input_limits(robot: NotchedTubeRobot, actuation: str) -> InputLimits:
    """Return what closes the notches."""
    most = notch_model(robot, actuation, math.inf).drives.tendon[0]
    return InputLimits(np.array([-math.inf]), most, "there the notches are closed")


def speed_case(robot: NotchedTubeRobot, levels: int) -> SpeedCase:
    """Return a cycle to and fro; its peak would bend the tube by half a radian if it stayed as stiff.

    By MuJoCo alone notches are no arcs and their metal has no plateau: the model does not follow the inputs.
    """
    row = notches(robot)
    arm = robot.tendons[0].radius_m + max(section(notch.segment).centroid_m for notch in row)
    peak = _BEND_RAD * bending_seen_from_tendon(robot) * arm
    return SpeedCase(pulled_in_turn([(peak, 1.0)], levels), len(row), rubs=True, follows=False)
