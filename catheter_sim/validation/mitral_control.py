"""Checks of the mitral catheters' control (Nayar 2022, Section III; Nayar 2023, Section IV-A).

2023. The robot is `mitral_4dof@measured`: tendons and joints by the printed Algorithms 1 and 2, cycle
effects included, dead-bands and friction; its slack is fitted to the error that the feedforward with
elongation leaves. The controller takes it for the nominal one: TE has the simplified law (phi = 1, beta =
0), and neither slack nor friction. A tracker at the tool gives the angles, with noise and in a frame that is
turned; errors are those that it sees, as in the paper. The paper prints no trajectory, so that only the
order of the models is judged; the digits stand beside. Both bending joints follow `CORNERS_DEG`, in half
waves of a cosine. They stay above 10 deg: Algorithm 2 asks the proximal tendon for no tension below 3.4 deg,
so that nothing there determines the bend. All joints at once: `mitral_whole`.

2022. A motor whose gain is 0.8 of the nominal one moves the bending joint of `mitral_transseptal`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.controllers import loop, motor
from catheter_sim.controllers.feedforward import along, feedforward
from catheter_sim.controllers.pid import RATE_HZ, Pid
from catheter_sim.controllers.tool_tracker import ToolTracker
from catheter_sim.controllers.trajectories import through, ticks_s
from catheter_sim.robots.catheter.kinematics import arm_m
from catheter_sim.robots.catheter.published import mitral_4dof, mitral_4dof_measured, mitral_transseptal
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.validation import control_plots
from catheter_sim.validation.lines import FITTED, OUT_OF_REACH, PREDICTED, Line, Validation

FOUR_DOF, TRANSSEPTAL = "mitral_4dof", "mitral_transseptal"
BENDING = ("bending_proximal", "bending_distal")
DRIVEN = (*BENDING, "torsion")
CORNERS_DEG, LEGS_S = (0.0, 10.0, 40.0, 10.0, 60.0, 10.0), (5.0, 15.0, 15.0, 20.0, 20.0)
ACROSS_MPS2 = (9.81, 0.0, 0.0)  # a robot that lies, bending first along its weight: assumed
# Of the tracker, assumed: the paper prints neither, and names a frame that is not aligned as a cause of
# error.
NOISE_DEG, FRAME_DEG, FRAME_AXIS, SEED = 0.3, 2.0, (1.0, 1.0, 1.0), 8
TRACKER_TEXT = f"tracker of {NOISE_DEG:g} deg noise in a frame turned by {FRAME_DEG:g} deg, assumed"
FIGURE_6_DEG = {"PK": 21.0, "TE": 4.8, "PK+PID": 2.53, "TE+PID": 0.88}  # proximal; in the order of size
WEAKER = 0.8  # the 2022 motor's gain over the nominal one
SERVO_DEG, SERVO_LEGS_S = 60.0, (2.0, 2.0)
MISMATCH = (0.7, 1.0, 1.3)


@dataclass(frozen=True)
class JointControl:
    """The four runs of Section IV-A by name: "PK", "TE", "PK+PID", "TE+PID"."""

    runs: Mapping[str, loop.ControlRun]

    def rmse_deg(self, joint: str) -> dict[str, float]:
        """Return the runs' root mean square errors of a joint, as the tracker sees it [deg]."""
        k = DRIVEN.index(joint)
        return {name: float(run.seen_rmse_deg()[k]) for name, run in self.runs.items()}

    def share(self, joint: str, run: str) -> float:
        """Return the controller's share of a joint's displacement in a run."""
        return float(self.runs[run].controller_share()[DRIVEN.index(joint)])


def tracker() -> ToolTracker:
    """Return the tracker of the control runs, its noise from the start."""
    size = math.radians(FRAME_DEG) / math.hypot(*FRAME_AXIS)
    x, y, z = (size * part for part in FRAME_AXIS)
    return ToolTracker(mitral_4dof(), math.radians(NOISE_DEG), np.random.default_rng(SEED), (x, y, z))


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


def validate_control_4dof(folder: Path) -> Validation:
    """Check the control of the catheter of Nayar 2023; draws `mitral_control_4dof.png`."""
    robot = mitral_4dof_measured()
    control = joint_control(robot)
    control_plots.joint_control(control.runs, BENDING, folder / "mitral_control_4dof.png")
    lines = [line for joint in BENDING for line in joint_lines(control, joint)]
    return Validation(tuple(lines), (_trajectory_finding(robot),))


def joint_lines(control: JointControl, joint: str) -> list[Line]:
    """Return the lines of Section IV-A for a bending joint; digits are printed of the proximal one alone."""
    found = control.rmse_deg(joint)
    printed = FIGURE_6_DEG if joint == "bending_proximal" else {}
    source = "Nayar 2023, Section IV-A"
    lines = []
    for name, value in found.items():
        theirs, what = printed.get(name), f"{joint}, {name}: RMSE"
        fitted = name == "TE" and theirs is not None
        why = (
            f"{source}; slack is fitted to it"
            if fitted
            else f"{source}; no trajectory is printed; {TRACKER_TEXT}"
        )
        kind = FITTED if fitted else OUT_OF_REACH
        lines.append(_line(what, "deg", _gap(value, theirs), None, why, value, theirs, kind))
    for above, below in (("TE", "PK"), ("PK+PID", "PK"), ("TE+PID", "TE")):
        ratio = found[above] / found[below]
        theirs = printed[above] / printed[below] if printed else None
        what = f"{joint}: RMSE of {above} over {below}"
        why = f"{source}; no trajectory is printed; {TRACKER_TEXT}"
        lines.append(_line(what, "-", _gap(ratio, theirs), None, why, ratio, theirs, OUT_OF_REACH))
    order = [found[name] for name in FIGURE_6_DEG]
    wrong = sum(not after < before for before, after in itertools.pairwise(order))
    what = f"{joint}: PK > TE > PK+PID > TE+PID in RMSE, neighbours out of order"
    why = f"{source}; shown, not judged: no model that is wrong by a fifth changes it"
    lines.append(_line(what, "-", float(wrong), None, why, float(wrong)))
    for model in ("TE", "PK"):
        share = control.share(joint, f"{model}+PID")
        what = f"{joint}: controller's share of the displacement under {model}"
        lines.append(_line(what, "-", math.nan, None, "no figure printed of one joint alone", share))
    return lines


def _gap(ours: float, printed: float | None) -> float:
    return math.nan if printed is None else abs(ours - printed)


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
    unmoved = "shown, not judged: no robot that is wrong by a fifth changes it"
    margins = f"2 is a gain margin of 2, a phase margin of 29 deg; {unmoved}"
    others = "servo, motor's gain, inertia and damping off by 30 %: largest peak of the sensitivity"
    lines = (
        Line(TRANSSEPTAL, f"{held}: PD alone, pair", "mm", error, 0.01 * expected, statics, alone, expected),
        Line(TRANSSEPTAL, f"{held}: PD alone, bend", "deg", bend_deg, None, source, bend_deg),
        Line(
            TRANSSEPTAL,
            f"{held}: with the observer, pair",
            "mm",
            abs(observed),
            None,
            f"{source}; {unmoved}",
            observed,
        ),
        Line(TRANSSEPTAL, others, "-", peak, None, margins, peak),
    )
    reading = (
        f"{TRANSSEPTAL}: the printed G_m^-1 has Q's poles, so it is taken for Q G_m^-1; in rad of the shaft "
        "per V its speed, 21 rpm of the pulley at 6 V, is one that a 380:1 gearmotor has."
    )
    return Validation(lines, (reading,))


def _controlled(
    robot: CatheterRobot, desired: Array, model_m: Array, controlled: tuple[str, ...]
) -> loop.ControlRun:
    feedback = {name: Pid() for name in controlled}
    return loop.run(Simulator(robot), desired, model_m, feedback=feedback, tracker=tracker())


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


def _mismatched(gain: float, inertia: float, damping: float) -> motor.Motor:
    nominal = motor.NOMINAL
    return motor.Motor(gain * nominal.gain, inertia * nominal.inertia, damping * nominal.damping)


def _trajectory_finding(robot: CatheterRobot) -> str:
    corners = ", ".join(f"{corner:g}" for corner in CORNERS_DEG)
    legs = ", ".join(f"{leg:g}" for leg in LEGS_S)
    return (
        f"{robot.name}: both bending joints go through {corners} deg in {legs} s, half waves of a cosine, "
        f"controlled at {RATE_HZ:g} Hz by a {TRACKER_TEXT}. TE knows neither slack nor friction nor the "
        "cycle "
        "effects; PK knows no elongation either."
    )
