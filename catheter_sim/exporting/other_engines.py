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

from collections.abc import Sequence

import mujoco

from catheter_sim.exporting.moments import HingeLaw
from catheter_sim.mjcf.document import Element

HINGE_TIME_S = 0.01  # as `core.robot.Dynamics` gives held rows
_LEVER_M = 1e-3  # by which an angle is made a length
_TIE_STEPS = 2.0  # in which a tie closes: MuJoCo allows no fewer
_INTEGRATORS = ("Euler", "implicitfast")


def make_plainer(root: Element, plain: mujoco.MjModel, laws: Sequence[HingeLaw]) -> None:
    """Take out of a model what such engines refuse, and let its ties and friction be hard without it.

    Args:
        root: the model, with all that it is given.
        plain: the same, loaded, without what laws add.
        laws: of its hinges.
    """
    for item in (*root.part("actuator").children, *root.part("sensor").children):
        item.set(delay=None, nsample=None, interp=None)
    option = root.part("option")
    if option.get("integrator") not in _INTEGRATORS:
        option.set(integrator="implicitfast")
    option.part("flag").set(diagexact=None)
    option.set(solver="Newton")  # with friction losses it is the faster one
    _tie_by_lengths(root, plain.opt.timestep)
    stiffness = {law.joint: abs(law.stiffness) + float(plain.joint(law.joint).stiffness[0]) for law in laws}
    for joint in root.part("worldbody").every("joint"):
        if own := stiffness.get(joint.get("name", ""), 0.0):
            joint.set(armature=max(own * HINGE_TIME_S**2, *joint.numbers("armature", 0.0)))


def _tie_by_lengths(root: Element, timestep_s: float) -> None:
    """Let tendons tie slides to hinges, so that a hinge's angle counts as a length."""
    tendons = root.part("tendon")
    made: set[str] = set()
    for tie in root.part("equality").every("joint"):
        slide, hinge = tie.get("joint1"), tie.get("joint2")
        for joint, coefficient in ((slide, 1.0), (hinge, _LEVER_M)):
            if joint not in made:
                made.add(joint)
                tendon = tendons.add("fixed", name=f"tie_{joint}")
                tendon.add("joint", joint=joint, coef=coefficient)
        powers = [value / _LEVER_M**power for power, value in enumerate(tie.numbers("polycoef"))]
        tie.tag = "tendon"
        tie.set(joint1=None, joint2=None, tendon1=f"tie_{slide}", tendon2=f"tie_{hinge}")
        tie.set(polycoef=powers, solref=(_TIE_STEPS * timestep_s, 1.0))
