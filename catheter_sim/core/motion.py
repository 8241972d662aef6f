"""What makes a MuJoCo model move as the robot does: step, integrator, damping and numerical inertia.

A kind writes a joint of stiffness K with the damping K * relaxation_time_s and the armature
K * inertia_time_s**2 (`core.robot.Dynamics`). `in_motion` returns the same robot with the two times that
motion needs in their place: so each kind writes one model, and either of its two uses.

How the times are chosen. With the step h MuJoCo's `implicitfast` does v' = v + h (M + h D)^-1 (f - D v),
q' = q + h v'. Written about the middle of a step that is the leapfrog rule with damping D and the mass
M + h D / 2, exactly. The leapfrog rule is stable where this mass exceeds h^2 K / 4, in any direction; with
equality it is the trapezoidal rule, which neither damps nor feeds any frequency. So a hinge gets the armature
K (h^2 / 4 - h T / 2), T = damping_time_s, and none where T is half a step or more. Light links of stiff
robots are thus safe without masses that they do not have: of a mode of frequency w the step changes the
frequency by w^2 h^2 / 24 to w^2 h^2 / 12 + w^2 h T / 4, of 1.

Tendons that are driven by displacement are springs a thousand times as stiff, and stiffnesses that laws
change between steps may be, so such models take the integrator `discrete`, for which joints, tendons and
actuators are implicit springs: (M + h D + h^2 K) v' = M v + h f. That is the rule above with K (T + h) for
the damping: each hinge gets K (T - h) and, where T is shorter than a step, damps as if T were one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeVar

from catheter_sim.core.robot import RobotSpec

LEAPFROG, IMPLICIT_SPRINGS = "implicitfast", "discrete"
MARGIN = 1.2  # of the armature, beyond what the stiffness of the hinges asks for: loads stiffen a robot, too

R = TypeVar("R", bound=RobotSpec)


@dataclass(frozen=True)
class Integration:
    """How the model of a robot is stepped in motion.

    Attributes:
        integrator: `LEAPFROG` or `IMPLICIT_SPRINGS`.
        stiffening: stiffness that acts beside the joints' own springs (laws between two steps), as a multiple
            of the one that scales a joint's damping and armature.
    """

    integrator: str
    stiffening: float = 0.0


def motion_step_s(robot: RobotSpec) -> float:
    """Return the time step in which `robot` moves [s]."""
    return min(robot.dynamics.motion_timestep_s, robot.dynamics.timestep_s)


def in_motion(robot: R, integration: Integration) -> R:
    """Return `robot` with the times by which its joints get damping and armature those of motion."""
    step, damping_time = motion_step_s(robot), robot.dynamics.damping_time_s
    explicit = integration.stiffening
    if integration.integrator == LEAPFROG:
        explicit += 1.0
    else:
        damping_time = max(0.0, damping_time - step)
    inertia = max(0.0, MARGIN * explicit * step**2 / 4.0 - step * damping_time / 2.0)
    dynamics = replace(
        robot.dynamics,
        timestep_s=step,
        relaxation_time_s=damping_time,
        inertia_time_s=math.sqrt(inertia),
    )
    return replace(robot, dynamics=dynamics)
