"""How much of a change nothing that follows from the commands can tell.

A robot that moves is never twice where it was: it swings, by what no command says. What is left of a change
by a smooth function of the commands, learned on other trials, is more than that; no cause need do better.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.fitting.residuals import residuals
from catheter_sim.diagnosis.fitting.stretches import blocks_of, trial_of
from catheter_sim.diagnosis.thresholds import MOST_MODEL_SHARE
from catheter_sim.diagnosis.verdict.discrepancy import explained


def untold_share(problem: Problem, robot: RobotSpec) -> float:
    """Return the share of a change that a smooth function of the commands leaves of trials left out.

    Args:
        problem: the trials that train, without what both recordings share.
        robot: the earlier recording's, whose errors are the change.

    Returns:
        A root mean square over another, at most `MOST_MODEL_SHARE`; 0 where a single trial trains.
    """
    if len(problem.trials) < 2:
        return 0.0
    change = residuals(replace(problem, robot=robot), (), np.zeros((1, 0)))[0]
    left = _left(problem, change)
    return min(MOST_MODEL_SHARE, float(np.sqrt(left @ left / max(float(change @ change), 1e-300))))


def _left(problem: Problem, change: Array) -> Array:
    """Return what is left of a change in every trial, by what the others say, shape (n,)."""
    trial, block = trial_of(problem), blocks_of(problem)
    left = change.copy()
    for index, away in enumerate(problem.trials):
        mine = trial == index
        others = replace(problem, trials=tuple(item for item in problem.trials if item is not away))
        there = replace(problem, trials=(away,))
        left[mine] -= explained(others, change[~mine], block[~mine], there)
    return left
