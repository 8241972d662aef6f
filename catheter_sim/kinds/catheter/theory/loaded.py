"""What a load does to a catheter in balance: each gap, the exposed tube and soft drives by themselves.

A force and a moment at the tip turn every hinge of `hinges` with a . (r x F + M), r from the hinge to the
tip, and so does the weight of what is beyond it. They are balanced by

- a gap: K (n + 1) (phi - rest), and its two tendons, which pull and never push: tension times what the
  gap shortens the tendon by for its angle. A joint's n + 1 gaps share one tension, which holds their sum
  alone: where they are far from the tip they yield one way, and near it the other way. A force F across
  the end of a straight joint of length L moves a tip beyond it by F L^2 / (12 K) by that alone, however
  stiff the tendons are;
- an exposed tube: EI against bending off its own curvature, at its present length;
- a drive of finite stiffness. Rigid ones hold; inextensible tendons do so exactly.

Against what pulls the joint on, a joint yields until its antagonist is taut: that is slack by `slack_m`, and
by Nayar 2022, Eq. 4 where the joint is bent. Two gaps' rims that touch hold each other.

All rows are balanced at once by Newton's method. Which tendon is taut is found on the way: one whose
tension would be below zero is let go, one that would be stretched is taken up.

Friction and laws that were measured keep a history that a load would be part of; beside these it is refused.
The law of a tube takes no notice of its torsion. What a drive of a tube feels of the tube's bending, and of
the weight, is left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.posture import Array
from catheter_sim.core.robot import has_mount_slide
from catheter_sim.core.static_run import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.kinds.catheter.layout import (
    bent_by,
    beside_springs,
    closing_angle_rad,
    joint_stiffness,
    moved_segment,
    tube_stiffness_N_m2,
)
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.kinds.catheter.theory.drive import played_m
from catheter_sim.kinds.catheter.theory.hinges import (
    AROUND_Z,
    TOWARD_X,
    TUBE_HINGES,
    Hinges,
    Standing,
    hinges_of,
    stand,
)
from catheter_sim.kinds.catheter.theory.tendons import arm_m, drawn_at_rest_m, pulled_m

_MOST_STEPS = 40
_LARGEST_STEP_RAD = 0.15  # of any hinge; gaps close at 0.4 or so
_BALANCED_N_M = 1e-11
_MET_M = 1e-13
_SHARES = np.linspace(0.1, 1.0, 10)  # of the load, one after another, where all at once finds no balance
_RIM_RATIO = 1e4  # of rims that touch, over their gap's stiffness
_SHORTEST_M = 1e-5  # of a tube, for its stiffness


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


def require_springs_alone(robot: CatheterRobot, inputs: Inputs, rows: np.ndarray, model: str) -> None:
    """Raise `InputError` where a load acts at some `rows` beside what keeps a history."""
    more = beside_springs(robot)
    if len(rows) and more:
        raise InputError(
            f"{row_name(inputs, int(rows[0]))}: static model {model!r} carries tip loads and weight beside "
            f"springs alone, not beside {more}; leave one of them out, or simulate"
        )


def yielded(
    robot: CatheterRobot,
    inputs: Inputs,
    gravity_mps2: Array,
    rows: np.ndarray,
    values: Array,
    sunk_m: Array,
) -> Yielded:
    """Return what the load does at some rows.

    Args:
        robot: whose joints and tendons do no more than springs.
        inputs: all rows; these make the drives' history.
        gravity_mps2: shape (3,) [m/s^2].
        rows: indices of the m rows to be balanced.
        values: of each pair's joint without the load, at these rows, shape (m, t) [rad or m].
        sunk_m: how far the mount gives way there, shape (m,) [m].
    """
    balance = _balance(robot, inputs, rows, values)
    load = Load(inputs.force_tip[rows], inputs.moment_tip[rows], np.asarray(gravity_mps2, dtype=float))
    none = load.part(np.arange(len(rows)), 0.0)
    before, _ = _found(balance, _unloaded(balance, values, sunk_m), none)
    after, left = _found(balance, before, load)
    was, now = (stand(balance.hinges, state.angle, state.advance) for state in (before, after))
    moved = now.face - was.face
    moved[..., 2] -= (after.sunk - before.sunk)[:, np.newaxis]
    jointed = [robot.segments[index].joint != "prismatic" for index in balance.hinges.segment]
    return Yielded(
        moved_m=moved,
        turn=now.turned @ was.turned.swapaxes(-1, -2),
        joint_angles=(after.angle - before.angle)[:, np.array(jointed, bool)],
        tension=_tension(balance, after, now, load) - _tension(balance, before, was, none),
        left=left,
    )


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


@dataclass(frozen=True)
class _Pull:
    """A bending joint's two tendons along m rows.

    Attributes:
        pair: index of it.
        gaps: its hinges.
        half_gap_m, arm_m: of the segment.
        compliance: of each tendon [m/N].
        firmness: by which a tendon's lack of length is weighed against a tension [N/m].
        drawn_m: by how much the tendon toward + and the one toward - may be no longer than straight,
            shape (m, 2) [m].
    """

    pair: int
    gaps: slice
    half_gap_m: float
    arm_m: float
    compliance: float
    firmness: float
    drawn_m: Array

    def shortened(self, angle: Array, side: Array) -> tuple[Array, Array, Array]:
        """Return how much shorter than straight a side's tendon is at all hinges' angles (m, h).

        Args:
            angle: of all hinges, shape (m, h) [rad].
            side: 1 or -1, shape (m,).

        Returns:
            Way, shape (m,) [m], its slopes in the gaps' angles, shape (m, g) [m/rad], and theirs.
        """
        half, toward = 0.5 * angle[:, self.gaps], side[:, np.newaxis] * self.arm_m
        sine, cosine = np.sin(half), np.cos(half)
        way = 2.0 * (2.0 * self.half_gap_m * np.sin(0.5 * half) ** 2 + toward * sine).sum(axis=1)
        slope = self.half_gap_m * sine + toward * cosine
        return way, slope, 0.5 * (self.half_gap_m * cosine - toward * sine)


@dataclass(frozen=True)
class _Balance:
    """What holds a robot along m rows.

    Attributes:
        hinges: of the robot, h of them and p tubes.
        free: which of h hinges, p tubes, tensions and the mount yield, shape (h + p + k + 1,).
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
    pulls: tuple[_Pull, ...]
    turns: tuple[tuple[int, int, CatheterSegment, float], ...]
    pushes: tuple[tuple[int, float], ...]
    drawn_m: Array
    mount: float

    def part(self, rows: np.ndarray) -> _Balance:
        """Return it at some of the rows."""
        pulls = tuple(replace(pull, drawn_m=pull.drawn_m[rows]) for pull in self.pulls)
        numbers = {name: getattr(self, name)[rows] for name in ("stiffness", "rest", "drawn_m")}
        return replace(self, pulls=pulls, **numbers)


@dataclass(frozen=True)
class _State:
    """Hinges' angles (m, h) [rad], advances (m, p) [m], tensions (m, k) [N] with the sides that have them,
    1, -1 or 0 for neither, and how far the mount gives way (m,) [m]."""

    angle: Array
    advance: Array
    tension: Array
    side: Array
    sunk: Array

    def part(self, rows: np.ndarray) -> _State:
        """Return it at some of the rows."""
        return _State(
            self.angle[rows], self.advance[rows], self.tension[rows], self.side[rows], self.sunk[rows]
        )


def _balance(robot: CatheterRobot, inputs: Inputs, rows: np.ndarray, values: Array) -> _Balance:
    """Return what holds `robot` at some rows of inputs; `values` (m, t) are its joints' without load."""
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
                pulls.append(_pull(robot, inputs, rows, pair, hinge))
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
    return _Balance(
        hinges,
        np.array([*free, *soft, *(True for _ in pulls), on_slide], bool),
        stiffness,
        rest,
        rim,
        tuple(pulls),
        tuple(turns),
        pushes,
        drawn,
        1.0 / robot.mount.axial_stiffness_N_per_m if on_slide else 0.0,
    )


def _pull(robot: CatheterRobot, inputs: Inputs, rows: np.ndarray, pair: int, first: int) -> _Pull:
    item, segment = robot.tendons[pair], bent_by(robot)[robot.tendons[pair].name]
    played = played_m(item, inputs.tendon[:, pair])[rows]
    home = [drawn_at_rest_m(segment, sign) - item.slack_m for sign in ("pos", "neg")]
    return _Pull(
        pair,
        slice(first, first + segment.rings + 1),
        segment.half_gap_m,
        segment.arm_m,
        1.0 / item.stiffness_N_per_m,
        joint_stiffness(robot, segment) / segment.arm_m**2,
        np.stack([played + home[0], -played + home[1]], axis=1),
    )


def _unloaded(balance: _Balance, values: Array, sunk_m: Array) -> _State:
    """Return where the joints' values, shape (m, t), put the hinges; no tendon is taut yet."""
    angle, count = balance.rest.copy(), len(balance.pulls)
    for pull in balance.pulls:
        angle[:, pull.gaps] = values[:, [pull.pair]] / (pull.gaps.stop - pull.gaps.start)
    for hinge, pair, _, _ in balance.turns:
        angle[:, hinge] = values[:, pair]
    advance = values[:, [pair for pair, _ in balance.pushes]]
    none = np.zeros((len(values), count))
    return _State(angle, advance, none, none, sunk_m.copy())


def _found(balance: _Balance, start: _State, load: Load) -> tuple[_State, Array]:
    """Return the balance under the load, and what is left unbalanced, shape (m,) [N m]; NaN: none found."""
    state, left = _newton(balance, _guessed(balance, start, load), load)
    (failed,) = np.nonzero(np.isnan(left))
    if not len(failed):
        return state, left
    own, at = balance.part(failed), start.part(failed)
    for share in _SHARES:
        at, rest = _newton(own, at, load.part(failed, share))
    for name in ("angle", "advance", "tension", "side", "sunk"):
        getattr(state, name)[failed] = getattr(at, name)
    left[failed] = rest
    return state, left


def _guessed(balance: _Balance, state: _State, load: Load) -> _State:
    """Return `state` with the tensions that would hold the joints as they are."""
    if not balance.pulls:
        return state
    torque = _torque(balance, stand(balance.hinges, state.angle, state.advance), load)[0]
    needed = balance.stiffness * (state.angle - balance.rest) - torque
    net = np.stack([needed[:, pull.gaps].mean(axis=1) / pull.arm_m for pull in balance.pulls], axis=1)
    return replace(state, tension=np.abs(net), side=np.sign(net))


def _newton(balance: _Balance, state: _State, load: Load) -> tuple[_State, Array]:
    """Return the balance that Newton's steps come to, and what is left, shape (m,) [N m]; NaN: not there."""
    hinges, tubes = len(balance.hinges.kind), len(balance.hinges.tubes)
    free = np.flatnonzero(balance.free)
    for _ in range(_MOST_STEPS):
        state = _sided(balance, state)
        residual, slopes = _residual(balance, state, load)
        left = np.abs(residual[:, :hinges] * balance.free[:hinges]).max(axis=1, initial=0.0)
        missed = np.abs(residual[:, hinges:] * balance.free[hinges:]).max(axis=1, initial=0.0)
        met = (left < _BALANCED_N_M) & (missed < _MET_M)
        if met.all():
            break
        step = np.zeros_like(residual)
        inner = slopes[:, free[:, np.newaxis], free]
        step[:, free] = -np.linalg.solve(inner, residual[:, free, np.newaxis])[..., 0]
        most = np.abs(step[:, :hinges]).max(axis=1, initial=0.0)
        step *= np.minimum(1.0, _LARGEST_STEP_RAD / np.maximum(most, 1e-300))[:, np.newaxis]
        state = _State(
            state.angle + step[:, :hinges],
            state.advance + step[:, hinges : hinges + tubes],
            state.tension + step[:, hinges + tubes : -1],
            state.side,
            state.sunk + step[:, -1],
        )
    return state, np.where(met, left, np.nan)


def _sided(balance: _Balance, state: _State) -> _State:
    """Return `state` with those tendons taut that would be stretched, and those slack that would push."""
    tension, side = state.tension.copy(), state.side.copy()
    for k, pull in enumerate(balance.pulls):
        scores, kept = [], []
        for place, sign in enumerate((1.0, -1.0)):
            own = np.where(side[:, k] == sign, tension[:, k], 0.0)
            way = pull.shortened(state.angle, np.full(len(own), sign))[0]
            lacks = pull.drawn_m[:, place] - state.sunk - way - pull.compliance * own
            kept.append(own)
            scores.append(own + pull.firmness * lacks)
        plus, minus = scores
        now = np.where((plus > 0.0) & (plus >= minus), 1.0, np.where(minus > 0.0, -1.0, 0.0))
        side[:, k] = now
        tension[:, k] = np.where(now > 0.0, kept[0], np.where(now < 0.0, kept[1], 0.0))
    return replace(state, tension=tension, side=side)


def _residual(balance: _Balance, state: _State, load: Load) -> tuple[Array, Array]:
    """Return what is unbalanced, and its slopes, of hinges, tubes, tensions and the mount.

    Returns:
        Moments [N m], forces [N] and ways [m], shape (m, u), and slopes, shape (m, u, u).
    """
    hinges, tubes = len(balance.hinges.kind), len(balance.hinges.tubes)
    standing = stand(balance.hinges, state.angle, state.advance)
    residual = np.zeros((len(state.angle), len(balance.free)))
    slopes = np.zeros((*residual.shape, residual.shape[1]))
    torque, turning = _torque(balance, standing, load)
    over = np.sign(state.angle) * np.maximum(np.abs(state.angle) - balance.rim, 0.0)
    rims = _RIM_RATIO * balance.stiffness
    residual[:, :hinges] = balance.stiffness * (state.angle - balance.rest) + rims * over - torque
    slopes[:, :hinges, :hinges] = -turning
    diagonal = np.einsum("mii->mi", slopes)
    diagonal[:, :hinges] += balance.stiffness + rims * (over != 0.0)
    for hinge, pair, segment, drive in balance.turns:
        if math.isfinite(drive):
            arm = arm_m(segment, state.angle[:, hinge])
            lacks = pulled_m(segment, state.angle[:, hinge]) - balance.drawn_m[:, pair]
            residual[:, hinge] += drive * lacks * arm
            diagonal[:, hinge] += drive * arm**2
    for tube, (pair, drive) in enumerate(balance.pushes):
        if math.isfinite(drive):
            outward = np.einsum("l,mli,mi->m", balance.hinges.link_share[:, tube], standing.along, load.force)
            residual[:, hinges + tube] = drive * (state.advance[:, tube] - balance.drawn_m[:, pair]) - outward
            diagonal[:, hinges + tube] = drive
    for k, pull in enumerate(balance.pulls):
        _add_pull(pull, state, k, hinges + tubes, residual, slopes)
    pressing = state.tension.sum(axis=1) - load.force[:, 2] - balance.hinges.mass_kg.sum() * load.gravity[2]
    residual[:, -1] = state.sunk - balance.mount * pressing
    slopes[:, -1, hinges + tubes : -1] = -balance.mount
    slopes[:, -1, -1] = 1.0
    return residual, slopes


def _add_pull(pull: _Pull, state: _State, k: int, first: int, residual: Array, slopes: Array) -> None:
    """Add a joint's taut tendon to residual (m, u) and slopes (m, u, u); tensions begin at `first`."""
    side, tension = state.side[:, k], state.tension[:, k]
    taut, own = side != 0.0, first + k
    way, slope, curve = pull.shortened(state.angle, side)
    slope, curve = slope * taut[:, np.newaxis], curve * taut[:, np.newaxis]
    drawn = np.where(side > 0.0, pull.drawn_m[:, 0], pull.drawn_m[:, 1]) - state.sunk
    residual[:, pull.gaps] -= tension[:, np.newaxis] * slope
    residual[:, own] = np.where(taut, way + pull.compliance * tension - drawn, tension)
    np.einsum("mii->mi", slopes)[:, pull.gaps] -= tension[:, np.newaxis] * curve
    slopes[:, pull.gaps, own] = -slope
    slopes[:, own, pull.gaps] = slope
    slopes[:, own, own] = np.where(taut, pull.compliance, 1.0)
    slopes[:, own, -1] = taut


def _torque(balance: _Balance, standing: Standing, load: Load) -> tuple[Array, Array]:
    """Return the load's moment about each hinge, shape (m, h) [N m], and its slopes, shape (m, h, h).

    A hinge turns all that is beyond it: the arm of a farther hinge, and its axis, turn with a nearer one.
    """
    hinges, axis = balance.hinges, standing.axis
    beyond = hinges.after > np.arange(len(hinges.kind))[:, np.newaxis]  # (h, n)
    masses = beyond * hinges.mass_kg
    arm = standing.tip[:, np.newaxis] - standing.place
    heavy = np.einsum("hn,mni->mhi", masses, standing.centre)
    heavy -= masses.sum(axis=1)[:, np.newaxis] * standing.place
    symmetric = np.zeros((*axis.shape[:2], axis.shape[1]))
    torque = np.einsum("mhi,mi->mh", axis, load.moment)
    gravity = np.broadcast_to(load.gravity, load.force.shape)
    for lever, force in ((arm, load.force), (heavy, gravity)):
        moved = np.cross(axis, lever)
        torque += np.einsum("mhi,mi->mh", moved, force)
        symmetric += moved @ np.cross(force[:, np.newaxis], axis).swapaxes(-1, -2)
    turned = axis @ np.cross(load.moment[:, np.newaxis], axis).swapaxes(-1, -2)
    lower = np.tril(symmetric)
    return torque, lower + np.tril(symmetric, -1).swapaxes(-1, -2) + np.tril(turned, -1)


def _tension(balance: _Balance, state: _State, standing: Standing, load: Load) -> Array:
    """Return the tension of each pair, shape (m, t) [N]: of a torsion joint what the load's moment takes."""
    tension = np.zeros_like(balance.drawn_m)
    for k, pull in enumerate(balance.pulls):
        tension[:, pull.pair] = state.tension[:, k]
    torque = _torque(balance, standing, load)[0]
    for hinge, pair, segment, _ in balance.turns:
        tension[:, pair] = np.abs(torque[:, hinge]) / arm_m(segment, state.angle[:, hinge])
    return tension
