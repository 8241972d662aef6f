"""Equilibrium of a tendon-driven robot whose segments bend in arcs, for many robots at once.

Unknowns of one robot: the bend vector b of each segment and the shift z of the base along -z.
With the path of tendon t in segment s shortened by d_ts(b), its stretch is
e_t = u_t + p_t/k_t - sum_s (d_ts(b) - d_ts(rest)) - z, since displacements count from the unloaded robot.
Its tension at the base T_t = k_t max(e_t, 0) (a tendon cannot push), and the balance of segment s reads

    L-averaged elastic moment(b_s) - sum_t T_ts grad d_ts = generalised load,    z = c sum_t T_t.

**Dry friction** (capstan, Coulomb). Behind a turn F the tension lies in [T e^-mu F, T e^+mu F]. For
each tendon and segment F is the turn from the base to the middle of the segment, and
T_ts = T_t (cosh mu F - x sinh mu F) with x in [-1, 1]. There x = 1 while the path shortens (the tendon is
pulled through), -1 while it grows. x follows the path like an elastic-plastic spring (backward
Euler, return mapping): x = clip(x_old + (d - d_old)/PRE_SLIDING, -1, 1), so that a stuck tendon
stays stuck and a reversal runs through the whole interval.

The generalised load is that of weights at the disks and of a force and a moment on the tip, all of
fixed direction in the base frame (virtual work). Beside a segment's elastic law may act an elastic-plastic
part (Prandtl's element, L. Prandtl, ZAMM 8, 1928). Of h times the stiffness, it carries h k0 e, where e
follows the bend as far as |e| = e_y and slips from there on, in the direction of the bend (return mapping).
The rows of a robot with friction or such a part are marched one by one. Without, a row's equilibrium does
not depend on others, unless there are several: then the one near the row before is found. Solved in
compiled loops (`arc_kernels`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.robots.continuum.arc_kernels import SHIFT_UNIT_M, solve_histories


@dataclass(frozen=True)
class ArcRobots:
    """A batch of B robots with S segments and T tendons, SI units.

    Attributes:
        length: (B, S) [m].
        bending: EI, (B, S) [N m^2].
        cubic, quintic: of the law M = EI (k + c3 k^3 + c5 k^5), (B, S) [m^2], [m^4].
        plastic: stiffness of the part that yields over the elastic one, and the bend at which it yields,
            (B, S, 2) [1], [rad].
        rest: bend vector of the unloaded robot, (B, S, 2) [rad].
        free: whether a component of the bend may differ from `rest`, (S, 2).
        arm: gradient of a tendon's path shortening by the bend, (B, T, S, 2) [m]; zero where the
            tendon does not run.
        chord: second-order shortening of a path that is straight between disks,
            d = arm b + chord |b|^2 / 2, (B, T, S) [m]; zero for a tendon held everywhere.
        cells: subsegments of a chain whose path is taken exactly, (B, S); zero: by `arm` and `chord`.
        share: where the hinge of such a subsegment stands, of its length, (B, S).
        lead: by which the arc begins above its segment's start, and disks lie below their places on it,
            (B, S) [m].
        stiffness: of each tendon, (B, T) [N/m]; finite.
        pretension: (B, T) [N].
        slack: by which tendons are too long, (B, T) [m].
        mu: friction coefficient, (B,).
        base_compliance: (B,) [m/N].
    """

    length: Array
    bending: Array
    cubic: Array
    quintic: Array
    plastic: Array
    rest: Array
    free: NDArray[np.bool_]
    arm: Array
    chord: Array
    cells: Array
    share: Array
    lead: Array
    stiffness: Array
    pretension: Array
    slack: Array
    mu: Array
    base_compliance: Array

    @property
    def shape(self) -> tuple[int, int, int]:
        """Return (B, S, T)."""
        return self.length.shape[0], self.length.shape[1], self.stiffness.shape[1]


@dataclass(frozen=True)
class ArcStates:
    """Equilibria of B robots over r rows.

    Attributes:
        bend: (B, r, S, 2) [rad].
        shift: of the base along -z, (B, r) [m].
        tension: at the base, (B, r, T) [N].
        span_tension: mean in each segment, (B, r, T, S) [N].
        residual: no unbalanced moment is larger, (B, r) [N m].
    """

    bend: Array
    shift: Array
    tension: Array
    span_tension: Array
    residual: Array


@dataclass(frozen=True)
class ArcLoads:
    """What acts on B robots of S segments over r rows, in the base frame.

    Attributes:
        disks: of each segment, equally spaced, the last at its end, (S,).
        weight: of each disk [N], and how far before it this acts, of a subsegment, (B, S, 4).
        force_tip, moment_tip: (B, r, 3) [N], [N m].
    """

    disks: NDArray[np.int64]
    weight: Array
    force_tip: Array
    moment_tip: Array


def solve_rows(
    robots: ArcRobots, commands: Array, driven_by_tension: bool, loads: ArcLoads | None = None, every: int = 1
) -> ArcStates:
    """Return the equilibria of B robots along r rows of inputs, history included.

    Args:
        robots: the batch.
        commands: tension [N] or displacement [m] of each tendon, shape (B, r, T).
        driven_by_tension: what `commands` are.
        loads: what acts, or None for nothing.
        every: only each so-many-th row is returned; the others still make the history.
    """
    batch, segments, tendons = robots.shape
    rows = commands.shape[1]
    if loads is None:
        nothing = np.zeros((batch, rows, 3))
        loads = ArcLoads(np.zeros(segments, np.int64), np.zeros((batch, segments, 4)), nothing, nothing)
    kept = len(range(0, rows, every))
    unknowns = np.empty((batch, kept, 2 * segments + 1))
    tension = np.empty((batch, kept, tendons))
    span = np.empty((batch, kept, tendons, segments))
    residual = np.empty((batch, kept))
    stiffness = robots.bending / robots.length
    numbers = (
        robots.length,
        stiffness,
        robots.cubic / robots.length**2,
        robots.quintic / robots.length**4,
        robots.rest,
        robots.arm,
        robots.chord,
        robots.stiffness,
        robots.pretension / robots.stiffness - robots.slack,
        robots.mu,
        robots.base_compliance,
        loads.weight,
        robots.cells,
        robots.share,
        robots.lead,
        robots.plastic,
    )
    inputs = (commands, loads.force_tip, loads.moment_tip)
    solve_histories(
        tuple(np.ascontiguousarray(item) for item in numbers),
        robots.free,
        loads.disks,
        driven_by_tension,
        tuple(np.ascontiguousarray(item) for item in inputs),
        every,
        (unknowns, tension, span, residual),
    )
    return ArcStates(
        bend=unknowns[..., :-1].reshape(batch, kept, segments, 2),
        shift=unknowns[..., -1] * SHIFT_UNIT_M,
        tension=tension,
        span_tension=span,
        residual=residual * stiffness.max(axis=1, keepdims=True),
    )
