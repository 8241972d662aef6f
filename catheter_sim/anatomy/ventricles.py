"""The way from a burr hole to a tumour of the posterior third ventricle, as data, and random ones.

Entry frame: origin where the sheath, which was put through a precoronal burr hole and the frontal lobe, ends
in the lateral ventricle; +z along the sheath, inward; +x the robot's bending direction before it is rolled.
From there the way goes through the lateral ventricle, the foramen of Monro and the third ventricle along an
arc of one curvature: the burr hole was planned so. Its plane contains the sheath's axis but for an error of
aim. Ventricles are wide, as where a tumour has closed the aqueduct. Kato 2016 states the approach and the
tumour's size, and no other dimension.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import trimesh

from catheter_sim.anatomy.ranges import drawn, middles
from catheter_sim.anatomy.wall import Wall
from catheter_sim.arrays import Array

# Least and largest value of every number of a random anatomy; assumed, unless another source is given.
RANGES: dict[str, tuple[float, float]] = {
    "lateral_length_m": (22e-3, 27e-3),
    "lateral_radius_m": (9e-3, 12e-3),
    # Zhu 2013 (Asian J Surg 36:74), 11 patients: mean diameters of 5.6 to 7.8 mm in three views; Jean 2019
    # (doi 10.1007/s00701-019-03887-4): mean opening of 32.6 mm^2 in hydrocephalus, 6.4 mm across
    "foramen_along_m": (2.8e-3, 3.9e-3),
    "foramen_across_m": (2.8e-3, 3.9e-3),
    "third_length_m": (25e-3, 30e-3),
    "third_along_m": (9e-3, 11e-3),
    "third_across_m": (6e-3, 8e-3),
    "turn_rad": (math.radians(40.0), math.radians(60.0)),
    "azimuth_rad": (math.radians(-30.0), math.radians(30.0)),
    # by which the foramen lies beside where the sheath was aimed
    "aside_along_m": (-1e-3, 1e-3),
    "aside_across_m": (-1e-3, 1e-3),
}
TUMOUR_RADIUS_M = 10e-3  # Kato 2016, Introduction: soft tumours of 2 cm
SHEATH_M = 2.0e-3  # inner radius of the sheath; assumed: a robot of 3.4 mm and room to slide
_FORAMEN_M = 2e-3  # length of its canal; assumed ("oval-shaped cylinder", Jean 2019)
_FUNNEL_M = 6e-3  # over which the ventricles narrow to it; assumed
_WALL_M = 8e-3  # of the wall's blocks, outward; of no matter
AROUND = 16  # cells of the wall


@dataclass(frozen=True)
class Ventricles:
    """One patient, as far as the robot meets her.

    Attributes:
        lateral_length_m: of the way from the sheath's end to the foramen's middle.
        lateral_radius_m: of the lateral ventricle around the way.
        foramen_along_m, foramen_across_m: semi-axes of the foramen, in the plane of the way's arc and across.
        third_length_m: of the way from the foramen's middle to the tumour's surface.
        third_along_m, third_across_m: semi-axes of the third ventricle around the way.
        turn_rad: by which the way turns from the sheath's end to the tumour.
        azimuth_rad: of the plane of the arc about the sheath's axis, from +x.
        aside_along_m, aside_across_m: where the foramen lies beside the arc that the sheath was aimed for.
    """

    lateral_length_m: float
    lateral_radius_m: float
    foramen_along_m: float
    foramen_across_m: float
    third_length_m: float
    third_along_m: float
    third_across_m: float
    turn_rad: float
    azimuth_rad: float
    aside_along_m: float
    aside_across_m: float

    @property
    def length_m(self) -> float:
        """Of the way from the sheath's end to the tumour's surface."""
        return self.lateral_length_m + self.third_length_m


class Place(NamedTuple):
    """Places on the way.

    Attributes:
        p_w: entry frame, shape (n, 3) [m].
        R_w: columns: in the plane of the arc (outward of it is -), across it, along the way; (n, 3, 3).
    """

    p_w: Array
    R_w: Array


def random_ventricles(rng: np.random.Generator) -> Ventricles:
    """Return an anatomy whose every number is drawn evenly from `RANGES`."""
    return Ventricles(**drawn(RANGES, rng))


def median_ventricles() -> Ventricles:
    """Return the anatomy in the middle of all ranges."""
    return Ventricles(**middles(RANGES))


def way(anatomy: Ventricles, s: Array) -> Place:
    """Return places on the way, `s` [m] from the sheath's end along it, shape (n,).

    The arc, moved beside itself as much as the foramen is: smoothly, from the sheath's end on.
    """
    s = np.atleast_1d(np.asarray(s, dtype=float))
    radius = anatomy.length_m / anatomy.turn_rad
    angle = np.maximum(s, 0.0) / radius
    cosine, sine, zero = np.cos(angle), np.sin(angle), np.zeros(len(s))
    share = np.clip(s / anatomy.lateral_length_m, 0.0, 1.0)
    moved = share * share * (3.0 - 2.0 * share)
    flat = np.stack([radius * (1.0 - cosine), zero, radius * sine + np.minimum(s, 0.0)], axis=1)
    flat[:, 0] += moved * anatomy.aside_along_m
    flat[:, 1] += moved * anatomy.aside_across_m
    axes = np.stack([[cosine, zero, sine], [zero, zero + 1.0, zero], [-sine, zero, cosine]])  # rows, columns
    turned = _about_z(anatomy.azimuth_rad)
    return Place(flat @ turned.T, turned @ np.moveaxis(axes, 2, 0))


def foramen(anatomy: Ventricles) -> Place:
    """Return the middle of the foramen, with its axes; each a single row."""
    return way(anatomy, np.array([anatomy.lateral_length_m]))


def tumour(anatomy: Ventricles) -> Array:
    """Return the middle of the tumour, a ball of `TUMOUR_RADIUS_M`, shape (3,) [m]."""
    end = way(anatomy, np.array([anatomy.length_m]))
    return end.p_w[0] + TUMOUR_RADIUS_M * end.R_w[0, :, 2]


def semi_axes(anatomy: Ventricles, s: Array) -> Array:
    """Return the semi-axes of the cross-section, in the plane of the arc and across, shape (n, 2) [m]."""
    s = np.atleast_1d(np.asarray(s, dtype=float))
    middle = anatomy.lateral_length_m
    lateral = np.full(2, anatomy.lateral_radius_m)
    third = np.array([anatomy.third_along_m, anatomy.third_across_m])
    narrow = np.array([anatomy.foramen_along_m, anatomy.foramen_across_m])
    away = np.clip((np.abs(s - middle) - 0.5 * _FORAMEN_M) / _FUNNEL_M, 0.0, 1.0)[:, np.newaxis]
    wide = np.where((s < middle)[:, np.newaxis], lateral, third)
    return narrow + (wide - narrow) * away


def ventricle_wall(anatomy: Ventricles) -> Wall:
    """Return the wall from the sheath's end to behind the tumour's surface; open at both ends.

    Its cells lie between cross-sections, `AROUND` in each ring; the rings' middles are `ring_places`.
    """
    s = ring_places(anatomy)
    at = way(anatomy, s)
    axes = semi_axes(anatomy, s)
    around: Array = np.arange(AROUND, dtype=np.float64) * (2.0 * np.pi / AROUND)
    # The polygon has the ellipse's area.
    size = math.sqrt(2.0 * math.pi / AROUND / math.sin(2.0 * math.pi / AROUND))
    ray = np.stack([np.cos(around), np.sin(around)], axis=1)
    inner = size * axes[:, np.newaxis] * ray  # (rings, AROUND, 2)
    outer = inner + _WALL_M * ray

    def placed(flat: Array) -> Array:
        return (at.p_w[:, np.newaxis] + np.einsum("rij,rkj->rki", at.R_w[:, :, :2], flat)).reshape(-1, 3)

    cells = []
    for ring in range(len(s) - 1):
        for k in range(AROUND):
            low, after = ring * AROUND + k, ring * AROUND + (k + 1) % AROUND
            cells.append((low, after, after + AROUND, low + AROUND))
    return Wall(placed(inner), placed(outer), tuple(cells))


def ring_places(anatomy: Ventricles) -> Array:
    """Return where along the way the wall's cross-sections are, shape (n,) [m]."""
    narrow = 0.5 * _FORAMEN_M
    middle, wide = anatomy.lateral_length_m, 0.5 * _FORAMEN_M + _FUNNEL_M
    end = anatomy.length_m + 0.8 * TUMOUR_RADIUS_M
    parts = [
        np.linspace(0.0, middle - wide, 4),
        np.linspace(middle - wide, middle - narrow, 4)[1:],
        np.linspace(middle + narrow, middle + wide, 4),
        np.linspace(middle + wide, end, 6)[1:],
    ]
    return np.concatenate(parts)


def is_foramen(anatomy: Ventricles, ring: int) -> bool:
    """Return whether the cells after this cross-section belong to the foramen and the funnels beside it."""
    s = ring_places(anatomy)
    middle = 0.5 * (s[ring] + s[ring + 1])
    return bool(abs(middle - anatomy.lateral_length_m) < 0.5 * _FORAMEN_M + _FUNNEL_M)


def tumour_mesh(anatomy: Ventricles) -> trimesh.Trimesh:
    """Return the tumour as a closed mesh."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=TUMOUR_RADIUS_M)
    ball.apply_translation(tumour(anatomy))
    return ball


def tumour_points(anatomy: Ventricles, rng: np.random.Generator, count: int = 3) -> Array:
    """Return points on the tumour's surface where the ventricle lays it open, shape (count, 3) [m].

    One in each of `count` equal sectors about the way's axis, which a random one comes first; their
    distances from the axis are drawn from 0.4 to 0.7 of the way to the ventricle's wall (assumed).
    """
    end = way(anatomy, np.array([anatomy.length_m]))
    angle = (rng.uniform() + np.arange(count)) * (2.0 * np.pi / count) + rng.uniform(-0.3, 0.3, count)
    share = rng.uniform(0.4, 0.7, count)
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=1) * share[:, np.newaxis]
    aside = ray * np.array([anatomy.third_along_m, anatomy.third_across_m])
    deeper = TUMOUR_RADIUS_M - np.sqrt(TUMOUR_RADIUS_M**2 - (aside**2).sum(axis=1))
    return end.p_w[0] + aside @ end.R_w[0, :, :2].T + deeper[:, np.newaxis] * end.R_w[0, :, 2]


def _about_z(angle: float) -> Array:
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
