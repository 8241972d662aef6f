"""The printed model: equal arcs of constant curvature, and Castigliano's theorem with friction at corners.

York et al. 2015 (doi 10.1109/ICRA.2015.7139423), Swaney et al. 2017 (doi 10.1115/1.4034575). The papers
were read in abstract only; the equations are those of the authors' statics script as it stands, with their
equation numbers, in the public repository nepacheco/MastersThesis (Wrist_statics.m, 2020), and derived
again here. Angles are of one notch. kappa is the curvature of the tube's axis, ybar as in `section`.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.notched_tube.spec import NotchedSegment, Superelastic
from catheter_sim.kinds.notched_tube.theory.section import fibres, section
from catheter_sim.kinds.notched_tube.theory.stress import stress


def curvature_of_bend(bend_rad: Array, height_m: float, centroid_m: float) -> Array:
    """Return the axis' curvature of a notch bent by so much [1/m].

    The neutral plane, ybar outside the axis, keeps its length h: theta (1 / kappa + ybar) = h, so that
    theta = kappa h / (1 + ybar kappa), as printed.
    """
    return bend_rad / (height_m - centroid_m * bend_rad)


def arc_length(curvature_per_m: Array, height_m: float, centroid_m: float) -> Array:
    """Return the axis' length in a bent notch, s = h / (1 + ybar kappa) [m]."""
    return height_m / (1.0 + centroid_m * curvature_per_m)


def tendon_displacement(
    curvature_per_m: Array, height_m: float, centroid_m: float, tendon_radius_m: float
) -> Array:
    """Return by how much a bent notch shortens the tendon's path [m].

    As printed: h - 2 (1 / kappa - r_i) sin(kappa h / (2 (1 + ybar kappa))), the tendon straight from edge to
    edge. At kappa = 0 that is 0/0; with theta it is h (1 - sinc) + 2 (ybar + r_i) sin(theta / 2), the same,
    since 1 / kappa = h / theta - ybar. The printed r_i puts the tendon's own line on the inner wall.
    """
    bend = curvature_per_m * arc_length(curvature_per_m, height_m, centroid_m)
    chord = height_m * np.sinc(0.5 * bend / np.pi)
    return height_m - chord + 2.0 * (centroid_m + tendon_radius_m) * np.sin(0.5 * bend)


def curvature_of_displacement(
    displacement_m: Array, height_m: float, centroid_m: float, tendon_radius_m: float
) -> Array:
    """Return the curvature of a notch whose tendon is pulled by so much [1/m], printed as an approximation.

    kappa = dl / (h (r_i + ybar) - dl ybar): exact for a tendon that follows the arc, dl = (r_i + ybar) theta.
    """
    arm = tendon_radius_m + centroid_m
    result: Array = displacement_m / (height_m * arm - displacement_m * centroid_m)
    return result


def bend_of_displacement(
    displacement_m: Array, height_m: float, centroid_m: float, tendon_radius_m: float
) -> Array:
    """Return the bend that shortens a notch's tendon by so much [rad]: `tendon_displacement` inverted.

    By Newton's method from the printed approximation. Below zero displacement, where a tendon is slack, 0.
    """
    pulled = np.maximum(np.asarray(displacement_m, dtype=float), 0.0)
    arm = tendon_radius_m + centroid_m
    bend = pulled / arm
    for _ in range(30):
        half = 0.5 * bend
        error = height_m * (1.0 - np.sinc(half / np.pi)) + 2.0 * arm * np.sin(half) - pulled
        bend = bend - error / (arm * np.cos(half) + height_m * _arc_slope(bend))
    return np.asarray(bend)


def _arc_slope(bend: Array) -> Array:
    """Return the derivative of 1 - sinc(bend / 2) by the bend."""
    small = np.abs(bend) < 1e-3
    safe = np.where(small, 1.0, bend)
    exact = (2.0 * np.sin(0.5 * safe) / safe - np.cos(0.5 * safe)) / safe
    return np.where(small, bend / 12.0, exact)


def corner_loss(bend_rad: Array | float, mu: float) -> Array:
    """Return what share of its tension the tendon keeps at one of a notch's two corners, eta.

    Printed: eta = (sin(g / 2) - mu cos(g / 2)) / (sin(g / 2) + mu cos(g / 2)), g = pi - theta / 2, from the
    balance of a corner that touches in one point: (1 - mu tan(theta / 4)) / (1 + mu tan(theta / 4)). The
    capstan's exp(-mu theta / 2) is the same to second order; at theta = 0.48, mu = 0.2, to 2e-4.
    """
    touch = mu * np.tan(0.25 * np.asarray(bend_rad))
    return np.asarray((1.0 - touch) / (1.0 + touch))


def elastic_moment(segment: NotchedSegment, metal: Superelastic, bend_rad: Array) -> Array:
    """Return the moment that bends a notch, its strain zero on the centroid, shape as `bend_rad` [N m].

    Printed: the derivative by theta of h times the integral of the energy at the strain
    kappa (y - ybar) / (1 + ybar kappa). That strain is theta (y - ybar) / h, so the derivative is the
    integral of stress times (y - ybar). The neutral plane stays on the centroid: where tension reaches its
    plateau before compression does, the section's forces do not add up to the tendon's pull.
    """
    points = fibres(segment, 24, 48)
    distance = -points[:, 0]
    strain = np.multiply.outer(np.asarray(bend_rad, dtype=float), distance) / segment.notch_height_m
    result: Array = stress(metal, strain) @ (distance * points[:, 2])
    return result


def tension_of_bend(
    segment: NotchedSegment, metal: Superelastic, mu: float, notches: int, bend_rad: Array
) -> Array:
    """Return the tension at the actuator that bends each of `notches` notches by `bend_rad` [N].

    Printed: F = (dU / dtheta) / (L eta^(2 n)), L = (r_o + r_i) / 2 + ybar: every notch carries the tension
    that is left behind all 2 n corners, though only the last one does; so all bend alike. L puts the tendon
    in the wall's middle, where the kinematics puts it on the inner wall (r_i): kept as printed.
    """
    arm = 0.5 * (segment.outer_radius_m + segment.inner_radius_m) + section(segment).centroid_m
    return elastic_moment(segment, metal, bend_rad) / (arm * corner_loss(bend_rad, mu) ** (2 * notches))


def bend_of_tension(
    segment: NotchedSegment, metal: Superelastic, mu: float, notches: int, tension_N: Array
) -> Array:
    """Return `tension_of_bend` inverted, up to where the notches close [rad]."""
    closed = segment.notch_height_m / (segment.outer_radius_m + section(segment).centroid_m)
    grid = np.linspace(0.0, closed, 2001)
    needed = np.maximum.accumulate(tension_of_bend(segment, metal, mu, notches, grid))
    return np.interp(tension_N, needed, grid)
