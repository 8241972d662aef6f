"""The static model PRB: four rigid links and three joints per subsegment, with twist (extended 3R).

Rao et al. 2021 (doi 10.3389/frobt.2020.630245, Eqs. 11-12, 30-33, 48-54, 58, Table 1 with the lengths
divided by their sum, 0.999). M* of Eq. 53 is taken as the moment's part normal to the z axis of the
subsegment's base. Three forms of the bending plane's balance:

- printed (Eq. 52: M* parallel to the plane's normal y). As one number it is M* . y - |M*|, of which the
  plane's angle is a double root: a solver gains one bit a step and stops where its tolerances let it
  (`prb_printed`; ten disks, 0.2 of the stiffness, 0.5 N across the plane: mean tip error 0.33 % of the
  length, of the root itself 0.16 %).
- M* . e = 0, e in the bending plane: the same root, a simple one. This is `PRB`.
- `prb_middle`: the same balance at the subsegment's middle joint, and the twist's at its end. Eqs. 52
  and 54 take the moment about the base. A load across the bending plane makes it vary along the
  subsegment, so that they err by half a subsegment's length, to first order: most of what is called
  the model's weakness under transverse loads (in that case 0.03 % remain).
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.static_run import StaticRun
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.kinds.continuum.theory.tdcr.lumped import Equilibria, free, static_run
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.balance import evaluate
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.models import LINKS, LINKS_MIDDLE, PLANE
from catheter_sim.kinds.continuum.theory.tdcr.problem import Load, Problem


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


def prb_printed(
    rod: Problem, loads: Load, row: int = 0, start: Array | None = None, tolerance: float = 1e-10
) -> tuple[Equilibria, float]:
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
    one = Load(loads.tension_N[[row]], loads.force_N[[row]], loads.moment_N_m[[row]])
    n = len(rod.length_m)
    may_move = free(rod, LINKS)
    if rod.mu or not may_move.all():
        raise ValueError("the printed residual is for free unknowns and no friction")
    r, D, parts = np.empty((n, 5)), np.empty((n, 5, 5)), np.empty((4, n, 5, 3))
    forces, swing = np.empty((n + 2, 3)), np.empty((n + 2, 3, 3))
    B, C = np.empty((n, 5, 3)), np.empty((n, 5, 3))
    span, wrench = np.zeros((len(rod.hole_m), n)), np.empty((n, 6))
    p_w, R_w = np.empty((n + 1, 3)), np.empty((n + 1, 3, 3))

    def printed(flat: Array) -> Array:
        x = flat.reshape(n, 5)
        evaluate(
            LINKS, x, may_move, rod.length_m, rod.bending_N_m2, rod.torsion_N_m2, rod.hole_m, rod.last_disk,
            0.0, True, one.tension_N[0], one.force_N[0], one.moment_N_m[0],
            r, D, parts, forces, swing, B, C, span, wrench, p_w, R_w, np.inf,
        )  # fmt: skip
        across = np.einsum("kij,ki->kj", R_w[:-1], wrench[:, 3:])[:, :2]  # M* in the base's axes
        normal = np.stack([-np.sin(x[:, PLANE]), np.cos(x[:, PLANE])], axis=1)
        result = r.copy()
        result[:, PLANE] = (across * normal).sum(axis=1) - np.hypot(across[:, 0], across[:, 1])
        return result.ravel()

    begin = np.zeros(5 * n) if start is None else np.asarray(start, dtype=float).ravel()
    found = least_squares(printed, begin, method="lm", xtol=tolerance, ftol=tolerance, gtol=tolerance)
    printed(found.x)
    stopped = Equilibria(
        rod=rod, load=one, model=LINKS, unknowns=found.x.reshape(1, n, 5), p_w=p_w[None], R_w=R_w[None],
        span_tension=span[None], wrench=wrench[None], residual=np.abs(r).max()[None],
        reached=np.ones(1), steps=np.ones(1, dtype=np.int64),
    )  # fmt: skip
    return stopped, 2.0 * float(found.cost)
