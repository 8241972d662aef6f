"""The implant at a catheter's tip: a clip of two arms that open, held by the last module.

Both mitral papers open it with a tendon that is pulled by hand and print neither its shape nor how it
moves. Assumed, as in clips for edge-to-edge repair: a post on a foot, two arms hinged at the post's far
end that open backward, so that leaflets come to lie between arms and post; sizes, angle and stiffness.

In the model, where the last segment is a torsion joint: bodies and hinges `implant_pos` and `implant_neg`
(toward the tool's +x and -x), the site `implant` in the middle of the clip, and the actuator `implant`,
the last of all: 0 closed, 1 open. It turns the first arm; a passive spring, the tendon `implant_arms`,
makes the other one its mirror image. The arms weigh next to nothing, so that they move no other joint.
"""

from __future__ import annotations

import math

import numpy as np
import trimesh

from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.mjcf.colours import Colour
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.parts import SEEN, add_mesh
from catheter_sim.mjcf.solids import across_y, box, circle, prism, together
from catheter_sim.mjcf.tendons import add_site

ACTUATOR = "implant"
ARMS = {"implant_pos": 1.0, "implant_neg": -1.0}  # bodies and hinges, and the side of the post
IMPLANT_M = 9.5e-3  # free length; assumed
OPEN_RAD = math.radians(60.0)  # of each arm from the post; assumed, of clips that open to 120 deg
SERVO_N_M_PER_RAD = 2e-2  # assumed: half a newton at an arm's end that a leaflet keeps 10 deg open
COUPLING_N_M_PER_RAD = 5.0 * SERVO_N_M_PER_RAD  # between the arms; assumed
COLOUR: Colour = (0.90, 0.70, 0.32, 1.0)
_HOLDER_M = 5.5e-3  # most of a holder's solid part; assumed
_WIDTH = 0.62  # half width of the arms along y, over the outer radius
_POST = 0.10  # half thickness of the post, over the outer radius
_HINGE = (0.13, 0.95)  # x over the outer radius, z over the implant's length
# An arm's outline, closed, toward +x, counter-clockwise; x over the outer radius, z over the length.
_OUTLINE = ((0.13, 0.17), (0.34, 0.14), (0.52, 0.32), (0.42, 0.90), (0.24, 1.0), (0.13, 1.0))
_NO_MASS_KG, _NO_INERTIA_KG_M2 = 1e-9, 1e-13  # as of the bodies of `kinds.catheter.mjcf.chain`


def has_implant(robot: CatheterRobot) -> bool:
    """Return whether the robot's last module holds an implant: one that can turn it does."""
    return robot.segments[-1].joint == "torsion"


def holder_length_m(robot: CatheterRobot) -> float:
    """Return how much of the last module is solid, below the implant's foot [m]."""
    return min(robot.segments[-1].length_m, _HOLDER_M)


def hinge_place_m(robot: CatheterRobot, side: float) -> tuple[float, float, float]:
    """Return where an arm's hinge lies in the last module's frame, `side` +1 or -1 [m]."""
    outer = robot.segments[-1].outer_radius_m
    return (side * _HINGE[0] * outer, 0.0, holder_length_m(robot) + _HINGE[1] * IMPLANT_M)


def arm_length_m() -> float:
    """Return the length of an arm from its hinge to its free end [m]."""
    return (_HINGE[1] - min(z for _, z in _OUTLINE)) * IMPLANT_M


def arm_width_m(robot: CatheterRobot) -> float:
    """Return the width of an arm, along the tool's y [m]."""
    return 2.0 * _WIDTH * robot.segments[-1].outer_radius_m


def post_mesh(outer_m: float) -> trimesh.Trimesh:
    """Return the implant's foot and post, from z = 0, for a module of this outer radius [m]."""
    foot = prism(circle(0.55 * outer_m, 24), [], 0.0, 0.12 * IMPLANT_M)
    half, width = _POST * outer_m, 0.5 * _WIDTH * outer_m
    return together([foot, box((-half, half), (-width, width), (0.10 * IMPLANT_M, 0.97 * IMPLANT_M))])


def arm_mesh(outer_m: float, side: float) -> trimesh.Trimesh:
    """Return an arm as it lies closed, in its hinge's frame, on the side +1 or -1."""
    outline = (np.array(_OUTLINE) - _HINGE) * (side * outer_m, IMPLANT_M)
    width = _WIDTH * outer_m
    return across_y(outline if side > 0 else outline[::-1], -width, width)


def add_implant(root: Element, robot: CatheterRobot, holder: Element) -> None:
    """Add the arms to the body `holder` of the last module, and their actuator; to be called last.

    The servo holds both arms at `OPEN_RAD` times its control exactly where nothing presses on them.
    """
    if not has_implant(robot):
        return
    outer = robot.segments[-1].outer_radius_m
    middle = holder_length_m(robot) + 0.5 * IMPLANT_M
    add_site(holder, "implant", (0, 0, middle))
    arms = root.part("tendon").add(
        "fixed", name="implant_arms", stiffness=COUPLING_N_M_PER_RAD, springlength=0.0
    )
    for name, side in ARMS.items():
        add_mesh(root, name, arm_mesh(outer, side))
        body = holder.add("body", name=name, pos=hinge_place_m(robot, side))
        body.add("inertial", pos=(0, 0, 0), mass=_NO_MASS_KG, diaginertia=[_NO_INERTIA_KG_M2] * 3)
        body.add(
            "joint",
            name=name,
            type="hinge",
            axis=(0, -side, 0),  # opening is positive
            damping=SERVO_N_M_PER_RAD * robot.dynamics.relaxation_time_s,
            armature=SERVO_N_M_PER_RAD * robot.dynamics.inertia_time_s**2,
        )
        body.add("geom", name=f"{name}_arm", mesh=name, rgba=COLOUR, material="metal", **SEEN)
        arms.add("joint", joint=name, coef=side)
    root.part("actuator").add(
        "general",
        name=ACTUATOR,
        joint=next(iter(ARMS)),
        biastype="affine",
        ctrlrange=(0.0, 1.0),
        gainprm=(SERVO_N_M_PER_RAD * OPEN_RAD,),
        biasprm=(0.0, -SERVO_N_M_PER_RAD, 0.0),
    )
