"""What fits go by: outputs of many robots with effects along commanded inputs, in file units, fast.

A diagnosis asks for the outputs of many robots that differ in a few numbers. A kind's twin
(`robots/<kind>/twin.py`) says where the robots are; their effects and the output columns are put around it
here, once for all kinds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import Shown, StateRows, outputs_of, shown_by, with_markers, write_columns
from catheter_sim.core.inputs import Inputs, numbers_of, with_tip_weight
from catheter_sim.core.posture import Observed
from catheter_sim.core.robot import RobotSpec
from catheter_sim.core.statics import OneByOne, Twin, TwinStates
from catheter_sim.effects.apply import (
    arriving_inputs,
    measured,
    remembers_what_was_seen,
    reshapes,
    sees_otherwise,
    shaped,
    with_built_in_effects,
)
from catheter_sim.effects.varying import mixed, mixed_angles, mixed_shapes, mixed_tensions, varies
from catheter_sim.robots import kind_of
from catheter_sim.simulation.moving_twin import MovingTwin
from catheter_sim.theory.static_models import STATIC_MODELS

# (robots with effects, alike but for their numbers; commanded inputs; every how many rows)
# -> outputs in file units, (B, r, o); NaN of a row without balance
Predict = Callable[[Sequence[Any], Inputs, int], Array]


@dataclass(frozen=True)
class Prediction:
    """Outputs by a twin; a value, so that it can be sent to other processes.

    Attributes:
        twin: of the robots' kind.
        shown: the output columns wanted.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
    """

    twin: Twin[Any]
    shown: Shown
    gravity_mps2: Array

    def __call__(self, robots: Sequence[RobotSpec], inputs: Inputs, every: int = 1) -> Array:
        """Return the outputs of `robots` at each `every`-th row, shape (B, r, o); NaN: no balance.

        The other rows still make the history.
        """
        return self.along(robots, [inputs], every)[0]

    def along(self, robots: Sequence[RobotSpec], trials: Sequence[Inputs], every: int = 1) -> list[Array]:
        """Return the outputs of `robots` along each of several trials, in order."""
        if any(varies(robot) for robot in robots):
            return [self._varied(robots, inputs, every) for inputs in trials]
        solved = self._solved(robots, trials, self._elements(robots), every)
        return [
            self._outputs(robots, inputs, states, which, every)
            for inputs, (states, which) in zip(trials, solved, strict=True)
        ]

    def _solved(
        self, robots: Sequence[RobotSpec], trials: Sequence[Inputs], elements: Sequence[int], every: int
    ) -> list[tuple[TwinStates, list[int]]]:
        """Return the states of the distinct ones among robots along each trial, and which each one is."""
        built_in, step = _built_in(robots), _step(robots, every)
        found = []
        for inputs in trials:
            distinct, arriving, which = _distinct(robots, built_in, inputs, self.gravity_mps2)
            found.append((self.twin.solve(distinct, arriving, self.gravity_mps2, elements, step), which))
        return found

    def _varied(self, robots: Sequence[RobotSpec], inputs: Inputs, every: int) -> Array:
        """Return the outputs of robots of which numbers vary, shape (B, r, o)."""
        count = outputs_of(robots[0]).elements
        mixes = [mixed(robot, inputs, count) for robot in robots]
        leaves = [leaf for mix in mixes for leaf in mix.robots]
        places = [mix.places for mix in mixes for _ in mix.rows]
        whole = any(item is not None for item in places)
        elements = range(count) if whole else self._elements(leaves)
        ((states, which),) = self._solved(leaves, [inputs], elements, every)
        outputs = self._outputs(leaves, inputs, states, which, every, places if whole else ())
        ends = np.cumsum([len(mix.rows) for mix in mixes])
        parts = np.split(outputs, ends[:-1])
        return np.array(
            [
                np.einsum("kr,kro->ro", mix.rows[:, ::every], part)
                for mix, part in zip(mixes, parts, strict=True)
            ]
        )

    def of_histories(self, robot: RobotSpec, histories: Sequence[Inputs]) -> Array:
        """Return the outputs of one robot along several histories of as many rows, shape (B, r, o).

        NaN of a row without balance.

        Args:
            robot: with its effects.
            histories: as commanded, each from rest, at the same times.
        """
        if varies(robot):
            return np.array([self([robot], item)[0] for item in histories])
        built_in = with_built_in_effects(robot)
        arriving = [
            with_tip_weight(arriving_inputs(robot, item), built_in.tip_mass_kg, self.gravity_mps2)
            for item in histories
        ]
        robots = [built_in] * len(arriving)
        states = self.twin.solve(robots, arriving, self.gravity_mps2, self._elements([robot]), 1)
        return self._outputs([robot] * len(arriving), histories[0], states, range(len(arriving)), 1)

    def _elements(self, robots: Sequence[RobotSpec]) -> Sequence[int]:
        """Return the elements whose states it takes to show what is wanted of `robots`."""
        if any(reshapes(robot) for robot in robots):
            return range(outputs_of(robots[0]).elements)
        return self.shown.elements

    def _outputs(
        self,
        robots: Sequence[RobotSpec],
        inputs: Inputs,
        states: TwinStates,
        which: Sequence[int],
        every: int,
        places: Sequence[Array | None] = (),
    ) -> Array:
        """Return the outputs of robots whose states are those of `which`, shape (B, r, o).

        `places`: of which several are one, mixed element by element: the weights of each (`Mixed.places`).
        """
        step = _step(robots, every)
        if list(which) != list(range(len(states.tension))):
            states = _repeated(states, which)
        if any(reshapes(robot) for robot in robots):
            states = _shaped(robots, states, range(states.p_w.shape[2]) if places else self.shown.elements)
        if places:
            states, first = _mixed_by_element(states, places, self.shown.elements)
            robots = [robots[index] for index in first]
        if self.shown.markers:
            states = replace(states, p_w=with_markers(self.shown, robots, states.p_w, states.R_w))
        if any(sees_otherwise(robot) for robot in robots):
            states = _observed(robots, states, inputs.time_s[::step], self.shown.tip)
        R_w = None if self.shown.tip is None else states.R_w[:, :, self.shown.tip]
        outputs = write_columns(self.shown, StateRows(states.p_w, R_w, states.joint_angles, states.tension))
        return outputs if step == every else outputs[:, ::every]


@dataclass(frozen=True)
class MovingPrediction(Prediction):
    """Outputs of robots in motion, by the simulation; trials are simulated side by side.

    Each trial starts at rest under its first row.
    """

    twin: MovingTwin

    def _solved(
        self, robots: Sequence[RobotSpec], trials: Sequence[Inputs], elements: Sequence[int], every: int
    ) -> list[tuple[TwinStates, list[int]]]:
        """Return the states of the distinct ones among robots along each trial, and which each one is."""
        built_in = _built_in(robots)
        asked = [_distinct(robots, built_in, inputs, moving=True) for inputs in trials]
        found = self.twin.solve_trials(
            [(distinct, arriving) for distinct, arriving, _ in asked],
            self.gravity_mps2,
            elements,
            _step(robots, every),
        )
        return [(states, which) for states, (_, _, which) in zip(found, asked, strict=True)]


def along(
    predict: Predict, robots: Sequence[RobotSpec], trials: Sequence[Inputs], every: int = 1
) -> list[Array]:
    """Return what `predict` says of robots along each of several trials, side by side where it can."""
    if isinstance(predict, Prediction):
        return predict.along(robots, trials, every)
    return [predict(robots, inputs, every) for inputs in trials]


def _step(robots: Sequence[RobotSpec], every: int) -> int:
    """Return every how many rows states are wanted: what an effect shows late depends on rows left out."""
    return 1 if any(remembers_what_was_seen(robot) for robot in robots) else every


def _built_in(robots: Sequence[RobotSpec]) -> list[RobotSpec]:
    """Return robots with their effects built in, without markers; of equal ones the same object."""
    found: list[RobotSpec] = []
    for robot in robots:
        own = with_built_in_effects(robot)
        if own.markers:  # they are only seen
            own = replace(own, markers=())
        found.append(next((item for item in found if item == own), own))
    return found


def _distinct(
    robots: Sequence[RobotSpec],
    built_in: Sequence[RobotSpec],
    inputs: Inputs,
    gravity_mps2: Array | None = None,
    moving: bool = False,
) -> tuple[list[RobotSpec], list[Inputs], list[int]]:
    """Return robots with their effects built in, what arrives at them, and which of these each one is.

    Robots that differ in what is seen of them alone are the same. With `gravity_mps2` the weight at their
    tips arrives with the inputs.

    Args:
        robots: with their effects.
        built_in: these with their effects built in (`_built_in`).
        inputs: as commanded.
        gravity_mps2: shape (3,) [m/s^2].
        moving: as for `arriving_inputs`.
    """
    distinct: dict[tuple[object, ...], tuple[int, RobotSpec, Inputs]] = {}
    which = []
    for robot, own in zip(robots, built_in, strict=True):
        arriving = arriving_inputs(robot, inputs, moving)
        if gravity_mps2 is not None:
            arriving = with_tip_weight(arriving, own.tip_mass_kg, gravity_mps2)
        key = (id(own), *numbers_of(arriving))
        which.append(distinct.setdefault(key, (len(distinct), own, arriving))[0])
    return [own for _, own, _ in distinct.values()], [item for _, _, item in distinct.values()], which


def _repeated(states: TwinStates, which: Sequence[int]) -> TwinStates:
    """Return the states of robots of which several are the same."""
    rows = np.array(which)
    return TwinStates(
        states.p_w[rows], states.R_w[rows], lambda: states.joint_angles()[rows], states.tension[rows]
    )


def twin_for(robot: RobotSpec, actuation: str, columns: Sequence[str], gravity_mps2: Array) -> Prediction:
    """Return what fits go by for robots like `robot` driven by `actuation`.

    Args:
        robot: of which the others differ in numbers only.
        actuation: "tension" or "displacement".
        columns: the output columns wanted.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
    """
    twin = kind_of(robot).twin.twin(robot, actuation)
    return Prediction(twin, shown_by(robot, columns), gravity_mps2)


def moving_twin_for(
    robot: RobotSpec, actuation: str, columns: Sequence[str], gravity_mps2: Array
) -> MovingPrediction:
    """Return what fits go by where robots like `robot` move: the simulation; arguments as of `twin_for`."""
    return MovingPrediction(MovingTwin(), shown_by(robot, columns), gravity_mps2)


def by_static_model(model: str, robot: RobotSpec, columns: Sequence[str], gravity_mps2: Array) -> Prediction:
    """Return outputs of robots like `robot` by any static model, one robot after another.

    Args:
        model: its name.
        robot, columns, gravity_mps2: as in `twin_for`.
    """
    twin = OneByOne(STATIC_MODELS[model].model, len(outputs_of(robot).joints))
    return Prediction(twin, shown_by(robot, columns), gravity_mps2)


def _shaped(robots: Sequence[RobotSpec], states: TwinStates, elements: Sequence[int]) -> TwinStates:
    """Return some elements' states of robots on whose shape effects act; `states` are of all elements."""
    found = [shaped(*own) for own in zip(robots, states.p_w, states.R_w, strict=True)]
    wanted = list(elements)
    p_w, R_w = (np.array(part)[:, :, wanted] for part in zip(*found, strict=True))
    return replace(states, p_w=p_w, R_w=R_w)


def _mixed_by_element(
    states: TwinStates, places: Sequence[Array | None], elements: Sequence[int]
) -> tuple[TwinStates, list[int]]:
    """Return some elements' states of robots that are mixed of several, and the first one of each.

    A joint's angle is that of the robot whose element it belongs to; a tension is the mean by weight.

    Args:
        states: of all elements of the robots that are mixed, those of one after one another.
        places: weight of each at each element, shape (L, n), of every robot; None: it is one by itself.
        elements: wanted.
    """
    counts = [1 if item is None else len(item) for item in places]
    first = [int(start) for start in np.cumsum([0, *counts[:-1]])]
    own = [slice(start, start + count) for start, count in zip(first, counts, strict=True)]
    shapes = [
        (states.p_w[part][0], states.R_w[part][0])
        if weights is None
        else mixed_shapes(states.p_w[part], states.R_w[part], weights)
        for part, weights in zip(own, places, strict=True)
    ]
    p_w, R_w = (np.array(part)[:, :, list(elements)] for part in zip(*shapes, strict=True))

    def angles() -> Array:
        every = states.joint_angles()
        found = []
        for part, weights in zip(own, places, strict=True):
            if weights is None:
                found.append(every[part][0])
                continue
            found.append(mixed_angles(every[part], weights))
        return np.array(found)

    tension = np.array(
        [
            states.tension[part][0] if weights is None else mixed_tensions(states.tension[part], weights)
            for part, weights in zip(own, places, strict=True)
        ]
    )
    return TwinStates(p_w, R_w, angles, tension), first


def _observed(robots: Sequence[RobotSpec], states: TwinStates, time_s: Array, tip: int | None) -> TwinStates:
    """Return what is measured of the states: positions, the tip's orientation if it is shown, and angles."""
    remember = any(remembers_what_was_seen(robot) for robot in robots)
    angles = states.joint_angles() if remember else np.empty((*states.tension.shape[:2], 0))
    tips = states.R_w[:, :, [] if tip is None else [tip]]
    rows = zip(states.p_w, tips, angles, states.tension, strict=True)
    found = [measured(robot, Observed(time_s, *own)) for robot, own in zip(robots, rows, strict=True)]
    p_w, tips, late, tension = (
        np.array([getattr(item, name) for item in found])
        for name in ("p_w", "R_w", "joint_angles", "tension")
    )
    R_w = states.R_w
    if tip is not None:
        R_w = R_w.copy()
        R_w[:, :, tip] = tips[:, :, 0]
    return TwinStates(p_w, R_w, (lambda: late) if remember else states.joint_angles, tension)
