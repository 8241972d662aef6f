"""Equilibria of a tendon-driven Cosserat rod: rows of loads in, postures and their evidence out.

A row's equilibrium is the one that its loads lead to when they grow in proportion from rest, so that it
does not depend on the rows around it. Only a row so near to the one before that one step of little
turn leads there starts from that, as the robot would. Where the way from rest ends (the robot would
snap), the other ways are tried: from the row before, and with the tensions or the other loads first.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.posture import Array
from catheter_sim.robots.specification import ContinuumRobot
from catheter_sim.statics.result import StaticRun
from catheter_sim.statics.tdcr import kernel
from catheter_sim.statics.tdcr.postures import run_of
from catheter_sim.statics.tdcr.problem import Load, Problem, load, problem

PATHS = {
    "continuous": kernel.CONTINUOUS,
    "projected": kernel.PROJECTED,
    "eyelets": kernel.EYELETS,
    "lumens": kernel.LUMENS,
}
# Steps of the integration along the whole robot: the tip is then within 2e-7 of the length.
STEPS = {"continuous": 40, "projected": 80, "eyelets": 80, "lumens": 40}
_ROUGHER = 4  # steps at the end of a way, over those on it
_NEAR, _FROM_REST, _FROM_BEFORE = "near", "from rest", "from before"
_TENSIONS_FIRST, _LOADS_FIRST = "tensions first", "loads first"

_Loads = tuple[Array, Array]  # tensions, moments and forces on the disks


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


def equilibria(rod: Problem, loads: Load, path: str, steps: int = 0) -> Equilibria:
    """Return the equilibria of `rod` under `loads`: see the module's text.

    Args:
        rod: the robot.
        loads: tensions, forces and moments, r rows.
        path: "continuous" (VC), "projected" (VC_ref), "eyelets" (VC_ref_noproj), or "lumens": as
            "continuous" with the forces of passing tendons where another one ends, which VC leaves out.
        steps: of the integration along the whole robot, at least; 0: as in `STEPS`.
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
    robot = PATHS[path], rough, fine, np.ascontiguousarray(rod.hole_m), rod.last_disk, float(rod.mu)
    turn, shift, angle = np.zeros((n, 3, 3)), np.zeros((n, 3)), np.zeros((tendons, n))
    tension = np.ascontiguousarray(loads.tension_N)
    applied = np.concatenate([loads.moment_N_m, loads.force_N], axis=2)
    for row in range(rows):
        before = row > 0 and result.reached[row - 1] == 1.0
        for way, stops in _ways(tension, applied, row, before):
            from_rest = way not in (_NEAR, _FROM_BEFORE)
            result.wrench[row] = 0.0 if from_rest else result.wrench[row - 1]
            if from_rest:
                angle[:] = 0.0
            reached = 1.0
            for start, end in pairwise(stops):
                reached, count = kernel.advance(
                    *robot, *start, *end, result.wrench[row], result.span_tension[row], angle,
                    turn, shift, result.R_w[row], result.unbalanced[row], way == _NEAR,
                )  # fmt: skip
                result.corrections[row] += count
                if reached < 1.0:
                    break
            if reached == 1.0 or way == _FROM_REST:
                result.reached[row] = reached
            if reached == 1.0:
                break
        result.p_w[row, 1:] = np.cumsum(np.einsum("jab,jb->ja", result.R_w[row, :-1], shift), axis=0)
    return result


def _ways(tension: Array, applied: Array, row: int, before: bool) -> Iterator[tuple[str, list[_Loads]]]:
    """Yield the ways to a row's loads in the order in which they are tried, each with its stops.

    `before` says whether the row before is balanced and may be a start.
    """
    there = tension[row], applied[row]
    rest = np.zeros_like(tension[row]), np.zeros_like(applied[row])
    if before:
        yield _NEAR, [(tension[row - 1], applied[row - 1]), there]
    yield _FROM_REST, [rest, there]
    if before:
        yield _FROM_BEFORE, [(tension[row - 1], applied[row - 1]), there]
    if there[0].any() and there[1].any():
        yield _TENSIONS_FIRST, [rest, (there[0], rest[1]), there]
        yield _LOADS_FIRST, [rest, (rest[0], there[1]), there]


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
        InputError: what no rod model carries, displacement inputs, or a row without an equilibrium
            that continuation from the row before or from rest would reach.
    """
    rod = problem(robot)
    gravity = np.asarray(gravity_mps2, dtype=float)
    found = equilibria(rod, load(rod, inputs, gravity), path)
    return run_of(
        model, robot, rod, inputs, gravity, found, np.abs(found.unbalanced[:, :, :3]).max(axis=(1, 2))
    )
