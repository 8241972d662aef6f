"""Control of a simulated catheter: desired motions, feedforward, feedback by a tracker, at a rate."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.controllers import motors as motor
from catheter_sim.controllers.motors import FEEDBACK_HZ as RATE_HZ
from catheter_sim.controllers.motors import Pid
from catheter_sim.errors import InputError, unknown
from catheter_sim.progress import counted
from catheter_sim.robots import KINDS, kind_of
from catheter_sim.robots.catheter.description import is_four_dof, is_transseptal, moved_segment, moving
from catheter_sim.robots.catheter.kinematics import inverse, pulled_m
from catheter_sim.robots.catheter.measured import (
    BENDING,
    TORSION_DISTAL,
    TORSION_PROXIMAL,
    BendingCalibration,
    Side,
    StretchingJoint,
    TorsionCalibration,
    bent_to,
    stretching_joints,
)
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.simulation.simulator import Simulator

# ----------------------------------------------------------------------------------------------------
# Desired joint values over time.


def ticks_s(duration_s: float, rate_hz: float) -> Array:
    """Return the ticks from 0 to the duration, shape (r,) [s]."""
    return np.arange(round(duration_s * rate_hz) + 1) / rate_hz


def through(corners: Sequence[float], legs_s: Sequence[float], at_s: Array) -> Array:
    """Return values that move from corner to corner in half waves of a cosine, at rest at each, shape (r,).

    The c `corners` are c - 1 legs apart in time; after the last corner the value stays there.
    """
    ends = np.cumsum(legs_s)
    leg = np.minimum(np.searchsorted(ends, at_s, side="right"), len(legs_s) - 1)
    length = np.asarray(legs_s, dtype=float)[leg]
    share = np.clip((at_s - (ends[leg] - length)) / length, 0.0, 1.0)
    corner = np.asarray(corners, dtype=float)
    return corner[leg] + (corner[leg + 1] - corner[leg]) * 0.5 * (1.0 - np.cos(np.pi * share))


# ----------------------------------------------------------------------------------------------------
# A tracker at the tool, whose orientation gives the joint angles, in a frame that may be turned.
#
# Nayar 2023, Section IV-B: the electromagnetic tracker sits on the end effector, its pose is taken into the
# robot's base frame, and Eqs 8-10 make joint angles of the orientation. So it also sees what is no joint
# angle: a tube that droops under the weight that it carries, and a base frame that is not aligned with the
# field generator's, which the paper names among the causes of its errors.


@dataclass(frozen=True)
class ToolTracker:
    """Joint angles from the tool's orientation, with noise."""

    robot: CatheterRobot  # what the controller takes the robot for: of a design with an inverse kinematics
    noise_rad: float  # standard deviation of every angle at every tick, white [rad]
    generator: np.random.Generator  # draws the noise
    # By which the tracker's frame is turned from the robot's base frame, as a rotation vector in the base
    # frame, shape (3,) [rad].
    frame_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def measured(self, simulator: Simulator, values: Array, turns: np.ndarray) -> Array:
        """Return joint values as they are measured, in the order of the pairs, shape (t,) [rad or m].

        Of both branches of the inverse kinematics the nearer to the true `values` is taken; what does not
        turn, an advance, is measured exactly.
        """
        found = tool_angles(self.robot, simulator.posture().R_w[-1], values, self.frame_rad)
        noise = self.noise_rad * self.generator.standard_normal(len(values))
        return np.where(turns, found + noise, values)


def tool_angles(
    robot: CatheterRobot, R_tool: Array, values: Array, frame_rad: tuple[float, float, float]
) -> Array:
    """Return the joint values of a tool's orientation, in the order of the pairs, shape (t,).

    An advance is no matter of orientation: its entry says nothing. The answer is sought near `values`, (t,);
    `R_tool` is in the base frame, from which the tracker's is turned by a rotation vector.
    """
    tool = np.eye(4)
    tool[:3, :3] = Rotation.from_rotvec(frame_rad).as_matrix().T @ R_tool
    order = [moving(robot).index(moved_segment(robot, pair)) for pair in range(len(robot.tendons))]
    branches = [branch[order] for branch in inverse(robot, tool).branches]
    turns = [robot.segments[moved_segment(robot, pair)].joint != "prismatic" for pair in range(len(order))]

    def apart(branch: Array) -> float:
        turned = np.remainder(branch - values + np.pi, 2.0 * np.pi) - np.pi
        return float(np.abs(turned[turns]).sum())

    return np.asarray(min(branches, key=apart))


# ----------------------------------------------------------------------------------------------------
# Feedforward: from a desired joint angle to the displacement of its pair, step by step.
#
#     pk  Nayar 2022, Eqs 3, 6; 2023, Eqs 12-13: no history
#     te  2023, Section III-A.4: Eq. 12 plus the tendon's elongation, simplified law (phi = 1, beta = 0);
#         torsion by Eq. 13 with its dead-band compensated (Section IV-B)
#     mk  2022, Eqs 25-26 solved for the displacement, dead-bands of the torsion joints included
#
# What a joint has been through counts, so each has an object with a history. An advance is as desired.

MODELS = ("pk", "te", "mk")


class JointFeedforward(Protocol):
    """The feedforward of one joint."""

    def displacement_m(self, value: float) -> float:
        """Return the displacement for the next desired angle [rad] or advance [m]."""
        ...


class Advance:
    """A tube: pushed as desired."""

    def displacement_m(self, value: float) -> float:
        return value


class Pure:
    """Pure kinematics of a joint, and compensation of a known dead-band between drive and joint.

    Half of the dead-band is added in the direction in which the joint moves, and kept while it stands.
    """

    def __init__(self, segment: CatheterSegment, dead_band_m: float = 0.0) -> None:
        self._segment, self._half_m = segment, 0.5 * dead_band_m
        self._before_rad, self._direction = 0.0, 0.0

    def displacement_m(self, value: float) -> float:
        if value != self._before_rad:
            self._direction = math.copysign(1.0, value - self._before_rad)
        self._before_rad = value
        return float(pulled_m(self._segment, value)) + self._half_m * self._direction


class Stretching:
    """A bending joint with stretching tendons, new at the start: TE."""

    def __init__(self, joint: StretchingJoint) -> None:
        self._joint = joint
        self._sides = [Side(), Side()]
        self._pulled = 0  # the side that bends, or bent last

    def displacement_m(self, value: float) -> float:
        angle_deg = math.degrees(value)
        if angle_deg != 0.0:
            self._pulled = 0 if angle_deg > 0.0 else 1
        ways = []
        for index, sign in enumerate((1.0, -1.0)):
            self._sides[index], way = bent_to(self._joint, self._sides[index], max(sign * angle_deg, 0.0))
            ways.append(sign * way)
        return ways[self._pulled]


class ModifiedBending:
    """Nayar 2022, Eq. 25 solved for the displacement: two lines, no history.

    For bends to the + side alone, and from the -4.2 deg on that Eq. 25 has at no displacement: 0 below them.
    """

    def __init__(self, segment: CatheterSegment, calibration: BendingCalibration = BENDING) -> None:
        self._arm_mm, self._calibration = segment.arm_m * 1e3, calibration

    def displacement_m(self, value: float) -> float:
        alphas, betas = self._calibration.alpha, self._calibration.beta_mm
        first, second = (
            1e-3 * (alpha * self._arm_mm * math.degrees(value) + beta)
            for alpha, beta in zip(alphas, betas, strict=True)
        )
        turn = self._calibration.turn_m
        return max(first, 0.0) if first <= turn else max(second, turn)


class ModifiedTorsion:
    """Nayar 2022, Eq. 26 solved for the displacement: the branch of the direction of motion.

    Angles beyond the plateaus cannot be had; the nearer plateau is aimed at.
    """

    def __init__(self, segment: CatheterSegment, calibration: TorsionCalibration) -> None:
        self._segment, self._calibration = segment, calibration
        self._before_rad, self._loading = calibration.lower_rad, True

    def displacement_m(self, value: float) -> float:
        calibration = self._calibration
        angle = min(max(value, calibration.lower_rad), calibration.upper_rad)
        if angle != self._before_rad:
            self._loading = angle > self._before_rad
        self._before_rad = angle
        if angle == calibration.lower_rad:
            return 0.0
        pure = float(pulled_m(self._segment, angle - calibration.lower_rad))
        return pure + (calibration.width_m if self._loading else 0.0)


def feedforward(
    robot: CatheterRobot, model: str, dead_band_m: Mapping[str, float] | None = None
) -> list[JointFeedforward]:
    """Return the feedforward of every pair, in the order of the robot that the controller takes it for.

    Tendons are new and at rest, `model` is of `MODELS`. Whole dead-bands are compensated, by name of a
    torsion joint's pair; not of "mk", which has its own.

    Raises:
        InputError: the model is unknown or not of this robot's design, or a dead-band has no such pair.
    """
    if model not in MODELS:
        raise unknown("feedforward", model, MODELS)
    if (model == "te" and not is_four_dof(robot)) or (model == "mk" and not is_transseptal(robot)):
        raise InputError(f"{robot.name}: feedforward {model!r} is of another design of catheter")
    bands = dict(dead_band_m or {})
    pairs = {pair.name: robot.segments[moved_segment(robot, k)] for k, pair in enumerate(robot.tendons)}
    turns = [name for name, segment in pairs.items() if segment.joint == "torsion" and model != "mk"]
    for name in bands:
        if name not in turns:
            raise unknown("pair with a dead-band", name, turns, f"{robot.name}: feedforward {model!r}")
    stretching = stretching_joints(robot) if model == "te" else {}
    return [
        _of_pair(segment, stretching.get(name), model, bands.get(name, 0.0), robot)
        for name, segment in pairs.items()
    ]


def along(joints: list[JointFeedforward], desired: Array) -> Array:
    """Return the displacements along desired angles and advances, both (r, t), in the order of the pairs [m].

    The `joints`, of `feedforward`, go on from where they are.
    """
    columns = [
        [joint.displacement_m(float(value)) for value in desired[:, k]] for k, joint in enumerate(joints)
    ]
    return np.array(columns).T


def _of_pair(
    segment: CatheterSegment,
    stretching: StretchingJoint | None,
    model: str,
    dead_band_m: float,
    robot: CatheterRobot,
) -> JointFeedforward:
    if segment.joint == "prismatic":
        return Advance()
    if stretching is not None:
        return Stretching(stretching)
    if model != "mk":
        return Pure(segment, dead_band_m)
    if segment.joint == "bending":
        return ModifiedBending(segment)
    first = segment is robot.segments[0]
    return ModifiedTorsion(segment, TORSION_PROXIMAL if first else TORSION_DISTAL)


# ----------------------------------------------------------------------------------------------------
# Control of a simulated catheter: feedforward, feedback and motors against the simulator, at a rate.
#
# At every tick the tracker gives the joint angles, feedforward and PID add up to a displacement, and the
# pairs move evenly until they are there at the next tick: held instead, every tick would jerk the tendons,
# and a tendon with a history counts jerks as load cycles. The desired angle is the tick's own. The angles
# are those that the papers take out of the tool's orientation (Nayar 2023, Eqs 8-10): each joint's whole
# turn.

_WHOLE = 1e-6  # share of a period by which a tick may miss the simulation's steps


@dataclass(frozen=True)
class ControlRun:
    """A controlled motion; columns in the order of the robot's pairs."""

    robot: str  # name of what was simulated
    joints: tuple[str, ...]  # how the joint of each pair moves: "torsion", "bending" or "prismatic"
    times_s: Array  # ticks, shape (r,)
    desired: Array  # joint values, shape (r, t) [rad or m]
    reached: Array
    model_m: Array  # displacement by feedforward and by feedback, shape (r, t)
    controller_m: Array
    displaced_m: Array  # of the pairs at the tick's end, shape (r, t); their sum but for the motors' lag
    # Joint values as the tracker gave them, shape (r, t) [rad or m]; None: exact.
    measured: Array | None = None

    def rmse_deg(self) -> Array:
        """Return the root mean square error of every joint, shape (t,) [deg]; NaN of an advance."""
        return self._rmse_deg(self.reached)

    def seen_rmse_deg(self) -> Array:
        """Return the same of what the tracker gave, as an experiment knows it."""
        return self._rmse_deg(self.reached if self.measured is None else self.measured)

    def _rmse_deg(self, values: Array) -> Array:
        rmse = np.degrees(np.sqrt(((values - self.desired) ** 2).mean(axis=0)))
        return np.where([joint == "prismatic" for joint in self.joints], np.nan, rmse)

    def controller_share(self) -> Array:
        """Return the controller's share of the displacement, shape (t,), 0 to 1; NaN where nothing moves.

        mean |controller| / (mean |model| + mean |controller|) over the ticks: the reading of Nayar 2023,
        Table II, whose two columns sum to 1 in every row.
        """
        model, controller = (np.abs(part).mean(axis=0) for part in (self.model_m, self.controller_m))
        whole = model + controller
        return np.divide(controller, whole, out=np.full(whole.shape, np.nan), where=whole > 0.0)


@dataclass(frozen=True)
class Tracker:
    """What measures the joint angles."""

    noise_rad: float  # standard deviation of every angle at every tick, white [rad]
    generator: np.random.Generator  # draws the noise
    # What every angle is measured too large, by a tracker whose frame is turned [rad].
    offset_rad: float = 0.0

    def measured(self, simulator: Simulator, values: Array, turns: np.ndarray) -> Array:
        """Return joint values as they are measured, shape (t,); those that are no turns are exact."""
        noise = self.noise_rad * self.generator.standard_normal(len(values))
        return values + np.where(turns, self.offset_rad + noise, 0.0)


def joint_kinds_of(simulator: Simulator) -> tuple[str, ...]:
    """Return how the joint of each pair moves: "torsion", "bending" or "prismatic"."""
    kinds: tuple[str, ...] = _joints_of(simulator).joint_kinds(simulator.robot)
    return kinds


def run(
    simulator: Simulator,
    desired: Array,
    model_m: Array,
    rate_hz: float = RATE_HZ,
    feedback: Mapping[str, Pid] | None = None,
    tracker: Tracker | ToolTracker | None = None,
    servos: Mapping[str, motor.Servo] | None = None,
    force_tip_N: Sequence[float] = (0.0, 0.0, 0.0),
    progress: str = "",
) -> ControlRun:
    """Control a robot from rest along desired joint values.

    Args:
        simulator: of a catheter; it is reset first.
        desired: angles and advances, one row a tick, shape (r, t) [rad or m].
        model_m: the feedforward's displacements (`along`), shape (r, t).
        rate_hz: ticks per second; whole steps of the simulation must fit into a tick.
        feedback: the controller of each pair that has one, by the pair's name; they are reset.
        tracker: what measures the joint values; None: exact.
        servos: the motor of each pair that has one, by the pair's name; others follow at once.
        force_tip_N: on the tip, base frame, shape (3,).
        progress: what to call the run on standard error, where its ticks are counted; empty: nowhere.

    Raises:
        InputError: the robot is no catheter, a name is not one of its pairs, shapes or rates do not
            fit, or a displacement is beyond a joint's range.
    """
    robot, face = simulator.robot, _joints_of(simulator)
    names = [pair.name for pair in robot.tendons]
    controllers, motors = dict(feedback or {}), dict(servos or {})
    for name in [*controllers, *motors]:
        if name not in names:
            raise unknown("pair", name, names, robot.name)
    if desired.shape != model_m.shape or desired.ndim != 2 or desired.shape[1] != len(names):
        raise InputError(
            f"{robot.name}: desired values of shape {desired.shape} and displacements of shape "
            f"{model_m.shape}: both must be (rows, {len(names)})"
        )
    step_s = float(simulator.model.opt.timestep)
    steps = _fitting(1.0 / rate_hz, step_s, f"a tick at {rate_hz:g} Hz")
    if motors:
        _fitting(step_s, 1.0 / next(iter(motors.values())).rate_hz, "a step of the simulation")
    simulator.reset()
    for controller in controllers.values():
        controller.reset()
    addresses = face.joint_matrix(robot, simulator.model)
    states = {name: motor.at_rest() for name in motors}
    before = np.zeros(len(names))
    reached, measured, feedback_m, displaced_m = (np.zeros(desired.shape) for _ in range(4))
    joints = face.joint_kinds(robot)
    turns = np.array([joint != "prismatic" for joint in joints])
    rows = len(desired)
    for row in counted(range(rows), rows, progress, "tick", bool(progress)):
        reached[row] = addresses @ simulator.data.qpos
        seen = reached[row] if tracker is None else tracker.measured(simulator, reached[row], turns)
        measured[row] = seen
        for k, name in enumerate(names):
            if name in controllers:
                feedback_m[row, k] = controllers[name].correction_m(desired[row, k] - seen[k])
        asked = model_m[row] + feedback_m[row]
        for step in range(1, steps + 1):
            displaced = before + (asked - before) * step / steps
            for name, state in states.items():
                k = names.index(name)
                load = _load_Nm(simulator, k, motor.pulley_rad(state))
                states[name], displaced[k] = _turned(motors[name], state, displaced[k], load, step_s)
            simulator.set_inputs(displaced, force_tip_N)
            simulator.step()
        before = asked
        displaced_m[row] = displaced
        simulator.require_finite()
    ticks = np.arange(len(desired)) / rate_hz
    return ControlRun(robot.name, joints, ticks, desired, reached, model_m, feedback_m, displaced_m, measured)


def _joints_of(simulator: Simulator) -> Any:
    kind = kind_of(simulator.robot)
    if not kind.has("joint_control"):
        having = [name for name, other in KINDS.items() if other.has("joint_control")]
        kinds = " and ".join(repr(name) for name in having)
        raise InputError(f"{simulator.robot.name}: joint control is of robots of kind {kinds} alone")
    return kind.face("joint_control", "joint control")


def _fitting(whole_s: float, part_s: float, what: str) -> int:
    """Return how often `part_s` fits into `whole_s`."""
    count = round(whole_s / part_s)
    if count < 1 or not math.isclose(count * part_s, whole_s, rel_tol=_WHOLE):
        raise InputError(f"{what} is {whole_s * 1e3:g} ms: must be a whole number of {part_s * 1e3:g} ms")
    return count


def _load_Nm(simulator: Simulator, pair: int, displacement_m: float) -> float:
    """Return the moment of a pair's tendons on its pulley, against the positive direction [N m].

    The tauter tendon is taken to be the one that is pulled. Its tension is that after the step, with the
    joint where it has gone: in the step itself a stiff tendon is stretched by the whole way of its drive.
    """
    mujoco.mj_fwdPosition(simulator.model, simulator.data)
    tension_N = float(simulator.actuator_tension()[pair])
    return motor.PULLEY_RADIUS_M * math.copysign(tension_N, displacement_m)


def _turned(
    servo: motor.Servo, state: Array, displacement_m: float, load_Nm: float, duration_s: float
) -> tuple[Array, float]:
    """Return a servo's state after the duration under a steady reference and load, and its displacement."""
    reference_rad = motor.reference_rad(displacement_m)
    for _ in range(round(duration_s * servo.rate_hz)):
        state = motor.advanced(servo, state, reference_rad, load_Nm)
    return state, motor.pulley_rad(state) * motor.PULLEY_RADIUS_M
