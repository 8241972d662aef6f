"""Motors and their control: gearmotors, lead screws, PID."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import signal

from catheter_sim.arrays import Array

# ----------------------------------------------------------------------------------------------------
# A motor with a gearbox and a screw that pulls a tendon's holder (Nayar 2023, Section II-B).
#
# The paper gives the gears (64:1 of a bending joint's motor, 100:1 of the tube's and the torsion's) and
# that the tube's carriage rides on a lead screw; neither leads nor efficiencies nor motors' torques are
# printed.


@dataclass(frozen=True)
class LeadScrew:
    """A screw behind a gearbox."""

    gear: float  # turns of the motor a turn of the screw
    lead_m: float = 2e-3  # way of the nut a turn [m]; assumed
    diameter_m: float = 5e-3  # of the thread's middle [m]; assumed
    friction: float = 0.2  # coefficient between nut and screw; assumed: bronze on steel, dry
    gear_efficiency: float = 0.7  # assumed
    counts: int = 48  # of the encoder a turn of the motor; assumed

    @property
    def locks_itself(self) -> bool:
        """Whether a pull on the nut alone cannot turn the screw: the tendon's tension then moves no motor."""
        return self.lead_m < math.pi * self.diameter_m * self.friction

    @property
    def step_m(self) -> float:
        """Way of the nut a count of the encoder [m]."""
        return self.lead_m / (self.gear * self.counts)

    def torque_Nm(self, tension_N: float) -> float:
        """Return the motor's torque that pulls a tension up, thread's and gearbox's losses included [N m]."""
        rise = math.atan(self.lead_m / (math.pi * self.diameter_m))
        at_screw = 0.5 * self.diameter_m * tension_N * math.tan(rise + math.atan(self.friction))
        return at_screw / (self.gear * self.gear_efficiency)

    def speed_rpm(self, nut_m_per_s: float) -> float:
        """Return the motor's speed for a speed of the nut [turns a minute]."""
        return 60.0 * self.gear * nut_m_per_s / self.lead_m


BENDING_GEAR, ADVANCE_GEAR = 64.0, 100.0  # Nayar 2023, Section II-B


# ----------------------------------------------------------------------------------------------------
# The gearmotor that turns a pulley, its nominal model and its servo (Nayar 2022, Section III, Fig. 5).
#
# A motor shaft turns a pulley of radius r_p through a gear, K_g = 1/380; the pair's tension loads it. The
# servo holds the reference pulley angle with proportional-derivative control and a disturbance observer:
#
# u = PD(reference - shaft) - d, d = Q G_m^-1 shaft - Q u (Fig. 5)
#
# so that d is what acts beside u, seen through the low-pass Q.
#
# Readings. The printed "G_m^-1 = (0.3948 s^2 + 1.1153 s)/(0.04 s^2 + 4.97 s + 156.14)" is Q G_m^-1: its
# denominator is 156.14/3.9478 = 39.55 times that of the printed Q, (0.001 s^2 + 0.1257 s + 3.9478), term by
# term within the print's digits (0.0396, 4.971, 156.14). So G_m = 156.14/(0.3948 s^2 + 1.1153 s), and Q is
# a double low-pass at 62.8 rad/s, 10 Hz.
#
# Units are not printed. Read as rad of the motor shaft per V, G_m's steady speed is 140 rad/s per V: 21 rpm
# of the pulley at 6 V, 0.6 of the 35 rpm at which a low-power 6 V gearmotor of this size and 380:1 idles by
# its maker's table. Read as degrees of the pulley per V it would be 140 rpm, and none of them is so fast.
# The time constant, 0.35 s, is long for a bare motor in either unit.
#
# Not printed and assumed: the PD gains, by pole placement on G_m (`pd_gains`); the supply; the torque per
# V.

GEAR = 1.0 / 380.0  # K_g, Fig. 5
PULLEY_RADIUS_M = 7.19e-3  # Section II-A
RATE_HZ = 1000.0  # of the servo; not printed
SUPPLY_V = 6.0  # assumed
# Assumed: a low-power gearmotor of this size and 380:1 stalls at some 0.245 N m (2.5 kg cm) at 6 V.
LOAD_V_PER_NM = 6.0 / 0.245
# Q: numerator and denominator, from the highest power of s.
Q_NUMERATOR, Q_DENOMINATOR = (3.9478,), (0.001, 0.1257, 3.9478)
BANDWIDTH_RAD_PER_S = 15.0  # of the PD loop on G_m; assumed, a quarter of Q's
_RATE_FILTER_S = 1.0 / (2.0 * math.pi * 100.0)  # of the PD's derivative


@dataclass(frozen=True)
class Motor:
    """gain/(inertia s^2 + damping s), from V to rad of the motor shaft; the defaults are G_m."""

    gain: float = 156.14
    inertia: float = 0.3948
    damping: float = 1.1153


NOMINAL = Motor()


@dataclass(frozen=True)
class Block:
    """A linear block in discrete time: x' = A x + B u, y = C x + D u; one input, one output."""

    A: Array
    B: Array
    C: Array
    D: float


@dataclass(frozen=True)
class Servo:
    """A motor and the controller that turns it, in discrete time.

    Its state, shape (7,): shaft angle [rad] and speed [rad/s] of the motor, then the states of the
    filtered derivative, of Q and of Q G_m^-1.
    """

    rate_hz: float  # of the controller
    proportional: float  # [V/rad]
    plant: Block  # the motor itself, its input held over a period
    derivative: Block  # of the PD, filtered [V]
    low_pass: Block  # Q; its input is held, so that it needs no input of the same instant
    inverse: Block  # Q G_m^-1, by Tustin's rule
    observes: bool  # whether what the observer finds is taken off


def transfer_function(motor: Motor) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return numerator and denominator from V to rad of the shaft, from the highest power of s."""
    return (motor.gain,), (motor.inertia, motor.damping, 0.0)


def filtered_inverse(motor: Motor) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return numerator and denominator of Q G_m^-1, from rad of the shaft to V."""
    numerator, denominator = transfer_function(motor)
    return tuple(np.polymul(Q_NUMERATOR, denominator)), tuple(np.polymul(Q_DENOMINATOR, numerator))


def pd_gains(
    motor: Motor = NOMINAL, bandwidth_rad_per_s: float = BANDWIDTH_RAD_PER_S, damping_ratio: float = 1.0
) -> tuple[float, float]:
    """Return the gains [V/rad, V s/rad] that give the loop s^2 + 2 z w s + w^2 on the motor."""
    w = bandwidth_rad_per_s
    proportional = motor.inertia * w**2 / motor.gain
    return proportional, (2.0 * damping_ratio * w * motor.inertia - motor.damping) / motor.gain


def servo(motor: Motor = NOMINAL, observes: bool = True, rate_hz: float = RATE_HZ) -> Servo:
    """Return a servo that is designed on G_m and turns `motor`."""
    proportional, rate_gain = pd_gains()
    return Servo(
        rate_hz,
        proportional,
        _mechanical(motor, rate_hz),
        _discrete((rate_gain, 0.0), (_RATE_FILTER_S, 1.0), rate_hz, "bilinear"),
        _discrete(Q_NUMERATOR, Q_DENOMINATOR, rate_hz, "zoh"),
        _discrete(*filtered_inverse(NOMINAL), rate_hz, "bilinear"),
        observes,
    )


def at_rest() -> Array:
    """Return the state of a servo at rest with its pulley at zero, shape (7,)."""
    return np.zeros(7)


def voltage_V(item: Servo, state: Array, reference_rad: float) -> float:
    """Return what the controller asks for in a `state` (7,), before the supply limits it [V]."""
    error = reference_rad / GEAR - state[0]
    asked = item.proportional * error + item.derivative.C[0] * state[2] + item.derivative.D * error
    if item.observes:
        disturbed = item.inverse.C @ state[5:7] + item.inverse.D * state[0]
        asked -= disturbed - item.low_pass.C @ state[3:5]
    return float(asked)


def advanced(
    item: Servo, state: Array, reference_rad: float, load_Nm: float, supply_V: float = SUPPLY_V
) -> Array:
    """Return the `state` (7,) one period later.

    The load is the moment of the tendons on the pulley, against the positive direction; the supply limits the
    voltage to either side, and the observer is told what was applied.
    """
    applied = min(max(voltage_V(item, state, reference_rad), -supply_V), supply_V)
    after = np.empty(7)
    after[:2] = item.plant.A @ state[:2] + item.plant.B * (applied - LOAD_V_PER_NM * load_Nm)
    error = reference_rad / GEAR - state[0]
    after[2] = item.derivative.A[0, 0] * state[2] + item.derivative.B[0] * error
    after[3:5] = item.low_pass.A @ state[3:5] + item.low_pass.B * applied
    after[5:7] = item.inverse.A @ state[5:7] + item.inverse.B * state[0]
    return after


def pulley_rad(state: Array) -> float:
    """Return the pulley's angle [rad]."""
    return float(state[0] * GEAR)


def reference_rad(displacement_m: float) -> float:
    """Return the pulley angle that displaces a pair (Section III)."""
    return displacement_m / PULLEY_RADIUS_M


def closed_loop(item: Servo) -> tuple[Array, Array, Array]:
    """Return the loop below its limits: A (7, 7), the voltage's row (7,), the load's column (7,) [1/V].

    x' = A x + b v with the reference at zero, u = k x; v is a voltage beside u at the motor's input.
    """
    unit = np.eye(7)
    A = np.stack([advanced(item, column, 0.0, 0.0, math.inf) for column in unit], axis=1)
    k = np.array([voltage_V(item, column, 0.0) for column in unit])
    b = advanced(item, np.zeros(7), 0.0, -1.0 / LOAD_V_PER_NM, math.inf)
    return A, k, b


def modulus_margin(item: Servo) -> float:
    """Return the smallest distance of the open loop's Nyquist curve from -1; 0 if the loop is unstable.

    A loop with a margin m stands a factor of at least 1/(1 - m) in its gain, and 2 asin(m/2) of phase.
    """
    A, k, b = closed_loop(item)
    if np.abs(np.linalg.eigvals(A)).max() >= 1.0:
        return 0.0
    frequency = np.geomspace(1e-2, math.pi * item.rate_hz, 1000) / item.rate_hz
    z = np.exp(1j * frequency)[:, np.newaxis, np.newaxis]
    whole = 1.0 + np.linalg.solve(z * np.eye(7) - A, b[:, np.newaxis])[..., 0] @ k
    return float(1.0 / np.abs(whole).max())


def _mechanical(motor: Motor, rate_hz: float) -> Block:
    """Return the motor with angle and speed as its states."""
    A = np.array([[0.0, 1.0], [0.0, -motor.damping / motor.inertia]])
    B = np.array([[0.0], [motor.gain / motor.inertia]])
    found = signal.cont2discrete((A, B, np.array([[1.0, 0.0]]), np.zeros((1, 1))), 1.0 / rate_hz, "zoh")
    return _block(*found[:4])


def _discrete(numerator: Sequence[float], denominator: Sequence[float], rate_hz: float, rule: str) -> Block:
    system = signal.tf2ss(np.asarray(numerator, float), np.asarray(denominator, float))
    return _block(*signal.cont2discrete(system, 1.0 / rate_hz, rule)[:4])


def _block(A: Array, B: Array, C: Array, D: Array) -> Block:
    return Block(A, B[:, 0], C[0], float(D[0, 0]))


# ----------------------------------------------------------------------------------------------------
# PID control of joint angles on tracker feedback (Nayar 2023, Section IV-A).
#
# Printed: P 0.01, I 0.2, D 0.0001, without units or rate. Read here as mm of displacement per deg, per deg
# s, and per deg/s, which the joints can bear (`tests/controllers/test_pid.py`): a pair bends its joint by 27
# deg/mm where the tendons do not stretch and by 2 to 6 where they do. Per m and rad the correction would be
# 17 times as large, and the loop unstable without stretch.

DEG_TO_SI = 1e-3 / math.radians(1.0)  # from mm/deg to m/rad
FEEDBACK_HZ = 40.0  # of an electromagnetic tracker; not printed
LIMIT_M = 12e-3  # of the correction; not printed


@dataclass(frozen=True)
class Gains:
    """Gains of a PID controller from angle to displacement."""

    P_m_per_rad: float
    I_m_per_rad_s: float
    D_m_s_per_rad: float


PRINTED = Gains(0.01 * DEG_TO_SI, 0.2 * DEG_TO_SI, 1e-4 * DEG_TO_SI)


class Pid:
    """A PID controller of one joint, called once a period.

    Anti-windup: while the correction is at its limit, the integral does not grow further toward it.
    """

    def __init__(
        self, gains: Gains = PRINTED, rate_hz: float = FEEDBACK_HZ, limit_m: float = LIMIT_M
    ) -> None:
        self._gains, self._period_s, self._limit_m = gains, 1.0 / rate_hz, limit_m
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self._integral_m = 0.0
        self._error_before: float | None = None

    def correction_m(self, error_rad: float) -> float:
        """Return what the controller adds for this period [m], from the desired less the measured angle."""
        gains, limit = self._gains, self._limit_m
        change = 0.0 if self._error_before is None else error_rad - self._error_before
        self._error_before = error_rad
        direct = gains.P_m_per_rad * error_rad + gains.D_m_s_per_rad * change / self._period_s
        before = self._integral_m
        integral = before + gains.I_m_per_rad_s * error_rad * self._period_s
        self._integral_m = min(max(integral, min(before, -limit - direct)), max(before, limit - direct))
        return min(max(direct + self._integral_m, -limit), limit)
