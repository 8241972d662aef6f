"""The two-segment robot of the modelling benchmark (Rao et al. 2021, Table 3), as data.

doi 10.3389/frobt.2020.630245. Table 3 puts the tendons on its y axis and bends toward y.
"""

from __future__ import annotations

import math

from catheter_sim.core.published import Published, Trials
from catheter_sim.core.robot import DAMPING_TIME_S, DYNAMICS_ASSUMED, Dynamics, Friction
from catheter_sim.kinds.continuum.spec import ContinuumRobot, Segment, Tendon

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


PUBLISHED = (
    Published(
        "spacer_disk",
        spacer_disk,
        trials=Trials("pull", (4.0,) * 4, 0.3, "yz", simulated={"links_per_subsegment": 2}, rods=True),
    ),
)
