"""Statics of a planar robot with the exact moment arm of straight tendons, and friction by how they slide."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.statics import NoEquilibrium, StaticRun
from catheter_sim.errors import InputError
from catheter_sim.mechanics.hysteresis import tensions_behind
from catheter_sim.robots.continuum.planar import (
    PlanarChain,
    PlanarDrive,
    at_rest,
    cell_slopes,
    drives,
    hinge_chain,
    largest_angles,
    lengths,
    load_moments,
    load_slopes,
    moment_arms,
    planar_chain,
    posture,
    require_tension_inputs,
    rest_angles,
    static_run,
    unbalanced,
)
from catheter_sim.robots.continuum.planar_kernels import MOST_CREEP_STEPS, MOST_DRAG, NO_DRAG, PRE_SLIDING_RAD
from catheter_sim.robots.continuum.spec import ContinuumRobot

# ----------------------------------------------------------------------------------------------------
# Dry friction by the motion of each tendon over each eyelet: the reference for load and history.
#
# Coulomb's law asks how a tendon moves, not what its tension was. The tendons are inextensible and fixed at
# their ends, so the sliding at an eyelet is the change of the tendon's length beyond it. A tendon that is
# drawn in comes out of the eyelet with T exp(-mu phi), one that runs out with T exp(+mu phi), and one that
# is stuck with anything between. So a tip force, a weight, or another section's tendons can make a tendon
# slip although its own tension is held.
#
# Sticking is approached by a very stiff elastic slip (`PRE_SLIDING_RAD`), which makes each step one
# smooth-by-pieces system in the bend angles, solved by Newton's method with exact derivatives. With tendons
# that both stick, their common tension is not determined by statics; this slip shares it out alike, where
# `slip.tensions_behind` keeps the old values: up to 0.06 mm of tip on a partial loop.

FKM_SLIDING = "fkm_sliding"
_TOLERANCE_RAD = 2e-11  # rounding of lengths against the stiff slip leaves up to 3e-12
_MOST_ROUNDS = 40
_SHARES = tuple(0.5**i for i in range(15))  # of a Newton step
_MOST_HALVINGS = 8


@dataclass(frozen=True)
class _SlidingState:
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
    chain = planar_chain(robot, FKM_SLIDING)
    require_tension_inputs(inputs, FKM_SLIDING)
    return solve_sliding(chain, inputs, gravity_mps2, FKM_SLIDING)


def solve_sliding(chain: PlanarChain, inputs: Inputs, gravity_mps2: Array, model: str) -> StaticRun:
    """Return the postures of `chain`, as `fkm_sliding`, under the name `model`."""
    gravity = np.asarray(gravity_mps2, dtype=float)
    postures, residual = [], []
    rest = at_rest(chain, gravity)
    untouched = np.zeros(chain.offset.shape)
    row = 0  # a failure at rest is the first row's
    try:
        # The robot sags without tension, so without friction; its eyelets remember nothing of it.
        state = _settle_sliding(
            chain, _SlidingState(rest_angles(chain), untouched, rest), rest, _MOST_HALVINGS
        )
        state = _SlidingState(state.angles, untouched, rest)
        for row, steps in enumerate(drives(chain, inputs, gravity)):  # noqa: B007
            for drive in steps:
                state = _settle_sliding(chain, state, drive, _MOST_HALVINGS)
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


def _settle_sliding(
    chain: PlanarChain, state: _SlidingState, drive: PlanarDrive, halvings: int
) -> _SlidingState:
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
    return _settle_sliding(chain, _settle_sliding(chain, state, middle, halvings - 1), drive, halvings - 1)


def _creep(chain: PlanarChain, state: _SlidingState, drive: PlanarDrive) -> _SlidingState:
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


def _newton(
    chain: PlanarChain, state: _SlidingState, drive: PlanarDrive, drag: float = 0.0
) -> _SlidingState | None:
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
            return _SlidingState(angles, slip, drive)
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


# ----------------------------------------------------------------------------------------------------
# The neuroendoscope's statics with the exact moment arm of a straight tendon between eyelets.
#
# Kato 2016 (doi 10.1007/s11548-015-1310-2) takes the eyelet's offset d as the moment arm (its A3). A tendon
# that runs straight from eyelet to eyelet past a hinge halfway between them, bent by t, has the length h
# cos(t/2) - 2 d sin(t/2) and so the arm d cos(t/2) + (h/2) sin(t/2): 2.4 % more at 3.8 deg in a 2 mm cell.
# The turn of the tendon at an eyelet is half the sum of the two adjoining cells' angles (at the base eyelet
# half of the first cell's), and the friction there is the capstan's.
#
# Quasi-static: the inputs move linearly from row to row, from rest, in steps so small that their number
# does not matter (`planar_chain.STEP_BEND_RAD`). Weight and tip force bend every cell through the moment
# about its hinge of everything beyond it.

FKM_EXACT_ARM = "fkm_exact_arm"

_ANGLE_TOLERANCE_RAD = 1e-12
_CELL_TOLERANCE_RAD = 1e-14
_MOST_SECANTS = 20
_MOST_LOAD_ROUNDS = 100


@dataclass(frozen=True)
class _Cell:
    """One cell in plain floats, for the loop that visits cells one by one."""

    length: float
    stiffness: float
    cubic: float
    quintic: float
    rest_curvature: float
    offset: tuple[float, ...]  # of the tendons that pass it
    tendons: tuple[int, ...]
    largest_angle: float  # there the tendon on the inside has no length left


@dataclass(frozen=True)
class _State:
    """Where the robot is, and what its eyelets remember.

    Attributes:
        angles: bend angles, shape (n,) [rad].
        tension: of each tendon in each cell, shape (t, n) [N], zero beyond its end.
        trend: change of the angles in the last step, where the search for the next one starts.
    """

    angles: Array
    tension: Array
    trend: Array


def fkm_exact_arm(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of a planar robot with exact moment arms and friction with history.

    Where all tendons end together, an eyelet's history is that of the tensions behind it
    (`slip.tensions_behind`). Where they end in different segments, that rule would leave a tendon
    stuck in the proximal segment while the distal one pulls it through. The robot is then solved
    with the motion of each tendon over each eyelet instead (`sliding.fkm_sliding`), which agrees
    with the rule to 0.1 mm where both hold.

    The rule remembers tensions, not motion. Under a steady weight that costs 0.2 mm; where a force
    pushes the tip to and fro while the tendons are held it is wrong by millimetres, and
    `fkm_sliding` is the model to take.

    Args:
        robot: every segment bends in the xz plane, one hinge a cell.
        inputs: tensions, and optionally tip force and moment; only what acts in the plane bends.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: the model does not know this robot or these inputs, or no posture balances a row.
    """
    chain = planar_chain(robot, FKM_EXACT_ARM)
    require_tension_inputs(inputs, FKM_EXACT_ARM)
    if len({tendon.ends_at for tendon in robot.tendons}) > 1:
        return solve_sliding(chain, inputs, gravity_mps2, FKM_EXACT_ARM)
    return _run(chain, inputs, np.asarray(gravity_mps2, dtype=float))


def _run(chain: PlanarChain, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    cells = _cells(chain)
    start = _State(rest_angles(chain), np.zeros(chain.offset.shape), np.zeros(len(cells)))
    postures, residual = [], []
    row = 0  # a failure at rest is the first row's
    try:
        state = _settle(chain, cells, start, at_rest(chain, gravity_mps2))
        for row, steps in enumerate(drives(chain, inputs, gravity_mps2)):  # noqa: B007
            # At a turn of the inputs a search further on could end on a far branch of a softening law.
            state = replace(state, trend=np.zeros(len(cells)))
            for drive in steps:
                state = _settle(chain, cells, state, drive)
            p_w, R_w = hinge_chain(state.angles, chain.cell_length)
            postures.append(posture(chain, state.angles, p_w, R_w, state.tension, steps[-1]))
            residual.append(float(np.abs(unbalanced(chain, state.angles, state.tension, steps[-1])).max()))
    except NoEquilibrium as error:
        raise InputError(f"{row_name(inputs, row)}: static model {FKM_EXACT_ARM!r}: {error}") from None
    return static_run(FKM_EXACT_ARM, inputs, gravity_mps2, postures, residual)


def _cells(chain: PlanarChain) -> list[_Cell]:
    limit = largest_angles(chain)
    result = []
    for k in range(len(chain.cell_length)):
        tendons = tuple(int(j) for j in np.flatnonzero(chain.reaches[:, k]))
        result.append(
            _Cell(
                length=float(chain.cell_length[k]),
                stiffness=float(chain.stiffness[k]),
                cubic=float(chain.cubic[k]),
                quintic=float(chain.quintic[k]),
                rest_curvature=float(chain.rest_curvature[k]),
                offset=tuple(float(chain.offset[j, k]) for j in tendons),
                tendons=tendons,
                largest_angle=float(limit[k]),
            )
        )
    return result


def _settle(chain: PlanarChain, cells: list[_Cell], state: _State, drive: PlanarDrive) -> _State:
    """Return the equilibrium under `drive`, reached from `state`.

    Cell after cell balances its own tensions and the load's moment about its hinge; that moment
    depends on the whole shape, so the pass is repeated in quasi-Newton rounds (exact derivative of
    the load's moments, friction's part of the cells' own stiffness left out).
    """
    if not drive.loaded:
        return _pass(chain, cells, state, state.angles, drive, np.zeros(len(cells)))
    angles = state.angles + state.trend
    limit = largest_angles(chain)
    for _ in range(_MOST_LOAD_ROUNDS):
        found = _pass(chain, cells, state, angles, drive, load_moments(chain, angles, drive))
        change = found.angles - angles
        if np.abs(change).max() < _ANGLE_TOLERANCE_RAD:
            return _State(found.angles, found.tension, found.angles - state.angles)
        cell_slope = cell_slopes(chain, angles, found.tension)
        coupled = np.diag(cell_slope) - load_slopes(chain, angles, drive)
        try:
            angles = angles + np.linalg.solve(coupled, cell_slope * change)
        except np.linalg.LinAlgError:
            break
        if not np.all(np.abs(angles) < limit):
            break
    raise NoEquilibrium(
        "no posture close by balances the weight and the tip load; the robot buckles or snaps, "
        "which 'fkm_sliding' follows"
    )


def _pass(
    chain: PlanarChain, cells: list[_Cell], state: _State, guess: Array, drive: PlanarDrive, load: Array
) -> _State:
    """Return the cells' angles and tensions, base to tip, under given moments of the load."""
    angles: list[float] = []
    tension = np.zeros(chain.offset.shape)
    before = [float(value) for value in drive.tension]
    angle_before = 0.0
    kept_all = state.tension.T.tolist()
    starts, loads = guess.tolist(), load.tolist()
    for k, cell in enumerate(cells):
        kept = [kept_all[k][j] for j in cell.tendons]
        entering = [before[j] for j in cell.tendons]
        angle, behind = _solve_cell(cell, chain.mu, entering, kept, angle_before, loads[k], starts[k], k)
        for j, value in zip(cell.tendons, behind, strict=True):
            before[j] = value
            tension[j, k] = value
        angles.append(angle)
        angle_before = angle
    return _State(np.array(angles), tension, np.zeros(len(cells)))


def _solve_cell(
    cell: _Cell,
    mu: float,
    before: list[float],
    kept: list[float],
    angle_before: float,
    load: float,
    start: float,
    index: int,
) -> tuple[float, list[float]]:
    """Return the angle at which one cell balances, and the tensions in it."""
    half_length = 0.5 * cell.length
    behind: list[float] = []

    def excess(angle: float) -> float:
        nonlocal behind
        capstan = math.exp(0.5 * mu * abs(angle_before + angle))
        behind = tensions_behind(before, kept, cell.offset, capstan)
        cosine, sine = math.cos(0.5 * angle), half_length * math.sin(0.5 * angle)
        moment = load
        for tension, d in zip(behind, cell.offset, strict=True):
            moment += tension * (d * cosine + sine)
        k = angle / cell.length - cell.rest_curvature
        k2 = k * k
        return moment - cell.stiffness * k * (1.0 + k2 * (cell.cubic + k2 * cell.quintic))

    slope = cell.stiffness / cell.length
    small = slope * _CELL_TOLERANCE_RAD
    angle, value = start, excess(start)
    for _ in range(_MOST_SECANTS):
        if abs(value) <= small:
            return angle, behind
        step = value / slope
        following = angle + step
        if step == 0.0 or following == angle:
            return angle, behind
        if not abs(following) < cell.largest_angle:
            break
        next_value = excess(following)
        if next_value != value:
            slope = (value - next_value) / step
        angle, value = following, next_value
        if slope == 0.0:
            break
    return _bracketed(excess, cell, index), behind


def _bracketed(excess: Callable[[float], float], cell: _Cell, index: int) -> float:
    """Return the balancing angle by bisection, where the secant rule did not find it."""
    limit = cell.largest_angle * (1.0 - 1e-9)
    if not excess(-limit) > 0.0 > excess(limit):
        raise NoEquilibrium(
            f"cell {index + 1} would bend beyond {math.degrees(limit):.0f} deg, where its tendon has no "
            "length left between the eyelets"
        )
    angle = float(brentq(excess, -limit, limit, xtol=1e-16, rtol=1e-15))
    excess(angle)
    return angle
