"""The static models of tendon-driven continuum robots."""

from __future__ import annotations

from catheter_sim.core.statics import StaticModel, unless
from catheter_sim.robots.continuum.constant_curvature import constant_curvature
from catheter_sim.robots.continuum.exact_arm import fkm_exact_arm, fkm_sliding
from catheter_sim.robots.continuum.four_bar import four_bar
from catheter_sim.robots.continuum.kato import fkm, fkm_stick, pcca
from catheter_sim.robots.continuum.lumped import cc_sub, prb, prb_middle, prb_no_twist, prb_one
from catheter_sim.robots.continuum.modal import haar, lacks, polynomial, taylor
from catheter_sim.robots.continuum.planar import bends_in_plane
from catheter_sim.robots.continuum.rods import (
    unsupported,
    unsupported_along,
    vc,
    vc_moment,
    vc_ref,
    vc_ref_noproj,
    vc_tip_force,
)
from catheter_sim.robots.continuum.spec import ContinuumRobot

_PLANAR = unless(
    bends_in_plane,
    "bending out of the xz plane, several hinges a cell or off its middle, tendons that wind or converge",
)

MODELS: tuple[StaticModel[ContinuumRobot], ...] = (
    # Planar robots, driven by tension.
    StaticModel(
        "fkm",
        "extended forward kinematic mapping as printed (Kato 2016, Eqs 2-9); depends on the rows' spacing",
        fkm,
        _PLANAR,
    ),
    StaticModel(
        "fkm_stick",
        "the printed mapping with cells that may stick; does not depend on the rows' spacing",
        fkm_stick,
        _PLANAR,
    ),
    StaticModel(
        "fkm_exact_arm",
        "exact moment arms of straight tendons, capstan friction with history, weight and tip load",
        fkm_exact_arm,
        _PLANAR,
    ),
    StaticModel(
        "fkm_sliding",
        "as fkm_exact_arm, friction by each tendon's motion over each eyelet: the reference under load",
        fkm_sliding,
        _PLANAR,
    ),
    StaticModel(
        "pcca", "piecewise constant curvature, no friction (as compared in Kato 2016)", pcca, _PLANAR
    ),
    # Spatial robots.
    StaticModel(
        "CC",
        "one arc per segment (Rao 2021, Sections 3.2.1, 5.2.2), tension or displacement, friction, weight",
        constant_curvature,
    ),
    StaticModel(
        "four_bar",
        "four-bar linkages driven by lengths (Rao 2021, Section 4.1); by tensions VC_ref's lengths",
        four_bar,
        unsupported_along,
    ),
    StaticModel(
        "CC_sub",
        "one arc per subsegment, twist, tendons straight between disks (Rao 2021, Eqs 43-47), friction",
        cc_sub,
        unsupported,
    ),
    StaticModel(
        "PRB",
        "three joints per subsegment, twist, otherwise as CC_sub (Rao 2021, Eqs 48-54), simple-root form",
        prb,
        unsupported,
    ),
    StaticModel(
        "PRB_middle",
        "PRB with Eqs 52 and 54's moment taken at the middle joint: better where a load acts across",
        prb_middle,
        unsupported,
    ),
    StaticModel(
        "PRB_no_twist",
        "PRB without torsion (Rao 2021, Eqs 12, 48-53): near PRB in a plane, off under loads across it",
        prb_no_twist,
        unsupported,
    ),
    StaticModel(
        "PRB_one",
        "one spring joint per subsegment, in its middle (Rao 2021, Section 3.2.2), twist, friction",
        prb_one,
        unsupported,
    ),
    StaticModel(
        "polynomial",
        "curvature of degree 2 along each segment, twist, by energy (Rao 2021, Section 3.2.3)",
        polynomial,
        lacks,
    ),
    StaticModel(
        "haar",
        "curvature by Haar's wavelets, constant on quarters of a segment, twist, by energy (Rao 2021, 3.2.3)",
        haar,
        lacks,
    ),
    StaticModel(
        "taylor",
        "one arc per segment, its pose a Taylor series in the bend, by energy (Rao 2021, Section 3.2.3)",
        taylor,
        lacks,
    ),
    StaticModel(
        "VC",
        "Cosserat rod, tendons held to its shape everywhere (Rao 2021, Eqs 24-41), friction, weight",
        vc,
        unsupported_along,
    ),
    StaticModel(
        "VC_moment",
        "Cosserat rod, tendons as moments at their ends (Rao 2021, Eq. 25): an arc where nothing else acts",
        vc_moment,
        unsupported_along,
    ),
    StaticModel(
        "VC_tip_force",
        "Cosserat rod, tendons as forces at their ends (Rao 2021, Eqs 24-25): bends too little",
        vc_tip_force,
        unsupported_along,
    ),
    StaticModel(
        "VC_ref",
        "Cosserat rod, tendons straight between disks, forces in the disks' planes (Rao 2021, Eqs 30-41, 58)",
        vc_ref,
        unsupported,
    ),
    StaticModel(
        "VC_ref_noproj",
        "as VC_ref without Eq. 58: eyelets without friction, as the simulation's tendons",
        vc_ref_noproj,
        unsupported,
    ),
)
