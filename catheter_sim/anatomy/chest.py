"""A chest as a tube meets it that is put through its wall, as data, and random ones.

Entry frame: origin where the dissected channel opens into the pleural space; +z inward, along the channel; +x
toward the apex. A large effusion has pushed the lung away from the wall. The wall's inner side is taken for
flat, lung and diaphragm for balls.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import trimesh

from catheter_sim.anatomy.ranges import drawn, middles
from catheter_sim.arrays import Array

# Least and largest value of every number of a random anatomy; assumed, unless another source is given.
RANGES: dict[str, tuple[float, float]] = {
    "wall_m": (26.6e-3, 80.2e-3),  # chest_tube_2025, Section II.B
    "effusion_m": (65e-3, 80e-3),
    "lung_radius_m": (120e-3, 160e-3),
    "lung_x_m": (30e-3, 80e-3),
    "diaphragm_radius_m": (70e-3, 90e-3),
    "diaphragm_away_m": (20e-3, 35e-3),
    "target_away_m": (90e-3, 125e-3),
    "target_azimuth_rad": (math.radians(-20.0), math.radians(20.0)),
    "target_depth_m": (36e-3, 44e-3),
}
CHANNEL_M = 6e-3  # half the width of the dissected channel; assumed: a finger's breadth at the most
_SLAB_M = 0.2  # half the width of what is taken of the wall; of no matter


@dataclass(frozen=True)
class Chest:
    """One patient, as far as the robot meets her.

    Attributes:
        wall_m: thickness of the chest wall.
        effusion_m: from the wall's inner side to the nearest of the lung.
        lung_radius_m, lung_x_m: of the lung, and how far toward the apex its middle lies.
        diaphragm_radius_m, diaphragm_away_m: of the dome, and how far from the channel's axis it begins.
        target_away_m, target_azimuth_rad, target_depth_m: the aspiration point: from the channel's axis, its
            direction about that axis from +x, and its depth under the wall's inner side.
    """

    wall_m: float
    effusion_m: float
    lung_radius_m: float
    lung_x_m: float
    diaphragm_radius_m: float
    diaphragm_away_m: float
    target_away_m: float
    target_azimuth_rad: float
    target_depth_m: float


def random_chest(rng: np.random.Generator) -> Chest:
    """Return an anatomy whose every number is drawn evenly from `RANGES`."""
    return Chest(**drawn(RANGES, rng))


def median_chest() -> Chest:
    """Return the anatomy in the middle of all ranges."""
    return Chest(**middles(RANGES))


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

    Args:
        half_m: half the channel's width.
        top_m, bottom_m: where along z it ends and begins.
        wide_m: half the width of all together.
    """
    depth, middle = 0.5 * (top_m - bottom_m), 0.5 * (top_m + bottom_m)
    arm = 0.5 * (wide_m - half_m)
    return [
        (np.array([arm, wide_m, depth]), np.array([half_m + arm, 0.0, middle])),
        (np.array([arm, wide_m, depth]), np.array([-half_m - arm, 0.0, middle])),
        (np.array([half_m, arm, depth]), np.array([0.0, half_m + arm, middle])),
        (np.array([half_m, arm, depth]), np.array([0.0, -half_m - arm, middle])),
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
