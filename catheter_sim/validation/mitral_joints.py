"""The transseptal catheter's joints with the tube: loops, dead-bands, PI models (Nayar 2022, Fig. 8, Section
IV-C)."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.robots.catheter import measured as modified
from catheter_sim.robots.catheter.description import moved_segment
from catheter_sim.robots.catheter.kinematics import pulled_m
from catheter_sim.robots.catheter.measured import identify
from catheter_sim.robots.catheter.published import mitral_transseptal, mitral_transseptal_tube
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.validation import mitral_plots
from catheter_sim.validation.lines import (
    FITTED,
    READ_BACK,
    Line,
    Validation,
)
from catheter_sim.validation.mitral_loops import (
    JOINTS,
    JointLoops,
    calibrated,
    loops_of,
    pure,
)

NAME = "mitral_transseptal"
_EQUATIONS = "Nayar 2022, Eqs 25-28 as printed"
PLATEAUS = {"torsion_proximal": modified.TORSION_PROXIMAL, "torsion_distal": modified.TORSION_DISTAL}
_OWN_LOOPS = "fitted to other loops of the same simulation: how well its form describes them, not judged"
DEAD_ZONES = 10


def validate_joints(folder: Path) -> Validation:
    """Check the joints' loops; draws `mitral_loops_tube.png` (Fig. 8)."""
    tube = mitral_transseptal_tube()
    loops = {joint: loops_of(tube, joint) for joint in JOINTS}
    lines = [*_figure_8(tube, loops), *_halves(tube, loops)]
    mitral_plots.loops(_drawn(tube, loops), folder / "mitral_loops_tube.png")
    return Validation(tuple(lines), (_finding(),))


def _figure_8(robot: CatheterRobot, loops: dict[str, JointLoops]) -> list[Line]:
    """Compare the simulated loops of the robot with the tube with MK as printed, and its dead-bands."""
    models = calibrated(robot, loops)
    source = "Nayar 2022, Eqs 25-28 as printed; stretch and stiffness are from its slope"
    bend = loops["bending"]
    printed = modified.bending_rad(robot.segments[1], bend.displacement_m)
    later = bend.displacement_m > modified.BENDING.turn_m
    lines = [
        Line(
            NAME,
            "with the tube, bending beyond l*: RMSE of MK",
            "deg",
            _rmse_deg(bend, printed, later),
            None,
            source,
            kind=FITTED,
        ),
        Line(
            NAME,
            "with the tube, bending to 6 mm: largest angle",
            "deg",
            abs(math.degrees(float(bend.angle_rad.max())) - math.degrees(float(printed.max()))),
            None,
            source,
            ours=math.degrees(float(bend.angle_rad.max())),
            published=math.degrees(float(printed.max())),
            kind=FITTED,
        ),
        Line(
            NAME,
            "with the tube, bending: RMSE of PK",
            "deg",
            _rmse_deg(bend, pure(robot, bend)),
            None,
            source,
        ),
    ]
    jump = [
        modified.bending_rad(robot.segments[1], np.array([modified.BENDING.turn_m + step]))[0]
        for step in (0.0, 1e-12)
    ]
    lines.append(
        Line(NAME, "MK of bending: jump at l*", "deg", math.degrees(abs(jump[1] - jump[0])), 0.1, _EQUATIONS)
    )
    for joint, plateaus in PLATEAUS.items():
        width = _dead_band_m(loops[joint]) * 1e3
        what = f"with the tube, {joint}: dead-band at the upper plateau"
        wanted, source = plateaus.width_m * 1e3, "Nayar 2022: d_b, the robot's own play"
        lines.append(
            Line(NAME, what, "mm", abs(width - wanted), None, source, width, None, wanted, READ_BACK)
        )
        found = modified.torsion_rad(
            robot.segments[moved_segment(robot, JOINTS.index(joint))],
            loops[joint].displacement_m,
            models.torsion[joint],
        )
        what = f"with the tube, {joint}: RMSE of MK calibrated on other loops"
        error, source = _rmse_deg(loops[joint], found, ~loops[joint].train), f"Eqs 26-28; {_OWN_LOOPS}"
        lines.append(Line(NAME, what, "deg", error, None, source, kind=FITTED))
    return lines


def _drawn(
    robot: CatheterRobot, loops: dict[str, JointLoops]
) -> list[tuple[str, JointLoops, dict[str, Array]]]:
    """Return every joint's loops with what PK, MK as printed and PI say of them [rad]."""
    models = calibrated(robot, loops)
    shown = []
    for joint, item in loops.items():
        segment = robot.segments[moved_segment(robot, JOINTS.index(joint))]
        if joint == "bending":
            printed = modified.bending_rad(segment, item.displacement_m)
        else:
            printed = modified.torsion_rad(segment, item.displacement_m, PLATEAUS[joint])
        plays = models.plays[joint](item.displacement_m)
        shown.append((joint, item, {"PK": pure(robot, item), "MK as printed": printed, "PI": plays}))
    return shown


def _halves(robot: CatheterRobot, loops: dict[str, JointLoops]) -> list[Line]:
    """Identify the plays on the first two loops, and test them on the other two."""
    lines = []
    every = {f"{joint}, to one side": item for joint, item in loops.items()}
    every["bending, to both sides"] = loops_of(robot, "bending", both_sides=True)
    for joint, item in every.items():
        way, angle = item.displacement_m[item.train], item.angle_rad[item.train]
        for zones in (0, DEAD_ZONES):
            found = identify(way, angle, dead_zones=zones)(item.displacement_m)
            share = math.radians(_rmse_deg(item, found, ~item.train)) / float(np.ptp(item.angle_rad))
            name = "PI with dead zones" if zones else "PI"
            what = f"{joint}: {name}, identified on half of the loops, on the others: RMSE over the range"
            source = f"Nayar 2022, Eqs 29-34; {_OWN_LOOPS}"
            lines.append(Line(NAME, what, "-", share, None, source, kind=FITTED))
    return lines


def _dead_band_m(item: JointLoops) -> float:
    """Return how far the displacement comes back from the last peak before the joint follows [m].

    That is to where it has followed by a few degrees, less the way that these take.
    """
    peak = len(item.angle_rad) - 1 - int(np.argmax(item.displacement_m[::-1]))
    moved = peak + int(np.argmax(np.abs(item.angle_rad[peak:] - item.angle_rad[peak]) > math.radians(5.0)))
    segment = mitral_transseptal().segments[moved_segment(mitral_transseptal(), JOINTS.index(item.joint))]
    followed = pulled_m(segment, item.angle_rad[[peak, moved]])
    return float(item.displacement_m[peak] - item.displacement_m[moved] - (followed[0] - followed[1]))


def _rmse_deg(item: JointLoops, modelled: Array, rows: np.ndarray | None = None) -> float:
    error = np.degrees(modelled - item.angle_rad)
    return float(np.sqrt((error[slice(None) if rows is None else rows] ** 2).mean()))


def _finding() -> str:
    return (
        f"{NAME}: a Prandtl-Ishlinskii model cannot follow the bending joint with the tube, which is slack "
        "about zero and comes back without a loop beyond; with dead zones before its plays it can. The paper "
        "says as much of its own PI model in Fig. 8(a)."
    )
