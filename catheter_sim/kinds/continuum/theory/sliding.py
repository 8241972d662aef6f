"""Dry friction by the motion of each tendon over each eyelet: the reference for load and history.

Coulomb's law asks how a tendon moves, not what its tension was. The tendons are inextensible and
fixed at their ends, so the sliding at an eyelet is the change of the tendon's length beyond it. A
tendon that is drawn in comes out of the eyelet with T exp(-mu phi), one that runs out with
T exp(+mu phi), and one that is stuck with anything between. So a tip force, a weight, or another
section's tendons can make a tendon slip although its own tension is held.

Sticking is approached by a very stiff elastic slip (`PRE_SLIDING_RAD`), which makes each step one
smooth-by-pieces system in the bend angles, solved by Newton's method with exact derivatives. With
tendons that both stick, their common tension is not determined by statics; this slip shares it out
alike, where `slip.tensions_behind` keeps the old values: up to 0.06 mm of tip on a partial loop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.static_run import NoEquilibrium, StaticRun
from catheter_sim.errors import InputError
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.kinds.continuum.theory.balance import (
    cell_slopes,
    largest_angles,
    lengths,
    load_slopes,
    moment_arms,
    unbalanced,
)
from catheter_sim.kinds.continuum.theory.planar import hinge_chain
from catheter_sim.kinds.continuum.theory.planar_chain import (
    PlanarChain,
    PlanarDrive,
    at_rest,
    drives,
    planar_chain,
    posture,
    require_tension_inputs,
    rest_angles,
    static_run,
)
from catheter_sim.kinds.continuum.theory.planar_kernels.columns import (
    MOST_CREEP_STEPS,
    MOST_DRAG,
    NO_DRAG,
    PRE_SLIDING_RAD,
)

MODEL = "fkm_sliding"
_TOLERANCE_RAD = 2e-11  # rounding of lengths against the stiff slip leaves up to 3e-12
_MOST_ROUNDS = 40
_SHARES = tuple(0.5**i for i in range(15))  # of a Newton step
_MOST_HALVINGS = 8


@dataclass(frozen=True)
class _State:
    """Where the robot is, and how each tendon hangs on each eyelet.

    Attributes:
        angles: bend angles, shape (n,) [rad].
        slip: 1 where the tendon was drawn in over the eyelet before cell k, -1 where it ran out,
            between while it sticks, shape (t, n).
        drive: what acts.
    """

    angles: Array
    slip: Array
    drive: PlanarDrive


def fkm_sliding(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of a planar robot with exact moment arms and Coulomb friction at each eyelet.

    The balance of each cell is that of `exact_arm.fkm_exact_arm`; the two differ in what an eyelet
    remembers.

    Args:
        robot: every segment bends in the xz plane, one hinge a cell.
        inputs: tensions, and optionally tip force and moment; only what acts in the plane bends.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: the model does not know this robot or these inputs, or no posture balances a row.
    """
    chain = planar_chain(robot, MODEL)
    require_tension_inputs(inputs, MODEL)
    return solve_sliding(chain, inputs, gravity_mps2, MODEL)


def solve_sliding(chain: PlanarChain, inputs: Inputs, gravity_mps2: Array, model: str) -> StaticRun:
    """Return the postures of `chain`, as `fkm_sliding`, under the name `model`."""
    gravity = np.asarray(gravity_mps2, dtype=float)
    postures, residual = [], []
    rest = at_rest(chain, gravity)
    untouched = np.zeros(chain.offset.shape)
    row = 0  # a failure at rest is the first row's
    try:
        # The robot sags without tension, so without friction; its eyelets remember nothing of it.
        state = _settle(chain, _State(rest_angles(chain), untouched, rest), rest, _MOST_HALVINGS)
        state = _State(state.angles, untouched, rest)
        for row, steps in enumerate(drives(chain, inputs, gravity)):  # noqa: B007
            for drive in steps:
                state = _settle(chain, state, drive, _MOST_HALVINGS)
            tension = _tensions(chain, state.angles, state.slip, state.drive)
            p_w, R_w = hinge_chain(state.angles, chain.cell_length)
            postures.append(posture(chain, state.angles, p_w, R_w, tension, state.drive))
            residual.append(float(np.abs(unbalanced(chain, state.angles, tension, state.drive)).max()))
    except NoEquilibrium as error:
        raise InputError(f"{row_name(inputs, row)}: static model {model!r}: {error}") from None
    return static_run(model, inputs, gravity, postures, residual)


def _turns(angles: Array) -> Array:
    """Return the signed turn at the eyelet before each cell, shape (n,) [rad]."""
    turn = 0.5 * angles
    turn[1:] += 0.5 * angles[:-1]
    return turn


def _beyond(values: Array) -> Array:
    """Return for each cell the sum from it to the tip, along the last axis."""
    return np.cumsum(values[..., ::-1], axis=-1)[..., ::-1]


def _tensions(chain: PlanarChain, angles: Array, slip: Array, drive: PlanarDrive) -> Array:
    """Return each tendon's tension in each cell, zero beyond its end, shape (t, n) [N]."""
    lost = chain.mu * np.cumsum(slip * np.abs(_turns(angles)), axis=1)
    return np.where(chain.reaches, drive.tension[:, None] * np.exp(-lost), 0.0)


def _settle(chain: PlanarChain, state: _State, drive: PlanarDrive, halvings: int) -> _State:
    """Return the equilibrium under `drive`, reached from `state`; a step that fails is halved."""
    found = _newton(chain, state, drive)
    if found is not None:
        return found
    if halvings == 0:
        return _creep(chain, state, drive)
    middle = PlanarDrive(
        0.5 * (state.drive.tension + drive.tension),
        0.5 * (state.drive.face_force + drive.face_force),
        0.5 * (state.drive.tip_moment + drive.tip_moment),
    )
    return _settle(chain, _settle(chain, state, middle, halvings - 1), drive, halvings - 1)


def _creep(chain: PlanarChain, state: _State, drive: PlanarDrive) -> _State:
    """Return the equilibrium that the robot reaches slowly where there is none close by.

    A robot that buckles or snaps through leaves its branch. Every cell gets a viscous drag, and time
    steps of growing length follow the robot until the drag no longer matters.
    """
    stiffness = float((chain.stiffness / chain.cell_length).min())
    drag = stiffness
    for _ in range(MOST_CREEP_STEPS):
        found = _newton(chain, state, drive, drag)
        if found is None:
            drag *= 4.0
            if drag > MOST_DRAG * stiffness:
                break
            continue
        state = found
        drag *= 0.6
        if drag < NO_DRAG * stiffness:
            found = _newton(chain, state, drive)
            if found is not None:
                return found
            drag = stiffness
    raise NoEquilibrium("no posture balances the tensions, the weight and the tip load")


def _newton(chain: PlanarChain, state: _State, drive: PlanarDrive, drag: float = 0.0) -> _State | None:
    """Return the equilibrium under `drive`, or None where Newton's method finds none.

    With `drag` [N m/rad] every cell is also held back in proportion to its motion from `state`.
    """
    limit = largest_angles(chain)
    tolerance = _TOLERANCE_RAD * float((chain.stiffness / chain.cell_length).min())
    length_before = _beyond(lengths(chain, state.angles))

    def at(angles: Array) -> tuple[Array, Array, Array]:
        drawn_in = length_before - _beyond(lengths(chain, angles))
        slip = np.clip(state.slip + drawn_in / pre_sliding, -1.0, 1.0)
        tension = _tensions(chain, angles, slip, drive)
        lack = unbalanced(chain, angles, tension, drive) - drag * (angles - state.angles)
        return slip, tension, lack

    pre_sliding = PRE_SLIDING_RAD * max(float(np.abs(chain.offset).max(initial=0.0)), 1e-9)
    angles = state.angles
    slip, tension, lack = at(angles)
    for _ in range(_MOST_ROUNDS):
        if np.abs(lack).max() < tolerance:
            return _State(angles, slip, drive)
        slope = _slope(chain, angles, slip, tension, drive, pre_sliding)
        slope[np.diag_indices_from(slope)] += drag
        try:
            step = np.linalg.solve(slope, lack)
        except np.linalg.LinAlgError:
            return None
        # Where an eyelet starts or stops sticking the slope jumps. Then no share of the step may be
        # better than where we are, and the best one is still the way across.
        size, best = float(np.linalg.norm(lack)), math.inf
        for share in _SHARES:
            trial = angles + share * step
            if not np.all(np.abs(trial) < limit):
                continue
            there = at(trial)
            trial_size = float(np.linalg.norm(there[2]))
            if trial_size < best:
                best, following, (slip, tension, lack) = trial_size, trial, there
            if trial_size < (1.0 - 1e-4 * share) * size:
                break
        if not math.isfinite(best):
            return None
        angles = following
    return None


def _slope(
    chain: PlanarChain, angles: Array, slip: Array, tension: Array, drive: PlanarDrive, pre_sliding: float
) -> Array:
    """Return minus the derivative of the unbalanced moments by the bend angles, shape (n, n)."""
    slope = np.diag(cell_slopes(chain, angles, tension)) - load_slopes(chain, angles, drive)
    turn = _turns(angles)
    side = 0.5 * np.sign(turn)
    turn_slope = np.diag(side) + np.diag(side[1:], -1)
    arms = moment_arms(chain, angles)
    for j in range(len(tension)):
        sticks = np.abs(slip[j]) < 1.0
        # A cell beyond an eyelet draws the tendon in by its moment arm for each radian.
        slip_slope = np.triu(np.outer(sticks, arms[j] / pre_sliding))
        lost_slope = np.cumsum(slip[j][:, None] * turn_slope + np.abs(turn)[:, None] * slip_slope, axis=0)
        slope += (chain.mu * arms[j] * tension[j])[:, None] * lost_slope
    return slope
