"""A twin by the balance of chest_tube_2025 as printed: what a diagnosis would go by that believed it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.channels import posture_columns
from catheter_sim.core.inputs import Inputs
from catheter_sim.effects.apply import arriving_inputs, observed, with_built_in_effects
from catheter_sim.errors import InputError
from catheter_sim.robots.rolling.complete import NotBalanced, balanced, postures
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.robots.rolling.printed import printed_balance, solve_printed
from catheter_sim.robots.rolling.spec import RollingRobot

NO_GRAVITY = np.zeros(3)


@dataclass
class PrintedTwin:
    """Twin of a robot of rolling joints; rows have no history, so that all trials are solved at once.

    Attributes:
        columns: the output columns wanted.
        trials: inputs of all trials, the held-out ones too.
        start: postures of the robot as specified, of all rows, shape (r, n) [rad].
    """

    columns: tuple[str, ...]
    trials: tuple[Inputs, ...]
    start: np.ndarray
    _solved: tuple[Sequence[RollingRobot], list[list[np.ndarray]]] = ((), [])

    def __call__(self, robots: Sequence[RollingRobot], inputs: Inputs, every: int = 1) -> np.ndarray:
        """Return the outputs of `robots` at each `every`-th row, shape (B, r, o); NaN: no balance."""
        place = [k for k, item in enumerate(self.trials) if item is inputs]
        if not place:  # columns exchanged, say
            try:
                other = printed_twin(robots[0], self.columns, [inputs])
            except InputError:
                return np.full((len(robots), len(inputs.time_s[::every]), len(self.columns)), np.nan)
            return other(robots, inputs, every)
        if self._solved[0] is not robots:
            self._solved = robots, [self._outputs(robot) for robot in robots]
        return np.array([outputs[place[0]][::every] for outputs in self._solved[1]])

    def _outputs(self, robot: RollingRobot) -> list[np.ndarray]:
        arrived = joined([arriving_inputs(robot, item) for item in self.trials])
        chain = rolling_chain(with_built_in_effects(robot))

        def moments(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            found = printed_balance(
                chain, theta, arrived.tendon, NO_GRAVITY, arrived.force_tip, arrived.moment_tip
            )
            return found.unbalanced, found.jacobian

        try:
            theta = balanced(moments, self.start, chain.low, chain.high)
        except NotBalanced:
            values = np.full((len(arrived), len(self.columns)), np.nan)
        else:
            nothing = np.zeros((len(theta), chain.pulled, chain.joints))
            run = observed(robot, arrived.time_s, tuple(postures(chain, arrived, NO_GRAVITY, theta, nothing)))
            seen = posture_columns(robot, run)
            values = np.stack([seen[name] for name in self.columns], axis=1)
        return np.split(values, np.cumsum([len(item) for item in self.trials])[:-1])


def printed_twin(robot: RollingRobot, columns: Sequence[str], trials: Sequence[Inputs]) -> PrintedTwin:
    """Return the twin of `robot` for these trials."""
    start, _ = solve_printed(rolling_chain(robot), joined(trials), NO_GRAVITY)
    return PrintedTwin(tuple(columns), tuple(trials), start)


def joined(trials: Sequence[Inputs]) -> Inputs:
    """Return the rows of several trials one after another."""
    rows = (
        np.concatenate([getattr(item, name) for item in trials])
        for name in ("tendon", "force_tip", "moment_tip")
    )
    return Inputs(np.arange(float(sum(map(len, trials)))), "tension", *rows)
