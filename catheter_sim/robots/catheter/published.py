"""The two published catheters for the mitral valve, as data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from catheter_sim.core.document import leaves, to_document
from catheter_sim.core.published import Drawn, Environment, Published, Trials, Uncertain, reach_and_track
from catheter_sim.core.robot import DAMPING_TIME_S, DYNAMICS_ASSUMED, Dynamics, Friction
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment, TendonPair

# ----------------------------------------------------------------------------------------------------
# The two robotic catheters for the mitral valve, as data.
#
# mitral_transseptal: Nayar 2022, doi 10.1109/TMRB.2022.3215522. mitral_4dof: Nayar 2023. Both papers bend
# first toward -y of their base frame; the base frame here is theirs turned by a quarter turn about +z
# (`robots.catheter.kinematics.R_BASE_PAPER`), so that the first bending joint bends toward +x.
# Neither paper prints masses: the robots have no weight.
#
# Errata. Nayar 2022, Section II-A: a bend of 264 deg in all is tan^-1 of t over a radius of 2.45 mm in each
# of 22 half gaps; with the outer radius of 2.85 mm it would be 228 deg. That radius is taken as the one at
# which the rings' rims touch. Table I's 1.9 mm "ID" is taken as the rings' inner diameter.

OUTER_RADIUS_M = 2.85e-3  # both: 5.7 mm outer diameter
STROKE_M = 60e-3  # both
TORSION_LIMIT_RAD = math.radians(75.0)  # both
WRAP_RAD = math.radians(120.0)  # 2022, Table I: a_t
# 2022
RINGS = 10  # Table I: n
RING_LENGTH_M = 2.04e-3  # Table I
HALF_GAP_M = 0.52e-3  # Table I: t
RIM_RADIUS_M = HALF_GAP_M / math.tan(math.radians(264.0) / (2 * (RINGS + 1)))  # Section II-A
BENDING_STIFFNESS_N_M_PER_RAD = 5.6e-3  # assumed: of the two wires and the tube together
LUMEN_RADIUS_M = 0.95e-3  # Table I: ID 1.9 mm
RIGID_END_M = 20e-3  # abstract and Section I: "a rigid distal end length of 20 mm"
# 2023
CROSSED_HALF_GAP_M = 0.69e-3  # Section III-C: t
CROSSED_ARM_M = 2.1e-3  # Section III-C: a_b
TENDON_LENGTH_M = 0.35  # Section IV-A
CROSSED_SLACK_M = 0.3e-3  # assumed, with tendons that stretch
TENDON_MU = 0.05  # assumed, where friction is on
# 2022 with the quadlumen tube in place: two published figures give the tendons' and the tube's stiffness.
# MK's second line (Eq. 25) is displacement = beta + (a_b + K / (a_b k)) bend, K of the joint, k of the
# tendon. At a bend of 90 deg a tip that is pushed aside changes the tension by 1 N per 1.814 mm (Section
# IV-F); by virtual work over the 11 gaps, with the first relation, no advance and no friction, that is k.
MK_BETA_M = 1.5849e-3
MK_SLOPE_M_PER_RAD = math.degrees(0.0290 * 1.8e-3)
DEFLECTION_M_PER_N = 1.814e-3
TUBE_TENDON_STIFFNESS_N_PER_M = 8338.0
TUBE_JOINT_STIFFNESS_N_M_PER_RAD = (MK_SLOPE_M_PER_RAD - 1.8e-3) * 1.8e-3 * TUBE_TENDON_STIFFNESS_N_PER_M
# assumed: two superelastic wires of 0.13 mm (Section II-A) and 60 GPa, free in the gaps only
WIRES_N_M_PER_RAD = 2 * 60e9 * math.pi * (0.13e-3) ** 4 / 64 / (2 * (RINGS + 1) * HALF_GAP_M)

_2022_TABLE = "Nayar 2022, Table I"
_2023 = "Nayar 2023, Section III-C"
_ROBOT_SOURCES = {
    "friction.mu": "assumed: none in the nominal robot",
    "mount": "assumed: rigid",
    "path_deg": "assumed: straight",
    "dynamics": DYNAMICS_ASSUMED,
    "tip_mass_g": "by definition 0",
    "stiffness_scale": "by definition 1",
}
_NOT_OF_THIS_JOINT = "by definition 0: not of this joint"
_COMMON = {
    "outer_radius_mm": "Nayar 2022, abstract, and Nayar 2023, Section II: 5.7 mm outer diameter",
    "mass_g": "assumed: no weight; masses are not printed",
    "rest_deg": "assumed: straight",
}
_TUBE = {
    "tube_stiffness_N_mm2": "assumed: rigid; what it adds to the joint is in the joint's stiffness",
    "tube_curvature_x_per_m": "assumed: straight",
    "tube_curvature_y_per_m": "assumed: straight",
}
_2022_TORSION = _COMMON | {
    "limit_deg": f"{_2022_TABLE}: +-75 deg",
    "tendon_radius_mm": f"{_2022_TABLE}: r",
    "wrap_deg": f"{_2022_TABLE}: a_t",
    "wrap_height_mm": f"{_2022_TABLE}: h",
}
_2022_SOURCES = {
    "torsion_proximal": _2022_TORSION | {"length_mm": f"{_2022_TABLE}: length (TM)"},
    "bending": _COMMON
    | {
        "length_mm": f"{_2022_TABLE}: 10 rings of 2.04 mm, 11 gaps of 1.04 mm",
        "limit_deg": f"{_2022_TABLE}: +-120 deg",
        "rings": f"{_2022_TABLE}: n",
        "half_gap_mm": f"{_2022_TABLE}: t",
        "arm_mm": f"{_2022_TABLE}: a_b",
        "rim_radius_mm": "Nayar 2022, Section II-A: of the bend of 264 deg that closes the gaps",
        "bending_stiffness_N_mm_per_rad": "assumed: two 0.13 mm wires and the tube, not printed",
    },
    "advance": _COMMON
    | _TUBE
    | {
        "length_mm": f"{_2022_TABLE}: distal torsion module, length (BM)",
        "stroke_mm": f"{_2022_TABLE}: translation 5-6 cm",
    },
    "torsion_distal": _2022_TORSION | {"length_mm": f"{_2022_TABLE}: distal torsion module, length (TM)"},
}
_2023_BENDING = _COMMON | {
    "length_mm": f"{_2023}: b_1, b_2",
    "limit_deg": "Nayar 2023, Section II-A: 90 and 120 deg to both sides",
    "rings": f"{_2023}: n",
    "half_gap_mm": f"{_2023}: t",
    "arm_mm": f"{_2023}: a_b",
    "rim_radius_mm": "assumed: as in Nayar 2022",
    "bending_stiffness_N_mm_per_rad": "assumed: as in Nayar 2022",
}
_2023_SOURCES = {
    "bending_proximal": _2023_BENDING,
    "link_middle": _COMMON | {"length_mm": f"{_2023}: bm"},
    "bending_distal": _2023_BENDING,
    "link_tip": _COMMON | {"length_mm": f"{_2023}: bt"},
    "advance": _COMMON
    | _TUBE
    | {"length_mm": f"{_2023}: dt", "stroke_mm": "Nayar 2023, Section II-A: up to 60 mm"},
    "torsion": _COMMON
    | {
        "length_mm": f"{_2023}: ih",
        "limit_deg": "Nayar 2023, Section II-A: +-75 deg",
        "tendon_radius_mm": f"{_2023}: r, Eq. 13",
        "wrap_deg": "assumed: as in Nayar 2022",
        "wrap_height_mm": f"{_2023}, Eq. 13: wound on a drum",
    },
}
_INEXTENSIBLE = "assumed: inextensible in the nominal robot"


def mitral_transseptal() -> CatheterRobot:
    """Return the catheter of Nayar 2022: proximal torsion, 10 rings, prismatic tube, distal torsion."""
    segments = (
        _torsion("torsion_proximal", 15e-3, 2.85e-3, 2.5e-3),
        CatheterSegment(
            name="bending",
            joint="bending",
            length_m=RINGS * RING_LENGTH_M + 2 * (RINGS + 1) * HALF_GAP_M,
            outer_radius_m=OUTER_RADIUS_M,
            limit_rad=math.radians(120.0),
            rings=RINGS,
            half_gap_m=HALF_GAP_M,
            arm_m=1.8e-3,
            rim_radius_m=RIM_RADIUS_M,
            bending_stiffness_N_m_per_rad=BENDING_STIFFNESS_N_M_PER_RAD,
        ),
        _advance(6e-3),
        _torsion("torsion_distal", 4.5e-3, 2.85e-3, 2e-3),
    )
    names = ("bending", "torsion_proximal", "torsion_distal", "advance")
    return CatheterRobot(
        name="mitral_transseptal",
        description="mitral-valve catheter: torsion, 10-ring bending, prismatic tube, torsion (Nayar 2022)",
        segments=segments,
        tendons=tuple(TendonPair(name, name) for name in names),
        friction=Friction(0.0),
        dynamics=Dynamics(damping_time_s=DAMPING_TIME_S),
        channel_radius_m=LUMEN_RADIUS_M,
        sources=_ROBOT_SOURCES
        | {"channel_radius_mm": f"{_2022_TABLE}: ID 1.9 mm"}
        | _segment_sources(segments, _2022_SOURCES)
        | _pair_sources(names, "assumed: 0 for not known; not printed"),
    )


def mitral_4dof() -> CatheterRobot:
    """Return the catheter of Nayar 2023: two crossed bending joints, prismatic tube, distal torsion."""
    segments = (
        _crossed("bending_proximal", "x", 3, 8.52e-3, 90.0),
        CatheterSegment("link_middle", "rigid", 2e-3, OUTER_RADIUS_M),
        _crossed("bending_distal", "y", 6, 15.66e-3, 120.0),
        CatheterSegment("link_tip", "rigid", 2e-3, OUTER_RADIUS_M),
        _advance(5e-3),
        _torsion("torsion", 15e-3, 2.1e-3, 0.0),
    )
    names = ("bending_proximal", "bending_distal", "torsion", "advance")
    return CatheterRobot(
        name="mitral_4dof",
        description="mitral-valve catheter: two crossed bending joints, prismatic tube, torsion (Nayar 2023)",
        segments=segments,
        tendons=tuple(
            TendonPair(name, name, 0.0 if name == "advance" else TENDON_LENGTH_M) for name in names
        ),
        friction=Friction(0.0),
        dynamics=Dynamics(damping_time_s=DAMPING_TIME_S),
        channel_radius_m=LUMEN_RADIUS_M,
        sources=_ROBOT_SOURCES
        | {"channel_radius_mm": "assumed: as in Nayar 2022, Table I"}
        | _segment_sources(segments, _2023_SOURCES)
        | _pair_sources(names, "Nayar 2023, Section IV-A: 350 mm; assumed for the torsion joint's too"),
    )


def mitral_transseptal_tube() -> CatheterRobot:
    """Return the catheter of Nayar 2022 as it was measured with the quadlumen tube in place.

    Dead-bands of Eqs 25-26; tendons that stretch, and a tube as stiff, as two published figures say.
    """
    nominal = mitral_transseptal()
    stiffness = (TUBE_JOINT_STIFFNESS_N_M_PER_RAD - WIRES_N_M_PER_RAD) * nominal.segments[1].length_m
    changed = {
        "bending": {"bending_stiffness_N_m_per_rad": WIRES_N_M_PER_RAD},
        "advance": {"tube_stiffness_N_m2": stiffness},
    }
    pairs = {
        "bending": {"stiffness_N_per_m": TUBE_TENDON_STIFFNESS_N_PER_M, "slack_m": MK_BETA_M},
        "torsion_proximal": {"play_m": 1.35e-3},
        "torsion_distal": {"play_m": 0.83e-3},
    }
    of_two = "Nayar 2022, Eq. 25 (second line's slope) with Section IV-F (1.814 mm/N), chosen to meet both"
    return _changed(
        nominal,
        "mitral_transseptal@tube",
        "mitral-valve catheter of Nayar 2022 with dead-bands, stretching tendons, stiff tube: as measured",
        changed,
        pairs,
        {
            "friction.mu": "assumed: polyethylene on plastic",
            "segments.bending.bending_stiffness_N_mm_per_rad": "assumed: two wires of 0.13 mm, 60 GPa",
            "segments.advance.tube_stiffness_N_mm2": of_two,
            "tendons.bending.stiffness_N_per_mm": of_two,
            "tendons.bending.slack_mm": "Nayar 2022, Eq. 25: beta_2",
            "tendons.torsion_proximal.play_mm": "Nayar 2022, Section IV-C: d_b, proximal",
            "tendons.torsion_distal.play_mm": "Nayar 2022, Section IV-C: d_b, distal",
        },
    )


def mitral_transseptal_rigid_end() -> CatheterRobot:
    """Return the catheter of Nayar 2022 as measured, its tip at the end of the rigid end of 20 mm.

    The nominal robot reads Table I's modules as link lengths: dt = 6 mm and h = 4.5 mm, 10.5 mm in all.
    The paper prints a rigid distal end of 20 mm (abstract, Section I), and its tool frame {F6} "is attached
    to the end tip of the robot". Where on the holder the tracker sat is not printed: that the measured point
    is the end of the 20 mm is inferred.
    """
    tube = mitral_transseptal_tube()
    module = next(part for part in tube.segments if part.name == "advance")
    return replace(
        tube,
        name="mitral_transseptal@rigid_end",
        description="mitral-valve catheter of Nayar 2022 as measured, its tip at the end of the rigid 20 mm",
        segments=tuple(
            replace(part, length_m=RIGID_END_M - module.length_m) if part.name == "torsion_distal" else part
            for part in tube.segments
        ),
        sources={
            **tube.sources,
            "segments.torsion_distal.length_mm": "Nayar 2022, abstract: rigid end of 20 mm, less the bottom "
            "module's 6 mm; assumed: the measured point is its end",
        },
    )


def mitral_4dof_elongation() -> CatheterRobot:
    """Return the catheter of Nayar 2023 with its stretching tendons and its joints' measured resistance."""
    pairs = {
        name: {"law": "uhmwpe", "slack_m": CROSSED_SLACK_M} for name in ("bending_proximal", "bending_distal")
    }
    return _changed(
        mitral_4dof(),
        "mitral_4dof@elongation",
        "mitral-valve catheter of Nayar 2023 with tendons that stretch, dead-bands and friction",
        {
            "bending_proximal": {"resistance": "measured_proximal"},
            "bending_distal": {"resistance": "measured_distal"},
        },
        pairs | {"torsion": {"play_m": 0.83e-3}},
        {"friction.mu": "assumed: polyethylene on plastic"}
        | {f"tendons.{name}.slack_mm": "assumed: a dead-band; not printed" for name in pairs}
        | {"tendons.torsion.play_mm": "assumed: as the distal torsion joint's of Nayar 2022, d_b"},
    )


def _changed(
    robot: CatheterRobot,
    name: str,
    description: str,
    segments: Mapping[str, Mapping[str, Any]],
    pairs: Mapping[str, Mapping[str, Any]],
    sources: Mapping[str, str],
) -> CatheterRobot:
    """Return `robot` with its tendons' friction and other numbers, by segment and pair."""
    return replace(
        robot,
        name=name,
        description=description,
        segments=tuple(replace(item, **segments.get(item.name, {})) for item in robot.segments),
        tendons=tuple(replace(item, **pairs.get(item.name, {})) for item in robot.tendons),
        friction=Friction(TENDON_MU),
        dynamics=Dynamics(damping_time_s=DAMPING_TIME_S),
        sources={**robot.sources, **sources},
    )


def _torsion(name: str, length_m: float, radius_m: float, height_m: float) -> CatheterSegment:
    return CatheterSegment(
        name=name,
        joint="torsion",
        length_m=length_m,
        outer_radius_m=OUTER_RADIUS_M,
        limit_rad=TORSION_LIMIT_RAD,
        tendon_radius_m=radius_m,
        wrap_rad=WRAP_RAD,
        wrap_height_m=height_m,
    )


def _advance(length_m: float) -> CatheterSegment:
    return CatheterSegment(
        "advance", "prismatic", length_m, OUTER_RADIUS_M, stroke_m=STROKE_M, tube_stiffness_N_m2=math.inf
    )


def _crossed(name: str, toward: str, rings: int, length_m: float, limit_deg: float) -> CatheterSegment:
    return CatheterSegment(
        name=name,
        joint="bending",
        length_m=length_m,
        outer_radius_m=OUTER_RADIUS_M,
        limit_rad=math.radians(limit_deg),
        bends_toward=toward,
        rings=rings,
        half_gap_m=CROSSED_HALF_GAP_M,
        arm_m=CROSSED_ARM_M,
        rim_radius_m=RIM_RADIUS_M,
        bending_stiffness_N_m_per_rad=BENDING_STIFFNESS_N_M_PER_RAD,
    )


def _segment_sources(
    segments: tuple[CatheterSegment, ...], texts: Mapping[str, Mapping[str, str]]
) -> dict[str, str]:
    """Return a source for every number of the segments, those that their joint does not have included."""
    return {
        f"segments.{segment.name}.{key}": texts[segment.name].get(key, _NOT_OF_THIS_JOINT)
        for segment in segments
        for key, _ in leaves(to_document(segment))
    }


def _pair_sources(names: tuple[str, ...], length: str) -> dict[str, str]:
    found = {f"tendons.{name}.length_mm": length for name in names}
    found["tendons.advance.length_mm"] = "by definition 0: a tube"
    for key, text in (
        ("stiffness_N_per_mm", _INEXTENSIBLE),
        ("slack_mm", "assumed: taut at rest in the nominal robot"),
        ("play_mm", "assumed: none in the nominal robot"),
    ):
        found |= {f"tendons.{name}.{key}": text for name in names}
    return found


# ----------------------------------------------------------------------------------------------------
# What the catheters' tube and tendons are made of, and how stiff that makes them; nothing here is fitted.
#
# Nayar 2022, Table I: quadlumen tube of 1.68 mm and hardness 72D with four lumens of 0.51 mm; polyethylene
# tendons of 0.12 mm, 0.61 m long. The moduli are not printed: they are assumed from what makers give.

TUBE_DIAMETER_M, LUMEN_DIAMETER_M = 1.68e-3, 0.51e-3
LUMEN_OFFSET_M = 0.42e-3  # assumed: lumens' axes from the tube's
TUBE_MODULUS_PA = 0.51e9  # assumed: a polyether block amide of 72D, in bending
TENDON_DIAMETER_M, MATERIAL_TENDON_LENGTH_M = 0.12e-3, 0.61  # Table I; Section I
# Assumed, and as stiff as it can be: a solid of the fibre's own modulus. A braid is softer.
TENDON_MODULUS_PA = 100e9


def tube_stiffness_N_m2() -> float:
    """Return the bending stiffness EI of the quadlumen tube [N m^2].

    0.12e-3: below the 0.18e-3 that Nayar 2023, Algorithm 2, leaves for everything in the proximal joint (its
    tension's slope, 0.18 N/deg at 2.1 mm, over 8.52 mm), as it must be. 0.56e-3 is what the two figures
    behind `mitral_transseptal@tube` ask for.
    """
    lumen = math.pi / 64.0 * LUMEN_DIAMETER_M**4 + math.pi / 4.0 * (LUMEN_DIAMETER_M * LUMEN_OFFSET_M) ** 2
    return TUBE_MODULUS_PA * (math.pi / 64.0 * TUBE_DIAMETER_M**4 - 4.0 * lumen)


def tendon_stiffness_N_per_m(modulus_Pa: float = TENDON_MODULUS_PA) -> float:
    """Return the stiffness EA / L of one tendon of the catheter of 2022 [N/m]; default: the largest."""
    return modulus_Pa * math.pi / 4.0 * TENDON_DIAMETER_M**2 / MATERIAL_TENDON_LENGTH_M


def tendon_modulus_Pa(stiffness_N_per_m: float) -> float:
    """Return the modulus that a tendon of the catheter of 2022 must have for a stiffness [Pa]."""
    return stiffness_N_per_m / tendon_stiffness_N_per_m(1.0)


def mitral_transseptal_material() -> CatheterRobot:
    """Return the catheter of Nayar 2022 with the tube, as stiff as its materials, friction on."""
    assumed = (
        "assumed: solid of the fibre's modulus, 100 GPa, 0.12 mm, 0.61 m (Nayar 2022, Table I): the stiffest"
    )
    return _changed(
        mitral_transseptal_tube(),
        "mitral_transseptal@material",
        "mitral-valve catheter of Nayar 2022 with tube, as stiff as its materials: none fitted",
        {"advance": {"tube_stiffness_N_m2": tube_stiffness_N_m2()}},
        {"bending": {"stiffness_N_per_m": tendon_stiffness_N_per_m()}},
        {
            "segments.advance.tube_stiffness_N_mm2": "assumed: 0.51 GPa, section of Nayar 2022, Table I",
            "tendons.bending.stiffness_N_per_mm": assumed,
        },
    )


def joint_slope_m_per_rad() -> float:
    """Return the displacement per bend of that robot beyond its slack, friction aside [m/rad].

    Arm plus stretch, a + K / (a k): what Nayar 2022, Eq. 25, prints as its second line's slope.
    """
    robot = mitral_transseptal_material()
    segment = robot.segments[1]
    stiffness = WIRES_N_M_PER_RAD + tube_stiffness_N_m2() / segment.length_m
    return segment.arm_m + stiffness / (segment.arm_m * tendon_stiffness_N_per_m())


# ----------------------------------------------------------------------------------------------------
# The catheter of Nayar 2023 with what its control was measured with: numbers fitted to its errors, a tube.
#
# `mitral_4dof@measured` is `mitral_4dof@elongation` with
# - a slack of the bending tendons that gives the printed 4.8 deg which the feedforward with elongation leaves
#   (Section IV-A): fitted to that one figure, so that it is no prediction of it. The paper names no slack;
# what   is in it are also its shift parameter beta, couplings and friction;
# - an exposed tube that bends, as stiff as its material and section say, and a weight beyond it: the
#   orientation of the tool, of which the paper makes its joint angles, then depends on the advance (rows of
#   Table I).

FITTED_SLACK_M = 0.803e-3  # to 4.8 deg of the proximal joint, as `validation.mitral_control` runs it
HOLDER_KG = 1.5e-3  # assumed: implant and its holder, 15 mm of plastic and steel


def mitral_4dof_measured() -> CatheterRobot:
    """Return the catheter of Nayar 2023 with slack fitted to its errors, a tube that bends and a weight."""
    fitted = "fitted to Nayar 2023, Section IV-A: 4.8 deg left by the feedforward with elongation"
    return _changed(
        mitral_4dof_elongation(),
        "mitral_4dof@measured",
        "mitral-valve catheter of Nayar 2023: slack fitted to its errors, tube bends, weight",
        {"advance": {"tube_stiffness_N_m2": tube_stiffness_N_m2()}, "torsion": {"mass_kg": HOLDER_KG}},
        {name: {"slack_m": FITTED_SLACK_M} for name in ("bending_proximal", "bending_distal")},
        {
            "segments.advance.tube_stiffness_N_mm2": "assumed: Nayar 2022, Table I (1.68 mm, 72D), 0.51 GPa",
            "segments.torsion.mass_g": "assumed: implant and holder; masses are not printed",
            "tendons.bending_proximal.slack_mm": fitted,
            "tendons.bending_distal.slack_mm": f"{fitted} of the proximal joint; assumed alike",
        },
    )


# ----------------------------------------------------------------------------------------------------
# The list of published catheters.

# Assumed: what a valve's leaflets ask for is finer than a tumour; chance reaches none of 100 targets anyway.
TOLERANCE_M = 2e-3
_REACH_M = (1.5e-3, 2.5e-3, 1.5e-3, 40e-3)  # of the bench's trials
_UNCERTAIN = (
    Uncertain("arm_bending", 0.01, ("segments.bending.arm_mm",)),
    Uncertain("radius_torsion_proximal", 0.01, ("segments.torsion_proximal.tendon_radius_mm",)),
    Uncertain("radius_torsion_distal", 0.01, ("segments.torsion_distal.tendon_radius_mm",)),
)


def _angles(*names: str) -> tuple[str, ...]:
    return tuple(f"angle_{name}_deg" for name in names)


PUBLISHED: tuple[Published, ...] = (
    Published(
        "mitral_transseptal",
        mitral_transseptal,
        (
            *reach_and_track("MitralTransseptal", tolerance_m=TOLERANCE_M),
            Environment("MitralTransseptalDeliver", "Deliver"),
        ),
        Trials("joints", _REACH_M, angles=_angles("bending", "torsion_proximal", "torsion_distal")),
        _UNCERTAIN,
    ),
    Published("mitral_transseptal@tube", mitral_transseptal_tube, uncertain=_UNCERTAIN),
    Published("mitral_transseptal@rigid_end", mitral_transseptal_rigid_end, uncertain=_UNCERTAIN),
    Published(
        "mitral_4dof",
        mitral_4dof,
        (
            *reach_and_track("Mitral4dof", tolerance_m=TOLERANCE_M),
            Environment("Mitral4dofDeliver", "Deliver"),
        ),
        Trials("joints", _REACH_M, angles=_angles("bending_proximal", "bending_distal", "torsion")),
    ),
    Published("mitral_4dof@elongation", mitral_4dof_elongation),
    Published("mitral_transseptal@material", mitral_transseptal_material),
    Published("mitral_4dof@measured", mitral_4dof_measured),
)
DRAWN: Mapping[str, Drawn] = {}
