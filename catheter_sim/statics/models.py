"""The static models by name: the one list that the command line, the validation and the tests read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from catheter_sim.effects.apply import embodied, in_force
from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array
from catheter_sim.statics import constant_curvature
from catheter_sim.statics.catheter.balance import balance
from catheter_sim.statics.catheter.corrected import hybrid, is_transseptal, mk, pi
from catheter_sim.statics.catheter.pure import is_catheter, pk
from catheter_sim.statics.catheter.stretching import is_four_dof, te
from catheter_sim.statics.exact_arm import fkm_exact_arm
from catheter_sim.statics.kato import fkm, fkm_stick, pcca
from catheter_sim.statics.planar_chain import bends_in_plane
from catheter_sim.statics.result import StaticRun
from catheter_sim.statics.rolling.complete import complete, virtual_work
from catheter_sim.statics.rolling.history import is_rolling
from catheter_sim.statics.rolling.pcc import pcc
from catheter_sim.statics.rolling.printed import printed
from catheter_sim.statics.sliding import fkm_sliding
from catheter_sim.statics.tdcr.cc_sub import cc_sub
from catheter_sim.statics.tdcr.prb import prb, prb_middle
from catheter_sim.statics.tdcr.problem import is_rod
from catheter_sim.statics.tdcr.vc import vc
from catheter_sim.statics.tdcr.vc_ref import vc_ref, vc_ref_noproj


@dataclass(frozen=True)
class StaticModel:
    """One analytic model.

    Attributes:
        name: as on the command line.
        summary: what it is and where it comes from, one line.
        law: robot, arriving inputs and gravity (shape (3,) [m/s^2]) to the postures, row after row; the
            robot's `effects` are not read.
        carries: whether it knows a robot whose effects are built in.
    """

    name: str
    summary: str
    law: Callable[[Any, Inputs, Array], StaticRun]  # takes the kind of robot that it applies to
    carries: Callable[[Robot], bool]

    def applies_to(self, robot: Robot) -> bool:
        """Return whether the model knows `robot`, its effects included."""
        return self.carries(embodied(robot) if robot.effects else robot)

    def solve(self, robot: Robot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
        """Return what is observed of `robot` with its effects, row after row, as inputs are commanded.

        Args:
            robot: as it is specified, of a kind that the model applies to.
            inputs: as commanded; `inputs` of the result are those, too.
            gravity_mps2: in the base frame, shape (3,) [m/s^2].

        Raises:
            InputError: an effect is not possible, the model does not carry the robot, or a row has no
                balance.
        """
        acting = in_force(robot, inputs)
        run = self.law(acting.robot, acting.inputs, gravity_mps2)
        if not robot.effects:
            return run
        return replace(run, inputs=inputs, postures=acting.observed(run.postures))


_MODELS = (
    # Planar robots, driven by tension.
    StaticModel(
        "fkm",
        "extended forward kinematic mapping as printed (Kato 2016, Eqs 2-9); depends on the rows' spacing",
        fkm,
        bends_in_plane,
    ),
    StaticModel(
        "fkm_stick",
        "the printed mapping with cells that may stick; does not depend on the rows' spacing",
        fkm_stick,
        bends_in_plane,
    ),
    StaticModel(
        "fkm_exact_arm",
        "exact moment arms of straight tendons, capstan friction with history, weight and tip load",
        fkm_exact_arm,
        bends_in_plane,
    ),
    StaticModel(
        "fkm_sliding",
        "as fkm_exact_arm, friction by each tendon's motion over each eyelet: the reference under load",
        fkm_sliding,
        bends_in_plane,
    ),
    StaticModel(
        "pcca", "piecewise constant curvature, no friction (as compared in Kato 2016)", pcca, bends_in_plane
    ),
    # Spatial robots.
    StaticModel(
        "CC",
        "one arc per segment (Rao 2021, Sections 3.2.1, 5.2.2), tension or displacement, friction, weight",
        constant_curvature.constant_curvature,
        constant_curvature.applies_to,
    ),
    StaticModel(
        "CC_sub",
        "one arc per subsegment, twist, tendons straight between disks (Rao 2021, Eqs 43-47), friction",
        cc_sub,
        is_rod,
    ),
    StaticModel(
        "PRB",
        "three joints per subsegment, twist, otherwise as CC_sub (Rao 2021, Eqs 48-54), simple-root form",
        prb,
        is_rod,
    ),
    StaticModel(
        "PRB_middle",
        "PRB with Eqs 52 and 54's moment taken at the middle joint: better where a load acts across",
        prb_middle,
        is_rod,
    ),
    StaticModel(
        "VC",
        "Cosserat rod, tendons held to its shape everywhere (Rao 2021, Eqs 24-41), friction, weight",
        vc,
        is_rod,
    ),
    StaticModel(
        "VC_ref",
        "Cosserat rod, tendons straight between disks, forces in the disks' planes (Rao 2021, Eqs 30-41, 58)",
        vc_ref,
        is_rod,
    ),
    StaticModel(
        "VC_ref_noproj",
        "as VC_ref without Eq. 58: eyelets without friction, as the simulation's tendons",
        vc_ref_noproj,
        is_rod,
    ),
    # Robots of rolling joints.
    StaticModel(
        "printed",
        "the balance of chest_tube_2025, Eqs 1-24, as printed with the least repairs; knows no unloading",
        printed,
        is_rolling,
    ),
    StaticModel(
        "complete",
        "Newton-Euler balance of every link, friction with history, weight and tip load",
        complete,
        is_rolling,
    ),
    StaticModel(
        "virtual_work",
        "as complete, by virtual work: the reference of its compiled form",
        virtual_work,
        is_rolling,
    ),
    StaticModel(
        "pcc",
        "piecewise constant curvature, no friction, no weight (as compared in chest_tube_2025)",
        pcc,
        is_rolling,
    ),
    # Catheters of torsion, bending and prismatic joints, driven by displacement.
    StaticModel(
        "pk",
        "pure kinematics (Nayar 2022, Eqs 3-15; 2023, Eqs 7, 12-13), no friction, no weight, no tip load",
        pk,
        is_catheter,
    ),
    StaticModel(
        "balance",
        "pk with the joints' balance: friction, tendons' and joints' measured laws (Nayar 2023), history",
        balance,
        is_catheter,
    ),
    StaticModel(
        "mk",
        "modified kinematics: measured dead-bands of all joints (Nayar 2022, Eqs 23-28), displacement >= 0",
        mk,
        is_transseptal,
    ),
    StaticModel(
        "pi",
        "Prandtl-Ishlinskii models (Nayar 2022, Eqs 29-34), weights from the MK loops: none are printed",
        pi,
        is_transseptal,
    ),
    StaticModel(
        "hybrid",
        "mk for the bending joint, pi for the torsion joints (Nayar 2022, Section IV-C)",
        hybrid,
        is_transseptal,
    ),
    StaticModel(
        "te",
        "tendons that stretch, measured joint forces, both with history (Nayar 2023, Algorithms 1-2)",
        te,
        is_four_dof,
    ),
)

STATIC_MODELS: dict[str, StaticModel] = {model.name: model for model in _MODELS}
