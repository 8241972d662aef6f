"""The elements of MJCF with which plain MuJoCo does what laws do beside the package's step.

A hinge's springs are fixed tendons with a range in which they give no force. Its friction grows with its
angle, which no friction loss of a joint does. It comes from a plastic spring (`springyield`) of a constant
force F whose arm grows: a tendon from a site below the hinge to one above, each at the distance A, has the
length 2 A cos(q / 2), and F times its slope is F A sin(|q| / 2). It yields after a turn by `TURN_SHARE` of
the hinge's range. A constant part is a plastic
fixed tendon. A friction loss of the same tendons does the same in engines that know no plastic
springs.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

import mujoco
import numpy as np

from catheter_sim.exporting.moments import HingeLaw
from catheter_sim.exporting.paths import Shift

TURN_SHARE = 0.01  # of a hinge's range: the turn after which its friction is all there
ARM_M = 1.0  # from a hinge to the sites of its plastic tendon, not drawn
SLIDE_ARMATURE_KG = 0.01  # of a slide that follows a hinge
_FAR = "1e6"
# As hard as a step allows: a tie, not a spring.
_TIE = {"solref": "0.002 1", "solimp": "0.9999 0.9999 0.001 0.5 2"}
_STICK = {"solreffriction": "0.001 1", "solimpfriction": "0.999 0.9999 0.001 0.5 2"}
_HIDDEN = {"group": "5", "rgba": "0 0 0 0"}


def text_of(*values: float) -> str:
    """Return numbers as MJCF has them."""
    return " ".join(f"{value:.12g}" for value in values)


def child(root: ElementTree.Element, tag: str) -> ElementTree.Element:
    """Return the model's element `tag`, made where it is not there."""
    found = root.find(tag)
    return ElementTree.SubElement(root, tag) if found is None else found


def bodies_of(root: ElementTree.Element) -> dict[str, ElementTree.Element]:
    """Return the model's bodies by name."""
    return {body.get("name", ""): body for body in root.iter("body")}


def add_shifts(root: ElementTree.Element, shifts: Sequence[Shift]) -> None:
    """Let bodies shift as their hinges turn."""
    if not shifts:
        return
    bodies, ties = bodies_of(root), child(root, "equality")
    flag = child(child(root, "option"), "flag")
    flag.set("diagexact", "enable")  # slides and hinges differ in size
    child(root, "option").set("solver", "CG")  # ten times as fast as Newton's on a hundred such joints
    for shift in shifts:
        body = bodies[shift.body]
        slide = ElementTree.Element(
            "joint",
            name=shift.slide,
            type="slide",
            axis=text_of(*np.eye(3)[shift.axis]),
            armature=text_of(SLIDE_ARMATURE_KG),
            stiffness="0",
        )
        first = next(k for k, part in enumerate(body) if part.tag == "joint")
        body.insert(first, slide)
        ElementTree.SubElement(
            ties,
            "joint",
            _TIE,
            name=shift.slide,
            joint1=shift.slide,
            joint2=shift.joint,
            polycoef=text_of(0.0, *shift.coefficients),
        )


def add_springs(root: ElementTree.Element, laws: Sequence[HingeLaw]) -> None:
    """Let hinges have the springs of their laws."""
    if not laws:
        return
    tendons = child(root, "tendon")
    for law in laws:
        if law.stiffness != 0.0:
            _fixed(
                tendons, law.joint, f"spring_{law.joint}", stiffness=text_of(law.stiffness), springlength="0"
            )
        for number, (knot, stiffness) in enumerate(law.knots, 1):
            free = f"-{_FAR} {text_of(knot)}" if knot > 0.0 else f"{text_of(knot)} {_FAR}"
            _fixed(
                tendons,
                law.joint,
                f"spring_{law.joint}_{number}",
                stiffness=text_of(stiffness),
                springlength=free,
            )


def _fixed(tendons: ElementTree.Element, joint: str, name: str, **own: str) -> None:
    tendon = ElementTree.SubElement(tendons, "fixed", own, name=name)
    ElementTree.SubElement(tendon, "joint", joint=joint, coef="1")


def add_friction(
    root: ElementTree.Element, plain: mujoco.MjModel, laws: Sequence[HingeLaw], plastic: bool = True
) -> None:
    """Let hinges rub as their laws say, by plastic springs.

    Args:
        root: the model.
        plain: the same, loaded, without what laws add.
        laws: of its hinges.
        plastic: by plastic springs; otherwise by the tendons' friction loss.
    """
    bodies, tendons = bodies_of(root), child(root, "tendon")
    for law in laws:
        if law.constant > 0.0:
            own = _rubbing(law.constant, TURN_SHARE * law.range_rad, plastic)
            _fixed(tendons, law.joint, f"rub_{law.joint}_constant", springlength="0", **own)
        if law.width > 0.0:
            _add_arm(bodies, child(root, "worldbody"), tendons, plain, law, plastic)


def _add_arm(
    bodies: dict[str, ElementTree.Element],
    world: ElementTree.Element,
    tendons: ElementTree.Element,
    plain: mujoco.MjModel,
    law: HingeLaw,
    plastic: bool,
) -> None:
    """Add a tendon past a hinge whose moment grows with the angle."""
    joint = plain.joint(law.joint)
    body = int(joint.bodyid[0])
    axis, hinge = plain.jnt_axis[joint.id], plain.jnt_pos[joint.id]
    along = np.array([0.0, 0.0, 1.0]) - axis[2] * axis  # the straight robot's axis, seen by the hinge
    along = along / np.linalg.norm(along) if np.linalg.norm(along) > 0.1 else np.array([1.0, 0.0, 0.0])
    below = plain.body_pos[body] + hinge - ARM_M * along
    parent = bodies.get(plain.body(plain.body_parentid[body]).name, world)
    names = [f"rub_{law.joint}_{side}" for side in ("below", "above")]
    ElementTree.SubElement(parent, "site", _HIDDEN, name=names[0], pos=text_of(*below), size="0.0001")
    above = hinge + ARM_M * along
    ElementTree.SubElement(
        bodies[plain.body(body).name], "site", _HIDDEN, name=names[1], pos=text_of(*above), size="0.0001"
    )
    arm = ARM_M * np.sin(0.5 * law.range_rad)
    force = law.width / arm
    yields = arm * TURN_SHARE * law.range_rad
    tendon = ElementTree.SubElement(
        tendons,
        "spatial",
        _HIDDEN | _rubbing(force, yields, plastic),
        name=f"rub_{law.joint}",
        width="0.0001",
        springlength=text_of(2.0 * ARM_M),
    )
    for name in names:
        ElementTree.SubElement(tendon, "site", site=name)


def _rubbing(force: float, yields: float, plastic: bool) -> dict[str, str]:
    """Return the attributes of a tendon that resists with a force [N, N m] after so much motion [m, rad]."""
    if plastic:
        return {"stiffness": text_of(force / yields), "springyield": text_of(yields)}
    return {"frictionloss": text_of(force), **_STICK}
