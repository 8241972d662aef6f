"""What every kind of robot must meet: friction, mount, stiffness scale, free channel, dynamics, markers."""

from __future__ import annotations

from catheter_sim.core.requirements import check_name, need, positive
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, shown

_LONGEST_NAME = 100  # characters
_TIMESTEP_S = (1e-5, 0.1)  # a held row takes 2 s and more: 200,000 steps, or 20
_MOST_N_S_PER_M = 1e6  # a tendon that cannot be moved
_MOST_AT_TIP_KG = 100.0  # no robot of these kinds holds as much
_SLOWEST_S = 1000.0  # a robot this slow never comes to rest
_MOST_MARKERS = 100
_FARTHEST_M = 10.0  # of a marker from its element


def check_shared(robot: RobotSpec, where: str) -> None:
    """Raise `InputError` where a number that robots of all kinds have is impossible.

    Args:
        robot: the robot.
        where: what to call it in the message (file or robot id).
    """
    top = f"{where}: "
    if not robot.name.strip() or not robot.name.isprintable() or len(robot.name) > _LONGEST_NAME:
        text = f"1 to {_LONGEST_NAME} characters that can be printed are needed"
        raise InputError(f"{top}name = {shown(robot.name)}: {text}")
    need(robot.friction, "mu", f"{top}friction.", lambda mu: 0 <= mu < 10, "must lie in 0 to 10")
    positive(robot.mount, "axial_stiffness_N_per_m", f"{top}mount.", finite=False)
    positive(robot, "stiffness_scale", top)
    what = f"must lie in 0 to {1e3 * _MOST_AT_TIP_KG:g} g"
    need(robot, "tip_mass_kg", top, lambda mass: 0.0 <= mass <= _MOST_AT_TIP_KG, what)
    smallest_m = min(segment.outer_radius_m for segment in robot.segments)
    what = f"must lie in 0 to the smallest outer radius, {smallest_m * 1e3:g} mm"
    need(robot, "channel_radius_m", top, lambda radius: 0 <= radius < smallest_m, what)
    for name in ("timestep_s", "relaxation_time_s", "inertia_time_s"):
        positive(robot.dynamics, name, f"{top}dynamics.")
    low_s, high_s = _TIMESTEP_S
    what = f"must lie in {low_s:g} to {high_s:g} s"
    need(robot.dynamics, "timestep_s", f"{top}dynamics.", lambda step: low_s <= step <= high_s, what)
    for name in ("relaxation_time_s", "inertia_time_s"):
        what = f"must be at most {_SLOWEST_S:g} s"
        need(robot.dynamics, name, f"{top}dynamics.", lambda time: time <= _SLOWEST_S, what)
    what = f"must lie in {low_s:g} to {high_s:g} s"
    need(robot.dynamics, "motion_timestep_s", f"{top}dynamics.", lambda step: low_s <= step <= high_s, what)
    for name in ("damping_time_s", "servo_lag_s"):
        what = f"must lie in 0 to {_SLOWEST_S:g} s"
        need(robot.dynamics, name, f"{top}dynamics.", lambda time: 0.0 <= time <= _SLOWEST_S, what)
    what = f"must lie in 0 to {_MOST_N_S_PER_M:g}"
    name = "tendon_damping_N_s_per_m"
    need(robot.dynamics, name, f"{top}dynamics.", lambda damping: 0.0 <= damping <= _MOST_N_S_PER_M, what)


def check_markers(robot: RobotSpec, elements: int, where: str) -> None:
    """Raise `InputError` where a marker is impossible.

    Args:
        robot: the robot.
        elements: how many cells, links, rings or disks it has.
        where: what to call it in the message (file or robot id).
    """
    if len(robot.markers) > _MOST_MARKERS:
        raise InputError(f"{where}: {len(robot.markers)} markers: more than {_MOST_MARKERS}")
    names = [marker.name for marker in robot.markers]
    for marker in robot.markers:
        check_name(marker.name, f"{where}: marker")
        if names.count(marker.name) > 1:
            raise InputError(f"{where}: marker {marker.name!r} stands twice")
        prefix = f"{where}: markers.{marker.name}."
        what = f"the robot's elements are 1 to {elements}"
        need(marker, "element", prefix, lambda element: 1 <= element <= elements, what)
        what = f"must lie within {1e3 * _FARTHEST_M:g} mm"
        for name in ("offset_x_m", "offset_y_m", "offset_z_m"):
            need(marker, name, prefix, lambda offset: abs(offset) <= _FARTHEST_M, what)
