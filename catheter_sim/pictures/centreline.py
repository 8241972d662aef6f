"""The centreline that an analytic posture promises, and what of the drawn robot must show it.

No geom is made for the check; what is looked at is what a user sees. Which geoms that are, the robot's kind
says (`picture.py`).
"""

from __future__ import annotations

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.robots import kind_of


def shows_centreline(robot: RobotSpec, geom: str) -> bool:
    """Return whether the geom of this name is one whose pixels' middle is the robot's centreline."""
    return geom.startswith(tuple(f"{prefix}_" for prefix in kind_of(robot).picture.CENTRELINE_PARTS))


def centreline(robot: RobotSpec, posture: Posture) -> Array:
    """Return points on the centreline from the robot's base to its tip, shape (n, 3) [m]."""
    return kind_of(robot).picture.centreline(robot, posture)
