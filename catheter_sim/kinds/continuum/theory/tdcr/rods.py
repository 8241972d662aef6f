"""Equilibria of a tendon-driven Cosserat rod: rows of loads in, postures and their evidence out.

A row's equilibrium is the one that its loads lead to when they grow in proportion from rest, so that it
does not depend on the rows around it. Only a row so near to the one before that one step of little
turn leads there starts from that, as the robot would. Where the way from rest ends (the robot would
snap), the other ways are tried: from the row before, and with the tensions or the other loads first.
Without friction, rows far from the one before are solved eight at once, where one step from rest leads there.
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
from catheter_sim.kinds.continuum.theory.tdcr.postures import run_of
from catheter_sim.kinds.continuum.theory.tdcr.problem import Load, Problem, linear_bends, load, problem
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels import columns
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.continuation import NEAR_RAD, follow
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.path_lengths import measure_paths
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.together import follow_together
from catheter_sim.kinds.continuum.theory.tdcr.threads import share_out
from catheter_sim.mechanics.eight import LANES

PATHS = {
    "continuous": columns.CONTINUOUS,
    "projected": columns.PROJECTED,
    "eyelets": columns.EYELETS,
    "lumens": columns.LUMENS,
}
# Steps of the integration along the whole robot: the tip is then within 2e-7 of the length.
STEPS = {"continuous": 40, "projected": 80, "eyelets": 80, "lumens": 40}
_ROUGHER = 4  # steps of the balance, over those of its derivative


@dataclass(frozen=True)
class Equilibria:
    """Equilibria of a rod under r rows of loads, and the evidence.

    Attributes:
        rod, load: what was asked.
        path: of the tendons: a key of `PATHS`.
        p_w: centres of disks 0 to n, shape (r, n + 1, 3) [m].
        R_w: their orientations, shape (r, n + 1, 3, 3).
        span_tension: of every tendon in every subsegment, zero beyond its end, shape (r, t, n) [N].
        wrench: moment [N m] and force [N] in the backbone at each subsegment's start, in the frame
            there; on a continuous path of the backbone and its tendons together; shape (r, n, 6).
        unbalanced: moment [N m] and force [N] left at disks 1 to n, in their frames, shape (r, n, 6).
        reached: share of the way from rest to the row's load, shape (r,); below 1 no way led there and
            the row's posture is none.
        corrections: of Newton's method, shape (r,).
    """

    rod: Problem
    load: Load
    path: str
    p_w: Array
    R_w: Array
    span_tension: Array
    wrench: Array
    unbalanced: Array
    reached: Array
    corrections: NDArray[np.intp]


def equilibria(
    rod: Problem,
    loads: Load,
    path: str,
    steps: int = 0,
    longest_step: float = 1.0,
    threads: int = 1,
) -> Equilibria:
    """Return the equilibria of `rod` under `loads`: see the module's text.

    Args:
        rod: the robot.
        loads: tensions, forces and moments, r rows.
        path: "continuous" (VC), "projected" (VC_ref), "eyelets" (VC_ref_noproj), or "lumens": as
            "continuous" with the forces of passing tendons where another one ends, which VC leaves out.
        steps: of the integration along the whole robot, at least; 0: as in `STEPS`.
        longest_step: share of the load that one step of a way may take.
        threads: among which the rows are shared out.
    """
    rows, n, tendons = len(loads), len(rod.length_m), len(rod.hole_m)
    result = Equilibria(
        rod=rod,
        load=loads,
        path=path,
        p_w=np.zeros((rows, n + 1, 3)),
        R_w=np.tile(np.eye(3), (rows, n + 1, 1, 1)),
        span_tension=np.zeros((rows, tendons, n)),
        wrench=np.zeros((rows, n, 6)),
        unbalanced=np.zeros((rows, n, 6)),
        reached=np.zeros(rows),
        corrections=np.zeros(rows, dtype=np.intp),
    )
    rough, fine = sections(rod, (steps or STEPS[path]) // _ROUGHER), sections(rod, steps or STEPS[path])
    shift = np.zeros((rows, n, 3))
    hole, tension = np.ascontiguousarray(rod.hole_m), np.ascontiguousarray(loads.tension_N)
    applied = np.concatenate([loads.moment_N_m, loads.force_N], axis=2)

    robot = PATHS[path], rough, fine, hole, rod.last_disk
    together = rows >= LANES and rod.mu == 0.0 and longest_step >= 1.0
    far = far_from_before(rod, loads) if together else np.zeros(rows, dtype=bool)

    def solve(part: slice) -> None:
        given = tension[part], applied[part]
        found = (
            result.wrench[part], result.span_tension[part], shift[part], result.R_w[part],
            result.unbalanced[part], result.reached[part], result.corrections[part],
        )  # fmt: skip
        chosen = np.flatnonzero(far[part])
        chosen = chosen[: len(chosen) // LANES * LANES]
        if len(chosen):
            follow_together(*robot, chosen, *given, *found)
        follow(*robot, float(rod.mu), *given, *found, longest_step)

    share_out(solve, rows, threads)
    moved = (result.R_w[:, :-1] @ shift[..., None])[..., 0]
    np.cumsum(moved, axis=1, out=result.p_w[:, 1:])
    return result


def far_from_before(rod: Problem, loads: Load) -> NDArray[np.bool_]:
    """Return which rows do not start from the row before, by the turn of the straight robot, shape (r,)."""
    change = np.diff(linear_bends(rod, loads), axis=0)
    turn = np.hypot(change[:, :, 0], change[:, :, 1]).sum(axis=1)
    return np.concatenate([[True], turn > NEAR_RAD])


def path_lengths(found: Equilibria) -> Array:
    """Return the lengths of the tendons' paths from the base to their ends, shape (r, t) [m]."""
    rod = found.rod
    if found.path in ("projected", "eyelets"):
        return straight_lengths(found, rod)
    length = np.zeros(found.load.tension_N.shape)
    measure_paths(
        sections(rod, 1), np.ascontiguousarray(rod.hole_m), rod.last_disk, found.span_tension, found.wrench,
        found.p_w, found.R_w, length,
    )  # fmt: skip
    return length


def sections(rod: Problem, steps: int) -> Array:
    """Return the subsegments as the compiled code takes them, shape (n, 8).

    Args:
        rod: the robot.
        steps: of the integration along the whole robot, at least.
    """
    bending = 1.0 / rod.bending_N_m2
    shear = 1.0 / rod.shear_N
    step = rod.disk_z_m[-1] / steps
    columns = [
        np.where(rod.planar, 0.0, bending),
        bending,
        1.0 / rod.torsion_N_m2,
        shear,
        np.where(rod.planar, 0.0, shear),
        1.0 / rod.axial_N,
        rod.length_m,
        np.ceil(rod.length_m / step - 1e-6),
    ]
    return np.ascontiguousarray(np.stack(columns, axis=1))


def static_run(
    model: str, path: str, robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array
) -> StaticRun:
    """Return the postures of `robot` under `inputs` for one kind of tendon path.

    Raises:
        InputError: what no rod model carries, displacements that no posture follows, or a row without
            an equilibrium that continuation from the row before or from rest would reach.
    """
    rod = problem(robot)
    gravity = np.asarray(gravity_mps2, dtype=float)
    loads = load(rod, inputs, gravity)
    if inputs.actuation == "displacement":
        loads = driven(
            model, robot, rod, inputs, loads, lambda rows: equilibria(rod, rows, path), path_lengths
        )
    found = equilibria(rod, loads, path)
    return run_of(
        model, robot, rod, inputs, gravity, found, np.abs(found.unbalanced[:, :, :3]).max(axis=(1, 2))
    )
