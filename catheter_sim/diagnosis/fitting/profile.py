"""The interval of a calibrated number along the valley of all others."""

from __future__ import annotations

import math
from dataclasses import replace

from scipy.optimize import brentq
from scipy.special import stdtrit

from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.intervals import (
    Interval,
    half_width_by_blocks,
    half_width_if_white,
    half_widths,
    inverse_of,
)
from catheter_sim.diagnosis.fitting.least_squares import influential
from catheter_sim.diagnosis.fitting.prior import prior_of
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.thresholds import INTERVAL_TOLERANCE


def profile_interval(problem: Problem, result: Fit, name: str) -> Interval:
    """Return the 95 % interval of a calibrated number along the valley of the other numbers.

    All others are fitted anew at each value of it. The interval ends where the sum of squares has risen by
    s^2 t^2, with s^2 the residuals' variance and t Student's (Bates and Watts 1988, Section 6.1): right also
    where numbers trade against one another far from where a parabola would hold. Where residuals of one block
    depend on one another, the rise is scaled up to the wider width of `intervals`.

    Args:
        problem: what `result` was fitted to.
        result: a fit.
        name: of one of the problem's nuisance numbers.

    Returns:
        Lower and upper end in the number's unit; a bound where the data do not end the interval
        before it.
    """
    index = [fitted.key for fitted in result.numbers].index(("", name))
    parameter = result.numbers[index].parameter
    low, high = (bound / parameter.scale for bound in parameter.fit_bounds)
    count = len(result.residual) - len(result.numbers)
    if count < 1 or not influential(result.jacobian)[index]:
        return parameter.lower, parameter.upper
    allowed = math.sqrt(_allowed_rise(result, index, count))
    cost = _cost(result)
    start = float(result.x[index])
    rises = {start: 0.0}
    values = {start: result.values}

    def beyond_allowed(x: float) -> float:
        """Return the root of the rise, which is nearly linear, less its allowed size."""
        if x not in rises:
            nearest = min(values, key=lambda other: abs(other - x))
            pinned = _pinned(problem, name, parameter.from_fit(x * parameter.scale))
            found = fit(pinned, result.terms, values[nearest], cross_validate=False, thorough=True)
            values[x] = found.values
            rises[x] = math.sqrt(max(_cost(found) - cost, 0.0))
        return rises[x] - allowed

    ends = []
    for bound, direction in ((low, -1.0), (high, 1.0)):
        inside, step, end = start, _first_step(result, index), bound
        while inside != bound:
            outside = inside + direction * step
            outside = bound if direction * (outside - bound) >= 0.0 else outside
            if beyond_allowed(outside) > 0.0:
                end = brentq(beyond_allowed, inside, outside, xtol=INTERVAL_TOLERANCE * abs(outside - inside))
                break
            inside, step = outside, 2.0 * step
        ends.append(parameter.from_fit(float(end) * parameter.scale))
    lowest, highest = sorted(ends)
    return lowest, highest


def _first_step(result: Fit, index: int) -> float:
    half = half_widths(result)[index]
    return float(half) if math.isfinite(half) and half > 0.0 else 1.0


def _allowed_rise(result: Fit, index: int, count: int) -> float:
    """Return the rise of the sum of squares at the end of an interval."""
    rise = float(result.residual @ result.residual) / count * float(stdtrit(count, 0.975)) ** 2
    use = influential(result.jacobian) & ~result.held
    if not use[index]:
        return rise
    part = result.jacobian[:, use]
    inverse = inverse_of(part, prior_of(result.numbers).precision[use])
    place = int(use[:index].sum())
    white, blocks = (
        widths[place]
        for widths in (half_width_if_white(result, inverse), half_width_by_blocks(result, inverse, part))
    )
    if not math.isfinite(blocks) or blocks <= white:
        return rise
    return rise * float(blocks / white) ** 2


def _cost(result: Fit) -> float:
    return float(result.residual @ result.residual) + prior_of(result.numbers).cost(result.x)


def _pinned(problem: Problem, name: str, value: float) -> Problem:
    """Return `problem` with one calibrated number built into its robot."""
    (number,) = (item for item in problem.nuisances if item.name == name)
    others = tuple(item for item in problem.nuisances if item.name != name)
    return replace(problem, robot=number.change_robot(problem.robot, value), nuisances=others)
