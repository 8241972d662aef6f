"""Claims about the gearmotor's servo: the readings of Nayar 2022, Section III, and what the loop does."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy import signal

from catheter_sim.controllers import motors
from catheter_sim.robots.catheter.kinematics import pulled_m
from catheter_sim.robots.catheter.published import mitral_transseptal

LOAD_NM = 0.04


def settled(pulley_rad: float, item: motors.Servo) -> np.ndarray:
    """Return the state of a servo at rest with its pulley at an angle, the inverse's filter settled there."""
    state = motors.at_rest()
    state[0] = pulley_rad / motors.GEAR
    state[5:7] = np.linalg.solve(np.eye(2) - item.inverse.A, item.inverse.B * state[0])
    return state


def response(
    item: motors.Servo, reference_rad: float, load_Nm: float, seconds: float, supply_V: float = math.inf
) -> np.ndarray:
    """Return the pulley's angle after each period from rest [rad]."""
    state, angles = motors.at_rest(), []
    for _ in range(round(seconds * item.rate_hz)):
        state = motors.advanced(item, state, reference_rad, load_Nm, supply_V)
        angles.append(motors.pulley_rad(state))
    return np.array(angles)


def test_the_printed_inverse_is_q_over_the_nominal_motor() -> None:
    """With its numerator at 0.3948 s^2 + 1.1153 s, Q G_m^-1 has the printed denominator, to its digits."""
    numerator, denominator = motors.filtered_inverse(motors.NOMINAL)
    scale = 0.3948 / numerator[0]
    assert np.multiply(scale, numerator) == pytest.approx([0.3948, 1.1153, 0.0], abs=1e-12)
    assert np.multiply(scale, denominator) == pytest.approx([0.04, 4.97, 156.14], abs=5e-3)


def test_q_is_a_double_low_pass_at_10_hz() -> None:
    """Both poles of the printed Q lie at 62.8 rad/s, to its digits, and it passes a constant unchanged."""
    poles = np.roots(motors.Q_DENOMINATOR)
    assert np.abs(poles) == pytest.approx([20.0 * math.pi] * 2, rel=0.05)
    assert np.sqrt(np.prod(poles)).real == pytest.approx(20.0 * math.pi, rel=1e-4)
    assert motors.Q_NUMERATOR[-1] == motors.Q_DENOMINATOR[-1]


def test_read_in_volts_at_the_shaft_the_speed_is_that_of_a_slow_gearmotor() -> None:
    """At 6 V the pulley turns at some 21 rpm, which a 380:1 gearmotor of 35 rpm without load can."""
    speed = response(motors.servo(), 1e6, 0.0, 5.0, supply_V=6.0)
    rpm = (speed[-1] - speed[-2]) * motors.RATE_HZ * 60.0 / (2.0 * math.pi)
    assert rpm == pytest.approx(6.0 * 156.14 / 1.1153 / 380.0 * 60.0 / (2.0 * math.pi), rel=1e-3)
    assert 20.0 < rpm < 35.0


def test_pd_gains_place_both_poles() -> None:
    """The ideal PD loop on the nominal motor has a double pole at the bandwidth."""
    proportional, rate = motors.pd_gains()
    nominal = motors.NOMINAL
    poles = np.roots([nominal.inertia, nominal.damping + nominal.gain * rate, nominal.gain * proportional])
    assert poles == pytest.approx([-motors.BANDWIDTH_RAD_PER_S] * 2, rel=1e-6)


@pytest.mark.parametrize("strength", [0.7, 1.0, 1.3])
def test_the_observer_rejects_a_constant_load_and_pd_alone_does_not(strength: float) -> None:
    """PD alone gives way by load over proportional gain; with the observer a thousandth of that is left."""
    own = motors.Motor(gain=strength * motors.NOMINAL.gain)
    given_way = motors.LOAD_V_PER_NM * LOAD_NM / motors.pd_gains()[0] * motors.GEAR
    alone = response(motors.servo(own, observes=False), 0.0, LOAD_NM, 3.0)[-1]
    observed = response(motors.servo(own), 0.0, LOAD_NM, 3.0)[-1]
    assert alone == pytest.approx(-given_way, rel=1e-4)
    assert abs(observed) < 1e-3 * given_way


def polynomial(*factors: Sequence[float]) -> np.ndarray:
    product = np.ones(1)
    for factor in factors:
        product = np.polymul(product, factor)
    return product


@pytest.mark.parametrize("what", ["reference", "load"])
def test_discrete_loop_follows_the_continuous_one(what: str) -> None:
    """Step responses at 1 kHz are within 3 % of their peak of the continuous loop's (scipy.signal.lsim).

    On the nominal motor: reference GC/(1 + GC), which the observer does not touch, and voltage beside u
    (1 - Q)G/(1 + GC).
    """
    proportional, rate = motors.pd_gains()
    lag = 1.0 / (2.0 * math.pi * 100.0)
    C = ([proportional * lag + rate, proportional], [lag, 1.0])
    G = motors.transfer_function(motors.NOMINAL)
    whole = np.polyadd(polynomial(G[0], C[0]), polynomial(G[1], C[1]))
    seconds = np.arange(1, 1001) / motors.RATE_HZ
    if what == "reference":
        system = (polynomial(G[0], C[0]), whole)
        ours = response(motors.servo(), 0.1, 0.0, 1.0)
        scale = 0.1
    else:
        left = np.polysub(motors.Q_DENOMINATOR, motors.Q_NUMERATOR)
        system = (polynomial(left, G[0], C[1]), polynomial(motors.Q_DENOMINATOR, whole))
        ours = response(motors.servo(), 0.0, LOAD_NM, 1.0)
        scale = -motors.LOAD_V_PER_NM * LOAD_NM * motors.GEAR
    times = np.concatenate([[0.0], seconds])
    expected = scale * signal.lsim(system, np.ones(len(times)), times)[1][1:]
    assert np.abs(ours - expected).max() < 0.03 * np.abs(expected).max()


@pytest.mark.slow
def test_the_loop_is_robust_to_a_motor_that_differs_by_30_percent() -> None:
    """Gain, inertia and damping each 0.7, 1 or 1.3 of G_m's: Nyquist stays half a unit away from -1.

    So a factor of 2 in the gain and 29 deg of phase are left.
    """
    for gain, inertia, damping in itertools.product((0.7, 1.0, 1.3), repeat=3):
        own = motors.Motor(
            gain * motors.NOMINAL.gain, inertia * motors.NOMINAL.inertia, damping * motors.NOMINAL.damping
        )
        assert motors.modulus_margin(motors.servo(own)) > 0.5, (gain, inertia, damping)


def test_an_unstable_loop_has_no_margin() -> None:
    """A motor a hundred times as strong oscillates under this controller, and the margin says so."""
    wild = motors.servo(motors.Motor(gain=100.0 * motors.NOMINAL.gain))
    assert motors.modulus_margin(wild) == 0.0
    swing = np.abs(response(wild, 0.01, 0.0, 2.0))
    assert swing[-100:].max() > 10.0 * swing[:100].max()


def test_margin_foretells_the_gain_that_is_left() -> None:
    """With the margin m, a motor 1/(1 - m) times as strong is still stable: the disk about -1 is empty."""
    m = motors.modulus_margin(motors.servo())
    # the loop's gain is that of the motor in the loop with the observer fixed
    stronger = motors.servo(motors.Motor(gain=motors.NOMINAL.gain * 0.99 / (1.0 - m)))
    assert motors.modulus_margin(stronger) > 0.0


def test_supply_limits_speed_without_windup() -> None:
    """Half a turn of the pulley at 6 V: never above the voltage's speed, hardly beyond the reference."""
    angle = response(motors.servo(), math.pi, LOAD_NM, 6.0, supply_V=6.0)
    assert np.diff(angle).max() * motors.RATE_HZ < 6.0 * 156.14 / 1.1153 * motors.GEAR
    assert angle.max() < 1.02 * math.pi
    assert angle[-1] == pytest.approx(math.pi, rel=1e-4)


def test_reference_is_the_pair_over_the_pulley() -> None:
    """90 deg of bending are Eq. 3 over r_p = 7.19 mm, torsion likewise Eq. 6."""
    robot = mitral_transseptal()
    half = math.radians(90.0) / 22
    bending_mm = 22 * (0.52 * (1.0 - math.cos(half)) + 1.8 * math.sin(half))
    found = motors.reference_rad(float(pulled_m(robot.segments[1], math.radians(90.0))))
    assert found == pytest.approx(bending_mm / 7.19, rel=1e-9)
    at, r, h, turn = math.radians(120.0), 2.85, 2.5, math.radians(30.0)
    torsion_mm = math.hypot(r * at, h) - math.hypot(r * (at - turn), h)
    found = motors.reference_rad(float(pulled_m(robot.segments[0], turn)))
    assert found == pytest.approx(torsion_mm / 7.19, rel=1e-9)


def test_a_servo_at_rest_away_from_zero_stays() -> None:
    """Started at rest at an angle that is also its reference, it does not move."""
    item = motors.servo()
    state = settled(0.3, item)
    for _ in range(100):
        state = motors.advanced(item, state, 0.3, 0.0)
    assert motors.pulley_rad(state) == pytest.approx(0.3, abs=1e-9)
