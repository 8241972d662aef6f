"""Laws of catheters as Nayar 2022 and 2023 measured them: MK, PI, hybrid, TE, sizing."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, least_squares, nnls

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.statics import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.mechanics.hysteresis import plays
from catheter_sim.robots.catheter.description import bent_by, moved_segment
from catheter_sim.robots.catheter.kinematics import (
    angle_rad,
    arm_m,
    beyond,
    channel_at,
    largest_angle_rad,
    pulled_m,
    pure_joint,
    require_rigid_mount,
    require_unloaded,
    run_of,
)
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment

# ----------------------------------------------------------------------------------------------------
# The tendon's tension at a bending joint's angle, loading and unloading (Nayar 2023, Algorithm 2).
#
# Degrees and newtons, as printed. Loading is a cubic; unloading is the cubic over c_1, times an inverse
# tangent of (angle / (b_ul + 0.01))^c_2, b_ul the angle at which unloading began.
#
# Readings. Hyperbolic or circular? The text says tanh^-1, Algorithm 2 prints tan^-1. It is tanh^-1: with
# the printed c_2 of 0.01 to 0.05 the power lies just below 1 everywhere, where tan^-1 is 0.78 throughout,
# so that unloading would drop by four fifths at once and c_2 would do nothing; tanh^-1 leaves the loading
# curve near b_ul and falls to about half of it, as the text says of the profile. The printed RMSE (0.13,
# 0.24 N) admits no drop of 9 N. Within some 3 % of b_ul tanh^-1 runs above the loading curve (its pole is
# at b_ul + 0.01): there the smaller of the two is taken.
#
# c_1 and c_2 are chosen by b_ul, not by the angle as printed: the text says that the curve depends on the
# final angle, and one unloading is then continuous.


@dataclass(frozen=True)
class JointForce:
    """Parameters of Algorithm 2."""

    loading: tuple[float, float, float, float]  # p_0 to p_3: [N], [N/deg] ...
    bounds_deg: tuple[float, float]  # p_4, p_5
    c_1: tuple[float, float, float]  # p_6, p_8, p_10
    c_2: tuple[float, float, float]  # p_7, p_9, p_11


PROXIMAL = JointForce(
    (-0.61, 0.18, -1.29e-5, -5.25e-6), (40.06, 61.03), (4.08, 5.26, 4.70), (0.02, 0.01, 0.03)
)
DISTAL = JointForce((-0.09, 0.17, -5.02e-4, -2.12e-7), (40.0, 64.50), (4.0, 5.26, 5.54), (0.05, 0.01, 0.01))

LAWS = {"measured_proximal": PROXIMAL, "measured_distal": DISTAL}  # by a segment's `resistance`


def loading_N(law: JointForce, angle_deg: ArrayLike) -> Array:
    """Return the tension that bends the joint further, same shape [N]; never below zero."""
    return np.maximum(np.polynomial.polynomial.polyval(np.asarray(angle_deg, float), law.loading), 0.0)


def unloading_N(law: JointForce, angle_deg: ArrayLike, turn_deg: ArrayLike) -> Array:
    """Return the tension at which the joint, let go at `turn_deg`, comes back, shapes broadcast [N]."""
    return np.minimum(unloading_unbounded_N(law, angle_deg, turn_deg), loading_N(law, angle_deg))


def unloading_unbounded_N(
    law: JointForce, angle_deg: ArrayLike, turn_deg: ArrayLike, hyperbolic: bool = True
) -> Array:
    """Return the unloading curve alone, with tanh^-1 or with the tan^-1 that Algorithm 2 prints."""
    angle, turn = np.asarray(angle_deg, dtype=float), np.asarray(turn_deg, dtype=float)
    piece = np.searchsorted(law.bounds_deg, turn)
    power = (np.clip(angle, 0.0, turn) / (turn + 0.01)) ** np.take(law.c_2, piece)
    inverse = np.arctanh if hyperbolic else np.arctan
    return loading_N(law, angle) / np.take(law.c_1, piece) * inverse(power)


# ----------------------------------------------------------------------------------------------------
# How a UHMWPE tendon stretches under cyclic load, permanent set included (Nayar 2023, Algorithm 1).
#
# Three phases. Loading follows the envelope, a cubic in strain. Unloading from (e_ul, F_ul) follows F = a
# e^q + b e + c, flat and slack at e_pl = gamma e_ul, q = a_n e_ul + b_n (Eqs 1-4). Reloading is a line of
# the slope between (e_pl + (n_c - 1) beta, 0) and (e_ul, phi^(n_c - 1) F_ul), n_c the number of unloadings
# since the envelope was left, until it meets the envelope.
#
# Readings. (e_ul, F_ul) of q, e_pl and the line are those at which the envelope was left: a set does not
# heal when a later cycle turns back earlier; each unloading curve starts where its cycle turns. Below e_pl
# the tendon is slack; the algorithm holds strain and tension there. After a partial unloading the line goes
# from there to the same top: with the full line's slope it would pass below the envelope for good.
#
# The text lets every reloading line meet the envelope in the end. With the printed phi and beta those that
# follow ten cycles to 2 mm or more of 65 mm do not: phi^9 lowers them by a sixth, and from there on the
# envelope is the steeper one. Such a line is followed past the largest strain, and the next turn counts as
# a new largest one. With phi = 1 and beta = 0 all meet, at the largest strain.
#
# Strain of a 65 mm sample at 0.05 mm/s; measured to 6 mm, strain 0.092.

LARGEST_STRAIN = 6.0 / 65.0  # of the paper's Fig. 3
UNTOUCHED = 1e-6  # strain: a tendon that never had more is as new
TOUCH = 1e-9  # strain: a line that ends on the envelope has not crossed it


@dataclass(frozen=True)
class TendonLaw:
    """Parameters of Algorithm 1."""

    envelope_N: tuple[float, float, float, float]  # p_1 to p_4: of strain^3, ^2, ^1, ^0
    gamma: float  # permanent set per strain at the turn
    a_n: float  # exponent q per strain at the turn
    b_n: float  # exponent q at zero
    phi: float  # by which the reloading line's top falls each cycle
    beta: float  # strain by which its foot shifts each cycle


PRINTED = TendonLaw((-2000.0, 6000.0, 150.0, 0.03), 0.4605, 7.7751, 5.4876, 0.9810, 0.00035)
SIMPLIFIED = replace(PRINTED, phi=1.0, beta=0.0)  # Section III-A.4: what the TE model uses


@dataclass(frozen=True)
class TendonState:
    """A tendon at a point of its history; the defaults are a new one at rest.

    Attributes:
        strain: now.
        tension_N: now [N].
        phase: "loading", "unloading" or "reloading".
        cycle: n_c, unloadings since the envelope was left.
        most: strain and tension [N] at which it was left.
        anchor: strain and tension [N] at which the present unloading or reloading began.
    """

    strain: float = 0.0
    tension_N: float = 0.0
    phase: str = "loading"
    cycle: int = 0
    most: tuple[float, float] = (0.0, 0.0)
    anchor: tuple[float, float] = (0.0, 0.0)


def envelope_N(law: TendonLaw, strain: float) -> float:
    """Return the tension of a tendon that is loaded for the first time [N]; 0 at and below zero strain.

    Beyond `LARGEST_STRAIN` it goes on straight: the cubic would turn down.
    """
    if strain <= 0.0:
        return 0.0
    p1, p2, p3, p4 = law.envelope_N
    e = min(strain, LARGEST_STRAIN)
    slope = 3.0 * p1 * e * e + 2.0 * p2 * e + p3
    return ((p1 * e + p2) * e + p3) * e + p4 + slope * (strain - e)


def permanent_set(law: TendonLaw, state: TendonState) -> float:
    """Return the strain at which the tendon goes slack when it is let go now."""
    most = state.strain if state.phase == "loading" else state.most[0]
    return law.gamma * most


def stretched(law: TendonLaw, state: TendonState, strain: float) -> TendonState:
    """Return the tendon after its strain has moved straight to `strain`."""
    if state.phase == "loading":
        if strain >= state.strain or state.strain <= UNTOUCHED:
            return replace(state, strain=strain, tension_N=envelope_N(law, strain))
        now = (state.strain, state.tension_N)
        return _let_go(law, replace(state, phase="unloading", cycle=1, most=now, anchor=now), strain)
    if state.phase == "unloading":
        if strain <= state.strain:
            return _let_go(law, state, strain)
        taut = state.tension_N > 0.0
        anchor = (state.strain, state.tension_N) if taut else (_foot(law, state), 0.0)
        return _pulled_again(law, replace(state, phase="reloading", anchor=anchor), strain)
    if strain >= state.strain:
        return _pulled_again(law, state, strain)
    now = (state.strain, state.tension_N)
    turned = replace(state, phase="unloading", anchor=now)
    if state.strain > state.most[0] + TOUCH:
        turned = replace(turned, most=now, cycle=1)
    elif state.tension_N > 0.0:
        turned = replace(turned, cycle=state.cycle + 1)
    return _let_go(law, turned, strain)


def strain_at(law: TendonLaw, state: TendonState, tension_N: float) -> float:
    """Return the strain at which the tendon, moved there straight, has a tension [N] of 0 or more.

    At zero tension: where it just goes slack.

    Raises:
        ValueError: the law's tension does not reach so high.
    """

    def excess(strain: float) -> float:
        return stretched(law, state, strain).tension_N - tension_N

    if tension_N >= state.tension_N:
        low, high = state.strain, max(state.strain, LARGEST_STRAIN)
        if excess(high) < 0.0:
            raise ValueError(f"no strain up to {high:g} has a tension of {tension_N:g} N")
        if tension_N == 0.0:
            return low
        if excess(low) >= 0.0:
            return low
    else:
        low, high = permanent_set(law, state), state.strain
        if tension_N == 0.0 or excess(low) >= 0.0:
            return low
    return float(brentq(excess, low, high, xtol=1e-15, rtol=1e-14))


def tension_along(law: TendonLaw, strains: Array) -> Array:
    """Return the tension along a history of strains of a new tendon, same shape (r,) [N]."""
    state = TendonState()
    result = np.empty(len(strains))
    for row, strain in enumerate(strains):
        state = stretched(law, state, float(strain))
        result[row] = state.tension_N
    return result


def _foot(law: TendonLaw, state: TendonState) -> float:
    """Return the strain at which a slack tendon becomes taut again.

    Many cycles shift it at most half of the way to the turn (the ten measured ones by two fifths).
    """
    slack = law.gamma * state.most[0]
    return min(slack + (state.cycle - 1) * law.beta, 0.5 * (slack + state.most[0]))


def _let_go(law: TendonLaw, state: TendonState, strain: float) -> TendonState:
    """Return the tendon on its unloading curve (Eqs 1-4)."""
    slack, (turn, top_N) = law.gamma * state.most[0], state.anchor
    tension = 0.0
    if strain > slack and top_N > 0.0:
        q = law.a_n * state.most[0] + law.b_n
        rise = turn**q - slack**q - q * slack ** (q - 1.0) * (turn - slack)
        here = strain**q - slack**q - q * slack ** (q - 1.0) * (strain - slack)
        tension = top_N * max(here, 0.0) / rise if rise > 0.0 else top_N
    return replace(state, strain=strain, tension_N=tension)


def _pulled_again(law: TendonLaw, state: TendonState, strain: float) -> TendonState:
    """Return the tendon on its reloading line, or on the envelope beyond where they meet."""
    foot, (start, start_N) = _foot(law, state), state.anchor
    turn, top_N = state.most[0], law.phi ** (state.cycle - 1) * state.most[1]
    slope = top_N / (turn - foot)
    if start < turn - TOUCH:
        slope = max(slope, (top_N - start_N) / (turn - start))
    if strain > _meeting(law, start, start_N, slope) + TOUCH:
        return TendonState(strain, envelope_N(law, strain))
    tension = max(start_N + slope * (strain - start), 0.0)
    return replace(state, strain=strain, tension_N=tension)


@lru_cache(maxsize=256)
def _meeting(law: TendonLaw, start: float, start_N: float, slope: float) -> float:
    """Return the first strain beyond `start` at which the line is not below the envelope; inf: none."""
    p1, p2, p3, p4 = law.envelope_N
    roots = np.roots([p1, p2, p3 - slope, p4 - start_N + slope * start])
    beyond = [root.real for root in roots if abs(root.imag) < 1e-9 and root.real > start]
    return min(beyond, default=math.inf)


# ----------------------------------------------------------------------------------------------------
# The Prandtl-Ishlinskii model of hysteresis: a weighted sum of plays (Nayar 2022, Eqs 29-34).
#
# The weights are found by non-negative least squares, which has one answer; the paper takes a general
# optimiser. With non-negative weights every loop is symmetric about its middle and bends one way: a joint
# that is slack about zero and follows without a loop beyond cannot be told so. With dead zones before the
# plays (as in Kuhnen 2003, Eur. J. Control 9, 407-418, but in front, so that the weights stay linear) it
# can.

OPERATORS = 10  # m of the paper: one more operator than that, the first without a threshold


@dataclass(frozen=True)
class PrandtlIshlinskii:
    """Weighted plays.

    Attributes:
        thresholds: r_i of Eq. 33, half of each play's width, shape (m + 1,), in the input's unit.
        weights: w_h, shape (z (m + 1),), output per input; those of the first dead zone first.
        rmse: of the fit, in the output's unit.
        dead_zones: half widths of the memoryless dead zones before the plays, shape (z,); (0,): none.
    """

    thresholds: Array
    weights: Array
    rmse: float
    dead_zones: Array = field(default_factory=lambda: np.zeros(1))

    def __call__(self, values: Array) -> Array:
        """Return the output along the input `values`, from rest, same shape (r,) (Eq. 32)."""
        return _outputs(values, self.dead_zones, self.thresholds) @ self.weights


def identify(
    values: Array, measured: Array, operators: int = OPERATORS, dead_zones: int = 0
) -> PrandtlIshlinskii:
    """Return the model that fits a measured history from rest best (Eqs 33-34).

    Input and output (r,); `operators` is m of Eq. 33; so many dead zones stand before the plays, besides
    none: 0 is the paper's model.

    Raises:
        InputError: fewer rows than weights, a missing value, or an input that never moves.
    """
    if len(values) != len(measured) or len(values) <= operators:
        rows = f"{len(values)} inputs and {len(measured)} outputs"
        raise InputError(f"Prandtl-Ishlinskii model: {rows} for {operators + 1} weights")
    if not (np.isfinite(values).all() and np.isfinite(measured).all()):
        raise InputError("Prandtl-Ishlinskii model: inputs and outputs must be finite numbers")
    largest = float(np.abs(values).max())
    if largest == 0.0:
        raise InputError("Prandtl-Ishlinskii model: the input never leaves zero")
    thresholds = largest * np.arange(operators + 1) / (operators + 1)
    zones = largest * np.arange(dead_zones + 1) / (dead_zones + 1)
    weights, left = nnls(_outputs(values, zones, thresholds), measured)
    return PrandtlIshlinskii(thresholds, weights, float(left) / len(values) ** 0.5, zones)


def _outputs(values: Array, dead_zones: Array, thresholds: Array) -> Array:
    """Return the outputs of all plays behind all dead zones, shape (r, z k)."""
    behind = [np.copysign(np.maximum(np.abs(values) - zone, 0.0), values) for zone in dead_zones]
    return np.concatenate([plays(own, thresholds) for own in behind], axis=1)


# ----------------------------------------------------------------------------------------------------
# Modified kinematics (MK) of the transseptal robot: measured dead-bands (Nayar 2022, Eqs 23-28).
#
# What its joints did with the quadlumen tube in place, fitted by the paper on loops from zero to one side.
# Nothing is printed for negative displacement.
#
# Units. Eq. 25 gives degrees per millimetre with the printed alpha and beta: so its two lines meet at l*,
# to 0.04 deg at 3.7 deg. In radians they would meet as well, at 211 deg, and 6 mm would bend by 85 rad.
#
# As printed the robot is not straight at zero displacement: Eq. 25 gives -4.2 deg, Eq. 26 the lower
# plateau, 10 or 12 deg. The paper's loops are of a joint that has been moved before.


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


def torsion_rad(segment: CatheterSegment, displacement_m: Array, calibration: TorsionCalibration) -> Array:
    """Return the torsion along displacements of 0 or more, shape (r,) [rad]: Eq. 26 with a history.

    The angle keeps its value until one of Eq. 26's two branches pushes it: on loops that reach the
    upper plateau this is Eq. 26, and the rows' spacing does not matter. NaN where no angle exists.
    """
    loading = plateau_branch(segment, displacement_m - calibration.width_m, calibration)
    unloading = plateau_branch(segment, displacement_m, calibration)
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


def plateau_branch(segment: CatheterSegment, displacement_m: Array, calibration: TorsionCalibration) -> Array:
    pure = angle_rad(segment, np.maximum(displacement_m, 0.0))
    return np.minimum(pure, calibration.upper_rad - calibration.lower_rad) + calibration.lower_rad


# ----------------------------------------------------------------------------------------------------
# Calibration of modified kinematics (MK) from measured loops of one joint (Nayar 2022, Section IV-C).
#
# The paper fits two lines to the bending joint's loops by least squares and tunes the torsion joints'
# plateaus and dead-band; here both are least squares.

_LEAST_ROWS = 4  # on each of two lines
_FLATTEST = 1e-6  # deg/mm: a line as flat as that has no alpha of its own


def calibrate_bending(
    segment: CatheterSegment, displacement_m: Array, angle_rad: Array
) -> BendingCalibration:
    """Return Eq. 25's two lines that fit loops of a bending joint best, displacements of 0 or more, (r,).

    The turn l* is sought among the displacements that occur; the lines need not meet there.

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
    """Return Eq. 26's plateaus and dead-band that fit a torsion joint's loops best, displacements >= 0, (r,).

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


# ----------------------------------------------------------------------------------------------------
# TE: kinematics of the 4-DoF robot with tendons that stretch (Nayar 2023, Section III), as a static model.
#
# A bending tendon's displacement is Eq. 12 of the angle plus its elongation, strain times length, by
# `elongation.SIMPLIFIED`; its tension is what `joint_force` asks for. Between the loading and the unloading
# curve the joint holds its angle: the tendon's tension alone changes. Each pair has two tendons, the other
# one slack; each has its own history, from new. Torsion and advance are kinematic (Section IV-B). The
# joint's force is the measured one, not the robot's bending stiffness.

MODEL = "te"


@dataclass(frozen=True)
class Side:
    """One tendon of a bending pair and what it has bent.

    Attributes:
        angle_deg: bend toward this side, >= 0 [deg].
        turn_deg: to which it was last loaded [deg].
        tendon: its history.
    """

    angle_deg: float = 0.0
    turn_deg: float = 0.0
    tendon: TendonState = field(default_factory=TendonState)


@dataclass(frozen=True)
class StretchingJoint:
    """A bending joint with its tendons' length and law and its own force law.

    Attributes:
        segment: the joint.
        length_m: of each tendon.
        force: its tendon's tension over the bend.
        law: of the tendons.
        mu, path_rad: friction of the tendons, and the angle by which they turn before the joint. In the
            joint they turn by half of the bend, in the mean over its gaps.
        elastic_N_m_per_rad: the joint's stiffness where `force` is None: then it is elastic.
    """

    segment: CatheterSegment
    length_m: float
    force: JointForce | None
    law: TendonLaw = SIMPLIFIED
    mu: float = 0.0
    path_rad: float = 0.0
    elastic_N_m_per_rad: float = 0.0

    def on_N(self, angle_deg: float) -> float:
        """Return the tension at the drive that bends the joint further [N]."""
        return self._at_joint_N(angle_deg, None) * self._rubbed(angle_deg)

    def back_N(self, angle_deg: float, turn_deg: float) -> float:
        """Return the tension at the drive at which the joint, let go at `turn_deg`, comes back [N]."""
        return self._at_joint_N(angle_deg, turn_deg) / self._rubbed(angle_deg)

    def _at_joint_N(self, angle_deg: float, turn_deg: float | None) -> float:
        if self.force is None:
            angle = math.radians(angle_deg)
            return self.elastic_N_m_per_rad * angle / float(arm_m(self.segment, angle))
        if turn_deg is None:
            return float(loading_N(self.force, angle_deg))
        return float(unloading_N(self.force, angle_deg, turn_deg))

    def _rubbed(self, angle_deg: float) -> float:
        return math.exp(self.mu * (self.path_rad + 0.5 * math.radians(angle_deg)))


def te(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures with stretching tendons, row after row from new tendons at rest.

    The run's residual is the unbalanced moment of the bending joint that moves, largest of both [N m].

    Raises:
        InputError: a load that the model does not have, a tendon without a length or with a stiffness
            of its own, or a displacement out of the range of the joint or of the measured tendon.
    """
    require_unloaded(robot, inputs, gravity_mps2, MODEL)
    require_rigid_mount(robot, MODEL)
    joints = stretching_joints(robot)
    values, residual = [], np.zeros(len(inputs))
    tension = np.zeros((len(inputs), len(robot.tendons)))
    for pair, item in enumerate(robot.tendons):
        if item.name not in joints:
            angle, left = pure_joint(robot, inputs, pair, MODEL)
            values.append(angle)
            continue
        displacement = inputs.tendon[:, pair]
        drawn = np.stack([displacement, -displacement], axis=1)
        angle, tension[:, pair], left = bent_along(
            joints[item.name], drawn, partial(channel_at, robot, inputs, pair, MODEL)
        )
        values.append(angle)
        residual = np.maximum(residual, left)
    return run_of(robot, inputs, gravity_mps2, MODEL, values, residual, tension)


def stretching_joints(robot: CatheterRobot) -> dict[str, StretchingJoint]:
    """Return the bending joints of a robot of the 4-DoF design by their pairs' names.

    Raises:
        InputError: a pair has no length, or a stiffness of its own.
    """
    found = {}
    for pair, item in enumerate(robot.tendons):
        if item.name not in bent_by(robot):
            continue
        where = f"{robot.name}: tendons.{item.name}."
        if item.length_m == 0.0:
            raise InputError(f"{where}length_mm = 0: static model {MODEL!r} needs the tendon's length")
        if math.isfinite(item.stiffness_N_per_m):
            shown = f"{item.stiffness_N_per_m * 1e-3:g}"
            raise InputError(
                f"{where}stiffness_N_per_mm = {shown}: static model {MODEL!r} has its own law; must be inf"
            )
        index = moved_segment(robot, pair)
        force = PROXIMAL if index == 0 else DISTAL
        found[item.name] = StretchingJoint(robot.segments[index], item.length_m, force)
    return found


def displaced(joint: StretchingJoint, side: Side, displacement_m: float) -> Side:
    """Return a side after its tendon's displacement has moved straight to `displacement_m`.

    Raises:
        ValueError: the joint would bend beyond its limit, or the tendon stretch beyond what was measured.
    """
    limit = math.degrees(joint.segment.limit_rad)

    def tendon(angle_deg: float) -> TendonState:
        own = displacement_m - float(pulled_m(joint.segment, math.radians(angle_deg)))
        return stretched(joint.law, side.tendon, own / joint.length_m)

    def too_tight(angle_deg: float) -> float:
        return tendon(angle_deg).tension_N - joint.on_N(angle_deg)

    def too_loose(angle_deg: float) -> float:
        state = tendon(angle_deg)
        excess = state.tension_N - joint.back_N(angle_deg, side.turn_deg)
        # where the joint asks for no tension it still follows the tendon, but does not slacken it
        slack = permanent_set(joint.law, state) - state.strain if state.tension_N == 0.0 else 0.0
        return excess - max(slack, 0.0)

    angle, turn = side.angle_deg, side.turn_deg
    if too_tight(angle) > 0.0:
        if too_tight(limit) > 0.0:
            raise ValueError(f"bends beyond its joint's limit of {limit:.4g} deg")
        # the first such angle: where the joint asks for no tension, any further one balances too
        angle = turn = _edge(too_tight, angle, limit, zero_is_low=False)[1]
    elif too_loose(angle) < 0.0:
        angle = _edge(too_loose, 0.0, angle, zero_is_low=True)[0]
    moved = tendon(angle)
    if moved.strain > LARGEST_STRAIN:
        raise ValueError(f"stretches its tendon by more than the measured {100 * LARGEST_STRAIN:.2g} %")
    return Side(angle, turn, moved)


def bent_to(joint: StretchingJoint, side: Side, angle_deg: float) -> tuple[Side, float]:
    """Return a side after it has bent straight to `angle_deg`, and the displacement that takes [m].

    The feedforward of Section IV-A: Eq. 12 plus the elongation.
    """
    if angle_deg >= side.angle_deg:
        turn, tension_N = angle_deg, joint.on_N(angle_deg)
    else:
        turn, tension_N = side.turn_deg, joint.back_N(angle_deg, side.turn_deg)
    strain = strain_at(joint.law, side.tendon, tension_N)
    tendon = stretched(joint.law, side.tendon, strain)
    way = float(pulled_m(joint.segment, math.radians(angle_deg))) + joint.length_m * strain
    return Side(angle_deg, turn, tendon), way


def bent_along(
    joint: StretchingJoint, drawn_m: Array, where: Callable[[int], str], path_rad: Array | None = None
) -> tuple[Array, Array, Array]:
    """Return what a joint does along the ways of its two tendons, from new tendons at rest.

    Ways of the tendon toward + and of the one toward - (r, 2) [m]; `where` names a row in a message;
    `path_rad` of each row, in place of the joint's, (r,). Returns angle [rad], the tighter tendon's tension
    [N] and the moment left over [N m], each (r,).

    Raises:
        InputError: a way to which no angle belongs, or beyond what was measured of the tendon.
    """
    sides = [Side(), Side()]
    angle, tension, left = (np.zeros(len(drawn_m)) for _ in range(3))
    for row, drawn in enumerate(drawn_m):
        if path_rad is not None:
            joint = replace(joint, path_rad=float(path_rad[row]))
        try:
            sides = [displaced(joint, side, float(own)) for side, own in zip(sides, drawn, strict=True)]
        except ValueError as error:
            raise InputError(f"{where(row)}: {error}") from None
        angle[row] = math.radians(sides[0].angle_deg - sides[1].angle_deg)
        tension[row] = max(side.tendon.tension_N for side in sides)
        left[row] = max(_unbalanced_Nm(joint, side) for side in sides)
    return angle, tension, left


def _unbalanced_Nm(joint: StretchingJoint, side: Side) -> float:
    """Return by how much the tension lies outside what the joint can hold, as a moment [N m]."""
    high, low = joint.on_N(side.angle_deg), joint.back_N(side.angle_deg, side.turn_deg)
    outside = max(side.tendon.tension_N - high, low - side.tendon.tension_N, 0.0)
    return outside * float(arm_m(joint.segment, math.radians(side.angle_deg)))


def _edge(
    falling: Callable[[float], float], low: float, high: float, zero_is_low: bool
) -> tuple[float, float]:
    """Return the two neighbouring angles [deg] between which a falling function passes zero.

    Where it stays at zero for a while: the end of that stretch if `zero_is_low`, else its beginning.
    """
    for _ in range(60):
        middle = 0.5 * (low + high)
        value = falling(middle)
        if value > 0.0 or (value == 0.0 and zero_is_low):
            low = middle
        else:
            high = middle
    return low, high


# ----------------------------------------------------------------------------------------------------
# What a joint's drive must give, and how its tendons are preconditioned (Nayar 2023, Section I).
#
# The paper names both as what its model of elongation is good for and prints no figure of either. A bending
# joint's tension is that of Algorithm 2; the displacement is Eq. 12 plus the elongation of Algorithm 1. A
# tendon that has once been pulled to the joint's largest tension keeps a set; drawn tight after that it
# follows one line up and down, and takes less displacement than a new one.

_SIZING_STEPS = 60  # of a bend from rest


@dataclass(frozen=True)
class Need:
    """What bending a joint to an angle takes.

    Attributes:
        tension_N: largest at the drive: what the motor holds, and what preconditioning pulls to.
        pure_m: displacement with tendons that do not stretch (Eq. 12).
        new_m: displacement with a new tendon.
        ready_m: displacement with a preconditioned tendon, its set drawn in.
        set_m: by which preconditioning lengthens the tendon for good.
    """

    tension_N: float
    pure_m: float
    new_m: float
    ready_m: float
    set_m: float


def need(joint: StretchingJoint, angle_deg: float) -> Need:
    """Return what a joint's drive must give to bend it from rest to `angle_deg`, above 0."""
    way = np.linspace(0.0, angle_deg, _SIZING_STEPS + 1)[1:]
    tension_N = max(joint.on_N(float(angle)) for angle in way)
    ready, lengthened = preconditioned(joint, tension_N)
    return Need(
        tension_N=tension_N,
        pure_m=float(pulled_m(joint.segment, math.radians(angle_deg))),
        new_m=_way_m(joint, Side(), way),
        ready_m=_way_m(joint, Side(tendon=ready), way) - lengthened,
        set_m=lengthened,
    )


def preconditioned(
    joint: StretchingJoint, tension_N: float, cycles: int = 1, law: TendonLaw | None = None
) -> tuple[TendonState, float]:
    """Return a tendon, of the joint's law or another, that was pulled to a tension; its set [m]."""
    law = law or joint.law
    state = TendonState()
    top = strain_at(law, state, tension_N)
    for _ in range(cycles):
        state = stretched(law, state, top)
        state = stretched(law, state, permanent_set(law, state))
    return state, permanent_set(law, state) * joint.length_m


def repeats_m(joint: StretchingJoint, angle_deg: float, law: TendonLaw, ready: bool) -> float:
    """Return by how much the displacement halfway differs from the first bend to the second [m].

    Halfway: at the top the tension, and so the strain, is the same for a new tendon and one that comes back.
    `ready`: whether the tendon, of `law`, has been preconditioned to the tension of that angle, above 0.
    """
    own = replace(joint, law=law)
    tension_N = need(replace(joint, law=SIMPLIFIED), angle_deg).tension_N
    side = Side(tendon=preconditioned(own, tension_N)[0] if ready else TendonState())
    ways = []
    for _ in range(2):
        side, halfway = bent_to(own, side, 0.5 * angle_deg)
        ways.append(halfway)
        side, _ = bent_to(own, side, angle_deg)
        side, _ = bent_to(own, side, 0.0)
    return ways[1] - ways[0]


def _way_m(joint: StretchingJoint, side: Side, way_deg: np.ndarray) -> float:
    ways = []
    for angle in way_deg:
        side, displacement = bent_to(joint, side, float(angle))
        ways.append(displacement)
    return max(ways)


# ----------------------------------------------------------------------------------------------------
# MK, PI and their hybrid as static models of the transseptal robot (Nayar 2022, Section IV-C).
#
# `mk`: Eqs 25-28 with the printed parameters. `hybrid`: MK for the bending joint, PI for both torsion
# joints. `pi`: PI for all three. The paper prints no weights for PI: here they are identified from two
# cycles of the MK loops of the same joints (`training_loop`), so that `pi` and `hybrid` say what a PI model
# makes of those loops, not what the paper's PI model was. In particular a PI model has no offset at rest,
# and a loop where MK's bending has none.
#
# The advance is as it is commanded. Formulas without an equation to solve: the run's residual is zero.

BENDING_LOOP_M = 6e-3  # the largest displacement of the paper's Fig. 8(a)
_STEPS = 120  # of a training loop, each way
_CYCLES = 2

# (robot, inputs, index of a pair, name of the model) -> angle per row, shape (r,) [rad]
Law = Callable[[CatheterRobot, Inputs, int, str], Array]


def mk(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures by modified kinematics, row after row; displacements of 0 or more.

    Raises:
        InputError: a load that the model does not have, or a displacement out of its range.
    """
    return _run(robot, inputs, gravity_mps2, "mk", {"bending": _modified, "torsion": _modified})


def pi(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures by Prandtl-Ishlinskii models, row after row; arguments as of `mk`.

    Displacements may be negative: the model is odd.
    """
    return _run(robot, inputs, gravity_mps2, "pi", {"bending": _plays, "torsion": _plays})


def hybrid(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures by MK for bending and PI for torsion, row after row; arguments as of `mk`."""
    return _run(robot, inputs, gravity_mps2, "hybrid", {"bending": _modified, "torsion": _plays})


def training_loop(robot: CatheterRobot, pair: int) -> tuple[Array, Array]:
    """Return the loop from which a joint's PI model is identified: displacement [m], angle [rad].

    From zero to 6 mm of bending, or to the upper plateau of torsion, and back, twice; angles by MK.
    """
    segment = robot.segments[moved_segment(robot, pair)]
    top = BENDING_LOOP_M
    if segment.joint == "torsion":
        top = plateau_displacement_m(segment, _torsion_calibration(robot, pair))
    ramp = np.linspace(0.0, top, _STEPS + 1)
    loop = np.concatenate([ramp[:1], *_CYCLES * (ramp[1:], ramp[-2::-1])])
    return loop, _by_mk(robot, pair, loop)


def identified(robot: CatheterRobot, pair: int) -> PrandtlIshlinskii:
    """Return the PI model of the joint that a pair moves, identified from `training_loop`."""
    return identify(*training_loop(robot, pair))


def _run(
    robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array, model: str, laws: Mapping[str, Law]
) -> StaticRun:
    require_unloaded(robot, inputs, gravity_mps2, model)
    require_rigid_mount(robot, model)
    values = []
    for pair in range(len(robot.tendons)):
        segment = robot.segments[moved_segment(robot, pair)]
        if segment.joint == "prismatic":
            values.append(inputs.tendon[:, pair])
            continue
        angle = laws[segment.joint](robot, inputs, pair, model)
        if np.isnan(angle).any():
            raise beyond(robot, inputs, int(np.argmax(np.isnan(angle))), pair, segment, model)
        values.append(angle)
    return run_of(robot, inputs, gravity_mps2, model, values, np.zeros(len(inputs)))


def _modified(robot: CatheterRobot, inputs: Inputs, pair: int, model: str) -> Array:
    displacement = inputs.tendon[:, pair]
    below = displacement < 0.0
    if below.any():
        row = int(np.argmax(below))
        raise InputError(f"{channel_at(robot, inputs, pair, model, row)}: calibrated for 0 or more only")
    return _by_mk(robot, pair, displacement)


def _by_mk(robot: CatheterRobot, pair: int, displacement: Array) -> Array:
    segment = robot.segments[moved_segment(robot, pair)]
    if segment.joint == "bending":
        angle = bending_rad(segment, displacement)
        return np.where(angle <= largest_angle_rad(segment), angle, np.nan)
    return torsion_rad(segment, displacement, _torsion_calibration(robot, pair))


def _plays(robot: CatheterRobot, inputs: Inputs, pair: int, model: str) -> Array:
    segment = robot.segments[moved_segment(robot, pair)]
    angle = identified(robot, pair)(inputs.tendon[:, pair])
    return np.where(np.abs(angle) <= largest_angle_rad(segment), angle, np.nan)


def _torsion_calibration(robot: CatheterRobot, pair: int) -> TorsionCalibration:
    return TORSION_PROXIMAL if moved_segment(robot, pair) == 0 else TORSION_DISTAL
