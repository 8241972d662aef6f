"""Puts a robot's `effects` into effect: checked, built in, on its inputs and on its outputs.

`robot.effects` holds values by effect and parameter name, in file units. Effects act in the order
of the registry, whatever the order in which they were written. Whoever drives a robot along a history of
inputs takes the robot as it is specified and puts its effects `in_force`: `simulate` and the static models
do. A robot whose effects are built in has none left, so that nothing acts twice.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Generic, cast

import numpy as np

from catheter_sim.effects.face import Effect, Parameter, same_postures
from catheter_sim.effects.registry import EFFECTS
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.checks import check_robot
from catheter_sim.robots.kinds import R, Robot
from catheter_sim.robots.posture import Array, Posture


def parameters_of(robot: Robot, effect: Effect) -> tuple[Parameter, ...]:
    """Return the parameters that `effect` has for `robot`; none where it makes no sense for it."""
    return effect.parameters(robot)


def check_effects(robot: Robot) -> None:
    """Raise `InputError` if an effect of `robot` or one of its values is not possible."""
    for name, values in robot.effects.items():
        if name not in EFFECTS:
            raise unknown("effect", name, EFFECTS, f"{robot.name}: effects")
        parameters = {item.name: item for item in parameters_of(robot, EFFECTS[name])}
        if not parameters:
            raise InputError(f"{robot.name}: effects.{name}: makes no sense for this robot")
        for key, value in values.items():
            where = f"{robot.name}: effects.{name}"
            if key not in parameters:
                raise unknown("parameter", key, parameters, where)
            item = parameters[key]
            if isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value):
                raise InputError(f"{where}.{key} = {value!r}: a number is needed")
            if not item.lower <= value <= item.upper:
                raise InputError(f"{where}.{key} = {value:g}: must lie in {item.lower:g} to {item.upper:g}")


class _Itself:
    """A robot as a key of what is remembered: it equals nothing but itself."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot

    def __hash__(self) -> int:
        return id(self.robot)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Itself) and other.robot is self.robot


def active(robot: Robot) -> tuple[tuple[Effect, Mapping[str, float]], ...]:
    """Return the effects of `robot` with every parameter's value, in the order in which they act."""
    return _active(_Itself(robot)) if robot.effects else ()


@lru_cache(maxsize=256)  # a diagnosis asks for a few dozen robots again and again, trial by trial
def _active(key: _Itself) -> tuple[tuple[Effect, Mapping[str, float]], ...]:
    robot = key.robot
    return tuple(
        (effect, MappingProxyType(effect.complete(robot, robot.effects[name])))
        for name, effect in EFFECTS.items()
        if name in robot.effects
    )


def embodied(robot: R) -> R:
    """Return `robot` with its effects put into the specification, and none left to apply.

    What acts on inputs and outputs is not in it: see `arriving_inputs` and `observed`.
    """
    changed: Robot = robot
    for effect, values in active(robot):
        changed = effect.change_robot(changed, values)
    return cast(R, replace(changed, effects={}))


def arriving_inputs(robot: Robot, inputs: Inputs) -> Inputs:
    """Return what arrives at the robot when `inputs` are commanded."""
    for effect, values in active(robot):
        inputs = effect.change_inputs(robot, inputs, values)
    return inputs


def observed(robot: Robot, postures: tuple[Posture, ...]) -> tuple[Posture, ...]:
    """Return what is measured when the robot is in `postures`."""
    for effect, values in active(robot):
        postures = effect.change_postures(robot, postures, values)
    return postures


def observed_frames(robot: Robot, p_w: Array, R_w: Array) -> tuple[Array, Array]:
    """Return what is measured of bare positions (..., 3) [m] and orientations (..., 3, 3).

    These may belong to different frames.
    """
    for effect, values in active(robot):
        if effect.change_frames is not None:
            p_w, R_w = effect.change_frames(values, p_w, R_w)
    return p_w, R_w


@dataclass(frozen=True)
class InForce(Generic[R]):
    """A robot's effects along a history of inputs.

    Attributes:
        specified: the robot as it was given, driven as the inputs drive it.
        robot: with the effects built in, none left.
        inputs: what arrives at it.
    """

    specified: R
    robot: R
    inputs: Inputs

    def observed(self, postures: tuple[Posture, ...]) -> tuple[Posture, ...]:
        """Return what is measured when the robot is in `postures`."""
        return observed(self.specified, postures)


def in_force(robot: R, inputs: Inputs, where: str = "") -> InForce[R]:
    """Return the effects of `robot` in force along `inputs`, as they are commanded.

    Units of parameters are those of the inputs: N where tensions drive the robot, else mm. `where` is what
    to call the robot in an error, by default its name.

    Raises:
        InputError: an effect or a value is not possible, or the robot is not with them.
    """
    if not robot.effects:
        return InForce(robot, robot, inputs)
    specified = driven_by(robot, inputs.actuation)
    return InForce(specified, built_in(specified, where), arriving_inputs(specified, inputs))


def driven_by(robot: R, actuation: str) -> R:
    """Return `robot` driven by "tension" or "displacement": the units of its effects are those."""
    return robot if robot.actuation == actuation else cast(R, replace(robot, actuation=actuation))


def built_in(robot: R, where: str = "") -> R:
    """Return `embodied(robot)`, checked; a robot without effects is returned as it is.

    Raises:
        InputError: an effect or a value is not possible, or the robot is not with them.
    """
    if not robot.effects:
        return robot
    check_effects(robot)
    changed = embodied(robot)
    check_robot(changed, where or robot.name)
    return changed


def wholly_built_in(robot: R) -> R:
    """Return `built_in(robot)` for whoever moves a robot step by step, without a history to apply effects to.

    Raises:
        InputError: as `built_in`, and where an effect acts on inputs or outputs.
    """
    changed = built_in(robot)
    outside = outside_the_robot(robot)
    if outside:
        raise InputError(
            f"{robot.name}: {', '.join(f'effects.{name}' for name in outside)}: acts on inputs or outputs, "
            "which steps of a simulator do not; `simulate` and environments do, `effects.apply.embodied` "
            "leaves it out"
        )
    return changed


def outside_the_robot(robot: Robot) -> list[str]:
    """Return the effects that `embodied` leaves out, in part or whole: they act on inputs or outputs.

    Tried out on a history of inputs in which every tendon moves, and on a frame.
    """
    rows, tendons = 4, len(robot.tendons)
    unit = 1.0 if robot.actuation == "tension" else 1e-3
    moved = unit * np.linspace(1.0, 2.0, rows * tendons).reshape(rows, tendons)
    still = np.zeros((rows, 3))
    probe = Inputs(np.arange(float(rows)), robot.actuation, moved, still, still)
    p_w, R_w = np.array([0.1, 0.2, 0.3]), np.eye(3)
    found = []
    for effect, values in active(robot):
        arrived = effect.change_inputs(robot, probe, values)
        outside = any(
            not np.array_equal(getattr(arrived, name), getattr(probe, name))
            for name in ("time_s", "tendon", "force_tip", "moment_tip")
        )
        if effect.change_frames is not None:
            seen = effect.change_frames(values, p_w, R_w)
            outside |= not (np.array_equal(seen[0], p_w) and np.array_equal(seen[1], R_w))
        if outside or (effect.change_frames is None and effect.change_postures is not same_postures):
            found.append(effect.name)
    return found


def with_effects(robot: R, effects: Mapping[str, Mapping[str, float]]) -> R:
    """Return `robot` with exactly these effects; values as in `robot.effects`."""
    return replace(robot, effects={name: dict(values) for name, values in effects.items()})
