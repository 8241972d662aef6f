"""The robot in the anatomy as MJCF: the robot's own model, pushed through the septum, with contacts.

What is added to the robot's model (`catheter_sim.modelling.build`), which is not changed otherwise:

- the body `catheter`, which carries the robot's base on the slide `insertion` along the sheath, and the
  actuator `insertion`, the last: control in m, from the place in which the robot waits outside the septum;
- the body `implant_mount` in the holder, where the implant is turned in it (`plan.implant_turn_rad`);
- geoms `touch_<k>` of every element, `touch_<arm>` and `touch_post` of the implant, not drawn;
- geoms `wall_<k>`, convex blocks, not drawn, and `atrium`, the wall's closed mesh, only drawn;
- bodies `scallop_<side>` and `margin_<side>` on hinges of the same names, with geoms of the same names;
  geoms `leaflet_<side>_<k>` beside them, only drawn.

The robot touches the anatomy, and nothing else touches anything (`catheter_sim.procedure.contact`). The
exposed tube, which is thinner than everything before it, touches nothing. Contacts have no friction: wet
tissue. Blood and the beating heart are left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from catheter_sim.anatomy.wall import blocks, facings, shell
from catheter_sim.mjcf.document import ALL_DIGITS, Element, read
from catheter_sim.mjcf.names import link as link_name
from catheter_sim.mjcf.parts import GROUP
from catheter_sim.modelling.model_cache import remembered_mjcf
from catheter_sim.modelling.surroundings import (
    NO_MASS,
    add_mesh,
    carry,
    quaternion,
    text,
    touched,
    touched_block,
    touching,
)
from catheter_sim.procedure import valve
from catheter_sim.procedure.atrium import wall
from catheter_sim.procedure.plan import Plan, implant_turn_rad, tip_to_end_m
from catheter_sim.robots.catheter.description import elements, ring_length_m
from catheter_sim.robots.catheter.picture import ARMS, IMPLANT_M, arm_width_m, holder_length_m, pieces
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.tissue import TISSUE

MOUNT = "implant_mount"
WAITING_M = 3e-3  # of the implant before the septum at the start
# assumed: leaflets follow what presses on them with a few hundredths of a newton
HINGE_N_M_PER_RAD = {"scallop": 1e-3, "margin": 2e-4}
# What a scene of tissue is made of; every plate of a leaflet is felt for itself.
FOUND_M = 0.5e-3  # before it presses a contact with tissue is known: more than the way of a step
REGIONS = ("wall", *(f"{plate}_{side}" for plate in HINGE_N_M_PER_RAD for side in valve.SIDES))
_WALL_RGBA, _LEAFLET_RGBA = "0.86 0.47 0.45 0.18", "0.93 0.72 0.60 1"
_FOUND_ONLY = {"margin": -0.05, "gap": 0.05}  # MuJoCo finds these contacts; `contact` has their forces


@dataclass(frozen=True)
class Scene:
    """A robot in an anatomy.

    Attributes:
        robot: the robot.
        plan: its way.
        text: the model as MJCF; opens in any MuJoCo viewer.
        waiting_m: insertion of the base at which the slide `insertion` is 0.
    """

    robot: CatheterRobot
    plan: Plan
    text: str
    waiting_m: float


def build_scene(robot: CatheterRobot, plan: Plan, tissue: bool = False) -> Scene:
    """Return the scene in which the robot waits outside the septum, valve frame.

    Args:
        robot: the catheter.
        plan: its way.
        tissue: what is touched presses back as `simulation.tissue` has it, not as `contact` and MuJoCo do:
            the regions of `REGIONS`, geoms `tissue_<region>_<k>` in place of the names above.
    """
    length = sum(segment.length_m for segment in robot.segments) + tip_to_end_m(robot)
    waiting = -length - WAITING_M
    root = read(remembered_mjcf(robot))
    root.part("statistic").set(center=(0, 0, 0.02))
    world = root.part("worldbody")
    carry(root, robot.dynamics, plan.base(waiting))
    _turn_implant(robot, world)
    _add_touches(robot, world)
    around = wall(plan.anatomy, plan.puncture, plan.direction)
    add_mesh(root, "atrium", shell(around), _WALL_RGBA)
    for number, (corners, facing) in enumerate(zip(blocks(around), facings(around), strict=True)):
        if tissue:
            touched_block(root, f"{TISSUE}wall_{number}", corners, facing, margin=FOUND_M)
        else:
            touched_block(root, f"wall_{number}", corners, None, **_FOUND_ONLY)
    for side, sign in valve.SIDES.items():
        if tissue:
            _add_leaflet(robot, plan, root, side, sign, f"{TISSUE}{{}}_0", FOUND_M)
        else:
            _add_leaflet(robot, plan, root, side, sign)
    return Scene(robot, plan, root.text(ALL_DIGITS), waiting)


def _turn_implant(robot: CatheterRobot, world: Element) -> None:
    """Put the implant, where it is turned in its holder, into the body `implant_mount`."""
    turn = implant_turn_rad(robot)
    if turn == 0.0:
        return
    holder = world.find("site", "implant").parent
    held = [child for child in holder.children if child.get("name", "").startswith("implant")]
    turned = text((math.cos(0.5 * turn), 0.0, 0.0, math.sin(0.5 * turn)))
    mount = holder.add("body", name=MOUNT, quat=turned)
    mount.add("inertial", **NO_MASS)
    for child in held:
        mount.append(child)


def _add_touches(robot: CatheterRobot, world: Element) -> None:
    """Add to every element what touches: balls around the middles of rings, cylinders for modules."""
    bodies = {body.get("name"): body for body in world.every("body")}
    parts = elements(robot)
    for piece in pieces(robot):
        if not piece.element:
            continue
        segment = robot.segments[piece.segment]
        radius, top = segment.outer_radius_m, parts[piece.element - 1].face_m - piece.origin_m
        bottom = top - (ring_length_m(segment) if piece.gap else segment.length_m)
        if piece.segment == len(robot.segments) - 1:
            top = holder_length_m(robot)
        middle = text((0, 0, 0.5 * (bottom + top)))
        shape: dict[str, Any] = {"type": "sphere", "size": radius, "pos": middle}
        if not piece.gap:  # one module goes on where the other ends: no notch in which a leaflet would catch
            shape = {"type": "cylinder", "size": radius, "fromto": text((0, 0, bottom, 0, 0, top))}
        touching(bodies[piece.name], name=f"touch_{piece.element}", **shape)
    outer, width = robot.segments[-1].outer_radius_m, 0.5 * arm_width_m(robot)
    holder = bodies[link_name(len(parts))]
    middle = text((0, 0, holder_length_m(robot) + 0.5 * IMPLANT_M))
    size = text((0.1 * outer, 0.5 * width, 0.45 * IMPLANT_M))
    touching(bodies.get(MOUNT, holder), name="touch_post", type="box", size=size, pos=middle)
    for arm, side in ARMS.items():
        place = (side * 0.17 * outer, 0.0, -0.38 * IMPLANT_M)
        size = text((0.17 * outer, width, 0.40 * IMPLANT_M))
        touching(bodies[arm], name=f"touch_{arm}", type="box", size=size, pos=text(place))


def _add_leaflet(
    robot: CatheterRobot,
    plan: Plan,
    root: Element,
    side: str,
    sign: float,
    named: str = "{}",
    margin: float = 0.0,
) -> None:
    """Add a leaflet: its middle scallop on hinges, its geoms so named, and what lies beside it."""
    carrier, place, R = root.part("worldbody"), np.zeros(3), np.eye(3)
    for name, plate in zip(HINGE_N_M_PER_RAD, valve.scallop(plan.anatomy, sign), strict=True):
        stiffness = HINGE_N_M_PER_RAD[name]
        carrier = carrier.add(
            "body",
            name=f"{name}_{side}",
            pos=text(R.T @ (plate.hinge - place)),
            quat=quaternion(R.T @ plate.R),
        )
        place, R = plate.hinge, plate.R
        carrier.add(
            "joint",
            name=f"{name}_{side}",
            type="hinge",
            axis=(0, 1, 0),
            stiffness=stiffness,
            damping=stiffness * robot.dynamics.relaxation_time_s,
            armature=stiffness * robot.dynamics.inertia_time_s**2,
        )
        carrier.add("inertial", **NO_MASS)
        size = 0.5 * np.array([plate.length_m, plate.width_m, plate.thickness_m])
        touched(
            carrier,
            name=named.format(f"{name}_{side}"),
            type="box",
            size=text(size),
            pos=text((size[0], 0, 0)),
            rgba=_LEAFLET_RGBA,
            margin=margin,
        ).set(group=GROUP)
    for number, mesh in enumerate(valve.beside(plan.anatomy, sign)):
        add_mesh(root, f"leaflet_{side}_{number}", mesh, _LEAFLET_RGBA)
