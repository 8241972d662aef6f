"""The static models CC_sub and PRB: few unknowns per subsegment, with twist."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.statics import StaticRun
from catheter_sim.mechanics.eight import LANES
from catheter_sim.robots.continuum.lumped_kernels import (
    ARC,
    DEGREES,
    LINKS,
    LINKS_MIDDLE,
    LINKS_ONE,
    ONE_FACTOR,
    PLANE,
    SPRING_FACTORS,
    DiskLoads,
    DiskStates,
    LumpedRod,
    Unbalanced,
    evaluate,
    solve_eights,
    solve_rows,
)
from catheter_sim.robots.continuum.rods import (
    RodLoad,
    RodProblem,
    driven,
    linear_bends,
    load,
    problem,
    run_of,
    share_out,
    straight_lengths,
)
from catheter_sim.robots.continuum.spec import ContinuumRobot

# ----------------------------------------------------------------------------------------------------
# Equilibria of the models with few unknowns per subsegment: rows of loads in, postures out.
#
# Each row is solved by itself: from a guess at the full load where the load turns the robot little, and
# else in load steps from the straight robot, so that the equilibrium is the one that the growing load leads
# to. Rows of the first sort go eight at once.
#
# Dry friction: every tendon slides toward the base at every hole, the base's included and that in which it
# ends not, so that its tension falls toward the tip by exp(-mu phi), phi the angle that it turns by.

# Turn of the robot by the straight one's moments that one load step may bring: with steps of 2.5 rad the
# equilibria of the benchmark's cases (stiffness 0.1 to 1, 1 to 10 disks) are those of 25 steps.
_STEP_RAD = 2.5


@dataclass(frozen=True)
class LumpedEquilibria:
    """Equilibria of a robot under r rows of loads, and the evidence.

    Attributes:
        rod, load: what was asked.
        model: `ARC`, `LINKS`, `LINKS_MIDDLE` or `LINKS_ONE`.
        unknowns: shape (r, n, d) [rad]; see `subsegments.arc` and `subsegments.links` in `lumped_kernels`.
        p_w: centres of disks 0 to n, shape (r, n + 1, 3) [m].
        R_w: their orientations, shape (r, n + 1, 3, 3).
        span_tension: of every tendon in every subsegment, zero beyond its end, shape (r, t, n) [N].
        wrench: force [N] and moment [N m] in each subsegment's base, tendons' included, base frame,
            shape (r, n, 6).
        residual: largest unbalanced moment, shape (r,) [N m].
        reached: share of the load at which there is balance, shape (r,); below 1 the row's posture is none.
        steps: load steps that were taken, shape (r,).
    """

    rod: RodProblem
    load: RodLoad
    model: int
    unknowns: Array
    p_w: Array
    R_w: Array
    span_tension: Array
    wrench: Array
    residual: Array
    reached: Array
    steps: NDArray[np.int64]


def equilibria(
    rod: RodProblem,
    loads: RodLoad,
    model: int,
    projected: bool = True,
    guess: Array | None = None,
    threads: int = 1,
) -> LumpedEquilibria:
    """Return the equilibria of `rod` under `loads`.

    Args:
        rod: the robot.
        loads: tensions, forces and moments, r rows.
        model: `ARC` (CC_sub), `LINKS` (PRB), `LINKS_MIDDLE` or `LINKS_ONE`.
        projected: whether the disks' forces lose their part along the disks' normals (Eq. 58).
        guess: unknowns to start from, shape (r, n, d); None: that of the straight robot's moments,
            or CC_sub's answer.
        threads: among which the rows are shared out.
    """
    rows, n, tendons = len(loads), len(rod.length_m), len(rod.hole_m)
    if guess is None and model != ARC:
        arcs = equilibria(rod, loads, ARC, projected, threads=threads).unknowns
        guess = links_like_arcs(arcs, ONE_FACTOR if model == LINKS_ONE else SPRING_FACTORS)
    linear = linear_bends(rod, loads)
    if guess is None:
        guess = np.concatenate([linear, np.zeros((rows, n, 1))], axis=2)
    unknowns = np.array(guess, dtype=float)
    turn = np.hypot(linear[:, :, 0], linear[:, :, 1]).sum(axis=1)
    result = LumpedEquilibria(
        rod=rod,
        load=loads,
        model=model,
        unknowns=unknowns,
        p_w=np.zeros((rows, n + 1, 3)),
        R_w=np.zeros((rows, n + 1, 3, 3)),
        span_tension=np.zeros((rows, tendons, n)),
        wrench=np.zeros((rows, n, 6)),
        residual=np.zeros(rows),
        reached=np.zeros(rows),
        steps=np.zeros(rows, dtype=np.int64),
    )
    may_move = free(rod, model)
    unknowns[:, ~may_move] = 0.0
    hole, tension = np.ascontiguousarray(rod.hole_m), np.ascontiguousarray(loads.tension_N)
    force, moment = np.ascontiguousarray(loads.force_N), np.ascontiguousarray(loads.moment_N_m)
    first_share = np.minimum(1.0, _STEP_RAD / np.maximum(turn, 1e-9))

    robot = LumpedRod(
        model, may_move, rod.length_m, rod.bending_N_m2, rod.torsion_N_m2, hole, rod.last_disk, rod.mu,
        projected,
    )  # fmt: skip

    def solve_part(solve: Callable[..., None], part: slice) -> None:
        states = (result.span_tension, result.wrench, result.p_w, result.R_w)
        solve(
            robot,
            DiskLoads(tension[part], force[part], moment[part]),
            *(first_share[part], unknowns[part]),
            DiskStates(*(array[part] for array in states)),
            *(result.residual[part], result.reached[part], result.steps[part]),
        )

    def solve(part: slice) -> None:
        first, last, _ = part.indices(rows)
        together = (last - first) // LANES * LANES
        if together:
            solve_part(solve_eights, slice(first, first + together))
        solve_part(solve_rows, part)

    share_out(solve, rows, threads)
    return result


def free(rod: RodProblem, model: int) -> NDArray[np.bool_]:
    """Return which unknowns may move, shape (n, d): no twist where GJ is infinite, no plane but xz."""
    result = np.ones((len(rod.length_m), DEGREES[model]), dtype=bool)
    result[:, -1] = np.isfinite(rod.torsion_N_m2)
    result[:, 1 if model == ARC else PLANE] = ~rod.planar
    return result


def links_like_arcs(bend: Array, factors: Array = SPRING_FACTORS) -> Array:
    """Return unknowns of links with the springs `factors`, shape (..., d), near CC_sub's, (..., 3) [rad]."""
    angle = np.hypot(bend[..., 0], bend[..., 1])
    shares = (1.0 / factors) / (1.0 / factors).sum()
    plane = np.arctan2(bend[..., 1], bend[..., 0])
    return np.concatenate([angle[..., None] * shares, plane[..., None], bend[..., 2:]], axis=-1)


def static_run(
    name: str, model: int, robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array, twists: bool = True
) -> StaticRun:
    """Return the postures of `robot` under `inputs`; without `twists` its torsion is locked.

    Raises:
        InputError: what no rod model carries, displacements that no posture follows, or a row without
            an equilibrium that load steps from the straight robot would reach.
    """
    rod = problem(robot)
    rod = rod if twists else untwisted(rod)
    gravity = np.asarray(gravity_mps2, dtype=float)
    loads = load(rod, inputs, gravity)
    if inputs.actuation == "displacement":
        loads = driven(
            name, robot, rod, inputs, loads,
            lambda rows: equilibria(rod, rows, model), lambda found: straight_lengths(found, rod),
        )  # fmt: skip
    found = equilibria(rod, loads, model)
    return run_of(name, robot, rod, inputs, gravity, found, found.residual)


# ----------------------------------------------------------------------------------------------------
# The static model PRB: four rigid links and three joints per subsegment, with twist (extended 3R).
#
# Rao et al. 2021 (doi 10.3389/frobt.2020.630245, Eqs. 11-12, 30-33, 48-54, 58, Table 1 with the lengths
# divided by their sum, 0.999). M* of Eq. 53 is taken as the moment's part normal to the z axis of the
# subsegment's base. Three forms of the bending plane's balance:
#
# - printed (Eq. 52: M* parallel to the plane's normal y). As one number it is M* . y - |M*|, of which the
#   plane's angle is a double root: a solver gains one bit a step and stops where its tolerances let it
#   (`prb_printed`; ten disks, 0.2 of the stiffness, 0.5 N across the plane: mean tip error 0.33 % of the
#   length, of the root itself 0.16 %).
# - M* . e = 0, e in the bending plane: the same root, a simple one. This is `PRB`.
# - `prb_middle`: the same balance at the subsegment's middle joint, and the twist's at its end. Eqs. 52
#   and 54 take the moment about the base. A load across the bending plane makes it vary along the
#   subsegment, so that they err by half a subsegment's length, to first order: most of what is called
#   the model's weakness under transverse loads (in that case 0.03 % remain).


def prb(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` under `inputs`, row by row: the equations' root.

    Args:
        robot: any robot that `problem.is_rod` accepts; shear and stretch of the backbone are not in
            the model, and its `effects` are not read.
        inputs: tensions or displacements, and loads on the tip.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: see `lumped.static_run`.
    """
    return static_run("PRB", LINKS, robot, inputs, gravity_mps2)


def prb_middle(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the same with the plane balanced at the middle of the subsegment and the twist at its end."""
    return static_run("PRB_middle", LINKS_MIDDLE, robot, inputs, gravity_mps2)


def prb_no_twist(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return PRB's postures without Eq. 54: no subsegment twists (Rao 2021, Eqs 12, 48-53; Huang 2019)."""
    return static_run("PRB_no_twist", LINKS, robot, inputs, gravity_mps2, twists=False)


def prb_one(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures with one joint per subsegment, in its middle (Rao 2021, Section 3.2.2)."""
    return static_run("PRB_one", LINKS_ONE, robot, inputs, gravity_mps2)


def untwisted(rod: RodProblem) -> RodProblem:
    """Return a robot that does not twist and is else like `rod`."""
    return replace(rod, torsion_N_m2=np.full(len(rod.length_m), np.inf))


def prb_printed(
    rod: RodProblem, loads: RodLoad, row: int = 0, start: Array | None = None, tolerance: float = 1e-10
) -> tuple[LumpedEquilibria, float]:
    """Return what Levenberg and Marquardt's method makes of the printed residual, as the benchmark used it.

    Derivatives by differences; the plane's residual is M* . y - |M*|.

    Args:
        rod: the robot; its unknowns must all be free, its friction zero.
        loads: of which one row is solved.
        row: which.
        start: unknowns, shape (n, 5); None: straight, all bending planes at angle zero.
        tolerance: of the method, on unknowns, cost and gradient alike.

    Returns:
        Where it stopped, as one row whose `residual` is that of the simple form [N m], and the sum of
        squares of the printed residual there.
    """
    one = RodLoad(loads.tension_N[[row]], loads.force_N[[row]], loads.moment_N_m[[row]])
    n = len(rod.length_m)
    may_move = free(rod, LINKS)
    if rod.mu or not may_move.all():
        raise ValueError("the printed residual is for free unknowns and no friction")
    r, D, parts = np.empty((n, 5)), np.empty((n, 5, 5)), np.empty((4, n, 5, 3))
    forces, swing = np.empty((n + 2, 3)), np.empty((n + 2, 3, 3))
    B, C = np.empty((n, 5, 3)), np.empty((n, 5, 3))
    span, wrench = np.zeros((len(rod.hole_m), n)), np.empty((n, 6))
    p_w, R_w = np.empty((n + 1, 3)), np.empty((n + 1, 3, 3))
    frictionless = LumpedRod(
        LINKS,
        may_move,
        rod.length_m,
        rod.bending_N_m2,
        rod.torsion_N_m2,
        rod.hole_m,
        rod.last_disk,
        0.0,
        True,
    )
    acting = DiskLoads(one.tension_N[0], one.force_N[0], one.moment_N_m[0])
    lacks, states = Unbalanced(r, D, parts, forces, swing, B, C), DiskStates(span, wrench, p_w, R_w)

    def printed(flat: Array) -> Array:
        x = flat.reshape(n, 5)
        evaluate(frictionless, x, acting, lacks, states, np.inf)
        across = np.einsum("kij,ki->kj", R_w[:-1], wrench[:, 3:])[:, :2]  # M* in the base's axes
        normal = np.stack([-np.sin(x[:, PLANE]), np.cos(x[:, PLANE])], axis=1)
        result = r.copy()
        result[:, PLANE] = (across * normal).sum(axis=1) - np.hypot(across[:, 0], across[:, 1])
        return result.ravel()

    begin = np.zeros(5 * n) if start is None else np.asarray(start, dtype=float).ravel()
    found = least_squares(printed, begin, method="lm", xtol=tolerance, ftol=tolerance, gtol=tolerance)
    printed(found.x)
    stopped = LumpedEquilibria(
        rod=rod, load=one, model=LINKS, unknowns=found.x.reshape(1, n, 5), p_w=p_w[None], R_w=R_w[None],
        span_tension=span[None], wrench=wrench[None], residual=np.abs(r).max()[None],
        reached=np.ones(1), steps=np.ones(1, dtype=np.int64),
    )  # fmt: skip
    return stopped, 2.0 * float(found.cost)


# ----------------------------------------------------------------------------------------------------
# The static model CC_sub: one arc of constant curvature per subsegment, with twist.
#
# Rao et al. 2021 (doi 10.3389/frobt.2020.630245, Eqs. 8, 30-33, 43-47, 58). Every arc's moment is that
# about its base; where tendon forces or a load make the moment vary along the subsegment, this is where the
# model errs: by the length of a subsegment, to first order.


def cc_sub(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` under `inputs`, row by row; see the module's text.

    Args:
        robot: any robot that `problem.is_rod` accepts; shear and stretch of the backbone are not in
            the model, and its `effects` are not read.
        inputs: tensions or displacements, and loads on the tip.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: see `lumped.static_run`.
    """
    return static_run("CC_sub", ARC, robot, inputs, gravity_mps2)
