"""Inputs and geometry that the tests of the planar statics share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import Friction
from catheter_sim.core.statics import StaticRun
from catheter_sim.robots.continuum.published import neuroendoscope_section
from catheter_sim.robots.continuum.spec import ContinuumRobot

NO_GRAVITY = np.zeros(3)
SIDEWAYS = np.array([9.81, 0.0, 0.0])


def section(mu: float = 0.3) -> ContinuumRobot:
    """Return the measured section with another friction coefficient."""
    return replace(neuroendoscope_section(), friction=Friction(mu))


def tensions(
    rows: Sequence[Sequence[float]],
    force_tip: Sequence[Sequence[float]] | None = None,
    moment_tip: Sequence[Sequence[float]] | None = None,
) -> Inputs:
    """Return tension inputs, a second apart."""
    count = len(rows)
    none = np.zeros((count, 3))
    return Inputs(
        time_s=np.arange(count, dtype=float),
        actuation="tension",
        tendon=np.array(rows, dtype=float),
        force_tip=none if force_tip is None else np.array(force_tip, dtype=float),
        moment_tip=none if moment_tip is None else np.array(moment_tip, dtype=float),
    )


def single(*right: float) -> Inputs:
    """Return inputs of the section's right tendon alone."""
    return tensions([(value, 0.0) for value in right])


def tips_mm(run: StaticRun) -> Array:
    """Return the tip's x and z, shape (rows, 2) [mm]."""
    return np.array([posture.p_w[-1, [0, 2]] for posture in run.postures]) * 1e3


def cell_angles(posture: Posture) -> Array:
    """Return the bend angles read off the cells' orientations, shape (n,) [rad]."""
    lean = np.unwrap(np.arctan2(posture.R_w[:, 0, 2], posture.R_w[:, 2, 2]))
    return np.diff(lean, prepend=0.0)


def eyelets(robot: ContinuumRobot, posture: Posture) -> Array:
    """Return the tendons' eyelets, the base's first, from the faces' poses, shape (t, n + 1, 3) [m]."""
    p_w = np.concatenate([np.zeros((1, 3)), posture.p_w])
    R_w = np.concatenate([np.eye(3)[None], posture.R_w])
    return np.array(
        [
            p_w
            + R_w
            @ np.array(
                [
                    tendon.radius_m * math.cos(tendon.angle_rad),
                    tendon.radius_m * math.sin(tendon.angle_rad),
                    0.0,
                ]
            )
            for tendon in robot.tendons
        ]
    )
