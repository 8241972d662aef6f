"""Intervals of fitted numbers, from stretches that err together, and by profiles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import stdtrit

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.fit import Fit, fit, influential, linearised
from catheter_sim.diagnosis.problem import Problem, box_of, prior_of
from catheter_sim.diagnosis.thresholds import TRUSTED_SHARE
from catheter_sim.diagnosis.trials import measured_of

INTERVAL_TOLERANCE = 0.05
"""[share of the way between two values that enclose an interval's end] The end is found to within this. Why:
an interval's end is reported with two digits."""

# ----------------------------------------------------------------------------------------------------
# How sure fitted numbers are: 95 % intervals from the curvature at the fit, or along its valley.

Interval = tuple[float, float]


def intervals(result: Fit, margin: Array | None = None) -> dict[tuple[str, str], Interval]:
    """Return a 95 % interval of every fitted value, by effect and parameter.

    The wider one of two intervals. Where residuals are white, that of least squares: s^2 A^-1 with A = J^T J
    and Student's t with as many degrees of freedom as residuals are left. Where residuals of one block depend
    on one another, blocks count, not rows. The covariance is the cluster-robust A^-1 (sum_b g_b g_b^T) A^-1
    G / (G - 1), with g_b a block's gradient and G blocks. Student's t has G - 1 degrees of freedom (Liang
    and Zeger 1986; Cameron and Miller 2015). A number known beforehand brings its own precision to A,
    also where it stands at a bound. Another value held at a bound, or one without influence, has the
    interval of its bounds. `margin`, shape (p,), is what a model that is not exact may put the values off
    by (`model_margin`); noise says nothing about that, so that it is added to both sides.
    """
    half = half_widths(result)
    if margin is not None:
        half = half + margin
    found: dict[tuple[str, str], Interval] = {}
    for fitted, x, width in zip(result.numbers, result.x, half, strict=True):
        parameter = fitted.parameter
        low, high = parameter.fit_bounds
        ends = np.clip([(x - width) * parameter.scale, (x + width) * parameter.scale], low, high)
        values = sorted(parameter.from_fit(float(end)) for end in ends)
        found[fitted.key] = (values[0], values[1])
    return found


def cause_intervals(
    result: Fit, shift: Array | None = None, trusted: float = TRUSTED_SHARE
) -> dict[tuple[str, str], Interval]:
    """Return the 95 % interval of every fitted value by which causes are named, and which is printed.

    As `intervals`, widened by what an unknown error of the model could do. A number that stands at a bound
    has the interval that it would have without the bound, cut off at the bound: that much is sure, since
    nothing is known of what lies beyond. `shift`, shape (p,), is by how much another model of the same
    physics would change the numbers (`shift_by_model`); None: none was asked. `trusted`: as for
    `model_margin`.
    """
    unheld = replace(result, held=np.zeros_like(result.held))
    moved = np.zeros(len(result.numbers)) if shift is None else shift
    return intervals(unheld, model_margin(unheld, moved, trusted))


def half_widths(result: Fit) -> Array:
    """Return half the interval of every fitted number, in units of its scale, inf where unknown, (p,)."""
    half = np.full(len(result.numbers), np.inf)
    precision = prior_of(result.numbers).precision
    use = influential(result.jacobian) & (~result.held | (precision > 0.0))
    if not use.any():
        return half
    part = result.jacobian[:, use]
    inverse = inverse_of(part, precision[use])
    widths = [half_width_if_white(result, inverse), half_width_by_blocks(result, inverse, part)]
    half[use] = np.maximum(*widths)
    return half


def model_margin(result: Fit, shift: Array, trusted: float = TRUSTED_SHARE) -> Array:
    """Return how far off a model that is not exact may put fitted numbers, shape (p,), in their scales.

    The sum of two sizes: `shift`, and the most that an unknown error of the model can do. That error is taken
    as a share of the residuals' root mean square. By the Cauchy-Schwarz inequality an error of root mean
    square e over n rows moves a number by at most e (n A^-1)^1/2, with A^-1 as in `intervals`. More rows do
    not make that smaller. `shift`, shape (p,), is by how much another model of the same physics would change
    the numbers; `trusted` is the share, 1 where the model is known to err by what is left.
    """
    margin = np.abs(shift)
    use = influential(result.jacobian) & ~result.held
    if use.any():
        inverse = inverse_of(result.jacobian[:, use], prior_of(result.numbers).precision[use])
        margin[use] += trusted * np.sqrt(float(result.residual @ result.residual) * np.diag(inverse))
    return margin


def shift_by_model(test: Problem, result: Fit, other: Sequence[Array]) -> Array:
    """Return by how much fitted numbers would change if another model of the same physics were fitted.

    One Gauss-Newton step that makes up for the difference of the two models, on trials that both have
    computed; zero for a number that is held or changes nothing. `result` is a fit by `test`'s twin, to these
    or other trials; `other` are the other model's outputs with the same numbers, by trial, shape (r, o), in
    file units, NaN where it has none. Returned in units of the numbers' scales, shape (p,).
    """
    shift = np.zeros(len(result.numbers))
    if not len(shift):
        return shift
    at = linearised(test, result.numbers, result.x, box_of(result.numbers)[1])
    jacobian = at.jacobian
    parts = []
    for trial, values in zip(test.trials, other, strict=True):
        measured = measured_of(trial, test.columns)
        parts.append(((values - measured) / test.weight)[:: test.every][np.isfinite(measured[:: test.every])])
    apart = np.concatenate(parts) - at.error
    known = np.isfinite(apart)
    use = influential(jacobian[known]) & ~result.held
    if use.any():
        part = jacobian[known][:, use]
        precision = prior_of(result.numbers).precision[use]
        shift[use] = -inverse_of(part, precision) @ part.T @ apart[known]
    return shift


def inverse_of(part: Array, precision: Array) -> Array:
    return np.asarray(np.linalg.pinv(part.T @ part + np.diag(precision), rcond=1e-12), dtype=np.float64)


def half_width_if_white(result: Fit, inverse: Array) -> Array:
    count = len(result.residual) - len(inverse)
    if count < 1:
        return np.full(len(inverse), np.inf)
    variance = float(result.residual @ result.residual) / count
    return np.sqrt(np.maximum(variance * np.diag(inverse), 0.0)) * float(stdtrit(count, 0.975))


def half_width_by_blocks(result: Fit, inverse: Array, part: Array) -> Array:
    labels = np.unique(result.block, return_inverse=True)[1]
    groups = int(labels.max()) + 1
    if groups < 2:
        return np.full(len(inverse), np.inf)
    scores = np.zeros((groups, len(inverse)))
    np.add.at(scores, labels, part * result.residual[:, None])
    covariance = inverse @ (scores.T @ scores) @ inverse * groups / (groups - 1)
    return np.sqrt(np.maximum(np.diag(covariance), 0.0)) * float(stdtrit(groups - 1, 0.975))


# ----------------------------------------------------------------------------------------------------
# The interval of a calibrated number along the valley of all others.


def profile_interval(problem: Problem, result: Fit, name: str) -> Interval:
    """Return the 95 % interval of a calibrated number along the valley of the other numbers.

    All others are fitted again at each value of it. The interval ends where the sum of squares has risen by
    s^2 t^2, with s^2 the residuals' variance and t Student's (Bates and Watts 1988, Section 6.1). It is
    right also where numbers trade against one another far from where a parabola would hold. Where residuals
    of one block depend on one another, the rise is scaled up to the wider width of `intervals`. Lower and
    upper end in the unit of the nuisance number `name`; a bound where the data do not end the interval
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
