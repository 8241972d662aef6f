"""A simple controller that reaches targets: what a learned one is to be measured against."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.envs.reach import CONTROL_STEP_S, RATE_PER_S, Action, Observation, ReachEnv
from catheter_sim.envs.steering import change_toward

GAIN = 0.3  # share of the way to the target in one step; the robot follows within a step or two


def resolved_rate(env: ReachEnv, observation: Observation) -> Action:
    """Return the action that moves the tip toward the target by the frictionless Jacobian.

    Actions add up in the drives' levels, so that it goes on pulling where friction holds the robot.

    Args:
        env: for the robot's lengths, drives and quick model; its state is not read.
        observation: of `env`.
    """
    part = {name: observation[place].astype(float) for name, place in env.layout.items()}
    way = (part["target"] - part["tip"]) * env.length_m
    bend = part["bend"].reshape(-1, 2) * math.pi
    largest = RATE_PER_S * CONTROL_STEP_S
    change = change_toward(
        GAIN * way,
        env.plant.quick.tip_slopes(part["level"], bend),
        env.length_m,
        np.clip(env.drives.lowest - part["level"], -largest, 0.0),
        np.clip(1.0 - part["level"], 0.0, largest),
    )
    return (change / largest).astype(np.float32)
