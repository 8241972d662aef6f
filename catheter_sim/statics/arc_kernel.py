"""The equations of `arc_equilibrium` in compiled loops: one robot after another, row after row.

A row is sought from the balances of the rows before it; without friction these decide nothing but which
balance is found where there are several. Newton's method has the exact derivative (semi-smooth: slack and
slip switch) and is damped where a step would make the balance worse. Where it ends in no balance, it
starts again with tendons that become taut little by little; where that fails too, inputs and loads are
brought on step by step: with friction from the row before, without from the robot at rest.

The generalised load of segment s follows from what its end carries, force F and moment M, and from the
weights on it: with its end at q(b) and turned by R(b) in the frame of its start, component a of it is

    F . dq/db_a + M . w_a + sum over disks of weight . dq_k/db_a,    hat(w_a) = dR/db_a R^T.
"""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.compiled import compiled

PRE_SLIDING_M = 1e-5  # path within which a stuck tendon gives way
SHIFT_UNIT_M = 1e-3  # the base's shift is solved for in this unit, alike in size to an angle
_TURN_FLOOR_RAD = 1e-4  # smooths |b| at zero
_TOLERANCE_RAD = 1e-10  # unbalanced moment over the segment's stiffness
# Where Newton's method fails at once, tendons become taut over a stretch narrowed from round to round.
_WIDEST_M, _NARROWEST_M, _NARROWER = 1e-3, 1e-8, 0.2
_ROUGH_RAD = 1e-2  # good enough for such a round
_MOST, _MOST_AT_ONCE = 60, 20  # evaluations of a round, and of the attempt at once
_DAMPINGS = 6
_WORSE_STEPS = 3  # taken at the most damping and worse all the same: there is no balance this way
_DAMPING = 0.4
_LARGEST_STEP_RAD = 1.0
_SMALL_RAD2 = 1e-2  # squared bend below which the series are exact to the last bits
_DIFFERENCE_RAD = 1e-6  # of the load's derivative: only Newton's speed depends on it
_SMALLEST_PIVOT = 1e-14
_SHORTEST_WAY = 1.0 / 64.0  # of what changes from one row to the next


@compiled
def arc_functions(angle2):
    """Return sin(t)/t, (1 - cos t)/t^2, their slopes by t^2, and (t - sin t)/t^3 for `angle2` = t^2."""
    u = angle2
    if u < _SMALL_RAD2:
        sine = 1.0 - u / 6.0 * (1.0 - u / 20.0 * (1.0 - u / 42.0 * (1.0 - u / 72.0)))
        versine = 0.5 - u / 24.0 * (1.0 - u / 30.0 * (1.0 - u / 56.0 * (1.0 - u / 90.0)))
        sine_slope = -1.0 / 6.0 + u / 60.0 - u * u / 1680.0 + u * u * u / 90720.0
        versine_slope = -1.0 / 24.0 + u / 360.0 - u * u / 13440.0 + u * u * u / 907200.0
        third = (1.0 - u / 20.0 * (1.0 - u / 42.0 * (1.0 - u / 72.0))) / 6.0
        return sine, versine, sine_slope, versine_slope, third
    angle = math.sqrt(u)
    half = math.sin(0.5 * angle)
    sine = math.sin(angle) / angle
    versine = 2.0 * half * half / u
    return (
        sine,
        versine,
        (1.0 - u * versine - sine) / (2.0 * u),
        (sine - 2.0 * versine) / (2.0 * u),
        (1.0 - sine) / u,
    )


@compiled
def turned(x, y, sine, versine, rotation, out):
    """Set `out` to `rotation` times the turn of an arc bent by (x, y), both (3, 3)."""
    for i in range(3):
        a, b, c = rotation[i, 0], rotation[i, 1], rotation[i, 2]
        toward = a * x + b * y
        out[i, 0] = a - (versine * toward + sine * c) * x
        out[i, 1] = b - (versine * toward + sine * c) * y
        out[i, 2] = c + sine * toward - versine * (x * x + y * y) * c


@compiled
def _along_arc(bend_x, bend_y, length, share, force):
    """Return where a point at `share` of an arc is, (3,), and its work on `force` by the bend, (2,)."""
    x, y, reach = share * bend_x, share * bend_y, share * length
    sine, versine, sine_slope, versine_slope, _ = arc_functions(x * x + y * y)
    along = 2.0 * (versine_slope * (x * force[0] + y * force[1]) + sine_slope * force[2])
    return (
        reach * versine * x,
        reach * versine * y,
        reach * sine,
        share * reach * (versine * force[0] + along * x),
        share * reach * (versine * force[1] + along * y),
    )


@compiled
def _generalised_load(bend, length, count, weight, tip_force, tip_moment, frames, out):
    """Set `out` (2S,) to the power of the loads per rate of each bend component [N m].

    Args: bend (2S,); length (S,); count (S,) disks; weight (S, 3) of each disk; tip_force, tip_moment (3,);
    frames (S + 1, 3, 3) working space.
    """
    segments = len(length)
    for i in range(3):
        for j in range(3):
            frames[0, i, j] = 1.0 if i == j else 0.0
    for s in range(segments):
        x, y = bend[2 * s], bend[2 * s + 1]
        sine, versine, _, _, _ = arc_functions(x * x + y * y)
        turned(x, y, sine, versine, frames[s], frames[s + 1])
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
        px, py, pz, qx, qy = _along_arc(x, y, length[s], 1.0, force)
        # The end turns by w_a = J e_a, J = 1 + versine [r] + third [r]^2, r = (-y, x, 0).
        _, versine, _, _, third = arc_functions(x * x + y * y)
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
                px, py, pz, dx, dy = _along_arc(x, y, length[s], (disk + 1.0) / count[s], own)
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
def _copy(source, target):
    """Set `target` to `source`, both (n,); a slice assignment compiles its error messages with it."""
    for i in range(len(source)):
        target[i] = source[i]


@compiled
def _acts(tip_force, tip_moment, weight):
    """Return whether anything acts: tip force and moment (3,), weights (S, 3)."""
    for i in range(3):
        if tip_force[i] != 0.0 or tip_moment[i] != 0.0:
            return True
        for s in range(weight.shape[0]):
            if weight[s, i] != 0.0:
                return True
    return False


@compiled
def _solve_in_place(matrix, vector):
    """Set `vector` (n,) to the solution of matrix x = vector; `matrix` (n, n) is used up."""
    n = len(vector)
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if best != k:
            for j in range(k, n):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
            vector[k], vector[best] = vector[best], vector[k]
        if abs(matrix[k, k]) < _SMALLEST_PIVOT:
            matrix[k, k] = _SMALLEST_PIVOT
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                vector[i] -= factor * vector[k]
    for k in range(n - 1, -1, -1):
        total = vector[k]
        for j in range(k + 1, n):
            total -= matrix[k, j] * vector[j]
        vector[k] = total / matrix[k, k]


@compiled
def _balance(x, robot, by_tension, inputs, anchor, smooth, work, state, derivative):
    """Set what the unknowns `x` (2S + 1,) leave over [rad], and its derivative; return the largest of it.

    Args: robot: one of `solve_histories`; inputs: command (T,), tip force and moment (3,); anchor (T, S)
    path at which each tendon would not slip; smooth: width of stretch [m] over which a tendon becomes
    taut, 0 for at once; work: working space; state, set: span, slip (T, S), tension
    (T,), residual (2S + 1,); derivative, set: (2S + 1, 2S + 1).
    """
    length, k0, c3, c5, rest, free, arm, chord, stiffness, stretch0, mu, compliance, count, weight = robot
    command, tip_force, tip_moment = inputs
    span, slip, tension, residual = state
    segments, tendons = len(length), len(stiffness)
    last = 2 * segments
    arms, turning, frames, force, moved = work
    shift = x[last] * SHIFT_UNIT_M
    for i in range(last + 1):
        residual[i] = 0.0
        for j in range(last + 1):
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
            slip[t, s] = min(max((own - anchor[t, s]) / PRE_SLIDING_M, -1.0), 1.0) if mu > 0.0 else 0.0
            path += own
        grip = 0.0
        if by_tension:
            pull = command[t]
        else:
            stretch = command[t] + stretch0[t] - path - shift
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
        if grip > 0.0:
            for j in range(last):
                derivative[last, j] += compliance / SHIFT_UNIT_M * grip * arms[j]

    if _acts(tip_force, tip_moment, weight):
        for j in range(-1, last):  # here, then moved by each component
            if j >= 0:
                x[j] += _DIFFERENCE_RAD
            _generalised_load(x, length, count, weight, tip_force, tip_moment, frames, moved)
            for i in range(last):
                if j < 0:
                    force[i] = moved[i]
                    residual[i] -= force[i]
                else:
                    derivative[i, j] -= (moved[i] - force[i]) / _DIFFERENCE_RAD
            if j >= 0:
                x[j] -= _DIFFERENCE_RAD

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
                for j in range(last + 1):
                    derivative[i, j] = 1.0 if i == j else 0.0
            else:
                residual[i] = residual[i] / k0[s] + away * factor
                for j in range(last + 1):
                    derivative[i, j] /= k0[s]
                derivative[i, i] += factor
                derivative[i, 2 * s] += slope * away * away_x
                derivative[i, 2 * s + 1] += slope * away * away_y
            largest = max(largest, abs(residual[i]))

    # The base gives way under the sum of the tensions.
    residual[last] = x[last] - compliance / SHIFT_UNIT_M * total_tension
    derivative[last, last] = 1.0 + compliance * total_grip
    return max(largest, abs(residual[last]))


@compiled
def _newton(x, robot, by_tension, inputs, anchor, smooth, tolerance, most, work, newton, state):
    """Move `x` to the balance next to it by Newton's method; return what is left over there [rad].

    It ends below `tolerance`, after `most` evaluations, or where it leads nowhere.
    """
    derivative, step, tried, _ = newton
    _copy(x, tried)
    allowed, share, damped, evaluations, worse = math.inf, 1.0, 0, 0, 0
    while True:
        evaluations += 1
        size = _balance(tried, robot, by_tension, inputs, anchor, smooth, work, state, derivative)
        if size > allowed and damped < _DAMPINGS:
            share *= _DAMPING
            damped += 1
        else:
            _copy(tried, x)
            worse += 1 if size > allowed else 0
            if size <= tolerance or evaluations >= most or worse == _WORSE_STEPS:
                return size
            allowed, damped = size, 0
            _copy(state[3], step)
            _solve_in_place(derivative, step)
            longest = 0.0
            for i in range(len(x)):
                longest = max(longest, abs(step[i]))
            share = 1.0 if longest <= _LARGEST_STEP_RAD else _LARGEST_STEP_RAD / longest
        for i in range(len(x)):
            tried[i] = x[i] - share * step[i]


@compiled
def _equilibrium(x, robot, by_tension, inputs, anchor, work, newton, state):
    """Move `x` to the balance next to it; return what is left over there [rad].

    Where Newton's method goes to and fro between tendons that are slack and taut, it starts again with
    tendons that become taut little by little, and less and less so.
    """
    begin = newton[3]
    _copy(x, begin)
    smooth = 0.0
    while True:
        tolerance = _ROUGH_RAD if smooth > 0.0 else _TOLERANCE_RAD
        most = _MOST if smooth != 0.0 or by_tension else _MOST_AT_ONCE
        size = _newton(x, robot, by_tension, inputs, anchor, smooth, tolerance, most, work, newton, state)
        if smooth > 0.0:
            smooth *= _NARROWER
            if smooth < _NARROWEST_M:
                smooth = -1.0
        elif smooth < 0.0 or by_tension or size <= tolerance:
            return size
        else:
            _copy(begin, x)
            smooth = _WIDEST_M


@compiled
def _anchored(x, robot, slip, anchor):
    """Set `anchor` (T, S) to the paths at which tendons that have `slip` at `x` would have none."""
    arm, chord = robot[6], robot[7]
    for t in range(anchor.shape[0]):
        for s in range(anchor.shape[1]):
            bx, by = x[2 * s], x[2 * s + 1]
            path = arm[t, s, 0] * bx + arm[t, s, 1] * by + 0.5 * chord[t, s] * (bx * bx + by * by)
            anchor[t, s] = path - PRE_SLIDING_M * slip[t, s]


@compiled
def _followed(x, guess, robot, by_tension, begin, end, anchor, between, work, newton, state):
    """Move `x`, in balance at `begin`, to the balance at `end`; return what is left over there [rad].

    At once from `guess` or, where that ends in no balance, by short ways.

    Args: begin, end: command (T,), tip force and moment (3,), and the share of weight and pretension that
    acts; between: space for the same and for pretension and weight.
    """
    length, k0, c3, c5, rest, free, arm, chord, stiffness, stretch0, mu, compliance, count, weight = robot
    command, tip_force, tip_moment, pretension, weighing, kept = between
    _copy(x, kept)
    _copy(guess, x)
    reached, way, size = 0.0, 1.0, 0.0
    while reached < 1.0:
        place = min(reached + way, 1.0)
        for i in range(len(command)):
            command[i] = begin[0][i] + place * (end[0][i] - begin[0][i])
        for i in range(3):
            tip_force[i] = begin[1][i] + place * (end[1][i] - begin[1][i])
            tip_moment[i] = begin[2][i] + place * (end[2][i] - begin[2][i])
        share = begin[3] + place * (1.0 - begin[3])
        for i in range(len(stretch0)):
            pretension[i] = share * stretch0[i]
        for s in range(len(length)):
            for i in range(3):
                weighing[s, i] = share * weight[s, i]
        there = (
            length, k0, c3, c5, rest, free, arm, chord, stiffness, pretension, mu, compliance, count, weighing
        )  # fmt: skip
        size = _equilibrium(
            x, there, by_tension, (command, tip_force, tip_moment), anchor, work, newton, state
        )
        if size <= _TOLERANCE_RAD:
            reached = place
            way *= 2.0
            _copy(x, kept)
            if mu > 0.0 and reached < 1.0:
                _anchored(x, robot, state[1], anchor)
        else:
            way *= 0.25 if way == 1.0 else 0.5
            if way < _SHORTEST_WAY:
                break
            _copy(kept, x)
    return size


@compiled
def solve_histories(robots, free, disks, by_tension, inputs, every, results):
    """Set `results` to the equilibria of B robots at each `every`-th of r rows, see `arc_equilibrium`.

    Args:
        robots: length (B, S), stiffness k0 [N m/rad] and c3, c5 of the law in the bend (B, S), rest
            (B, S, 2), arm (B, T, S, 2), chord (B, T, S), tendons' stiffness and stretch by their
            pretension (B, T), mu, base compliance (B,), weight of each disk (B, S, 3).
        free: which bends are free, (S, 2).
        disks: of each segment, (S,).
        by_tension: what the commands are.
        inputs: commands (B, r, T), tip force and moment (B, r, 3).
        every: which rows are wanted; those of robots with friction are marched through all the same.
        results: unknowns (B, n, 2S + 1), tension (B, n, T), span (B, n, T, S), residual (B, n) [rad].
    """
    lengths, k0s, c3s, c5s, rests, arms, chords, stiffnesses, stretches, mus, compliances, weights = robots
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
    )
    newton = (np.empty((n, n)), np.empty(n), np.empty(n), np.empty(n))
    span, slip = np.empty((tendons, segments)), np.zeros((tendons, segments))
    tension, residual = np.empty(tendons), np.empty(n)
    state = (span, slip, tension, residual)
    between = (
        np.empty(tendons), np.empty(3), np.empty(3), np.empty(tendons), np.empty((segments, 3)), np.empty(n)
    )  # fmt: skip
    guess, at_rest, before, now = np.empty(n), np.zeros(n), np.empty(n), np.empty(n)
    anchor = np.empty((tendons, segments))
    nothing = (np.zeros(tendons), np.zeros(3), np.zeros(3), 0.0)
    for b in range(batch):
        robot = (
            lengths[b], k0s[b], c3s[b], c5s[b], rests[b], free, arms[b], chords[b], stiffnesses[b],
            stretches[b], mus[b], compliances[b], disks, weights[b],
        )  # fmt: skip
        for s in range(segments):
            at_rest[2 * s], at_rest[2 * s + 1] = rests[b, s, 0], rests[b, s, 1]
        _copy(at_rest, now)
        _copy(at_rest, before)
        for t in range(tendons):
            for s in range(segments):
                slip[t, s] = 0.0
        _anchored(at_rest, robot, slip, anchor)
        rough = mus[b] > 0.0
        begin = nothing
        for row in range(0, rows, 1 if rough else every):
            end = (commands[b, row], tip_forces[b, row], tip_moments[b, row], 1.0)
            for i in range(n):
                guess[i] = now[i] + 0.5 * (now[i] - before[i]) if row > 1 and rough else now[i]
            if not rough:
                _copy(at_rest, now)
            _copy(now, before)
            size = _followed(now, guess, robot, by_tension, begin, end, anchor, between, work, newton, state)
            if rough:
                _anchored(now, robot, slip, anchor)
                begin = end
            if row % every == 0:
                place = row // every
                _copy(now, unknowns[b, place])
                _copy(tension, tensions[b, place])
                for t in range(tendons):
                    _copy(span[t], spans[b, place, t])
                residuals[b, place] = size
