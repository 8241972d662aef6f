"""Checks of the mitral catheters' control (Nayar 2022, Section III; Nayar 2023, Sections IV-A and IV-B).

2023. The robot is `mitral_4dof@elongation`: tendons and joints by the printed Algorithms 1 and 2, cycle
effects included, dead-bands and friction. The controller takes it for the nominal one: TE has the
simplified law (phi = 1, beta = 0), and neither slack nor friction. The paper prints no trajectory, so
order and ratios are judged, the digits only stand beside. Both bending joints follow `CORNERS_DEG`, in
half waves of a cosine. They stay above 10 deg: Algorithm 2 asks the proximal tendon for no tension below
3.4 deg, so that nothing there determines the bend. The dead-band that torsion compensates is assumed to
be known a fifth too small.

2022. A motor whose gain is 0.8 of the nominal one moves the bending joint of `mitral_transseptal`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from catheter_sim.controllers import loop, motor
from catheter_sim.controllers.feedforward import along, feedforward
from catheter_sim.controllers.pid import RATE_HZ, Pid
from catheter_sim.controllers.trajectories import through, ticks_s
from catheter_sim.core.posture import Array
from catheter_sim.kinds.catheter.robots.mitral import mitral_4dof, mitral_4dof_elongation, mitral_transseptal
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.kinds.catheter.theory.tendons import arm_m
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.validation import control_plots
from catheter_sim.validation.lines import ASSUMED, OUT_OF_REACH, PREDICTED, Line, Validation

FOUR_DOF, TRANSSEPTAL = "mitral_4dof", "mitral_transseptal"
BENDING = ("bending_proximal", "bending_distal")
DRIVEN = (*BENDING, "torsion")
CORNERS_DEG, LEGS_S = (0.0, 10.0, 40.0, 10.0, 60.0, 10.0), (5.0, 15.0, 15.0, 20.0, 20.0)
# Section IV-B: all joints at once; bending joints, torsion [deg], advance [mm]
WHOLE_DEG, WHOLE_LEGS_S = (0.0, 10.0, 50.0, 10.0), (4.0, 12.0, 12.0)
TORSION_DEG, ADVANCE_MM = (0.0, 40.0, -40.0, 0.0), (0.0, 20.0, 5.0, 20.0)
DEAD_BAND_KNOWN = 0.8  # share of the torsion pair's play that is compensated; assumed
SHARES = (0.25, 0.31)  # Table II: the controller's, of the bending joints
_TRACKER = "the tracker's noise and its frame's error are not in the runs"
FIGURE_6_DEG = {"PK": 21.0, "TE": 4.8, "PK+PID": 2.53, "TE+PID": 0.88}  # proximal; in the order of size
# Tables I and II, variable advance, by joint: model alone and with the controller; the controller's share
TABLE_1_DEG = ((10.08, 2.1), (8.1, 1.03), (5.52, 1.91))
TABLE_2_SHARE = (0.28, 0.31, 0.45)
WEAKER = 0.8  # the 2022 motor's gain over the nominal one
SERVO_DEG, SERVO_LEGS_S = 60.0, (2.0, 2.0)
MISMATCH = (0.7, 1.0, 1.3)


@dataclass(frozen=True)
class JointControl:
    """The four runs of Section IV-A by name: "PK", "TE", "PK+PID", "TE+PID"."""

    runs: Mapping[str, loop.ControlRun]

    def rmse_deg(self, joint: str) -> dict[str, float]:
        """Return the runs' root mean square errors of a joint [deg]."""
        k = DRIVEN.index(joint)
        return {name: float(run.rmse_deg()[k]) for name, run in self.runs.items()}

    def share(self, joint: str, run: str) -> float:
        """Return the controller's share of a joint's displacement in a run."""
        return float(self.runs[run].controller_share()[DRIVEN.index(joint)])


def joint_control(
    robot: CatheterRobot,
    corners_deg: tuple[float, ...] = CORNERS_DEG,
    legs_s: tuple[float, ...] = LEGS_S,
) -> JointControl:
    """Return both bending joints of a robot controlled by PK and TE, without and with PID.

    Args:
        robot: of the design of the 4-DoF catheter.
        corners_deg, legs_s: of the desired bends (`trajectories.through`).
    """
    ticks = ticks_s(sum(legs_s), RATE_HZ)
    bend = np.radians(through(corners_deg, legs_s, ticks))
    desired = np.stack([bend, bend, np.zeros(len(ticks)), np.zeros(len(ticks))], axis=1)
    runs = {}
    for model in ("pk", "te"):
        way = along(feedforward(mitral_4dof(), model), desired)
        runs[model.upper()] = _controlled(robot, desired, way, ())
        runs[f"{model.upper()}+PID"] = _controlled(robot, desired, way, BENDING)
    return JointControl(runs)


def whole_robot(
    robot: CatheterRobot, advance_mm: tuple[float, ...]
) -> tuple[loop.ControlRun, loop.ControlRun]:
    """Return all joints moved at once by TE alone and with PID (Section IV-B).

    Args:
        robot: of the design of the 4-DoF catheter.
        advance_mm: at the corners of `WHOLE_DEG`.
    """
    ticks = ticks_s(sum(WHOLE_LEGS_S), RATE_HZ)
    bend, turn, tube = (
        through(corners, WHOLE_LEGS_S, ticks) for corners in (WHOLE_DEG, TORSION_DEG, advance_mm)
    )
    desired = np.stack([np.radians(bend), np.radians(bend), np.radians(turn), tube * 1e-3], axis=1)
    play_m = {pair.name: DEAD_BAND_KNOWN * pair.play_m for pair in robot.tendons if pair.name == "torsion"}
    way = along(feedforward(mitral_4dof(), "te", play_m), desired)
    return _controlled(robot, desired, way, ()), _controlled(robot, desired, way, DRIVEN)


def validate_control_4dof(folder: Path) -> Validation:
    """Check the control of the catheter of Nayar 2023; draws `mitral_control_4dof.png`."""
    robot = mitral_4dof_elongation()
    control = joint_control(robot)
    control_plots.joint_control(control.runs, BENDING, folder / "mitral_control_4dof.png")
    lines = [line for joint in BENDING for line in joint_lines(control, joint)]
    lines += whole_lines(*whole_robot(robot, ADVANCE_MM))
    return Validation(tuple(lines), (_trajectory_finding(robot), _advance_finding()))


def joint_lines(control: JointControl, joint: str) -> list[Line]:
    """Return the lines of Section IV-A for a bending joint."""
    found = control.rmse_deg(joint)
    printed = FIGURE_6_DEG if joint == "bending_proximal" else {}
    source = "Nayar 2023, Section IV-A"
    lines = [
        _line(
            f"{joint}, {name}: RMSE",
            "deg",
            math.nan if p is None else abs(value - p),
            None,
            f"{source}; {_TRACKER}",
            value,
            p,
            OUT_OF_REACH,
        )
        for name, value in found.items()
        for p in [printed.get(name)]
    ]
    for above, below, kind, why in (
        ("TE", "PK", ASSUMED, "TE's error is that of an assumed slack of the tendons"),
        ("PK+PID", "PK", OUT_OF_REACH, _TRACKER),
        ("TE+PID", "TE", OUT_OF_REACH, _TRACKER),
    ):
        ratio = found[above] / found[below]
        published = printed[above] / printed[below] if printed else None
        what = f"{joint}: RMSE of {above} over {below}"
        gap = math.nan if published is None else abs(ratio - published)
        lines.append(_line(what, "-", gap, None, f"Nayar 2023, Section IV-A; {why}", ratio, published, kind))
    order = [found[name] for name in FIGURE_6_DEG]
    wrong = sum(not after < before for before, after in itertools.pairwise(order))
    what = f"{joint}: PK > TE > PK+PID > TE+PID in RMSE, neighbours out of order"
    lines.append(_line(what, "-", float(wrong), 0.0, source, float(wrong)))
    share = control.share(joint, "TE+PID")
    what = f"{joint}: controller's share of the displacement under TE"
    least, most = SHARES
    gap = max(least - share, share - most, 0.0)
    source = f"Nayar 2023, Table II: {least:g} to {most:g}; {_TRACKER}"
    lines.append(_line(f"{what}, error: outside", "-", gap, None, source, share, least, OUT_OF_REACH))
    share = control.share(joint, "PK+PID")
    what = f"{joint}: controller's share of the displacement under PK"
    return [*lines, _line(what, "-", math.nan, None, "no figure printed", share)]


def bend_control(observes: bool) -> loop.ControlRun:
    """Return the 2022 bending joint moved by its motor to `SERVO_DEG` and held there."""
    robot = mitral_transseptal()
    ticks = ticks_s(sum(SERVO_LEGS_S), RATE_HZ)
    desired = np.zeros((len(ticks), len(robot.tendons)))
    desired[:, 0] = np.radians(through((0.0, SERVO_DEG, SERVO_DEG), SERVO_LEGS_S, ticks))
    way = along(feedforward(robot, "pk"), desired)
    own = motor.Motor(gain=WEAKER * motor.NOMINAL.gain)
    servos = {"bending": motor.servo(own, observes)}
    return loop.run(Simulator(robot), desired, way, servos=servos)


def given_way_mm(robot: CatheterRobot, bend_rad: float) -> float:
    """Return by how much PD alone lets the 2022 bending joint's pair give way at a bend [mm].

    The pair's tension K theta / arm loads the pulley; its moment, as a voltage, over the proportional gain
    is the shaft's error, and gear and pulley make it the pair's.
    """
    joint = robot.segments[1]
    tension_N = joint.bending_stiffness_N_m_per_rad * bend_rad / float(arm_m(joint, bend_rad))
    shaft_rad = motor.LOAD_V_PER_NM * tension_N * motor.PULLEY_RADIUS_M / motor.pd_gains()[0]
    return shaft_rad * motor.GEAR * motor.PULLEY_RADIUS_M * 1e3


def validate_control_transseptal(folder: Path) -> Validation:
    """Check the servo of the catheter of Nayar 2022; draws `mitral_control_transseptal.png`."""
    runs = {"PD": bend_control(False), "PD + observer": bend_control(True)}
    control_plots.servo(runs, folder / "mitral_control_transseptal.png")
    alone, observed = (float(run.model_m[-1, 0] - run.displaced_m[-1, 0]) * 1e3 for run in runs.values())
    expected = given_way_mm(mitral_transseptal(), float(runs["PD"].reached[-1, 0]))
    bend_deg = SERVO_DEG - math.degrees(runs["PD"].reached[-1, 0])
    peak = max(
        1.0 / motor.modulus_margin(motor.servo(_mismatched(*factors)))
        for factors in itertools.product(MISMATCH, repeat=3)
    )
    held = f"bending held at {SERVO_DEG:g} deg by a motor of {WEAKER:g} times the nominal gain"
    source = "Nayar 2022, Section III; PD gains, supply and torque per V assumed"
    statics = "the tendon's tension through pulley, gear and proportional gain"
    error = abs(alone - expected)
    margins = "gain margin of 2, phase margin of 29 deg"
    others = "servo, motor's gain, inertia and damping off by 30 %: largest peak of the sensitivity"
    lines = (
        Line(TRANSSEPTAL, f"{held}: PD alone, pair", "mm", error, 0.01 * expected, statics, alone, expected),
        Line(TRANSSEPTAL, f"{held}: PD alone, bend", "deg", bend_deg, None, source, bend_deg),
        Line(
            TRANSSEPTAL,
            f"{held}: with the observer, pair",
            "mm",
            abs(observed),
            0.01 * alone,
            source,
            observed,
        ),
        Line(TRANSSEPTAL, others, "-", peak, 2.0, margins, peak),
    )
    reading = (
        f"{TRANSSEPTAL}: the printed G_m^-1 has Q's poles, so it is taken for Q G_m^-1; in rad of the shaft "
        "per V its speed, 21 rpm of the pulley at 6 V, is one that a 380:1 gearmotor has."
    )
    return Validation(lines, (reading,))


def _controlled(
    robot: CatheterRobot, desired: Array, model_m: Array, controlled: tuple[str, ...]
) -> loop.ControlRun:
    return loop.run(Simulator(robot), desired, model_m, feedback={name: Pid() for name in controlled})


def _line(
    what: str,
    unit: str,
    error: float,
    tolerance: float | None,
    source: str,
    ours: float | None = None,
    published: float | None = None,
    kind: str = PREDICTED,
) -> Line:
    return Line(FOUR_DOF, what, unit, error, tolerance, source, ours, None, published, kind)


def whole_lines(open_loop: loop.ControlRun, closed: loop.ControlRun) -> list[Line]:
    """Return the lines of Tables I and II, variable advance."""
    lines = []
    for k, joint in enumerate(DRIVEN):
        where = f"whole robot, variable advance, {joint}"
        alone, controlled = (float(run.rmse_deg()[k]) for run in (open_loop, closed))
        source = f"Nayar 2023, Table I; no trajectory is printed, {_TRACKER}"
        for name, ours, printed in zip(("TE", "TE+PID"), (alone, controlled), TABLE_1_DEG[k], strict=True):
            what = f"{where}, {name}: RMSE"
            gap = abs(ours - printed)
            lines.append(_line(what, "deg", gap, None, source, ours, printed, OUT_OF_REACH))
        ratio, printed = controlled / alone, TABLE_1_DEG[k][1] / TABLE_1_DEG[k][0]
        what, gap = f"{where}: RMSE of TE+PID over TE", abs(ratio - printed)
        lines.append(_line(what, "-", gap, None, source, ratio, printed, OUT_OF_REACH))
        share, printed = float(closed.controller_share()[k]), TABLE_2_SHARE[k]
        what, gap = f"{where}: controller's share under TE", abs(share - printed)
        source = f"Nayar 2023, Table II; {_TRACKER}"
        lines.append(_line(what, "-", gap, None, source, share, printed, OUT_OF_REACH))
    return lines


def _mismatched(gain: float, inertia: float, damping: float) -> motor.Motor:
    nominal = motor.NOMINAL
    return motor.Motor(gain * nominal.gain, inertia * nominal.inertia, damping * nominal.damping)


def _trajectory_finding(robot: CatheterRobot) -> str:
    corners = ", ".join(f"{corner:g}" for corner in CORNERS_DEG)
    legs = ", ".join(f"{leg:g}" for leg in LEGS_S)
    return (
        f"{robot.name}: both bending joints go through {corners} deg in {legs} s, half waves of a cosine, "
        f"controlled at {RATE_HZ:g} Hz without tracker noise. TE knows neither slack nor friction nor the "
        "cycle effects; PK knows no elongation either. The dead-band that torsion compensates is assumed "
        f"to be known to {DEAD_BAND_KNOWN:g} of it."
    )


def _advance_finding() -> str:
    return (
        f"{FOUR_DOF}: the simulated tube adds no stiffness with its advance and the robot has no weight, so "
        "that Table I's rows of 0, 10 and 20 mm would be one; what differs between them in the paper has no "
        "cause here."
    )
