"""Displacement of an antagonistic pair to the angle of its joint and back: lengths, slack, range.

Nayar 2022, Eqs 1-7, and Nayar 2023, Eqs 12-13. Displacement and angle have the same sign; the pulled
tendon decides, its length is Eq. 3 or 6 of the angle's size. With phi = theta / (2 (n + 1)),

    bending  l = 2 (n + 1) (t (1 - cos phi) + a sin phi)                          2022 Eq. 3, 2023 Eq. 12
    torsion  l = sqrt((r a_t)^2 + h^2) - sqrt((r (a_t - theta))^2 + h^2)          2022 Eq. 6

h = 0 is l = r theta, 2023 Eq. 13. Solved for the angle (2022 Eqs 5, 7), here in forms that lose no digits
near zero, with x = l / (2 (n + 1)) and w = sqrt((r a_t)^2 + h^2),

    bending  tan(phi / 2) = x / (a + sqrt(a^2 + x (2 t - x)))
    torsion  theta = l (2 w - l) / (r (r a_t + sqrt((w - l)^2 - h^2)))

Valid up to the angle at which a bending joint's gaps have closed, or the tendon is unwrapped.

A bending joint whose rest is bent, by rest_rad, has both tendons taut there. Eq. 3 then holds for each
tendon by itself: with the angle counted toward its own side, the pulled one is drawn by l(theta) less
l(rest). "Size" and "sign" of an angle are those of its difference from rest. Between rest and straight
the antagonist lacks up to 4 (n + 1) t (1 - cos) of the rest's half gap angle, 1 um at a rest of 11 deg of
the 2022 robot and 7 um at 30 deg; it is taken to give way.

The antagonist. A bending joint needs less of it than the pulley lets go: it slackens (2022, after
Eq. 4). A torsion joint with h > 0 needs more, as its wrapped length is convex in the angle: by 0.43 mm
of 3.55 mm at 75 deg of the 2022 proximal joint. The paper does not say so; something there must yield.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.arrays import Array
from catheter_sim.kinds.catheter.layout import closing_angle_rad
from catheter_sim.kinds.catheter.spec import CatheterSegment


def pulled_m(segment: CatheterSegment, angle_rad: ArrayLike) -> Array:
    """Return how far the pair is displaced for the angle, with the angle's sign, same shape [m]."""
    angle = np.asarray(angle_rad, dtype=float)
    if segment.joint == "bending":
        side = _side(segment, angle)
        return side * (_drawn_m(segment, side * angle) - _drawn_m(segment, side * segment.rest_rad))
    return np.copysign(_wrapped_m(segment, 0.0) - _wrapped_m(segment, np.abs(angle)), angle)


def drawn_at_rest_m(segment: CatheterSegment, sign: str) -> float:
    """Return by how much a bending joint's tendon, "pos" or "neg", is shorter at rest than straight [m]."""
    return float(_drawn_m(segment, segment.rest_rad if sign == "pos" else -segment.rest_rad))


def released_m(segment: CatheterSegment, angle_rad: ArrayLike) -> Array:
    """Return how much more of the antagonist the joint takes up at the angle, >= 0, same shape [m].

    Nayar 2022, Eq. 4, and the same for Eq. 6.
    """
    angle = np.asarray(angle_rad, dtype=float)
    if segment.joint == "bending":
        side = _side(segment, angle)
        return _drawn_m(segment, -side * segment.rest_rad) - _drawn_m(segment, -side * angle)
    size = np.abs(angle)
    return _wrapped_m(segment, -size) - _wrapped_m(segment, 0.0)


def slack_m(segment: CatheterSegment, angle_rad: ArrayLike) -> Array:
    """Return the slack of the antagonist on a common pulley, same shape [m]; below 0 it must stretch."""
    return np.abs(pulled_m(segment, angle_rad)) - released_m(segment, angle_rad)


def arm_m(segment: CatheterSegment, angle_rad: ArrayLike) -> Array:
    """Return the pulled tendon's moment arm, the slope of `pulled_m`, same shape [m]."""
    angle = np.asarray(angle_rad, dtype=float)
    if segment.joint == "bending":
        phi = _side(segment, angle) * angle / (2 * (segment.rings + 1))
        return segment.half_gap_m * np.sin(phi) + segment.arm_m * np.cos(phi)
    size = np.abs(angle)
    if segment.wrap_height_m == 0.0:
        return np.full(size.shape, segment.tendon_radius_m)
    left = segment.wrap_rad - size
    return segment.tendon_radius_m**2 * left / _wrapped_m(segment, size)


def largest_angle_rad(segment: CatheterSegment) -> float:
    """Return the angle beyond which no displacement reaches: gaps closed, or tendon unwrapped [rad]."""
    return closing_angle_rad(segment) if segment.joint == "bending" else segment.wrap_rad


def angle_rad(segment: CatheterSegment, displacement_m: ArrayLike) -> Array:
    """Return the angle at a displacement of the inextensible pair, same shape [rad].

    NaN where no angle exists: the displacement is beyond that of `largest_angle_rad`.
    """
    displacement = np.asarray(displacement_m, dtype=float)
    size = np.abs(displacement)
    largest = largest_angle_rad(segment)
    side = np.copysign(1.0, displacement)
    most = np.abs(pulled_m(segment, side * largest))
    # the last bit of the largest displacement itself is no reason to refuse it
    size = np.where(size <= most * (1.0 + 1e-12), np.minimum(size, most), np.nan)
    if segment.joint == "bending":
        gaps = 2 * (segment.rings + 1)
        home = _drawn_m(segment, side * segment.rest_rad)
        t, a, x = segment.half_gap_m, segment.arm_m, (size + home) / gaps
        return side * 2.0 * gaps * np.arctan(x / (a + np.sqrt(a * a + x * (2.0 * t - x))))
    whole, radius = _wrapped_m(segment, 0.0), segment.tendon_radius_m
    around = np.sqrt(np.maximum((whole - size) ** 2 - segment.wrap_height_m**2, 0.0))
    angle = size * (2.0 * whole - size) / (radius * (radius * segment.wrap_rad + around))
    return np.copysign(angle, displacement)


def elastic_angle_rad(segment: CatheterSegment, displacement_m: ArrayLike, compliance_m: float) -> Array:
    """Return a bending joint's angle where its pair stretches by `compliance_m` a radian, same shape [rad].

    The pulled tendon's way at the drive is Eq. 3 plus its stretch, which grows with the angle as the
    elastic moment does. NaN where no angle exists. Of any joint if the compliance is 0.
    """
    displacement = np.asarray(displacement_m, dtype=float)
    if compliance_m == 0.0:
        return angle_rad(segment, displacement)
    side = np.copysign(1.0, displacement)
    size = np.abs(displacement)
    turn = side * largest_angle_rad(segment) - segment.rest_rad  # from rest
    reached = np.abs(pulled_m(segment, segment.rest_rad + turn)) + compliance_m * np.abs(turn)
    for _ in range(50):  # convex and rising: Newton's steps come down from above
        angle = segment.rest_rad + turn
        excess = np.abs(pulled_m(segment, angle)) + compliance_m * np.abs(turn) - size
        step = excess / (arm_m(segment, angle) + compliance_m)
        turn = side * np.maximum(np.abs(turn) - step, 0.0)
        if not (np.abs(step) > 1e-14).any():
            break
    return np.where(size <= reached * (1.0 + 1e-12), segment.rest_rad + turn, np.nan)


def _side(segment: CatheterSegment, angle: Array) -> Array:
    """Return 1 where the tendon toward + is the pulled one at a bending joint's angle, else -1."""
    return np.where(angle >= segment.rest_rad, 1.0, -1.0)


def _drawn_m(segment: CatheterSegment, angle: ArrayLike) -> Array:
    """Return by how much the straight tendon is longer than at the angle, counted toward its side [m].

    Nayar 2022, Eqs 1-2.
    """
    phi = np.asarray(angle, dtype=float) / (2 * (segment.rings + 1))
    # 1 - cos as 2 sin^2 of the half: no digits are lost near straight
    versine = 2.0 * np.sin(0.5 * phi) ** 2
    return 2 * (segment.rings + 1) * (segment.half_gap_m * versine + segment.arm_m * np.sin(phi))


def _wrapped_m(segment: CatheterSegment, angle: ArrayLike) -> Array:
    """Return the length of a tendon around a torsion module that has unwound by the angle [m]."""
    around = segment.tendon_radius_m * (segment.wrap_rad - np.asarray(angle, dtype=float))
    return np.hypot(around, segment.wrap_height_m) if segment.wrap_height_m else around
