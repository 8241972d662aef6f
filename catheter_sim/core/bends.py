"""Where a cause acts on a robot of segments in a row: curvature without load, damping, loads on the tip."""

from __future__ import annotations

from collections.abc import Sequence

from catheter_sim.core.effect import Handle, Role

_MOST_RAD = 2.0  # over the length; some 115 deg
_MATTERS_RAD = 0.02
DAMPING = Handle(Role.DAMPING, "dynamics.damping_time_s", "damping_time_s")  # of every kind's robots


def curvature_handle(key: str, parameter: str, group: str, length_m: float) -> Handle:
    """Return the place of a curvature that acts over a length."""
    most = _MOST_RAD / length_m
    return Handle(Role.REST_CURVATURE, key, parameter, group, _MATTERS_RAD / length_m, -most, most)


def curvature_handles(segments: Sequence[tuple[str, float, str]]) -> tuple[Handle, ...]:
    """Return the places of rest curvatures: of all segments alike, and of several also of each.

    Args:
        segments: name, length [m] and bending axes ("x", "y" or "xy") of each.
    """
    axes = _axes(segments)
    length_m = sum(length for _, length, _ in segments)
    common = [
        curvature_handle(_key(name, axis), f"curvature_{axis}_per_m", "all", length_m)
        for axis in axes
        for name, _, own in segments
        if axis in own
    ]
    if len(segments) == 1:
        return tuple(common)
    each = [
        curvature_handle(_key(name, axis), f"curvature_{name}_{axis}_per_m", "each", length)
        for name, length, own in segments
        for axis in own
    ]
    return (*common, *each)


def _axes(segments: Sequence[tuple[str, float, str]]) -> str:
    """Return the directions in which any of the segments bends."""
    return "".join(axis for axis in "xy" if any(axis in own for _, _, own in segments))


def _key(segment: str, axis: str) -> str:
    return f"segments.{segment}.rest_curvature_{axis}_per_m"


def tip_forces(segments: Sequence[tuple[str, float, str]]) -> tuple[Handle, ...]:
    """Return the directions of a force on the tip, in the plane of a planar robot, else in space, and a mass
    there."""
    forces = (Handle(Role.TIP_FORCE, "", f"force_{axis}_N") for axis in f"{_axes(segments)}z")
    return (*forces, Handle(Role.TIP_MASS, "tip_mass_g", "mass_g"))
