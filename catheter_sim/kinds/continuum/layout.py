"""Where everything of a robot lies when it is straight: links, disks, holes. Derived from the data.

Links are counted from 1 at the base, disks from 1 (0 is the fixed one at z = 0), holes like disks.
The hinge of a link stands at its middle, or where `hinge_places` says; a disk at the distal face of every
`links_per_subsegment`-th link.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from catheter_sim.kinds.continuum.spec import ContinuumRobot, Segment, Tendon


@dataclass(frozen=True)
class Link:
    """One rigid link: the far half of its own hinge's length and the near half of the next one's.

    Attributes:
        index: 1 at the base.
        segment: the segment that its hinge belongs to.
        length_m: backbone length that its hinge stands for [m].
        hinge_z_m, face_z_m: height of its hinge and of its distal face in the straight robot [m].
        disk: number of the disk at its distal face, 0 where there is none.
    """

    index: int
    segment: Segment
    length_m: float
    hinge_z_m: float
    face_z_m: float
    disk: int


def disks(robot: ContinuumRobot, segment: Segment) -> int:
    """Return how many subsegments `segment` has (`disks_per_segment` rules where it is set)."""
    return robot.disks_per_segment or segment.disks


def links(robot: ContinuumRobot) -> list[Link]:
    """Return the robot's links, base to tip."""
    result: list[Link] = []
    z, disk = 0.0, 0
    for segment in robot.segments:
        count = disks(robot, segment) * robot.links_per_subsegment
        length = segment.length_m / count
        places = hinge_places(robot, segment)
        for i in range(count):
            carries_disk = (i + 1) % robot.links_per_subsegment == 0
            disk += carries_disk
            start = z + i * length
            hinge_z = start + length / 2.0
            if robot.hinges == "rod" or segment.hinge_share != 0.5:
                within = i % robot.links_per_subsegment
                hinge_z = start + (places[within] * robot.links_per_subsegment - within) * length
            result.append(
                Link(
                    index=len(result) + 1,
                    segment=segment,
                    length_m=length,
                    hinge_z_m=hinge_z,
                    face_z_m=start + length,
                    disk=disk if carries_disk else 0,
                )
            )
        z += segment.length_m
    return result


def axes_of(segment: Segment) -> str:
    """Return the letters of the directions in which a segment bends, "" for none."""
    return "" if segment.bending_axes == "none" else segment.bending_axes


def is_centred(robot: ContinuumRobot) -> bool:
    """Return whether no segment's hinges stand elsewhere than in the middles of its subsegments."""
    return all(segment.hinge_share == 0.5 for segment in robot.segments)


def hinge_places(robot: ContinuumRobot, segment: Segment | None = None) -> list[float]:
    """Return where the hinges of a subsegment are, as shares of its length, rising; default: of the first's.

    Bent by a small t at n hinges of equal turns, a subsegment of length h is shorter between its disks by
    h t^2 / 2 times the variance of the turn along it. At the middles of equal links that is 1/12 (1 + 2/n^2),
    of an arc 1/12. "rod" gives the n hinges equal distances, and leaves 1 / 2(n + 1) at either end: 1/12.
    """
    count = robot.links_per_subsegment
    if count == 1:
        return [(segment or robot.segments[0]).hinge_share]
    if robot.hinges == "even":
        return [(k + 0.5) / count for k in range(count)]
    end = 0.5 / (count + 1)
    return [end + k * (1.0 - 2.0 * end) / (count - 1) for k in range(count)]


@dataclass(frozen=True)
class Piece:
    """What moves as one rigid body: its mass and moments of inertia as of solid cylinders.

    Attributes:
        mass_kg: of it.
        centre_z_m: height of its centre of mass in the straight robot [m].
        transverse_kg_m2, axial_kg_m2: about its centre, across the robot's axis and about it.
    """

    mass_kg: float
    centre_z_m: float
    transverse_kg_m2: float
    axial_kg_m2: float


def pieces(robot: ContinuumRobot) -> list[Piece]:
    """Return what lies below the first hinge (the first piece), and what each link carries.

    With masses "along" the robot a piece reaches from its own hinge to the next one, so that all together
    have the mass, the centre and the second moments of the unbent robot; with "faces" each link carries the
    mass of the length that its hinge stands for, in the middle of its distal face, and nothing is below.
    """
    row = links(robot)
    if robot.masses == "faces":
        return [
            Piece(0.0, 0.0, 0.0, 0.0),
            *(_at(link.segment, link.length_m, link.face_z_m) for link in row),
        ]
    ends = [0.0, *(link.hinge_z_m for link in row), sum(segment.length_m for segment in robot.segments)]
    return [_between(robot, low, high) for low, high in pairwise(ends)]


def _at(segment: Segment, length: float, centre: float) -> Piece:
    """Return a piece of one segment of a length [m], its centre at a height [m]."""
    mass, radius = segment.mass_kg * length / segment.length_m, segment.outer_radius_m
    return Piece(mass, centre, mass * (radius**2 / 4.0 + length**2 / 12.0), mass * radius**2 / 2.0)


def _between(robot: ContinuumRobot, low: float, high: float) -> Piece:
    """Return the piece between two heights [m], which may lie in several segments."""
    parts: list[Piece] = []
    start = 0.0
    for segment in robot.segments:
        bottom, top = max(low, start), min(high, start + segment.length_m)
        if top > bottom:
            parts.append(_at(segment, top - bottom, 0.5 * (top + bottom)))
        start += segment.length_m
    mass = sum(part.mass_kg for part in parts)
    centre = sum(part.mass_kg * part.centre_z_m for part in parts) / mass
    transverse = sum(part.transverse_kg_m2 + part.mass_kg * (part.centre_z_m - centre) ** 2 for part in parts)
    return Piece(mass, centre, transverse, sum(part.axial_kg_m2 for part in parts))


def disk_masses(robot: ContinuumRobot) -> np.ndarray:
    """Return the mass that statics put at each disk, the base's fixed one left out, shape (n,) [kg].

    With "faces" that of the subsegment below it; of masses "along" the robot half of either neighbour's,
    which bends the robot alike to second order in a subsegment's length.
    """
    counts = [disks(robot, segment) for segment in robot.segments]
    each = [segment.mass_kg / count for segment, count in zip(robot.segments, counts, strict=True)]
    return _at_faces(robot, np.repeat(each, counts))


def face_masses(robot: ContinuumRobot) -> np.ndarray:
    """Return the mass that statics put at each link's distal face, as `disk_masses` does, shape (n,) [kg]."""
    row = links(robot)
    return _at_faces(
        robot, np.array([link.segment.mass_kg / link.segment.length_m * link.length_m for link in row])
    )


def _at_faces(robot: ContinuumRobot, own: np.ndarray) -> np.ndarray:
    """Return masses at the distal faces of stretches that have the masses `own`, shape (n,) [kg]."""
    if robot.masses == "faces":
        return own
    return 0.5 * (own + np.append(own[1:], 0.0))


def segment_ends(robot: ContinuumRobot) -> dict[str, int]:
    """Return, by segment name, the number of the disk at its end."""
    ends: dict[str, int] = {}
    count = 0
    for segment in robot.segments:
        count += disks(robot, segment)
        ends[segment.name] = count
    return ends


def last_disk(robot: ContinuumRobot, tendon: Tendon) -> int:
    """Return the number of the disk in which `tendon` is fixed."""
    return segment_ends(robot)[tendon.ends_at]


def disk_heights(robot: ContinuumRobot) -> np.ndarray:
    """Return the heights of the disks in the straight robot, the base's first, shape (n + 1,) [m]."""
    return np.array([0.0, *(link.face_z_m for link in links(robot) if link.disk)])


def hole_angle_rad(robot: ContinuumRobot, tendon: Tendon, height_m: float) -> float:
    """Return the angle of a tendon's hole about +z at a height, with the segments' rest twist [rad]."""
    angle, z = tendon.angle_rad, 0.0
    for segment in robot.segments:
        angle += segment.rest_twist_rad_per_m * min(max(height_m - z, 0.0), segment.length_m)
        z += segment.length_m
    return angle


def is_planar(robot: ContinuumRobot) -> bool:
    """Return whether every hinge bends in the xz plane and none twists."""
    return all(
        segment.bending_axes == "x" and not np.isfinite(segment.torsion_stiffness_N_m2)
        for segment in robot.segments
    )
