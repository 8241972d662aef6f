"""Where a robot's inputs lead it: the twin asked about many next inputs that share a past.

Dry friction makes a posture depend on the way. Of that way the twin is given the last `REMEMBERED` rows, from
rest: a friction's memory fades as inputs go past where they turned before. What is forgotten by that, and
what the twin leaves out besides, shows when the whole way is simulated (`inverse`, corrections).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import check_effects
from catheter_sim.planning.drives import PlanDrives, inputs_at
from catheter_sim.planning.targets import Targets
from catheter_sim.theory.predict import Prediction, twin_for

REMEMBERED = 8  # rows of the way that lead to a posture
_SAME = 1e-9  # share of the robot's length, or rad: postures that differ by less are one
_PAIRS = 6  # of random inputs by which it is found out whether the way counts


class Forward:
    """A robot's answers to inputs, in the targets' columns.

    Attributes:
        drives: what is asked of the robot.
        targets: what is seen of it.
        remembers: whether a posture depends on the inputs before.
    """

    def __init__(self, robot: RobotSpec, drives: PlanDrives, targets: Targets, gravity_mps2: Array) -> None:
        """Prepare the twin of `robot`, as it is specified."""
        self.drives, self.targets = drives, targets
        self._robot = replace(robot, actuation=drives.actuation)
        check_effects(self._robot)
        self._twin: Prediction = twin_for(self._robot, drives.actuation, targets.observed, gravity_mps2)
        self.remembers = self._way_counts()

    def seen(self, past: Array, candidates: Array, times: Array) -> Array:
        """Return the targets' columns under each candidate for the next row, shape (B, m); NaN: no balance.

        Args:
            past: levels of the rows before, shape (h, d).
            candidates: levels, shape (B, d).
            times: of the rows before and the next one, shape (h + 1,) [s].
        """
        kept = min(len(past), REMEMBERED) if self.remembers else 0
        way = past[len(past) - kept :]
        clock = times[len(times) - kept - 1 :]
        histories = [self._inputs(np.vstack([way, level]), clock) for level in candidates]
        outputs = self._twin.of_histories(self._robot, histories)[:, -1]
        return self.targets.seen(outputs)

    def _inputs(self, levels: Array, times: Array) -> Inputs:
        return inputs_at(self.drives, levels, times - times[0])

    def _way_counts(self) -> bool:
        """Try whether larger inputs before, and any, change what is seen; asked of a few random pairs."""
        rng = np.random.default_rng(0)
        least, most = self.drives.least, self.drives.most
        before, after = (rng.uniform(least, most, (_PAIRS, len(least))) for _ in range(2))
        before[::2] = np.clip(1.3 * after[::2] + 0.2 * np.sign(after[::2]), least, most)
        clock = np.array([0.0, 1.0])
        ways = [self._inputs(np.stack(pair), clock) for pair in zip(before, after, strict=True)]
        alone = [self._inputs(level[np.newaxis], clock[:1]) for level in after]
        one = self.targets.seen(self._twin.of_histories(self._robot, ways)[:, -1])
        other = self.targets.seen(self._twin.of_histories(self._robot, alone)[:, -1])
        apart = self.targets.misses(one, other)
        return not bool(np.nanmax(np.abs(apart), initial=0.0) < _SAME)
