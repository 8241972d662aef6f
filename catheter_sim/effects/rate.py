"""The response depends on speed: a first-order lag, or a pure delay, before the robot or behind it.

Before it: a viscous drive, a slow servo. Behind it: a tracker that filters, or is late. Each trial starts at
rest at its own first row; what is observed has been watched long enough before that to show the first row as
it is. Friction and play run on what arrives at the rows; a turning point that a delay moves between two rows
is seen at the rows beside it.
"""

from __future__ import annotations

from catheter_sim.core.effect import Effect, Form, Parameter, Stage
from catheter_sim.effects._late import Late

_LONGEST_S = 10.0  # what is slower creeps: see `drift`


def _form(name: str, equation: str, parameter: str, memory: Late) -> Form:
    # Off zero the response has a slope by either also where a trial begins with a step.
    item = Parameter(parameter, null=0.0, lower=0.0, upper=_LONGEST_S, scale=0.1, start=0.2)
    behind = memory is _BEHIND
    return Form(
        name=name,
        equation=equation,
        stage=Stage.OBSERVATION if behind else Stage.COMMAND,
        parameters=lambda robot: (item,),
        memory=memory,
        in_place=behind,
    )


_BEFORE, _BEHIND = Late("lag_s", "delay_s"), Late("output_lag_s", "output_delay_s")
EFFECT = Effect(
    name="rate",
    summary="what arrives follows the inputs with a first-order lag, or late by a delay, all channels alike; "
    "or what is observed so follows the robot, but for tensions at the actuators",
    trace="a loop whose width grows with the speed, and which closes where the input is held",
    forms=(
        _form("input_lag", "lag_s y' = u - y", "lag_s", _BEFORE),
        _form("input_delay", "y(t) = u(t - delay_s)", "delay_s", _BEFORE),
        _form("output_lag", "output_lag_s y' = x - y", "output_lag_s", _BEHIND),
        _form("output_delay", "y(t) = x(t - output_delay_s)", "output_delay_s", _BEHIND),
    ),
    advice={
        frozenset({"backlash", "tendon_friction"}): "Play the same loops at half and at twice the speed, and "
        "hold still in the middle of each way: a lag's loop changes its width with the speed and closes in "
        "the hold, the others' do neither.",
    },
)
