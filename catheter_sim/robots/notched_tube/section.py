"""The cross-section that a notch leaves of the wall, and the stress of its superelastic metal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.robots.notched_tube.spec import NotchedSegment, Superelastic

# ----------------------------------------------------------------------------------------------------
# The stress of a superelastic metal: linear, then a plateau of a lower slope, in tension and compression.
#
# York et al. 2015 (doi 10.1109/ICRA.2015.7139423) and Swaney et al. 2017 (doi 10.1115/1.4034575): a flat
# plateau, lower in tension than in compression. Pacheco et al. 2021 (J. Medical Robotics Research): 0.08 of
# the modulus beyond 2 % strain.


def knees(metal: Superelastic) -> tuple[float, float]:
    """Return the strains at which the plateaus begin, of tension and compression, both above zero."""
    return metal.tension_plateau_Pa / metal.modulus_Pa, metal.compression_plateau_Pa / metal.modulus_Pa


def beyond_knees(metal: Superelastic, strain: Array) -> Array:
    """Return how far a strain lies beyond its knee, with its sign; 0 between the knees."""
    tension, compression = knees(metal)
    above = np.maximum(strain - tension, 0.0) if math.isfinite(tension) else np.zeros_like(strain)
    below = np.minimum(strain + compression, 0.0) if math.isfinite(compression) else np.zeros_like(strain)
    return above + below


def stress(metal: Superelastic, strain: Array) -> Array:
    """Return the stress at a strain [Pa]."""
    return metal.modulus_Pa * (strain - (1.0 - metal.plateau_slope) * beyond_knees(metal, strain))


# ----------------------------------------------------------------------------------------------------
# The cross-section that a notch leaves of the tube's wall: exact integrals, and points to integrate with.
#
# York et al. 2015 (doi 10.1109/ICRA.2015.7139423), Eqs 1-2, and Swaney et al. 2017 (doi 10.1115/1.4034575)
# give area and centroid of the flat cut as those of two circular segments. Here with the second moments,
# and for the radial cut as well, at any depth: below the axis, above it, and 0.
#
# All is measured across the tube from its axis, x toward the notch. `centroid_m` is York's ybar: the
# distance of the centroid, at x = -ybar, on which the neutral plane of a linear metal lies.


@dataclass(frozen=True)
class Section:
    """Integrals over a cross-section.

    Attributes:
        area_m2: A.
        centroid_m: ybar, distance of the centroid from the axis, away from the notch [m].
        second_moment_m4: about the centroid, of bending toward the notch.
        lateral_second_moment_m4: of bending at right angles to that.
        torsion_constant_m4: Saint-Venant's J.
        warping_constant_m6: Cw; 0 of a section that is closed.
    """

    area_m2: float
    centroid_m: float
    second_moment_m4: float
    lateral_second_moment_m4: float
    torsion_constant_m4: float
    warping_constant_m6: float


@lru_cache(maxsize=256)  # the same for all notches of a segment
def section(segment: NotchedSegment) -> Section:
    """Return what a segment's notches leave of the tube."""
    outer = _cut_disc(segment, segment.outer_radius_m)
    inner = _cut_disc(segment, segment.inner_radius_m)
    area, first, across, lateral = (float(value) for value in outer - inner)
    centroid = first / area
    bending = across - area * centroid**2
    if half_angle(segment, segment.inner_radius_m) >= math.pi:
        return Section(area, centroid, bending, lateral, bending + lateral, 0.0)
    return Section(area, centroid, bending, lateral, *_open_torsion(segment, area))


def half_angle(segment: NotchedSegment, radius_m: float) -> float:
    """Return the polar angle that is left of the circle of `radius_m`, half, seen from -x [rad].

    0: nothing is left; pi: the cut does not reach it.
    """
    reach = segment.notch_depth_m - segment.outer_radius_m
    edge = segment.outer_radius_m if segment.cut == "radial" else radius_m
    return math.acos(min(max(reach / edge, -1.0), 1.0))


def _cut_disc(segment: NotchedSegment, radius_m: float) -> Array:
    """Return area, first moment and second moments across and laterally of what is left of a disc."""
    alpha, r = half_angle(segment, radius_m), radius_m
    sine, cosine = math.sin(alpha), math.cos(alpha)
    product = sine * cosine
    if segment.cut == "radial":  # circular sectors
        quarter = r**2 / 4.0
        moments = (alpha, r * 2.0 / 3.0 * sine, quarter * (alpha + product), quarter * (alpha - product))
    else:  # circular segments
        more = 2.0 * sine**2 * product
        moments = (
            alpha - product,
            r * 2.0 / 3.0 * sine**3,
            r**2 / 4.0 * (alpha - product + more),
            r**2 / 12.0 * (3.0 * (alpha - product) - more),
        )
    return r**2 * np.array(moments)


def _open_torsion(segment: NotchedSegment, area: float) -> tuple[float, float]:
    """Return J and Cw of the wall that is left, as a thin circular strip.

    J = b t^3 (1 - 0.63 t / b) / 3 of a strip of width b. Cw = 2 t r^5 / 3 (a^3 - 6 (sin a - a cos a)^2 /
    (a - sin a cos a)) of a circular arc of half angle a about its shear centre (Young and Budynas 2002,
    Roark's formulas, Table 10.2).
    """
    wall = segment.outer_radius_m - segment.inner_radius_m
    middle = 0.5 * (segment.outer_radius_m + segment.inner_radius_m)
    width = area / wall
    torsion = width * wall**3 / 3.0 * max(1.0 - 0.63 * wall / width, 0.3)
    a = 0.5 * width / middle
    lever = (math.sin(a) - a * math.cos(a)) ** 2 / (a - math.sin(a) * math.cos(a))
    return torsion, 2.0 * wall * middle**5 / 3.0 * max(a**3 - 6.0 * lever, 0.0)


def torsion_stiffness(segment: NotchedSegment, modulus_Pa: float, poisson_ratio: float) -> float:
    """Return the moment about the tube that twists one notch by a radian [N m/rad].

    Both ends of a notch are held plane by the uncut tube. So the stiffness is G J / h / (1 - tanh(u) / u),
    u = h / 2 times sqrt(G J / (E Cw)) (Vlasov's theory). J and Cw are those of a thin wall: within some
    tens of percent of the true value.
    """
    shape, height = section(segment), segment.notch_height_m
    twist = modulus_Pa / (2.0 * (1.0 + poisson_ratio)) * shape.torsion_constant_m4
    if shape.warping_constant_m6 == 0.0:
        return twist / height
    u = 0.5 * height * math.sqrt(twist / (modulus_Pa * shape.warping_constant_m6))
    held = u * u / 3.0 if u < 1e-3 else 1.0 - math.tanh(u) / u
    return twist / height / held


def fibres(segment: NotchedSegment, radial: int = 6, around: int = 16) -> Array:
    """Return points that integrate over the section: x from its centroid, y and area, shape (f, 3) [SI].

    Gauss-Legendre over the wall's thickness and over the angle that is left at each radius. `around` is even:
    the first half of each radius' points has y < 0, in the order that mirrors the second half. `radial`:
    points over the thickness; `around`: points over the angle at each.
    """
    (nodes_r, weights_r), (nodes_a, weights_a) = _gauss(radial), _gauss(around)
    low, high = segment.inner_radius_m, segment.outer_radius_m
    reach = segment.notch_depth_m - segment.outer_radius_m
    if segment.cut == "flat" and reach > low:  # the lowest radii have nothing left
        low = reach
    points = []
    for node, weight in zip(nodes_r, weights_r, strict=True):
        r = 0.5 * (high + low) + 0.5 * (high - low) * node
        alpha = half_angle(segment, r)
        area = r * 0.5 * (high - low) * weight * alpha * weights_a
        points.append(np.stack([-r * np.cos(alpha * nodes_a), r * np.sin(alpha * nodes_a), area], axis=1))
    found = np.concatenate(points)
    found[:, 0] += section(segment).centroid_m
    return found


@lru_cache(maxsize=16)
def _gauss(count: int) -> tuple[Array, Array]:
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return nodes, weights


def closing_angle(segment: NotchedSegment) -> float:
    """Return the bend at which a notch's two edges touch, h / (r_o + ybar) [rad].

    Seen from the arc's centre the neutral plane, of the length h, has the radius r_o + ybar then.
    """
    return segment.notch_height_m / (segment.outer_radius_m + section(segment).centroid_m)


def closed_stiffness(segment: NotchedSegment, modulus_Pa: float) -> float:
    """Return what resists further bending of a closed notch [N m/rad]: as stiff as uncut tube (assumed)."""
    ring = math.pi / 4.0 * (segment.outer_radius_m**4 - segment.inner_radius_m**4)
    return modulus_Pa * ring / segment.notch_height_m
