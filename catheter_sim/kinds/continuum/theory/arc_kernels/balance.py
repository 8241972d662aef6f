"""What the balance of a robot of arcs leaves over, and its exact derivative, compiled."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from catheter_sim.kinds.continuum.theory.arc_kernels.loads import acts, find_generalised_load
from catheter_sim.mechanics.arc_turns import arc_series
from catheter_sim.mechanics.compiled import compiled

PRE_SLIDING_M = 1e-5  # path within which a stuck tendon gives way
SHIFT_UNIT_M = 1e-3  # the base's shift is solved for in this unit, alike in size to an angle
_TURN_FLOOR_RAD = 1e-4  # smooths |b| at zero
_DIFFERENCE_RAD = 1e-6  # of the load's derivative: only Newton's speed depends on it
LOAD_SLOPE_NEAR_RAD = 0.02  # bends so near have nearly the same derivative of the loads' part


class ArcRobot(NamedTuple):
    """One robot as the loops take it; S segments, T tendons.

    Attributes:
        length: (S,) [m].
        k0, c3, c5: stiffness [N m/rad] and the law in the bend, (S,).
        rest: bends at rest, (S, 2) [rad].
        free: which bends are free, (S, 2).
        arm, chord: of the tendons, (T, S, 2) and (T, S) [m].
        stiffness, stretch: of the tendons, and by their pretension, (T,) [N/m], [m].
        at_rest: the tendons' paths in the unloaded robot, (T,) [m]; displacements count from there.
        mu: capstan coefficient.
        compliance: of the base [m/N].
        disks: number of each segment, (S,).
        weight: of each disk [N], and how far before it this acts, of a subsegment, (S, 4).
        cells, share, lead: as of `arc_equilibrium.ArcRobots`, (S,).
    """

    length: Any
    k0: Any
    c3: Any
    c5: Any
    rest: Any
    free: Any
    arm: Any
    chord: Any
    stiffness: Any
    stretch: Any
    at_rest: Any
    mu: Any
    compliance: Any
    disks: Any
    weight: Any
    cells: Any
    share: Any
    lead: Any


@compiled
def path_of_cells(bx, by, arm_x, arm_y, length, cells, share):
    """Return how much shorter a bend makes a straight tendon's path over a chain's cells, and its slopes.

    From the hole before a hinge, at (d, -a) from it, to the hole beyond, at (d, b) and turned by q: of the
    square, a^2 + b^2 + 2 d^2 - 2 (d^2 - a b) cos q - 2 d (a + b) sin q.

    Args: bend (bx, by); arm (arm_x, arm_y) [m]; length of all cells; their number; where the hinge stands.
    """
    if arm_x == 0.0 and arm_y == 0.0:  # beyond its end
        return 0.0, 0.0, 0.0
    h = length / cells
    product = share * (1.0 - share) * h * h
    u = (bx * bx + by * by) / (cells * cells)
    sine, versine, sine_slope, versine_slope, _ = arc_series(u)
    w = (arm_x * bx + arm_y * by) / cells  # d q
    m = w * w - product * u
    chord = math.sqrt(max(h * h + 2.0 * versine * m - 2.0 * h * w * sine, (1e-6 * h) ** 2))
    by_w = 4.0 * versine * w - 2.0 * h * sine
    by_u = 2.0 * versine_slope * m - 2.0 * versine * product - 2.0 * h * w * sine_slope
    slope_x = -0.5 * (by_w * arm_x + by_u * 2.0 * bx / cells) / chord
    slope_y = -0.5 * (by_w * arm_y + by_u * 2.0 * by / cells) / chord
    return cells * (h - chord), slope_x, slope_y


@compiled
def balance(x, robot, by_tension, inputs, anchor, smooth, work, state, sloped, derivative):
    """Set what the unknowns `x` (2S + 1,) leave over [rad], and its derivative; return the largest of it.

    Args: inputs: command (T,), tip force and moment (3,); anchor (T, S)
    path at which each tendon would not slip; smooth: width of stretch [m] over which a tendon becomes
    taut, 0 for at once; work: working space, its last array where the derivative of the loads' part was
    worked out, which serves near there (NaN: nowhere yet); state, set: span, slip (T, S), tension
    (T,), residual (2S + 1,); sloped: whether the derivative is wanted; derivative, set: (2S + 1, 2S + 1).
    """
    length, k0, c3, c5, rest, free, arm, chord, stiffness, pretension, at_rest, mu, compliance = robot[:13]
    count, weight = robot.disks, robot.weight
    cells, share_of, lead = robot.cells, robot.share, robot.lead
    command, tip_force, tip_moment = inputs
    span, slip, tension, residual = state
    segments, tendons = len(length), len(stiffness)
    last = 2 * segments
    arms, turning, frames, force, moved, load_slope, load_slope_at = work
    shift = x[last] * SHIFT_UNIT_M
    for i in range(last + 1):
        residual[i] = 0.0
        for j in range(last + 1 if sloped else 0):
            derivative[i, j] = 0.0

    # Turn of a tendon from the base to the middle of each segment: its cosh, sinh, and |b|.
    turn = 0.0
    for s in range(segments):
        bx, by = x[2 * s], x[2 * s + 1]
        norm = math.sqrt(bx * bx + by * by + _TURN_FLOOR_RAD * _TURN_FLOOR_RAD)
        half = 0.5 * mu * (norm - _TURN_FLOOR_RAD)
        turning[s, 0] = math.cosh(turn + half)
        turning[s, 1] = math.sinh(turn + half)
        turning[s, 2] = norm
        turn += 2.0 * half

    # Tendons: moments less what they push, in N m.
    total_tension, total_grip = 0.0, 0.0
    for t in range(tendons):
        path = 0.0
        for s in range(segments):
            bx, by, sag = x[2 * s], x[2 * s + 1], chord[t, s]
            arms[2 * s] = arm[t, s, 0] + sag * bx
            arms[2 * s + 1] = arm[t, s, 1] + sag * by
            own = arm[t, s, 0] * bx + arm[t, s, 1] * by + 0.5 * sag * (bx * bx + by * by)
            if cells[s] > 0.0:
                own, arms[2 * s], arms[2 * s + 1] = path_of_cells(
                    bx, by, arm[t, s, 0], arm[t, s, 1], length[s], cells[s], share_of[s]
                )
            slip[t, s] = min(max((own - anchor[t, s]) / PRE_SLIDING_M, -1.0), 1.0) if mu > 0.0 else 0.0
            path += own
        grip = 0.0
        if by_tension:
            pull = command[t]
        else:
            stretch = command[t] + pretension[t] + at_rest[t] - path - shift
            if smooth > 0.0:
                root = math.sqrt(stretch * stretch + smooth * smooth)
                grip = 0.5 * stiffness[t] * (1.0 + stretch / root)
                pull = 0.5 * stiffness[t] * (stretch + root)
            elif stretch > 0.0:
                grip = stiffness[t]
                pull = grip * stretch
            else:
                pull = 0.0
        tension[t] = pull
        total_tension += pull
        total_grip += grip
        for s in range(segments):
            cosh, sinh, x_slip = turning[s, 0], turning[s, 1], slip[t, s]
            share = cosh - x_slip * sinh
            span[t, s] = pull * share
            if pull == 0.0:
                continue
            ax, ay = arms[2 * s], arms[2 * s + 1]
            residual[2 * s] -= ax * pull * share
            residual[2 * s + 1] -= ay * pull * share
            if not sloped:
                continue
            derivative[2 * s, 2 * s] -= pull * share * chord[t, s]
            derivative[2 * s + 1, 2 * s + 1] -= pull * share * chord[t, s]
            if grip > 0.0:
                for j in range(segments * 2):
                    derivative[2 * s, j] += share * grip * ax * arms[j]
                    derivative[2 * s + 1, j] += share * grip * ay * arms[j]
                derivative[2 * s, last] += share * grip * ax * SHIFT_UNIT_M
                derivative[2 * s + 1, last] += share * grip * ay * SHIFT_UNIT_M
            if mu > 0.0:
                by_turn = mu * pull * (sinh - x_slip * cosh)
                for j in range(s + 1):
                    part = by_turn * (0.5 if j == s else 1.0) / turning[j, 2]
                    for a in range(2):
                        derivative[2 * s, 2 * j + a] -= ax * part * x[2 * j + a]
                        derivative[2 * s + 1, 2 * j + a] -= ay * part * x[2 * j + a]
                if abs(x_slip) < 1.0:  # a stuck tendon
                    stuck = pull * sinh / PRE_SLIDING_M
                    derivative[2 * s, 2 * s] += stuck * ax * ax
                    derivative[2 * s, 2 * s + 1] += stuck * ax * ay
                    derivative[2 * s + 1, 2 * s] += stuck * ay * ax
                    derivative[2 * s + 1, 2 * s + 1] += stuck * ay * ay
        if sloped and grip > 0.0:
            for j in range(last):
                derivative[last, j] += compliance / SHIFT_UNIT_M * grip * arms[j]

    if acts(tip_force, tip_moment, weight):
        find_generalised_load(x, length, lead, count, weight, tip_force, tip_moment, frames, force)
        near = True
        for j in range(last if sloped else 0):
            near = near and abs(x[j] - load_slope_at[j]) < LOAD_SLOPE_NEAR_RAD
        if not near:
            for j in range(last):
                load_slope_at[j] = x[j]
                x[j] += _DIFFERENCE_RAD
                find_generalised_load(x, length, lead, count, weight, tip_force, tip_moment, frames, moved)
                x[j] = load_slope_at[j]
                for i in range(last):
                    load_slope[i, j] = (moved[i] - force[i]) / _DIFFERENCE_RAD
        for i in range(last):
            residual[i] -= force[i]
            for j in range(last if sloped else 0):
                derivative[i, j] -= load_slope[i, j]

    # Elastic moments; every row over its segment's stiffness, in rad.
    largest = 0.0
    for s in range(segments):
        away_x, away_y = x[2 * s] - rest[s, 0], x[2 * s + 1] - rest[s, 1]
        square = away_x * away_x + away_y * away_y
        factor = 1.0 + square * (c3[s] + square * c5[s])
        slope = 2.0 * c3[s] + 4.0 * square * c5[s]
        for a in range(2):
            i = 2 * s + a
            away = away_x if a == 0 else away_y
            if not free[s, a]:
                residual[i] = away
                for j in range(last + 1 if sloped else 0):
                    derivative[i, j] = 1.0 if i == j else 0.0
            else:
                residual[i] = residual[i] / k0[s] + away * factor
                for j in range(last + 1 if sloped else 0):
                    derivative[i, j] /= k0[s]
                derivative[i, i] += factor
                derivative[i, 2 * s] += slope * away * away_x
                derivative[i, 2 * s + 1] += slope * away * away_y
            largest = max(largest, abs(residual[i]))

    # The base gives way under the sum of the tensions.
    residual[last] = x[last] - compliance / SHIFT_UNIT_M * total_tension
    derivative[last, last] = 1.0 + compliance * total_grip
    return max(largest, abs(residual[last]))
