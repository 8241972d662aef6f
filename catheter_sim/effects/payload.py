"""A force on the tip that the model does not know."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catheter_sim.effects._scales import tip_force_N
from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.kinds import Robot


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    if isinstance(robot, CatheterRobot):
        return ()  # the statics of catheters carry no load, so the simulation would be without a twin
    unit = tip_force_N(robot)
    planar = all(segment.bending_axes == "x" for segment in robot.segments)
    return tuple(
        Parameter(f"force_{axis}_N", 0.0, -3.0 * unit, 3.0 * unit, scale=0.05 * unit, start=0.0)
        for axis in ("xz" if planar else "xyz")
    )


def _change_inputs(robot: Robot, inputs: Inputs, values: Values) -> Inputs:
    force = np.array([values.get(f"force_{axis}_N", 0.0) for axis in "xyz"])
    return replace(inputs, force_tip=inputs.force_tip + force)


EFFECT = Effect(
    name="payload",
    summary="a constant force on the tip, in the base frame",
    trace="an error that is there at rest and changes with where the robot points",
    parameters=_parameters,
    change_inputs=_change_inputs,
)
