"""The twin of robots of rolling joints: the complete balance, with friction's history, one after another."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, numbers_of, slice_inputs
from catheter_sim.core.statics import Twin, TwinStates
from catheter_sim.errors import InputError
from catheter_sim.robots.rolling.complete import (
    Solved,
    StandingLinks,
    faces,
    several_rods_at_once,
    solve_history,
)
from catheter_sim.robots.rolling.description import RollingChain, rolling_chain
from catheter_sim.robots.rolling.spec import RollingRobot

# Of the rods of one end that move alone, without weight and loads: these make the same history in one step.
_ALONE_STEP_RAD = 1.0
# Where several rods pull at once, or a load acts, friction goes by how rods slide: random histories
# of `chest_tube` then come within 0.5 mm of the simulation, rods that move one after another within 0.25 mm.
# Keeping tensions errs by up to 190 mm there. A tenth of the pre-sliding halves that, in twice the time.
_SLIDING_STEP_RAD = 0.08
_PRE_SLIDING_M = (1e-7, 1e-6)
# Five times the static model's own. A load that moves the robot while a rod is held makes it depend on the
# steps: random histories of the bench under their own weight move by at most 0.04 mm (`chest_tube`) and
# 0.006 mm (section).
_STEP_RAD = 0.2


@dataclass(frozen=True, eq=False)
class _How:
    """By which choices a robot's rows are solved.

    Attributes:
        chain: the robot.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        sliding: whether friction goes by how rods slide.
    """

    chain: RollingChain
    gravity_mps2: Array
    sliding: bool

    def solve(
        self, inputs: Inputs, guide: Solved | None = None, after: StandingLinks | None = None
    ) -> Solved:
        """Return where the robot is along rows of inputs; arguments and errors of `solve_history`."""
        return solve_history(
            self.chain,
            inputs,
            self.gravity_mps2,
            step_bend_rad=_SLIDING_STEP_RAD if self.sliding else _STEP_RAD,
            alone_bend_rad=None if self.sliding else _ALONE_STEP_RAD,
            guide=guide,
            pre_sliding_m=_PRE_SLIDING_M if self.sliding else (),
            after=after,
        )


@dataclass(frozen=True)
class RollingTwin:
    """Twin of robots of rolling joints.

    Of one robot along several histories that begin alike, and along one after another of them, what they
    share is solved once.
    """

    carries_load: bool = True
    _latest: list[tuple[RollingRobot, Hashable, Solved]] = field(
        default_factory=list, repr=False, compare=False
    )

    def solve(
        self,
        robots: Sequence[RollingRobot],
        arriving: Sequence[Inputs],
        gravity_mps2: Array,
        elements: Sequence[int],
        every: int,
    ) -> TwinStates:
        """Return where robots are, as `Twin.solve` says; NaN of one that folds in any row."""
        shown, wanted = slice(None, None, every), list(elements)
        shape = len(robots), len(arriving[0].time_s[shown])
        p_w, R_w = np.full((*shape, len(wanted), 3), np.nan), np.full((*shape, len(wanted), 3, 3), np.nan)
        angles = np.full((*shape, sum(segment.joints for segment in robots[0].segments)), np.nan)
        tension = np.full((*shape, arriving[0].tendon.shape[1]), np.nan)
        histories = self._histories(robots, arriving, gravity_mps2)
        for index, (robot, inputs, solved) in enumerate(zip(robots, arriving, histories, strict=True)):
            if solved is None:
                continue
            chain = rolling_chain(robot)
            angles[index], tension[index] = solved.theta[shown], inputs.tendon[shown]
            if wanted:
                rows = slice_inputs(inputs, shown)
                places, turns = faces(chain, rows, gravity_mps2, angles[index], solved.link_length[shown])
                p_w[index], R_w[index] = places[:, wanted], turns[:, wanted]
        return TwinStates(p_w, R_w, lambda: angles, tension)

    def _histories(
        self, robots: Sequence[RollingRobot], arriving: Sequence[Inputs], gravity_mps2: Array
    ) -> Iterator[Solved | None]:
        """Yield where each robot is along its rows, None of one that folds in any of them."""
        at_once = any(several_rods_at_once(inputs.tendon) for inputs in arriving)
        shared = _shared_rows(robots, arriving)
        first = None
        for index, (robot, inputs) in enumerate(zip(robots, arriving, strict=True)):
            unloaded = not (gravity_mps2.any() or inputs.force_tip.any() or inputs.moment_tip.any())
            how = _How(rolling_chain(robot), gravity_mps2, sliding=at_once or not unloaded)
            try:
                begun = self._begun(how, robot, slice_inputs(inputs, slice(shared))) if shared else None
                rest = slice_inputs(inputs, slice(shared, None))
                solved = how.solve(rest, first, begun.end if begun else None)
            except InputError:
                yield None
                continue
            if index == 0 and unloaded:  # under a load another's way may lead to another equilibrium
                first = solved
            yield _joined(begun, solved) if begun else solved

    def _begun(self, how: _How, robot: RollingRobot, inputs: Inputs) -> Solved:
        """Return where a robot is along rows; those asked for last are known."""
        key = how.sliding, how.gravity_mps2.tobytes(), numbers_of(inputs)
        for known, its_key, solved in self._latest:
            if its_key == key and known == robot:
                return solved
        solved = how.solve(inputs)
        self._latest[:] = [(robot, key, solved)]
        return solved


def _shared_rows(robots: Sequence[RollingRobot], arriving: Sequence[Inputs]) -> int:
    """Return in how many leading rows, the last not counted, all histories of one robot are alike; else 0."""
    one = arriving[0]
    if any(robot is not robots[0] for robot in robots) or len(one) < 2:
        return 0
    same = np.ones(len(one) - 1, dtype=bool)
    for other in arriving[1:]:
        for name in ("tendon", "force_tip", "moment_tip"):
            same &= (getattr(one, name)[:-1] == getattr(other, name)[:-1]).all(axis=1)
    return len(same) if same.all() else int(np.argmin(same))


def _joined(begun: Solved, rest: Solved) -> Solved:
    """Return the rows of two histories, of which the second goes on from the first."""
    return replace(
        rest,
        theta=np.concatenate([begun.theta, rest.theta]),
        at_joint=np.concatenate([begun.at_joint, rest.at_joint]),
        link_length=np.concatenate([begun.link_length, rest.link_length]),
        unbalanced=np.concatenate([begun.unbalanced, rest.unbalanced]),
    )


def twin(robot: RollingRobot, actuation: str) -> Twin[RollingRobot]:
    """Return the twin of robots like `robot`, which tensions drive."""
    return RollingTwin()
