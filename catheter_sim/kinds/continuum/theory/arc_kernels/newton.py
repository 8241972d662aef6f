"""Newton's method for a robot of arcs, compiled.

It is semi-smooth (slack and slip switch) and damped where a step would make the balance worse. Where it
ends in no balance, it starts again with tendons that become taut little by little.
"""

from __future__ import annotations

import math

from catheter_sim.kinds.continuum.theory.arc_kernels.balance import balance
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.linear import solve_factorised, solve_vector
from catheter_sim.mechanics.vectors import copy, fill

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

    Where Newton's method goes to and fro between tendons that are slack and taut, it starts again, if
    `patient`, with tendons that become taut little by little, and less and less so, while that leads
    somewhere.
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
