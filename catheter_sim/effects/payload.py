"""A force on the tip that the model does not know."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects._places import places, sizes


def _parameters(robot: RobotSpec) -> tuple[Parameter, ...]:
    axes = places(robot, Role.TIP_FORCE)
    if not axes:
        return ()
    unit = sizes(robot).tip_force_N
    return tuple(
        Parameter(item.parameter, 0.0, -3.0 * unit, 3.0 * unit, scale=0.05 * unit, start=0.0) for item in axes
    )


def _loaded(robot: RobotSpec, inputs: Inputs, values: Values) -> Inputs:
    force = np.array([values.get(f"force_{axis}_N", 0.0) for axis in "xyz"])
    if not force.any():
        return inputs
    return replace(inputs, force_tip=inputs.force_tip + force)


EFFECT = Effect(
    name="payload",
    summary="a constant force on the tip, in the base frame",
    trace="an error that is there at rest and changes with where the robot points",
    forms=(
        Form(
            name="force",
            equation="a constant force on the tip, in the base frame",
            stage=Stage.COMMAND,
            parameters=_parameters,
            command=_loaded,
        ),
    ),
    advice={
        frozenset({"precurvature", "measurement_frame"}): "Measure the rest shape with the base turned by "
        "180 deg: weight changes sides, shape does not.",
    },
)
