"""The transseptal catheter's tip by PK, MK, PI and their hybrid (Nayar 2022, Tables III and IV).

The robot is `mitral_transseptal@tube`: the dead-bands of Eqs 25-26, tendons that stretch, friction. All
three joints move at once; the paper prints no trajectory, so it is chosen here (`motion`): in a cycle of
35 s the bending joint goes to 6 mm and back once, the proximal torsion joint to its printed plateau twice,
the distal one three times. MK, PI and hybrid are calibrated as in the paper, on loops of each joint alone
(`mitral_loops`); MK is also taken as printed. Nothing
of it is judged: the specimen's own errors are not printed.

Table IV, the tortuous path, leaves open on which loops MK was calibrated: "using the MK model here leads to
large RMSE values". Both readings are shown: calibrated along that path, and along the straight one.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.robots.catheter import measured as modified
from catheter_sim.robots.catheter.description import moved_segment
from catheter_sim.robots.catheter.kinematics import angle_rad, tool_frame
from catheter_sim.robots.catheter.measured import TorsionCalibration
from catheter_sim.robots.catheter.published import mitral_transseptal, mitral_transseptal_tube
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation import mitral_plots
from catheter_sim.validation.drives import NO_GRAVITY, tips_mm
from catheter_sim.validation.lines import ASSUMED, OUT_OF_REACH, PREDICTED, REFUTED, Line, Validation
from catheter_sim.validation.mitral_loops import (
    JOINTS,
    ROWS_PER_S,
    Calibrated,
    calibrated,
    largest_displacement_m,
    loops_of,
    moving,
)
from catheter_sim.validation.shown import Motion

NAME = "mitral_transseptal"


CYCLE_S, CYCLES = 35.0, 2


SWINGS = (1, 2, 3)  # of the joints in a cycle


ADVANCES_MM = (0.0, 10.0, 20.0)


PATH_DEG, PATH_MU = 180.0, 0.2  # of the tortuous path: assumed, from the vena cava through the septum


MODELS = ("PK", "MK as printed", "MK", "PI", "hybrid")


ELSEWHERE = ("MK", "PI", "hybrid")  # models that have a calibration: along the same path, or along another


_SPECIMEN = "the specimen's own curvature, couplings and tracker are not printed"


TABLE_3_MM = {  # 3D
    0.0: {"PK": 45.47, "MK": 4.00, "PI": 8.25, "hybrid": 3.88},
    10.0: {"PK": 58.06, "MK": 4.90, "PI": 9.96, "hybrid": 4.69},
    20.0: {"PK": 68.54, "MK": 6.00, "PI": 12.59, "hybrid": 5.79},
}


TABLE_4_MM = {
    0.0: {"PK": 24.47, "PI": 3.72},
    10.0: {"PK": 32.37, "PI": 4.53},
    20.0: {"PK": 41.93, "PI": 6.54},
}


_PRINTED = {"torsion_proximal": modified.TORSION_PROXIMAL, "torsion_distal": modified.TORSION_DISTAL}


def tortuous(robot: CatheterRobot) -> CatheterRobot:
    """Return the robot with its tendons led through a tortuous path (Section IV-D)."""
    return replace(robot, path_rad=float(np.radians(PATH_DEG)), friction=replace(robot.friction, mu=PATH_MU))


def straight(model: str) -> str:
    """Return what a model that was calibrated along the straight path is called."""
    return f"{model} calibrated along the straight path"


def motion(
    robot: CatheterRobot, models: Calibrated, advance_mm: float, elsewhere: Calibrated | None = None
) -> Motion:
    """Return the chosen motion at an advance, simulated and by every model.

    Args:
        robot: of the transseptal design.
        models: calibrated along its own path.
        advance_mm: of the tube.
        elsewhere: calibrated along the straight path, to be shown besides.
    """
    time = np.arange(round(CYCLE_S * CYCLES * ROWS_PER_S) + 1) / ROWS_PER_S
    rows = np.zeros((len(time), 4))
    for pair, (joint, swings) in enumerate(zip(JOINTS, SWINGS, strict=True)):
        phase = 2.0 * np.pi * swings * time / CYCLE_S
        rows[:, pair] = largest_displacement_m(robot, joint) * (0.5 - 0.5 * np.cos(phase))
    rows[:, 3] = advance_mm * 1e-3 * np.minimum(time / 5.0, 1.0)
    simulated = simulate(robot, moving(rows), NO_GRAVITY, dynamic=True).postures
    told = {name: _tips_mm(robot, models, rows, name) for name in MODELS}
    if elsewhere is not None:
        told |= {straight(name): _tips_mm(robot, elsewhere, rows, name) for name in ELSEWHERE}
    return Motion(time, tips_mm(simulated), told)


def _tips_mm(robot: CatheterRobot, models: Calibrated, rows_m: Array, model: str) -> Array:
    """Return the tips that a model predicts, shape (r, 3) [mm]."""
    angles = {joint: _angle_rad(robot, models, joint, rows_m[:, k], model) for k, joint in enumerate(JOINTS)}
    q = np.stack(
        [angles["torsion_proximal"], angles["bending"], rows_m[:, 3], angles["torsion_distal"]], axis=1
    )
    return tool_frame(mitral_transseptal(), q)[:, :3, 3] * 1e3


def _angle_rad(robot: CatheterRobot, models: Calibrated, joint: str, way_m: Array, model: str) -> Array:
    segment = robot.segments[moved_segment(robot, JOINTS.index(joint))]
    if model == "PK":
        return angle_rad(segment, way_m)
    if model == "PI" or (model == "hybrid" and joint != "bending"):
        return models.plays[joint](way_m)
    printed = model == "MK as printed"
    if joint == "bending":
        return modified.bending_rad(segment, way_m, modified.BENDING if printed else models.bending)
    torsion: dict[str, TorsionCalibration] = _PRINTED if printed else models.torsion
    return modified.torsion_rad(segment, way_m, torsion[joint])


def validate_motion(folder: Path) -> Validation:
    """Check the order and ratios of Tables III and IV; writes `mitral_motion.png`."""
    lines: list[Line] = []
    shown: list[tuple[str, Motion]] = []
    along_straight: Calibrated | None = None
    for path, table, robot in (
        ("straight", TABLE_3_MM, mitral_transseptal_tube()),
        ("tortuous", TABLE_4_MM, tortuous(mitral_transseptal_tube())),
    ):
        models = calibrated(robot, {joint: loops_of(robot, joint) for joint in JOINTS})
        for advance in ADVANCES_MM:
            found = motion(robot, models, advance, along_straight)
            error = {name: float(found.rmse_mm(name)[3]) for name in found.model_mm}
            where = f"{path} path, advance {advance:g} mm"
            source = f"Nayar 2022, Table {'III' if path == 'straight' else 'IV'}; trajectory chosen here"
            lines += [
                Line(
                    NAME,
                    f"{where}: tip by {name}, RMSE",
                    "mm",
                    error[name] if published is None else abs(error[name] - published),
                    None,
                    f"{source}; {_SPECIMEN}",
                    ours=error[name],
                    published=published,
                    kind=PREDICTED if published is None else OUT_OF_REACH,
                )
                for name, published in ((name, table[advance].get(name)) for name in error)
            ]
            lines += _ratios(where, error, table[advance], source)
            shown.append((where, found))
        along_straight = models
    mitral_plots.motions([shown[2], shown[5]], MODELS, folder / "mitral_motion.png")
    return Validation(tuple(lines), (_finding(),))


def _ratios(where: str, error: dict[str, float], printed: dict[str, float], source: str) -> list[Line]:
    """Show the ratios of the models' errors beside the table's.

    MK and the hybrid are calibrated on loops of the same simulated robot, whose dead-bands they know, so that
    how far they get is no prediction. Table IV gives no figures of theirs, but says that PI does better.
    """
    lines = []
    for a, b in (("MK", "PK"), ("PI", "PK"), ("hybrid", "PK"), ("PI", "MK")):
        ours, what = error[a] / error[b], f"{where}: RMSE of {a} over {b}"
        if a in printed and b in printed:
            theirs = printed[a] / printed[b]
            gap, why = abs(ours - theirs), f"{source}; {_SPECIMEN}"
            lines.append(Line(NAME, what, "-", gap, None, why, ours, None, theirs, OUT_OF_REACH))
        elif (a, b) == ("PI", "MK"):
            why = f"{source}; said to be below 1, and is not where MK is calibrated along the same path"
            kind = REFUTED if ours > 1.0 else OUT_OF_REACH
            lines.append(Line(NAME, what, "-", max(ours - 1.0, 0.0), None, why, ours, kind=kind))
    if straight("MK") in error:
        for a, b in (("PI", "MK"), ("PI", "hybrid")):
            ours = error[straight(a)] / error[straight(b)]
            what = f"{where}: RMSE of {a} over {b}, both calibrated along the straight path"
            why = f"{source}; said to be below 1; which loops the models were calibrated on is not printed"
            gap = max(ours - 1.0, 0.0)
            lines.append(Line(NAME, what, "-", gap, None, why, ours, kind=ASSUMED))
    return lines


def _finding() -> str:
    return (
        f"{NAME}: the tip errors are of a simulated robot with the printed dead-bands, not of the paper's "
        "specimen: its tube's own curvature, its couplings and its tracker are not in them."
    )
