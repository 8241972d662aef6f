"""A catheter as hinges in a row, for what its load does to it: every gap and the exposed tube by itself.

A bending joint's hinges lie as `layout.hinge_heights_m` says. An exposed tube of length s that bends is
`TUBE_HINGES` pairs of hinges, toward +x and toward +y, evenly spaced about its middle by s over the root of
(their number squared - 1): the mean square of their places is then a beam's, s^2 / 12, so that a straight
tube yields under any small force and moment at its end by F s^3 / (3 EI), F s^2 / (2 EI) and M s / EI.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.catheter.layout import bending_tubes, elements, hinge_heights_m, ring_length_m
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.kinds.catheter.theory.hinge_kernel import (
    AROUND_Z,
    TOWARD_X,
    TOWARD_Y,
    moment_rows,
    stand_rows,
)

TUBE_HINGES = 6  # even: x and y take turns in being first, so that a bend in both does not twist the tube


@dataclass(frozen=True)
class Hinges:
    """A robot's h hinges, p tubes and n elements, base to tip.

    Attributes:
        kind: `TOWARD_X`, `TOWARD_Y` or `AROUND_Z`, shape (h,).
        segment: index of the segment that each belongs to, shape (h,).
        link_m: straight way before each hinge, and from the last one to the tip, at no advance, (h + 1,) [m].
        link_share: what an advance adds to it, as a share of itself, shape (h + 1, p).
        tubes: indices of the prismatic segments, shape (p,).
        after: how many hinges come before each element, shape (n,).
        face_m, face_share: the element's distal face, from the last hinge before it, as the links.
        back_m: from the face back to the element's centre of mass, shape (n,).
        mass_kg: of each element, shape (n,).
    """

    kind: np.ndarray
    segment: np.ndarray
    link_m: Array
    link_share: Array
    tubes: np.ndarray
    after: np.ndarray
    face_m: Array
    face_share: Array
    back_m: Array
    mass_kg: Array


@dataclass(frozen=True)
class Standing:
    """Where m rows of hinges are in the base frame.

    Attributes:
        axis: of each hinge, shape (m, h, 3).
        place: of each hinge, and last the tip, shape (m, h + 1, 3) [m].
        along: direction of each link, shape (m, h + 1, 3).
        face: the elements' distal faces, shape (m, n, 3) [m].
        turned: their orientations, shape (m, n, 3, 3).
        centre: their centres of mass, shape (m, n, 3) [m].
    """

    axis: Array
    place: Array
    along: Array
    face: Array
    turned: Array
    centre: Array


@dataclass(frozen=True)
class Load:
    """What acts along m rows, base frame.

    Attributes:
        force: on the tip, shape (m, 3) [N].
        moment: there, shape (m, 3) [N m].
        gravity: on the elements' masses, shape (3,) [m/s^2].
    """

    force: Array
    moment: Array
    gravity: Array

    def part(self, rows: np.ndarray, share: float = 1.0) -> Load:
        """Return a share of it at some of the rows."""
        return Load(share * self.force[rows], share * self.moment[rows], share * self.gravity)


class _Row:
    """Collects hinges and elements on the way from base to tip."""

    def __init__(self, tubes: list[int]) -> None:
        self.tubes = tubes
        self.kind: list[int] = []
        self.segment: list[int] = []
        self.links: list[tuple[float, Array]] = []
        self.faces: list[tuple[int, float, Array, float, float]] = []
        self._way, self._share = 0.0, np.zeros(len(tubes))

    def go(self, way_m: float, tube: int | None = None, share: float = 0.0) -> None:
        """Go on straight, besides by a share of a tube's advance."""
        self._way += way_m
        if tube is not None:
            self._share = self._share + share * (np.array(self.tubes) == tube)

    def hinge(self, kind: int, segment: int) -> None:
        """Put a hinge here."""
        self.links.append((self._way, self._share))
        self.kind.append(kind)
        self.segment.append(segment)
        self._way, self._share = 0.0, np.zeros(len(self.tubes))

    def face(self, ahead_m: float, back_m: float, mass_kg: float) -> None:
        """Put an element's face ahead of here."""
        self.faces.append((len(self.kind), self._way + ahead_m, self._share, back_m, mass_kg))

    def end(self) -> Hinges:
        """Return the row, which ends here."""
        self.links.append((self._way, self._share))
        link_m, link_share = zip(*self.links, strict=True)
        after, face_m, face_share, back_m, mass_kg = zip(*self.faces, strict=True)
        return Hinges(
            np.array(self.kind, dtype=int),
            np.array(self.segment, dtype=int),
            np.array(link_m),
            np.array(link_share),
            np.array(self.tubes, dtype=int),
            np.array(after, dtype=int),
            np.array(face_m),
            np.array(face_share),
            np.array(back_m),
            np.array(mass_kg),
        )


def hinges_of(robot: CatheterRobot) -> Hinges:
    """Return `robot` as hinges in a row."""
    tubes = [index for index, item in enumerate(robot.segments) if item.joint == "prismatic"]
    row, bend = _Row(tubes), bending_tubes(robot)
    for index, segment in enumerate(robot.segments):
        if segment.joint == "bending":
            faces = [part.face_m for part in elements(robot) if part.segment == index]
            _add_gaps(row, index, segment, faces)
            continue
        if segment.joint == "torsion":
            row.hinge(AROUND_Z, index)
        elif segment.joint == "prismatic":
            _add_tube(row, index, segment in bend)
        row.go(segment.length_m)
        row.face(0.0, 0.5 * segment.length_m, segment.mass_kg)
    return row.end()


def _add_gaps(row: _Row, index: int, segment: CatheterSegment, faces: list[float]) -> None:
    kind = TOWARD_X if segment.bends_toward == "x" else TOWARD_Y
    before = 0.0
    for gap, height in enumerate(hinge_heights_m(segment)):
        row.go(float(height) - before)
        row.hinge(kind, index)
        before = float(height)
        if gap < segment.rings:
            back = 0.5 * ring_length_m(segment)
            row.face(faces[gap] - before, back, segment.mass_kg / segment.rings)
    row.go(segment.length_m - before)


def _add_tube(row: _Row, index: int, bends: bool) -> None:
    if not bends:
        row.go(0.0, index, 1.0)
        return
    spacing = 1.0 / math.sqrt(TUBE_HINGES**2 - 1.0)
    end = 0.5 - 0.5 * (TUBE_HINGES - 1) * spacing
    for pair in range(TUBE_HINGES):
        row.go(0.0, index, spacing if pair else end)
        first, second = (TOWARD_X, TOWARD_Y) if pair % 2 == 0 else (TOWARD_Y, TOWARD_X)
        row.hinge(first, index)
        row.hinge(second, index)
    row.go(0.0, index, end)


def stand(hinges: Hinges, angle: Array, advance: Array) -> Standing:
    """Return where the hinges are.

    Args:
        hinges: of one robot.
        angle: of each hinge, shape (m, h) [rad].
        advance: of each tube, shape (m, p) [m].
    """
    rows, count = angle.shape
    link = hinges.link_m + advance @ hinges.link_share.T
    place, axis = np.empty((rows, count + 1, 3)), np.empty((rows, count, 3))
    turned = np.empty((rows, count + 1, 3, 3))  # before each hinge, and beyond the last; columns second
    stand_rows(hinges.kind, link, np.ascontiguousarray(angle), place, axis, turned)
    along = turned[:, :, 2]
    base = np.concatenate([np.zeros((rows, 1, 3)), place[:, :-1]], axis=1)[:, hinges.after]
    way = hinges.face_m + advance @ hinges.face_share.T
    ahead = along[:, hinges.after]
    face = base + way[..., np.newaxis] * ahead
    return Standing(
        axis=axis,
        place=place,
        along=along,
        face=face,
        turned=turned[:, hinges.after].swapaxes(-1, -2),
        centre=face - hinges.back_m[:, np.newaxis] * ahead,
    )


def moments(hinges: Hinges, standing: Standing, load: Load) -> tuple[Array, Array]:
    """Return the load's moment about each hinge, shape (m, h) [N m], and its slopes, shape (m, h, h).

    A hinge turns all that is beyond it: the arm of a farther hinge, and its axis, turn with a nearer one.
    """
    rows, count = standing.axis.shape[:2]
    torque, slopes = np.empty((rows, count)), np.empty((rows, count, count))
    scratch = np.empty((2, 2, max(count, 2), 3))
    moment_rows(
        standing.axis,
        standing.place,
        np.ascontiguousarray(standing.centre),
        hinges.after,
        hinges.mass_kg,
        np.ascontiguousarray(load.force),
        np.ascontiguousarray(load.moment),
        np.ascontiguousarray(load.gravity),
        scratch[0],
        scratch[1],
        torque,
        slopes,
    )
    return torque, slopes
