"""The published continuum robots, and those of drawn dimensions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from catheter_sim.core.published import Drawn, Environment, Published, Trials, Uncertain, reach_and_track
from catheter_sim.core.robot import DAMPING_TIME_S, DYNAMICS_ASSUMED, Dynamics, Friction
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon

# ----------------------------------------------------------------------------------------------------
# Continuum robots of drawn dimensions, of no publication: for the bench of hidden effects.

_DISKS = 12  # a segment; with fewer, an arc from disk to disk and a finer chain differ by too much
# The twin bends in arcs; the chain that makes the data has other links than the robot's own simulation, too.
_FINER = {"links_per_subsegment": 2}


def one_segment(generator: np.random.Generator) -> tuple[ContinuumRobot, Trials]:
    """Return one segment with three elastic tendons, driven by displacement, without friction."""
    length = generator.uniform(0.05, 0.09)
    radius = generator.uniform(3.5e-3, 5e-3)
    segment = Segment("arm", length, _DISKS, radius + 5e-4, generator.uniform(1.5e-3, 4e-3), 3e-3)
    tendons = tuple(
        Tendon(
            f"t{k}",
            radius,
            math.radians(120.0 * k + 20.0),
            "arm",
            stiffness_N_per_m=generator.uniform(6e3, 12e3),
            pretension_N=1.0,
        )
        for k in range(3)
    )
    robot = ContinuumRobot(
        name="arm",
        description="",
        segments=(segment,),
        tendons=tendons,
        friction=Friction(0.0),
        actuation="displacement",
    )
    return robot, Trials("heading", (radius,) * 3, simulated=_FINER)


def two_segments(generator: np.random.Generator) -> tuple[ContinuumRobot, Trials]:
    """Return two segments with three tendons each, driven by tension, without friction."""
    radius = generator.uniform(3e-3, 5e-3)
    segments = tuple(
        Segment(
            name, generator.uniform(0.03, 0.05), _DISKS, radius + 5e-4, generator.uniform(1e-3, 3e-3), 2e-3
        )
        for name in ("lower", "upper")
    )
    tendons = tuple(
        Tendon(f"{part.name}_{k}", radius, math.radians(120.0 * k + 60.0 * index), part.name)
        for index, part in enumerate(segments)
        for k in range(3)
    )
    robot = ContinuumRobot(
        name="two_segments", description="", segments=segments, tendons=tendons, friction=Friction(0.0)
    )
    # 0.8 of the tension that bends it all by a radian if it were of its softer segment: T r L = EI
    softest, length = min(part.bending_stiffness_N_m2 for part in segments), sum(p.length_m for p in segments)
    reach = (0.8 * (softest / (radius * length)),) * len(tendons)
    return robot, Trials("pull", reach, simulated=_FINER, rods=True)


# ----------------------------------------------------------------------------------------------------
# The two-segment robot of the modelling benchmark (Rao et al. 2021, Table 3), as data.
#
# doi 10.3389/frobt.2020.630245. Table 3 puts the tendons on its y axis and bends toward y.

SEGMENT_LENGTH_M = 50e-3  # Rao 2021, Table 3
DISK_RADIUS_M = 8e-3  # Rao 2021, Table 3: also the tendons' distance from the backbone
BACKBONE_DIAMETER_M = 0.8e-3  # Rao 2021, Table 3
YOUNG_MODULUS_PA = 2.11e11  # Rao 2021, Table 3
POISSON_RATIO = 0.3  # not printed; of steel, and of the authors' published code
SEGMENT_MASS_KG = 2e-3  # assumed: the benchmark is weightless
DISKS = 10  # Rao 2021, scenario 2

_TABLE_3 = "Rao 2021, Table 3"


def spacer_disk() -> ContinuumRobot:
    """Return the benchmark robot: two segments of 50 mm, four tendons in the yz plane."""
    second_moment_m4 = math.pi / 64.0 * BACKBONE_DIAMETER_M**4
    bending = YOUNG_MODULUS_PA * second_moment_m4
    torsion = bending / (1.0 + POISSON_RATIO)  # G J = E/(2(1+nu)) * 2I
    area_m2 = math.pi / 4.0 * BACKBONE_DIAMETER_M**2
    axial = YOUNG_MODULUS_PA * area_m2
    shear = axial / (2.0 * (1.0 + POISSON_RATIO))

    def segment(name: str) -> Segment:
        return Segment(
            name=name,
            length_m=SEGMENT_LENGTH_M,
            disks=DISKS,
            outer_radius_m=DISK_RADIUS_M * 1.15,
            bending_stiffness_N_m2=bending,
            torsion_stiffness_N_m2=torsion,
            axial_stiffness_N=axial,
            shear_stiffness_N=shear,
            mass_kg=SEGMENT_MASS_KG,
        )

    def tendon(name: str, side: float, ends_at: str) -> Tendon:
        return Tendon(name, DISK_RADIUS_M, side * math.pi / 2.0, ends_at)

    segments = (segment("first"), segment("second"))
    each = {
        "length_mm": _TABLE_3,
        "disks": "Rao 2021, Section 6.2: n = 10 (1 to 13 in scenario 1)",
        "outer_radius_mm": "assumed: 15 % more than the tendons' distance",
        "bending_stiffness_N_mm2": f"{_TABLE_3}: E = 211 GPa, diameter 0.8 mm",
        "torsion_stiffness_N_mm2": "assumed: Poisson ratio 0.3, not printed",
        "axial_stiffness_N": f"{_TABLE_3}: E = 211 GPa, diameter 0.8 mm",
        "shear_stiffness_N": "assumed: Poisson ratio 0.3, not printed; no shear correction",
        "mass_g": "assumed: the benchmark is weightless",
        "stiffness_cubic_mm2": "Rao 2021: linear",
        "stiffness_quintic_mm4": "Rao 2021: linear",
        "plastic_share": "Rao 2021: linear",
        "yield_curvature_per_m": "Rao 2021: linear",
        "rest_curvature_x_per_m": "Rao 2021: straight",
        "rest_curvature_y_per_m": "Rao 2021: straight",
        "rest_twist_deg_per_m": "Rao 2021: straight",
        "hinge_share": "by definition 0.5: several hinges a subsegment",
    }
    return ContinuumRobot(
        name="spacer_disk",
        description="two-segment spacer-disk robot of the modelling benchmark, 100 mm (Rao 2021)",
        segments=segments,
        tendons=(
            tendon("1", 1.0, "first"),
            tendon("2", -1.0, "first"),
            tendon("3", 1.0, "second"),
            tendon("4", -1.0, "second"),
        ),
        friction=Friction(0.0),
        dynamics=Dynamics(damping_time_s=DAMPING_TIME_S),
        disks_per_segment=DISKS,
        links_per_subsegment=4,
        sources={f"segments.{item.name}.{key}": text for item in segments for key, text in each.items()}
        | {
            "tendons": f"{_TABLE_3}: 1 and 3 at +y, 2 and 4 at -y; inextensible",
            "friction.mu": "Rao 2021, Section 7.1: frictionless",
            "mount": "Rao 2021: rigid",
            "dynamics": DYNAMICS_ASSUMED,
            "channel_radius_mm": "Rao 2021: none",
            "tip_mass_g": "by definition 0",
            "stiffness_scale": "Rao 2021, scenario 2: 0.1 to 10",
            "links_per_subsegment": "chosen: tip error of the chain 0.03 % at ten disks",
            "disks_per_segment": "Rao 2021, scenario 2",
        },
    )


SPACER_DISKS = (
    Published(
        "spacer_disk",
        spacer_disk,
        trials=Trials("pull", (4.0,) * 4, 0.3, "yz", simulated={"links_per_subsegment": 2}, rods=True),
    ),
)


# ----------------------------------------------------------------------------------------------------
# The neuroendoscope of Kato et al. 2016 (Int J CARS, doi 10.1007/s11548-015-1310-2), as data.
#
# The paper prints no friction coefficient, and its figures hold two (`theory/identify.py`). So the measured
# section has two named sets: `@arching`, the default, from the distances between measurement and models in
# arching, and `@openings`, from the openings of both loops if extending starts from full reversal. The
# second one contradicts Fig. 13. The first one asks of the antagonistic opening that extending starts from
# 0.70 N, where the paper names 0.65 N at most (`validation/neuroendoscope_figures`).

CELL_LENGTH_M = 2e-3  # Kato 2016, Materials and methods
CELL_STIFFNESS_N_M_PER_RAD = 8.6e-3  # Kato 2016, "measured after fabrication"
CELL_MASS_KG = 15e-6  # assumed: NiTi backbone and PEEK guide of a 2 mm cell, 0.45 g a section
CELLS = 30  # a section; Kato 2016
EYELET_OFFSET_M = 1.4e-3  # from the centroid; Kato 2016
OUTER_RADIUS_M = 1.7e-3  # 3.4 mm outer diameter; Kato 2016
CHANNEL_RADIUS_M = 0.7e-3  # 1.4 mm tool channel; Kato 2016
FRICTION_MU = 0.3  # assumed (not printed): within 0.29 to 0.35, which the distances in arching leave
OPENINGS_MU = 0.128  # assumed: from the opening of 9.8 mm, if extending starts from full reversal
# Assumed (not printed): angle of the proximal section's four tendons from the bending plane.
PROXIMAL_TENDON_ANGLE_RAD = math.radians(35.0)

_KATO = "Kato 2016, Materials and methods"
_SOURCES = {
    "length_mm": f"{_KATO}: 30 cells of 2 mm",
    "disks": f"{_KATO}: thirty cells a section",
    "outer_radius_mm": f"{_KATO}: outer diameter 3.4 mm",
    "bending_stiffness_N_mm2": f"{_KATO}: 8.6e-3 N m/rad a cell, times its 2 mm",
    "mass_g": "assumed: 15 mg a cell",
    "torsion_stiffness_N_mm2": "assumed: the flexures do not twist",
    "axial_stiffness_N": "assumed: the flexures do not stretch",
    "shear_stiffness_N": "assumed: the flexures do not shear",
    "stiffness_cubic_mm2": "assumed: linear (Kato 2016, Eq. 3)",
    "stiffness_quintic_mm4": "assumed: linear (Kato 2016, Eq. 3)",
    "plastic_share": "assumed: elastic (Kato 2016, Eq. 3)",
    "yield_curvature_per_m": "assumed: elastic (Kato 2016, Eq. 3)",
    "rest_curvature_x_per_m": "assumed: straight",
    "rest_curvature_y_per_m": "assumed: straight",
    "rest_twist_deg_per_m": "assumed: straight",
    "hinge_share": "assumed: a flexure bends in its middle",
}


def _section(name: str) -> Segment:
    return Segment(
        name=name,
        length_m=CELLS * CELL_LENGTH_M,
        disks=CELLS,
        outer_radius_m=OUTER_RADIUS_M,
        bending_stiffness_N_m2=CELL_STIFFNESS_N_M_PER_RAD * CELL_LENGTH_M,
        mass_kg=CELLS * CELL_MASS_KG,
        bending_axes="x",
    )


def _sources(segments: tuple[Segment, ...], proximal_angle: str) -> dict[str, str]:
    sources = {f"segments.{item.name}.{key}": text for item in segments for key, text in _SOURCES.items()}
    return sources | {
        "tendons": f"{_KATO}: eyelets 1.4 mm from the centroid{proximal_angle}; inextensible (A7); "
        "no pretension assumed",
        "friction.mu": "assumed: no value is printed; 0.29 to 0.35 by Kato 2016's distances in arching",
        "mount": "assumed: rigid",
        "dynamics": DYNAMICS_ASSUMED,
        "channel_radius_mm": f"{_KATO}: tool channel of 1.4 mm diameter",
        "tip_mass_g": "by definition 0",
        "stiffness_scale": "by definition 1",
        "links_per_subsegment": f"{_KATO}: one flexure a cell",
        "disks_per_segment": "by definition 0: as the segments say",
    }


def neuroendoscope_section() -> ContinuumRobot:
    """Return the measured single section: 30 cells, 60 mm, one antagonistic pair of tendons."""
    segments = (_section("section"),)
    return ContinuumRobot(
        name="neuroendoscope_section",
        description="single section of 30 elastic cells, 60 mm, two tendons (Kato 2016)",
        segments=segments,
        tendons=(
            Tendon("right", EYELET_OFFSET_M, 0.0, "section"),
            Tendon("left", EYELET_OFFSET_M, math.pi, "section"),
        ),
        friction=Friction(FRICTION_MU),
        dynamics=Dynamics(damping_time_s=DAMPING_TIME_S),
        appearance="wire_guides",
        masses="faces",
        channel_radius_m=CHANNEL_RADIUS_M,
        sources=_sources(segments, ""),
    )


def neuroendoscope_section_openings() -> ContinuumRobot:
    """Return the measured section with the friction that its loops' openings have from full reversal."""
    nominal = neuroendoscope_section()
    source = "assumed: fitted to Kato 2016's opening of 9.8 mm at 0.4 N, extending from full reversal"
    return replace(
        nominal,
        description="the same section, friction from its loops' openings at full reversal (Kato 2016)",
        friction=Friction(OPENINGS_MU),
        sources=dict(nominal.sources) | {"friction.mu": source},
    )


def neuroendoscope() -> ContinuumRobot:
    """Return the full robot: proximal and distal section of 30 cells, 120 mm, six tendons.

    Two tendons in the bending plane end at the tip. Four end at the midpoint; they run through
    eyelets placed symmetrically about the bending plane, 1.4 mm from the centroid like the others,
    and each side's two share one input.
    """
    segments = (_section("proximal"), _section("distal"))
    angle = PROXIMAL_TENDON_ANGLE_RAD

    def proximal(name: str, angle_rad: float, channel: str) -> Tendon:
        return Tendon(name, EYELET_OFFSET_M, angle_rad, "proximal", channel)

    return ContinuumRobot(
        name="neuroendoscope",
        description="two sections of 30 elastic cells, 120 mm, six tendons (Kato 2016)",
        segments=segments,
        tendons=(
            Tendon("distal_right", EYELET_OFFSET_M, 0.0, "distal"),
            Tendon("distal_left", EYELET_OFFSET_M, math.pi, "distal"),
            proximal("proximal_right_1", angle, "proximal_right"),
            proximal("proximal_right_2", -angle, "proximal_right"),
            proximal("proximal_left_1", math.pi - angle, "proximal_left"),
            proximal("proximal_left_2", math.pi + angle, "proximal_left"),
        ),
        friction=Friction(FRICTION_MU),
        dynamics=Dynamics(damping_time_s=DAMPING_TIME_S),
        appearance="wire_guides",
        masses="faces",
        channel_radius_m=CHANNEL_RADIUS_M,
        sources=_sources(segments, "; the proximal tendons' 35 deg from the bending plane assumed"),
    )


# Assumed: the tip of a single section moves on a curve, where it comes near a target more easily.
SECTION_TOLERANCE_M = 2e-3
# Kato 2016 articulates a section with up to 0.65 N; this asks for 0.61 N of the distal tendons.
TUMOUR_BEND_RAD = 3.0


def _uncertain(tendons: tuple[str, ...]) -> tuple[Uncertain, ...]:
    return (
        Uncertain("elastic_constant", 0.03, ("stiffness_scale",)),
        Uncertain("friction_coefficient", 0.20, ("friction.mu",)),
        Uncertain("moment_arm", 0.01, tuple(f"tendons.{name}.radius_mm" for name in tendons)),
    )


NEUROENDOSCOPES = (
    Published(
        "neuroendoscope",
        neuroendoscope,
        (
            *reach_and_track("Neuroendoscope"),
            Environment("NeuroendoscopeTumour", "Tumour", {"largest_bend_rad": TUMOUR_BEND_RAD}),
        ),
        Trials("pull", (0.35, 0.35, 0.7, 0.7), 0.0, "xz", rows=20, together=False),
        _uncertain(tuple(tendon.name for tendon in neuroendoscope().tendons)),
    ),
    Published(
        "neuroendoscope_section",
        neuroendoscope_section,
        reach_and_track("NeuroendoscopeSection", tolerance_m=SECTION_TOLERANCE_M),
        # Two tendons that both pull slip together in the nominal statics, each by itself in the simulation.
        Trials("pull", (0.45, 0.45), 0.04, "xz"),
        _uncertain(tuple(tendon.name for tendon in neuroendoscope_section().tendons)),
    ),
    Published(
        "neuroendoscope_section@arching",
        neuroendoscope_section,
        uncertain=_uncertain(tuple(tendon.name for tendon in neuroendoscope_section().tendons)),
    ),
    Published(
        "neuroendoscope_section@openings",
        neuroendoscope_section_openings,
        uncertain=_uncertain(tuple(tendon.name for tendon in neuroendoscope_section().tendons)),
    ),
)


# ----------------------------------------------------------------------------------------------------
# The published continuum robots, a file each, and those that the bench of hidden effects draws.

PUBLISHED: tuple[Published, ...] = (*NEUROENDOSCOPES, *SPACER_DISKS)
DRAWN: Mapping[str, Drawn] = {
    "file_displacement": one_segment,
    "file_tension": two_segments,
}
