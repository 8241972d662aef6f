"""The tendons' holes turn about the backbone along the robot: out-of-plane motion that grows."""

from __future__ import annotations

from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.effects._places import added_everywhere, places, sizes

_RATE = "rate_deg_per_m"


def _parameters(robot: RobotSpec) -> tuple[Parameter, ...]:
    if not places(robot, Role.HOLE_TWIST):
        return ()
    bound = 90.0 / sizes(robot).length_m
    return (Parameter(_RATE, null=0.0, lower=-bound, upper=bound, scale=0.02 * bound, start=0.0),)


def _twisted(robot: R, values: Values) -> R:
    return added_everywhere(robot, Role.HOLE_TWIST, values[_RATE]) if _RATE in values else robot


EFFECT = Effect(
    name="twist",
    summary="the tendons' holes turn about the backbone at a constant rate along the robot",
    trace="a bending plane that turns from segment to segment",
    bench="Look along the straight robot from its tip: do the holes of all disks lie on straight "
    "lines? See how the disks are fixed to the backbone.",
    forms=(
        Form(
            name="holes",
            equation="a tendon's holes lie at its angle + rate times the height along the backbone",
            stage=Stage.SPECIFICATION,
            parameters=_parameters,
            specify=_twisted,
        ),
    ),
    same_as=frozenset({Role.HOLE_TWIST}),
)
