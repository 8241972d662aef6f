"""Robots of arcs, compiled: loads, balance with its derivative, Newton's method, way along inputs."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from catheter_sim.mechanics.arcs import arc_series, turn_by_arc
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.vectors import copy, factorise, fill, solve_factorised, solve_vector

# ----------------------------------------------------------------------------------------------------
# The generalised loads of a robot of arcs, compiled.
#
# The generalised load of segment s follows from what its end carries, force F and moment M, and from the
# weights on it: with its end at q(b) and turned by R(b) in the frame of its start, component a of it is
#
# F . dq/db_a + M . w_a + sum over disks of weight . dq_k/db_a, hat(w_a) = dR/db_a R^T.


@compiled
def _along_arc(bend_x, bend_y, length, lead, share, force):
    """Return where a point at `share` of an arc is, (3,), and its work on `force` by the bend, (2,).

    The arc begins after a straight `lead`, and the point lies as far before its place on it.
    """
    x, y, reach = share * bend_x, share * bend_y, share * length
    sine, versine, sine_slope, versine_slope, _ = arc_series(x * x + y * y)
    along = 2.0 * (versine_slope * (x * force[0] + y * force[1]) + sine_slope * force[2])
    if lead != 0.0:
        u = x * x + y * y
        turned = 2.0 * (sine_slope * (x * force[0] + y * force[1]) - (versine + u * versine_slope) * force[2])
        return (
            (reach * versine - lead * sine) * x,
            (reach * versine - lead * sine) * y,
            reach * sine + lead * versine * u,
            share * (reach * (versine * force[0] + along * x) - lead * (sine * force[0] + turned * x)),
            share * (reach * (versine * force[1] + along * y) - lead * (sine * force[1] + turned * y)),
        )
    return (
        reach * versine * x,
        reach * versine * y,
        reach * sine,
        share * reach * (versine * force[0] + along * x),
        share * reach * (versine * force[1] + along * y),
    )


@compiled
def find_generalised_load(bend, length, lead, count, weight, tip_force, tip_moment, frames, out):
    """Set `out` (2S,) to the power of the loads per rate of each bend component [N m].

    - bend (2S,), length and lead (S,), count (S,) of disks.
    - weight (S, 4) of each disk, and how far before the disk it acts, of a subsegment.
    - tip_force, tip_moment (3,), frames (S + 1, 3, 3) working space.
    """
    segments = len(length)
    for i in range(3):
        for j in range(3):
            frames[0, i, j] = 1.0 if i == j else 0.0
    for s in range(segments):
        x, y = bend[2 * s], bend[2 * s + 1]
        sine, versine, _, _, _ = arc_series(x * x + y * y)
        turn_by_arc(x, y, sine, versine, frames[s], frames[s + 1])
    fx, fy, fz = tip_force
    mx, my, mz = tip_moment
    for s in range(segments - 1, -1, -1):
        x, y = bend[2 * s], bend[2 * s + 1]
        R = frames[s]
        force = (
            R[0, 0] * fx + R[1, 0] * fy + R[2, 0] * fz,
            R[0, 1] * fx + R[1, 1] * fy + R[2, 1] * fz,
            R[0, 2] * fx + R[1, 2] * fy + R[2, 2] * fz,
        )
        m0 = R[0, 0] * mx + R[1, 0] * my + R[2, 0] * mz
        m1 = R[0, 1] * mx + R[1, 1] * my + R[2, 1] * mz
        m2 = R[0, 2] * mx + R[1, 2] * my + R[2, 2] * mz
        px, py, pz, qx, qy = _along_arc(x, y, length[s], lead[s], 1.0, force)
        # The end turns by w_a = J e_a, J = 1 + versine [r] + third [r]^2, r = (-y, x, 0).
        _, versine, _, _, third = arc_series(x * x + y * y)
        qx += m1 * (1.0 - third * y * y) - third * x * y * m0 - versine * y * m2
        qy += third * x * y * m1 - m0 * (1.0 - third * x * x) + versine * x * m2
        # what the start of the segment carries, in its frame
        m0 += py * force[2] - pz * force[1]
        m1 += pz * force[0] - px * force[2]
        m2 += px * force[1] - py * force[0]
        wx, wy, wz = weight[s, 0], weight[s, 1], weight[s, 2]
        if wx != 0.0 or wy != 0.0 or wz != 0.0:
            own = (
                R[0, 0] * wx + R[1, 0] * wy + R[2, 0] * wz,
                R[0, 1] * wx + R[1, 1] * wy + R[2, 1] * wz,
                R[0, 2] * wx + R[1, 2] * wy + R[2, 2] * wz,
            )
            for disk in range(count[s]):
                place = (disk + 1.0 - weight[s, 3]) / count[s]
                back = lead[s] if weight[s, 3] == 0.0 else 0.0  # a disk; the rest stands on the arc
                px, py, pz, dx, dy = _along_arc(x, y, length[s], back, place, own)
                pz += lead[s] - back
                qx += dx
                qy += dy
                m0 += py * own[2] - pz * own[1]
                m1 += pz * own[0] - px * own[2]
                m2 += px * own[1] - py * own[0]
            fx, fy, fz = fx + count[s] * wx, fy + count[s] * wy, fz + count[s] * wz
        mx = R[0, 0] * m0 + R[0, 1] * m1 + R[0, 2] * m2
        my = R[1, 0] * m0 + R[1, 1] * m1 + R[1, 2] * m2
        mz = R[2, 0] * m0 + R[2, 1] * m1 + R[2, 2] * m2
        out[2 * s], out[2 * s + 1] = qx, qy


@compiled
def acts(tip_force, tip_moment, weight):
    """Return whether anything acts: tip force and moment (3,), weights (S, 4)."""
    for i in range(3):
        if tip_force[i] != 0.0 or tip_moment[i] != 0.0:
            return True
        for s in range(weight.shape[0]):
            if weight[s, i] != 0.0:
                return True
    return False


# ----------------------------------------------------------------------------------------------------
# What the balance of a robot of arcs leaves over, and its exact derivative, compiled.

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
        plastic: the same, (S, 2).
        held, stood: the elastic bend of the part that yields in the balance before, and the segment's bend
            from rest, (S, 2) [rad].
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
    plastic: Any
    held: Any
    stood: Any


@compiled
def path_of_cells(bx, by, arm_x, arm_y, length, cells, share):
    """Return how much shorter a bend makes a straight tendon's path over a chain's cells, and its slopes.

    From the hole before a hinge, at (d, -a) from it, to the hole beyond, at (d, b) and turned by q. Of the
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
def _carried(robot, s, away_x, away_y):
    """Return the elastic bend of the part of segment `s` that yields, with the segment bent to `away` (2,).

    From where it was left the segment bends on straight. The part follows as far as it yields; then what it
    carries turns toward the way w: of the angle p between, dp/dw = -sin(p) / e_y (Krieg and Krieg 1977, the
    exact law of perfect plasticity along a straight way).
    """
    most, ex, ey = robot.plastic[s, 1], robot.held[s, 0], robot.held[s, 1]
    dx, dy = away_x - robot.stood[s, 0], away_y - robot.stood[s, 1]
    x, y = ex + dx, ey + dy
    way = math.sqrt(dx * dx + dy * dy)
    if x * x + y * y <= most * most or way == 0.0:
        return x, y
    ux, uy = dx / way, dy / way
    along, across = ex * ux + ey * uy, ux * ey - uy * ex
    across = min(max(across, -most), most)
    reached = math.sqrt(most * most - across * across)  # along the way, where it yields
    angle = 2.0 * math.atan(across / (most + reached) * math.exp(-(way - (reached - along)) / most))
    cosine, sine = most * math.cos(angle), most * math.sin(angle)
    return ux * cosine - uy * sine, uy * cosine + ux * sine


@compiled
def _add_plastic(robot, s, away_x, away_y, residual, derivative):
    """Add what the part of segment `s` that yields carries [rad], and its derivative, by differences."""
    share, i = robot.plastic[s, 0], 2 * s
    x, y = _carried(robot, s, away_x, away_y)
    residual[i] += share * x
    residual[i + 1] += share * y
    for a in range(2):
        step_x, step_y = (_DIFFERENCE_RAD, 0.0) if a == 0 else (0.0, _DIFFERENCE_RAD)
        moved_x, moved_y = _carried(robot, s, away_x + step_x, away_y + step_y)
        derivative[i, i + a] += share * (moved_x - x) / _DIFFERENCE_RAD
        derivative[i + 1, i + a] += share * (moved_y - y) / _DIFFERENCE_RAD


@compiled
def let_slip(x, robot):
    """Let the parts that yield stand where they are at the bends `x`."""
    for s in range(len(robot.length)):
        if robot.plastic[s, 0] > 0.0:
            away_x, away_y = x[2 * s] - robot.rest[s, 0], x[2 * s + 1] - robot.rest[s, 1]
            held = _carried(robot, s, away_x, away_y)
            robot.held[s, 0], robot.held[s, 1] = held
            robot.stood[s, 0], robot.stood[s, 1] = away_x, away_y


@compiled
def balance(x, robot, by_tension, inputs, anchor, smooth, work, state, sloped, derivative):
    """Set what the unknowns `x` (2S + 1,) leave over [rad], and its derivative; return the largest of it.

    - inputs: command (T,), tip force and moment (3,).
    - anchor (T, S): path at which each tendon would not slip.
    - smooth: width of stretch [m] over which a tendon becomes taut, 0 for at once.
    - work: working space, its last array where the derivative of the loads' part was worked out, which
      serves near there (NaN: nowhere yet).
    - state, set: span, slip (T, S), tension (T,), residual (2S + 1,).
    - sloped: whether the derivative is wanted.
    - derivative, set: (2S + 1, 2S + 1).
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
        if robot.plastic[s, 0] > 0.0:
            _add_plastic(robot, s, away_x, away_y, residual, derivative)
        for i in range(2 * s, 2 * s + 2):
            largest = max(largest, abs(residual[i]))

    # The base gives way under the sum of the tensions.
    residual[last] = x[last] - compliance / SHIFT_UNIT_M * total_tension
    derivative[last, last] = 1.0 + compliance * total_grip
    return max(largest, abs(residual[last]))


# ----------------------------------------------------------------------------------------------------
# Newton's method for a robot of arcs, compiled.
#
# It is semi-smooth (slack and slip switch) and damped where a step would make the balance worse. Where it
# ends in no balance, it starts again with tendons that become taut little by little.

TOLERANCE_RAD = 1e-10  # unbalanced moment over the segment's stiffness
# Where Newton's method fails at once, tendons become taut over a stretch narrowed from round to round.
_WIDEST_M, _NARROWEST_M, _NARROWER = 1e-3, 1e-8, 0.2
_ROUGH_RAD = 1e-2  # good enough for such a round
_MOST, _MOST_AT_ONCE = 60, 20  # evaluations of a round, and of the attempt at once
_DAMPINGS = 6
_WORSE_STEPS = 3  # taken at the most damping and worse all the same: there is no balance this way
_DAMPING = 0.4
_LARGEST_STEP_RAD = 1.0
_SMALLEST_PIVOT = 1e-14
_LEFT_OVER = 0.3  # of the unbalance by a step with a like robot's derivative; with more, Newton's is quicker


@compiled
def _newton(x, robot, by_tension, inputs, anchor, smooth, tolerance, most, work, newton, state):
    """Move `x` to the balance next to it by Newton's method; return what is left over there [rad].

    It ends below `tolerance`, after `most` evaluations, or where it leads nowhere.
    """
    derivative, step, tried, _ = newton
    copy(x, tried)
    fill(work[6], math.nan)
    allowed, share, damped, evaluations, worse = math.inf, 1.0, 0, 0, 0
    while True:
        evaluations += 1
        size = balance(tried, robot, by_tension, inputs, anchor, smooth, work, state, True, derivative)
        if size > allowed and damped < _DAMPINGS:
            share *= _DAMPING
            damped += 1
        else:
            copy(tried, x)
            worse += 1 if size > allowed else 0
            if size <= tolerance or evaluations >= most or worse == _WORSE_STEPS:
                return size
            allowed, damped = size, 0
            copy(state[3], step)
            solve_vector(derivative, step, _SMALLEST_PIVOT)
            longest = 0.0
            for i in range(len(x)):
                longest = max(longest, abs(step[i]))
            share = 1.0 if longest <= _LARGEST_STEP_RAD else _LARGEST_STEP_RAD / longest
        for i in range(len(x)):
            tried[i] = x[i] - share * step[i]


@compiled
def find_beside(x, robot, by_tension, inputs, anchor, slope, exchanged, work, newton, state):
    """Move `x` to the balance next to it by the derivative of a like robot; return what is left over [rad].

    Args: slope, exchanged: that derivative, factorised. It ends where a step leaves more than
    `_LEFT_OVER` of what there was.
    """
    step = newton[1]
    size = balance(x, robot, by_tension, inputs, anchor, 0.0, work, state, False, newton[0])
    while size > TOLERANCE_RAD:
        copy(state[3], step)
        solve_factorised(slope, exchanged, step)
        for i in range(len(x)):
            x[i] -= step[i]
        before = size
        size = balance(x, robot, by_tension, inputs, anchor, 0.0, work, state, False, newton[0])
        if not size < _LEFT_OVER * before:
            break
    return size


@compiled
def find_equilibrium(x, robot, by_tension, inputs, anchor, patient, work, newton, state):
    """Move `x` to the balance next to it; return what is left over there [rad].

    Newton's method may go to and fro between tendons that are slack and taut. If `patient`, it then starts
    again with tendons that become taut little by little, and less and less so, while that leads somewhere.
    """
    begin = newton[3]
    copy(x, begin)
    smooth = 0.0
    while True:
        tolerance = _ROUGH_RAD if smooth > 0.0 else TOLERANCE_RAD
        most = _MOST if smooth != 0.0 or by_tension else _MOST_AT_ONCE
        size = _newton(x, robot, by_tension, inputs, anchor, smooth, tolerance, most, work, newton, state)
        if smooth > 0.0:
            if size > tolerance:
                return size
            smooth *= _NARROWER
            if smooth < _NARROWEST_M:
                smooth = -1.0
        elif smooth < 0.0 or by_tension or not patient or size <= tolerance:
            return size
        else:
            copy(begin, x)
            smooth = _WIDEST_M


# ----------------------------------------------------------------------------------------------------
# Equilibria of robots of arcs along their inputs, compiled.
#
# A row is sought from the balances of the rows before it; without friction these decide nothing but which
# balance is found where there are several. Where Newton's method finds no balance, inputs and loads are
# brought on step by step: with friction from the row before, without from the robot at rest. Robots solved
# together are alike: where the first one has no balance in a row, the others' is sought briefly.

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
def _followed(x, guess, robot, by_tension, ends, shortest, patient, anchor, between, work, newton, state):
    """Move `x`, in balance at the first of two `ends`, to balance at the other; return what is left [rad].

    At once from `guess` or, where that ends in no balance, by ways not shorter than `shortest`.

    Args: ends: each command (T,), tip force and moment (3,), and the share of weight and pretension that
    acts; patient: as for `find_equilibrium`; between: space for the same and for pretension and weight.
    """
    begin, end = ends
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
            robot.cells, robot.share, robot.lead, robot.plastic, robot.held,
            robot.stood,
        )  # fmt: skip
        size = find_equilibrium(
            x, there, by_tension, (command, tip_force, tip_moment), anchor, patient, work, newton, state
        )
        if size <= TOLERANCE_RAD:
            reached = place
            way *= 2.0
            copy(x, kept)
            if reached < 1.0:
                if robot.mu > 0.0:
                    _anchored(x, robot, state[1], anchor)
                let_slip(x, robot)
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
            (B, S, 2), arm (B, T, S, 2), chord (B, T, S). Then tendons' stiffness and stretch by their
            pretension (B, T), mu, base compliance (B,), weight of each disk (B, S, 4). Then cells, share
            and lead (B, S), plastic (B, S, 2).
        free: which bends are free, (S, 2).
        disks: of each segment, (S,).
        by_tension: what the commands are.
        inputs: commands (B, r, T), tip force and moment (B, r, 3).
        every: which rows are wanted; those of robots with friction are marched through all the same.
        results: unknowns (B, n, 2S + 1), tension (B, n, T), span (B, n, T, S), residual (B, n) [rad].
    """
    lengths, k0s, c3s, c5s, rests, arms, chords, stiffnesses, stretches, mus = robots[:10]
    compliances, weights, cells, shares, leads, plastics = robots[10:]
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
    held, stood = np.empty((segments, 2)), np.empty((segments, 2))
    table = np.empty(2 ** math.ceil(math.log2(rows + 1) + 1), np.int64)
    nothing = (np.zeros(tendons), np.zeros(3), np.zeros(3), 0.0)
    for b in range(batch):
        robot = ArcRobot(
            lengths[b], k0s[b], c3s[b], c5s[b], rests[b], free, arms[b], chords[b], stiffnesses[b],
            stretches[b], path_at_rest, mus[b], compliances[b], disks, weights[b], cells[b], shares[b],
            leads[b], plastics[b], held, stood,
        )  # fmt: skip
        held[:], stood[:] = 0.0, 0.0
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
        rough = mus[b] > 0.0 or plastics[b, :, 0].max() > 0.0
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
                    now, guess, robot, by_tension, (begin, end), shortest, hoped,
                    anchor, between, work, newton, state,
                )  # fmt: skip
            lost += 1 if size > TOLERANCE_RAD else 0
            if rough:
                _anchored(now, robot, slip, anchor)
                let_slip(now, robot)
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
