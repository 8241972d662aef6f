"""Where the tendons of a catheter's bending joints rub: on their way to the base, and at the rings."""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.law import RobotInModel, TendonPaths
from catheter_sim.errors import InputError
from catheter_sim.kinds.catheter.layout import bent_by
from catheter_sim.kinds.catheter.spec import CatheterRobot


class PairTurns:
    """The angles by which a catheter's bending tendons turn: on their way to the base, then at the gaps.

    Halfway through a ring a tendon has turned by half of each gap beside it. Before the first gap it has
    turned by the robot's `path_rad` and by the bends of the joints that it passes.

    Attributes:
        path_rad: the robot's.
        gaps: of each pair, where its joint's gaps are in the positions.
        before: of each pair, the pairs whose joints it passes.
    """

    def __init__(self, robot: CatheterRobot, place: RobotInModel, spans: int) -> None:
        self.path_rad, self._name = robot.path_rad, robot.name
        self.gaps = []
        for segment in bent_by(robot).values():
            names = [f"{segment.name}_{gap}" for gap in range(1, segment.rings + 2)]
            self.gaps.append(np.array([place.joint(name).qposadr[0] for name in names]))
        order = [robot.segments.index(segment) for segment in bent_by(robot).values()]
        self.before = [[other for other, k in enumerate(order) if k < own] for own in order]
        self._turn = np.zeros((2 * len(order), spans))

    def __call__(self, data: mujoco.MjData, ends: np.ndarray | None = None) -> Array:
        """Return the turn before each span, shape (2 pairs, n) [rad], in a reused array."""
        bends = [data.qpos[gaps] for gaps in self.gaps]
        for row, own in enumerate(bends):
            passed = sum(abs(float(bends[other].sum())) for other in self.before[row])
            turn = 0.5 * np.abs(own + np.concatenate([[0.0], own[:-1]]))
            turn[0] += self.path_rad + passed
            self._turn[row, : len(own)] = self._turn[row + len(bends), : len(own)] = turn
        return self._turn

    def of_copies(self, copies: np.ndarray, qpos: Array, site_xpos: Array, turn: Array) -> None:
        """Refuse: the turns of many copies are not known.

        Raises:
            InputError: always.
        """
        raise InputError(f"{self._name}: friction of a catheter's pairs: not for many copies at once")


def span_ends(robot: CatheterRobot) -> np.ndarray:
    """Return the number of spans of each tendon: the pairs', then their antagonists', shape (t,)."""
    return np.array(2 * [segment.rings + 1 for segment in bent_by(robot).values()])


def pair_turns(robot: CatheterRobot, place: RobotInModel) -> PairTurns:
    """Return the turns of the bending joints' tendons."""
    return PairTurns(robot, place, int(span_ends(robot).max()))


def paths(robot: CatheterRobot, place: RobotInModel) -> TendonPaths:
    """Return where the bending joints' tendons rub, in the order of the actuators that pull them."""
    bent, ends = bent_by(robot), span_ends(robot)
    return TendonPaths(
        names=[f"{place.prefix}tendon_{pair}_{sign}" for sign in ("pos", "neg") for pair in bent],
        spans=int(ends.max()),
        ends=ends,
        span_of_dof={
            int(place.joint(f"{segment.name}_{gap}").dofadr[0]): gap - 1
            for segment in bent.values()
            for gap in range(1, segment.rings + 2)
        },
        turns=pair_turns(robot, place),
    )
