"""Checks of the mitral-valve catheters' joints, loops and tips (Nayar 2022, Nayar 2023)."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.controllers.motors import ADVANCE_GEAR, BENDING_GEAR, LeadScrew
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.robots.catheter import kinematics
from catheter_sim.robots.catheter import measured as modified
from catheter_sim.robots.catheter.description import (
    hinge_counts,
    hinge_heights_m,
    moved_segment,
    moving,
    turning,
)
from catheter_sim.robots.catheter.kinematics import angle_rad, pulled_m
from catheter_sim.robots.catheter.laws import StretchingTendon
from catheter_sim.robots.catheter.measured import (
    BENDING_LOOP_M,
    PRINTED,
    BendingCalibration,
    PrandtlIshlinskii,
    TorsionCalibration,
    calibrate_bending,
    calibrate_torsion,
    identify,
    need,
    repeats_m,
    stretching_joints,
    tension_along,
)
from catheter_sim.robots.catheter.published import mitral_4dof, mitral_transseptal, mitral_transseptal_tube
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.robots.catheter.statics import balance
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation import pictures
from catheter_sim.validation.lines import (
    ASSUMED,
    FITTED,
    NO_GRAVITY,
    READ_BACK,
    Line,
    Validation,
    given,
    largest_distance,
    tips_mm,
)

# ----------------------------------------------------------------------------------------------------
# Checks of the mitral-valve catheters (Nayar 2022, doi 10.1109/TMRB.2022.3215522; Nayar 2023).

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
        tool = kinematics.transseptal_tool(robot, q)
    else:
        tool = kinematics.four_dof_tool(robot, q)
    return kinematics.in_base_frame(*tool)[0] * 1e3


def displacements_mm(robot: CatheterRobot, q: Array) -> Array:
    """Return what moves the joints to q, shape (r, 4), in the order of the pairs, shape (r, 4) [mm]."""
    order = moving(robot)
    columns = []
    for pair in range(len(robot.tendons)):
        index = moved_segment(robot, pair)
        value, segment = q[:, order.index(index)], robot.segments[index]
        columns.append(value if segment.joint == "prismatic" else kinematics.pulled_m(segment, value))
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
    expected = segment.bending_stiffness_N_m_per_rad * np.abs(bend) / kinematics.arm_m(segment, bend)
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
    slack = float(kinematics.slack_m(segment, segment.limit_rad)) * 1e3
    pull = float(kinematics.pulled_m(segment, segment.limit_rad)) * 1e3
    return (
        f"{robot.name}: by Eq. 6 the antagonist of {segment.name} needs {-slack:.2f} mm more than the common "
        f"pulley lets go ({pull:.2f} mm) at {math.degrees(segment.limit_rad):g} deg; the simulation lets it "
        "give way by that much, so that Eq. 7 holds."
    )


# ----------------------------------------------------------------------------------------------------
# Loops of the transseptal catheter's joints, simulated, and the models that are calibrated on them.
#
# Nayar 2022, Figs 6 and 8. The paper prints no trajectory: each joint goes out and back alone, `PEAKS`
# times its range, in half waves of a cosine, `LEG_S` each way.

JOINTS = ("bending", "torsion_proximal", "torsion_distal")  # in the order of the pairs
PEAKS = (1.0, 0.6, 0.8, 1.0)  # of a joint's largest displacement; a model sees the first two
LEG_S = 5.0
ROWS_PER_S = 10.0
_PRINTED = {"torsion_proximal": modified.TORSION_PROXIMAL, "torsion_distal": modified.TORSION_DISTAL}


@dataclass(frozen=True)
class JointLoops:
    """What one joint did.

    Attributes:
        joint: its name.
        displacement_m, angle_rad: row by row from rest, shape (r,).
        train: rows of the first two loops, shape (r,).
    """

    joint: str
    displacement_m: Array
    angle_rad: Array
    train: np.ndarray


@dataclass(frozen=True)
class CalibratedModels:
    """Models of the joints calibrated on their loops: MK's two kinds, and PI for each."""

    bending: BendingCalibration
    torsion: dict[str, TorsionCalibration]
    plays: dict[str, PrandtlIshlinskii]


def waves(corners: Array, leg_s: float = LEG_S) -> Array:
    """Return half waves of a cosine through `corners`, `ROWS_PER_S` rows a second, shape (r,)."""
    steps = round(leg_s * ROWS_PER_S)
    share = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, steps + 1) / steps)
    parts = [low + (high - low) * share for low, high in itertools.pairwise(corners)]
    return np.concatenate([corners[:1], *parts])


def moving_joint(rows_m: Array) -> Inputs:
    """Return inputs of displacements and advance in time, shape (r, 4) [m]."""
    nothing = np.zeros((len(rows_m), 3))
    return Inputs(np.arange(len(rows_m)) / ROWS_PER_S, "displacement", rows_m, nothing, nothing)


def largest_displacement_m(robot: CatheterRobot, joint: str) -> float:
    """Return how far the paper's loop of a joint goes [m]: 6 mm, or to the printed upper plateau."""
    if joint == "bending":
        return BENDING_LOOP_M
    segment = robot.segments[moved_segment(robot, JOINTS.index(joint))]
    return modified.plateau_displacement_m(segment, _PRINTED[joint])


def loops_of(
    robot: CatheterRobot,
    joint: str,
    both_sides: bool = False,
    top_m: float | None = None,
    by_statics: bool = False,
) -> JointLoops:
    """Return a joint's loops from rest, simulated.

    Args:
        robot: of the transseptal design.
        joint: one of `JOINTS`.
        both_sides: to one side and the other, instead of to one.
        top_m: largest displacement; default: the paper's.
        by_statics: by the balance of tendons and joint instead.
    """
    pair = JOINTS.index(joint)
    top = largest_displacement_m(robot, joint) if top_m is None else top_m
    corners = np.zeros(2 * len(PEAKS) + 1)
    corners[1::2] = np.array(PEAKS) * top
    if both_sides:
        corners[2::2] = -corners[1::2]
    rows = np.zeros((len(waves(corners)), 4))
    rows[:, pair] = waves(corners)
    if by_statics:
        postures = balance(robot, moving_joint(rows), NO_GRAVITY).postures
    else:
        postures = simulate(robot, moving_joint(rows), NO_GRAVITY, dynamic=True).postures
    angle = np.radians(joint_angles_deg(robot, postures)[joint])
    train = np.arange(len(rows)) <= 4 * round(LEG_S * ROWS_PER_S)
    return JointLoops(joint, rows[:, pair], angle, train)


def calibrated(robot: CatheterRobot, loops: dict[str, JointLoops]) -> CalibratedModels:
    """Return MK and PI models of the joints, from the first two loops of each."""
    torsion, plays = {}, {}
    bending = None
    for joint, item in loops.items():
        segment = robot.segments[moved_segment(robot, JOINTS.index(joint))]
        way, angle = item.displacement_m[item.train], item.angle_rad[item.train]
        if joint == "bending":
            bending = calibrate_bending(segment, way, angle)
        else:
            torsion[joint] = calibrate_torsion(segment, way, angle)
        plays[joint] = identify(way, angle)
    assert bending is not None
    return CalibratedModels(bending, torsion, plays)


def r_squared(measured: Array, modelled: Array) -> float:
    """Return the share of the measured variance that a model explains."""
    left = float(((measured - modelled) ** 2).sum())
    return 1.0 - left / float(((measured - measured.mean()) ** 2).sum())


def branches(item: JointLoops) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows of loading (away from zero) and of unloading, after the first leg, each (r,)."""
    size = np.abs(item.displacement_m)
    step = np.diff(size, prepend=size[0])
    later = np.arange(len(size)) > round(LEG_S * ROWS_PER_S)
    return later & (step > 0.0), later & (step < 0.0)


def pure(robot: CatheterRobot, item: JointLoops) -> Array:
    """Return what pure kinematics says along loops, shape (r,) [rad] (Eqs 5 and 7)."""
    segment = robot.segments[moved_segment(robot, JOINTS.index(item.joint))]
    return angle_rad(segment, item.displacement_m)


def with_play(robot: CatheterRobot, joint: str, play_m: float) -> CatheterRobot:
    """Return a robot whose drive of one joint has a play."""
    pairs = (replace(pair, play_m=play_m) if pair.name == joint else pair for pair in robot.tendons)
    return replace(robot, tendons=tuple(pairs))


# ----------------------------------------------------------------------------------------------------
# The transseptal catheter's joints with the tube: loops, dead-bands, PI models (Nayar 2022, Fig. 8, Section
# IV-C).

NAME_MITRAL_JOINTS = "mitral_transseptal"
_EQUATIONS = "Nayar 2022, Eqs 25-28 as printed"
PLATEAUS = {"torsion_proximal": modified.TORSION_PROXIMAL, "torsion_distal": modified.TORSION_DISTAL}
_OWN_LOOPS = "Fitted to other loops of the same simulation: how well its form describes them, not judged"
DEAD_ZONES = 10


def validate_joints(folder: Path) -> Validation:
    """Check the joints' loops; draws `mitral_loops_tube.png` (Fig. 8)."""
    tube = mitral_transseptal_tube()
    loops = {joint: loops_of(tube, joint) for joint in JOINTS}
    lines = [*_figure_8(tube, loops), *_halves(tube, loops)]
    pictures.joint_loops(_drawn(tube, loops), folder / "mitral_loops_tube.png")
    return Validation(tuple(lines), (_joints_finding(),))


def _figure_8(robot: CatheterRobot, loops: dict[str, JointLoops]) -> list[Line]:
    """Compare the simulated loops of the robot with the tube with MK as printed, and its dead-bands."""
    models = calibrated(robot, loops)
    source = "Nayar 2022, Eqs 25-28 as printed; stretch and stiffness are from its slope"
    bend = loops["bending"]
    printed = modified.bending_rad(robot.segments[1], bend.displacement_m)
    later = bend.displacement_m > modified.BENDING.turn_m
    lines = [
        Line(
            NAME_MITRAL_JOINTS,
            "with the tube, bending beyond l*: RMSE of MK",
            "deg",
            _rmse_deg(bend, printed, later),
            None,
            source,
            kind=FITTED,
        ),
        Line(
            NAME_MITRAL_JOINTS,
            "with the tube, bending to 6 mm: largest angle",
            "deg",
            abs(math.degrees(float(bend.angle_rad.max())) - math.degrees(float(printed.max()))),
            None,
            source,
            ours=math.degrees(float(bend.angle_rad.max())),
            analytic=math.degrees(float(printed.max())),  # by Eq. 25: the angle itself is not printed
            kind=FITTED,
        ),
        Line(
            NAME_MITRAL_JOINTS,
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
        Line(
            NAME_MITRAL_JOINTS,
            "MK of bending: jump at l*",
            "deg",
            math.degrees(abs(jump[1] - jump[0])),
            0.1,
            _EQUATIONS,
        )
    )
    for joint, plateaus in PLATEAUS.items():
        width = _dead_band_m(loops[joint]) * 1e3
        what = f"with the tube, {joint}: dead-band at the upper plateau"
        wanted, source = plateaus.width_m * 1e3, "Nayar 2022: d_b, the robot's own play"
        lines.append(
            Line(
                NAME_MITRAL_JOINTS,
                what,
                "mm",
                abs(width - wanted),
                None,
                source,
                width,
                None,
                wanted,
                READ_BACK,
            )
        )
        found = modified.torsion_rad(
            robot.segments[moved_segment(robot, JOINTS.index(joint))],
            loops[joint].displacement_m,
            models.torsion[joint],
        )
        what = f"with the tube, {joint}: RMSE of MK calibrated on other loops"
        error, source = _rmse_deg(loops[joint], found, ~loops[joint].train), f"Eqs 26-28. {_OWN_LOOPS}"
        lines.append(Line(NAME_MITRAL_JOINTS, what, "deg", error, None, source, kind=FITTED))
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
            what = f"{joint}: {name}, identified on half of the loops, RMSE over the range on the others"
            source = f"Nayar 2022, Eqs 29-34. {_OWN_LOOPS}"
            lines.append(Line(NAME_MITRAL_JOINTS, what, "-", share, None, source, kind=FITTED))
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


def _joints_finding() -> str:
    return (
        f"{NAME_MITRAL_JOINTS}: a Prandtl-Ishlinskii model cannot follow the bending joint with the tube, "
        "which is slack about zero and comes back without a loop beyond; with dead zones before its plays it "
        "can. The paper says as much of its own PI model in Fig. 8(a)."
    )


# ----------------------------------------------------------------------------------------------------
# The transseptal catheter's joints without the tube, and ten cycles of each (Nayar 2022, Fig. 6, Section
# IV-A).
#
# Fig. 6 prints two R^2 of pure kinematics for each joint, and neither the friction nor the dead-band of the
# specimen without the tube; d_b is printed with it alone. Read as the displacement growing and falling, the
# two R^2 leave two numbers: the drive's dead-band, and where the displacement has its zero. They are
# fitted, `DEAD_BANDS_MM`. With prestressed springs, as in the paper, there is no dead-band.

NAME = "mitral_transseptal"
FIGURE_6 = {"bending": (0.9972, 0.995), "torsion_proximal": (0.962, 0.9134)}  # R^2 without the springs
DEAD_BANDS_MM = {"bending": (0.290, -0.027), "torsion_proximal": (0.842, -0.135)}  # whole width; zero. Fitted
_FITTED = "Nayar 2022, Fig. 6(a); dead-band and zero of the drive are from these two"
CYCLES = 10


@dataclass(frozen=True)
class Bare:
    """A joint's loops without the tube: with springs, and without; the zero of the latter's displacement
    [m]."""

    sprung: JointLoops
    slack: JointLoops
    zero_m: float


def validate_cycles(folder: Path) -> Validation:
    """Check the loops without the tube and the ten cycles; draws `mitral_loops_bare.png` (Fig. 6)."""
    found = {joint: bare_loops(joint) for joint in FIGURE_6}
    lines = [line for joint in FIGURE_6 for line in bare_lines(joint, found[joint])]
    lines += [repeat_line(joint, ten_cycles(joint)) for joint in JOINTS]
    robot = mitral_transseptal()
    shown = [
        (f"{joint}, no tube, {name}", item, {"PK": pure(robot, item)})
        for joint, bare in found.items()
        for name, item in (("springs", bare.sprung), ("no springs", bare.slack))
    ]
    pictures.joint_loops(shown, folder / "mitral_loops_bare.png")
    return Validation(tuple(lines), (_cycles_finding(),))


def bare_loops(joint: str) -> Bare:
    """Return a joint's simulated loops to both limits without the tube."""
    robot = mitral_transseptal()
    segment = robot.segments[moved_segment(robot, JOINTS.index(joint))]
    top = float(pulled_m(segment, segment.limit_rad))
    width_mm, zero_mm = DEAD_BANDS_MM[joint]
    sprung, slack = (
        loops_of(with_play(robot, joint, way), joint, True, top) for way in (0.0, width_mm * 1e-3)
    )
    return Bare(sprung, slack, zero_mm * 1e-3)


def bare_lines(joint: str, bare: Bare) -> list[Line]:
    """Return how much of each branch pure kinematics leaves unexplained, with springs and without."""
    robot, lines = mitral_transseptal(), []
    segment = robot.segments[moved_segment(robot, JOINTS.index(joint))]
    item = bare.slack
    limit = float(pulled_m(segment, segment.limit_rad))
    told = angle_rad(segment, np.clip(item.displacement_m + bare.zero_m, -limit, limit))
    names = ("displacement growing", "displacement falling")
    for name, rows, printed in zip(names, growing_falling(item), FIGURE_6[joint], strict=True):
        left = 1.0 - r_squared(item.angle_rad[rows], told[rows])
        what = f"{joint}, no tube, without the spring, {name}: 1 - R^2 of pk"
        wanted = 1.0 - printed
        lines.append(Line(NAME, what, "-", abs(left - wanted), None, _FITTED, left, None, wanted, FITTED))
    for name, rows in zip(names, growing_falling(bare.sprung), strict=True):
        left = 1.0 - r_squared(bare.sprung.angle_rad[rows], pure(robot, bare.sprung)[rows])
        what = f"{joint}, no tube, with the spring, {name}: 1 - R^2 of pk"
        lines.append(Line(NAME, what, "-", left, 1e-4, "no slack, so Eqs 3 and 6", left))
    return lines


def growing_falling(item: JointLoops) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows in which the displacement grows and falls, after the first leg, each (r,)."""
    step = np.diff(item.displacement_m, prepend=item.displacement_m[0])
    later = np.arange(len(step)) > round(LEG_S * ROWS_PER_S)
    return later & (step > 0.0), later & (step < 0.0)


def ten_cycles(joint: str) -> Array:
    """Return a joint's angle with the tube in ten equal cycles to its largest displacement, (10, r) [deg]."""
    robot = mitral_transseptal_tube()
    corners = np.zeros(2 * CYCLES + 1)
    corners[1::2] = largest_displacement_m(robot, joint)
    way = waves(corners)
    rows = np.zeros((len(way), 4))
    rows[:, JOINTS.index(joint)] = way
    postures = simulate(robot, moving_joint(rows), NO_GRAVITY, dynamic=True).postures
    return joint_angles_deg(robot, postures)[joint][1:].reshape(CYCLES, -1)


def repeat_line(joint: str, angle_deg: Array) -> Line:
    """Return how far the second to the tenth cycle lie apart at one displacement."""
    apart = float(np.ptp(angle_deg[1:], axis=0).max())
    what = f"with the tube, {joint}, ten cycles: second to tenth, largest spread at one displacement"
    source = (
        "Nayar 2022, Section IV-A, ten cycles. Dry friction and dead-bands forget no cycle and add none. "
        "Shown, not judged: no robot that is wrong by a fifth changes it"
    )
    return Line(NAME, what, "deg", apart, None, source, ours=apart)


def _cycles_finding() -> str:
    width = DEAD_BANDS_MM["torsion_proximal"][0]
    printed = modified.TORSION_PROXIMAL.width_m * 1e3
    return (
        f"{NAME}: Fig. 6's two R^2 of the torsion joint without the tube ask for a dead-band of {width:g} "
        "mm, less "
        f"than the {printed:g} mm that are printed with it, as the paper's words have it."
    )


# ----------------------------------------------------------------------------------------------------
# The bending tendons of the 4-DoF catheter under cyclic load (Nayar 2023, Fig. 3, Algorithm 1).
#
# Ten cycles each to 1 to 6 mm of a 65 mm sample. Statics of the law, and the simulated tendon beside it.
# The figure's ranges are not in the paper's text; what the text says of it is judged.

ELONGATION = "mitral_4dof"
SAMPLE_M, CYCLES_MITRAL_ELONGATION, STEPS = 65e-3, 10, 120
WAYS_MM = (1, 2, 3, 4, 5, 6)
SOURCE = "Nayar 2023, Section III-A, Fig. 3"


def cycles(way_mm: float) -> Array:
    """Return the strains of ten cycles from zero, `STEPS` each way, shape (20 STEPS + 1,)."""
    up = np.linspace(0.0, way_mm * 1e-3 / SAMPLE_M, STEPS + 1)
    return np.concatenate([up[:1], *CYCLES_MITRAL_ELONGATION * (up[1:], up[-2::-1])])


def losses_J(strain: Array, tension_N: Array) -> Array:
    """Return the work that each cycle takes and does not give back, shape (10,) [J]."""
    work = np.diff(strain) * SAMPLE_M * 0.5 * (tension_N[1:] + tension_N[:-1])
    return np.asarray(work.reshape(CYCLES_MITRAL_ELONGATION, -1).sum(axis=1), dtype=float)


def validate_elongation(folder: Path) -> Validation:
    """Check the cyclic law and the simulated tendon; writes `mitral_elongation.png`."""
    lines, shown = [], []
    apart = 0.0
    for way in WAYS_MM:
        strain = cycles(way)
        tension = tension_along(PRINTED, strain)
        loss = losses_J(strain, tension)
        tendon = StretchingTendon(SAMPLE_M, math.inf)
        simulated = np.array([tendon.at(SAMPLE_M * own).tension_N for own in strain])
        apart = max(apart, float(np.abs(np.maximum(simulated, 0.0) - tension).max()))
        what = f"tendon of 65 mm to {way} mm, ten cycles: "
        lines += [
            _shown(what + "loss of the tenth over the first", "-", float(loss[-1] / loss[0])),
            _shown(what + "largest tension", "N", float(tension.max())),
            _shown(what + "slack after the first", "mm", _slack_mm(strain, tension)),
        ]
        shown.append((f"{way} mm", strain * SAMPLE_M * 1e3, tension))
    what = "simulated tendon against Algorithm 1, all cycles: tension, largest"
    lines.append(Line(ELONGATION, what, "N", apart, 1e-6, "Nayar 2023, Algorithm 1, printed parameters"))
    pictures.elongations(shown, folder / "mitral_elongation.png")
    return Validation(tuple(lines), ())


def _shown(what: str, unit: str, ours: float) -> Line:
    return Line(ELONGATION, what, unit, math.nan, None, SOURCE, ours=ours, kind=READ_BACK)


def _slack_mm(strain: Array, tension: Array) -> float:
    """Return at which elongation the first unloading left no tension [mm]."""
    first = slice(STEPS, 2 * STEPS + 1)
    return float(strain[first][tension[first] > 0.0].min()) * SAMPLE_M * 1e3


# ----------------------------------------------------------------------------------------------------
# Actuator sizing and preconditioning of the catheter of Nayar 2023, which the paper names and does not
# print.

SIZING = "mitral_4dof"
BEND_DEG_PER_S = 30.0  # of a joint, at which its motor is sized; assumed
_LAWS = "Nayar 2023, Algorithms 1 and 2; the paper names the use and prints no figure"
_SCREW = "Nayar 2023, Section II-B: gears of 64 and 100 to 1; screw of 2 mm lead, friction 0.2 assumed"


def validate_sizing(folder: Path) -> Validation:
    """Show what the drives must give; nothing is written."""
    lines: list[Line] = []
    screw = LeadScrew(BENDING_GEAR)
    for name, joint in stretching_joints(mitral_4dof()).items():
        limit = math.degrees(joint.segment.limit_rad)
        found = need(joint, limit)
        where = f"{name} to {limit:g} deg"
        lines += [
            _sizing_shown(f"{where}: largest tension, and preconditioning's", "N", found.tension_N),
            _sizing_shown(f"{where}: displacement, tendons that do not stretch", "mm", found.pure_m * 1e3),
            _sizing_shown(f"{where}: displacement, new tendon", "mm", found.new_m * 1e3),
            _sizing_shown(f"{where}: displacement, preconditioned tendon", "mm", found.ready_m * 1e3),
        ]
        new, ready = (abs(repeats_m(joint, limit, PRINTED, item)) * 1e3 for item in (False, True))
        what = (
            f"{where}: displacement halfway, change from the first bend to the second, preconditioned over "
            "new"
        )
        lines += [
            _sizing_shown(what, "-", ready / new, kind=READ_BACK),
            _sizing_shown(f"{where}: motor's torque", "mN m", screw.torque_Nm(found.tension_N) * 1e3, _SCREW),
        ]
        speed = found.ready_m / limit * BEND_DEG_PER_S
        lines += [
            _sizing_shown(
                f"{where}: motor's speed at {BEND_DEG_PER_S:g} deg/s", "rpm", screw.speed_rpm(speed), _SCREW
            ),
        ]
    tube = LeadScrew(ADVANCE_GEAR)
    lines.append(_sizing_shown("advance by 1 mm/s: motor's speed", "rpm", tube.speed_rpm(1e-3), _SCREW))
    lines.append(
        _sizing_shown(
            "bending drives: way of a holder a count of the encoder", "um", screw.step_m * 1e6, _SCREW
        )
    )
    return Validation(tuple(lines), (_sizing_finding(screw),))


def _sizing_shown(what: str, unit: str, ours: float, source: str = _LAWS, kind: str = ASSUMED) -> Line:
    return Line(SIZING, what, unit, math.nan, None, source, ours=ours, kind=kind)


def _sizing_finding(screw: LeadScrew) -> str:
    locks = (
        "locks itself, so that a tendon's tension moves no motor" if screw.locks_itself else "does not lock"
    )
    return (
        f"{SIZING}: a screw of {screw.lead_m * 1e3:g} mm lead on {screw.diameter_m * 1e3:g} mm {locks}: the "
        "control "
        "runs have their displacements exactly, and a motor's lag is of the catheter of 2022 alone."
    )
