"""Calibration of modified kinematics (MK) from measured loops of one joint (Nayar 2022, Section IV-C).

The paper fits two lines to the bending joint's loops by least squares and tunes the torsion joints'
plateaus and dead-band; here both are least squares.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import least_squares

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError
from catheter_sim.kinds.catheter.spec import CatheterSegment
from catheter_sim.kinds.catheter.theory.modified import BendingCalibration, TorsionCalibration, torsion_rad
from catheter_sim.kinds.catheter.theory.tendons import pulled_m

_LEAST_ROWS = 4  # on each of two lines
_FLATTEST = 1e-6  # deg/mm: a line as flat as that has no alpha of its own


def calibrate_bending(
    segment: CatheterSegment, displacement_m: Array, angle_rad: Array
) -> BendingCalibration:
    """Return Eq. 25's two lines that fit loops of a bending joint best.

    The turn l* is sought among the displacements that occur; the lines need not meet there.

    Args:
        segment: the joint; its arm is in Eq. 25.
        displacement_m, angle_rad: along the loops, displacements of 0 or more, shape (r,).

    Raises:
        InputError: too few different displacements, or a missing value.
    """
    _require_finite(displacement_m, angle_rad)
    mm, deg = displacement_m * 1e3, np.degrees(angle_rad)
    places = np.unique(mm)
    best = (math.inf, 0.0, (0.0, 0.0), (0.0, 0.0))
    for turn in places[_LEAST_ROWS - 1 : -_LEAST_ROWS]:
        before = mm <= turn
        fits = [np.polyfit(mm[part], deg[part], 1) for part in (before, ~before)]
        left = sum(
            float(((np.polyval(fit, mm[part]) - deg[part]) ** 2).sum())
            for fit, part in zip(fits, (before, ~before), strict=True)
        )
        if left < best[0]:
            slopes, zeros = zip(*fits, strict=True)
            best = (left, float(turn), (slopes[0], slopes[1]), (zeros[0], zeros[1]))
    if not math.isfinite(best[0]):
        raise InputError(
            f"modified kinematics: {len(places)} different displacements are too few for two lines"
        )
    _, turn, slopes, zeros = best
    # Eq. 25: angle = (l - beta) / (alpha a_b)
    slope = [max(value, _FLATTEST) for value in slopes]
    alpha = [1.0 / (value * segment.arm_m * 1e3) for value in slope]
    beta = [-zero / value for zero, value in zip(zeros, slope, strict=True)]
    return BendingCalibration(turn * 1e-3, (alpha[0], alpha[1]), (beta[0], beta[1]))


def calibrate_torsion(
    segment: CatheterSegment, displacement_m: Array, angle_rad: Array
) -> TorsionCalibration:
    """Return Eq. 26's plateaus and dead-band that fit loops of a torsion joint best.

    Args:
        segment: the joint.
        displacement_m, angle_rad: along the loops, displacements of 0 or more, shape (r,).

    Raises:
        InputError: a joint that does not move, or a missing value.
    """
    _require_finite(displacement_m, angle_rad)
    low, high = float(angle_rad.min()), float(angle_rad.max())
    if high <= low:
        raise InputError("modified kinematics: the torsion joint does not move")
    width = max(float(displacement_m.max()) - float(pulled_m(segment, high - low)), 1e-5)

    def left(numbers: Array) -> Array:
        upper, lower, width_mm = numbers
        calibration = TorsionCalibration(upper, lower, width_mm * 1e-3)
        found = torsion_rad(segment, displacement_m, calibration)
        return np.where(np.isnan(found), math.pi, found) - angle_rad

    bounds = ([low - 0.5, low - 0.5, 0.0], [high + 0.5, high + 0.5, 1e3 * float(displacement_m.max())])
    fit = least_squares(left, (high, low, width * 1e3), bounds=bounds, diff_step=1e-4)
    return TorsionCalibration(float(fit.x[0]), float(fit.x[1]), float(fit.x[2]) * 1e-3)


def _require_finite(displacement_m: Array, angle_rad: Array) -> None:
    if not (np.isfinite(displacement_m).all() and np.isfinite(angle_rad).all()):
        raise InputError("modified kinematics: displacements and angles must be finite numbers")
    if (displacement_m < 0.0).any():
        raise InputError("modified kinematics: calibrated for displacements of 0 or more only")
