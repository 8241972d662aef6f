"""What the catheters' tube and tendons are made of, and how stiff that makes them; nothing here is fitted.

Nayar 2022, Table I: quadlumen tube of 1.68 mm and hardness 72D with four lumens of 0.51 mm; polyethylene
tendons of 0.12 mm, 0.61 m long. The moduli are not printed: they are assumed from what makers give.
"""

from __future__ import annotations

import math
from dataclasses import replace

from catheter_sim.core.published import Published
from catheter_sim.kinds.catheter.robots.mitral import WIRES_N_M_PER_RAD, mitral_transseptal_tube
from catheter_sim.kinds.catheter.spec import CatheterRobot

TUBE_DIAMETER_M, LUMEN_DIAMETER_M = 1.68e-3, 0.51e-3
LUMEN_OFFSET_M = 0.42e-3  # assumed: lumens' axes from the tube's
TUBE_MODULUS_PA = 0.51e9  # assumed: a polyether block amide of 72D, in bending
TENDON_DIAMETER_M, TENDON_LENGTH_M = 0.12e-3, 0.61  # Table I; Section I
# Assumed, and as stiff as it can be: a solid of the fibre's own modulus. A braid is softer.
TENDON_MODULUS_PA = 100e9


def tube_stiffness_N_m2() -> float:
    """Return the bending stiffness EI of the quadlumen tube [N m^2].

    0.12e-3: below the 0.18e-3 that Nayar 2023, Algorithm 2, leaves for everything in the proximal joint (its
    tension's slope, 0.18 N/deg at 2.1 mm, over 8.52 mm), as it must be; 0.56e-3 is what the two figures
    behind `mitral_transseptal@tube` ask for.
    """
    lumen = math.pi / 64.0 * LUMEN_DIAMETER_M**4 + math.pi / 4.0 * (LUMEN_DIAMETER_M * LUMEN_OFFSET_M) ** 2
    return TUBE_MODULUS_PA * (math.pi / 64.0 * TUBE_DIAMETER_M**4 - 4.0 * lumen)


def tendon_stiffness_N_per_m(modulus_Pa: float = TENDON_MODULUS_PA) -> float:
    """Return the stiffness EA / L of one tendon of the catheter of 2022 [N/m]; default: the largest."""
    return modulus_Pa * math.pi / 4.0 * TENDON_DIAMETER_M**2 / TENDON_LENGTH_M


def tendon_modulus_Pa(stiffness_N_per_m: float) -> float:
    """Return the modulus that a tendon of the catheter of 2022 must have for a stiffness [Pa]."""
    return stiffness_N_per_m / tendon_stiffness_N_per_m(1.0)


def mitral_transseptal_material() -> CatheterRobot:
    """Return the catheter of Nayar 2022 with the tube, as stiff as its materials, friction on."""
    robot = mitral_transseptal_tube()
    assumed = (
        "assumed: solid of the fibre's modulus, 100 GPa, 0.12 mm, 0.61 m (Nayar 2022, Table I): the stiffest"
    )
    return replace(
        robot,
        name="mitral_transseptal@material",
        description="mitral-valve catheter of Nayar 2022 with tube, as stiff as its materials: none fitted",
        segments=tuple(
            replace(item, tube_stiffness_N_m2=tube_stiffness_N_m2()) if item.name == "advance" else item
            for item in robot.segments
        ),
        tendons=tuple(
            replace(item, stiffness_N_per_m=tendon_stiffness_N_per_m()) if item.name == "bending" else item
            for item in robot.tendons
        ),
        sources={
            **robot.sources,
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


PUBLISHED = (Published("mitral_transseptal@material", mitral_transseptal_material),)
