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

Friction. A joint's tension and that at its drive stay in the ratio that they have without the load at that
row, as if its tendon were as much softer or stiffer: right where the joint slips the same way with the load.
A constant force on `mitral_transseptal@tube` moves the tip so to 1 % (rms) of what the simulation says, at
coefficients of 0.05 and 0.2; on `mitral_4dof` with taut tendons of 3 and 5 N/mm to 1 to 5 % at 0.1, and to
4 to 9 % at 0.3. A load that comes and goes is held by friction besides: that is not known here.

Laws of tendons and joints that were measured keep a history of which a load would be part: beside these it is
refused.

The law of a tube takes no notice of its torsion. What a drive of a tube feels of the tube's bending, and of
the weight, is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.static_run import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.kinds.catheter.layout import bent_by, beside_friction, joint_stiffness, moved_segment
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.kinds.catheter.theory.held import (
    TOWARD,
    Held,
    State,
    at_values,
    held_by,
    sided,
    together,
    unbalanced,
)
from catheter_sim.kinds.catheter.theory.hinges import Load, Standing, moments, stand
from catheter_sim.kinds.catheter.theory.tendons import arm_m

_PARTS = ("moved_m", "turn", "joint_angles", "tension", "left")  # of `Yielded`
_MOST_STEPS = 40
_LARGEST_STEP_RAD = 0.15  # of any hinge; gaps close at 0.4 or so
_BALANCED_N_M = 1e-13
_MET_M = 1e-14
_LEAST_TENSION_N = 1e-6  # from which on it is told how much of it friction takes
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
    before, _ = _found(held, at_values(held, values, sunk_m), none)
    after, left = _found(held, before, load)
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


def _found(held: Held, start: State, load: Load) -> tuple[State, Array]:
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
