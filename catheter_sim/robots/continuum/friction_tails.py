"""The tendons that carry friction in the reference friction law: one per hole, to the tendon's end.

Their limits are set at run time by `catheter_sim.robots.continuum.laws.NestedFriction`.
"""

from __future__ import annotations

from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.names import hole
from catheter_sim.robots.continuum.description import last_disk
from catheter_sim.robots.continuum.spec import ContinuumRobot

# A friction row exists only where its limit is above zero; at rest all limits are about zero.
SMALLEST_LIMIT = 1e-12
# Dry friction that holds: the constraint's impedance at MuJoCo's upper bound.
SOLIMP_FRICTION = (0.9999, 0.9999, 0.001, 0.5, 2.0)
SOLREF_FRICTION = (0.004, 1.0)


def add(root: Element, robot: ContinuumRobot) -> None:
    """Add the tendons `tail_<tendon>_<k>` (hole k to the tendon's end) to the model."""
    for tendon in robot.tendons:
        end = last_disk(robot, tendon)
        for first in range(end):
            element = root.part("tendon").add(
                "spatial",
                name=f"tail_{tendon.name}_{first}",
                group=5,
                rgba=(0, 0, 0, 0),
                frictionloss=SMALLEST_LIMIT,
                solimpfriction=SOLIMP_FRICTION,
                solreffriction=SOLREF_FRICTION,
            )
            for k in range(first, end + 1):
                element.add("site", site=hole(tendon.name, k))
