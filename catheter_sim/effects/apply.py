"""Puts a robot's effects into effect, stage by stage, for whole histories or step by step."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Any, Generic, cast

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import actuations
from catheter_sim.core.effect import Form, Memory, Stage, Values, amount_of
from catheter_sim.core.inputs import Inputs, driven_by, pulls_alone, quantity_of
from catheter_sim.core.posture import Observed, Posture, marker_points
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.core.variation import MARK, number_varied
from catheter_sim.effects import EFFECTS
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots import check_robot, kind_of

# ----------------------------------------------------------------------------------------------------
# Which causes say the same as a number of a robot that is calibrated already.


def causes_same_as(robot: RobotSpec, keys: Iterable[str]) -> tuple[str, ...]:
    """Return the causes that act on one of the numbers at dotted keys as its calibration does."""
    wanted = set(keys)
    face = kind_of(robot).handles
    driven = (driven_by(robot, actuation) for actuation in actuations(robot))
    roles = {item.role for one in driven for item in face.handles(one) if item.key in wanted}
    return tuple(name for name, effect in EFFECTS.items() if effect.same_as & roles)


# ----------------------------------------------------------------------------------------------------
# Puts a robot's `effects` into effect, stage by stage: on its inputs, in the robot, on what is observed.
#
# `robot.effects` holds values by effect and parameter name, in file units. Effects act in the order of the
# list, whatever the order in which they were written. Whoever drives a robot along a history of inputs
# takes the robot as it is specified and puts its effects `in_force`: `simulate` and the static models do;
# whoever drives it step by step, `steps.Commands` and `steps.Sight`. A robot whose effects are built in has
# none left, so that nothing acts twice.


def check_effects(robot: RobotSpec) -> None:
    """Raise `InputError` if an effect of `robot` or one of its values is not possible."""
    for name, values in robot.effects.items():
        if name not in EFFECTS:
            raise unknown("effect", name, EFFECTS, f"{robot.name}: effects")
        parameters = {item.name: item for item in EFFECTS[name].parameters(robot)}
        if not parameters:
            raise InputError(f"{robot.name}: effects.{name}: makes no sense for this robot")
        for key, value in values.items():
            where = f"{robot.name}: effects.{name}"
            if number_varied(key) not in parameters:
                raise unknown("parameter", number_varied(key), parameters, where)
            item = parameters[key] if key in parameters else amount_of(parameters[number_varied(key)], key)
            if isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value):
                raise InputError(f"{where}.{key} = {value!r}: a number is needed")
            if not item.lower <= value <= item.upper:
                raise InputError(f"{where}.{key} = {value:g}: must lie in {item.lower:g} to {item.upper:g}")


class _Itself:
    """A robot as a key of what is remembered: it equals nothing but itself."""

    def __init__(self, robot: RobotSpec) -> None:
        self.robot = robot

    def __hash__(self) -> int:
        return id(self.robot)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Itself) and other.robot is self.robot


@dataclass(frozen=True)
class Act:
    """A form of one of a robot's effects, with the values that are given for the effect."""

    effect: str
    form: Form
    values: Values


def acts(robot: RobotSpec, stage: Stage) -> tuple[Act, ...]:
    """Return the forms of the effects of `robot` that act at a stage, in the order in which they act.

    Of forms with the same memory there is one.
    """
    return _acts(_Itself(robot)).get(stage, ()) if robot.effects else ()


@lru_cache(maxsize=256)  # a diagnosis asks for a few dozen robots again and again, trial by trial
def _acts(key: _Itself) -> Mapping[Stage, tuple[Act, ...]]:
    given = key.robot.effects
    found: dict[Stage, tuple[Act, ...]] = {}
    for name, effect in EFFECTS.items():
        if name not in given:
            continue
        if any(MARK in item for item in given[name]):
            raise InputError(
                f"{key.robot.name}: effects.{name}.varies: `simulate`, `statics` and `diagnose` know a "
                "number that varies; what is asked here takes it at one value"
            )
        values = MappingProxyType({item: float(value) for item, value in given[name].items()})
        memories: list[Memory] = []
        for form in effect.forms:
            if form.memory is not None:
                if form.memory in memories:
                    continue
                memories.append(form.memory)
            found[form.stage] = (*found.get(form.stage, ()), Act(name, form, values))
    return found


def with_built_in_effects(robot: R) -> R:
    """Return `robot` with its effects put into the specification, and none left to apply.

    What acts on inputs, on its shape and on what is observed is not in it: see `arriving_inputs`, `shaped`
    and `observed`.
    """
    changed = robot
    for act in (*acts(robot, Stage.SPECIFICATION), *acts(robot, Stage.LAW)):
        if act.form.specify is not None:
            changed = act.form.specify(changed, act.values)
    return cast(R, replace(changed, effects={}))


def arriving_inputs(robot: RobotSpec, inputs: Inputs, moving: bool = False) -> Inputs:
    """Return what arrives at the robot when `inputs` are commanded.

    Args:
        robot: with its effects.
        inputs: as commanded.
        moving: the robot is at rest under its first row, which has been commanded for long; otherwise it is
            at rest under zero inputs.

    Raises:
        InputError: time stands still, and an effect that needs it is in force.
    """
    for act in acts(robot, Stage.COMMAND):
        if act.form.command is not None:
            inputs = pulled_only(act.form.command(robot, inputs, act.values))
        memory = act.form.memory
        rest = inputs.tendon[0] if moving and len(inputs) else np.zeros(inputs.tendon.shape[1:])
        if memory is not None and memory.start(robot, act.values, rest) is not None:
            time_s = _elapsed_s(inputs.time_s, act.effect) if memory.timed else inputs.time_s
            tendon = memory.series(robot, act.values, rest, time_s, inputs.tendon)
            inputs = pulled_only(replace(inputs, tendon=tendon))
    return inputs


def pulled_only(inputs: Inputs) -> Inputs:
    """Return `inputs` without tensions below zero: a tendon cannot push."""
    tendon = pulls_alone(inputs.actuation, inputs.tendon)
    return inputs if tendon is inputs.tendon else replace(inputs, tendon=tendon)


def _elapsed_s(time_s: Array, effect: str) -> Array:
    """Return the time since the trial's start, its first row, shape (r,) [s].

    Raises:
        InputError: the clock stands still or runs back.
    """
    stands = np.diff(time_s) <= 0.0
    if stands.any():
        row = int(np.argmax(stands)) + 1
        raise InputError(
            f"effects.{effect}: time_s = {time_s[row]:g} at row {row + 1} does not increase: "
            "this effect needs the time of every row"
        )
    return time_s - time_s[0]


def reshaping(robot: RobotSpec) -> list[str]:
    """Return the effects that act on the shape of `robot`."""
    return [
        act.effect
        for act in acts(robot, Stage.SHAPE)
        if any(item.name in act.values for item in act.form.parameters(robot))
    ]


def reshapes(robot: RobotSpec) -> bool:
    """Return whether an effect acts on the shape of `robot`: it then takes all elements to know one."""
    return bool(reshaping(robot))


def shaped(robot: RobotSpec, p_w: Array, R_w: Array) -> tuple[Array, Array]:
    """Return where the robot's elements are, with what acts on its shape.

    Args:
        robot: with its effects.
        p_w: centres of all elements' distal faces without that, base to tip, shape (..., n, 3) [m].
        R_w: their orientations, shape (..., n, 3, 3).
    """
    for act in acts(robot, Stage.SHAPE):
        if act.form.shape is not None:
            p_w, R_w = act.form.shape(robot, p_w, R_w, act.values)
    return p_w, R_w


def sees_otherwise(robot: RobotSpec) -> bool:
    """Return whether an effect acts on what is measured of `robot`."""
    return bool(acts(robot, Stage.OBSERVATION))


def remembers_what_was_seen(robot: RobotSpec) -> bool:
    """Return whether what is observed depends on earlier rows, so that none may be left out before."""
    nothing = np.zeros(1)
    return any(
        act.form.memory is not None and act.form.memory.start(robot, act.values, nothing) is not None
        for act in acts(robot, Stage.OBSERVATION)
    )


def measured(robot: RobotSpec, true: Observed) -> Observed:
    """Return what is measured of the robot when `true` is the case, row after row.

    What remembers has watched long enough before the first row to show it as it is. Orientations that are
    mixed from those before are the rotations nearest to the mean of their matrices. Tensions are measured
    at the actuators, with the inputs, and stay as they are.

    Raises:
        InputError: time stands still, and an effect that needs it is in force.
    """
    if not len(true.time_s):
        return true
    for act in acts(robot, Stage.OBSERVATION):
        if act.form.observe is not None:
            true = act.form.observe(true, act.values)
        memory = act.form.memory
        if (
            memory is not None
            and memory.start(robot, act.values, np.zeros(1)) is not None
            and len(true.time_s)
        ):
            time_s = _elapsed_s(true.time_s, act.effect) if memory.timed else true.time_s
            p_w, R_w, angles = (
                memory.series(robot, act.values, rows[0], time_s, rows)
                for rows in (true.p_w, true.R_w, true.joint_angles)
            )
            true = replace(true, p_w=p_w, R_w=nearest_rotations(R_w), joint_angles=angles)
    return true


def nearest_rotations(matrices: Array) -> Array:
    """Return the rotations nearest to matrices (..., 3, 3), by their entries; NaN where one is not finite."""
    result = np.full(matrices.shape, np.nan)
    finite = np.isfinite(matrices).all(axis=(-2, -1))
    left, _, right = np.linalg.svd(matrices[finite])
    turned = np.linalg.det(left @ right) < 0.0
    left[turned, :, -1] *= -1.0
    result[finite] = left @ right
    return result


def observed(robot: RobotSpec, time_s: Array, postures: tuple[Posture, ...]) -> tuple[Posture, ...]:
    """Return what is measured when the robot is in `postures`, one at each of the times (r,) [s]."""
    if not postures or not (reshapes(robot) or sees_otherwise(robot)):
        return postures
    names = ("p_w", "R_w", "joint_angles", "actuator_tension")
    p_w, R_w, *others = (np.array([getattr(posture, name) for posture in postures]) for name in names)
    p_w, R_w = shaped(robot, p_w, R_w)
    count = p_w.shape[1]
    if robot.markers:  # points like the others
        p_w = np.concatenate([p_w, marker_points(robot.markers, p_w, R_w)], axis=1)
    now = measured(robot, Observed(time_s[: len(postures)], p_w, R_w, *others))
    return tuple(
        replace(
            posture,
            p_w=now.p_w[row, :count],
            R_w=now.R_w[row],
            joint_angles=now.joint_angles[row],
            markers_w=now.p_w[row, count:] if robot.markers else None,
        )
        for row, posture in enumerate(postures)
    )


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
        """Return what is measured when the robot is in `postures`, one for each of the first rows."""
        return observed(self.specified, self.inputs.time_s, postures)


def in_force(robot: R, inputs: Inputs, where: str = "", moving: bool = False) -> InForce[R]:
    """Return the effects of `robot` in force along `inputs`, as they are commanded.

    Units of parameters are those of the inputs: N where tensions drive the robot, else mm. `where` is what
    to call the robot in an error, by default its name; `moving` as of `arriving_inputs`.

    Raises:
        InputError: an effect or a value is not possible, or the robot is not with them.
    """
    if not robot.effects:
        return InForce(robot, robot, inputs)
    specified = driven_by(robot, inputs.actuation)
    return InForce(specified, built_in(specified, where), arriving_inputs(specified, inputs, moving))


def built_in(robot: R, where: str = "") -> R:
    """Return `with_built_in_effects(robot)`, checked; a robot without effects is returned as it is.

    Raises:
        InputError: an effect or a value is not possible, or the robot is not with them.
    """
    if not robot.effects:
        return robot
    check_effects(robot)
    changed = with_built_in_effects(robot)
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
            "which steps of a simulator do not; `simulate` and environments do, "
            "`effects.apply.with_built_in_effects` leaves it out"
        )
    return changed


def outside_the_robot(robot: RobotSpec) -> list[str]:
    """Return the effects that act on inputs or outputs: `with_built_in_effects` leaves them out.

    Tried out on a history of inputs in which every tendon moves, on a shape, and on a frame.
    """
    rows, tendons = 4, len(robot.tendons)
    unit = quantity_of(robot.actuation).file_size
    moved = unit * np.linspace(1.0, 2.0, rows * tendons).reshape(rows, tendons)
    still = np.zeros((rows, 3))
    probe = Inputs(np.arange(float(rows)), robot.actuation, moved, still, still)
    frames = np.tile([0.1, 0.2, 0.3], (rows, 1, 1)), np.tile(np.eye(3), (rows, 1, 1, 1))
    look = Observed(probe.time_s, *frames, np.zeros((rows, 1)), moved)
    found: dict[str, None] = {}
    for act in (
        *acts(robot, Stage.COMMAND),
        *acts(robot, Stage.SHAPE),
        *acts(robot, Stage.OBSERVATION),
    ):
        form, memory = act.form, act.form.memory
        changes = memory is not None and memory.start(robot, act.values, moved[0]) is not None
        if form.command is not None:
            changes = _differ(form.command(robot, probe, act.values), probe)
        if form.shape is not None:
            p_w, R_w = form.shape(robot, look.p_w, look.R_w, act.values)
            changes = _differ(replace(look, p_w=p_w, R_w=R_w), look)
        if form.observe is not None:
            changes = _differ(form.observe(look, act.values), look)
        if changes:
            found[act.effect] = None
    return list(found)


def _differ(first: Inputs | Observed, second: Inputs | Observed) -> bool:
    """Return whether a value of arrays differs from another."""
    names: Iterable[str] = [name for name, value in vars(first).items() if isinstance(value, np.ndarray)]
    return any(not np.array_equal(getattr(first, name), getattr(second, name)) for name in names)


def with_effects(robot: R, effects: Mapping[str, Mapping[str, float]]) -> R:
    """Return `robot` with exactly these effects; values as in `robot.effects`."""
    return replace(robot, effects={name: dict(values) for name, values in effects.items()})


# ----------------------------------------------------------------------------------------------------
# A robot's effects step by step, for whoever moves it without knowing the way beforehand.
#
# The memories' steps are those whose series `apply` takes along a whole history.


class _Remembered:
    """Where a memory is on its way.

    Attributes:
        now: what comes out.
    """

    def __init__(self, robot: RobotSpec, act: Act, rest: Array) -> None:
        memory = act.form.memory
        assert memory is not None
        self._memory: Memory = memory
        self._state: Any = memory.start(robot, act.values, rest)
        self._before = self.now = rest

    @property
    def acts(self) -> bool:
        """Whether it does anything."""
        return self._state is not None

    def step(self, after: Array, dt_s: float) -> Array:
        """Return what comes out when what goes in has moved to `after`."""
        if not self.acts:
            return after
        self._state, self.now = self._memory.step(self._state, self._before, after, dt_s)
        self._before = after
        return self.now


class ArrivingCommands:
    """From each command of a robot to what arrives at it.

    Attributes:
        change: whether anything else arrives than what is commanded.
    """

    def __init__(self, robot: RobotSpec) -> None:
        self._robot = robot
        self._acts = acts(robot, Stage.COMMAND)
        self.reset()
        self.change = any(act.form.command is not None for act in self._acts) or any(
            item.acts for item in self._memories.values()
        )

    def reset(self) -> None:
        """Return to rest, all inputs zero. The first step after it should take no time."""
        rest = np.zeros(len(self._robot.tendons))
        self._memories = {
            index: _Remembered(self._robot, act, rest)
            for index, act in enumerate(self._acts)
            if act.form.memory is not None
        }

    def step(self, tendon: Array, dt_s: float) -> tuple[Array, Array, Array]:
        """Return what arrives when the inputs of the tendons, shape (t,), have moved to `tendon`.

        That is their inputs, and force and moment on the tip, shape (3,) each [N, N m].
        """
        nothing = np.zeros((1, 3))
        inputs = Inputs(np.zeros(1), self._robot.actuation, tendon[np.newaxis], nothing, nothing)
        for index, act in enumerate(self._acts):
            if act.form.command is not None:
                inputs = pulled_only(act.form.command(self._robot, inputs, act.values))
            if index in self._memories:
                arrived = self._memories[index].step(inputs.tendon[0], dt_s)
                inputs = pulled_only(replace(inputs, tendon=arrived[np.newaxis]))
        return inputs.tendon[0], inputs.force_tip[0], inputs.moment_tip[0]


class Sight:
    """What is measured of something of a robot, from each look to the next.

    What remembers has watched long enough before the first look to show it as it is.
    """

    def __init__(self, robot: RobotSpec) -> None:
        self._robot = robot
        self._acts = acts(robot, Stage.OBSERVATION)
        self._memories: dict[tuple[int, int], _Remembered] = {}

    def look(self, p_w: Array, R_w: Array, dt_s: float) -> tuple[Array, Array]:
        """Return what is measured of positions (..., 3) [m] and orientations (..., 3, 3).

        `dt_s` is the time since the last look.
        """
        for index, act in enumerate(self._acts):
            if act.form.observe is not None:
                none = np.zeros(0)
                now = act.form.observe(Observed(none, p_w, R_w, none, none), act.values)
                p_w, R_w = now.p_w, now.R_w
            if act.form.memory is not None:
                p_w = self._remembered(index, 0, act, p_w).step(p_w, dt_s)
                frames = self._remembered(index, 1, act, R_w)
                R_w = nearest_rotations(frames.step(R_w, dt_s)) if frames.acts else R_w
        return p_w, R_w

    def _remembered(self, index: int, what: int, act: Act, now: Array) -> _Remembered:
        """Return the memory of one thing seen, which begins as it is."""
        if (index, what) not in self._memories:
            self._memories[index, what] = _Remembered(self._robot, act, now)
        return self._memories[index, what]
