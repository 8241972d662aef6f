"""Checks of the mitral-valve catheters (Nayar 2022, doi 10.1109/TMRB.2022.3215522; Nayar 2023)."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.robots.catheter import kinematics as closed_form
from catheter_sim.robots.catheter import kinematics as tendons
from catheter_sim.robots.catheter.description import (
    hinge_counts,
    hinge_heights_m,
    moved_segment,
    moving,
    turning,
)
from catheter_sim.robots.catheter.published import mitral_4dof, mitral_transseptal
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation.drives import NO_GRAVITY, given, largest_distance, tips_mm
from catheter_sim.validation.lines import Line, Validation

TRANSSEPTAL, FOUR_DOF = "mitral_transseptal", "mitral_4dof"
ANGLE_DEG, TIP_MM = 0.5, 0.3  # tolerances
RANDOM_POSTURES, SEED = 40, 4
SWEEP = np.concatenate([np.linspace(0.0, 1.0, 9), np.linspace(0.75, -1.0, 8), [-0.5, 0.0]])  # of the limit

# Displacements of bending, proximal and distal torsion, advance [mm]; angles in that order [deg], tip [mm]:
# values of a kinematic model written independently of this package.
REFERENCE_MM = np.array([(0, 0, 0, 0), (1, 1, -1, 20), (3, 0, 2, 0), (-2, 1.5, 0, 50)], dtype=float)
REFERENCE_DEG = np.array([(0, 0, 0), (31.719, 22.157, -21.432), (94.558, 0, 43.583), (-63.230, 33.612, 0)])
REFERENCE_TIP_MM = np.array(
    [(0.0, 0.0, 57.340), (22.807, 9.288, 71.183), (31.293, 0.0, 33.398), (-58.190, -38.679, 68.009)]
)


def catheter(name: str) -> CatheterRobot:
    """Return one of the two catheters, as published."""
    return mitral_transseptal() if name == TRANSSEPTAL else mitral_4dof()


def displaced(rows_mm: Array) -> Inputs:
    """Return inputs of displacements and advances, shape (r, t) [mm], one second apart."""
    return given(rows_mm * 1e-3, "displacement")


def joint_angles_deg(robot: CatheterRobot, postures: tuple[Posture, ...]) -> dict[str, Array]:
    """Return each joint's angle, by segment name, shape (r,) [deg]; gaps of a bending joint summed."""
    every = np.degrees([posture.joint_angles for posture in postures])
    parts = np.split(every, np.cumsum(hinge_counts(robot))[:-1], axis=1)
    return {segment.name: part.sum(axis=1) for segment, part in zip(turning(robot), parts, strict=True)}


def validate_transseptal(folder: Path) -> Validation:
    """Check the catheter of Nayar 2022; nothing is written."""
    robot = mitral_transseptal()
    postures = simulate(robot, displaced(REFERENCE_MM), NO_GRAVITY).postures
    found = joint_angles_deg(robot, postures)
    angles = np.stack([found[name] for name in ("bending", "torsion_proximal", "torsion_distal")], axis=1)
    source = "independent kinematic model"
    far = largest_distance(tips_mm(postures), REFERENCE_TIP_MM)
    lines = [
        Line(
            TRANSSEPTAL,
            "four reference postures: joint angle, largest",
            "deg",
            float(np.abs(angles - REFERENCE_DEG).max()),
            ANGLE_DEG,
            source,
        ),
        Line(TRANSSEPTAL, "four reference postures: tip, largest", "mm", far, TIP_MM, source),
    ]
    return Validation(tuple(lines + _lines(robot)), (_antagonist_finding(robot), _hinges_finding(robot)))


def validate_4dof(folder: Path) -> Validation:
    """Check the catheter of Nayar 2023; nothing is written."""
    robot = mitral_4dof()
    return Validation(tuple(_lines(robot)), (_hinges_finding(robot),))


def closed_form_tips_mm(robot: CatheterRobot, q: Array) -> Array:
    """Return the printed closed form's tips, base frame, shape (r, 3) [mm] (2022 Eq. 15; 2023 Eq. 7).

    Args:
        robot: of one of the two designs.
        q: joint values, base to tip, shape (r, 4).
    """
    if robot.name == TRANSSEPTAL:
        tool = closed_form.transseptal_tool(closed_form.transseptal_lengths(robot), q)
    else:
        tool = closed_form.four_dof_tool(closed_form.four_dof_lengths(robot), q)
    return closed_form.in_base_frame(*tool)[0] * 1e3


def displacements_mm(robot: CatheterRobot, q: Array) -> Array:
    """Return what moves the joints to q, shape (r, 4), in the order of the pairs, shape (r, 4) [mm]."""
    order = moving(robot)
    columns = []
    for pair in range(len(robot.tendons)):
        index = moved_segment(robot, pair)
        value, segment = q[:, order.index(index)], robot.segments[index]
        columns.append(value if segment.joint == "prismatic" else tendons.pulled_m(segment, value))
    return np.stack(columns, axis=1) * 1e3


def _lines(robot: CatheterRobot) -> list[Line]:
    return [*_sweep_lines(robot), _tip_line(robot), *_chain_lines(robot)]


def _limits(robot: CatheterRobot) -> Array:
    """Return the joints' limits, base to tip, shape (4,) [rad or m]."""
    segments = [robot.segments[index] for index in moving(robot)]
    return np.array([segment.stroke_m or segment.limit_rad for segment in segments])


def _sweep_lines(robot: CatheterRobot) -> list[Line]:
    """Move every joint alone through its range to both sides, and back."""
    lines = []
    for number, index in enumerate(moving(robot)):
        segment = robot.segments[index]
        if segment.joint == "prismatic":
            continue
        q = np.zeros((len(SWEEP), 4))
        q[:, number] = SWEEP * segment.limit_rad
        postures = simulate(robot, displaced(displacements_mm(robot, q)), NO_GRAVITY).postures
        error = joint_angles_deg(robot, postures)[segment.name] - np.degrees(q[:, number])
        limit = f"0 to {math.degrees(segment.limit_rad):g} deg, to both sides and back"
        equation = {"bending": "2022 Eq. 3, 2023 Eq. 12", "torsion": "2022 Eq. 6, 2023 Eq. 13"}[segment.joint]
        what = f"{segment.name}, {limit}: angle, largest"
        lines.append(
            Line(robot.name, what, "deg", float(np.abs(error).max()), ANGLE_DEG, f"Nayar {equation}")
        )
        if segment.joint == "bending":
            lines.append(_tension_line(robot, segment, postures, q[:, number]))
    return lines


def _tension_line(
    robot: CatheterRobot, segment: CatheterSegment, postures: tuple[Posture, ...], bend: Array
) -> Line:
    pair = [item.moves for item in robot.tendons].index(segment.name)
    tension = np.array([posture.actuator_tension[pair] for posture in postures])
    expected = segment.bending_stiffness_N_m_per_rad * np.abs(bend) / tendons.arm_m(segment, bend)
    error = float(np.abs(tension - expected).max() / expected.max() * 100.0)
    what = f"{segment.name}, the same: tension, largest error over largest tension"
    return Line(
        robot.name, what, "%", error, 1.0, "virtual work: stiffness * bend over the slope of the pull"
    )


def _tip_line(robot: CatheterRobot) -> Line:
    limits = _limits(robot)
    low = np.where([robot.segments[index].joint == "prismatic" for index in moving(robot)], 0.0, -limits)
    q = np.random.default_rng(SEED).uniform(low, limits, size=(RANDOM_POSTURES, 4))
    postures = simulate(robot, displaced(displacements_mm(robot, q)), NO_GRAVITY).postures
    far = largest_distance(tips_mm(postures), closed_form_tips_mm(robot, q))
    what = f"{RANDOM_POSTURES} random postures within the limits (seed {SEED}): tip, largest"
    return Line(robot.name, what, "mm", far, TIP_MM, "closed form, Nayar 2022 Eq. 15, 2023 Eq. 7 corrected")


def _chain_lines(robot: CatheterRobot) -> list[Line]:
    """Report the chain of hinges' own distance from the arc."""
    lines = []
    for segment in robot.segments:
        if segment.joint == "bending":
            what = (
                f"{segment.name} at {math.degrees(segment.limit_rad):g} deg: chain of hinges to arc, its end"
            )
            far = _far_from_arc_mm(segment, hinge_heights_m(segment))
            lines.append(Line(robot.name, what, "mm", far, None, "geometry alone"))
    return lines


def _far_from_arc_mm(segment: CatheterSegment, heights: Array) -> float:
    """Return how far a chain with hinges at these heights ends from the arc, at the joint's limit [mm]."""
    bend, gaps = segment.limit_rad, segment.rings + 1
    steps = np.diff(np.concatenate([[0.0], heights, [segment.length_m]]))
    angle = bend * np.arange(gaps + 1) / gaps
    arc = segment.length_m * np.array([1.0 - math.cos(bend), math.sin(bend)]) / bend
    return 1e3 * float(np.linalg.norm([steps @ np.sin(angle), steps @ np.cos(angle)] - arc))


def _hinges_finding(robot: CatheterRobot) -> str:
    found = []
    for segment in robot.segments:
        if segment.joint == "bending":
            ends = (segment.half_gap_m, segment.length_m - segment.half_gap_m)
            far = _far_from_arc_mm(segment, np.linspace(*ends, segment.rings + 1))
            found.append(f"{segment.name} {far:.2f} mm")
    return (
        f"{robot.name}: with rigid rings and every hinge in the middle of its gap, the bending joint's end "
        f"would lie off the papers' arc of constant curvature, at the limit by: {', '.join(found)}. The "
        "simulation spaces its hinges so that chain and arc agree; tendons keep the gaps' geometry."
    )


def _antagonist_finding(robot: CatheterRobot) -> str:
    segment = robot.segments[0]
    slack = float(tendons.slack_m(segment, segment.limit_rad)) * 1e3
    pull = float(tendons.pulled_m(segment, segment.limit_rad)) * 1e3
    return (
        f"{robot.name}: by Eq. 6 the antagonist of {segment.name} needs {-slack:.2f} mm more than the common "
        f"pulley lets go ({pull:.2f} mm) at {math.degrees(segment.limit_rad):g} deg; the simulation lets it "
        "give way by that much, so that Eq. 7 holds."
    )
