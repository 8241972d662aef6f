"""Notched tubes and inputs that several tests share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.robots.notched_tube.published import notched_wrist_script
from catheter_sim.robots.notched_tube.spec import NotchedTubeRobot, Superelastic

WRIST = notched_wrist_script()
LINEAR = Superelastic(60e9)


def changed(
    robot: NotchedTubeRobot = WRIST,
    mu: float | None = None,
    metal: Superelastic | None = None,
    tendon: dict[str, float] | None = None,
    **segment: float,
) -> NotchedTubeRobot:
    """Return a robot with another friction, metal, or numbers of its tendon and segments."""
    robot = replace(robot, segments=tuple(replace(item, **segment) for item in robot.segments))
    if mu is not None:
        robot = replace(robot, friction=Friction(mu))
    if metal is not None:
        robot = replace(robot, material=metal)
    if tendon:
        robot = replace(robot, tendons=(replace(robot.tendons[0], **tendon),))
    return robot


def inputs(
    drive: Sequence[float],
    actuation: str = "tension",
    force: Sequence[float] = (0.0, 0.0, 0.0),
    moment: Sequence[float] = (0.0, 0.0, 0.0),
) -> Inputs:
    """Return rows of tension or displacement under a steady load on the tip."""
    rows = len(drive)
    return Inputs(
        time_s=np.arange(rows, dtype=float),
        actuation=actuation,
        tendon=np.asarray(drive, dtype=float)[:, None],
        force_tip=np.tile(np.asarray(force, dtype=float), (rows, 1)),
        moment_tip=np.tile(np.asarray(moment, dtype=float), (rows, 1)),
    )
