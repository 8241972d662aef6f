"""Claims about the PID controller of joint angles (Nayar 2023, Section IV-A)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from catheter_sim.controllers import motors
from catheter_sim.robots.catheter.kinematics import arm_m
from catheter_sim.robots.catheter.published import mitral_4dof


def critical_slope_deg_per_mm(
    gains: motors.Gains = motors.PRINTED, rate_hz: float = motors.FEEDBACK_HZ
) -> float:
    """Return the slope of a joint, angle per displacement, beyond which the loop is unstable [deg/mm].

    Of a joint that answers within a period: y' = slope * u. Its characteristic polynomial,
    z^2 (z - 1) + slope (P z (z - 1) + I T z^2 + D (z - 1)^2 / T), leaves the unit circle at z = -1.
    """
    period_s = 1.0 / rate_hz
    at_minus_one = 2.0 * gains.P_m_per_rad + gains.I_m_per_rad_s * period_s
    at_minus_one += 4.0 * gains.D_m_s_per_rad / period_s
    return 2.0 / at_minus_one * motors.DEG_TO_SI


def characteristic_roots(
    slope_deg_per_mm: float, gains: motors.Gains = motors.PRINTED, rate_hz: float = motors.FEEDBACK_HZ
) -> np.ndarray:
    """Return the roots of the polynomial of `critical_slope_deg_per_mm`, shape (3,), complex."""
    P, I, D = (  # noqa: E741
        value * slope_deg_per_mm / motors.DEG_TO_SI
        for value in (gains.P_m_per_rad, gains.I_m_per_rad_s / rate_hz, gains.D_m_s_per_rad * rate_hz)
    )
    return np.roots([1.0, -1.0 + P + I + D, -P - 2.0 * D, D])


def closed(slope_deg_per_mm: float, ticks: int, disturbance_deg: float = 1.0) -> np.ndarray:
    """Return the angle of a joint that answers within a tick to the controller alone [deg]."""
    controller, angle = motors.Pid(limit_m=1.0), []
    now = disturbance_deg
    for _ in range(ticks):
        angle.append(now)
        now = disturbance_deg + slope_deg_per_mm * 1e3 * controller.correction_m(-math.radians(now))
    return np.array(angle)


def test_printed_gains_in_mm_and_deg() -> None:
    """A constant error of 10 deg for a second: 0.1 mm by P, 2 mm by I, none by D."""
    controller = motors.Pid(rate_hz=40.0)
    corrections = [controller.correction_m(math.radians(10.0)) for _ in range(40)]
    assert corrections[-1] * 1e3 == pytest.approx(0.01 * 10.0 + 0.2 * 10.0 * 1.0)


def test_derivative_acts_on_the_change() -> None:
    """An error that grows by 1 deg in a period of 25 ms adds 0.0001 * 40 mm."""
    gains = motors.Gains(0.0, 0.0, motors.PRINTED.D_m_s_per_rad)
    controller = motors.Pid(gains, rate_hz=40.0)
    assert controller.correction_m(0.0) == 0.0
    assert controller.correction_m(math.radians(1.0)) * 1e3 == pytest.approx(0.0001 * 40.0)


def test_critical_slope_is_where_the_loop_turns_unstable() -> None:
    """Just below it all roots lie inside the unit circle, just above one does not; so does a run."""
    critical = critical_slope_deg_per_mm()
    assert np.abs(characteristic_roots(0.99 * critical)).max() < 1.0
    assert np.abs(characteristic_roots(1.01 * critical)).max() > 1.0
    assert abs(closed(0.9 * critical, 400)[-1]) < 1e-3
    assert abs(closed(1.1 * critical, 400)[-1]) > 1e3


def test_gains_in_mm_and_deg_are_stable_on_every_joint_and_in_m_and_rad_are_not() -> None:
    """The steepest joint, without stretch, stands a factor of 1.5 more; gains in m and rad would not hold."""
    robot = mitral_4dof()
    slopes = [
        math.degrees(1.0) * 1e-3 / float(arm_m(segment, 0.0))
        for segment in robot.segments
        if segment.joint in ("bending", "torsion")
    ]
    assert max(slopes) == pytest.approx(math.degrees(1.0) / 2.1, rel=1e-6)
    assert critical_slope_deg_per_mm() > 1.5 * max(slopes)
    in_m_and_rad = motors.Gains(0.01, 0.2, 0.0001)
    assert critical_slope_deg_per_mm(in_m_and_rad) < min(slopes)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_correction_stops_at_its_limit_and_does_not_wind_up(sign: float) -> None:
    """After a long error of one sign the correction leaves its limit within a tick of the error's turn."""
    controller = motors.Pid(limit_m=1e-3)
    for _ in range(4000):
        stuck = controller.correction_m(sign * math.radians(20.0))
    assert stuck == pytest.approx(sign * 1e-3)
    assert sign * controller.correction_m(-sign * math.radians(20.0)) < 0.9e-3


def test_reset_forgets() -> None:
    """After a reset the first correction is that of a new controller."""
    controller = motors.Pid()
    first = controller.correction_m(0.1)
    controller.correction_m(0.3)
    controller.reset()
    assert controller.correction_m(0.1) == first
