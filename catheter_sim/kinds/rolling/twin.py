"""The twin of robots of rolling joints: the complete balance, with friction's history, one after another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.core.inputs import Inputs, slice_inputs
from catheter_sim.core.posture import Array
from catheter_sim.core.statics import Twin, TwinStates
from catheter_sim.errors import InputError
from catheter_sim.kinds.rolling.spec import RollingRobot
from catheter_sim.kinds.rolling.theory.chain import rolling_chain
from catheter_sim.kinds.rolling.theory.complete import solve_history
from catheter_sim.kinds.rolling.theory.history import faces, several_rods_at_once

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


@dataclass(frozen=True)
class RollingTwin:
    """Twin of robots of rolling joints."""

    carries_load: bool = True

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
        first, at_once = None, any(several_rods_at_once(inputs.tendon) for inputs in arriving)
        for index, (robot, inputs) in enumerate(zip(robots, arriving, strict=True)):
            chain = rolling_chain(robot)
            unloaded = not (gravity_mps2.any() or inputs.force_tip.any() or inputs.moment_tip.any())
            sliding = at_once or not unloaded
            alone_rad = None if sliding else _ALONE_STEP_RAD
            try:
                solved = solve_history(
                    chain,
                    inputs,
                    gravity_mps2,
                    step_bend_rad=_SLIDING_STEP_RAD if sliding else _STEP_RAD,
                    alone_bend_rad=alone_rad,
                    guide=first,
                    pre_sliding_m=_PRE_SLIDING_M if sliding else (),
                )
            except InputError:
                continue
            if index == 0 and unloaded:  # under a load another's way may lead to another equilibrium
                first = solved
            angles[index], tension[index] = solved.theta[shown], inputs.tendon[shown]
            if wanted:
                rows = slice_inputs(inputs, shown)
                places, turns = faces(chain, rows, gravity_mps2, angles[index], solved.link_length[shown])
                p_w[index], R_w[index] = places[:, wanted], turns[:, wanted]
        return TwinStates(p_w, R_w, lambda: angles, tension)


def twin(robot: RollingRobot, actuation: str) -> Twin[RollingRobot]:
    """Return the twin of robots like `robot`, which tensions drive."""
    return RollingTwin()
