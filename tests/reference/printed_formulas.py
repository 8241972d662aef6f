"""Printed formulas that only tests hold the package against: a notch's geometry and metal, a rod's gap.

Notches: York et al. 2015 (doi 10.1109/ICRA.2015.7139423), Swaney et al. 2017 (doi 10.1115/1.4034575), as in
`robots.notched_tube.statics`. Gaps: chest_tube_2025 (doi 10.1109/LRA.2025.3597860), as in
`robots.rolling.joint`.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.robots.notched_tube.section import beyond_knees, section
from catheter_sim.robots.notched_tube.spec import NotchedSegment, Superelastic


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


def energy_density(metal: Superelastic, strain: Array) -> Array:
    """Return the energy stored per volume at a strain [J/m^3]: the integral of `stress`."""
    beyond = beyond_knees(metal, strain)
    return 0.5 * metal.modulus_Pa * (strain**2 - (1.0 - metal.plateau_slope) * beyond**2)


def largest_strain(segment: NotchedSegment, bend_rad: float) -> float:
    """Return the outer wall's strain of a notch bent by so much about its centroid.

    York 2015: kappa (y - ybar) / (1 + ybar kappa), y = r_o; the same as (r_o - ybar) theta / h.
    """
    return (segment.outer_radius_m - section(segment).centroid_m) * bend_rad / segment.notch_height_m


def gap_length(theta: Array, height: Array) -> Array:
    """Return the free length s of a rod bent into an arc between its mouths [m] (Eqs 15, 16).

    s = h theta / sin theta, h the height of the upper mouth above the lower one (`Span.along`).
    Printed: h = R^l (1 - cos(alpha - theta)) on the left and R^r (1 - cos(beta + theta)) on the
    right. The first holds for theta > 0 only, the second for theta < 0 only: each takes the radius
    of its own side, where the link rolls on the active one. For theta > 0 the right-hand height is
    R^l (1 - cos theta) + R^r (cos theta - cos(beta + theta)).
    """
    return height / np.sinc(theta / np.pi)
