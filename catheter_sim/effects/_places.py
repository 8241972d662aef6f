"""Parameters of the places that a robot's kind gives for a role, and their values added there."""

from __future__ import annotations

from catheter_sim.core.effect import Handle, Parameter, Role, Sizes, Values
from catheter_sim.core.numbers import number, si_of, with_values
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.robots import kind_of


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
