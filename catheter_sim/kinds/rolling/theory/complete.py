"""The static models `complete`, `complete_sliding` and `virtual_work`: the same robot, balanced in two ways.

`complete` takes the Newton-Euler balance of every link, compiled (`kernels`); `virtual_work` the
principle of virtual work, in plain NumPy. They agree to rounding. Neither shows the buckling of the
even joints that the printed balance of chest_tube_2025 has (`printed`).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.loads import LinkForce
from catheter_sim.core.static_run import NoEquilibrium, StaticRun, require_tensions
from catheter_sim.errors import InputError
from catheter_sim.kinds.rolling.spec import RollingRobot
from catheter_sim.kinds.rolling.theory import virtual_work as by_virtual_work
from catheter_sim.kinds.rolling.theory.chain import RollingChain, rolling_chain
from catheter_sim.kinds.rolling.theory.history import (
    Standing,
    Stretch,
    postures,
    several_rods_at_once,
    stretches,
    ways,
)
from catheter_sim.kinds.rolling.theory.kernels.columns import LENGTH, REST
from catheter_sim.kinds.rolling.theory.kernels.history import follow, load_batch
from catheter_sim.kinds.rolling.theory.kernels.packed import pack
from catheter_sim.kinds.rolling.theory.loads import loads

_SHORTEST_STEP = 1e-4  # share of the way between two rows
# Of rods that stick, the first that finds an equilibrium. Ten times as much moves the tip of
# `chest_tube_section` by 0.04 mm where it turns round, of `chest_tube` by 0.1 mm.
PRE_SLIDING_M = (1e-8, 1e-7, 1e-6)


@dataclass(frozen=True)
class Solved:
    """Equilibria of one robot, one a row.

    Attributes:
        theta: bend angles, shape (r, n) [rad].
        at_joint: tension of the pulled rods in each joint's gap, shape (r, t, n) [N].
        link_length: as compressed, shape (r, n) [m].
        unbalanced: moment left at each joint, shape (r, n) [N m].
        steps: how many lead to rest under the weight, then to each row, shape (r + 1,), or (0,).
        made: what each of all s steps along a history did, as `kernels.history.follow` leaves it.
        end: where a history ended; None: there is none.
    """

    theta: Array
    at_joint: Array
    link_length: Array
    unbalanced: Array
    steps: np.ndarray
    made: Array
    end: Standing | None = None


def complete(
    robot: RollingRobot, inputs: Inputs, gravity_mps2: Array, others: Sequence[LinkForce] = ()
) -> StaticRun:
    """Return the postures by the complete Newton-Euler balance, with the friction's history.

    As long as one rod at a time pulls and no load is given, its tensions alone tell how it rubs
    (`rods.tensions`); weight makes that err by up to 0.35 mm at the tip of `chest_tube_section`. Where
    several rods are tense at once, or a force or moment acts on the tip or on links, friction goes by how
    rods slide, as in `complete_sliding`: tensions alone err there by up to 190 mm at the tip of `chest_tube`.

    Args:
        robot: a robot of rolling joints.
        inputs: tensions of its rods, and optionally tip force and moment.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        others: further forces, steady from the start.

    Raises:
        InputError: displacement inputs, or no posture balances a row.
    """
    return _run("complete", robot, inputs, gravity_mps2, others)


def complete_sliding(
    robot: RollingRobot, inputs: Inputs, gravity_mps2: Array, others: Sequence[LinkForce] = ()
) -> StaticRun:
    """Return the postures by the complete balance, with friction by how the rods slide in the links.

    Coulomb's law asks how a rod moves, not what its tension was: see `kernels.sliding`. Arguments and errors
    as in `complete`.
    """
    return _run("complete_sliding", robot, inputs, gravity_mps2, others)


def virtual_work(
    robot: RollingRobot, inputs: Inputs, gravity_mps2: Array, others: Sequence[LinkForce] = ()
) -> StaticRun:
    """Return the postures by virtual work; arguments, errors and the choice of friction as in `complete`.

    Where friction goes by how rods slide, how they do is read from `complete`: the balance alone is checked.
    """
    return _run("virtual_work", robot, inputs, gravity_mps2, others)


def solve_history(
    chain: RollingChain,
    inputs: Inputs,
    gravity_mps2: Array,
    others: Sequence[LinkForce] = (),
    step_bend_rad: float | None = None,
    alone_bend_rad: float | None = None,
    guide: Solved | None = None,
    pre_sliding_m: tuple[float, ...] = (),
    after: Standing | None = None,
) -> Solved:
    """Return the equilibria of every row, one after another, by the complete balance.

    Arguments are those of `history.ways`, and

    Args:
        guide: of a robot that is much alike, under as many rows; the search goes in its steps where those are
            nearly as many as asked for, and begins where it went.
        pre_sliding_m: of rods that stick, by which friction goes by how they slide (`kernels.sliding`); the
            first with which an equilibrium is found. None: friction keeps tensions.
        after: where the robot stands, after rows by the same choices; None: at rest.

    Raises:
        InputError: no posture balances a row.
    """
    robot = pack(chain)
    way = ways(chain, inputs, gravity_mps2, others, step_bend_rad, alone_bend_rad, after)
    steps, alike = way.steps, guide is not None and _nearly_as_many(guide.steps, way.steps)
    if guide is not None and alike:
        steps = guide.steps
    r, n, t = len(steps), chain.joints, chain.pulled
    if after is None:
        memory = np.zeros((3 if pre_sliding_m else 1, t, n))
        angle, lengths = robot.joint[:, REST].copy(), robot.joint[:, LENGTH].copy()
    else:
        angle, lengths, memory = after.theta.copy(), after.link_length.copy(), after.memory.copy()
    theta, length, value = np.empty((r, n)), np.empty((r, n)), np.empty((r, n))
    at_joint = np.empty((r, t, n))
    made = np.empty((int(steps.sum()), 1 + t if pre_sliding_m else 1, n))
    known = guide.made if guide is not None and alike and guide.made.shape == made.shape else made[:0]
    reached = follow(
        *(robot.joint, robot.rod, robot.stiffness, robot.pulled, robot.mu),
        *(way.drive, way.at_rest.link, way.at_rest.point, way.force, way.tip_moment, steps),
        *(np.array(pre_sliding_m), known, made, 0 if after is None else 1, angle, lengths, memory),
        *(theta, length, at_joint, value),
    )
    if reached < r:
        raise _no_equilibrium("complete", inputs, reached)
    end = Standing(angle, lengths, memory, way.drive[-1], way.force[-1], way.tip_moment[-1])
    return Solved(theta[1:], at_joint[1:], length[1:], value[1:], steps, made, end)


def _nearly_as_many(theirs: np.ndarray, asked: np.ndarray) -> bool:
    """Return whether no row's steps are more than a tenth, and more than one, away from those asked for."""
    return theirs.shape == asked.shape and bool((np.abs(theirs - asked) <= np.maximum(1, asked // 10)).all())


def solve_loaded(
    chain: RollingChain,
    tension: Array,
    gravity_mps2: Array,
    force_tip: Array | None = None,
    moment_tip: Array | None = None,
) -> Solved:
    """Return the equilibria of a batch of tensions, each loaded from rest: no history but its own.

    Args:
        chain: the robot.
        tension: at the actuator, shape (b, t) [N].
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        force_tip, moment_tip: the same for all, shape (3,) [N], [N m].

    Raises:
        InputError: no posture balances one of them.
    """
    packed = pack(chain)
    acting = loads(chain, gravity_mps2, force_tip, moment_tip)
    b, n, t = len(tension), chain.joints, chain.pulled
    order = np.argsort(tension.sum(axis=1), kind="stable")  # neighbours are good starts for one another
    drive = np.ascontiguousarray(tension[order], dtype=float)
    theta, length, value = np.empty((b, n)), np.empty((b, n)), np.empty((b, n))
    at_joint = np.empty((b, t, n))
    failed = load_batch(
        *(packed.joint, packed.rod, packed.stiffness, packed.pulled, packed.mu, drive, length),
        *(acting.link, acting.point, acting.force, acting.tip_moment, theta, at_joint, value),
    )
    if failed >= 0:
        raise InputError(
            f"static model 'complete': no posture balances the tensions {tension[order[failed]].tolist()} N"
        )
    back = np.argsort(order, kind="stable")
    return Solved(
        theta[back], at_joint[back], length[back], value[back], np.empty(0, np.int64), np.empty((0, 1, n))
    )


def solve_history_by_virtual_work(
    chain: RollingChain, inputs: Inputs, gravity_mps2: Array, others: Sequence[LinkForce] = ()
) -> Solved:
    """Return the equilibria of every row by virtual work; as `solve_history`."""
    theta, kept = chain.rest_angle.copy(), np.zeros((chain.pulled, chain.joints))
    rows = []
    for row, way in enumerate(stretches(chain, inputs, gravity_mps2, others)):
        try:
            found = _follow(chain, way, theta, kept)
        except NoEquilibrium:
            raise _no_equilibrium("virtual_work", inputs, row) from None
        theta, kept = found.theta, found.tension.above
        rows.append((theta, found.tension.at_joint, found.link_length, found.unbalanced))
    thetas, at_joint, length, value = (np.array(column[1:]) for column in zip(*rows, strict=True))
    return Solved(thetas, at_joint, length, value, np.empty(0, np.int64), np.empty((0, 1, chain.joints)))


def balance_by_virtual_work(
    chain: RollingChain, inputs: Inputs, gravity_mps2: Array, others: Sequence[LinkForce], solved: Solved
) -> Solved:
    """Return the equilibria by virtual work under the tensions that `solved` has along its rods, row by row.

    Raises:
        InputError: no posture balances a row.
    """
    rows, rod = [], np.arange(chain.pulled)
    last = chain.last[: chain.pulled] - 1
    for row, way in enumerate(itertools.islice(stretches(chain, inputs, gravity_mps2, others), 1, None)):
        at_joint = solved.at_joint[row]
        above = np.zeros_like(at_joint)
        above[:, :-1] = at_joint[:, 1:]
        above[rod, last] = at_joint[rod, last]  # a rod ends in its last link
        try:
            found = by_virtual_work.equilibrium(
                chain, *way.at(1.0), solved.theta[row], above, solved.link_length[row]
            )
        except NoEquilibrium:
            raise _no_equilibrium("virtual_work", inputs, row + 1) from None
        rows.append((found.theta, found.tension.at_joint, found.link_length, found.unbalanced))
    theta, tension, length, value = (np.array(column) for column in zip(*rows, strict=True))
    return Solved(theta, tension, length, value, np.empty(0, np.int64), np.empty((0, 1, chain.joints)))


def _follow(chain: RollingChain, way: Stretch, theta: Array, kept: Array) -> by_virtual_work.Balance:
    """Return the equilibrium at the end of `way`; steps are halved where none is found."""
    done, stride = 0.0, 1.0 / way.steps
    while True:
        part = done + stride
        part = 1.0 if part > 1.0 - 1e-9 else part
        drive, acting = way.at(part)
        try:
            found = by_virtual_work.equilibrium(chain, drive, acting, theta, kept)
        except NoEquilibrium:
            stride *= 0.5
            if stride < _SHORTEST_STEP:
                raise
            continue
        theta, kept, done = found.theta, found.tension.above, part
        if done == 1.0:
            return found


def _run(
    model: str,
    robot: RollingRobot,
    inputs: Inputs,
    gravity_mps2: Array,
    others: Sequence[LinkForce],
) -> StaticRun:
    require_tensions(inputs, model)
    chain = rolling_chain(robot)
    gravity = np.asarray(gravity_mps2, dtype=float)
    loaded = bool(inputs.force_tip.any() or inputs.moment_tip.any() or others)
    sliding = model == "complete_sliding" or loaded or several_rods_at_once(inputs.tendon)
    if model == "virtual_work" and not sliding:
        solved = solve_history_by_virtual_work(chain, inputs, gravity, others)
    else:
        gives = PRE_SLIDING_M if sliding else ()
        solved = solve_history(chain, inputs, gravity, others, pre_sliding_m=gives)
        if model == "virtual_work":
            solved = balance_by_virtual_work(chain, inputs, gravity, others, solved)
    found = postures(chain, inputs, gravity, solved.theta, solved.at_joint, solved.link_length)
    residual = np.abs(solved.unbalanced).max(axis=1)
    return StaticRun(model, inputs, gravity, tuple(found), residual)


def _no_equilibrium(model: str, inputs: Inputs, row: int) -> InputError:
    place = row_name(inputs, row - 1) if row else "at rest under its weight"
    what = "no posture close by balances rods and loads; the robot snaps or folds"
    return InputError(f"{place}: static model {model!r}: {what}")
