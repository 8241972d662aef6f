"""Solids of MJCF models: plain ones, with holes, and their colours."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import mapbox_earcut
import numpy as np
import trimesh
from numpy.typing import NDArray

from catheter_sim.arrays import Array

# ----------------------------------------------------------------------------------------------------
# Colours of what is drawn, red, green, blue and opacity.

Colour = tuple[float, float, float, float]

PEEK: Colour = (0.86, 0.76, 0.60, 1.0)
PEEK_NEXT: Colour = (0.72, 0.62, 0.47, 1.0)  # every other segment, to tell them apart
NITI: Colour = (0.60, 0.63, 0.68, 1.0)
DISK: Colour = (0.83, 0.86, 0.90, 1.0)
DISK_NEXT: Colour = (0.66, 0.72, 0.80, 1.0)
FIXED: Colour = (0.33, 0.36, 0.41, 1.0)

# Pulled toward +x and -x in turn: warm and cool colours.
TENDON_COLOURS: tuple[Colour, ...] = (
    (0.84, 0.15, 0.16, 1.0),
    (0.12, 0.35, 0.75, 1.0),
    (0.93, 0.50, 0.10, 1.0),
    (0.10, 0.58, 0.62, 1.0),
    (0.75, 0.12, 0.50, 1.0),
    (0.30, 0.25, 0.65, 1.0),
)


def tendon_colour(index: int) -> Colour:
    """Return the colour of tendon `index`."""
    return TENDON_COLOURS[index % len(TENDON_COLOURS)]


# ----------------------------------------------------------------------------------------------------
# Small closed triangle meshes: prisms with holes, boxes, rods. Lengths in metres, axis +z.
#
# Nothing here knows a robot. Vertices and faces follow from the arguments alone, so that a model that is
# written twice is the same text twice; outlines are rounded to a nanometre first, for the last bit of a
# sine depends on the machine and could decide how a symmetric outline is cut into triangles.


def circle(radius: float, sections: int, centre: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Return `sections` points on a circle, counter-clockwise, shape (sections, 2)."""
    angle = np.arange(sections) * (2.0 * math.pi / sections)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius + np.asarray(centre)


def prism(outline: Array, holes: Sequence[Array], z_from: float, z_to: float) -> trimesh.Trimesh:
    """Return the closed prism over a polygon with holes.

    Args:
        outline: counter-clockwise, shape (n, 2).
        holes: each counter-clockwise, inside the outline and apart from one another.
        z_from, z_to: where it begins and ends, z_from < z_to.
    """
    rings = [np.asarray(outline), *(np.asarray(hole)[::-1] for hole in holes)]
    ends = np.cumsum([len(ring) for ring in rings])
    flat = np.asarray(np.concatenate(rings), dtype=np.float64).round(9)
    cap = triangles(flat, ends)
    count = len(flat)
    walls = []
    for begin, end in zip([0, *ends[:-1]], ends, strict=True):
        here = np.arange(begin, end)
        after = np.roll(here, -1)
        walls += [np.stack([here, after, after + count], 1), np.stack([here, after + count, here + count], 1)]
    vertices = np.concatenate(
        [np.column_stack([flat, np.full(count, z_from)]), np.column_stack([flat, np.full(count, z_to)])]
    )
    return trimesh.Trimesh(vertices, np.concatenate([cap[:, ::-1], cap + count, *walls]), process=False)


def triangles(flat: Array, ends: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return counter-clockwise triangles over a polygon with holes, shape (m, 3).

    Args:
        flat: corners of the outline and then of the holes, shape (n, 2).
        ends: where each of them ends.
    """
    cap = mapbox_earcut.triangulate_float64(flat, ends.astype(np.uint32)).reshape(-1, 3).astype(np.int64)
    corner = flat[cap]
    first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    clockwise = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] < 0
    cap[clockwise] = cap[clockwise][:, ::-1]
    return cap


def across_y(profile: Array, y_from: float, y_to: float) -> trimesh.Trimesh:
    """Return the closed prism along y over a counter-clockwise polygon (x, z), shape (n, 2)."""
    mesh = prism(profile, (), -y_to, -y_from)
    x, z, minus_y = mesh.vertices.T
    return trimesh.Trimesh(np.column_stack([x, -minus_y, z]), mesh.faces, process=False)


def box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> trimesh.Trimesh:
    """Return the box between two values of each coordinate."""
    outline = np.array([(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])])
    return prism(outline, (), *z)


def domed_rod(radius: float, length: float, sections: int) -> trimesh.Trimesh:
    """Return a rod from z = 0 to `length` with half a ball below z = 0, which rounds a kink there."""
    angle = np.linspace(0.0, math.pi / 2.0, 4)[1:]
    profile = [(radius * math.sin(a), -radius * math.cos(a)) for a in angle] + [(radius, length)]
    rings = [np.column_stack([circle(r, sections), np.full(sections, z)]) for r, z in profile]
    south, north = len(rings) * sections, len(rings) * sections + 1
    vertices = np.concatenate([*rings, [(0.0, 0.0, -radius), (0.0, 0.0, length)]])
    here = np.arange(sections)
    after = np.roll(here, -1)
    faces = [np.stack([np.full(sections, south), after, here], 1)]
    for ring in range(len(rings) - 1):
        low, high = ring * sections, (ring + 1) * sections
        faces += [
            np.stack([here + low, after + low, after + high], 1),
            np.stack([here + low, after + high, here + high], 1),
        ]
    last = (len(rings) - 1) * sections
    faces.append(np.stack([here + last, after + last, np.full(sections, north)], 1))
    return trimesh.Trimesh(vertices, np.concatenate(faces), process=False)


def together(solids: Sequence[trimesh.Trimesh]) -> trimesh.Trimesh:
    """Return closed solids as one mesh; they may sink into one another."""
    counts = np.cumsum([0, *(len(solid.vertices) for solid in solids)])
    return trimesh.Trimesh(
        np.concatenate([solid.vertices for solid in solids]),
        np.concatenate([solid.faces + begin for solid, begin in zip(solids, counts, strict=False)]),
        process=False,
    )


def raised(mesh: trimesh.Trimesh, z: float) -> trimesh.Trimesh:
    """Return `mesh` moved by `z` along its axis."""
    return trimesh.Trimesh(mesh.vertices + np.array([0.0, 0.0, z]), mesh.faces, process=False)


# ----------------------------------------------------------------------------------------------------
# Closed solids with a flat top, a lower face that is curved in one direction, and bores along z.
#
# Nothing here knows a robot. As in `catheter_sim.mjcf.solids`, vertices and faces follow from the arguments
# alone: outlines are rounded to a nanometre before anything is decided by them.
#
# The lower face is cut into strips at right angles to the direction in which it is curved. All of its
# vertices lie on it. Where it is convex its facets therefore lie within the solid, at most by the arc's
# height over one strip.

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
