"""The elements of MJCF with which plain MuJoCo does what laws do beside the package's step.

A hinge's springs are fixed tendons with a range in which they give no force. Its friction grows with its
angle, which no friction loss of a joint does. It comes from a plastic spring (`springyield`) of a constant
force F whose arm grows: a tendon from a site below the hinge to one above, each at the distance A, has the
length 2 A cos(q / 2), and F times its slope is F A sin(|q| / 2). A second part of the tendon, between sites
on one side of the hinge, takes that slope away but for the third power of q. A tendon yields after a turn by
`TURN_SHARE` of the hinge's range, at that range. A constant part is a plastic fixed tendon. A friction loss
of the same tendons does the same in engines that know no plastic springs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from catheter_sim.exporting.moments import HingeLaw
from catheter_sim.exporting.paths import Shift
from catheter_sim.mjcf.document import Element

TURN_SHARE, STEEP_TURN_SHARE = 0.005, 0.003  # of a hinge's range: the turn after which all friction is there
LOSS_TURN_SHARE = 0.03  # of a hinge's range: by it a friction loss is turned, to have a slope at rest
_CUBIC_AS_LINE = 0.6  # w of the line w x that is nearest to x^3 from 0 to 1, by least squares
Chord = tuple[float, float]  # heights over a hinge of a site on its parent and of one on its body [m]
_ARM: tuple[Chord, ...] = ((-1.0, 1.0),)
# A chord on one side of the hinge, a = 0.43 and b = 0.23 m, has a slope of the same size as the other's,
# which it takes away but for the third power of the angle: a b / (a - b) = 1 / 2.
_GAP_M = 0.2
_MIDDLE_M = (0.5 * _GAP_M + 0.25 * _GAP_M**2) ** 0.5
_STEEP_ARM: tuple[Chord, ...] = (*_ARM, (_MIDDLE_M + 0.5 * _GAP_M, _MIDDLE_M - 0.5 * _GAP_M))
SLIDE_ARMATURE_KG = 0.01  # of a slide that follows a hinge
_FAR = 1e6
# As hard as a step allows: a tie, not a spring.
_TIE: Mapping[str, Any] = {"solref": (0.002, 1), "solimp": (0.9999, 0.9999, 0.001, 0.5, 2)}
_STICK = {"solreffriction": (0.001, 1), "solimpfriction": (0.999, 0.9999, 0.001, 0.5, 2)}
_HIDDEN = {"group": 5, "rgba": (0, 0, 0, 0)}


def add_shifts(root: Element, shifts: Sequence[Shift]) -> None:
    """Let bodies shift as their hinges turn."""
    if not shifts:
        return
    ties, option = root.part("equality"), root.part("option")
    option.part("flag").set(diagexact="enable")  # slides and hinges differ in size
    option.set(solver="CG")  # ten times as fast as Newton's on a hundred such joints
    for shift in shifts:
        body = root.find("body", shift.body)
        joints = [part for part in body.children if part.tag == "joint"]
        body.add(
            "joint",
            name=shift.slide,
            type="slide",
            axis=np.eye(3)[shift.axis],
            armature=SLIDE_ARMATURE_KG,
            stiffness=0,
        )
        for joint in joints:  # those of the robot come after the slide
            body.append(joint)
        ties.add(
            "joint",
            **_TIE,
            name=shift.slide,
            joint1=shift.slide,
            joint2=shift.joint,
            polycoef=(0.0, *shift.coefficients),
        )


def add_springs(root: Element, laws: Sequence[HingeLaw]) -> None:
    """Let hinges have the springs of their laws."""
    if not laws:
        return
    tendons = root.part("tendon")
    for law in laws:
        name = f"spring_{law.joint}"
        if law.stiffness != 0.0:
            _fixed(tendons, law.joint, name, stiffness=law.stiffness, springlength=0)
        for number, (knot, stiffness) in enumerate(law.knots, 1):
            free = (-_FAR, knot) if knot > 0.0 else (knot, _FAR)
            _fixed(tendons, law.joint, f"{name}_{number}", stiffness=stiffness, springlength=free)


def _fixed(tendons: Element, joint: str, name: str, **own: Any) -> None:
    tendons.add("fixed", **own, name=name).add("joint", joint=joint, coef=1)


def add_friction(
    root: Element, plain: mujoco.MjModel, laws: Sequence[HingeLaw], plastic: bool = True
) -> None:
    """Let hinges rub as their laws say, by plastic springs.

    A friction loss is regularised by the tendon's slope at rest, which is zero where the hinge is straight:
    it is turned a little, by `LOSS_TURN_SHARE` of the hinge's range. What grows with the third power of the
    angle would need more than single precision has; it becomes a part of what grows with the angle.

    Args:
        root: the model.
        plain: the same, loaded, without what laws add.
        laws: of its hinges.
        plastic: by plastic springs; otherwise by the tendons' friction loss.
    """
    tendons = root.part("tendon")
    bodies = {body.get("name", "world"): body for body in root.part("worldbody").every("worldbody", "body")}
    for law in laws:
        if law.constant > 0.0:
            own = _rubbing(law.constant, TURN_SHARE * law.range_rad, plastic)
            _fixed(tendons, law.joint, f"rub_{law.joint}_constant", springlength=0, **own)
        arms: Sequence[tuple[float, Sequence[Chord]]] = ((law.width, _ARM), (law.cubic, _STEEP_ARM))
        if not plastic:
            arms = ((law.width + _CUBIC_AS_LINE * law.cubic, _ARM),)
        for share, chords in arms:
            if share > 0.0:
                _add_arm(bodies, tendons, plain, law, share, chords, plastic)


def slope_of(chords: Sequence[Chord], angle: float) -> float:
    """Return by how much chords past a hinge lengthen with its angle, together [m/rad]."""
    lengths = [np.sqrt(a * a + b * b - 2.0 * a * b * np.cos(angle)) for a, b in chords]
    return float(sum(a * b * np.sin(angle) / own for (a, b), own in zip(chords, lengths, strict=True)))


def _add_arm(
    bodies: dict[str, Element],
    tendons: Element,
    plain: mujoco.MjModel,
    law: HingeLaw,
    moment: float,
    chords: Sequence[Chord],
    plastic: bool,
) -> None:
    """Add a tendon past a hinge that rubs by more the more it is turned, by `moment` at its range [N m]."""
    joint = plain.joint(law.joint)
    body = int(joint.bodyid[0])
    axis, hinge = plain.jnt_axis[joint.id], plain.jnt_pos[joint.id]
    along = np.array([0.0, 0.0, 1.0]) - axis[2] * axis  # the straight robot's axis, seen by the hinge
    along = along / np.linalg.norm(along) if np.linalg.norm(along) > 0.1 else np.array([1.0, 0.0, 0.0])
    turn = 0.0 if plastic else LOSS_TURN_SHARE * law.range_rad
    turned = np.cos(turn) * along + np.sin(turn) * np.cross(axis, along)
    places = (
        (bodies[plain.body(plain.body_parentid[body]).name], plain.body_pos[body] + hinge),
        (bodies[plain.body(body).name], hinge),
    )
    arm = abs(slope_of(chords, law.range_rad))
    steep = chords is _STEEP_ARM
    name = f"rub_{law.joint}{'_steep' if steep else ''}"
    yields = arm * law.range_rad * (STEEP_TURN_SHARE if steep else TURN_SHARE)
    tendon = tendons.add(
        "spatial",
        **_HIDDEN,
        **_rubbing(moment / arm, yields, plastic),
        name=name,
        width=1e-4,
        springlength=sum(abs(a - b) for a, b in chords),
    )
    for number, chord in enumerate(chords):
        if number:
            tendon.add("pulley", divisor=1)
        for side, (parent, middle), height in zip(("below", "above"), places, chord, strict=True):
            site = f"{name}_{side}_{number}"
            way = turned if side == "above" else along
            parent.add("site", **_HIDDEN, name=site, pos=middle + height * way, size=1e-4)
            tendon.add("site", site=site)


def _rubbing(force: float, yields: float, plastic: bool) -> dict[str, Any]:
    """Return the attributes of a tendon that resists with a force [N, N m] after so much motion [m, rad]."""
    if plastic:
        return {"stiffness": force / yields, "springyield": yields}
    return {"frictionloss": force, **_STICK}
