"""Equilibria of the models with few unknowns per subsegment: rows of loads in, postures out.

Each row is solved by itself: from a guess at the full load where the load turns the robot little, and
else in load steps from the straight robot, so that the equilibrium is the one that the growing load
leads to. Rows of the first sort go eight at once.

Dry friction: every tendon slides toward the base at every hole, the base's included and that in which
it ends not, so that its tension falls toward the tip by exp(-mu phi), phi the angle that it turns by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.static_run import StaticRun
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.kinds.continuum.theory.tdcr.displacement import driven, straight_lengths
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.models import ARC, DEGREES, PLANE, SPRING_FACTORS
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.newton import solve_rows
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.together import solve_eights
from catheter_sim.kinds.continuum.theory.tdcr.postures import run_of
from catheter_sim.kinds.continuum.theory.tdcr.problem import Load, Problem, linear_bends, load, problem
from catheter_sim.kinds.continuum.theory.tdcr.threads import share_out
from catheter_sim.mechanics.eight import LANES

# Turn of the robot by the straight one's moments that one load step may bring: with steps of 2.5 rad the
# equilibria of the benchmark's cases (stiffness 0.1 to 1, 1 to 10 disks) are those of 25 steps.
_STEP_RAD = 2.5


@dataclass(frozen=True)
class Equilibria:
    """Equilibria of a robot under r rows of loads, and the evidence.

    Attributes:
        rod, load: what was asked.
        model: `ARC`, `LINKS` or `LINKS_MIDDLE`.
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

    rod: Problem
    load: Load
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
    rod: Problem,
    loads: Load,
    model: int,
    projected: bool = True,
    guess: Array | None = None,
    threads: int = 1,
) -> Equilibria:
    """Return the equilibria of `rod` under `loads`.

    Args:
        rod: the robot.
        loads: tensions, forces and moments, r rows.
        model: `ARC` (CC_sub), `LINKS` (PRB) or `LINKS_MIDDLE`.
        projected: whether the disks' forces lose their part along the disks' normals (Eq. 58).
        guess: unknowns to start from, shape (r, n, d); None: that of the straight robot's moments,
            or CC_sub's answer.
        threads: among which the rows are shared out.
    """
    rows, n, tendons = len(loads), len(rod.length_m), len(rod.hole_m)
    if guess is None and model != ARC:
        guess = links_like_arcs(equilibria(rod, loads, ARC, projected, threads=threads).unknowns)
    linear = linear_bends(rod, loads)
    if guess is None:
        guess = np.concatenate([linear, np.zeros((rows, n, 1))], axis=2)
    unknowns = np.array(guess, dtype=float)
    turn = np.hypot(linear[:, :, 0], linear[:, :, 1]).sum(axis=1)
    result = Equilibria(
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

    robot = (
        model, may_move, rod.length_m, rod.bending_N_m2, rod.torsion_N_m2, hole, rod.last_disk, rod.mu,
        projected,
    )  # fmt: skip

    def solve(part: slice) -> None:
        given = tension[part], force[part], moment[part]
        found = (
            unknowns[part], result.span_tension[part], result.wrench[part], result.p_w[part],
            result.R_w[part], result.residual[part], result.reached[part],
        )  # fmt: skip
        together = len(given[0]) // LANES * LANES
        if together:
            solve_eights(
                *robot, *(array[:together] for array in given), first_share[part][:together],
                *(array[:together] for array in found), result.steps[part][:together],
            )  # fmt: skip
        solve_rows(*robot, *given, first_share[part], *found, result.steps[part])

    share_out(solve, rows, threads)
    return result


def free(rod: Problem, model: int) -> NDArray[np.bool_]:
    """Return which unknowns may move, shape (n, d): no twist where GJ is infinite, no plane but xz."""
    result = np.ones((len(rod.length_m), DEGREES[model]), dtype=bool)
    result[:, -1] = np.isfinite(rod.torsion_N_m2)
    result[:, 1 if model == ARC else PLANE] = ~rod.planar
    return result


def links_like_arcs(bend: Array) -> Array:
    """Return unknowns of PRB, shape (..., 5), near those of CC_sub, shape (..., 3) [rad]."""
    angle = np.hypot(bend[..., 0], bend[..., 1])
    shares = (1.0 / SPRING_FACTORS) / (1.0 / SPRING_FACTORS).sum()
    plane = np.arctan2(bend[..., 1], bend[..., 0])
    return np.concatenate([angle[..., None] * shares, plane[..., None], bend[..., 2:]], axis=-1)


def static_run(
    name: str, model: int, robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array
) -> StaticRun:
    """Return the postures of `robot` under `inputs`.

    Raises:
        InputError: what no rod model carries, displacements that no posture follows, or a row without
            an equilibrium that load steps from the straight robot would reach.
    """
    rod = problem(robot)
    gravity = np.asarray(gravity_mps2, dtype=float)
    loads = load(rod, inputs, gravity)
    if inputs.actuation == "displacement":
        loads = driven(
            name, robot, rod, inputs, loads,
            lambda rows: equilibria(rod, rows, model), lambda found: straight_lengths(found, rod),
        )  # fmt: skip
    found = equilibria(rod, loads, model)
    return run_of(name, robot, rod, inputs, gravity, found, found.residual)
