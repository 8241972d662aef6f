"""What comes late: a first-order lag and a delay, exact where the input moves on straight lines, from rest.

The output y follows lag_s dy/dt = u(t - delay_s) - y. While u is a straight line u_0 + s t,
y = u - s lag + (y_0 - u_0 + s lag) exp(-t / lag); a first row that is not at rest is a step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled

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
    """Return a first-order lag's response to delayed inputs, shape (r, ...).

    Args:
        time_s: increasing, shape (r,).
        values: inputs u at the rows, shape (r, ...).
        lag_s: time constant, 0 or more [s].
        delay_s: 0 or more [s].
        rest: where input and output are before the first row, shape (...); by default at zero.
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
