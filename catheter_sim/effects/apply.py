"""Puts a robot's `effects` into effect: checked, built in, on its inputs and on its outputs.

`robot.effects` holds values by effect and parameter name, in file units. Effects act in the order
of the registry, whatever the order in which they were written.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType
from typing import cast

from catheter_sim.effects.face import Effect, Parameter
from catheter_sim.effects.registry import EFFECTS
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.channels import Inputs
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


def with_effects(robot: R, effects: Mapping[str, Mapping[str, float]]) -> R:
    """Return `robot` with exactly these effects; values as in `robot.effects`."""
    return replace(robot, effects={name: dict(values) for name, values in effects.items()})
