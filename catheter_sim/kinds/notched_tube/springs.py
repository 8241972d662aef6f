"""How stiff unbent notches are: what a model's springs hold of the metal's law, and its damping's scale."""

from __future__ import annotations

from catheter_sim.kinds.notched_tube.layout import notches
from catheter_sim.kinds.notched_tube.spec import NotchedSegment, NotchedTubeRobot
from catheter_sim.kinds.notched_tube.theory.section import closed_stiffness, section, torsion_stiffness


def spring_stiffness(robot: NotchedTubeRobot, segment: NotchedSegment) -> tuple[float, float, float]:
    """Return what resists a notch's turn toward +x, toward +y and about the tube [N m/rad]."""
    metal, shape = robot.material, section(segment)
    modulus = metal.modulus_Pa * robot.stiffness_scale
    per_moment = modulus / segment.notch_height_m
    torsion = torsion_stiffness(segment, modulus, metal.poisson_ratio)
    return per_moment * shape.second_moment_m4, per_moment * shape.lateral_second_moment_m4, torsion


def stop_stiffness(robot: NotchedTubeRobot, segment: NotchedSegment) -> float:
    """Return what resists further bending of a closed notch [N m/rad]."""
    return closed_stiffness(segment, robot.material.modulus_Pa * robot.stiffness_scale)


def bending_seen_from_tendon(robot: NotchedTubeRobot) -> float:
    """Return the whole tube's stiffness against its tendon's displacement, unbent [N/m]."""
    radius = robot.tendons[0].radius_m
    softness = 0.0
    for notch in notches(robot):
        arm = radius + section(notch.segment).centroid_m
        softness += arm**2 / spring_stiffness(robot, notch.segment)[0]
    return 1.0 / softness
