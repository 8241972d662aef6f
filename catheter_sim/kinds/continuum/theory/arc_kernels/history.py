"""Equilibria of robots of arcs along their inputs, compiled.

A row is sought from the balances of the rows before it; without friction these decide nothing but which
balance is found where there are several. Where Newton's method finds no balance, inputs and loads are
brought on step by step: with friction from the row before, without from the robot at rest. Robots solved
together are alike: where the first one has no balance in a row, the others' is sought briefly.
"""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.kinds.continuum.theory.arc_kernels.balance import PRE_SLIDING_M, ArcRobot, path_of_cells
from catheter_sim.kinds.continuum.theory.arc_kernels.newton import (
    TOLERANCE_RAD,
    find_beside,
    find_equilibrium,
)
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.linear import factorise
from catheter_sim.mechanics.vectors import copy

_SHORTEST_WAY = 1.0 / 64.0  # of what changes from one row to the next
_HASH_RATIO = 1.6180339887  # any number that makes unlike sums of unlike rows
_MOST_SOUGHT = 2  # rows without balance of a robot, after which the others are sought at once only


@compiled
def _anchored(x, robot, slip, anchor):
    """Set `anchor` (T, S) to the paths at which tendons that have `slip` at `x` would have none."""
    arm, chord = robot.arm, robot.chord
    for t in range(anchor.shape[0]):
        for s in range(anchor.shape[1]):
            bx, by = x[2 * s], x[2 * s + 1]
            path = arm[t, s, 0] * bx + arm[t, s, 1] * by + 0.5 * chord[t, s] * (bx * bx + by * by)
            if robot.cells[s] > 0.0:
                path, _, _ = path_of_cells(
                    bx, by, arm[t, s, 0], arm[t, s, 1], robot.length[s], robot.cells[s], robot.share[s]
                )
            anchor[t, s] = path - PRE_SLIDING_M * slip[t, s]


@compiled
def _followed(
    x, guess, robot, by_tension, begin, end, shortest, patient, anchor, between, work, newton, state
):
    """Move `x`, in balance at `begin`, to the balance at `end`; return what is left over there [rad].

    At once from `guess` or, where that ends in no balance, by ways not shorter than `shortest`.

    Args: begin, end: command (T,), tip force and moment (3,), and the share of weight and pretension that
    acts; patient: as for `find_equilibrium`; between: space for the same and for pretension and weight.
    """
    stretch, weight = robot.stretch, robot.weight
    command, tip_force, tip_moment, pretension, weighing, kept = between
    copy(x, kept)
    copy(guess, x)
    reached, way, size = 0.0, 1.0, 0.0
    while reached < 1.0:
        place = min(reached + way, 1.0)
        for i in range(len(command)):
            command[i] = begin[0][i] + place * (end[0][i] - begin[0][i])
        for i in range(3):
            tip_force[i] = begin[1][i] + place * (end[1][i] - begin[1][i])
            tip_moment[i] = begin[2][i] + place * (end[2][i] - begin[2][i])
        share = begin[3] + place * (1.0 - begin[3])
        for i in range(len(stretch)):
            pretension[i] = share * stretch[i]
        for s in range(len(weight)):
            for i in range(3):
                weighing[s, i] = share * weight[s, i]
            weighing[s, 3] = weight[s, 3]
        there = ArcRobot(
            robot.length, robot.k0, robot.c3, robot.c5, robot.rest, robot.free, robot.arm, robot.chord,
            robot.stiffness, pretension, robot.at_rest, robot.mu, robot.compliance, robot.disks, weighing,
            robot.cells, robot.share, robot.lead,
        )  # fmt: skip
        size = find_equilibrium(
            x, there, by_tension, (command, tip_force, tip_moment), anchor, patient, work, newton, state
        )
        if size <= TOLERANCE_RAD:
            reached = place
            way *= 2.0
            copy(x, kept)
            if robot.mu > 0.0 and reached < 1.0:
                _anchored(x, robot, state[1], anchor)
        else:
            way *= 0.25 if way == 1.0 else 0.5
            if way < shortest:
                break
            copy(kept, x)
    return size


@compiled
def _same_before(command, tip_force, tip_moment, row, table):
    """Return the first row with the same inputs as `row`, itself where none of those asked for before is it.

    Args: table: rows asked for by what their inputs hash to, -1 where none; a power of two more than there
    are rows.
    """
    total, weight = 0.0, 1.0
    for i in range(command.shape[1]):
        weight *= _HASH_RATIO
        total += weight * command[row, i]
    for i in range(3):
        total += weight * ((i + 2.0) * tip_force[row, i] + (i + 5.0) * tip_moment[row, i])
    place = hash(total) & (len(table) - 1)
    while table[place] >= 0:
        other = table[place]
        same = True
        for i in range(command.shape[1]):
            if command[other, i] != command[row, i]:
                same = False
                break
        for i in range(3 if same else 0):
            same = same and tip_force[other, i] == tip_force[row, i]
            same = same and tip_moment[other, i] == tip_moment[row, i]
        if same:
            return other
        place = (place + 1) & (len(table) - 1)
    table[place] = row
    return row


@compiled
def solve_histories(robots, free, disks, by_tension, inputs, every, results):
    """Set `results` to the equilibria of B robots at each `every`-th of r rows, see `arc_equilibrium`.

    Args:
        robots: length (B, S), stiffness k0 [N m/rad] and c3, c5 of the law in the bend (B, S), rest
            (B, S, 2), arm (B, T, S, 2), chord (B, T, S), tendons' stiffness and stretch by their
            pretension (B, T), mu, base compliance (B,), weight of each disk (B, S, 4), cells, share and lead
            (B, S).
        free: which bends are free, (S, 2).
        disks: of each segment, (S,).
        by_tension: what the commands are.
        inputs: commands (B, r, T), tip force and moment (B, r, 3).
        every: which rows are wanted; those of robots with friction are marched through all the same.
        results: unknowns (B, n, 2S + 1), tension (B, n, T), span (B, n, T, S), residual (B, n) [rad].
    """
    lengths, k0s, c3s, c5s, rests, arms, chords, stiffnesses, stretches, mus = robots[:10]
    compliances, weights, cells, shares, leads = robots[10:]
    commands, tip_forces, tip_moments = inputs
    unknowns, tensions, spans, residuals = results
    batch, rows, tendons = commands.shape
    segments = lengths.shape[1]
    n = 2 * segments + 1
    work = (
        np.empty(n),
        np.empty((segments, 3)),
        np.empty((segments + 1, 3, 3)),
        np.empty(n),
        np.empty(n),
        np.empty((n - 1, n - 1)),
        np.empty(n - 1),
    )
    newton = (np.empty((n, n)), np.empty(n), np.empty(n), np.empty(n))
    span, slip = np.empty((tendons, segments)), np.zeros((tendons, segments))
    tension, residual = np.empty(tendons), np.empty(n)
    state = (span, slip, tension, residual)
    between = (
        np.empty(tendons), np.empty(3), np.empty(3), np.empty(tendons), np.empty((segments, 4)), np.empty(n)
    )  # fmt: skip
    guess, at_rest, before, now = np.empty(n), np.zeros(n), np.empty(n), np.empty(n)
    tried = np.empty(n)
    # Of the first robot: where it is in balance, and the derivative there, factorised.
    firsts, balanced = np.empty((rows, n)), np.zeros(rows, np.bool_)
    slopes = np.empty((rows if batch > 1 else 0, n, n))
    exchanged = np.empty((len(slopes), n), np.int64)
    sloped = np.zeros(rows, np.bool_)
    anchor, path_at_rest = np.empty((tendons, segments)), np.empty(tendons)
    table = np.empty(2 ** math.ceil(math.log2(rows + 1) + 1), np.int64)
    nothing = (np.zeros(tendons), np.zeros(3), np.zeros(3), 0.0)
    for b in range(batch):
        robot = ArcRobot(
            lengths[b], k0s[b], c3s[b], c5s[b], rests[b], free, arms[b], chords[b], stiffnesses[b],
            stretches[b], path_at_rest, mus[b], compliances[b], disks, weights[b], cells[b], shares[b],
            leads[b],
        )  # fmt: skip
        for s in range(segments):
            at_rest[2 * s], at_rest[2 * s + 1] = rests[b, s, 0], rests[b, s, 1]
        copy(at_rest, now)
        copy(at_rest, before)
        for t in range(tendons):
            for s in range(segments):
                slip[t, s] = 0.0
        _anchored(at_rest, robot, slip, anchor)
        for t in range(tendons):
            path_at_rest[t] = anchor[t].sum()
        table[:] = -1
        rough = mus[b] > 0.0
        begin, lost = nothing, 0
        for row in range(0, rows, 1 if rough else every):
            known = row
            if not rough:
                known = _same_before(commands[b], tip_forces[b], tip_moments[b], row, table)
            if known < row and residuals[b, known // every] <= TOLERANCE_RAD:
                if b == 0:
                    copy(firsts[known], firsts[row])
                    balanced[row] = True
                    if sloped[known]:
                        for i in range(n):
                            copy(slopes[known, i], slopes[row, i])
                            exchanged[row, i] = exchanged[known, i]
                        sloped[row] = True
                old, place = known // every, row // every
                copy(unknowns[b, old], now)
                copy(unknowns[b, old], unknowns[b, place])
                copy(tensions[b, old], tensions[b, place])
                for t in range(tendons):
                    copy(spans[b, old, t], spans[b, place, t])
                residuals[b, place] = residuals[b, old]
                continue
            end = (commands[b, row], tip_forces[b, row], tip_moments[b, row], 1.0)
            last = row - (1 if rough else every)
            if b > 0 and last >= 0 and balanced[last] and balanced[row]:  # it moves as the first one did
                for i in range(n):
                    guess[i] = now[i] + firsts[row, i] - firsts[last, i]
            else:
                for i in range(n):
                    guess[i] = now[i] + 0.5 * (now[i] - before[i]) if row > 1 and rough else now[i]
            if not rough:
                copy(at_rest, now)
            copy(now, before)
            hoped = b == 0 or balanced[row]
            shortest = _SHORTEST_WAY if hoped and lost < _MOST_SOUGHT else 1.0
            size = math.inf
            if b > 0 and sloped[row]:
                copy(guess, tried)
                size = find_beside(
                    tried, robot, by_tension, end[:3], anchor, slopes[row], exchanged[row], work, newton,
                    state,
                )  # fmt: skip
            if size <= TOLERANCE_RAD:
                copy(tried, now)
            else:
                size = _followed(
                    now, guess, robot, by_tension, begin, end, shortest, hoped,
                    anchor, between, work, newton, state,
                )  # fmt: skip
            lost += 1 if size > TOLERANCE_RAD else 0
            if rough:
                _anchored(now, robot, slip, anchor)
                begin = end
            if b == 0:
                copy(now, firsts[row])
                balanced[row] = size <= TOLERANCE_RAD
                if balanced[row] and batch > 1:
                    for i in range(n):
                        copy(newton[0][i], slopes[row, i])
                    sloped[row] = factorise(slopes[row], exchanged[row])
            if row % every == 0:
                place = row // every
                copy(now, unknowns[b, place])
                copy(tension, tensions[b, place])
                for t in range(tendons):
                    copy(span[t], spans[b, place, t])
                residuals[b, place] = size
