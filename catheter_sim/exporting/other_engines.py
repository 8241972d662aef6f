"""What a model must be like for engines that know less than MuJoCo: MJX and MuJoCo Warp.

They have no plastic springs, no late controls or views, no implicit integration, and they regularise a
constraint by the inertia that a joint or a tendon has at the straight robot at rest, as MuJoCo does without
its flag `diagexact`: R = (1 - d) / d times what `dof_invweight0`, `tendon_invweight0` say. For a tie of a
slide to a hinge that is 1 / inertia of the hinge, in 1 / (kg m^2), beside that of the slide, in 1 / kg, and a
hinge alone in a light robot has next to no inertia: the tie gives way by a millimetre. Tendons tie them
instead, the hinge's an angle times a short lever. For a friction loss it is nothing at all where the tendon
has no slope at rest; `elements.add_friction` gives it some. A friction loss creeps by R times its force, the
less the more inertia the hinge has: it gets its stiffness times `HINGE_TIME_S` squared. At rest nothing is
felt of that.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

import mujoco

from catheter_sim.exporting.elements import child, text_of
from catheter_sim.exporting.moments import HingeLaw

HINGE_TIME_S = 0.01  # as `core.robot.Dynamics` gives held rows
_LEVER_M = 1e-3  # by which an angle is made a length
_TIE_STEPS = 2.0  # in which a tie closes: MuJoCo allows no fewer
_LATE = ("delay", "nsample", "interp")
_INTEGRATORS = ("Euler", "implicitfast")


def make_plainer(root: ElementTree.Element, plain: mujoco.MjModel, laws: Sequence[HingeLaw]) -> None:
    """Take out of a model what such engines refuse, and let its ties and friction be hard without it.

    Args:
        root: the model, with all that it is given.
        plain: the same, loaded, without what laws add.
        laws: of its hinges.
    """
    for item in (*child(root, "actuator"), *child(root, "sensor")):
        for key in _LATE:
            item.attrib.pop(key, None)
    option = child(root, "option")
    if option.get("integrator") not in _INTEGRATORS:
        option.set("integrator", "implicitfast")
    child(option, "flag").attrib.pop("diagexact", None)
    option.set("solver", "Newton")  # with friction losses it is the faster one
    _tie_by_lengths(root, plain.opt.timestep)
    stiffness = {law.joint: abs(law.stiffness) + float(plain.joint(law.joint).stiffness[0]) for law in laws}
    for joint in root.iterfind("worldbody//joint"):
        if own := stiffness.get(joint.get("name", ""), 0.0):
            inertia = max(own * HINGE_TIME_S**2, float(joint.get("armature", "0")))
            joint.set("armature", text_of(inertia))


def _tie_by_lengths(root: ElementTree.Element, timestep_s: float) -> None:
    """Let tendons tie slides to hinges, so that a hinge's angle counts as a length."""
    equality, tendons = child(root, "equality"), child(root, "tendon")
    made: set[str] = set()
    for tie in equality.findall("joint"):
        slide, hinge = tie.get("joint1", ""), tie.get("joint2", "")
        for joint, coefficient in ((slide, 1.0), (hinge, _LEVER_M)):
            if joint not in made:
                made.add(joint)
                tendon = ElementTree.SubElement(tendons, "fixed", name=f"tie_{joint}")
                ElementTree.SubElement(tendon, "joint", joint=joint, coef=text_of(coefficient))
        powers = enumerate(float(text) for text in tie.get("polycoef", "").split())
        tie.tag = "tendon"
        tie.attrib.pop("joint1")
        tie.attrib.pop("joint2")
        tie.set("tendon1", f"tie_{slide}")
        tie.set("tendon2", f"tie_{hinge}")
        tie.set("polycoef", text_of(*(value / _LEVER_M**power for power, value in powers)))
        tie.set("solref", text_of(_TIE_STEPS * timestep_s, 1.0))
