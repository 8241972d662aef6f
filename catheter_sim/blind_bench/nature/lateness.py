"""What remembers the time: lags, delays, slow actuators, viscous loss, creep. Arrays are (rows, ...)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from catheter_sim.arrays import Array

_PARTS = 8  # of the way from row to row, where no closed form is at hand
_LOG_TIMES = (1.0, 4.0, 16.0, 64.0)  # of the shortest time: a logarithm over two and a half decades


def lag(time_s: Array, u: Array, tau_s: float) -> Array:
    """Return the solution of tau y' = u - y with `u` linear from row to row, from y = u at the first row."""
    found = np.array(u, dtype=float)
    if tau_s <= 0.0:
        return found
    for row in range(1, len(u)):
        duration = time_s[row] - time_s[row - 1]
        slope = (u[row] - u[row - 1]) / duration
        behind = found[row - 1] - u[row - 1] + slope * tau_s
        found[row] = u[row] - slope * tau_s + behind * np.exp(-duration / tau_s)
    return found


def delay(time_s: Array, u: Array, by_s: float) -> Array:
    """Return y(t) = u(t - by); before the first row `u` was as there."""
    flat = u.reshape(len(u), -1)
    late = [np.interp(time_s - by_s, time_s, column) for column in flat.T]
    return np.array(late).T.reshape(u.shape)


def two_lags(time_s: Array, u: Array, tau_s: float) -> Array:
    """Return two equal lags of tau / 2 in a row: it starts without a slope, as a heavy or a long drive."""
    return _finely(time_s, u, lambda t, v: lag(t, lag(t, v, 0.5 * tau_s), 0.5 * tau_s))


def slew(time_s: Array, u: Array, most_per_s: float) -> Array:
    """Return what follows `u` at no more than a speed: a motor at its limit."""
    if not np.isfinite(most_per_s):
        return np.array(u, dtype=float)

    def follow(t: Array, v: Array) -> Array:
        found = np.array(v, dtype=float)
        for row in range(1, len(v)):
            step = most_per_s * (t[row] - t[row - 1])
            found[row] = found[row - 1] + np.clip(v[row] - found[row - 1], -step, step)
        return found

    return _finely(time_s, u, follow)


def speed(time_s: Array, u: Array) -> Array:
    """Return the slope of the way to each row; zero at the first one."""
    duration = np.diff(time_s).reshape(-1, *(1,) * (u.ndim - 1))
    return np.concatenate([np.zeros_like(u[:1]), np.diff(u, axis=0) / duration])


def viscous_loss(time_s: Array, u: Array, loss_s: float, reference: float, power: float = 0.6) -> Array:
    """Return u - loss reference sign(v) (|v| / reference)^power: oil that thins as it is sheared
    (Ostwald and de Waele's power law). `reference` is a speed."""
    v = speed(time_s, u)
    return u - loss_s * reference * np.sign(v) * (np.abs(v) / reference) ** power


def stribeck(time_s: Array, u: Array, width: float, reference: float, sliding_share: float = 0.2) -> Array:
    """Return a play whose width falls from `width` at rest to a share of it in fast motion.

    w(v) = w (s + (1 - s) exp(-(v / reference)^2)) (Armstrong-Helouvry 1994, the Stribeck curve).
    """
    fall = np.exp(-((speed(time_s, u) / reference) ** 2))
    half = 0.5 * width * (sliding_share + (1.0 - sliding_share) * fall)
    found = np.empty_like(u)
    now = np.zeros(u.shape[1:])
    for row in range(len(u)):
        now = np.clip(now, u[row] - half[row], u[row] + half[row])
        found[row] = now
    return found


def creep(time_s: Array, u: Array, times_s: Sequence[float]) -> Array:
    """Return by how much `u` creeps on: the mean of Kelvin-Voigt elements with these times, from rest."""
    from_rest = u - u[:1]
    return np.mean([lag(time_s, from_rest, tau) for tau in times_s], axis=0)


def log_creep(time_s: Array, u: Array, shortest_s: float) -> Array:
    """Return creep by about log(1 + t / shortest) under a held `u`, by four elements in geometric order."""
    return creep(time_s, u, [shortest_s * factor for factor in _LOG_TIMES])


def _finely(time_s: Array, u: Array, follow: Callable[[Array, Array], Array]) -> Array:
    """Return `follow` on rows that are cut into parts, at the rows."""
    rows = np.arange(len(time_s))
    fine = np.linspace(0.0, len(time_s) - 1.0, (len(time_s) - 1) * _PARTS + 1)
    t = np.interp(fine, rows, time_s)
    flat = u.reshape(len(u), -1)
    v = np.array([np.interp(fine, rows, column) for column in flat.T]).T
    return follow(t, v)[::_PARTS].reshape(u.shape)
