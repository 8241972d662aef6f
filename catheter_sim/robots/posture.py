"""Where a robot is: the one result that the simulation and every static model return per row."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
    """

    p_w: Array
    R_w: Array
    joint_angles: Array
    actuator_tension: Array
    tendon_tension: Array
