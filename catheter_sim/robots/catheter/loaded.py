"""What a load does to a catheter in balance: each gap, the exposed tube and soft drives by themselves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.robot import has_mount_slide
from catheter_sim.core.statics import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.robots.catheter.description import (
    bending_tubes,
    bent_by,
    beside_friction,
    closing_angle_rad,
    elements,
    hinge_heights_m,
    joint_stiffness,
    moved_segment,
    ring_length_m,
    tube_stiffness_N_m2,
)
from catheter_sim.robots.catheter.kinematics import arm_m, drawn_at_rest_m, played_m, pulled_m
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment

# ----------------------------------------------------------------------------------------------------
# Where hinges in a row are, and what a load does about them, in compiled loops: the text is in `hinges`.

TOWARD_X, TOWARD_Y, AROUND_Z = 0, 1, 2


@compiled
def stand_rows(kind, link, angle, place, axis, turned):
    """Write where h hinges of given kinds are at each of m rows.

    Straight ways before each and beyond the last (m, h + 1) [m], angles (m, h) [rad]. Out: places of the
    hinges and the tip (m, h + 1, 3) [m]; axes (m, h, 3); frames before each hinge and beyond the last, their
    columns first, (m, h + 1, 3, 3).
    """
    rows, count = angle.shape
    for m in range(rows):
        for i in range(3):
            for j in range(3):
                turned[m, 0, i, j] = 1.0 if i == j else 0.0
            place[m, 0, i] = 0.0
        for k in range(count + 1):
            for i in range(3):
                before = place[m, k - 1, i] if k else 0.0
                place[m, k, i] = before + link[m, k] * turned[m, k, 2, i]
            if k == count:
                continue
            # Which two columns the hinge mixes, first' = cos first - sin second.
            first, second, which, sign = 0, 2, 1, 1.0
            if kind[k] == TOWARD_Y:
                first, second, which, sign = 1, 2, 0, -1.0
            elif kind[k] == AROUND_Z:
                first, second, which, sign = 1, 0, 2, 1.0
            sine, cosine = math.sin(angle[m, k]), math.cos(angle[m, k])
            for i in range(3):
                one, other = turned[m, k, first, i], turned[m, k, second, i]
                axis[m, k, i] = sign * turned[m, k, which, i]
                turned[m, k + 1, which, i] = turned[m, k, which, i]
                turned[m, k + 1, second, i] = sine * one + cosine * other
                turned[m, k + 1, first, i] = cosine * one - sine * other


@compiled
def _cross(a, b, out):
    """Write the vector product of two vectors, shape (3,) each."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@compiled
def moment_rows(axis, place, centre, after, mass, force, moment, gravity, lever, turns, torque, slopes):
    """Write the load's moments about hinges at each of m rows (m, h) [N m], and their slopes (m, h, h).

    Axes (m, h, 3), places with the tip (m, h + 1, 3). Of the n elements centres of mass (m, n, 3), how many
    hinges come before each, and mass. Force and moment on the tip (m, 3), gravity (3,). SI units. `lever` and
    `turns`, (2, h, 3) each, are overwritten.
    """
    rows, count = axis.shape[:2]
    for m in range(rows):
        for k in range(count):
            own = axis[m, k]
            weight = lever[1, k]
            arm = lever[0, k]
            for i in range(3):
                arm[i] = place[m, count, i] - place[m, k, i]
                weight[i] = 0.0
            for n in range(len(mass)):
                if after[n] > k and mass[n] != 0.0:
                    for i in range(3):
                        weight[i] += mass[n] * (centre[m, n, i] - place[m, k, i])
            _cross(own, arm, turns[0, k])
            _cross(own, weight, turns[1, k])
            torque[m, k] = 0.0
            for i in range(3):
                torque[m, k] += own[i] * moment[m, i] + turns[0, k, i] * force[m, i]
                torque[m, k] += turns[1, k, i] * gravity[i]
        for j in range(count):
            pushed, heavy, twisted = lever[0, 0], lever[0, 1], lever[1, 0]  # no longer needed
            _cross(force[m], axis[m, j], pushed)
            _cross(gravity, axis[m, j], heavy)
            _cross(moment[m], axis[m, j], twisted)
            for k in range(j, count):
                common = 0.0
                alone = 0.0
                for i in range(3):
                    common += turns[0, k, i] * pushed[i] + turns[1, k, i] * heavy[i]
                    alone += axis[m, k, i] * twisted[i]
                slopes[m, j, k] = common
                slopes[m, k, j] = common + (alone if k > j else 0.0)


# ----------------------------------------------------------------------------------------------------
# A catheter as hinges in a row, for what its load does to it: every gap and the exposed tube by itself.
#
# A bending joint's hinges lie as `layout.hinge_heights_m` says. An exposed tube of length s that bends is
# `TUBE_HINGES` pairs of hinges, toward +x and toward +y, evenly spaced about its middle by s over the root
# of (their number squared - 1): the mean square of their places is then a beam's, s^2 / 12, so that a
# straight tube yields under any small force and moment at its end by F s^3 / (3 EI), F s^2 / (2 EI) and M s
# / EI.

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
    """What acts along m rows, base frame: on the tip, (m, 3) [N] and [N m]; on masses, (3,) [m/s^2]."""

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
    """Return where one robot's hinges are at angles (m, h) [rad] and advances of its tubes (m, p) [m]."""
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
    lever, turns = np.empty((2, 2, max(count, 2), 3))
    masses = np.ascontiguousarray(standing.centre), hinges.after, hinges.mass_kg
    loads = (np.ascontiguousarray(item) for item in (load.force, load.moment, load.gravity))
    moment_rows(standing.axis, standing.place, *masses, *loads, lever, turns, torque, slopes)
    return torque, slopes


# ----------------------------------------------------------------------------------------------------
# What holds a catheter's hinges under a load: gaps and their tendons, tubes, drives, the mount.

TOWARD = (1.0, -1.0)  # the sides of a pair's two tendons
_RIM_RATIO = 1e4  # of rims that touch, over their gap's stiffness
_SHORTEST_M = 1e-5  # of a tube, for its stiffness
# What of `Held`, and of `Pull`, is given row by row.
_HELDS_ROWS, _PULLS_ROWS = ("stiffness", "rest", "drawn_m"), ("compliance", "firmness", "drawn_m")


@dataclass(frozen=True)
class Pull:
    """A bending joint's two tendons along m rows.

    Attributes:
        pair: index of it.
        gaps: its hinges.
        half_gap_m, arm_m: of the segment.
        compliance: of each tendon, as the joint feels it, shape (m,) [m/N].
        firmness: of a tendon's lack of length against a tension, shape (m,) [N/m].
        drawn_m: by how much the tendon toward + and the one toward - may be no longer than straight,
            shape (m, 2) [m].
    """

    pair: int
    gaps: slice
    half_gap_m: float
    arm_m: float
    compliance: Array
    firmness: Array
    drawn_m: Array

    def part(self, rows: np.ndarray) -> Pull:
        """Return it at some of the rows."""
        numbers = {name: getattr(self, name)[rows] for name in _PULLS_ROWS}
        return replace(self, **numbers)

    def shortened(self, angle: Array, side: int) -> tuple[Array, Array, Array]:
        """Return how much shorter than straight the tendon of a side of `TOWARD` is at angles (m, h) [rad].

        Way (m,) [m], its slopes in the gaps' angles (m, g) [m/rad], and theirs.
        """
        half, toward = 0.5 * angle[:, self.gaps], TOWARD[side] * self.arm_m
        sine, cosine = np.sin(half), np.cos(half)
        way = 2.0 * (2.0 * self.half_gap_m * np.sin(0.5 * half) ** 2 + toward * sine).sum(axis=1)
        slope = self.half_gap_m * sine + toward * cosine
        return way, slope, 0.5 * (self.half_gap_m * cosine - toward * sine)


@dataclass(frozen=True)
class Held:
    """What holds a robot along m rows.

    Attributes:
        hinges: of the robot, h of them and p tubes.
        free: which of h hinges, p tubes, tensions and the mount yield, shape (h + p + 2 k + 1,).
        stiffness, rest: of gaps and tubes at each row, shape (m, h) [N m/rad] and [rad].
        rim: angle at which a gap closes; inf of other hinges, shape (h,) [rad].
        pulls: of the k bending joints.
        turns: of torsion joints: hinge, pair, segment, and stiffness of its drive [N/m].
        pushes: pair of each tube, and stiffness of its drive [N/m].
        drawn_m: what arrives at the pairs of torsion joints and tubes, shape (m, t) [m].
        mount: its compliance [m/N].
    """

    hinges: Hinges
    free: np.ndarray
    stiffness: Array
    rest: Array
    rim: Array
    pulls: tuple[Pull, ...]
    turns: tuple[tuple[int, int, CatheterSegment, float], ...]
    pushes: tuple[tuple[int, float], ...]
    drawn_m: Array
    mount: float

    def part(self, rows: np.ndarray) -> Held:
        """Return it at some of the rows."""
        pulls = tuple(pull.part(rows) for pull in self.pulls)
        numbers = {name: getattr(self, name)[rows] for name in _HELDS_ROWS}
        return replace(self, pulls=pulls, **numbers)

    @property
    def frame(self) -> tuple[object, ...]:
        """What is one number for all rows, as a key: robots that have the same may be balanced together."""
        hinges = vars(self.hinges).values()
        pulls = [(pull.pair, pull.gaps.start, pull.half_gap_m, pull.arm_m) for pull in self.pulls]
        parts = (*hinges, self.free, self.rim, pulls, self.pushes)
        return (*(np.asarray(part, dtype=float).tobytes() for part in parts), self.turns, self.mount)


@dataclass(frozen=True)
class State:
    """Where a robot is along m rows.

    Attributes:
        angle: of the hinges, shape (m, h) [rad].
        advance: of the tubes, shape (m, p) [m].
        tension: of each bending joint's two tendons, side by side, shape (m, 2 k) [N].
        taut: which of these are, shape (m, 2 k); the others' tensions are 0 in balance.
        sunk: how far the mount gives way, shape (m,) [m].
    """

    angle: Array
    advance: Array
    tension: Array
    taut: np.ndarray
    sunk: Array

    def part(self, rows: np.ndarray) -> State:
        """Return it at some of the rows."""
        return State(
            self.angle[rows], self.advance[rows], self.tension[rows], self.taut[rows], self.sunk[rows]
        )


def together(parts: Sequence[Held]) -> Held:
    """Return what holds several robots of the same `frame`, the rows of one after those of another."""
    pulls = tuple(
        replace(own[0], **_joined(own, _PULLS_ROWS))
        for own in zip(*(part.pulls for part in parts), strict=True)
    )
    return replace(parts[0], pulls=pulls, **_joined(parts, _HELDS_ROWS))


def _joined(parts: Sequence[Any], names: Sequence[str]) -> dict[str, Any]:
    """Return what parts give row by row, those of one after those of another."""
    return {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}


def held_by(robot: CatheterRobot, inputs: Inputs, rows: np.ndarray, values: Array, rubbed: Array) -> Held:
    """Return what holds `robot` at some rows of inputs.

    Args:
        values: of each pair's joint without load, shape (m, t) [rad or m].
        rubbed: tension of each bending pair at its drive over that at its joint, shape (m, t).
    """
    hinges = hinges_of(robot)
    count, pair_of = len(hinges.kind), {moved_segment(robot, k): k for k in range(len(robot.tendons))}
    stiffness, rest = np.zeros((len(rows), count)), np.zeros((len(rows), count))
    free, rim, drawn = np.zeros(count, bool), np.full(count, math.inf), values.copy()
    pulls, turns = [], []
    for hinge, (kind, index) in enumerate(zip(hinges.kind, hinges.segment, strict=True)):
        segment, pair = robot.segments[index], pair_of[index]
        if segment.joint == "bending":
            gaps = segment.rings + 1
            stiffness[:, hinge] = joint_stiffness(robot, segment) * gaps
            rest[:, hinge], rim[hinge] = segment.rest_rad / gaps, closing_angle_rad(segment) / gaps
            free[hinge] = True
            if not hinge or hinges.segment[hinge - 1] != index:
                pulls.append(_pull(robot, inputs, rows, pair, hinge, rubbed[:, pair]))
        elif kind == AROUND_Z:
            drive = robot.tendons[pair].stiffness_N_per_m
            turns.append((hinge, pair, segment, drive))
            drawn[:, pair] = pulled_m(segment, values[:, pair])
            free[hinge] = math.isfinite(drive)
        else:
            own, length = tube_stiffness_N_m2(robot, segment), values[:, pair]
            toward = segment.tube_curvature_x_per_m if kind == TOWARD_X else segment.tube_curvature_y_per_m
            rest[:, hinge] = toward * length / TUBE_HINGES
            free[hinge] = math.isfinite(own)
            stiffness[:, hinge] = own * TUBE_HINGES / np.maximum(length, _SHORTEST_M) if free[hinge] else 0.0
    pushes = tuple((pair_of[k], robot.tendons[pair_of[k]].stiffness_N_per_m) for k in hinges.tubes)
    soft = [math.isfinite(drive) for _, drive in pushes]
    on_slide = has_mount_slide(robot)
    return Held(
        hinges,
        np.array([*free, *soft, *(True for _ in pulls for _ in TOWARD), on_slide], bool),
        stiffness,
        rest,
        rim,
        tuple(pulls),
        tuple(turns),
        pushes,
        drawn,
        1.0 / robot.mount.axial_stiffness_N_per_m if on_slide else 0.0,
    )


def _pull(
    robot: CatheterRobot, inputs: Inputs, rows: np.ndarray, pair: int, first: int, rubbed: Array
) -> Pull:
    item, segment = robot.tendons[pair], bent_by(robot)[robot.tendons[pair].name]
    played = played_m(item, inputs.tendon[:, pair])[rows]
    home = [drawn_at_rest_m(segment, sign) - item.slack_m for sign in ("pos", "neg")]
    return Pull(
        pair,
        slice(first, first + segment.rings + 1),
        segment.half_gap_m,
        segment.arm_m,
        rubbed / item.stiffness_N_per_m,
        np.full(len(rows), joint_stiffness(robot, segment) / segment.arm_m**2),
        np.stack([played + home[0], -played + home[1]], axis=1),
    )


def at_values(held: Held, values: Array, sunk_m: Array) -> State:
    """Return where the joints' values, shape (m, t), put the hinges; no tendon is taut yet."""
    angle, count = held.rest.copy(), 2 * len(held.pulls)
    for pull in held.pulls:
        angle[:, pull.gaps] = values[:, [pull.pair]] / (pull.gaps.stop - pull.gaps.start)
    for hinge, pair, _, _ in held.turns:
        angle[:, hinge] = values[:, pair]
    advance = values[:, [pair for pair, _ in held.pushes]]
    none = np.zeros((len(values), count))
    return State(angle, advance, none, none > 0.0, sunk_m.copy())


def sided(held: Held, state: State) -> State:
    """Return `state` with those tendons taut that would be stretched, and those slack that would push.

    Of a joint's two on a rigid mount the one that would be stretched more: beside a bent rest the other may
    lack some micrometres, and is taken to give way, as in `tendons`.
    """
    tension = np.where(state.taut, state.tension, 0.0)
    score = np.empty_like(tension)
    for k, pull in enumerate(held.pulls):
        for side in range(2):
            own = tension[:, 2 * k + side]
            way = pull.shortened(state.angle, side)[0]
            lacks = pull.drawn_m[:, side] - state.sunk - way - pull.compliance * own
            score[:, 2 * k + side] = own + pull.firmness * lacks
    taut = score > 0.0
    if held.mount == 0.0:
        pairs = score.reshape(len(score), -1, 2)
        taut &= (pairs >= pairs.max(axis=2, keepdims=True, initial=-math.inf)).reshape(score.shape)
    return replace(state, tension=np.where(taut, tension, 0.0), taut=taut)


def unbalanced(held: Held, state: State, load: Load) -> tuple[Array, Array]:
    """Return what is unbalanced, and its slopes, of hinges, tubes, tensions and the mount.

    Returns:
        Moments of the hinges [N m], then ways [m] and slack tendons' tensions [N], shape (m, u), and slopes
        in the state's numbers, shape (m, u, u).
    """
    hinges, tubes = len(held.hinges.kind), len(held.hinges.tubes)
    standing = stand(held.hinges, state.angle, state.advance)
    residual = np.zeros((len(state.angle), len(held.free)))
    slopes = np.zeros((*residual.shape, residual.shape[1]))
    torque, turning = moments(held.hinges, standing, load)
    over = np.sign(state.angle) * np.maximum(np.abs(state.angle) - held.rim, 0.0)
    rims = _RIM_RATIO * held.stiffness
    residual[:, :hinges] = held.stiffness * (state.angle - held.rest) + rims * over - torque
    slopes[:, :hinges, :hinges] = -turning
    diagonal = np.einsum("mii->mi", slopes)
    diagonal[:, :hinges] += held.stiffness + rims * (over != 0.0)
    for hinge, pair, segment, drive in held.turns:
        if math.isfinite(drive):
            arm = arm_m(segment, state.angle[:, hinge])
            lacks = pulled_m(segment, state.angle[:, hinge]) - held.drawn_m[:, pair]
            residual[:, hinge] += drive * lacks * arm
            diagonal[:, hinge] += drive * arm**2
    for tube, (pair, drive) in enumerate(held.pushes):
        if math.isfinite(drive):
            outward = np.einsum("l,mli,mi->m", held.hinges.link_share[:, tube], standing.along, load.force)
            residual[:, hinges + tube] = state.advance[:, tube] - held.drawn_m[:, pair] - outward / drive
            diagonal[:, hinges + tube] = 1.0
    for k, pull in enumerate(held.pulls):
        for side in range(2):
            _add_pull(pull, state, side, 2 * k + side, residual, slopes)
    pressing = state.tension.sum(axis=1) - load.force[:, 2] - held.hinges.mass_kg.sum() * load.gravity[2]
    residual[:, -1] = state.sunk - held.mount * pressing
    slopes[:, -1, hinges + tubes : -1] = -held.mount
    slopes[:, -1, -1] = 1.0
    return residual, slopes


def _add_pull(pull: Pull, state: State, side: int, place: int, residual: Array, slopes: Array) -> None:
    """Add one tendon of a joint, at `place` among all, to residual (m, u) and slopes (m, u, u)."""
    tension, taut = state.tension[:, place], state.taut[:, place]
    own = place - state.tension.shape[1] - 1  # counted from the end, where the mount is
    way, slope, curve = pull.shortened(state.angle, side)
    slope, curve = slope * taut[:, np.newaxis], curve * taut[:, np.newaxis]
    lacks = way + pull.compliance * tension - pull.drawn_m[:, side] + state.sunk
    residual[:, pull.gaps] -= tension[:, np.newaxis] * slope
    residual[:, own] = np.where(taut, lacks, tension)
    np.einsum("mii->mi", slopes)[:, pull.gaps] -= tension[:, np.newaxis] * curve
    slopes[:, pull.gaps, own] = -slope
    slopes[:, own, pull.gaps] = slope
    slopes[:, own, own] = np.where(taut, pull.compliance, 1.0)
    slopes[:, own, -1] = taut


# ----------------------------------------------------------------------------------------------------
# What a load does to a catheter in balance: each gap, the exposed tube and soft drives by themselves.
#
# A force and a moment at the tip turn every hinge of `hinges` with a . (r x F + M), r from the hinge to the
# tip, and so does the weight of what is beyond it. They are balanced by
#
# - a gap: K (n + 1) (phi - rest), and its two tendons, which pull and never push: tension times what the
#   gap shortens the tendon by for its angle. A joint's n + 1 gaps share one tension, which holds their sum
#   alone: where they are far from the tip they yield one way, and near it the other way. A force F across
#   the end of a straight joint of length L moves a tip beyond it by F L^2 / (12 K) by that alone, however
#   stiff the tendons are;
# - an exposed tube: EI against bending off its own curvature, at its present length;
# - a drive of finite stiffness. Rigid ones hold; inextensible tendons do so exactly.
#
# Against what pulls the joint on, a joint yields until its antagonist is taut: that is slack by `slack_m`,
# and by Nayar 2022, Eq. 4 where the joint is bent. Two gaps' rims that touch hold each other.
#
# All rows are balanced at once by Newton's method. Which tendon is taut is found on the way: one whose
# tension would be below zero is let go, one that would be stretched is taken up.
#
# Friction. A joint's tension and that at its drive stay in the ratio that they have without the load at
# that row, as if its tendon were as much softer or stiffer: right where the joint slips the same way with
# the load. A constant force on `mitral_transseptal@tube` moves the tip so to 1 % (rms) of what the
# simulation says, at coefficients of 0.05 and 0.2; on `mitral_4dof` with taut tendons of 3 and 5 N/mm to 1
# to 5 % at 0.1, and to 4 to 9 % at 0.3. A load that comes and goes is held by friction besides: that is not
# known here.
#
# Laws of tendons and joints that were measured keep a history of which a load would be part: beside these
# it is refused.
#
# The law of a tube takes no notice of its torsion. What a drive of a tube feels of the tube's bending, and
# of the weight, is left out.

_PARTS = ("moved_m", "turn", "joint_angles", "tension", "left")  # of `Yielded`
_MOST_STEPS = 40
_LARGEST_STEP_RAD = 0.15  # of any hinge; gaps close at 0.4 or so
_BALANCED_N_M = 1e-13
_MET_M = 1e-14
_LEAST_TENSION_N = 1e-6  # from which on it is known how much of it friction takes
_SHARES = np.linspace(0.1, 1.0, 10)  # of the load, one after another, where all at once finds no balance


@dataclass(frozen=True)
class Yielded:
    """What a load alone does to a catheter, along m rows: differences from where it is without.

    Attributes:
        moved_m: of the elements' distal faces, shape (m, n, 3) [m].
        turn: by which they have turned in the base frame, shape (m, n, 3, 3).
        joint_angles: of the hinges in the order of `Outputs.joints`, shape (m, j) [rad].
        tension: of each pair, shape (m, t) [N].
        left: what is unbalanced, shape (m,) [N m]; NaN where no balance was found.
    """

    moved_m: Array
    turn: Array
    joint_angles: Array
    tension: Array
    left: Array


def loaded_rows(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array) -> np.ndarray:
    """Return the indices of the rows at which a load acts: on the tip, or all where the robot has weight."""
    acts = inputs.force_tip.any(axis=1) | inputs.moment_tip.any(axis=1)
    if np.any(np.asarray(gravity_mps2)) and any(segment.mass_kg > 0.0 for segment in robot.segments):
        acts = np.ones(len(inputs), dtype=bool)
    found: np.ndarray = np.flatnonzero(acts)
    return found


def require_no_law(robot: CatheterRobot, inputs: Inputs, rows: np.ndarray, model: str) -> None:
    """Raise `InputError` where a load acts at some `rows` beside a law that was measured."""
    more = beside_friction(robot)
    if len(rows) and more:
        raise InputError(
            f"{row_name(inputs, int(rows[0]))}: static model {model!r} carries tip loads and weight beside "
            f"springs that may rub, not beside {more}; leave one of them out, or simulate"
        )


@dataclass(frozen=True)
class Unloaded:
    """A catheter along some rows without its load.

    Attributes:
        robot: whose joints and tendons are springs, which may rub.
        inputs: all rows; these make the drives' history.
        rows: indices of the m rows to be balanced.
        values: of each pair's joint at these rows, shape (m, t) [rad or m].
        tension_N: of each pair at its drive, the same; needed where tendons rub.
        sunk_m: how far the mount gives way there, shape (m,) [m].
    """

    robot: CatheterRobot
    inputs: Inputs
    rows: np.ndarray
    values: Array
    tension_N: Array
    sunk_m: Array


def yielded(one: Unloaded, gravity_mps2: Array) -> Yielded:
    """Return what the load does to a robot; `gravity_mps2` has shape (3,) [m/s^2]."""
    return yielded_together([one], gravity_mps2)[0]


def yielded_together(many: Sequence[Unloaded], gravity_mps2: Array) -> list[Yielded]:
    """Return what their loads do to several robots, in order; those of one `Held.frame` go together."""
    rubbed = [_rubbed(item.robot, item.values, item.tension_N) for item in many]
    held = [
        held_by(item.robot, item.inputs, item.rows, item.values, own)
        for item, own in zip(many, rubbed, strict=True)
    ]
    groups: dict[tuple[object, ...], list[int]] = {}
    for place, item in enumerate(held):
        groups.setdefault(item.frame, []).append(place)
    found: dict[int, Yielded] = {}
    for group in groups.values():
        own = [many[place] for place in group]
        whole = _yielded(
            together([held[place] for place in group]),
            np.concatenate([item.inputs.force_tip[item.rows] for item in own]),
            np.concatenate([item.inputs.moment_tip[item.rows] for item in own]),
            np.concatenate([item.values for item in own]),
            np.concatenate([item.sunk_m for item in own]),
            np.concatenate([rubbed[place] for place in group]),
            np.asarray(gravity_mps2, dtype=float),
        )
        ends = np.cumsum([0, *(len(many[place].rows) for place in group)])
        for place, start, end in zip(group, ends, ends[1:], strict=False):
            found[place] = Yielded(*(getattr(whole, name)[start:end] for name in _PARTS))
    return [found[place] for place in range(len(many))]


def _yielded(
    held: Held,
    force: Array,
    moment: Array,
    values: Array,
    sunk_m: Array,
    rubbed: Array,
    gravity_mps2: Array,
) -> Yielded:
    load = Load(force, moment, gravity_mps2)
    none = load.part(np.arange(len(force)), 0.0)
    before, _ = _balance(held, at_values(held, values, sunk_m), none)
    after, left = _balance(held, before, load)
    was, now = (stand(held.hinges, state.angle, state.advance) for state in (before, after))
    moved = now.face - was.face
    moved[..., 2] -= (after.sunk - before.sunk)[:, np.newaxis]
    tension = _tension(held, after, now, load) - _tension(held, before, was, none)
    jointed = ~np.isin(held.hinges.segment, held.hinges.tubes)
    return Yielded(
        moved_m=moved,
        turn=now.turned @ was.turned.swapaxes(-1, -2),
        joint_angles=(after.angle - before.angle)[:, jointed],
        tension=rubbed * tension,
        left=left,
    )


def _rubbed(robot: CatheterRobot, values: Array, tension_N: Array) -> Array:
    """Return each pair's tension at its drive over that at its joint, without the load, shape (m, t)."""
    ratio = np.ones(values.shape)
    if robot.friction.mu == 0.0:
        return ratio
    for pair, item in enumerate(robot.tendons):
        if item.name in bent_by(robot):
            segment, angle = robot.segments[moved_segment(robot, pair)], values[:, pair]
            own = joint_stiffness(robot, segment) * np.abs(angle - segment.rest_rad) / arm_m(segment, angle)
            pulled = own > _LEAST_TENSION_N
            ratio[pulled, pair] = tension_N[pulled, pair] / own[pulled]
    return ratio


def under_load(run: StaticRun, rows: np.ndarray, found: Yielded) -> StaticRun:
    """Return a run without load, with what a load does at some of its rows.

    Raises:
        InputError: no balance was found for one of them.
    """
    if np.isnan(found.left).any():
        where = row_name(run.inputs, int(rows[np.isnan(found.left)][0]))
        raise InputError(f"{where}: static model {run.model!r}: finds no balance under the load")
    postures, residual = list(run.postures), run.residual.copy()
    for place, row in enumerate(rows):
        old = postures[row]
        postures[row] = replace(
            old,
            p_w=old.p_w + found.moved_m[place],
            R_w=found.turn[place] @ old.R_w,
            joint_angles=old.joint_angles + found.joint_angles[place],
            actuator_tension=old.actuator_tension + found.tension[place],
        )
        residual[row] = max(residual[row], found.left[place])
    return replace(run, postures=tuple(postures), residual=residual)


def _balance(held: Held, start: State, load: Load) -> tuple[State, Array]:
    """Return the balance under the load, and what is left unbalanced, shape (m,) [N m]; NaN: none found."""
    state, left = _newton(held, guessed(held, start, load), load)
    (failed,) = np.nonzero(np.isnan(left))
    if not len(failed):
        return state, left
    own, at = held.part(failed), start.part(failed)
    for share in _SHARES:
        at, rest = _newton(own, at, load.part(failed, share))
    for name in ("angle", "advance", "tension", "taut", "sunk"):
        getattr(state, name)[failed] = getattr(at, name)
    left[failed] = rest
    return state, left


def guessed(held: Held, state: State, load: Load) -> State:
    """Return `state` with the tensions that would hold the joints as they are."""
    if not held.pulls:
        return state
    torque = moments(held.hinges, stand(held.hinges, state.angle, state.advance), load)[0]
    needed = held.stiffness * (state.angle - held.rest) - torque
    net = np.stack([needed[:, pull.gaps].mean(axis=1) / pull.arm_m for pull in held.pulls], axis=1)
    tension = np.maximum(net[..., np.newaxis] * TOWARD, 0.0).reshape(len(net), -1)
    return replace(state, tension=tension, taut=tension > 0.0)


def _newton(held: Held, state: State, load: Load) -> tuple[State, Array]:
    """Return the balance that Newton's steps come to, and what is left, shape (m,) [N m]; NaN: not there."""
    hinges, tubes = len(held.hinges.kind), len(held.hinges.tubes)
    free = np.flatnonzero(held.free)
    for _ in range(_MOST_STEPS):
        state = sided(held, state)
        residual, slopes = unbalanced(held, state, load)
        left = np.abs(residual[:, :hinges] * held.free[:hinges]).max(axis=1, initial=0.0)
        missed = np.abs(residual[:, hinges:] * held.free[hinges:]).max(axis=1, initial=0.0)
        met = (left < _BALANCED_N_M) & (missed < _MET_M)
        if met.all():
            break
        step = np.zeros_like(residual)
        inner = slopes[:, free[:, np.newaxis], free]
        try:
            step[:, free] = -np.linalg.solve(inner, residual[:, free, np.newaxis])[..., 0]
        except np.linalg.LinAlgError:  # at some row several steps would do: the shortest
            shortest = np.linalg.pinv(np.nan_to_num(inner))
            step[:, free] = -(shortest @ np.nan_to_num(residual[:, free, np.newaxis]))[..., 0]
        most = np.abs(step[:, :hinges]).max(axis=1, initial=0.0)
        step *= np.minimum(1.0, _LARGEST_STEP_RAD / np.maximum(most, 1e-300))[:, np.newaxis]
        state = State(
            state.angle + step[:, :hinges],
            state.advance + step[:, hinges : hinges + tubes],
            state.tension + step[:, hinges + tubes : -1],
            state.taut,
            state.sunk + step[:, -1],
        )
    return state, np.where(met, left, np.nan)


def _tension(held: Held, state: State, standing: Standing, load: Load) -> Array:
    """Return the tension of each pair, shape (m, t) [N]: of a torsion joint what the load's moment takes."""
    tension = np.zeros_like(held.drawn_m)
    for k, pull in enumerate(held.pulls):
        tension[:, pull.pair] = state.tension[:, 2 * k : 2 * k + 2].max(axis=1)
    torque = moments(held.hinges, standing, load)[0]
    for hinge, pair, segment, _ in held.turns:
        tension[:, pair] = np.abs(torque[:, hinge]) / arm_m(segment, state.angle[:, hinge])
    return tension
