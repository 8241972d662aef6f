"""Where a robot is: the one result that the simulation and every static model return per row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array


@dataclass(frozen=True)
class Posture:
    """A robot's posture in the base frame, SI units.

    Attributes:
        p_w: centres of the elements' distal faces, base to tip, shape (n, 3) [m].
        R_w: their orientations, shape (n, 3, 3); columns are the body axes in the base frame.
        joint_angles: one per hinge in the order of `channels.joint_names`, shape (m,) [rad].
        actuator_tension: per tendon, in the robot's order, at the actuator, shape (t,) [N].
        tendon_tension: per tendon and subsegment, base to tip, shape (t, n) [N]; NaN beyond a
            tendon's end.
        markers_w: positions of the robot's markers, shape (m, 3) [m], where they are seen elsewhere than
            their elements' frames say; None: they are there.
    """

    p_w: Array
    R_w: Array
    joint_angles: Array
    actuator_tension: Array
    tendon_tension: Array
    markers_w: Array | None = None


def finite_rows(postures: Sequence[Posture]) -> int:
    """Return how many postures come before the first one with a position or turn that is no number."""
    for row, posture in enumerate(postures):
        parts = (posture.p_w, posture.R_w, posture.joint_angles)
        if not all(np.isfinite(part).all() for part in parts):
            return row
    return len(postures)


@dataclass(frozen=True)
class Observed:
    """What is measured of a robot, row by row, SI units; what is not asked for may be left out (k = 0).

    Positions and orientations may belong to different frames.

    Attributes:
        time_s: of the rows, shape (r,).
        p_w: positions in the base frame, shape (r, k, 3) [m].
        R_w: orientations, shape (r, m, 3, 3).
        joint_angles: shape (r, j) [rad].
        tension: at the actuators, shape (r, t) [N].
    """

    time_s: Array
    p_w: Array
    R_w: Array
    joint_angles: Array
    tension: Array
