"""A mount that gives way under a catheter's bending tendons.

The base sinks by s = sum T / k toward the drives, so that every tendon is drawn by s less, whichever way. A
pulled tendon's tension balances its joint's elastic moment, T = K |theta - rest| / arm(theta); the antagonist
is slack. With the drawn way d and the tendon's compliance c [m/rad], each bending joint obeys

    l(theta) + c |theta - rest| = |d| - s,

and s is where both meet: s - sum T(s) / k rises with s, so that there is one such s. Torsion joints and
tubes need no tension here.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import has_mount_slide
from catheter_sim.errors import InputError
from catheter_sim.kinds.catheter.layout import bent_by, beside_springs, joint_stiffness, moved_segment
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.kinds.catheter.theory.tendons import arm_m, elastic_angle_rad

_MOST_STEPS = 40
_SMALLEST_STEP_M = 1e-15


def require_rigid_mount(robot: CatheterRobot, model: str) -> None:
    """Raise `InputError` where the mount gives way, of which a static model does not know."""
    if has_mount_slide(robot):
        shown = f"{robot.mount.axial_stiffness_N_per_m * 1e-3:g}"
        raise InputError(
            f"{robot.name}: mount.axial_stiffness_N_per_mm = {shown}: static model {model!r} has no mount "
            "that gives way; must be inf"
        )


def require_springs(robot: CatheterRobot, model: str) -> None:
    """Raise `InputError` where the mount gives way under tendons that do more than pull at springs."""
    more = beside_springs(robot)
    if has_mount_slide(robot) and more:
        raise InputError(
            f"{robot.name}: mount.axial_stiffness_N_per_mm: static model {model!r} has a mount that "
            f"gives way beside springs alone, not beside {more}; set it to inf, or simulate"
        )


def eased_m(drawn_m: Array, sunk_m: Array | float) -> Array:
    """Return ways of a pair, shape (r,), after the base has sunk toward the drives, same shape [m]."""
    return np.copysign(np.maximum(np.abs(drawn_m) - sunk_m, 0.0), drawn_m)


def sunk_by(robot: CatheterRobot, drawn_m: Array) -> Array:
    """Return how far the base sinks, shape (r,) [m]; NaN where a joint is led beyond its range.

    Args:
        robot: a catheter whose bending joints are springs, without friction.
        drawn_m: how far each pair's tendons are drawn at the drive, shape (r, t) [m].
    """
    sunk = np.zeros(len(drawn_m))
    if not has_mount_slide(robot):
        return sunk
    for _ in range(_MOST_STEPS):  # from no sinking, Newton's steps go up
        tension_N, loosening = _tension(robot, drawn_m, sunk)
        stiffness = robot.mount.axial_stiffness_N_per_m
        step = (tension_N / stiffness - sunk) / (1.0 + loosening / stiffness)
        sunk = np.maximum(sunk + step, 0.0)
        if not (np.abs(step) > _SMALLEST_STEP_M).any():
            break
    return sunk


def _tension(robot: CatheterRobot, drawn_m: Array, sunk_m: Array) -> tuple[Array, Array]:
    """Return the bending tendons' summed tension [N], and by how much it falls as the base sinks [N/m]."""
    tension_N, loosening = np.zeros(len(drawn_m)), np.zeros(len(drawn_m))
    bending = bent_by(robot)
    for pair, item in enumerate(robot.tendons):
        if item.name not in bending:
            continue
        segment = robot.segments[moved_segment(robot, pair)]
        stiffness = joint_stiffness(robot, segment)
        compliance_m = stiffness / segment.arm_m / item.stiffness_N_per_m
        way = eased_m(drawn_m[:, pair], sunk_m)
        angle = elastic_angle_rad(segment, way, compliance_m)
        arm = arm_m(segment, angle)
        tension_N += stiffness * np.abs(angle - segment.rest_rad) / arm
        # The arm's own change with the angle is left out: it is a step's direction alone.
        loosening += np.where(way != 0.0, stiffness / arm / (arm + compliance_m), 0.0)
    return tension_N, loosening
