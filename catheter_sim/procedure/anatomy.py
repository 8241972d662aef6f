"""A left atrium and a mitral valve as data, and random ones.

Valve frame: origin in the middle of the annulus, +z along its axis into the atrium, +x toward the septum,
right-handed. The atrium is an ellipsoid cut off by the plane of the annulus; its middle and its third
semi-axis follow from its height and from the annulus that it ends in.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from catheter_sim.anatomy.ranges import drawn, middles
from catheter_sim.arrays import Array

# Least and largest value of every number of a random anatomy. Assumed, unless another source is given: an
# enlarged atrium, as where a valve leaks.
RANGES: dict[str, tuple[float, float]] = {
    "atrium_x_m": (25e-3, 30e-3),
    "atrium_y_m": (24e-3, 29e-3),
    "atrium_height_m": (54e-3, 64e-3),
    # assumed, from clip procedures: the septum is punctured 40 to 50 mm above the annulus
    "fossa_y_m": (-4e-3, 4e-3),
    "fossa_z_m": (42e-3, 48e-3),
    "fossa_radius_m": (6e-3, 9e-3),
    "annulus_along_m": (16e-3, 20e-3),
    "annulus_across_m": (14e-3, 17e-3),
    # EVEREST II trial, criteria for clips: depth at most 11 mm, length at least 2 mm
    "coaptation_depth_m": (4e-3, 10e-3),
    "coaptation_length_m": (4e-3, 8e-3),
    # so that the implant turns by at most the 45 deg that are clinically required: Nayar 2022, Section IV-E
    "coaptation_rad": (math.radians(-40.0), math.radians(40.0)),
    # Nayar 2022, Section IV-E: the proximal torsion joint aligned the robot by 20 to 40 deg
    "roll_rad": (math.radians(20.0), math.radians(40.0)),
}
WALL_M = 2.5e-3  # assumed
LEAFLET_M = 1.2e-3  # thickness; assumed


@dataclass(frozen=True)
class Anatomy:
    """One patient, as far as the procedure meets her.

    Attributes:
        atrium_x_m, atrium_y_m: horizontal semi-axes of the atrium.
        atrium_height_m: of its roof above the annulus.
        fossa_y_m, fossa_z_m: middle of the oval fossa, on the septal side of the wall.
        fossa_radius_m: within it the septum may be punctured.
        annulus_along_m, annulus_across_m: semi-axes of the annulus, along and across the coaptation line.
        coaptation_depth_m: of the leaflets' first contact below the annulus.
        coaptation_length_m: of the leaflets' free margins, which lie against each other below that.
        coaptation_rad: turn of the coaptation line about +z, from +y.
        roll_rad: of the outer sheath about its axis: between the robot's home bending plane and the
            plane that contains the sheath's axis and the valve's.
    """

    atrium_x_m: float
    atrium_y_m: float
    atrium_height_m: float
    fossa_y_m: float
    fossa_z_m: float
    fossa_radius_m: float
    annulus_along_m: float
    annulus_across_m: float
    coaptation_depth_m: float
    coaptation_length_m: float
    coaptation_rad: float
    roll_rad: float


def random_anatomy(rng: np.random.Generator, ranges: Mapping[str, tuple[float, float]] = RANGES) -> Anatomy:
    """Return an anatomy whose every number is drawn evenly from its range, in the order of `ranges`."""
    return Anatomy(**drawn(ranges, rng))


def median_anatomy() -> Anatomy:
    """Return the anatomy in the middle of all ranges."""
    return Anatomy(**middles(RANGES))


def semi_axes_m(anatomy: Anatomy) -> Array:
    """Return the semi-axes of the atrium's ellipsoid, shape (3,) [m]."""
    cosine = _cut_cosine(anatomy)
    return np.array(
        [anatomy.atrium_x_m, anatomy.atrium_y_m, anatomy.atrium_height_m / (1.0 + cosine)], dtype=float
    )


def centre_m(anatomy: Anatomy) -> Array:
    """Return the middle of the atrium's ellipsoid, valve frame, shape (3,) [m]."""
    return np.array([0.0, 0.0, semi_axes_m(anatomy)[2] * _cut_cosine(anatomy)])


def _cut_cosine(anatomy: Anatomy) -> float:
    """Return the middle's height over the third semi-axis: the ellipsoid ends as wide as the annulus."""
    annulus = anatomy.annulus_along_m + anatomy.annulus_across_m
    return math.sqrt(1.0 - (annulus / (anatomy.atrium_x_m + anatomy.atrium_y_m)) ** 2)


def inward(anatomy: Anatomy, place: Array) -> Array:
    """Return the unit normal of the wall that points into the atrium, shape (..., 3)."""
    normal = -(place - centre_m(anatomy)) / semi_axes_m(anatomy) ** 2
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def depth_m(anatomy: Anatomy, place: Array) -> Array:
    """Return about how far inside the wall points lie, shape (...) [m]; below 0 outside.

    First order: exact on the wall, within a few per cent nearby.
    """
    scaled = (place - centre_m(anatomy)) / semi_axes_m(anatomy)
    size = np.linalg.norm(scaled, axis=-1)
    slope = np.linalg.norm(scaled / semi_axes_m(anatomy), axis=-1)
    return size * (1.0 - size) / np.maximum(slope, 1e-9)


def septal_point(anatomy: Anatomy, y_m: float, z_m: float) -> Array:
    """Return the point of the septal side of the wall at these coordinates, shape (3,) [m]."""
    axes, middle = semi_axes_m(anatomy), centre_m(anatomy)
    left = 1.0 - (y_m / axes[1]) ** 2 - ((z_m - middle[2]) / axes[2]) ** 2
    return np.array([axes[0] * math.sqrt(max(left, 0.0)), y_m, z_m])


def coaptation_axes(anatomy: Anatomy) -> tuple[Array, Array]:
    """Return unit vectors along the coaptation line and across it, toward the septum; shape (3,) each."""
    cosine, sine = math.cos(anatomy.coaptation_rad), math.sin(anatomy.coaptation_rad)
    return np.array([-sine, cosine, 0.0]), np.array([cosine, sine, 0.0])
