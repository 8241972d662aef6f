"""What depends on time: a first-order lag and a delay of inputs, exact between rows, from rest."""

from __future__ import annotations

import numpy as np

from catheter_sim.errors import InputError
from catheter_sim.robots.posture import Array


def elapsed_s(time_s: Array, effect: str) -> Array:
    """Return the time since the trial's start, its first row, shape (r,) [s].

    Args:
        time_s: of the rows, shape (r,).
        effect: which needs it, for the message.

    Raises:
        InputError: the clock stands still or runs back.
    """
    stands = np.diff(time_s) <= 0.0
    if stands.any():
        row = int(np.argmax(stands)) + 1
        raise InputError(
            f"effects.{effect}: time_s = {time_s[row]:g} at row {row + 1} does not increase: "
            "this effect needs the time of every row"
        )
    return time_s - time_s[0]


def lagged(time_s: Array, values: Array, lag_s: float, delay_s: float = 0.0) -> Array:
    """Return a first-order lag's response to delayed inputs, shape (r, ...), from rest at zero.

    The output y follows lag_s dy/dt = u(t - delay_s) - y with y = u = 0 before the first row. From row to
    row u is a straight line u_0 + s t, for which y = u - s lag + (y_0 - u_0 + s lag) exp(-t / lag) is exact;
    a first row that is not zero is a step.

    Args:
        time_s: increasing, shape (r,).
        values: inputs u at the rows, shape (r, ...).
        lag_s: time constant, 0 or more [s].
        delay_s: 0 or more [s].
    """
    if lag_s == 0.0 and delay_s == 0.0:
        return values
    error = _errors(time_s, values, lag_s)
    # Each row shows what left `delay_s` before: at `since` after an earlier row, nothing before the first.
    asked = time_s - delay_s
    row = np.searchsorted(time_s, asked, side="right") - 1
    begun = row >= 0
    row = row[begun]
    since = asked[begun] - time_s[row]
    after = np.minimum(row + 1, len(time_s) - 1)
    step = np.maximum(time_s[after] - time_s[row], np.finfo(float).tiny)
    share = _column(since / step, values)
    slope_part = (values[after] - values[row]) * share
    result = np.zeros_like(values)
    result[begun] = (
        values[row]
        + slope_part
        + error[row] * _column(_remaining(since, lag_s), values)
        + slope_part * _column(_mean_lag(since, lag_s), values)
    )
    return result


def _errors(time_s: Array, values: Array, lag_s: float) -> Array:
    """Return y - u at the rows, shape (r, ...)."""
    error = np.zeros_like(values)
    if lag_s == 0.0:
        return error
    step = np.diff(time_s)
    remaining = _remaining(step, lag_s)
    added = np.diff(values, axis=0) * _column(_mean_lag(step, lag_s), values)
    error[0] = -values[0]
    for row in range(len(step)):
        error[row + 1] = error[row] * remaining[row] + added[row]
    return error


def _remaining(since_s: Array, lag_s: float) -> Array:
    """Return the share of an error that is left after `since_s`, same shape."""
    return np.exp(-since_s / lag_s) if lag_s > 0.0 else np.zeros_like(since_s)


def _mean_lag(since_s: Array, lag_s: float) -> Array:
    """Return the error after `since_s` of a straight line from rest, over the line's rise, same shape.

    -lag / t (1 - exp(-t / lag)): -1 at once, 0 long after.
    """
    if lag_s == 0.0:
        return np.zeros_like(since_s)
    times = np.maximum(since_s / lag_s, np.finfo(float).tiny)
    return np.expm1(-times) / times


def _column(values: Array, like: Array) -> Array:
    """Return `values`, shape (r,), with as many axes as `like`."""
    return values.reshape(-1, *(1,) * (like.ndim - 1))
