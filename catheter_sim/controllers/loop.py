"""Control of a simulated catheter: feedforward, feedback and motors against the simulator, at a rate.

At every tick the tracker gives the joint angles, feedforward and PID add up to a displacement, and the
pairs move evenly until they are there at the next tick: held instead, every tick would jerk the tendons,
and a tendon with a history counts jerks as load cycles. The desired angle is the tick's own. The angles
are those that the papers take out of the tool's orientation (Nayar 2023, Eqs 8-10): each joint's whole
turn.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.controllers import motor
from catheter_sim.controllers.pid import RATE_HZ, Pid
from catheter_sim.errors import InputError, unknown
from catheter_sim.progress import counted
from catheter_sim.robots import KINDS, kind_of
from catheter_sim.simulation.simulator import Simulator

_WHOLE = 1e-6  # share of a period by which a tick may miss the simulation's steps


@dataclass(frozen=True)
class ControlRun:
    """A controlled motion; columns in the order of the robot's pairs.

    Attributes:
        robot: name of what was simulated.
        joints: how the joint of each pair moves: "torsion", "bending" or "prismatic".
        times_s: ticks, shape (r,).
        desired, reached: joint values, shape (r, t) [rad or m].
        model_m, controller_m: displacement by feedforward and by feedback, shape (r, t).
        displaced_m: of the pairs at the tick's end, shape (r, t); their sum but for the motors' lag.
        measured: joint values as the tracker gave them, shape (r, t) [rad or m]; None: exact.
    """

    robot: str
    joints: tuple[str, ...]
    times_s: Array
    desired: Array
    reached: Array
    model_m: Array
    controller_m: Array
    displaced_m: Array
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


class Sensor(Protocol):
    """What gives the controller the joint values at a tick."""

    def seen(self, simulator: Simulator, values: Array, turns: np.ndarray) -> Array:
        """Return the values as measured, shape (t,) [rad or m]; `values` are true, `turns` says which "
        "turn."""


@dataclass(frozen=True)
class Tracker:
    """What measures the joint angles.

    Attributes:
        noise_rad: standard deviation of every angle at every tick, white [rad].
        generator: draws the noise.
        offset_rad: what every angle is measured too large, by a tracker whose frame is turned [rad].
    """

    noise_rad: float
    generator: np.random.Generator
    offset_rad: float = 0.0

    def measured(self, values: Array, turns: np.ndarray) -> Array:
        """Return joint values as they are measured, shape (t,); those that are no turns are exact."""
        noise = self.noise_rad * self.generator.standard_normal(len(values))
        return values + np.where(turns, self.offset_rad + noise, 0.0)

    def seen(self, simulator: Simulator, values: Array, turns: np.ndarray) -> Array:
        """Return the same; of the robot no more is needed."""
        return self.measured(values, turns)


def joint_values(simulator: Simulator) -> Array:
    """Return the values of the joints in the order of the pairs, shape (t,) [rad or m]."""
    return np.asarray(
        _joints_of(simulator).joint_matrix(simulator.robot, simulator.model) @ simulator.data.qpos
    )


def joint_kinds_of(simulator: Simulator) -> tuple[str, ...]:
    """Return how the joint of each pair moves: "torsion", "bending" or "prismatic".

    Raises:
        InputError: the robot is no catheter.
    """
    kinds: tuple[str, ...] = _joints_of(simulator).joint_kinds(simulator.robot)
    return kinds


def run(
    simulator: Simulator,
    desired: Array,
    model_m: Array,
    rate_hz: float = RATE_HZ,
    feedback: Mapping[str, Pid] | None = None,
    tracker: Sensor | None = None,
    servos: Mapping[str, motor.Servo] | None = None,
    force_tip_N: Sequence[float] = (0.0, 0.0, 0.0),
    progress: str = "",
) -> ControlRun:
    """Control a robot from rest along desired joint values.

    Args:
        simulator: of a catheter; it is reset first.
        desired: angles and advances, one row a tick, shape (r, t) [rad or m].
        model_m: the feedforward's displacements (`feedforward.along`), shape (r, t).
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
        seen = reached[row] if tracker is None else tracker.seen(simulator, reached[row], turns)
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
