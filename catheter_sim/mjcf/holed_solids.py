"""Closed solids with a flat top, a lower face that is curved in one direction, and bores along z.

Nothing here knows a robot. As in `catheter_sim.mjcf.solids`, vertices and faces follow from the
arguments alone: outlines are rounded to a nanometre before anything is decided by them.

The lower face is cut into strips at right angles to the direction in which it is curved. All of its
vertices lie on it. Where it is convex its facets therefore lie within the solid, at most by the arc's
height over one strip.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import trimesh
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.mjcf.solids import triangles

_CLOSE_RAD = 1e-2  # from a circle's crossing with a line: a regular corner nearer than this is left out
_APART = 1e-4  # of the outer radius: lines nearer than that to the one before are left out
_TANGENT = 1e-4  # a line this near to a circle's end, over its radius, is left out


@dataclass(frozen=True)
class Bore:
    """A straight round hole through the solid, widened like a cone at both mouths.

    Attributes:
        centre: x and y [m].
        radius: of its straight part [m].
        mouth_radius: in both faces; as `radius`: not widened [m].
        z_from, z_to: where the straight part begins and ends, unless it is not widened [m].
        sections: corners of the circle, a multiple of 4; those at the strips' borders not counted.
    """

    centre: tuple[float, float]
    radius: float
    mouth_radius: float
    z_from: float
    z_to: float
    sections: int


def bored(
    radius: float,
    sections: int,
    bores: Sequence[Bore],
    lower: Callable[[Array], Array],
    cuts: Iterable[float],
    axis: int,
    top: float,
) -> trimesh.Trimesh:
    """Return the closed round solid between the surface z = `lower`(u) and the plane z = `top`.

    Args:
        radius, sections: of the outer circle about the z axis [m], and its corners, a multiple of 4.
        bores: inside the circle and apart from one another.
        lower: height of the lower face as a function of u, below `top` everywhere [m].
        cuts: values of u between the strips [m].
        axis: which coordinate u is: 0: x, 1: y.
        top: [m].
    """
    circles = [(radius, sections, (0.0, 0.0))]
    circles += [(bore.mouth_radius, bore.sections, bore.centre) for bore in bores]
    lines = np.unique(np.round(np.asarray(list(cuts), dtype=float), 9))
    lines = lines[np.diff(lines, prepend=-np.inf) > _APART * radius]
    for size, _, centre in circles:
        lines = lines[np.abs(np.abs(lines - centre[axis]) - size) > _TANGENT * size]
    rings = [_ring(*circle, lines, axis) for circle in circles]
    flat = np.concatenate(rings)
    count = len(flat)
    starts = np.cumsum([0, *(len(ring) for ring in rings)])
    loops = [np.arange(*ends) for ends in pairwise(starts)]
    vertices = [np.column_stack([flat, lower(flat[:, axis])]), np.column_stack([flat, np.full(count, top)])]
    faces = [_face(flat, loops, lines, axis)[:, ::-1], _face(flat, loops, np.zeros(0), axis) + count]
    total = 2 * count
    for number, (ring, loop) in enumerate(zip(rings, loops, strict=True)):
        levels = [loop]
        if number and bores[number - 1].mouth_radius > bores[number - 1].radius:
            bore = bores[number - 1]
            middle = np.asarray(bore.centre)
            narrow = middle + (ring - middle) * (bore.radius / bore.mouth_radius)
            for z in (bore.z_from, bore.z_to):
                vertices.append(np.column_stack([narrow, np.full(len(ring), z)]))
                levels.append(np.arange(total, total + len(ring)))
                total += len(ring)
        levels.append(loop + count)
        for low, high in pairwise(levels):
            beside_low, beside_high = np.roll(low, -1), np.roll(high, -1)
            for corners in ((low, beside_low, beside_high), (low, beside_high, high)):
                # Around a bore the solid is on the other side.
                faces.append(np.stack(corners[::-1] if number else corners, axis=1))
    return trimesh.Trimesh(np.concatenate(vertices), np.concatenate(faces), process=False)


def _ring(radius: float, sections: int, centre: tuple[float, float], lines: Array, axis: int) -> Array:
    """Return a circle's corners, counter-clockwise, one at every crossing with a line, shape (n, 2)."""
    offset = lines - centre[axis]
    crossed = offset[np.abs(offset) < radius]
    turn = np.arccos(crossed / radius)  # from the direction of the coordinate `axis`
    at_lines = np.concatenate([turn, -turn]) + axis * math.pi / 2.0
    regular = np.arange(sections) * (2.0 * math.pi / sections)
    apart = np.abs(np.angle(np.exp(1j * (regular[:, None] - at_lines[None, :]))))
    regular = regular[(apart > _CLOSE_RAD).all(axis=1)]
    angle = np.concatenate([at_lines, regular])
    corner = np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius + np.asarray(centre)
    corner = corner.round(9)
    corner[: len(at_lines), axis] = np.tile(lines[np.abs(offset) < radius], 2)
    return corner[np.argsort(np.mod(angle, 2.0 * math.pi), kind="stable")]


def _face(flat: Array, loops: Sequence[Array], lines: Array, axis: int) -> NDArray[np.int64]:
    """Return counter-clockwise triangles over the first loop less the others, shape (m, 3).

    No triangle reaches over one of the lines, and none has a corner that the loops have not.

    Args:
        flat: corners, shape (n, 2).
        loops: indices of corners, counter-clockwise, with a corner wherever a loop crosses a line.
        lines: ascending.
        axis: which coordinate the lines cut.
    """
    strips: list[dict[int, int]] = [{} for _ in range(len(lines) + 1)]  # each corner's next one
    for number, loop in enumerate(loops):
        for here, after in zip(loop, np.roll(loop, -1), strict=True):
            strip = int(np.searchsorted(lines, 0.5 * (flat[here, axis] + flat[after, axis])))
            # The solid is on the left of an edge.
            start, end = (after, here) if number else (here, after)
            strips[strip][int(start)] = int(end)
    for strip, line in enumerate(lines):
        on_line = np.flatnonzero(flat[:, axis] == line)
        on_line = on_line[np.argsort(flat[on_line, 1 - axis])]
        for here, after in pairwise(on_line):
            middle = 0.5 * (flat[here] + flat[after])
            if _within(middle, flat[loops[0]]) and not any(_within(middle, flat[k]) for k in loops[1:]):
                start, end = (after, here) if axis else (here, after)
                strips[strip][int(start)] = int(end)
                strips[strip + 1][int(end)] = int(start)
    return np.concatenate([_triangles(flat, cycles) for strip in strips for cycles in _areas(flat, strip)])


def _areas(flat: Array, following: dict[int, int]) -> list[list[list[int]]]:
    """Return the areas that directed edges enclose, each as its border and then its holes."""
    outer: list[list[list[int]]] = []
    inner: list[list[int]] = []
    left = dict(following)
    while left:
        cycle = [next(iter(left))]
        while (after := left.pop(cycle[-1])) != cycle[0]:
            cycle.append(after)
        x, y = flat[cycle].T
        area = np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))
        if area > 0.0:
            outer.append([cycle])
        else:
            inner.append(cycle)
    for hole in inner:
        next(cycles for cycles in outer if _within(flat[hole[0]], flat[cycles[0]])).append(hole)
    return outer


def _triangles(flat: Array, cycles: Sequence[Sequence[int]]) -> NDArray[np.int64]:
    order = np.concatenate([np.asarray(cycle) for cycle in cycles])
    return order[triangles(flat[order], np.cumsum([len(cycle) for cycle in cycles]))]


def _within(point: Array, polygon: Array) -> bool:
    """Return whether a point lies inside a polygon, shape (n, 2): a ray from it crosses an odd number."""
    x, y = (polygon - point).T
    x_next, y_next = np.roll(x, -1), np.roll(y, -1)
    crossing = (y > 0.0) != (y_next > 0.0)
    x, x_next, y, y_next = x[crossing], x_next[crossing], y[crossing], y_next[crossing]
    return bool(((x - y * (x_next - x) / (y_next - y)) > 0.0).sum() % 2)
