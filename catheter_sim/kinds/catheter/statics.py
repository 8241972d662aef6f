"""The static models of catheters of torsion, bending and prismatic joints, driven by displacement."""

from __future__ import annotations

from catheter_sim.core.statics import StaticModel, unless
from catheter_sim.kinds.catheter.layout import is_four_dof, is_transseptal
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.kinds.catheter.theory.balance import balance
from catheter_sim.kinds.catheter.theory.corrected import hybrid, mk, pi
from catheter_sim.kinds.catheter.theory.pure import pk
from catheter_sim.kinds.catheter.theory.stretching import te

_OF_2022 = unless(is_transseptal, "other joints than those of Nayar 2022")
_OF_2023 = unless(is_four_dof, "other joints than those of Nayar 2023")

MODELS: tuple[StaticModel[CatheterRobot], ...] = (
    StaticModel(
        "pk",
        "pure kinematics (Nayar 2022, Eqs 3-15; 2023, Eqs 7, 12-13), no friction, no weight, no tip load",
        pk,
    ),
    StaticModel(
        "balance",
        "pk with the joints' balance: friction, measured laws (Nayar 2023), history; springs under load",
        balance,
    ),
    StaticModel(
        "mk",
        "modified kinematics: measured dead-bands of all joints (Nayar 2022, Eqs 23-28), displacement >= 0",
        mk,
        _OF_2022,
    ),
    StaticModel(
        "pi",
        "Prandtl-Ishlinskii models (Nayar 2022, Eqs 29-34), weights from the MK loops: none are printed",
        pi,
        _OF_2022,
    ),
    StaticModel(
        "hybrid",
        "mk for the bending joint, pi for the torsion joints (Nayar 2022, Section IV-C)",
        hybrid,
        _OF_2022,
    ),
    StaticModel(
        "te",
        "tendons that stretch, measured joint forces, both with history (Nayar 2023, Algorithms 1-2)",
        te,
        _OF_2023,
    ),
)
