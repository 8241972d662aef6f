"""What every kind of robot must meet: friction, mount, stiffness scale, free channel, dynamics."""

from __future__ import annotations

from typing import TYPE_CHECKING

from catheter_sim.robots.requirements import need, positive

if TYPE_CHECKING:
    from catheter_sim.robots.kinds import Robot


def check_shared(robot: Robot, where: str) -> None:
    """Raise `InputError` where a number that robots of all kinds have is impossible.

    Args:
        robot: the robot.
        where: what to call it in the message (file or robot id).
    """
    top = f"{where}: "
    need(robot.friction, "mu", f"{top}friction.", lambda mu: 0 <= mu < 10, "must lie in 0 to 10")
    positive(robot.mount, "axial_stiffness_N_per_m", f"{top}mount.", finite=False)
    positive(robot, "stiffness_scale", top)
    smallest_m = min(segment.outer_radius_m for segment in robot.segments)
    what = f"must lie in 0 to the smallest outer radius, {smallest_m * 1e3:g} mm"
    need(robot, "channel_radius_m", top, lambda radius: 0 <= radius < smallest_m, what)
    for name in ("timestep_s", "relaxation_time_s", "inertia_time_s"):
        positive(robot.dynamics, name, f"{top}dynamics.")
