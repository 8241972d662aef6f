"""What several effects share: parameters of channels and places, and a lag's memory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import channel_gains, channel_of
from catheter_sim.core.document import number, si_of, with_values
from catheter_sim.core.effect import Handle, Parameter, Role, Sizes, Values
from catheter_sim.core.inputs import Inputs, Quantity, quantity_of
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.mechanics.hysteresis import Past, lagged, late_step
from catheter_sim.robots import kind_of

# ----------------------------------------------------------------------------------------------------
# Parameters of the places that a robot's kind gives for a role, and their values added there.


def places(robot: RobotSpec, role: Role) -> tuple[Handle, ...]:
    """Return the places of a role that matter as `robot` is driven."""
    return tuple(item for item in kind_of(robot).handles.handles(robot) if item.role is role)


def sizes(robot: RobotSpec) -> Sizes:
    """Return what bends `robot` by a radian."""
    return kind_of(robot).handles.sizes(robot)


def parameters_at(robot: RobotSpec, role: Role) -> tuple[Parameter, ...]:
    """Return the parameters that the kind names at the places of a role, each once; null is zero."""
    found: dict[str, Parameter] = {}
    for item in places(robot, role):
        parameter = Parameter(item.parameter, 0.0, item.lower, item.upper, scale=item.size, start=0.0)
        found.setdefault(item.parameter, parameter)
    return tuple(found.values())


def groups_at(robot: RobotSpec, role: Role) -> tuple[tuple[str, ...], ...]:
    """Return the names of these parameters by the kind's groups."""
    groups: dict[str, dict[str, None]] = {}
    for item in places(robot, role):
        groups.setdefault(item.group, {})[item.parameter] = None
    return tuple(tuple(names) for names in groups.values())


def added_at(robot: R, role: Role, values: Values) -> R:
    """Return `robot` with the values of these parameters added to the numbers at their places."""
    sums: dict[str, float] = {}
    for item in places(robot, role):
        if item.parameter in values:
            change = si_of(robot, item.key, values[item.parameter])
            sums[item.key] = sums.get(item.key, 0.0) + change
    return with_values(robot, {key: number(robot, key) + change for key, change in sums.items()})


def added_everywhere(robot: R, role: Role, change: float) -> R:
    """Return `robot` with one change, in the file's unit, added to the numbers at all places of a role."""
    keys = [item.key for item in places(robot, role)]
    return with_values(robot, {key: number(robot, key) + si_of(robot, key, change) for key in keys})


def in_series_at(robot: R, role: Role, stiffness_N_per_m: float) -> R:
    """Return `robot` with a spring in series with those at all places of a role."""
    keys = [item.key for item in places(robot, role)]
    return with_values(robot, {key: in_series(number(robot, key), stiffness_N_per_m) for key in keys})


def in_series(first_N_per_m: float, second_N_per_m: float) -> float:
    """Return the stiffness of two springs in series; infinite ones give nothing way."""
    compliance = 1.0 / first_N_per_m + 1.0 / second_N_per_m
    return 1.0 / compliance if compliance > 0.0 else float("inf")


# ----------------------------------------------------------------------------------------------------
# Per-channel parameters: a common value first, then one for each input channel.

TO_SI = {"N": 1.0, "mm": 1e-3}


def channels(robot: RobotSpec) -> list[str]:
    """Return the robot's actuator channels, each once."""
    return list(dict.fromkeys(channel_of(robot)))


def common_and_each(robot: RobotSpec, common: Parameter, each: str) -> tuple[Parameter, ...]:
    """Return the common parameter, and for several channels the same named by `each` (with `{}`)."""
    return _common_and_each(tuple(channels(robot)), common, each)


@lru_cache(maxsize=256)  # a diagnosis asks for the same of every robot
def _common_and_each(names: tuple[str, ...], common: Parameter, each: str) -> tuple[Parameter, ...]:
    if len(names) == 1:
        return (common,)
    return (common, *(replace(common, name=each.format(name)) for name in names))


def common_then_each(robot: RobotSpec, common: str, each: str) -> tuple[tuple[str, ...], ...]:
    """Return the variants: the common parameter alone, or one for each channel."""
    names = channels(robot)
    if len(names) == 1:
        return ((common,),)
    return ((common,), tuple(each.format(name) for name in names))


def per_tendon(robot: RobotSpec, each: str, values: Values, null: float) -> Array:
    """Return each tendon's own channel value, `null` where none is given, shape (t,)."""
    return np.array([values.get(each.format(name), null) for name in channel_of(robot)])


def actuation_unit(robot: RobotSpec) -> float:
    """Return 1 mm, or the tension that bends the robot by a radian [N], to one digit: what drives it."""
    return float(f"{sizes(robot).tension_N:.1g}") if _tensioned(robot) else 1.0


def _tensioned(robot: RobotSpec) -> bool:
    return quantity_of(robot.actuation) is Quantity.TENSION


def scale_of(robot: RobotSpec) -> str:
    """Return the unit in files of the robot's actuator inputs."""
    return quantity_of(robot.actuation).file_unit


def sized_parameter(robot: RobotSpec, name: str, size: Mapping[str, tuple[float, float]]) -> Parameter:
    """Return a parameter that does nothing at zero, with bounds on both sides of it.

    Args:
        robot: of which the unit is, and the tension that bends it.
        name: of the parameter.
        size: by unit in files, its bound and a change that matters: in mm, or in tensions that bend the
            robot by a radian.

    A fit starts a little below zero where tensions drive the robot. There only the rows say something in
    which a tendon is pulled. At zero, every row at rest speaks for whoever adds nothing, since it cannot
    show that the zero is too low: a tendon cannot push.
    """
    unit = scale_of(robot)
    bound, scale = (round(value * actuation_unit(robot), 9) for value in size[unit])
    start = -scale if unit == "N" else 0.0
    return Parameter(name, null=0.0, lower=-bound, upper=bound, scale=scale, start=start)


def in_si(robot: RobotSpec, names: tuple[str, str], values: Values) -> Array:
    """Return each tendon's value, the common one and its channel's own added up, SI, shape (t,).

    It is as the channel's gain hands it on: a tendon that its channel lets out gets it with the other sign.

    Args:
        robot: in whose actuator inputs' unit the values are.
        names: of the common parameter, and of each channel's (with `{}`).
        values: of the parameters; what is not given is zero.
    """
    common, each = names
    own = (values.get(common, 0.0) + per_tendon(robot, each, values, 0.0)) * TO_SI[scale_of(robot)]
    return np.asarray(own * channel_gains(robot))


def shift_names(robot: RobotSpec, stem: str) -> tuple[str, str]:
    """Return the names of a shift common to all channels, and of each channel's (with `{}`)."""
    unit = scale_of(robot)
    return f"{stem}_{unit}", f"{stem}_{{}}_{unit}"


def shift_parameters(
    robot: RobotSpec, stem: str, size: Mapping[str, tuple[float, float]]
) -> tuple[Parameter, ...]:
    """Return the parameters of shifts of the inputs, named by `stem`; `size` as of `sized_parameter`."""
    common, each = shift_names(robot, stem)
    return common_and_each(robot, sized_parameter(robot, common, size), each)


def shifted(robot: RobotSpec, inputs: Inputs, stem: str, values: Values) -> Inputs:
    """Return inputs with their shifts, the common one and each channel's own, added."""
    return replace(inputs, tendon=inputs.tendon + in_si(robot, shift_names(robot, stem), values))


# ----------------------------------------------------------------------------------------------------
# A lag and a delay as an effect's memory, of commands or of what is observed.


@dataclass(frozen=True)
class Late:
    """A first-order lag and a delay, all numbers alike.

    Attributes:
        lag, delay: names of the parameters that hold them [s].
    """

    lag: str
    delay: str
    timed = True

    def start(self, robot: RobotSpec, values: Values, rest: Array) -> Past | None:
        """Return the state at rest; None without lag and delay."""
        lag_s, delay_s = values.get(self.lag, 0.0), values.get(self.delay, 0.0)
        return Past(lag_s, delay_s, rest) if lag_s > 0.0 or delay_s > 0.0 else None

    def step(self, state: Past, before: Array, after: Array, dt_s: float) -> tuple[Past, Array]:
        """Return the state and what comes out when what goes in has moved from `before` to `after`."""
        return late_step(state, before, after, dt_s)

    def series(self, robot: RobotSpec, values: Values, rest: Array, time_s: Array, rows: Array) -> Array:
        """Return what comes out at each row, same shape as `rows`, from rest."""
        return lagged(time_s, rows, values.get(self.lag, 0.0), values.get(self.delay, 0.0), rest)
