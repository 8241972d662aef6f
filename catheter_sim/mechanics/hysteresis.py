"""What remembers the way or the time: plays, slack, slips, lags."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled

# ----------------------------------------------------------------------------------------------------
# The play: what follows with a dead-band, and stands still after each reversal until that is crossed.
#
# The output follows y = clip(y_before, u - width / 2, u + width / 2), Krasnosel'skii's play operator (Nayar
# 2022, Eqs 29-31). Between two rows the input moves one way, so that the rows alone decide.


@compiled
def played(before, value, half):
    """Return where a play is that was at `before`, when its input has come to `value`; `half` its width."""
    return min(max(before, value - half), value + half)


@compiled
def _series(values, half, rest, result):
    """Set `result` (r, t) to the outputs of plays along `values` (r, t) from `rest` (t,)."""
    for column in range(values.shape[1]):
        now = rest[column]
        for row in range(values.shape[0]):
            now = played(now, values[row, column], half[column])
            result[row, column] = now


def play(values: Array, width: float | Array, rest: Array | None = None) -> Array:
    """Return the outputs of plays along their inputs (r, t), same shape.

    `width`: of the whole dead-band, or one a column, 0 or more; `rest`: where input and output are before the
    first row, (t,), by default at zero.
    """
    count = values.shape[1]
    half = 0.5 * np.broadcast_to(np.asarray(width, dtype=float), (count,))
    start = np.zeros(count) if rest is None else np.asarray(rest, dtype=float)
    result = np.empty(values.shape)
    _series(np.ascontiguousarray(values, dtype=float), half, start, result)
    return result


def play_step(before: Array, value: Array, width: float | Array) -> Array:
    """Return the outputs of plays that were at `before` when their inputs come to `value`, shape (..., t)."""
    half = 0.5 * np.asarray(width)
    return np.minimum(np.maximum(before, value - half), value + half)


@compiled
def _closing(now, before, after, width, time_s, dt_s):
    """Return where a closing play is, see `closing_play_step`."""
    half = 0.5 * width
    if dt_s <= 0.0 or time_s <= 0.0:
        return played(now, after, half)
    behind = time_s * (after - before) / dt_s  # where u - y tends to
    gap = behind + (before - now - behind) * math.exp(-dt_s / time_s)
    return after - min(max(gap, -half), half)


@compiled
def _limited(now, before, after, most_per_s, dt_s):
    """Return where a drive with a top speed is, see `limited_step`."""
    if dt_s <= 0.0:
        return now if math.isfinite(most_per_s) else after
    speed = (after - before) / dt_s
    toward = 1.0 if before > now else (-1.0 if before < now else 0.0)
    closing = most_per_s - speed * toward  # how fast the gap closes
    meets_s = 0.0
    if toward != 0.0:
        meets_s = abs(before - now) / closing if closing > 0.0 else math.inf
    if meets_s >= dt_s:
        return now + toward * most_per_s * dt_s
    if abs(speed) <= most_per_s:
        return after
    return before + speed * meets_s + math.copysign(1.0, speed) * most_per_s * (dt_s - meets_s)


@compiled
def _closings(steps_s, values, width, time_s, rest, result):
    """Set `result` (r, t) to where closing plays are along `values` (r, t), from `rest` (t,)."""
    for column in range(values.shape[1]):
        now = before = rest[column]
        for row in range(values.shape[0]):
            after = values[row, column]
            now = _closing(now, before, after, width[column], time_s, steps_s[row])
            result[row, column], before = now, after


@compiled
def _limits(steps_s, values, most_per_s, rest, result):
    """Set `result` (r, t) to where drives with a top speed are along `values` (r, t), from `rest` (t,)."""
    for column in range(values.shape[1]):
        now = before = rest[column]
        for row in range(values.shape[0]):
            after = values[row, column]
            now = _limited(now, before, after, most_per_s[column], steps_s[row])
            result[row, column], before = now, after


def closing_play(time_s: Array, values: Array, width: Array, closes_s: float, rest: Array) -> Array:
    """Return the outputs of `closing_play_step` along inputs (r, t) at times (r,), from `rest` (t,)."""
    result = np.empty(values.shape)
    steps_s = np.diff(time_s, prepend=time_s[:1])
    _closings(steps_s, np.ascontiguousarray(values, dtype=float), width, float(closes_s), rest, result)
    return result


def limited(time_s: Array, values: Array, most_per_s: Array, rest: Array) -> Array:
    """Return the outputs of `limited_step` along inputs (r, t) at times (r,), from `rest` (t,)."""
    result = np.empty(values.shape)
    steps_s = np.diff(time_s, prepend=time_s[:1])
    _limits(steps_s, np.ascontiguousarray(values, dtype=float), most_per_s, rest, result)
    return result


def closing_play_step(
    now: Array, before: Array, after: Array, width: Array, time_s: float, dt_s: float
) -> Array:
    """Return the outputs of plays whose drives close what is left of the dead-band with a time constant.

    Inside the dead-band y follows dy/dt = (u - y) / T; the input moves on a straight line from `before` to
    `after` in `dt_s`. All arrays have shape (t,); exact, as u - y goes one way within a step.
    """
    rows = zip(now.tolist(), before.tolist(), after.tolist(), width.tolist(), strict=True)
    return np.array([_closing(*row, float(time_s), float(dt_s)) for row in rows])


def limited_step(now: Array, before: Array, after: Array, most_per_s: Array, dt_s: float) -> Array:
    """Return where outputs are that follow their inputs at no more than a speed, shape (t,).

    The inputs move on a straight line from `before` to `after` in `dt_s`. An output goes toward its input,
    meets it, and then keeps up with it or falls behind on the other side; exact.
    """
    rows = zip(now.tolist(), before.tolist(), after.tolist(), most_per_s.tolist(), strict=True)
    return np.array([_limited(*row, float(dt_s)) for row in rows])


@compiled
def _rubbings(values, low, high, rest, result):
    """Set `result` (r, t) to `values` (r, t) as far as it must go to stay within both shares of them."""
    for column in range(values.shape[1]):
        now = rest[column]
        for row in range(values.shape[0]):
            value = values[row, column]
            now = min(max(now, value * low), value * high)
            result[row, column] = now


def rubbed(values: Array, loss: float, rest: Array) -> Array:
    """Return tensions behind a path that rubs, along those before it (r, t), from `rest` (t,).

    They stay while they lie between T exp(-loss) and T exp(loss) (Euler), and follow only as far as they
    must.
    """
    result = np.empty(values.shape)
    low, high = math.exp(-loss), math.exp(loss)
    _rubbings(np.ascontiguousarray(values, dtype=float), low, high, rest, result)
    return result


def plays(values: Array, thresholds: Array) -> Array:
    """Return the outputs of several plays of one input (r,), from rest at zero, (r, k); half widths (k,)."""
    return play(np.repeat(values[:, np.newaxis], len(thresholds), axis=1), 2.0 * thresholds)


# ----------------------------------------------------------------------------------------------------
# Actuators of driven tendons pull only: which of them a step clamps, for one robot and for copies.
#
# MuJoCo clamps an actuator's force at the start of a step and then leaves its stiffness out of the implicit
# solution: a stiff tendon that is paid out would jump between taut and slack at every step. Left unclamped
# for the step in which it slackens, it ends near zero by itself. So only those are clamped that were slack
# before the command changed. Index i picks among m copies.


def clamp_of_slack(force_before: Array) -> Array:
    """Return the largest forces of actuators: none push, but those are left alone that pulled before."""
    return np.where(force_before < 0.0, 1e9, 0.0)


@compiled
def clamp_slack(
    pulls: Index,
    tendons: Index,
    gain: Array,
    bias: Array,
    length_gain: Array,
    length: Array,
    ctrl: Array,
    before: Array,
    force_range: Array,
) -> None:
    """Set the largest forces of the actuators that pull one robot's tendons, and keep their controls.

    Actuators and what they pull (k,); force = gain control + bias + length_gain length, (k,); lengths (nt,)
    [m]; controls (nu,). In and out: controls of the last step, (k,). Out: at force_range[:, 1] none of a
    tendon that was slack before, (nu, 2) [N].
    """
    for k in range(pulls.shape[0]):
        force = gain[k] * before[k] + bias[k] + length_gain[k] * length[tendons[k]]
        force_range[pulls[k], 1] = 1e9 if force < 0.0 else 0.0
        before[k] = ctrl[pulls[k]]


@compiled
def clamp_slack_of(
    copies: Index,
    pulls: Index,
    tendons: Index,
    gain: Array,
    bias: Array,
    length_gain: Array,
    length: Array,
    ctrl: Array,
    before: Array,
    force_range: Array,
) -> None:
    """Do it for those of m copies that `copies` picks: an axis of m before those of all that changes."""
    for i in copies:
        clamp_slack(pulls, tendons, gain, bias, length_gain, length[i], ctrl[i], before[i], force_range[i])


# ----------------------------------------------------------------------------------------------------
# What an eyelet with dry friction does to the tensions of the tendons that run through it.
#
# A tendon that turns by `phi` at an eyelet with friction coefficient mu comes out with a tension in [T/E, T
# E], E = exp(mu phi), T the tension before the eyelet (capstan; Coulomb). It comes out with T/E while it is
# pulled toward the base, with T E while it runs toward the tip.

_NEUTRAL = 2.0**-500  # of the farthest eyelet's place: nearer to the neutral plane is in it


def tensions_behind(
    before: Sequence[float], kept: Sequence[float], offset: Sequence[float], capstan: float
) -> list[float]:
    """Return the tensions behind an eyelet for tendons that end together, so that they slip together.

    What bends the robot beyond the eyelet is the moment sum(offset * tension). It keeps its value
    while it can. It can between two limits: where the tendons on the +x side come out lowest and
    those on the -x side highest (bending further toward +x), and the reverse (coming back). A moment
    that left these limits is moved to the one it crossed, and all tendons slip. Otherwise they
    stick: each keeps its tension as far as all then stay inside their own intervals; where one does
    not, they take the nearest tensions with the same moment. With one tendon this is: it keeps its
    tension unless the interval pushes it.

    Args:
        before: tensions before the eyelet [N].
        kept: tensions behind it a moment ago [N].
        offset: x of the eyelets, one a tendon [m].
        capstan: E = exp(mu phi) >= 1.
    """
    offset = _scaled(offset)
    low = [tension / capstan for tension in before]
    high = [tension * capstan for tension in before]
    moment = forward = backward = 0.0
    inside = True
    for lo, hi, old, d in zip(low, high, kept, offset, strict=True):
        moment += d * old
        forward += d * (lo if d > 0.0 else hi)
        backward += d * (hi if d > 0.0 else lo)
        inside = inside and lo <= old <= hi
    if inside:
        return list(kept)
    if moment <= forward:
        ends = zip(low, high, strict=True)
    elif moment >= backward:
        ends = zip(high, low, strict=True)
    else:
        return _nearest(low, high, kept, offset, moment)
    # A tendon in the neutral plane is moved by neither: it keeps its tension as far as it can.
    return [
        right if d > 0.0 else left if d < 0.0 else min(max(old, min(right, left)), max(right, left))
        for (right, left), old, d in zip(ends, kept, offset, strict=True)
    ]


def _scaled(offset: Sequence[float]) -> list[float]:
    """Return the places with the farthest between 0.5 and 1.

    Nothing depends on their scale, and a power of two rounds nothing; places of 1e-311 m would lose the
    digits that their moments need.
    """
    exponent = math.frexp(max((abs(d) for d in offset), default=0.0))[1]
    scaled = [math.ldexp(d, -exponent) for d in offset]
    return [0.0 if abs(d) < _NEUTRAL else d for d in scaled]


def _nearest(
    low: Sequence[float], high: Sequence[float], kept: Sequence[float], offset: Sequence[float], moment: float
) -> list[float]:
    """Return the tensions inside their intervals, nearest to `kept`, whose moment is `moment`.

    Least squares under one equality: tension = clip(kept + multiplier * offset). The moment grows
    with the multiplier, linearly between the values at which a tendon meets an end of its interval.
    """

    def at(multiplier: float) -> tuple[list[float], float]:
        tensions = [
            min(max(old + multiplier * d, lo), hi)
            for lo, hi, old, d in zip(low, high, kept, offset, strict=True)
        ]
        return tensions, sum(d * tension for d, tension in zip(offset, tensions, strict=True))

    knees = sorted(
        (end - old) / d
        for ends, old, d in zip(zip(low, high, strict=True), kept, offset, strict=True)
        if d != 0.0
        for end in ends
    )
    left, (tensions, left_moment) = knees[0], at(knees[0])
    for right in knees[1:]:
        if left_moment >= moment:
            break
        tensions, right_moment = at(right)
        if right_moment >= moment:
            share = (moment - left_moment) / (right_moment - left_moment)
            return at(left + share * (right - left))[0]
        left, left_moment = right, right_moment
    return tensions


# ----------------------------------------------------------------------------------------------------
# What comes late: a first-order lag and a delay, exact where the input moves on straight lines, from rest.
#
# The output y follows lag_s dy/dt = u(t - delay_s) - y. While u is a straight line u_0 + s t, y = u - s lag
# + (y_0 - u_0 + s lag) exp(-t / lag); a first row that is not at rest is a step.

_TINY = float(np.finfo(float).tiny)


@compiled
def _errors(values, remaining, rising, rest, error):
    """Set `error` (r, t) to y - u at the rows of `values` (r, t), from `rest` (t,).

    `remaining` and `rising`, shape (r - 1,), are `_remaining` and `_mean_lag` of the steps.
    """
    for column in range(values.shape[1]):
        now = rest[column] - values[0, column]
        error[0, column] = now
        for row in range(values.shape[0] - 1):
            rise = values[row + 1, column] - values[row, column]
            now = now * remaining[row] + rise * rising[row]
            error[row + 1, column] = now


def lagged(
    time_s: Array, values: Array, lag_s: float, delay_s: float = 0.0, rest: Array | None = None
) -> Array:
    """Return a first-order lag's response to delayed inputs (r, ...) at increasing times (r,), same shape.

    `rest`: where input and output are before the first row, shape (...); by default at zero.
    """
    if lag_s == 0.0 and delay_s == 0.0:
        return values
    start = np.zeros(values.shape[1:]) if rest is None else rest
    error = _all_errors(time_s, values, lag_s, start)
    if delay_s == 0.0:
        return values + error
    # Each row shows what left `delay_s` before: at `since` after an earlier row, nothing before the first.
    asked = time_s - delay_s
    row = np.searchsorted(time_s, asked, side="right") - 1
    begun = row >= 0
    row = row[begun]
    since = asked[begun] - time_s[row]
    after = np.minimum(row + 1, len(time_s) - 1)
    step = np.maximum(time_s[after] - time_s[row], _TINY)
    slope_part = (values[after] - values[row]) * _column(since / step, values)
    result = np.empty(values.shape)
    result[:] = start
    result[begun] = (
        values[row]
        + slope_part
        + error[row] * _column(_remaining(since, lag_s), values)
        + slope_part * _column(_mean_lag(since, lag_s), values)
    )
    return result


def _all_errors(time_s: Array, values: Array, lag_s: float, rest: Array) -> Array:
    """Return y - u at the rows, shape (r, ...)."""
    if lag_s == 0.0:
        return np.zeros(values.shape)
    step = np.diff(time_s)
    error = np.empty((len(values), math.prod(values.shape[1:])))
    flat = np.ascontiguousarray(values, dtype=float).reshape(error.shape)
    _errors(flat, _remaining(step, lag_s), _mean_lag(step, lag_s), np.ravel(rest), error)
    return error.reshape(values.shape)


def _remaining(since_s: Array, lag_s: float) -> Array:
    """Return the share of an error that is left after `since_s`, same shape."""
    return np.exp(-since_s / lag_s) if lag_s > 0.0 else np.zeros_like(since_s)


def _mean_lag(since_s: Array, lag_s: float) -> Array:
    """Return the error after `since_s` of a straight line from rest, over the line's rise, same shape.

    -lag / t (1 - exp(-t / lag)): -1 at once, 0 long after.
    """
    if lag_s == 0.0:
        return np.zeros_like(since_s)
    times = np.maximum(since_s / lag_s, _TINY)
    return np.expm1(-times) / times


def _column(values: Array, like: Array) -> Array:
    """Return `values`, shape (r,), with as many axes as `like`."""
    return values.reshape(-1, *(1,) * (like.ndim - 1))


@dataclass(frozen=True)
class Past:
    """What a lag and a delay need to know of the past; at first, only where they began.

    Attributes:
        lag_s, delay_s: both 0 or more.
        rest: where input and output were before the first row.
        time_s: of the rows from the last one that the delay may still ask for, since the first.
        values, errors: inputs u and y - u at those rows, y without the delay.
    """

    lag_s: float
    delay_s: float
    rest: Array
    time_s: tuple[float, ...] = ()
    values: tuple[Array, ...] = ()
    errors: tuple[Array, ...] = ()


def late_step(past: Past, before: Array, after: Array, dt_s: float) -> tuple[Past, Array]:
    """Return the past and the response when the input has moved from `before` to `after`, as `lagged` does.

    The first step, to the first row, takes no time.
    """
    error = np.zeros_like(after)
    if past.lag_s > 0.0:
        last = past.errors[-1] if past.errors else past.rest - before
        since = np.array(dt_s)
        error = last * _remaining(since, past.lag_s) + (after - before) * _mean_lag(since, past.lag_s)
    times = (*past.time_s, past.time_s[-1] + dt_s if past.time_s else 0.0)
    values, errors = (*past.values, after), (*past.errors, error)
    asked = times[-1] - past.delay_s
    kept = max(sum(time <= asked for time in times) - 1, 0)
    now = replace(past, time_s=times[kept:], values=values[kept:], errors=errors[kept:])
    return now, _response(now, asked)


def _response(past: Past, time_s: float) -> Array:
    """Return the lag's response at a time from the first kept row on; rest before it."""
    since = time_s - past.time_s[0]
    if since < 0.0:
        return past.rest
    value, error = past.values[0], past.errors[0]
    if len(past.time_s) == 1:  # at that row itself
        return value + error
    slope_part = (past.values[1] - value) * (since / max(past.time_s[1] - past.time_s[0], _TINY))
    gone, rising = (part(np.array(since), past.lag_s) for part in (_remaining, _mean_lag))
    return value + slope_part + error * gone + slope_part * rising


# ----------------------------------------------------------------------------------------------------
# In how many steps a robot with friction goes from one row of inputs to the next.

_BESIDE_SHARE = 0.1  # of a step's bend, beside tendons of one end that move all but alone
_ROUNDING = 1e-9


def counts_where_alone(bend_rad: Array, alone_rad: Array, step_rad: float, alone_step_rad: float) -> Array:
    """Return how many steps rows take, longer ones where the tendons of one end move all but alone.

    `bend_rad`: by which the change of all inputs would bend a frictionless robot, (r,). `alone_rad`: the part
    of the tendons of one end, those that do most, (r,). `step_rad` of a step, `alone_step_rad` of one where
    all else bends it by less than a tenth of `step_rad`.
    """
    beside = np.ceil((bend_rad - alone_rad) / (_BESIDE_SHARE * step_rad) - _ROUNDING)
    counts: Array = np.maximum(
        np.ceil(alone_rad / alone_step_rad), np.minimum(np.ceil(bend_rad / step_rad), beside)
    )
    return counts
