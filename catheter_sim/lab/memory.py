"""What remembers the way or the time: plays, friction bands, slack, lags, creep; written a second time."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.arrays import Array

# ----------------------------------------------------------------------------------------------------
# What remembers the way but not the time: plays, friction bands, slack. Arrays are (rows, columns).


def within(lower: Array, upper: Array, start: float = 0.0) -> Array:
    """Return what lies between two bounds and moves only when one of them pushes it.

    That is dry friction without inertia: y stays where it is unless it leaves [lower, upper] (Krasnosel'skii
    and Pokrovskii 1989, the play operator with any bounds). The bounds have the shape (r, c), lower <= upper;
    `start` is that of every column before the first row.
    """
    found = np.empty_like(lower)
    now = np.full(lower.shape[1:], start)
    for row in range(len(lower)):
        now = np.minimum(np.maximum(now, lower[row]), upper[row])
        found[row] = now
    return found


def play(u: Array, width: ArrayLike) -> Array:
    """Return what follows `u` through a dead-band of the whole `width`, which starts centred."""
    half = 0.5 * np.broadcast_to(np.asarray(width, dtype=float), u.shape)
    return within(u - half, u + half)


def smooth_play(u: Array, width: ArrayLike, plays: int = 8) -> Array:
    """Return the mean of plays whose widths are spread evenly over 0 to twice `width`.

    After a reversal the parts let go one after the other, so that the loop's corners are round
    (Prandtl and Ishlinskii's operator).
    """
    shares = (np.arange(plays) + 0.5) / plays * 2.0
    return np.mean([play(u, share * np.asarray(width)) for share in shares], axis=0)


def soft_play(u: Array, width: ArrayLike, through: float) -> Array:
    """Return a play beside a spring: the share `through` of `u` passes the dead-band at once."""
    return through * u + (1.0 - through) * play(u, width)


def capstan(tension: Array, turn: float) -> Array:
    """Return the tension behind a bend: it lies in [T exp(-turn), T exp(turn)] (Euler).

    `turn` is the coefficient of friction times the angle [rad].
    """
    return within(tension * np.exp(-turn), tension * np.exp(turn))


def pressed(u: Array, coefficient: float, from_input: float) -> Array:
    """Return what passes a wall that is touched beyond `from_input`: half the band is
    `coefficient` times what exceeds it (Coulomb, normal force in proportion)."""
    half = coefficient * np.maximum(np.abs(u) - from_input, 0.0)
    return within(u - half, u + half)


def hole_tensions(tension: Array, loss: float, holes: int) -> Array:
    """Return the tensions behind each of several holes, shape (holes, r, c).

    Each hole holds back up to `loss`, whatever the tension: T_k in [T_(k-1) - loss, T_(k-1) + loss], never
    below zero.
    """
    found = []
    now = tension
    for _ in range(holes):
        now = np.maximum(within(np.maximum(now - loss, 0.0), now + loss), 0.0)
        found.append(now)
    return np.array(found)


def slack(u: Array, lost: ArrayLike) -> Array:
    """Return what a pair draws whose tendons are too long by `lost`: sign(u) max(|u| - lost, 0)."""
    return np.sign(u) * np.maximum(np.abs(u) - np.asarray(lost), 0.0)


def largest_so_far(u: Array) -> Array:
    """Return the running maximum of each column, from zero."""
    return np.maximum.accumulate(np.maximum(u, 0.0), axis=0)


def turning_points(u: Array) -> Array:
    """Return how often each column has turned back before each row, shape (r, c)."""
    found = np.zeros_like(u)
    for column in range(u.shape[1]):
        way, count = 0.0, 0
        for row in range(1, len(u)):
            step = np.sign(u[row, column] - u[row - 1, column])
            if step and way and step != way:
                count += 1
            way = step or way
            found[row, column] = count
    return found


# ----------------------------------------------------------------------------------------------------
# What remembers the time: lags, delays, slow actuators, viscous loss, creep. Arrays are (rows, ...).

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
