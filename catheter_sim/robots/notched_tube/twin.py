"""The twin of notched tubes: the kinetostatic model of many robots at once, with friction's history."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.statics import Twin, TwinStates
from catheter_sim.robots.notched_tube.spec import NotchedTubeRobot
from catheter_sim.robots.notched_tube.statics import solve_rows


@dataclass(frozen=True)
class NotchedTubeTwin:
    """Twin of notched tubes."""

    carries_load: bool = True

    def solve(
        self,
        robots: Sequence[NotchedTubeRobot],
        arriving: Sequence[Inputs],
        gravity_mps2: Array,
        elements: Sequence[int],
        every: int,
    ) -> TwinStates:
        """Return where robots are, as `Twin.solve` says; NaN from a row on that has no balance."""
        shown = solve_rows(robots, arriving, gravity_mps2).every(every)
        p_w, R_w = shown.faces()
        wanted = list(elements)
        return TwinStates(p_w[:, :, wanted], R_w[:, :, wanted], shown.joint_angles, shown.tension[:, :, None])


def twin(robot: NotchedTubeRobot, actuation: str) -> Twin[NotchedTubeRobot]:
    """Return the twin of robots like `robot`, whatever drives them."""
    return NotchedTubeTwin()
