"""The unloaded robot is not straight; of a catheter, its exposed tube or its bending joints."""

from __future__ import annotations

from catheter_sim.core.effect import Effect, Form, Role, Stage
from catheter_sim.effects.shared import added_at, groups_at, parameters_at


def _form(name: str, equation: str, role: Role, local: bool) -> Form:
    return Form(
        name=name,
        equation=equation,
        stage=Stage.SPECIFICATION,
        parameters=lambda robot: parameters_at(robot, role),
        groups=lambda robot: groups_at(robot, role),
        specify=lambda robot, values: added_at(robot, role, values),
        local=local,
    )


EFFECT = Effect(
    name="precurvature",
    summary="the unloaded robot is bent: a rest curvature (of a catheter, its exposed tube's, or a bending "
    "joint's rest bend) is added to its own",
    trace="an error that is largest near rest, where the tip is off the axis",
    bench="Slacken all tendons and look at the robot from two sides. Is it straight? Turn its base "
    "by 180 deg: a bend of the robot turns with it, weight does not.",
    forms=(
        _form(
            "curvature",
            "moment = EI * (k - curvature), k the bend per length",
            Role.REST_CURVATURE,
            local=True,
        ),
        _form("joint_bend", "moment = K * (angle - rest bend) of a joint", Role.REST_BEND, local=False),
    ),
    same_as=frozenset({Role.REST_CURVATURE}),
)
