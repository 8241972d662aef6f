"""Modified kinematics (MK) of the transseptal robot: measured dead-bands (Nayar 2022, Eqs 23-28).

What its joints did with the quadlumen tube in place, fitted by the paper on loops from zero to one side.
Nothing is printed for negative displacement.

Units. Eq. 25 gives degrees per millimetre with the printed alpha and beta: so its two lines meet at l*,
to 0.04 deg at 3.7 deg. In radians they would meet as well, at 211 deg, and 6 mm would bend by 85 rad.

As printed the robot is not straight at zero displacement: Eq. 25 gives -4.2 deg, Eq. 26 the lower
plateau, 10 or 12 deg. The paper's loops are of a joint that has been moved before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.catheter.spec import CatheterSegment
from catheter_sim.kinds.catheter.theory.tendons import angle_rad, pulled_m


@dataclass(frozen=True)
class BendingCalibration:
    """Two lines, Eq. 25: angle [deg] = (displacement [mm] - beta) / (alpha a_b [mm])."""

    turn_m: float  # l*: the first line up to it
    alpha: tuple[float, float]
    beta_mm: tuple[float, float]


@dataclass(frozen=True)
class TorsionCalibration:
    """Plateaus and dead-band of Eq. 26."""

    upper_rad: float  # Y_U
    lower_rad: float  # Y_L
    width_m: float  # d_b


BENDING = BendingCalibration(1.7750e-3, (0.1246, 0.0290), (0.9498, 1.5849))
TORSION_PROXIMAL = TorsionCalibration(math.radians(58.8), math.radians(10.0), 1.35e-3)
TORSION_DISTAL = TorsionCalibration(math.radians(73.0), math.radians(12.0), 0.83e-3)


def bending_rad(
    segment: CatheterSegment, displacement_m: Array, calibration: BendingCalibration = BENDING
) -> Array:
    """Return the bend at displacements of 0 or more, same shape [rad] (Eq. 25)."""
    arm_mm, mm = segment.arm_m * 1e3, displacement_m * 1e3
    first, second = (
        (mm - beta) / (alpha * arm_mm)
        for alpha, beta in zip(calibration.alpha, calibration.beta_mm, strict=True)
    )
    return np.radians(np.where(displacement_m <= calibration.turn_m, first, second))


def torsion_as_printed_rad(
    segment: CatheterSegment, displacement_m: Array, calibration: TorsionCalibration
) -> Array:
    """Return the torsion along displacements of 0 or more, shape (r,) [rad] (Eqs 26-28).

    The first row counts as loading. At rest Eq. 28 gives s = 1/2, halfway between the branches; and a
    turn below the upper plateau jumps from one branch to the other. `torsion_rad` does neither.
    """
    change = np.diff(displacement_m, prepend=displacement_m[0] - 1.0)
    s = 0.5 * (np.sign(change) + 1.0)
    return _branch(segment, displacement_m - calibration.width_m * s, calibration)


def torsion_rad(segment: CatheterSegment, displacement_m: Array, calibration: TorsionCalibration) -> Array:
    """Return the torsion along displacements of 0 or more, shape (r,) [rad]: Eq. 26 with a history.

    The angle keeps its value until one of Eq. 26's two branches pushes it: on loops that reach the
    upper plateau this is Eq. 26, and the rows' spacing does not matter. NaN where no angle exists.
    """
    loading = _branch(segment, displacement_m - calibration.width_m, calibration)
    unloading = _branch(segment, displacement_m, calibration)
    angle = np.empty_like(displacement_m)
    now = loading[0]
    for row, (least, most) in enumerate(zip(loading, unloading, strict=True)):
        now = min(max(now, least), most)
        angle[row] = now
    return np.where(np.isnan(unloading), np.nan, angle)


def plateau_displacement_m(segment: CatheterSegment, calibration: TorsionCalibration) -> float:
    """Return the displacement at which loading reaches the upper plateau [m]."""
    span = calibration.upper_rad - calibration.lower_rad
    return float(pulled_m(segment, span)) + calibration.width_m


def _branch(segment: CatheterSegment, displacement_m: Array, calibration: TorsionCalibration) -> Array:
    pure = angle_rad(segment, np.maximum(displacement_m, 0.0))
    return np.minimum(pure, calibration.upper_rad - calibration.lower_rad) + calibration.lower_rad
