"""The response depends on speed: a lag or a delay before the robot or behind it, or its own viscous loss.

In it: its material resists a rate of strain by more, or by less, than is specified. Before it: a viscous
drive, a slow servo. Behind it: a tracker that filters, or is late. Each trial starts at rest at its own first
row; what is observed has been watched long enough before that to show the first row as it is. Friction and
play run on what arrives at the rows; a turning point that a delay moves between two rows is seen at the rows
beside it.
"""

from __future__ import annotations

from collections.abc import Callable

from catheter_sim.core.document import number
from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Timing, Values
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.effects.shared import Late, added_at, places

_VISCOUS = "damping_time_s"
_MOST_DAMPING_S = 0.3  # by which most robots swing no more
_DAMPING_SCALE = 0.1  # of a change that matters, of the damping that is specified
_LEAST_DAMPING_SCALE_S = 1e-3
_LONGEST_S = 10.0  # what is slower creeps: see `drift`
# [s] scale and start: between held rows seconds pass, in motion hundredths of a second (assumed)
_HELD_S, _MOVING_S = (0.1, 0.2), (0.01, 0.02)


def _form(name: str, equation: str, parameter: str, memory: Late) -> Form:
    # Off zero the response has a slope by either also where a trial begins with a step.
    scale, start = _HELD_S
    item = Parameter(parameter, 0.0, 0.0, _LONGEST_S, scale=scale, start=start, in_motion=_MOVING_S)
    behind = memory is _BEHIND
    lags = parameter == memory.lag
    return Form(
        name=name,
        equation=equation,
        stage=Stage.OBSERVATION if behind else Stage.COMMAND,
        parameters=lambda robot: (item,),
        memory=memory,
        in_place=behind,
        timing=_timing(parameter, lags, behind),
    )


def _timing(parameter: str, lags: bool, behind: bool) -> Callable[[Values], Timing] | None:
    """Return what MJCF has of a form: actuators with lag and delay, sensors with a delay."""
    if lags and behind:
        return None
    if lags:
        return lambda values: Timing(lag_s=values.get(parameter, 0.0))
    return lambda values: Timing(delay_s=values.get(parameter, 0.0))


def _damping(robot: RobotSpec) -> tuple[Parameter, ...]:
    where = places(robot, Role.DAMPING)
    if not where:
        return ()
    specified_s = number(robot, where[0].key)
    scale = max(_DAMPING_SCALE * specified_s, _LEAST_DAMPING_SCALE_S)
    return (Parameter(_VISCOUS, 0.0, -specified_s, _MOST_DAMPING_S, scale=scale, start=0.0),)


def _damped(robot: R, values: Values) -> R:
    return added_at(robot, Role.DAMPING, values)


_BEFORE, _BEHIND = Late("lag_s", "delay_s"), Late("output_lag_s", "output_delay_s")
EFFECT = Effect(
    name="rate",
    summary="what arrives, or what is observed but for tensions, follows with a first-order lag or a delay, "
    "all channels alike. Or the material resists a rate of strain by more than specified",
    trace="a loop whose width grows with the speed, and which closes where the input is held",
    bench="Step one input and record as fast as the tracker can. How long until the tip moves, and "
    "until it rests? Check that inputs and tracker share one clock.",
    forms=(
        _form("input_lag", "lag_s * dy/dt = u - y", "lag_s", _BEFORE),
        _form("input_delay", "y(t) = u(t - delay_s)", "delay_s", _BEFORE),
        Form(
            name="viscous",
            equation="stress = E * (strain + (T + damping_time_s) * strain rate), T as specified "
            "(Kelvin and Voigt)",
            stage=Stage.SPECIFICATION,
            parameters=_damping,
            specify=_damped,
            in_motion=True,
        ),
        _form("output_lag", "output_lag_s * dy/dt = x - y", "output_lag_s", _BEHIND),
        _form("output_delay", "y(t) = x(t - output_delay_s)", "output_delay_s", _BEHIND),
    ),
    advice={
        frozenset({"backlash", "tendon_friction"}): "Play the same loops at half and at twice the speed, and "
        "hold still in the middle of each way. The loop of a lag changes its width with the speed and closes "
        "in the hold. The others' loops do neither.",
    },
)
