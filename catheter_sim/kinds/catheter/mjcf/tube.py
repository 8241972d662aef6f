"""The exposed tube of a prismatic segment as MJCF, where it bends: by its own curvature or under load.

The tube is its chord, a slide, with a universal joint at either end (`kinds.catheter.theory.tube`). In the
body of the segment's element, from the guide outward, stand the hinges `exit_<segment>_x` and `_y`,
the slide, `twist_<segment>`, `inlet_<segment>_y` and `_x`; `x` bends toward +x. The inlet mirrors
the exit, so that an arc in any plane is without twist; what bends unlike an arc twists by what the
hinges' order makes of it, and the hinge `twist` takes that back. Either end turns by 80 deg at most:
arcs up to 160 deg, and less where an end alone is bent.

The beam's law is in springs over both ends: fixed tendons `bend_<segment>_<axis>`, the sum of the two
hinges, and `skew_<segment>_<axis>`, their difference. `catheter_sim.kinds.catheter.forces.tube` makes
them those of the present length before every step. In the file as it stands the stiffness is that of
half the stroke, the rest bend is right, and the slide is the chord.
"""

from __future__ import annotations

import math

from catheter_sim.kinds.catheter.layout import bending_tubes, tube_stiffness_N_m2
from catheter_sim.kinds.catheter.mjcf.drive import INEXTENSIBLE_RATIO, TURNING_SCALE_N_M_PER_RAD
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.kinds.catheter.theory.tube import SKEW_STIFFNESS
from catheter_sim.mjcf.document import Element

BEND_AXIS = {"x": (0, 1, 0), "y": (-1, 0, 0)}
RIGID_N_M_PER_RAD = INEXTENSIBLE_RATIO * TURNING_SCALE_N_M_PER_RAD  # of the ends of a rigid curved tube
FURTHEST_RAD = math.radians(80.0)  # at 90 deg the two hinges of an end would stand in one plane
_ORDER = {"exit": "xy", "inlet": "yx"}


def tube_joint_names(segment: CatheterSegment) -> list[str]:
    """Return the names of the hinges of a prismatic segment's bending tube, from the guide outward."""
    ends = {end: [f"{end}_{segment.name}_{axis}" for axis in order] for end, order in _ORDER.items()}
    return [*ends["exit"], f"twist_{segment.name}", *ends["inlet"]]


def add_tube_end(body: Element, robot: CatheterRobot, segment: CatheterSegment, end: str) -> None:
    """Add the hinges of one end, "exit" (before the slide) or "inlet"; none to a rigid straight tube."""
    if segment not in bending_tubes(robot):
        return
    times = robot.dynamics
    if end == "inlet":
        body.add(
            "joint",
            name=f"twist_{segment.name}",
            type="hinge",
            axis=(0, 0, 1),
            stiffness=RIGID_N_M_PER_RAD,
            damping=TURNING_SCALE_N_M_PER_RAD * times.relaxation_time_s,
            armature=TURNING_SCALE_N_M_PER_RAD * times.inertia_time_s**2,
        )
    for axis in _ORDER[end]:
        body.add(
            "joint",
            name=f"{end}_{segment.name}_{axis}",
            type="hinge",
            axis=BEND_AXIS[axis],
            range=(-FURTHEST_RAD, FURTHEST_RAD),
            limited=True,
            armature=_scale(robot, segment) * times.inertia_time_s**2,
        )


def add_tube_springs(root: Element, robot: CatheterRobot) -> None:
    """Add the springs over both ends of every tube that bends; to be called after the other tendons."""
    for segment in bending_tubes(robot):
        curvature = {"x": segment.tube_curvature_x_per_m, "y": segment.tube_curvature_y_per_m}
        for axis in "xy":
            for kind, sign, factor in (("bend", 1.0, 1.0), ("skew", -1.0, SKEW_STIFFNESS)):
                spring = root.part("tendon").add(
                    "fixed",
                    name=f"{kind}_{segment.name}_{axis}",
                    stiffness=factor * tube_spring(robot, segment, 0.5 * segment.stroke_m),
                    damping=factor * _scale(robot, segment) * robot.dynamics.relaxation_time_s,
                )
                spring.add("joint", joint=f"exit_{segment.name}_{axis}", coef=1.0)
                spring.add("joint", joint=f"inlet_{segment.name}_{axis}", coef=sign)
                if kind == "bend" and curvature[axis] != 0.0:
                    spring.add("joint", joint=segment.name, coef=-curvature[axis])


def tube_spring(robot: CatheterRobot, segment: CatheterSegment, length_m: float) -> float:
    """Return the stiffness of a length of tube against its whole bend: EI / length, or rigid [N m/rad]."""
    stiffness = tube_stiffness_N_m2(robot, segment)
    return stiffness / length_m if math.isfinite(stiffness) else RIGID_N_M_PER_RAD


def _scale(robot: CatheterRobot, segment: CatheterSegment) -> float:
    """Return the stiffness from which the hinges take their damping and armature [N m/rad]."""
    if math.isfinite(segment.tube_stiffness_N_m2):
        return tube_spring(robot, segment, 0.5 * segment.stroke_m)
    return TURNING_SCALE_N_M_PER_RAD
