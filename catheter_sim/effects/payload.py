"""A load on the tip that the model does not know: a constant force, or a mass with weight and inertia."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.effects.shared import added_at, places, sizes

# Times what bends a robot by a radian that is all as soft as its softest part; springs of tendons and its own
# weight hold against it.
_MOST = 12.0
_MATTERS = 0.05
_EARTH_MPS2 = 9.81  # by which a mass is compared with a force


def _forces(robot: RobotSpec) -> tuple[Parameter, ...]:
    axes = places(robot, Role.TIP_FORCE)
    if not axes:
        return ()
    unit = sizes(robot).tip_force_N
    return tuple(
        Parameter(item.parameter, 0.0, -_MOST * unit, _MOST * unit, scale=_MATTERS * unit, start=0.0)
        for item in axes
    )


def _tried(
    role: Role, parameters: Callable[[RobotSpec], tuple[Parameter, ...]]
) -> Callable[[RobotSpec], tuple[tuple[str, ...], ...]]:
    """Return what gives the parameters that a diagnosis frees together: those of places that it tries."""

    def groups(robot: RobotSpec) -> tuple[tuple[str, ...], ...]:
        names = tuple(item.name for item in parameters(robot))
        return (names,) if names and all(item.tried for item in places(robot, role)) else ()

    return groups


def _loaded(robot: RobotSpec, inputs: Inputs, values: Values) -> Inputs:
    force = np.array([values.get(f"force_{axis}_N", 0.0) for axis in "xyz"])
    if not force.any():
        return inputs
    return replace(inputs, force_tip=inputs.force_tip + force)


def _masses(robot: RobotSpec) -> tuple[Parameter, ...]:
    where = places(robot, Role.TIP_MASS)
    if not where:
        return ()
    unit_g = 1e3 * sizes(robot).tip_force_N / _EARTH_MPS2
    return tuple(
        Parameter(item.parameter, 0.0, 0.0, _MOST * unit_g, scale=_MATTERS * unit_g, start=0.0)
        for item in where
    )


def _weighted(robot: R, values: Values) -> R:
    return added_at(robot, Role.TIP_MASS, values)


EFFECT = Effect(
    name="payload",
    summary="a constant force on the tip, in the base frame, or a mass there",
    trace="an error that is there at rest and changes with where the robot points; a mass also slows swings",
    bench="Look for a load on the tip: a tool, a tube, a tracker's cable. Weigh it and write it into "
    "the robot's file. Check the direction of gravity in the base frame.",
    forms=(
        Form(
            name="force",
            equation="a constant force on the tip, in the base frame",
            stage=Stage.COMMAND,
            parameters=_forces,
            groups=_tried(Role.TIP_FORCE, _forces),
            command=_loaded,
        ),
        Form(
            name="mass",
            equation="a mass m fixed to the tip: weight m * g, and inertia where the robot moves",
            stage=Stage.SPECIFICATION,
            parameters=_masses,
            groups=_tried(Role.TIP_MASS, _masses),
            specify=_weighted,
            in_motion=True,
        ),
    ),
    advice={
        frozenset({"precurvature", "measurement_frame"}): "Measure the rest shape with the base turned by "
        "180 deg: weight changes sides, shape does not.",
    },
)
