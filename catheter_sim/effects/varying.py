"""Puts numbers of causes that vary into effect: along the robot, over time, with inputs, with the past.

How it acts is the same for every cause, kind and stage (`core.variation` says what may vary with what). The
robot is computed with the number at a few fixed values, its knots, and what comes out is interpolated row
by row. It is exact where the value of a row is a knot, as of a step. Elsewhere it is a parabola through
three. Along the robot each element's own motion relative to the one before it is taken from the robot
that has the element's value. What loads an element is then that robot's: a change of a part does not
change what the others carry.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import product
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import channel_inputs, drives_of, input_channels
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.core.variation import MARK, SHAPES, Variation, variation_of
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import nearest_rotations
from catheter_sim.errors import InputError, unknown

KNOTS = 3
"""[values] At which a robot is computed whose number takes more than so many. Why: of a stiffness or a
gain that changes by a third a parabola through three is within 2 % of the change
(`tests/effects/test_varying.py`)."""
STILL_SHARE = 1e-3
"""[share of an input's largest size] A way back by less is no turn. Why: noise of a sensor of the inputs
is of this size, a step of a motion is ten times larger."""


# ----------------------------------------------------------------------------------------------------
# What a number varies with, row by row.


def course(robot: RobotSpec, inputs: Inputs, item: Variation) -> Array:
    """Return how far a variation has come at each row, shape (r,), of all but those along the robot."""
    found = [
        SHAPES[each.shape].of(argument(robot, inputs, each.along, each.channel), each.at)
        for each in item.courses
    ]
    return np.asarray(np.prod(found, axis=0))


def argument(robot: RobotSpec, inputs: Inputs, along: str, channel: str = "") -> Array:
    """Return what numbers vary with at each row, shape (r,), in the unit of `Variation.at`.

    Raises:
        InputError: the robot has no such channel.
    """
    if along == "time":
        return inputs.time_s - inputs.time_s[0] if len(inputs) else inputs.time_s
    names = input_channels(robot, inputs.actuation)
    if channel not in names:
        raise unknown("channel", channel, names, f"{robot.name}: varies with {along}")
    which = names.index(channel)
    size = drives_of(robot, inputs.actuation)[which].quantity.file_size
    level = channel_inputs(robot, inputs)[:, which] / size
    if along == "level":
        return np.abs(level)
    if along == "sign":
        return level
    if along == "largest":
        return np.maximum.accumulate(np.abs(level)) if len(level) else level
    way = np.diff(level, prepend=0.0)
    if along == "path":
        return np.cumsum(np.abs(way))
    direction, turns = _turns(np.abs(level) if along == "outward" else level)
    return turns if along == "turns" else direction


def _turns(level: Array) -> tuple[Array, Array]:
    """Return the direction of an input at each row, 1 up, -1 down, 0 before it moves; and its turns."""
    least = STILL_SHARE * float(np.max(np.abs(level), initial=0.0))
    direction, count, extreme = 0.0, 0, 0.0
    found = np.zeros((2, len(level)))
    for row, value in enumerate(level):
        if direction == 0.0:
            if abs(value - extreme) > least:
                direction, extreme = float(np.sign(value - extreme)), value
        elif (value - extreme) * direction >= 0.0:
            extreme = value
        elif abs(value - extreme) > least:
            direction, extreme, count = -direction, value, count + 1
        found[:, row] = direction, count
    return found[0], found[1]


# ----------------------------------------------------------------------------------------------------
# A robot whose numbers vary, as robots whose numbers do not, and how these are mixed.


def varies(robot: RobotSpec) -> bool:
    """Return whether a number of one of the robot's effects varies."""
    return any(MARK in name for values in robot.effects.values() for name in values)


def without_variations(robot: R) -> R:
    """Return a robot whose numbers stay at their own values."""
    effects = {
        effect: {name: value for name, value in values.items() if MARK not in name}
        for effect, values in robot.effects.items()
    }
    return replace(robot, effects=effects) if varies(robot) else robot


@dataclass(frozen=True)
class Mixed:
    """Robots whose numbers do not vary, in the place of one whose do.

    Attributes:
        robots: K * L of them, those of one set of row values together.
        rows: weight of each of the K sets at each row, shape (K, r).
        places: weight of each of a set's L robots at each element, shape (L, n); None: L is 1.
    """

    robots: tuple[Any, ...]
    rows: Array
    places: Array | None


def mixed(robot: RobotSpec, inputs: Inputs, elements: int) -> Mixed:
    """Return the robots of which one is mixed whose numbers vary along `inputs`; it has so many `elements`.

    Raises:
        InputError: an effect has no such number, or one varies along the robot and from row to row.
    """
    plain = without_variations(robot)
    by_row: list[tuple[tuple[str, str], Array, Array]] = []  # number, its knots, their weights
    by_place: list[tuple[tuple[str, str], Array, Array]] = []
    for (effect, number), items in _varied(robot).items():
        base = EFFECTS[effect].parameter(robot, number)
        if base is None:
            raise InputError(f"{robot.name}: effects.{effect}: no number {number!r} that may vary")
        own = base.to_fit(robot.effects[effect].get(number, base.null))
        along = [(item, by) for item, by in items if item.along == "place"]
        rest = [(item, by) for item, by in items if item.along != "place"]
        if along and rest:
            raise InputError(f"{robot.name}: effects.{effect}.{number}: varies along the robot or with rows")
        if along:
            places = (np.arange(elements) + 0.5) / elements
            values = own + sum(by * SHAPES[item.shape].of(places, item.at) for item, by in along)
        else:
            values = own + sum(by * course(robot, inputs, item) for item, by in rest)
        knots, weights = _knots(np.clip(values, *base.fit_bounds), most=elements if along else KNOTS)
        where = by_place if along else by_row
        where.append(((effect, number), np.array([base.from_fit(float(knot)) for knot in knots]), weights))
    sets, rows = _products(by_row, len(inputs))
    leaves, places = _products(by_place, elements)
    robots = tuple(_with_numbers(plain, {**first, **second}) for first in sets for second in leaves)
    return Mixed(robots, rows, places if by_place else None)


def _varied(robot: RobotSpec) -> dict[tuple[str, str], list[tuple[Variation, float]]]:
    """Return the variations of each number, by effect and parameter, with how much each is."""
    found: dict[tuple[str, str], list[tuple[Variation, float]]] = {}
    for effect, values in robot.effects.items():
        for name, by in values.items():
            if MARK in name:
                item = variation_of(name)
                found.setdefault((effect, item.number), []).append((item, float(by)))
    return found


def _knots(values: Array, most: int) -> tuple[Array, Array]:
    """Return the values at which to compute (k,), and the weight of each at each of `values`, (k, r)."""
    distinct = np.unique(values)
    if len(distinct) <= max(most, 2):
        return distinct, (values == distinct[:, np.newaxis]).astype(float)
    knots = np.linspace(distinct[0], distinct[-1], most)
    weights = np.ones((most, len(values)))
    for one, other in product(range(most), repeat=2):
        if one != other:
            weights[one] *= (values - knots[other]) / (knots[one] - knots[other])
    return knots, weights


def _products(
    groups: Sequence[tuple[tuple[str, str], Array, Array]], length: int
) -> tuple[list[dict[tuple[str, str], float]], Array]:
    """Return every choice of one knot of each number, and the product of their weights, shape (K, length)."""
    choices = list(product(*(range(len(knots)) for _, knots, _ in groups)))
    sets = [
        {key: float(knots[index]) for index, (key, knots, _) in zip(choice, groups, strict=True)}
        for choice in choices
    ]
    weights = [
        reduce(
            np.multiply,
            (own[index] for index, (_, _, own) in zip(choice, groups, strict=True)),
            np.ones(length),
        )
        for choice in choices
    ]
    return sets, np.array(weights)


def _with_numbers(robot: RobotSpec, numbers: Mapping[tuple[str, str], float]) -> RobotSpec:
    effects = {effect: dict(values) for effect, values in robot.effects.items()}
    for (effect, number), value in numbers.items():
        effects.setdefault(effect, {})[number] = value
    return replace(robot, effects=effects)


# ----------------------------------------------------------------------------------------------------
# Shapes of several robots, mixed element by element.


def mixed_shapes(p_w: Array, R_w: Array, weights: Array) -> tuple[Array, Array]:
    """Return where elements are whose own motions are those of several robots, mixed.

    Args:
        p_w: of each robot's elements, base to tip, shape (L, r, n, 3) [m].
        R_w: their orientations, shape (L, r, n, 3, 3).
        weights: of each robot at each element, summing to 1, shape (L, n).

    Returns:
        Positions (r, n, 3) and orientations (r, n, 3, 3).
    """
    rows, count = p_w.shape[1:3]
    p, R = np.zeros((rows, 3)), np.tile(np.eye(3), (rows, 1, 1))
    found_p, found_R = np.empty(p_w.shape[1:]), np.empty(R_w.shape[1:])
    for element in range(count):
        way, turn = np.zeros((rows, 3)), np.zeros((rows, 3, 3))
        for which in np.flatnonzero(weights[:, element]):
            share = weights[which, element]
            before_p = p_w[which, :, element - 1] if element else np.zeros((rows, 3))
            before_R = R_w[which, :, element - 1] if element else np.tile(np.eye(3), (rows, 1, 1))
            back = before_R.transpose(0, 2, 1)
            way += share * np.einsum("rij,rj->ri", back, p_w[which, :, element] - before_p)
            turn += share * (back @ R_w[which, :, element])
        if np.count_nonzero(weights[:, element]) > 1:
            turn = nearest_rotations(turn)
        p, R = p + np.einsum("rij,rj->ri", R, way), R @ turn
        found_p[:, element], found_R[:, element] = p, R
    return found_p, found_R


def mixed_angles(angles: Array, weights: Array) -> Array:
    """Return joints' angles (r, j) of those of L robots, (L, r, j): each joint goes with its element.

    `weights`: of each robot at each element, shape (L, n).
    """
    joints, count = angles.shape[2], weights.shape[1]
    at = np.minimum(np.arange(joints) * count // max(joints, 1), count - 1)
    return np.asarray(np.einsum("lrj,lj->rj", angles, weights[:, at]))


def mixed_tensions(tensions: Array, weights: Array) -> Array:
    """Return tensions (r, ...) of those of L robots, (L, r, ...): the mean by their `weights` (L, n)."""
    return np.asarray(np.einsum("l,l...->...", weights.mean(axis=1), tensions))


def mixed_postures(mix: Mixed, runs: Sequence[Sequence[Posture]]) -> tuple[Posture, ...]:
    """Return the postures of a robot whose numbers vary, from those of the robots that it is mixed of."""
    count = min(len(run) for run in runs)
    parts = {
        name: np.array([[getattr(posture, name) for posture in run[:count]] for run in runs])
        for name in ("p_w", "R_w", "joint_angles", "actuator_tension", "tendon_tension", "markers_w")
        if runs[0][:1] and getattr(runs[0][0], name) is not None
    }
    if not count:
        return ()
    if mix.places is not None:
        parts = _by_element(mix, parts)
    by_row = {name: np.einsum("kr,kr...->r...", mix.rows[:, :count], own) for name, own in parts.items()}
    by_row["R_w"] = nearest_rotations(by_row["R_w"])
    return tuple(Posture(**{name: own[row] for name, own in by_row.items()}) for row in range(count))


def _by_element(mix: Mixed, parts: Mapping[str, Array]) -> dict[str, Array]:
    """Return parts of postures (K * L, r, ...), each set of L mixed element by element, (K, r, ...)."""
    assert mix.places is not None
    sets = {name: own.reshape(len(mix.rows), len(mix.places), *own.shape[1:]) for name, own in parts.items()}
    shapes = [mixed_shapes(p, R, mix.places) for p, R in zip(sets["p_w"], sets["R_w"], strict=True)]
    found = {name: np.array([mixed_tensions(each, mix.places) for each in own]) for name, own in sets.items()}
    found["joint_angles"] = np.array([mixed_angles(each, mix.places) for each in sets["joint_angles"]])
    found["p_w"], found["R_w"] = (np.array(part) for part in zip(*shapes, strict=True))
    return found
