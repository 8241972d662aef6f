"""What holds a catheter's hinges under a load: gaps and their tendons, tubes, drives, the mount."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import has_mount_slide
from catheter_sim.kinds.catheter.layout import (
    bent_by,
    closing_angle_rad,
    joint_stiffness,
    moved_segment,
    tube_stiffness_N_m2,
)
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.kinds.catheter.theory.drive import played_m
from catheter_sim.kinds.catheter.theory.hinge_kernel import AROUND_Z, TOWARD_X
from catheter_sim.kinds.catheter.theory.hinges import (
    TUBE_HINGES,
    Hinges,
    Load,
    hinges_of,
    moments,
    stand,
)
from catheter_sim.kinds.catheter.theory.tendons import arm_m, drawn_at_rest_m, pulled_m

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
        firmness: by which a tendon's lack of length is weighed against a tension, shape (m,) [N/m].
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
        """Return how much shorter than straight a side's tendon is at all hinges' angles (m, h).

        Args:
            angle: of all hinges, shape (m, h) [rad].
            side: index in `TOWARD`.

        Returns:
            Way, shape (m,) [m], its slopes in the gaps' angles, shape (m, g) [m/rad], and theirs.
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
        robot, inputs, rows: whose, along what, and at which of its rows.
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
