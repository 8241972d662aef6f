"""Parametric anatomies: a chest and its wall, the way through the ventricles to a tumour."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple, TypeVar

import numpy as np
import trimesh

from catheter_sim.arrays import Array

# ----------------------------------------------------------------------------------------------------
# Anatomies are frozen dataclasses of numbers, each with its range: drawn from it, or in the middle.

A = TypeVar("A")
Ranges = Mapping[str, tuple[float, float]]  # name of a number -> its least and largest value, SI units


def ranged(least: float, most: float) -> Any:
    """Return a dataclass's field for a number from `least` to `most`."""
    return field(metadata={"range": (least, most)})


def ranges_of(anatomy: Any) -> dict[str, tuple[float, float]]:
    """Return the ranges of a class of anatomies."""
    return {item.name: item.metadata["range"] for item in fields(anatomy)}


def drawn(ranges: Ranges, rng: np.random.Generator) -> dict[str, float]:
    """Return every number drawn evenly from its range, in the order of `ranges`."""
    return {name: float(rng.uniform(*bounds)) for name, bounds in ranges.items()}


def middles(ranges: Ranges) -> dict[str, float]:
    """Return every number in the middle of its range."""
    return {name: 0.5 * (low + high) for name, (low, high) in ranges.items()}


def random_of(kind: type[A], rng: np.random.Generator) -> A:
    """Return an anatomy whose every number is drawn evenly from its range."""
    return kind(**drawn(ranges_of(kind), rng))


def median_of(kind: type[A]) -> A:
    """Return the anatomy in the middle of all ranges."""
    return kind(**middles(ranges_of(kind)))


# ----------------------------------------------------------------------------------------------------
# A wall as a closed mesh to be drawn, and as convex pieces to be touched.


@dataclass(frozen=True)
class Wall:
    """The wall as a shell."""

    inner: Array  # its vertices, shape (n, 3) [m]
    outer: Array
    cells: tuple[tuple[int, ...], ...]  # of three or four vertices, counter-clockwise seen from outside


def shell(part: Wall) -> trimesh.Trimesh:
    """Return the wall as one closed mesh, its openings included, its faces outward."""
    count = len(part.inner)
    faces = []
    edges: dict[tuple[int, int], tuple[int, int]] = {}
    for cell in part.cells:
        for k in range(1, len(cell) - 1):
            a, b, c = cell[0], cell[k], cell[k + 1]
            faces += [(a + count, b + count, c + count), (a, c, b)]
        for a, b in zip(cell, (*cell[1:], cell[0]), strict=True):
            if edges.pop((b, a), None) is None:
                edges[a, b] = (a, b)
    for a, b in edges.values():  # rims
        faces += [(a, b, b + count), (a, b + count, a + count)]
    mesh = trimesh.Trimesh(np.concatenate([part.inner, part.outer]), np.array(faces), process=False)
    mesh.remove_unreferenced_vertices()
    return mesh


def blocks(part: Wall) -> list[Array]:
    """Return the corners of every cell's convex block, shape (6 or 8, 3) each [m]."""
    return [np.concatenate([part.inner[list(cell)], part.outer[list(cell)]]) for cell in part.cells]


def facings(part: Wall) -> Array:
    """Return the unit normals of the blocks' inner faces, away from the wall, shape (m, 3)."""
    normals = []
    for cell in part.cells:
        a, b, c, d = part.inner[[cell[0], cell[1], cell[2], cell[-1]]]
        normals.append(-np.cross(c - a, d - b) if len(cell) > 3 else -np.cross(b - a, c - a))
    found = np.array(normals)
    return found / np.linalg.norm(found, axis=1, keepdims=True)


# ----------------------------------------------------------------------------------------------------
# A chest as a tube meets it that is put through its wall, as data, and random ones.
#
# Entry frame: origin where the dissected channel opens into the pleural space; +z inward, along the
# channel; +x toward the apex. A large effusion has pushed the lung away from the wall. The wall's inner
# side is taken for flat, lung and diaphragm for balls.

CHANNEL_M = 6e-3  # half the width of the dissected channel; assumed: a finger's breadth at the most
_SLAB_M = 0.2  # half the width of what is taken of the wall; of no matter


@dataclass(frozen=True)
class Chest:
    """One patient, as far as the robot meets her; ranges are assumed, unless another source is given."""

    wall_m: float = ranged(26.6e-3, 80.2e-3)  # thickness of the chest wall; chest_tube_2025, Section II.B
    effusion_m: float = ranged(65e-3, 80e-3)  # from the wall's inner side to the nearest of the lung
    lung_radius_m: float = ranged(120e-3, 160e-3)
    lung_x_m: float = ranged(30e-3, 80e-3)  # how far toward the apex the lung's middle lies
    diaphragm_radius_m: float = ranged(70e-3, 90e-3)  # of the dome
    diaphragm_away_m: float = ranged(20e-3, 35e-3)  # how far from the channel's axis it begins
    # The aspiration point: from the channel's axis, its direction about that axis from +x, and its depth
    # under the wall's inner side.
    target_away_m: float = ranged(90e-3, 125e-3)
    target_azimuth_rad: float = ranged(math.radians(-20.0), math.radians(20.0))
    target_depth_m: float = ranged(36e-3, 44e-3)


def lung(anatomy: Chest) -> Array:
    """Return the middle of the lung's ball, shape (3,) [m]."""
    return np.array([anatomy.lung_x_m, 0.0, anatomy.effusion_m + anatomy.lung_radius_m])


def diaphragm(anatomy: Chest) -> Array:
    """Return the middle of the diaphragm's ball, shape (3,) [m]."""
    return np.array([-anatomy.diaphragm_away_m - anatomy.diaphragm_radius_m, 0.0, 0.5 * anatomy.effusion_m])


def aspiration_point(anatomy: Chest) -> Array:
    """Return the point that the tip is brought to, shape (3,) [m]."""
    across = anatomy.target_away_m
    azimuth = anatomy.target_azimuth_rad
    return np.array([across * math.cos(azimuth), across * math.sin(azimuth), anatomy.target_depth_m])


def channel_boxes(half_m: float, top_m: float, bottom_m: float, wide_m: float) -> list[tuple[Array, Array]]:
    """Return half sizes and middles of four boxes around a square channel along z, shapes (3,) each [m].

    `half_m` is half the channel's width, `wide_m` that of all together; along z it goes from `bottom_m` to
    `top_m`.
    """
    depth, middle = 0.5 * (top_m - bottom_m), 0.5 * (top_m + bottom_m)
    arm = 0.5 * (wide_m - half_m)
    beside = half_m + arm
    return [
        *((np.array([arm, wide_m, depth]), np.array([x, 0.0, middle])) for x in (beside, -beside)),
        *((np.array([half_m, arm, depth]), np.array([0.0, y, middle])) for y in (beside, -beside)),
    ]


def wall_boxes(anatomy: Chest) -> list[tuple[Array, Array]]:
    """Return the chest wall with its channel as boxes: half sizes and middles."""
    return channel_boxes(CHANNEL_M, 0.0, -anatomy.wall_m, _SLAB_M)


def meshes(anatomy: Chest) -> dict[str, trimesh.Trimesh]:
    """Return what is seen: wall, lung and diaphragm, each closed."""
    wall = []
    for half, middle in channel_boxes(CHANNEL_M, 0.0, -anatomy.wall_m, 0.5 * _SLAB_M):
        box = trimesh.creation.box(2.0 * half)
        box.apply_translation(middle)
        wall.append(box)
    joined = trimesh.util.concatenate(wall)
    assert isinstance(joined, trimesh.Trimesh)
    return {
        "wall": joined,
        "lung": _ball(anatomy.lung_radius_m, lung(anatomy)),
        "diaphragm": _ball(anatomy.diaphragm_radius_m, diaphragm(anatomy)),
    }


def _ball(radius: float, middle: Array) -> trimesh.Trimesh:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    ball.apply_translation(middle)
    return ball


# ----------------------------------------------------------------------------------------------------
# The way from a burr hole to a tumour of the posterior third ventricle, as data, and random ones.
#
# Entry frame: origin where the sheath, which was put through a precoronal burr hole and the frontal lobe,
# ends in the lateral ventricle; +z along the sheath, inward; +x the robot's bending direction before it is
# rolled. From there the way goes through the lateral ventricle, the foramen of Monro and the third
# ventricle along an arc of one curvature: the burr hole was planned so. Its plane contains the sheath's
# axis but for an error of aim. Ventricles are wide, as where a tumour has closed the aqueduct. Kato 2016
# states the approach and the tumour's size, and no other dimension.

TUMOUR_RADIUS_M = 10e-3  # Kato 2016, Introduction: soft tumours of 2 cm
SHEATH_M = 2.0e-3  # inner radius of the sheath; assumed: a robot of 3.4 mm and room to slide
_FORAMEN_M = 2e-3  # length of its canal; assumed ("oval-shaped cylinder", Jean 2019)
_FUNNEL_M = 6e-3  # over which the ventricles narrow to it; assumed
_WALL_M = 8e-3  # of the wall's blocks, outward; of no matter
AROUND = 16  # cells of the wall


@dataclass(frozen=True)
class Ventricles:
    """One patient, as far as the robot meets her; ranges are assumed, unless another source is given."""

    lateral_length_m: float = ranged(22e-3, 27e-3)  # of the way from the sheath's end to the foramen's middle
    lateral_radius_m: float = ranged(9e-3, 12e-3)  # of the lateral ventricle around the way
    # Semi-axes of the foramen, in the plane of the way's arc and across. Zhu 2013 (Asian J Surg 36:74), 11
    # patients: mean diameters of 5.6 to 7.8 mm in three views; Jean 2019 (doi 10.1007/s00701-019-03887-4):
    # mean opening of 32.6 mm^2 in hydrocephalus, 6.4 mm across.
    foramen_along_m: float = ranged(2.8e-3, 3.9e-3)
    foramen_across_m: float = ranged(2.8e-3, 3.9e-3)
    third_length_m: float = ranged(
        25e-3, 30e-3
    )  # of the way from the foramen's middle to the tumour's surface
    third_along_m: float = ranged(9e-3, 11e-3)  # semi-axes of the third ventricle around the way
    third_across_m: float = ranged(6e-3, 8e-3)
    turn_rad: float = ranged(math.radians(40.0), math.radians(60.0))  # of the way, sheath's end to tumour
    azimuth_rad: float = ranged(math.radians(-30.0), math.radians(30.0))  # of the arc's plane, from +x
    # Where the foramen lies beside the arc that the sheath was aimed for.
    aside_along_m: float = ranged(-1e-3, 1e-3)
    aside_across_m: float = ranged(-1e-3, 1e-3)

    @property
    def length_m(self) -> float:
        """Of the way from the sheath's end to the tumour's surface."""
        return self.lateral_length_m + self.third_length_m


class Place(NamedTuple):
    """Places on the way, entry frame."""

    p_w: Array  # shape (n, 3) [m]
    R_w: Array  # columns: in the plane of the arc (outward of it is -), across it, along the way; (n, 3, 3)


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
    return _ball(TUMOUR_RADIUS_M, tumour(anatomy))


def tumour_points(anatomy: Ventricles, rng: np.random.Generator, count: int = 3) -> Array:
    """Return points on the tumour's surface where the ventricle lays it open, shape (count, 3) [m].

    One in each of `count` equal sectors about the way's axis, which a random one comes first. Their
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
