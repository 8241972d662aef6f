"""Exact geometry of one rolling joint with a two-arc profile, and of a rod that crosses it.

Equation numbers are those of chest_tube_2025 (doi 10.1109/LRA.2025.3597860). A function's docstring
gives the printed form where that is wrong, and why. Everything is element by element, so that the
arguments may be arrays of any shape that broadcasts.

Frames. The link below ends in a flat. Its frame has its origin on the flat, where the joint's line
touches at angle 0; x along the flat toward the positive bending side, z away from the flat. The
upper link's frame has its origin on its profile where the two arcs meet (the joint's line), z toward
their centres. Both coincide at angle 0. A positive angle turns z toward x. An offset is the x of a
rod's hole in both frames: positive on the side of positive bending.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array


def active_radius(theta: Array, radius_positive: Array, radius_negative: Array) -> Array:
    """Return the radius [m] of the arc that the joint rolls on at `theta` [rad] (Eq. 12)."""
    return np.where(theta >= 0.0, radius_positive, radius_negative)


def hole_angle(offset: Array, radius: Array) -> Array:
    """Return the angle [rad] of a hole's mouth on its arc, alpha or beta (Eqs 13, 14).

    Printed: arcsin(R / A), which exceeds 1. It must be arcsin(A / R): the mouth lies at the distance
    A from the line on an arc of radius R > A.
    """
    return np.arcsin(np.abs(offset) / radius)


def mouth_height(offset: Array, radius: Array) -> Array:
    """Return z of a hole's mouth in the upper link's frame, R (1 - cos alpha) [m] (in Eqs 3, 18)."""
    return radius * (1.0 - np.cos(hole_angle(offset, radius)))


def line_position(theta: Array, radius: Array) -> tuple[Array, Array]:
    """Return x and z [m] of the upper link's origin in the frame below: the cycloid of pure rolling.

    The arc's centre moves by R theta along the flat at the height R; the line hangs below it at the
    radius R, turned by theta. So x = R (theta - sin theta) and z = R (1 - cos theta), for both signs.
    """
    return radius * (theta - np.sin(theta)), radius * (1.0 - np.cos(theta))


def contact_on_profile(theta: Array, radius: Array) -> tuple[Array, Array]:
    """Return x and z [m] of the contact O in the upper link's frame (Eq. 17).

    Printed: (R sin theta, R (1 - cos theta)) for odd and even links. With the even links' mirrored
    x axis it must be -R sin theta there. In the frame used here, which is not mirrored, the printed
    form holds for all links.
    """
    return radius * np.sin(theta), radius * (1.0 - np.cos(theta))


@dataclass(frozen=True)
class Span:
    """The straight line between a rod's hole mouths in the two links, and how it changes.

    Attributes:
        across, along: x and z from the lower mouth to the upper one, in the frame below [m].
        length: l [m].
        slope: dl/dtheta [m].
        second: d2l/dtheta2 [m].
        along_slope: derivative of `along` [m].
    """

    across: Array
    along: Array
    length: Array
    slope: Array
    second: Array
    along_slope: Array


def span(theta: Array, radius: Array, offset: Array, mouth: Array, countersink: Array) -> Span:
    """Return the rod's free span at `theta` [rad].

    Args:
        theta: bend angle [rad].
        radius: of the active arc [m].
        offset: of the hole [m].
        mouth: z of the upper mouth in the upper link's frame, countersink included [m].
        countersink: depth of the lower mouth below the flat [m].
    """
    sine, cosine = np.sin(theta), np.cos(theta)
    across = radius * (theta - sine) + offset * cosine + mouth * sine - offset
    along = radius * (1.0 - cosine) - offset * sine + mouth * cosine + countersink
    across_slope = along - countersink
    along_slope = radius * theta - offset - across
    length = np.hypot(across, along)
    slope = (across * across_slope + along * along_slope) / length
    along_second = radius - across_slope
    second = (
        across_slope**2 + along_slope**2 + across * along_slope + along * along_second - slope**2
    ) / length
    return Span(across, along, length, slope, second, along_slope)


def rod_curvature(theta: Array, height: Array, height_slope: Array) -> tuple[Array, Array]:
    """Return the curvature theta / s [1/m] of a rod in its gap (in Eq. 8), and its derivative.

    Eq. 8, |M| = EI theta / s, is 0/0 at theta = 0 as printed; sin(theta) / h is the same and smooth.
    """
    sine = np.sin(theta)
    curvature = sine / height
    return curvature, (np.cos(theta) - curvature * height_slope) / height


def turn(
    theta: Array, radius: Array, offset: Array, mouth: Array, clearance: Array, hole_end: Array, length: Array
) -> tuple[Array, Array]:
    """Return the angle phi [rad] by which a rod turns in the upper link, and its derivative (Eqs 2-4).

    Three points that the rod touches, across its clearance, define a circle: P1 at the far end of the
    upper link's hole, P2 at its mouth, P3 at the far end of the hole below. phi is the angle between
    P1 and P2 at the circle's centre, twice the angle between them at P3.

    Printed: A^t in Eq. 2, which is defined nowhere; it is A^l, as the hole is straight. Eqs 2-4 are
    for a rod on the side of positive bending; here `clearance` carries the side's sign, and phi that
    of the turn: positive toward positive bending.

    Args:
        theta: bend angle [rad].
        radius: of the active arc [m].
        offset: of the hole [m].
        mouth: z of the upper mouth in the upper link's frame [m].
        clearance: c, positive on the positive side, 0 for a rod in the neutral plane [m].
        hole_end: z of the far end of the upper link's hole in its frame [m].
        length: of the link below [m].
    """
    sine, cosine = np.sin(theta), np.cos(theta)
    reach = offset + clearance - radius * theta
    x3 = radius * sine + reach * cosine + length * sine
    z3 = radius * (1.0 - cosine) + reach * sine - length * cosine
    x1, z1 = offset + clearance - x3, hole_end - z3
    x2, z2 = offset - clearance - x3, mouth - z3
    phi = 2.0 * np.arctan2(x1 * z2 - z1 * x2, x1 * x2 + z1 * z2)
    # P3 moves as the lower hole's end turns about the contact.
    dx3, dz3 = -reach * sine + length * cosine, reach * cosine + length * sine
    slope = 2.0 * ((z2 * dx3 - x2 * dz3) / (x2**2 + z2**2) - (z1 * dx3 - x1 * dz3) / (x1**2 + z1**2))
    return phi, slope


def closing_angle(radius: Array, offset: Array, mouth: Array, countersink: Array) -> Array:
    """Return the positive angle [rad] at which a hole's mouth meets the other mouth's plane.

    Arguments as in `span`, for rolling toward the positive side; inf where it never does.
    """
    distance = np.hypot(radius - mouth, offset)
    at_lowest = np.arctan2(offset, radius - mouth)
    # A mouth in the middle of the arc's circle gets no nearer: `at_lowest` is zero.
    cosine = (radius + countersink) / np.where(distance > 0.0, distance, 1.0)
    reached = (cosine <= 1.0 + 1e-12) & (at_lowest > 0.0)
    return np.where(reached, at_lowest - np.arccos(np.minimum(cosine, 1.0)), np.inf)
