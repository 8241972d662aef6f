"""A heart as the procedure meets it: atrium, septum, valve, flow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from catheter_sim.anatomy.anatomies import Ranges, Wall, drawn, middles, ranged, ranges_of
from catheter_sim.arrays import Array

# ----------------------------------------------------------------------------------------------------
# Rigid transforms as the procedure needs them: the robot's base in the valve frame, errors of a pose.

DOWN = np.array([0.0, 0.0, -1.0])  # along the valve's axis, into the ventricle


def transform(R: Array, p: Array) -> Array:
    """Return a rotation and a position as one transform, shape (4, 4)."""
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = R, p
    return result


def base_frame(puncture: Array, direction: Array, roll_rad: float, insertion_m: float) -> Array:
    """Return the robot's base frame in the valve frame, shape (4, 4).

    The base lies beyond the puncture of the septum, along the sheath, a unit vector, and is rolled from the
    home bending plane to the plane of the sheath and the valve's axis.
    """
    toward_valve = DOWN - (DOWN @ direction) * direction
    toward_valve /= np.linalg.norm(toward_valve)
    aside = np.cross(direction, toward_valve)
    x = math.cos(roll_rad) * toward_valve - math.sin(roll_rad) * aside
    R = np.stack([x, np.cross(direction, x), direction], axis=1)
    return transform(R, puncture + insertion_m * direction)


def pose_error(wanted: Array, reached: Array) -> Array:
    """Return what is missing from a pose: position [m], then rotation vector [rad]; shape (6,)."""
    turn = Rotation.from_matrix(wanted[:3, :3] @ reached[:3, :3].T).as_rotvec()
    return np.concatenate([wanted[:3, 3] - reached[:3, 3], turn])


# ----------------------------------------------------------------------------------------------------
# A left atrium and a mitral valve as data, and random ones.
#
# Valve frame: origin in the middle of the annulus, +z along its axis into the atrium, +x toward the septum,
# right-handed. The atrium is an ellipsoid cut off by the plane of the annulus; its middle and its third
# semi-axis follow from its height and from the annulus that it ends in.

WALL_M = 2.5e-3  # assumed
LEAFLET_M = 1.2e-3  # thickness; assumed


@dataclass(frozen=True)
class Anatomy:
    """One patient, as far as the procedure meets her.

    Ranges are assumed, unless another source is given: an enlarged atrium, as where a valve leaks.
    """

    atrium_x_m: float = ranged(25e-3, 30e-3)  # horizontal semi-axes of the atrium
    atrium_y_m: float = ranged(24e-3, 29e-3)
    atrium_height_m: float = ranged(54e-3, 64e-3)  # of its roof above the annulus
    # Middle of the oval fossa, on the septal side of the wall; assumed, from clip procedures: the septum is
    # punctured 40 to 50 mm above the annulus.
    fossa_y_m: float = ranged(-4e-3, 4e-3)
    fossa_z_m: float = ranged(42e-3, 48e-3)
    fossa_radius_m: float = ranged(6e-3, 9e-3)  # within it the septum may be punctured
    annulus_along_m: float = ranged(16e-3, 20e-3)  # semi-axes, along and across the coaptation line
    annulus_across_m: float = ranged(14e-3, 17e-3)
    # Of the leaflets' first contact below the annulus, and of their free margins, which lie against each
    # other below that. EVEREST II trial, criteria for clips: depth at most 11 mm, length at least 2 mm.
    coaptation_depth_m: float = ranged(4e-3, 10e-3)
    coaptation_length_m: float = ranged(4e-3, 8e-3)
    # Turn of the coaptation line about +z, from +y: so that the implant turns by at most the 45 deg that are
    # clinically required: Nayar 2022, Section IV-E.
    coaptation_rad: float = ranged(math.radians(-40.0), math.radians(40.0))
    # Of the outer sheath about its axis: between the robot's home bending plane and the plane that contains
    # the sheath's axis and the valve's. Nayar 2022, Section IV-E: the proximal torsion joint aligned the
    # robot by 20 to 40 deg.
    roll_rad: float = ranged(math.radians(20.0), math.radians(40.0))


RANGES = ranges_of(Anatomy)


def random_anatomy(rng: np.random.Generator, ranges: Ranges = RANGES) -> Anatomy:
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


# ----------------------------------------------------------------------------------------------------
# The wall of the atrium as a closed mesh and as convex pieces, with its two openings.
#
# The grid runs in rings from the rim of the annulus to the roof. Its vertices near the puncture are moved
# onto the rim of the hole, so that the hole is round and not cut along the grid.

AROUND, UPWARD = 36, 15  # cells of the grid
HOLE_RADIUS_M = 5e-3  # of the hole in the septum; assumed: a sheath of 8 mm widens it
_BLENDED = 3  # rings over which the annulus' ellipse goes over into the atrium's


def wall(anatomy: Anatomy, puncture: Array, direction: Array) -> Wall:
    """Return the wall with its holes; the sheath comes through the puncture along a unit vector."""
    inner, cells = _grid(anatomy)
    inner = _pushed_out(anatomy, inner, puncture, direction)
    kept = []
    for cell in cells:
        corners = inner[list(cell)]
        if _off_axis(corners.mean(axis=0), puncture, direction) > 0.98 * HOLE_RADIUS_M:
            kept.append(cell)
    return Wall(inner, inner - WALL_M * inward(anatomy, inner), tuple(kept))


def _grid(anatomy: Anatomy) -> tuple[Array, list[tuple[int, ...]]]:
    """Return the inner vertices, rings from the annulus upward and the roof's last, and the cells."""
    axes, middle = semi_axes_m(anatomy), centre_m(anatomy)
    around: Array = np.arange(AROUND, dtype=np.float64) * (2.0 * np.pi / AROUND)
    lowest = np.arcsin(-middle[2] / axes[2])
    rings = []
    for ring, latitude in enumerate(np.linspace(lowest, 0.5 * np.pi, UPWARD + 1)[:-1]):
        flat = np.cos(latitude) * np.stack([axes[0] * np.cos(around), axes[1] * np.sin(around)], axis=1)
        share = max(0.0, 1.0 - ring / _BLENDED)
        flat = (1.0 - share) * flat + share * annulus_rim(anatomy, around)[:, :2]
        height = np.full(AROUND, middle[2] + axes[2] * np.sin(latitude))
        rings.append(np.column_stack([flat, height]))
    roof = len(rings) * AROUND
    vertices = np.concatenate([*rings, [(0.0, 0.0, middle[2] + axes[2])]])
    cells: list[tuple[int, ...]] = []
    for ring in range(UPWARD):
        for k in range(AROUND):
            low, after = ring * AROUND + k, ring * AROUND + (k + 1) % AROUND
            if ring == UPWARD - 1:
                cells.append((low, after, roof))
            else:
                cells.append((low, after, after + AROUND, low + AROUND))
    return vertices, cells


def annulus_rim(anatomy: Anatomy, around: Array) -> Array:
    """Return the annulus' points in these directions about +z from +x, shape (n, 3) [m]."""
    along, across = coaptation_axes(anatomy)
    ray = np.stack([np.cos(around), np.sin(around), np.zeros(len(around))], axis=1)
    size = np.hypot(ray @ along / anatomy.annulus_along_m, ray @ across / anatomy.annulus_across_m)
    return ray / size[:, np.newaxis]


def _off_axis(place: Array, puncture: Array, direction: Array) -> float:
    """Return the distance of a point on the septal side from the sheath's axis; inf on the other side [m]."""
    way = place - puncture
    along = float(way @ direction)
    if abs(along) > 4.0 * HOLE_RADIUS_M:
        return np.inf
    return float(np.linalg.norm(way - along * direction))


def _pushed_out(anatomy: Anatomy, vertices: Array, puncture: Array, direction: Array) -> Array:
    """Return the vertices with those inside the hole moved to its rim, on the wall."""
    axes, middle = semi_axes_m(anatomy), centre_m(anatomy)
    moved = vertices.copy()
    for index, vertex in enumerate(vertices):
        distance = _off_axis(vertex, puncture, direction)
        if distance >= HOLE_RADIUS_M:
            continue
        way = vertex - puncture
        aside = way - (way @ direction) * direction
        if distance < 1e-9:
            aside = np.cross(direction, (0.0, 0.0, 1.0))
        start = puncture + aside / np.linalg.norm(aside) * HOLE_RADIUS_M
        # where the line along the sheath through that point meets the ellipsoid, nearest to the septum
        p, d = (start - middle) / axes, direction / axes
        a, b, c = d @ d, p @ d, p @ p - 1.0
        moved[index] = start + (-b - np.sqrt(max(b * b - a * c, 0.0))) / a * direction
    return moved


# ----------------------------------------------------------------------------------------------------
# The two leaflets: middle scallops that give way, and what lies beside them, only to be seen.
#
# A scallop is two plates on hinges along the coaptation line: one from the annulus down to the coaptation,
# and the free margin, which hangs below it against that of the other leaflet.

SIDES = {"septal": 1.0, "lateral": -1.0}  # of the coaptation line
SCALLOP_M = 12e-3  # width of the scallops that the clip takes; assumed
_POINTS = 12


@dataclass(frozen=True)
class Plate:
    """A rigid plate of a leaflet, closed valve."""

    hinge: Array  # middle of its hinge line, shape (3,) [m]
    R: Array  # columns: across the leaflet away from the hinge, along the coaptation line, the normal; (3, 3)
    length_m: float  # along these axes
    width_m: float
    thickness_m: float


def scallop(anatomy: Anatomy, side: float) -> tuple[Plate, Plate]:
    """Return the plate from the annulus and the free margin of the leaflet on the side +1 or -1."""
    along, across = coaptation_axes(anatomy)
    outward = side * across
    middle = 0.5 * LEAFLET_M * outward  # the two margins touch
    edge = outward * anatomy.annulus_across_m
    fold = middle - (0.0, 0.0, anatomy.coaptation_depth_m)
    return (
        _plate(edge, fold, along),
        _plate(fold, fold - (0.0, 0.0, anatomy.coaptation_length_m), along),
    )


def free_edge_z_m(anatomy: Anatomy) -> float:
    """Return the height of the leaflets' free edges in the closed valve, below the annulus: < 0 [m]."""
    return -anatomy.coaptation_depth_m - anatomy.coaptation_length_m


def pushed_edge_z_m(anatomy: Anatomy, radius_m: float) -> float:
    """Return how low the free edges reach when a round rod of this radius stands between the leaflets [m].

    It pushes the margins aside; the plates from the annulus, of fixed length, turn down by that.
    """
    first, margin = scallop(anatomy, 1.0)
    reach = anatomy.annulus_across_m - radius_m - 0.5 * LEAFLET_M
    return -math.sqrt(max(first.length_m**2 - reach**2, 0.0)) - margin.length_m


def beside(anatomy: Anatomy, side: float) -> list[trimesh.Trimesh]:
    """Return the parts of a leaflet on both sides of its middle scallop, closed meshes."""
    along, across = coaptation_axes(anatomy)
    parts = []
    for end in (1.0, -1.0):
        u = np.linspace(0.5 * SCALLOP_M, 0.97 * anatomy.annulus_along_m, _POINTS)
        height = 1.0 - (u / anatomy.annulus_along_m) ** 2
        upper = end * u[:, None] * along + side * anatomy.annulus_across_m * np.sqrt(height)[:, None] * across
        lower = end * u[:, None] * along  # on the coaptation line
        lower[:, 2] -= anatomy.coaptation_depth_m * height
        parts.append(_thick(upper, lower))
    return parts


def _plate(hinge: Array, end: Array, along: Array) -> Plate:
    way = end - hinge
    length = float(np.linalg.norm(way))
    first = way / length
    R = np.stack([first, along, np.cross(first, along)], axis=1)
    return Plate(hinge, R, length, SCALLOP_M, LEAFLET_M)


def _thick(upper: Array, lower: Array) -> trimesh.Trimesh:
    """Return the closed solid between two rows of points, as thick as a leaflet along z."""
    down = np.array([0.0, 0.0, LEAFLET_M])
    corners = np.stack([upper + 0.5 * down, lower + 0.5 * down, lower - 0.5 * down, upper - 0.5 * down], 1)
    vertices = corners.reshape(-1, 3)
    faces = []
    for step in range(len(upper) - 1):
        for k in range(4):
            a, b = 4 * step + k, 4 * step + (k + 1) % 4
            faces += [(a, b, b + 4), (a, b + 4, a + 4)]
    last = 4 * (len(upper) - 1)
    faces += [(0, 2, 1), (0, 3, 2), (last, last + 1, last + 2), (last, last + 2, last + 3)]
    mesh = trimesh.Trimesh(vertices, np.array(faces), process=False)
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh


# ----------------------------------------------------------------------------------------------------
# The force with which the flow through the valve shakes the implant, 70 times a minute.
#
# Nayar 2022, Section IV-F, ran 70 strokes a minute of 60 ml through a phantom of the left heart and held
# the robot bent by 90 deg: its tip swung by 0.13 mm, as under a periodic force of that frequency. The force
# itself is not printed; it is the one that swings the tip of `mitral_transseptal@tube`, held likewise with
# its tube not advanced and no friction, by as much.

BEATS_PER_S = 70.0 / 60.0  # Nayar 2022, Section IV-F
PRINTED_FLOW_N = 9.2e-3  # amplitude at 60 ml a stroke; derived, see above
# Assumed: from half of it to twice as much. A valve that leaks passes more than the phantom's did, and only
# a part of the stream meets the implant.
FLOW_N = (0.5 * PRINTED_FLOW_N, 2.0 * PRINTED_FLOW_N)
TILT_RAD = math.radians(30.0)  # of the stream from the valve's axis, at most; assumed
EXPOSED_M = 10e-3  # way of the tip beyond the septum over which the stream gets hold of it; assumed


@dataclass(frozen=True)
class Flow:
    """A pulsating force on the tool frame's origin."""

    amplitude_N: float  # of the force; its mean over a beat is zero
    # In which it acts at the start of a beat's second quarter, unit vector, valve frame, shape (3,).
    direction: Array
    phase_rad: float  # of the beat at time zero

    def beat_rad(self, time_s: float) -> float:
        """Return the phase of the beat [rad]: 0 where the force rises through zero."""
        return (2.0 * math.pi * BEATS_PER_S * time_s + self.phase_rad) % (2.0 * math.pi)

    def force_N(self, time_s: float, beyond_m: float) -> Array:
        """Return the force on a tip so far beyond the septum, which shields it; valve frame, (3,) [N]."""
        share = min(max(beyond_m / EXPOSED_M, 0.0), 1.0)
        force: Array = share * self.amplitude_N * math.sin(self.beat_rad(time_s)) * self.direction
        return force


def random_flow(rng: np.random.Generator, bounds_N: tuple[float, float] = FLOW_N) -> Flow:
    """Return a flow of an amplitude drawn evenly within bounds, its tilt and phase drawn too.

    The direction is evenly spread over the cone of `TILT_RAD` about the valve's axis.
    """
    amplitude = float(rng.uniform(*bounds_N))
    height = float(rng.uniform(math.cos(TILT_RAD), 1.0))
    around, phase = rng.uniform(0.0, 2.0 * math.pi, 2)
    flat = math.sqrt(1.0 - height**2)
    direction = np.array([flat * math.cos(around), flat * math.sin(around), height * DOWN[2]])
    return Flow(amplitude, direction, float(phase))
