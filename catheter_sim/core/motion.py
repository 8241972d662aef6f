"""What makes a MuJoCo model move as the robot does: step, integrator, damping and numerical inertia.

A kind writes a joint of stiffness K with the damping K * relaxation_time_s and the armature
K * inertia_time_s**2 (`core.robot.Dynamics`). `in_motion` returns the same robot with the two times that
motion needs in their place: so each kind writes one model, and either of its two uses.

How they are chosen. With the step h MuJoCo's `implicitfast` does v' = v + h (M + h D)^-1 (f - D v),
q' = q + h v'. Written about the middle of a step that is the leapfrog rule with damping D and the mass
M + h D / 2, exactly. The leapfrog rule is stable where this mass exceeds h^2 K / 4, in any direction; with
equality it is the trapezoidal rule, which neither damps nor feeds any frequency. Where T, the damping time,
is half a step or more, hinges of stiffness K with D = K T so are safe without masses that they do not have.
A mode of frequency w swings slower by w^2 h T / 4, of 1. But forces of gyration are those of the step
before: without damping they feed large motion, so that T is taken as one step at least.

A robot of springs and masses alone, whose T is less than a step, takes `RK4`, which neither damps nor
feeds. (Nearly: its stability ends where w h = 2.8, and its damping begins not much before.). Each hinge
gets the armature K (h^2 / 8 + h T / 2.8), which keeps every w below that.

Tendons that are driven by displacement are springs a thousand times as stiff, and so may be stiffnesses
that laws change between steps. Such models take the integrator `discrete`, for which joints, tendons and
actuators are implicit springs: (M + h D + h^2 K) v' = M v + h f. That is the first rule with K (T + h) for
the damping: each hinge gets K (T - h) and, where T is shorter than a step, damps as if T were one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeVar

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError

LEAPFROG, IMPLICIT_SPRINGS, SMOOTH = "implicitfast", "discrete", "RK4"
MOST_STEPS = 10_000_000  # of a run in motion: 83 minutes of it in steps of 0.5 ms, an hour of computing
MARGIN = 1.2  # of the armature, beyond what the stiffness of the hinges asks for: loads stiffen a robot, too

R = TypeVar("R", bound=RobotSpec)


@dataclass(frozen=True)
class Integration:
    """How the model of a robot is stepped in motion.

    Attributes:
        integrator: `LEAPFROG`, `IMPLICIT_SPRINGS` or `SMOOTH`, as MJCF has it.
        stiffening: stiffness that acts beside the joints' own springs (laws between two steps), as a multiple
            of the one that scales a joint's damping and armature.
        own_springs: whether the joints have springs of their own.
    """

    integrator: str
    stiffening: float = 0.0
    own_springs: bool = True


def motion_step_s(robot: RobotSpec) -> float:
    """Return the time step in which `robot` moves [s]."""
    return min(robot.dynamics.motion_timestep_s, robot.dynamics.timestep_s)


def require_steps(
    robot: RobotSpec,
    time_s: Array,
    most_steps: int,
    where: str,
    said: str = "in motion",
    option: str = "most_steps",
) -> None:
    """Raise `InputError` where following a clock in motion takes more steps than a budget.

    Args:
        robot: what moves.
        time_s: of the rows, shape (r,) [s].
        most_steps: the budget.
        where: what the error calls the inputs.
        said: what it calls motion.
        option: what it calls the budget.
    """
    step_s, seconds = motion_step_s(robot), float(time_s[-1] - time_s[0])
    if seconds / step_s > most_steps:
        raise InputError(
            f"{where}: time_s runs over {seconds:g} s, {said} at most {most_steps * step_s:g} s. "
            f"These are {len(time_s)} rows, {seconds / step_s:.0f} steps of {step_s:g} s; "
            f"the budget is {most_steps}. Is time_s in seconds? If so, raise {option}"
        )


def of_springs_and_masses(robot: RobotSpec) -> Integration:
    """Return how a robot is stepped that has no stiffness but its joints' own springs.

    Where tendons rub, `discrete`: MuJoCo's constraints then know the damping, too; the rule is `LEAPFROG`'s.
    """
    if robot.friction.mu > 0.0:
        return Integration(IMPLICIT_SPRINGS)
    dynamics = robot.dynamics
    damped = dynamics.damping_time_s >= motion_step_s(robot) or dynamics.tendon_damping_N_s_per_m > 0.0
    return Integration(LEAPFROG if damped else SMOOTH)


def in_motion(robot: R, integration: Integration) -> R:
    """Return `robot` with the times by which its joints get damping and armature those of motion."""
    step, damping_time = motion_step_s(robot), robot.dynamics.damping_time_s
    beside = integration.stiffening
    if integration.integrator == SMOOTH:
        inertia = MARGIN * (step**2 / 8.0 + step * damping_time / 2.8)
    elif integration.integrator == LEAPFROG or not integration.own_springs:
        damping_time = max(damping_time, step)
        all_springs = beside + (1.0 if integration.own_springs else 0.0)
        inertia = MARGIN * all_springs * step**2 / 4.0 - step * damping_time / 2.0
    else:
        inertia = MARGIN * beside * step**2 / 4.0
        damping_time = max(0.0, damping_time - step)
    dynamics = replace(
        robot.dynamics,
        timestep_s=step,
        relaxation_time_s=damping_time,
        inertia_time_s=math.sqrt(max(0.0, inertia)),
    )
    return replace(robot, dynamics=dynamics)
