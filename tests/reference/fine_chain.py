"""A check on the kinetostatic model: the same tube as a chain of many short links, its energy minimised.

Written in another way throughout. A notch is cut into short rigid links with a hinge in the middle of each,
on the strip's centroid line. All hinges of a notch turn alike (the arc of the model, as links become many)
or each on its own (what the model leaves out: bending that varies along a notch). Energy, by a fine even grid
over the section, plus tension times length of tendon, less the work of the tip's force and the weight, is
least at rest. With friction each notch has its own tension, found by repetition; loading only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.robots.notched_tube.description import Notch, notches
from catheter_sim.robots.notched_tube.section import (
    closed_stiffness,
    closing_angle,
    section,
    torsion_stiffness,
)
from catheter_sim.robots.notched_tube.spec import NotchedSegment, NotchedTubeRobot
from catheter_sim.robots.notched_tube.statics import rest_vector
from reference.printed_formulas import energy_density

_THROUGH, _AROUND = 60, 60  # cells through the wall and around what is left of it
_ANGLE = 0.1  # unit of the unknown angles [rad]
_STRETCH = 1e-3  # of the unknown stretches


@dataclass(frozen=True)
class FineLoads:
    """What acts on a tube: each notch's tension, tip force and gravity, (n,) [N], (3,) [N] and [m/s^2]."""

    tension: Array
    force_tip: Array
    gravity_mps2: Array


@dataclass(frozen=True)
class FineChain:
    """A chain at rest.

    Attributes:
        turns: rotation vectors of the hinges, shape (n, links, 3) [rad].
        face: elements' distal faces, shape (n, 3) [m].
        energy_J: of tube, tendon and loads.
    """

    turns: Array
    face: Array
    energy_J: float


def at_rest(robot: NotchedTubeRobot, acting: FineLoads, links: int, alike: bool, axes: int) -> FineChain:
    """Return the chain's rest by minimising its energy.

    Args:
        robot: a notched tube.
        acting: on it.
        links: to a notch.
        alike: whether all hinges of a notch turn alike.
        axes: 1: toward +-x only; 3: any way.
    """
    row, n = notches(robot), len(notches(robot))
    grids = [_grid(item.segment) for item in row]
    hinges = 1 if alike else links
    rest = np.array([rest_vector(item) for item in row])
    components = [1] if axes == 1 else [0, 1, 2]

    def unpacked(unknown: Array) -> tuple[Array, Array]:
        turns = np.zeros((n, hinges, 3))
        turns[:, :, components] = _ANGLE / links * unknown[n:].reshape(n, hinges, axes)
        return np.repeat(turns, links, axis=1) if alike else turns, _STRETCH * unknown[:n]

    unit = robot.material.modulus_Pa * section(row[0].segment).second_moment_m4
    unit *= robot.stiffness_scale * _ANGLE**2 / row[0].segment.notch_height_m

    def energy(unknown: Array) -> float:
        turns, stretch = unpacked(unknown)
        total = _potential(robot, row, turns, stretch, acting)
        for index, item in enumerate(row):
            total += _elastic(robot, item, grids[index], turns[index] - rest[index] / links, stretch[index])
        return total / unit

    start = np.concatenate([np.zeros(n), np.repeat(rest[:, components] / _ANGLE, hinges, axis=0).ravel()])
    found = minimize(energy, start, method="BFGS", jac="3-point", options={"gtol": 1e-9, "maxiter": 500})
    turns, stretch = unpacked(found.x)
    faces, _, _ = _placed(robot, row, turns, stretch)
    return FineChain(np.array(turns), faces, float(found.fun) * unit)


def loaded_tensions(robot: NotchedTubeRobot, tension_N: float, bend_rad: Array) -> Array:
    """Return each notch's tension while the tendon is pulled in, the tube bent in its plane, (n,) [N]."""
    passed = np.cumsum(bend_rad) - 0.5 * bend_rad
    return np.asarray(tension_N * np.exp(-robot.friction.mu * passed))


def _grid(segment: NotchedSegment) -> Array:
    """Return distance from the centroid (along x), y and area of even cells of the section, shape (f, 3)."""
    outer, inner = segment.outer_radius_m, segment.inner_radius_m
    radius = inner + (np.arange(_THROUGH) + 0.5) / _THROUGH * (outer - inner)
    reach = (segment.notch_depth_m - outer) / (outer if segment.cut == "radial" else radius)
    half = np.broadcast_to(np.arccos(np.clip(reach, -1.0, 1.0)), radius.shape)
    angle = np.outer(half, (2.0 * np.arange(_AROUND) + 1.0) / _AROUND - 1.0)
    area = radius * half / _AROUND * 2.0 * (outer - inner) / _THROUGH
    areas = np.repeat(area, _AROUND)
    x = (-radius[:, None] * np.cos(angle)).ravel()
    y = (radius[:, None] * np.sin(angle)).ravel()
    return np.stack([x - x @ areas / areas.sum(), y, areas], axis=1)


def _elastic(robot: NotchedTubeRobot, item: Notch, grid: Array, turns: Array, stretch: float) -> float:
    """Return a notch's elastic energy; `turns`: of its hinges beyond those at rest, shape (links, 3)."""
    segment, scale = item.segment, robot.stiffness_scale
    links = len(turns)
    piece = segment.notch_height_m / links
    stored = 0.0
    for turn in turns[:1] if np.ptp(turns, axis=0).max() == 0.0 else turns:
        strain = stretch - grid[:, 0] * turn[1] / piece + grid[:, 1] * turn[0] / piece
        stored += float(energy_density(robot.material, strain) @ grid[:, 2]) * piece
    if np.ptp(turns, axis=0).max() == 0.0:
        stored *= links
    modulus = robot.material.modulus_Pa * scale
    twist = torsion_stiffness(segment, modulus, robot.material.poisson_ratio)
    beyond = max(float(turns[:, 1].sum()) + rest_vector(item)[1] - closing_angle(segment), 0.0)
    closed = 0.5 * closed_stiffness(segment, modulus) * beyond**2
    return scale * stored + 0.5 * twist * links * float((turns[:, 2] ** 2).sum()) + closed


def _potential(
    robot: NotchedTubeRobot, row: list[Notch], turns: Array, stretch: Array, acting: FineLoads
) -> float:
    """Return tension times tendon less the work of force and weight."""
    faces, middles, spans = _placed(robot, row, turns, stretch)
    masses = np.array([item.mass_kg for item in row])
    work = acting.force_tip @ faces[-1] + masses @ middles @ acting.gravity_mps2
    return float(acting.tension @ spans - work)


def _placed(
    robot: NotchedTubeRobot, row: list[Notch], turns: Array, stretch: Array
) -> tuple[Array, Array, Array]:
    """Return distal faces, middles of the uncut pieces, and the tendon's spans in the notches."""
    here, R = np.zeros(3), np.eye(3)
    arm = np.array([robot.tendons[0].radius_m, 0.0, 0.0])
    faces, middles, spans = [], [], []
    for index, item in enumerate(row):
        centroid = np.array([-section(item.segment).centroid_m, 0.0, 0.0])
        half = 0.5 * item.segment.notch_height_m * (1.0 + stretch[index]) / turns.shape[1]
        low = here + R @ arm
        point = here + R @ centroid
        for each in Rotation.from_rotvec(turns[index]).as_matrix():
            point = point + half * R[:, 2]
            R = R @ each
            point = point + half * R[:, 2]
        here = point - R @ centroid
        spans.append(float(np.linalg.norm(here + R @ arm - low)))
        middles.append(here + 0.5 * item.uncut_m * R[:, 2])
        here = here + item.uncut_m * R[:, 2]
        faces.append(here)
    return np.array(faces), np.array(middles), np.array(spans)
