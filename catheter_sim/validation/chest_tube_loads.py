"""Checks of forces on links and of the outer tube as an elastic sleeve, simulation against statics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.loads import LinkForce
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import Friction
from catheter_sim.robots.rolling.complete import complete
from catheter_sim.robots.rolling.published import chest_tube, chest_tube_section
from catheter_sim.robots.rolling.spec import RollingRobot, Sleeve
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation.drives import NO_GRAVITY, given, largest_distance, tips_mm
from catheter_sim.validation.lines import Line, Validation

SECTION, FULL = "chest_tube_section", "chest_tube"
TENSIONS_N = np.array([[5], [50], [20], [5]], dtype=float)
# Steady forces on links of the section: in its bending plane, and across it.
LINK_FORCES = {
    "in the plane": (
        LinkForce(5, (3e-3, 0.0, 7e-3), (-0.1, 0.0, 0.05)),
        LinkForce(11, (0.0, 0.0, 15e-3), (0.05, 0.0, 0.1)),
    ),
    "across": (
        LinkForce(8, (2e-3, 1e-3, 5e-3), (0.05, 0.3, -0.02)),
        LinkForce(15, (-3e-3, 2e-3, 10e-3), (-0.03, -0.2, 0.01)),
    ),
}
# The same as large as makes the friction's history by each rod alone and by sliding differ.
LARGE_FORCES = (
    LinkForce(3, (0.0, 0.0, 15e-3), (-1.0, 0.0, 0.0)),
    LinkForce(12, (0.0, 0.0, 15e-3), (0.3, 0.0, 0.0)),
)
# Modulus of a chest tube's material. Assumed: plasticised PVC of Shore A 75, a usual hardness of drains,
# by Gent's relation E = 0.0981 (56 + 7.62336 A) / (0.137505 (254 - 2.54 A)) MPa; silicone of the same
# use, Shore A 60, would have half of it. chest_tube_2025 prints the tube's sizes only (Section II.B).
TUBE_HARDNESS_SHORE_A = 75.0


def tube_modulus_Pa(hardness_shore_A: float = TUBE_HARDNESS_SHORE_A) -> float:
    """Return Young's modulus of an elastomer of given hardness, 40 to 85 Shore A [Pa] (Gent 1958)."""
    top = 0.0981 * (56.0 + 7.62336 * hardness_shore_A)
    return top / (0.137505 * (254.0 - 2.54 * hardness_shore_A)) * 1e6


def in_outer_tube(robot: RollingRobot) -> RollingRobot:
    """Return `robot` inside its 28F tube of assumed PVC: the sleeve's EI from its own two radii."""
    sleeve = robot.sleeve
    second_moment = math.pi / 4.0 * (sleeve.outer_radius_m**4 - sleeve.inner_radius_m**4)
    return replace(robot, sleeve=replace(sleeve, bending_stiffness_N_m2=tube_modulus_Pa() * second_moment))


def compare(
    robot: RollingRobot,
    rows: Array,
    gravity_mps2: Array = NO_GRAVITY,
    others: Sequence[LinkForce] = (),
) -> tuple[float, float]:
    """Return how far the simulation's tip [mm] and joints [deg] are from the complete statics, at most.

    Args:
        robot: of rolling joints.
        rows: tensions, shape (r, t) [N].
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        others: steady forces on links.
    """
    ours = simulate(robot, given(rows), gravity_mps2, others=others).postures
    theirs = complete(robot, given(rows), gravity_mps2, others).postures
    if len(ours) != len(theirs):
        return math.nan, math.nan
    return largest_distance(tips_mm(ours), tips_mm(theirs)), _largest_turn_deg(ours, theirs)


def compared_lines(
    robot: str, what: str, found: tuple[float, float], tolerance: tuple[float, float] | None
) -> list[Line]:
    """Return the two lines of what `compare` found, tolerances in mm and deg."""
    tip, joint = (None, None) if tolerance is None else tolerance
    return [
        Line(robot, f"{what}: tip, largest", "mm", found[0], tip, "complete statics"),
        Line(robot, f"{what}: joint angle, largest", "deg", found[1], joint, "complete statics"),
    ]


def validate_loads(folder: Path) -> Validation:
    """Check forces on the section's links; nothing goes into `folder`."""
    section = chest_tube_section()
    frictionless = replace(section, friction=Friction(0.0))
    lines = []
    for name, forces in LINK_FORCES.items():
        for robot, mu, tolerance in ((frictionless, "mu 0", (0.25, 0.05)), (section, "friction", (1.0, 0.2))):
            what = f"50 N and back, two forces on links {name}, {mu}"
            lines += compared_lines(SECTION, what, compare(robot, TENSIONS_N, others=forces), tolerance)
    what = "50 N and back, 1 N and 0.3 N on links in the plane, friction"
    lines += compared_lines(SECTION, what, compare(section, TENSIONS_N, others=LARGE_FORCES), None)
    return Validation(tuple(lines), ())


def validate_section_sleeve(folder: Path) -> Validation:
    """Check the section in its outer tube; nothing goes into `folder`."""
    plain = replace(chest_tube_section(), friction=Friction(0.0))
    tubed = in_outer_tube(plain)
    across = np.array([9.81, 0.0, 0.0])
    lines = compared_lines(
        SECTION,
        "in the assumed outer tube, mu 0, 0 to 50 N, gravity across",
        compare(tubed, TENSIONS_N[:2], across),
        (0.25, 0.05),
    )
    lines += compared_lines(
        SECTION,
        "in the assumed outer tube, friction, 50 N and back",
        compare(in_outer_tube(chest_tube_section()), TENSIONS_N),
        (1.0, 0.2),
    )
    rigid = replace(plain, sleeve=Sleeve(1.0, plain.sleeve.inner_radius_m, plain.sleeve.outer_radius_m))
    straight = np.array([[0.0, 0.0, 225.0]])
    bent = tips_mm(simulate(rigid, given(TENSIONS_N[[1]]), NO_GRAVITY).postures)
    # Every joint turns by tension * arm / (EI / L) at most: 50 N * 3 mm / (1 N m^2 / 15 mm).
    angle = 50.0 * 3e-3 * 15e-3
    limit = sum(15.0 * k * angle for k in range(1, 16))
    far = largest_distance(bent, straight)
    what = "in a tube of EI 1 N m^2, 50 N: tip's way from straight; tolerance: linear estimate"
    lines.append(Line(SECTION, what, "mm", far, limit, "limit of a stiff tube", ours=far))
    return Validation(tuple(lines), (_tube_finding(plain, tubed),))


def validate_full_sleeve(folder: Path) -> Validation:
    """Check the full robot in its outer tube; nothing goes into `folder`."""
    robot = in_outer_tube(replace(chest_tube(), friction=Friction(0.0)))
    rows = np.zeros((3, len(robot.tendons)))
    rows[0, 0], rows[1, [0, 4]], rows[2, [1, 6]] = 40.0, (30.0, 20.0), (30.0, 20.0)
    found = compare(robot, rows, np.array([0.0, 9.81, 0.0]))
    what = "in the assumed outer tube, mu 0, three tension sets, gravity across"
    return Validation(tuple(compared_lines(FULL, what, found, (0.25, 0.05))), ())


def _tube_finding(plain: RollingRobot, tubed: RollingRobot) -> str:
    bends = [
        np.degrees(complete(robot, given(np.array([[20.0]])), NO_GRAVITY).postures[0].joint_angles.sum())
        for robot in (plain, tubed)
    ]
    return (
        f"{SECTION}: the 28F tube, assumed of PVC of Shore A {TUBE_HARDNESS_SHORE_A:g} "
        f"(E {tube_modulus_Pa() * 1e-6:.1f} MPa, EI {tubed.sleeve.bending_stiffness_N_m2 * 1e6:.0f} N mm^2), "
        f"lets the section bend {bends[1]:.1f} deg at 20 N, mu 0, where it bends {bends[0]:.1f} deg alone: "
        f"an outer backbone about as stiff as the rods in their gaps."
    )


def _largest_turn_deg(ours: Sequence[Posture], theirs: Sequence[Posture]) -> float:
    both = [np.array([posture.joint_angles for posture in run]) for run in (ours, theirs)]
    return float(np.degrees(np.abs(both[0] - both[1]).max()))
