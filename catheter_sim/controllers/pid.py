"""PID control of joint angles on tracker feedback (Nayar 2023, Section IV-A).

Printed: P 0.01, I 0.2, D 0.0001, without units or rate. Read here as mm of displacement per deg, per
deg s, and per deg/s, which the joints can bear (`critical_slope_deg_per_mm`): a pair bends its joint by
27 deg/mm where the tendons do not stretch and by 2 to 6 where they do. Per m and rad the correction
would be 17 times as large, and the loop unstable without stretch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

DEG_TO_SI = 1e-3 / math.radians(1.0)  # from mm/deg to m/rad
RATE_HZ = 40.0  # of an electromagnetic tracker; not printed
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

    def __init__(self, gains: Gains = PRINTED, rate_hz: float = RATE_HZ, limit_m: float = LIMIT_M) -> None:
        self._gains, self._period_s, self._limit_m = gains, 1.0 / rate_hz, limit_m
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self._integral_m = 0.0
        self._error_before: float | None = None

    def correction_m(self, error_rad: float) -> float:
        """Return the displacement that the controller adds for this period [m].

        Args:
            error_rad: desired angle less measured angle.
        """
        gains, limit = self._gains, self._limit_m
        change = 0.0 if self._error_before is None else error_rad - self._error_before
        self._error_before = error_rad
        direct = gains.P_m_per_rad * error_rad + gains.D_m_s_per_rad * change / self._period_s
        before = self._integral_m
        integral = before + gains.I_m_per_rad_s * error_rad * self._period_s
        self._integral_m = min(max(integral, min(before, -limit - direct)), max(before, limit - direct))
        return min(max(direct + self._integral_m, -limit), limit)


def critical_slope_deg_per_mm(gains: Gains = PRINTED, rate_hz: float = RATE_HZ) -> float:
    """Return the slope of a joint, angle per displacement, beyond which the loop is unstable [deg/mm].

    Of a joint that answers within a period: y' = slope * u. Its characteristic polynomial,
    z^2 (z - 1) + slope (P z (z - 1) + I T z^2 + D (z - 1)^2 / T), leaves the unit circle at z = -1.
    """
    period_s = 1.0 / rate_hz
    at_minus_one = 2.0 * gains.P_m_per_rad + gains.I_m_per_rad_s * period_s
    at_minus_one += 4.0 * gains.D_m_s_per_rad / period_s
    return 2.0 / at_minus_one * DEG_TO_SI


def characteristic_roots(
    slope_deg_per_mm: float, gains: Gains = PRINTED, rate_hz: float = RATE_HZ
) -> np.ndarray:
    """Return the roots of the polynomial of `critical_slope_deg_per_mm`, shape (3,), complex."""
    P, I, D = (  # noqa: E741
        value * slope_deg_per_mm / DEG_TO_SI
        for value in (gains.P_m_per_rad, gains.I_m_per_rad_s / rate_hz, gains.D_m_s_per_rad * rate_hz)
    )
    return np.roots([1.0, -1.0 + P + I + D, -P - 2.0 * D, D])
