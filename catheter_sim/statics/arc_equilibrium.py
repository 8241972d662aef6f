"""Equilibrium of a tendon-driven robot whose segments bend in arcs, for many robots at once.

Unknowns of one robot: the bend vector b of each segment and the shift z of the base along -z.
With the path of tendon t in segment s shortened by d_ts(b), its stretch is
e_t = u_t + p_t/k_t - sum_s d_ts - z, its tension at the base T_t = k_t max(e_t, 0) (a tendon cannot
push), and the balance of segment s reads

    L-averaged elastic moment(b_s) - sum_t T_ts grad d_ts = generalised load,    z = c sum_t T_t.

**Dry friction** (capstan, Coulomb). Behind a turn F the tension lies in [T e^-mu F, T e^+mu F]. For
each tendon and segment F is the turn from the base to the middle of the segment, and
T_ts = T_t (cosh mu F - x sinh mu F) with x in [-1, 1]: x = 1 while the path shortens (the tendon is
pulled through), -1 while it grows. x follows the path like an elastic-plastic spring (backward
Euler, return mapping): x = clip(x_old + (d - d_old)/PRE_SLIDING, -1, 1), so that a stuck tendon
stays stuck and a reversal runs through the whole interval.

The rows of a history are marched one by one, all robots of a batch at once; without friction all
rows are solved at once. Newton's method with the exact derivative (semi-smooth: slack and slip
switch), steps halved where they make it worse.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PRE_SLIDING_M = 1e-5  # path within which a stuck tendon gives way
_TURN_FLOOR_RAD = 1e-4  # smooths |b| at zero
_TOLERANCE_RAD = 1e-7
_MAX_ITERATIONS = 60
_ROUND = 2  # Newton steps after which the rows that balance are set aside

# bend (m, s, 2) -> generalised load (m, 2s) [N m] and its derivative (m, 2s, 2s)
Load = Callable[[Array], tuple[Array, Array]]
# (robot of each problem (m,), row of each problem (m,)) -> their load
LoadOf = Callable[[NDArray[np.intp], NDArray[np.intp]], Load]


@dataclass(frozen=True)
class ArcRobots:
    """A batch of B robots with S segments and T tendons, SI units.

    Attributes:
        length: (B, S) [m].
        bending: EI, (B, S) [N m^2].
        cubic, quintic: of the law M = EI (k + c3 k^3 + c5 k^5), (B, S) [m^2], [m^4].
        rest: bend vector of the unloaded robot, (B, S, 2) [rad].
        free: whether a component of the bend may differ from `rest`, (S, 2).
        arm: gradient of a tendon's path shortening by the bend, (B, T, S, 2) [m]; zero where the
            tendon does not run.
        chord: second-order shortening of a path that is straight between disks,
            d = arm b + chord |b|^2 / 2, (B, T, S) [m]; zero for a tendon held everywhere.
        stiffness: of each tendon, (B, T) [N/m]; finite.
        pretension: (B, T) [N].
        mu: friction coefficient, (B,).
        base_compliance: (B,) [m/N].
    """

    length: Array
    bending: Array
    cubic: Array
    quintic: Array
    rest: Array
    free: NDArray[np.bool_]
    arm: Array
    chord: Array
    stiffness: Array
    pretension: Array
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
        residual: largest unbalanced moment, (B, r) [N m].
    """

    bend: Array
    shift: Array
    tension: Array
    span_tension: Array
    residual: Array


def take(robots: ArcRobots, index: NDArray[np.intp]) -> ArcRobots:
    """Return the robots at `index` (repeats allowed) as a batch of their own."""
    values = {name: (value if name == "free" else value[index]) for name, value in vars(robots).items()}
    return ArcRobots(**values)


@dataclass
class _Balance:
    """One evaluation: residual (scaled to rad), its derivative, and what the caller may want."""

    residual: Array  # (m, n)
    derivative: Array  # (m, n, n)
    path: Array  # (m, T, S)
    slip: Array  # (m, T, S), x in [-1, 1]
    tension: Array  # (m, T)
    span_tension: Array  # (m, T, S)


_SHIFT_UNIT_M = 1e-3  # the base's shift is solved for in this unit, alike in size to an angle


class _Equations:
    """The balance of a batch with what does not change from row to row worked out beforehand."""

    def __init__(self, robots: ArcRobots, driven_by_tension: bool, load: Load | None) -> None:
        self.robots = robots
        self.by_tension = driven_by_tension
        self.load = load
        batch, segments, tendons = robots.shape
        self.size = 2 * segments + 1
        self.segments = segments
        self.tendons = tendons
        self.k0 = robots.bending / robots.length  # (m, S) [N m/rad]
        self.c3 = robots.cubic / robots.length**2
        self.c5 = robots.quintic / robots.length**4
        self.stretch0 = robots.pretension / robots.stiffness
        self.arms = robots.arm.reshape(batch, tendons, 2 * segments)
        self.has_chord = bool(robots.chord.any())
        self.has_friction = bool(robots.mu.any())
        self.has_law = bool(robots.cubic.any() or robots.quintic.any())
        self.mu = robots.mu[:, None]
        # turn from the base to the middle of a segment: every segment before it, and half of it
        self.before = np.tril(np.ones((segments, segments)), -1) + 0.5 * np.eye(segments)
        self.blocked = ~robots.free.reshape(-1)
        self.rest = robots.rest.reshape(batch, 2 * segments)
        self.diagonal = np.arange(2 * segments)
        self.row_scale = np.repeat(1.0 / self.k0, 2, axis=1)

    def evaluate(self, x: Array, command: Array, anchor: Array) -> _Balance:
        """Return the balance at the unknowns `x` (m, n), inputs (m, T), path anchors (m, T, S)."""
        robots = self.robots
        count, n, s2 = len(x), self.size, self.size - 1
        flat = x[:, :s2]
        bend = flat.reshape(count, self.segments, 2)
        shift = x[:, s2:] * _SHIFT_UNIT_M
        products = self.arms * flat[:, None, :]
        path = products.reshape(count, self.tendons, self.segments, 2).sum(axis=3)
        if self.has_chord:
            path = path + 0.5 * robots.chord * (bend * bend).sum(axis=2)[:, None, :]
            arms = self.arms + np.repeat(robots.chord, 2, axis=2) * flat[:, None, :]
        else:
            arms = self.arms
        if self.by_tension:
            tension = command
            grip = np.zeros_like(command)
        else:
            stretch = command + self.stretch0 - path.sum(axis=2) - shift
            grip = np.where(stretch > 0.0, robots.stiffness, 0.0)
            tension = grip * stretch

        # Elastic moments, in rad (divided by k0).
        away = flat - self.rest
        derivative = np.zeros((count, n, n))
        residual = np.empty((count, n))
        residual[:, :s2] = away
        derivative[:, self.diagonal, self.diagonal] = 1.0
        if self.has_law:
            by_segment = away.reshape(bend.shape)
            square = (by_segment * by_segment).sum(axis=2)
            factor = 1.0 + square * (self.c3 + square * self.c5)
            slope = 2.0 * self.c3 + 4.0 * square * self.c5
            residual[:, :s2] = away * np.repeat(factor, 2, axis=1)
            derivative[:, self.diagonal, self.diagonal] = np.repeat(factor, 2, axis=1)
            for s in range(self.segments):
                part = by_segment[:, s]
                derivative[:, 2 * s : 2 * s + 2, 2 * s : 2 * s + 2] += (
                    slope[:, s, None, None] * part[:, :, None] * part[:, None, :]
                )

        # Tendons.
        if self.has_friction:
            norm = np.sqrt((bend * bend).sum(axis=2) + _TURN_FLOOR_RAD**2)
            turn = self.mu * ((norm - _TURN_FLOOR_RAD) @ self.before.T)
            sinh, cosh = np.sinh(turn), np.cosh(turn)
            trial = (path - anchor) / PRE_SLIDING_M
            slip = np.clip(trial, -1.0, 1.0)
            factor_ts = cosh[:, None, :] - slip * sinh[:, None, :]
            span = tension[:, :, None] * factor_ts
            scaled = arms * (np.repeat(factor_ts, 2, axis=2) * grip[:, :, None])
            push = (arms * np.repeat(span, 2, axis=2)).sum(axis=1)
            jacobian = scaled.transpose(0, 2, 1) @ arms
            # through the turn
            weight = tension[:, :, None] * (sinh[:, None, :] - slip * cosh[:, None, :])
            by_turn = (arms * np.repeat(weight, 2, axis=2)).sum(axis=1) * self.mu
            direction = (bend / norm[:, :, None]).reshape(count, s2)
            spread = np.repeat(np.repeat(self.before, 2, axis=0), 2, axis=1)
            jacobian -= by_turn[:, :, None] * direction[:, None, :] * spread
            # through the stuck tendons
            stuck = np.where(np.abs(trial) < 1.0, tension[:, :, None] * sinh[:, None, :] / PRE_SLIDING_M, 0.0)
            if stuck.any():
                for s in range(self.segments):
                    part = arms[:, :, 2 * s : 2 * s + 2]
                    jacobian[:, 2 * s : 2 * s + 2, 2 * s : 2 * s + 2] += (
                        part * stuck[:, :, s, None]
                    ).transpose(0, 2, 1) @ part
        else:
            slip = np.zeros_like(path)
            span = np.repeat(tension[:, :, None], self.segments, axis=2)
            scaled = arms * grip[:, :, None]
            push = (tension[:, None, :] @ arms)[:, 0, :]
            jacobian = scaled.transpose(0, 2, 1) @ arms
        if self.has_chord:
            sag = np.repeat((span * robots.chord).sum(axis=1), 2, axis=1)
            jacobian[:, self.diagonal, self.diagonal] -= sag
        if self.load is not None:
            force, slope_of_load = self.load(bend)
            push = push + force
            jacobian = jacobian - slope_of_load
        residual[:, :s2] -= push * self.row_scale
        derivative[:, :s2, :s2] += jacobian * self.row_scale[:, :, None]
        derivative[:, :s2, s2] = scaled.sum(axis=1) * (self.row_scale * _SHIFT_UNIT_M)

        # The base gives way under the sum of the tensions.
        compliance = robots.base_compliance / _SHIFT_UNIT_M
        residual[:, s2] = x[:, s2] - compliance * tension.sum(axis=1)
        derivative[:, s2, s2] = 1.0 + compliance * _SHIFT_UNIT_M * grip.sum(axis=1)
        derivative[:, s2, :s2] = compliance[:, None] * (grip[:, :, None] * arms).sum(axis=1)
        if self.blocked.any():
            rows = self.diagonal[self.blocked]
            residual[:, rows] = away[:, rows]
            derivative[:, rows, :] = 0.0
            derivative[:, rows, rows] = 1.0
        return _Balance(residual, derivative, path, slip, tension, span)

    def solve(
        self, start: Array, command: Array, anchor: Array, most: int = _MAX_ITERATIONS
    ) -> tuple[Array, _Balance]:
        """Return the equilibrium next to `start` (after at most `most` steps), and the balance there."""
        x = start
        now = self.evaluate(x, command, anchor)
        norm = np.abs(now.residual).max(axis=1)
        for _ in range(most):
            if not (norm > _TOLERANCE_RAD).any():
                break
            step = np.linalg.solve(now.derivative, -now.residual[:, :, None])[:, :, 0]
            share = np.ones((len(x), 1))
            for attempt in range(7):
                candidate = x + share * step
                balance = self.evaluate(candidate, command, anchor)
                size = np.abs(balance.residual).max(axis=1)
                worse = size > np.maximum(norm, _TOLERANCE_RAD)
                if attempt == 6 or not worse.any():
                    break
                share[worse] *= 0.4
            x, now, norm = candidate, balance, size
        return x, now


def solve_rows(
    robots: ArcRobots,
    commands: Array,
    driven_by_tension: bool,
    load: LoadOf | None = None,
) -> ArcStates:
    """Return the equilibria of B robots along r rows of inputs, history included.

    Args:
        robots: the batch.
        commands: tension [N] or displacement [m] of each tendon, shape (B, r, T).
        driven_by_tension: what `commands` are.
        load: the generalised load of each robot at each row, or None for no load.
    """
    rows = commands.shape[1]
    if robots.mu.any():
        return _march(robots, commands, driven_by_tension, load)
    return _all_rows(robots, commands, driven_by_tension, load, None, rows)


def _march(robots: ArcRobots, commands: Array, driven_by_tension: bool, load: LoadOf | None) -> ArcStates:
    batch, segments, tendons = robots.shape
    rows = commands.shape[1]
    x = np.zeros((batch, 2 * segments + 1))
    x[:, :-1] = robots.rest.reshape(batch, -1)
    xs = np.empty((batch, rows, x.shape[1]))
    tension = np.empty((batch, rows, tendons))
    span = np.empty((batch, rows, tendons, segments))
    residual = np.empty((batch, rows))
    equations = _Equations(robots, driven_by_tension, None)
    k0 = equations.k0.max(axis=1)
    anchor = equations.evaluate(x, commands[:, 0], np.zeros((batch, tendons, segments))).path
    before = x
    for row in range(rows):
        if load is not None:
            equations.load = load(np.arange(batch), np.full(batch, row))
        guess = x if row < 2 else x + 0.5 * (x - before)
        new, balance = equations.solve(guess, commands[:, row], anchor)
        before, x = x, new
        anchor = balance.path - PRE_SLIDING_M * balance.slip
        xs[:, row], tension[:, row], span[:, row] = x, balance.tension, balance.span_tension
        residual[:, row] = np.abs(balance.residual[:, :-1]).max(axis=1) * k0
    return _states(xs, tension, span, residual, segments)


def _all_rows(
    robots: ArcRobots,
    commands: Array,
    driven_by_tension: bool,
    load: LoadOf | None,
    start: Array | None,
    rows: int,
) -> ArcStates:
    batch, segments, tendons = robots.shape
    if start is None and batch > 1:
        # Robots of a batch are alike: the first one's bends are a good start for the others.
        one = _all_rows(take(robots, np.zeros(1, np.intp)), commands[:1], driven_by_tension, load, None, rows)
        first = np.concatenate([one.bend.reshape(1, rows, -1), one.shift[:, :, None] / _SHIFT_UNIT_M], axis=2)
        start = np.broadcast_to(first, (batch, *first.shape[1:]))
    robot = np.repeat(np.arange(batch), rows)
    row = np.tile(np.arange(rows), batch)
    command = commands.reshape(batch * rows, tendons)
    x = np.zeros((batch * rows, 2 * segments + 1))
    if start is None:
        x[:, :-1] = robots.rest[robot].reshape(batch * rows, -1)
    else:
        x[:] = start.reshape(batch * rows, -1)
    tension = np.empty((batch * rows, tendons))
    span = np.empty((batch * rows, tendons, segments))
    residual = np.empty(batch * rows)
    left = np.arange(batch * rows)
    for attempt in range(_MAX_ITERATIONS // _ROUND):
        equations = _Equations(
            take(robots, robot[left]),
            driven_by_tension,
            load(robot[left], row[left]) if load is not None else None,
        )
        anchor = np.zeros((len(left), tendons, segments))
        x[left], balance = equations.solve(x[left], command[left], anchor, _ROUND * (1 + attempt))
        unbalanced = np.abs(balance.residual).max(axis=1)
        tension[left], span[left] = balance.tension, balance.span_tension
        residual[left] = np.abs(balance.residual[:, :-1]).max(axis=1) * equations.k0.max(axis=1)
        left = left[unbalanced > _TOLERANCE_RAD]
        if len(left) == 0:
            break
    return _states(
        x.reshape(batch, rows, -1),
        tension.reshape(batch, rows, tendons),
        span.reshape(batch, rows, tendons, segments),
        residual.reshape(batch, rows),
        segments,
    )


def _states(xs: Array, tension: Array, span: Array, residual: Array, segments: int) -> ArcStates:
    return ArcStates(
        bend=xs[..., :-1].reshape(*xs.shape[:2], segments, 2),
        shift=xs[..., -1] * _SHIFT_UNIT_M,
        tension=tension,
        span_tension=span,
        residual=residual,
    )
