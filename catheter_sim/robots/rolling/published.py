"""The rod-driven chest-tube robot of chest_tube_2025 (doi 10.1109/LRA.2025.3597860), as data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from catheter_sim.core.published import Drawn, Environment, Published, Trials, Uncertain, reach_and_track
from catheter_sim.core.robot import DAMPING_TIME_S, DYNAMICS_ASSUMED, Dynamics, Friction
from catheter_sim.robots.rolling.spec import Rod, RollingRobot, RollingSegment, Sleeve

# ----------------------------------------------------------------------------------------------------
# The rod-driven chest-tube robot of chest_tube_2025 (doi 10.1109/LRA.2025.3597860), as data.
#
# Three parameter sets of its measured section: `table2`, Table II with the values that are not printed
# chosen so that the printed balance gives the paper's Fig. 13; `prototype`, the calibration of the measured
# prototype that its authors published with their code; `printed_shapes`. The published calibration was made
# with the printed balance, so its numbers are effective ones: the complete balance and the simulation give
# other shapes with them. `printed_shapes` is fitted so that these two give the shapes that the printed
# balance has with the published calibration, which the measured ones lay within 2.25 % of (Section IV-A);
# its numbers are effective ones, too.
#
# Errata. Section II.B reads French units as "one-third of a centimeter": they are thirds of a millimetre,
# 28F is an outer diameter of 9.33 mm. Table I asks for a 3 mm lumen: with rod holes 2 mm from the axis and
# Table II's diameter less is left.

LINK_LENGTH_M = 15e-3  # Table II: L
OUTER_RADIUS_M = 3.1e-3  # Table II: D = 6.2 mm
BASE_JOINTS = 15  # Table II: n
LARGER_RADIUS_M = 6.7e-3  # Table II: R1
SMALLER_RADIUS_M = 2.275e-3  # Table II: R2
LARGER_ARM_M = 3e-3  # Table II: A1
SMALLER_ARM_M = 1e-3  # Table II: A2
SYMMETRIC_ARM_M = 2e-3  # Section III.A: "2 mm in the symmetric design"
LINK_MASS_KG = 0.38e-3  # assumed: an estimate, not printed
CENTRE_OF_MASS_DEPTH_M = 7.3e-3  # assumed: below the link's top, not printed
ROD_RADIUS_M = 0.3e-3  # of the published calibration; Table II has none
ROD_STIFFNESS_N_M2 = 25.6e-6  # assumed: EI of one rod, with mu and c fitted to Fig. 13
FRICTION_MU = 0.316  # assumed: fitted to Fig. 13
CLEARANCE_M = 0.335e-3  # assumed: fitted to Fig. 13
LUMEN_RADIUS_M = 1.2e-3  # assumed: what holes of 0.635 mm radius, 2 mm from the axis, leave

# The published calibration of the prototype.
PROTOTYPE_ROD_MODULUS_PA = 7.79e9
PROTOTYPE_MU = 0.0703
PROTOTYPE_CLEARANCE_M = 0.60e-3
PROTOTYPE_LARGER_ARM_M = 3.98e-3
PROTOTYPE_SMALLER_ARM_M = 1.33e-3
PROTOTYPE_LARGER_RADIUS_M = 6.37e-3
PROTOTYPE_SMALLER_RADIUS_M = 3.80e-3
PROTOTYPE_LINK_MODULUS_PA = 25e6  # the area that it goes with is assumed: the section less the lumen

# Fitted so that the complete balance gives the shapes of the printed one with that calibration, at the
# thirteen measured tensions (`validation/chest_tube_measured.py`): 1.9 % of a point's distance from
# the base. Both holes' distance from the axis, the clearance and the larger radius end at their bounds.
PRINTED_SHAPES_STIFFNESS_N_M2 = 57.58e-6
PRINTED_SHAPES_MU = 0.0599
PRINTED_SHAPES_CLEARANCE_M = 0.60e-3
PRINTED_SHAPES_LARGER_ARM_M = 4.664e-3
PRINTED_SHAPES_SMALLER_ARM_M = 0.936e-3
PRINTED_SHAPES_LARGER_RADIUS_M = 5.20e-3
PRINTED_SHAPES_SMALLER_RADIUS_M = 2.451e-3

# The full robot: 25 links of 15 mm, as Table I's 375 mm asks.
MIDDLE_JOINTS = 3  # assumed: the paper prints the base section's number only
TIP_JOINTS = 7  # assumed: toward +x and +y in turn, four and three joints
SYMMETRIC_RADIUS_M = 3.5e-3  # assumed: above the outer radius, or the profile would not span the link
ROW_SPACING_M = 1.3e-3  # assumed: holes of 0.635 mm radius side by side
COUNTERSINK_M = 1e-3  # assumed: a rod on a joint's own line needs a free length to bend over

_TABLE_2 = "chest_tube_2025, Table II"
_FIG_13 = "assumed (not printed): fitted so that the printed balance gives Fig. 13 of chest_tube_2025"
_CALIBRATION = "calibration of the prototype, published with the code of chest_tube_2025"
_PRINTED_SHAPES = (
    "assumed: fitted so that the complete balance gives the shapes of the printed one with the published "
    "calibration (chest_tube_2025)"
)

_ASSUMED = {
    "centre_of_mass_depth_mm": "assumed: 7.3 mm below the link's top, not printed (Eq. 19)",
    "link_modulus_Pa": "chest_tube_2025, Section III.B: link deformations are ignored",
    "stiffness_cubic_mm2": "chest_tube_2025, Section III.B: the rods remain linearly elastic",
    "stiffness_quintic_mm4": "chest_tube_2025, Section III.B: the rods remain linearly elastic",
    "rest_curvature_x_per_m": "assumed: straight",
    "rest_curvature_y_per_m": "assumed: straight",
}
_BASE_SOURCES = _ASSUMED | {
    "length_mm": f"{_TABLE_2}: 15 links of 15 mm",
    "joints": f"{_TABLE_2}: n",
    "outer_radius_mm": f"{_TABLE_2}: D = 6.2 mm",
    "mass_g": "assumed: 0.38 g a link, an estimate",
    "larger_radius_mm": f"{_TABLE_2}: R1",
    "smaller_radius_mm": f"{_TABLE_2}: R2",
    "larger_arm_mm": f"{_TABLE_2}: A1 = 3 +- 0.5 mm",
    "smaller_arm_mm": f"{_TABLE_2}: A2 = 1 +- 0.5 mm",
}
_SYMMETRIC_SOURCES = _BASE_SOURCES | {
    "length_mm": f"{_TABLE_2}: links of 15 mm, their number assumed; 375 mm in all (Table I)",
    "joints": "assumed: the number of joints is printed for the base section only",
    "larger_radius_mm": "assumed: the symmetric profile's radius is not printed",
    "smaller_radius_mm": "assumed: the symmetric profile's radius is not printed",
    "larger_arm_mm": "chest_tube_2025, Section III.A: 2 mm in the symmetric design",
    "smaller_arm_mm": "chest_tube_2025, Section III.A: 2 mm in the symmetric design",
}
_ROD_SOURCES = {
    "rod_radius_mm": f"{_CALIBRATION}; chest_tube_2025 prints none",
    "bending_stiffness_N_mm2": f"{_FIG_13}: 25.6 N mm^2 a rod",
    "lateral_mm": "assumed: in the bending plane",
    "countersink_mm": "assumed: none",
}
_ROBOT_SOURCES = {
    "friction.mu": f"{_FIG_13}: 0.316",
    "clearance_mm": f"{_FIG_13}: 0.335 mm",
    "sleeve.bending_stiffness_N_mm2": "by definition 0: no outer tube",
    "sleeve.outer_radius_mm": "chest_tube_2025, Section II.B: 28F, 9.33 mm outer diameter",
    "sleeve.inner_radius_mm": "chest_tube_2025, Section II.B: 6.2 mm inner diameter",
    "mount": "assumed: rigid",
    "dynamics": DYNAMICS_ASSUMED,
    "channel_radius_mm": "assumed: of Table I's 3 mm lumen (chest_tube_2025), what the rod holes leave",
    "tip_mass_g": "by definition 0",
    "stiffness_scale": "by definition 1",
}
_SLEEVE = Sleeve(0.0, inner_radius_m=OUTER_RADIUS_M, outer_radius_m=28.0 / 6.0 * 1e-3)
_DYNAMICS = Dynamics(timestep_s=1e-3, damping_time_s=DAMPING_TIME_S)


def chest_tube_section() -> RollingRobot:
    """Return the measured base section: 15 asymmetric joints, 225 mm, one rod pulled, one passive."""
    return RollingRobot(
        name="chest_tube_section",
        description="asymmetric base section of 15 rolling joints, 225 mm, one pulled rod (chest_tube_2025)",
        segments=(_base("section"),),
        tendons=(_rod("active", "+x", "section"),),
        passive_rods=(_rod("passive", "-x", "section"),),
        friction=Friction(FRICTION_MU),
        clearance_m=CLEARANCE_M,
        sleeve=_SLEEVE,
        dynamics=_DYNAMICS,
        channel_radius_m=LUMEN_RADIUS_M,
        sources=_ROBOT_SOURCES
        | _sources("segments.section", _BASE_SOURCES)
        | _sources("tendons.active", _ROD_SOURCES)
        | _sources("passive_rods.passive", _ROD_SOURCES),
    )


def chest_tube_section_prototype() -> RollingRobot:
    """Return the measured base section with the prototype's own calibration."""
    nominal = chest_tube_section()
    stiffness = PROTOTYPE_ROD_MODULUS_PA * math.pi / 4.0 * ROD_RADIUS_M**4
    segment = replace(
        nominal.segments[0],
        larger_radius_m=PROTOTYPE_LARGER_RADIUS_M,
        smaller_radius_m=PROTOTYPE_SMALLER_RADIUS_M,
        larger_arm_m=PROTOTYPE_LARGER_ARM_M,
        smaller_arm_m=PROTOTYPE_SMALLER_ARM_M,
        link_modulus_Pa=PROTOTYPE_LINK_MODULUS_PA,
    )
    rod_sources = {
        "rod_radius_mm": f"{_CALIBRATION}: 0.3 mm",
        "bending_stiffness_N_mm2": f"{_CALIBRATION}: E = 7.79 GPa, radius 0.3 mm",
    }
    described = replace(
        nominal,
        description="the same section with the prototype's published calibration (chest_tube_2025)",
        friction=Friction(PROTOTYPE_MU),
        clearance_m=PROTOTYPE_CLEARANCE_M,
    )
    found = _calibrated(described, segment, stiffness, _CALIBRATION)
    modulus = _sources("segments.section", {"link_modulus_Pa": _CALIBRATION})
    rods = _sources("tendons.active", rod_sources) | _sources("passive_rods.passive", rod_sources)
    return replace(found, sources=dict(found.sources) | modulus | rods)


def chest_tube_section_printed_shapes() -> RollingRobot:
    """Return the measured base section with whose numbers simulation and complete balance are as measured.

    As far as that can be said without the measured shapes: see the module.
    """
    nominal = chest_tube_section()
    segment = replace(
        nominal.segments[0],
        larger_radius_m=PRINTED_SHAPES_LARGER_RADIUS_M,
        smaller_radius_m=PRINTED_SHAPES_SMALLER_RADIUS_M,
        larger_arm_m=PRINTED_SHAPES_LARGER_ARM_M,
        smaller_arm_m=PRINTED_SHAPES_SMALLER_ARM_M,
    )
    described = replace(
        nominal,
        description="the same section fitted to the printed balance's shapes (chest_tube_2025)",
        friction=Friction(PRINTED_SHAPES_MU),
        clearance_m=PRINTED_SHAPES_CLEARANCE_M,
    )
    return _calibrated(described, segment, PRINTED_SHAPES_STIFFNESS_N_M2, _PRINTED_SHAPES)


def _calibrated(
    robot: RollingRobot, segment: RollingSegment, stiffness_N_m2: float, source: str
) -> RollingRobot:
    """Return `robot` with a calibrated profile and rods; `source` is that of profile, rods and friction."""
    profile = ("larger_radius_mm", "smaller_radius_mm", "larger_arm_mm", "smaller_arm_mm")
    rods = {"bending_stiffness_N_mm2": source}
    return replace(
        robot,
        segments=(segment,),
        tendons=tuple(replace(rod, bending_stiffness_N_m2=stiffness_N_m2) for rod in robot.tendons),
        passive_rods=tuple(replace(rod, bending_stiffness_N_m2=stiffness_N_m2) for rod in robot.passive_rods),
        sources=dict(robot.sources)
        | {"friction.mu": source, "clearance_mm": source}
        | _sources("segments.section", dict.fromkeys(profile, source))
        | _sources("tendons.active", rods)
        | _sources("passive_rods.passive", rods),
    )


def chest_tube() -> RollingRobot:
    """Return the full robot: 375 mm, base asymmetric, middle and tip symmetric, the tip in two planes.

    Eight rods, two for each plane of each segment. Rods of one side run side by side. Those that end
    at the tip lie in the middle of their side: there the joints of the other plane do not feel them.
    They cross those joints on the joints' own line, so that their holes need a countersink; those
    toward +y and -y cross all of the base and middle so.
    """
    segments = (
        _base("base"),
        _symmetric("middle", MIDDLE_JOINTS, "x"),
        _symmetric("tip", TIP_JOINTS, "xy"),
    )
    row = {"base": ROW_SPACING_M, "middle": -ROW_SPACING_M, "tip": 0.0}
    rods = [
        _rod(f"{name}_{side}", f"{sign}x", name, lateral_m=row[name] * (1.0 if sign == "+" else -1.0))
        for name in row
        for side, sign in (("right", "+"), ("left", "-"))
    ]
    rods += [_rod("tip_front", "+y", "tip"), _rod("tip_back", "-y", "tip")]
    rods = [replace(rod, countersink_m=COUNTERSINK_M) if rod.ends_at == "tip" else rod for rod in rods]
    assumed = {
        "lateral_mm": "assumed: rods of one side run side by side",
        "countersink_mm": "assumed: for rods that cross a joint on its own line",
    }
    return RollingRobot(
        name="chest_tube",
        description="full chest-tube robot of 25 rolling joints, 375 mm, eight rods (chest_tube_2025)",
        segments=segments,
        tendons=tuple(rods),
        friction=Friction(FRICTION_MU),
        clearance_m=CLEARANCE_M,
        sleeve=_SLEEVE,
        dynamics=_DYNAMICS,
        channel_radius_m=LUMEN_RADIUS_M,
        sources=_ROBOT_SOURCES
        | _sources("segments.base", _BASE_SOURCES)
        | _sources("segments.middle", _SYMMETRIC_SOURCES)
        | _sources("segments.tip", _SYMMETRIC_SOURCES)
        | {
            key: text
            for rod in rods
            for key, text in _sources(f"tendons.{rod.name}", _ROD_SOURCES | assumed).items()
        },
    )


def _base(name: str) -> RollingSegment:
    return RollingSegment(
        name=name,
        length_m=BASE_JOINTS * LINK_LENGTH_M,
        joints=BASE_JOINTS,
        outer_radius_m=OUTER_RADIUS_M,
        mass_kg=BASE_JOINTS * LINK_MASS_KG,
        centre_of_mass_depth_m=CENTRE_OF_MASS_DEPTH_M,
        larger_radius_m=LARGER_RADIUS_M,
        smaller_radius_m=SMALLER_RADIUS_M,
        larger_arm_m=LARGER_ARM_M,
        smaller_arm_m=SMALLER_ARM_M,
    )


def _symmetric(name: str, joints: int, axes: str) -> RollingSegment:
    return replace(
        _base(name),
        length_m=joints * LINK_LENGTH_M,
        joints=joints,
        mass_kg=joints * LINK_MASS_KG,
        larger_radius_m=SYMMETRIC_RADIUS_M,
        smaller_radius_m=SYMMETRIC_RADIUS_M,
        larger_arm_m=SYMMETRIC_ARM_M,
        smaller_arm_m=SYMMETRIC_ARM_M,
        bending_axes=axes,
    )


def _rod(name: str, side: str, ends_at: str, lateral_m: float = 0.0) -> Rod:
    return Rod(name, side, ends_at, ROD_RADIUS_M, ROD_STIFFNESS_N_M2, lateral_m=lateral_m)


def _sources(prefix: str, texts: dict[str, str]) -> dict[str, str]:
    return {f"{prefix}.{key}": text for key, text in texts.items()}


# At 50.2 N the rod would bend the frictionless section so far; the prototype was measured up to 47.9 N.
SECTION_BEND_RAD = 3.0
# Assumed: the tip of a single section moves on a curve, where it comes near a target more easily.
SECTION_TOLERANCE_M = 2e-3
# Assumed: so that few joints can make the turn; 100 N at most (chest_tube_2025, Table I).
INSERT_BEND_RAD = 3.0
INSERT_TOLERANCE_M = 10e-3  # assumed: about the tube's outer diameter


def _uncertain(robot: RollingRobot) -> tuple[Uncertain, ...]:
    arms = (f"segments.{item.name}.{arm}_arm_mm" for item in robot.segments for arm in ("larger", "smaller"))
    return (
        Uncertain("elastic_constant", 0.03, ("stiffness_scale",)),
        Uncertain("friction_coefficient", 0.20, ("friction.mu",)),
        Uncertain("moment_arm", 0.01, tuple(arms)),
    )


CHEST_TUBES = (
    Published(
        "chest_tube",
        chest_tube,
        (
            *reach_and_track("ChestTube"),
            Environment(
                "ChestTubeInsert",
                "Insert",
                {"largest_bend_rad": INSERT_BEND_RAD, "tolerance_m": INSERT_TOLERANCE_M},
            ),
        ),
        Trials("pull", (25.0,) * 8, rows=30, together=False),
        _uncertain(chest_tube()),
    ),
    Published(
        "chest_tube_section",
        chest_tube_section,
        reach_and_track(
            "ChestTubeSection", largest_bend_rad=SECTION_BEND_RAD, tolerance_m=SECTION_TOLERANCE_M
        ),
        Trials("pull", (45.0,), 0.0, "xz", rows=45),
        _uncertain(chest_tube_section()),
    ),
    Published("chest_tube_section@table2", chest_tube_section, uncertain=_uncertain(chest_tube_section())),
    Published(
        "chest_tube_section@prototype",
        chest_tube_section_prototype,
        trials=Trials("pull", (35.0,), 0.0, "xz", rows=45),
        uncertain=_uncertain(chest_tube_section_prototype()),
    ),
    Published(
        "chest_tube_section@printed_shapes",
        chest_tube_section_printed_shapes,
        uncertain=_uncertain(chest_tube_section_printed_shapes()),
    ),
)


# ----------------------------------------------------------------------------------------------------
# The published robots of rolling joints, a file each.

PUBLISHED: tuple[Published, ...] = CHEST_TUBES
DRAWN: Mapping[str, Drawn] = {}
