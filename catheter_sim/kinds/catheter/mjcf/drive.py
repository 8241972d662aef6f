"""What moves a catheter's joints in its MJCF: an actuator for each pair, and one for each antagonist.

Actuators `tendon_<pair>` stand first, in the robot's order, then `antagonist_<pair>` of the bending
joints' pairs; a common pulley gives an antagonist the opposite control. Controls are in m.

Torsion. Its pair is in no spatial tendon: MuJoCo wraps one by less than half a turn, and the paper's
antagonist is too short (`kinds.catheter.theory.tendons`). Its actuator turns the joint; what
`catheter_sim.kinds.catheter.forces.torsion` does to it before every step makes it Eq. 6. In the file as it
stands it is Eq. 6 in the linear range about zero.
"""

from __future__ import annotations

import math

from catheter_sim.core.robot import has_mount_slide
from catheter_sim.kinds.catheter.layout import joint_stiffness, moved_segment
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment, TendonPair
from catheter_sim.kinds.catheter.theory.elongation import PRINTED
from catheter_sim.kinds.catheter.theory.tendons import arm_m, drawn_at_rest_m
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.names import tendon
from catheter_sim.mjcf.tendons import FEED_LENGTH_M, add_puller

# An inextensible tendon is a spring this many times stiffer than its joint's bending seen from it; the
# angle then lags by less than 0.02 % of itself. Ten times that of a continuum robot: what is beyond the
# joint is long.
INEXTENSIBLE_RATIO = 1e4
# Joints without a stiffness of their own take their damping, armature and drive from these. Of the order
# of the bending joints'; no equilibrium depends on them but by the drive's yield under a load.
TURNING_SCALE_N_M_PER_RAD = 5e-3
SLIDING_SCALE_N_PER_M = 1e3


def tendon_stiffness(robot: CatheterRobot, pair: TendonPair) -> float:
    """Return the stiffness of each tendon of a pair, or of an advanced tube; finite [N/m].

    Of a tendon with a law of its own: that at no strain, in series with its stiffness.
    """
    if pair.law == "uhmwpe":
        return 1.0 / (pair.length_m / PRINTED.envelope_N[2] + 1.0 / pair.stiffness_N_per_m)
    if math.isfinite(pair.stiffness_N_per_m):
        return pair.stiffness_N_per_m
    segment = next(item for item in robot.segments if item.name == pair.moves)
    if segment.joint == "prismatic":
        return INEXTENSIBLE_RATIO * SLIDING_SCALE_N_PER_M
    if segment.joint == "torsion":
        return INEXTENSIBLE_RATIO * TURNING_SCALE_N_M_PER_RAD / segment.tendon_radius_m**2
    joint = joint_stiffness(robot, segment)
    return INEXTENSIBLE_RATIO * joint / segment.arm_m**2


def add_catheter_actuators(root: Element, robot: CatheterRobot) -> None:
    """Add the actuators; to be called when the tendons are there."""
    moved = [robot.segments[moved_segment(robot, index)] for index in range(len(robot.tendons))]
    for pair, segment in zip(robot.tendons, moved, strict=True):
        if segment.joint == "bending":
            _add_puller(root, robot, pair, segment, tendon(pair.name), "pos")
            continue
        stiffness = tendon_stiffness(robot, pair)
        arm = float(arm_m(segment, 0.0)) if segment.joint == "torsion" else 1.0
        root.part("actuator").add(
            "general",
            name=tendon(pair.name),
            joint=segment.name,
            biastype="affine",
            gainprm=(stiffness * arm,),
            biasprm=(0.0, -stiffness * arm**2, 0.0),
        )
    for pair, segment in zip(robot.tendons, moved, strict=True):
        if segment.joint == "bending":
            _add_puller(root, robot, pair, segment, f"antagonist_{pair.name}", "neg")


def _add_puller(
    root: Element,
    robot: CatheterRobot,
    pair: TendonPair,
    segment: CatheterSegment,
    name: str,
    sign: str,
) -> None:
    """Add the actuator of one tendon of a bending joint: a spring that pulls only."""
    stiffness = tendon_stiffness(robot, pair)
    length = segment.length_m + pair.slack_m + (FEED_LENGTH_M if has_mount_slide(robot) else 0.0)
    length -= drawn_at_rest_m(segment, sign)
    add_puller(root, name, tendon(f"{pair.name}_{sign}"), stiffness, stiffness * length)
