"""What remembers the way but not the time: plays, friction bands, slack. Arrays are (rows, columns)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.arrays import Array


def within(lower: Array, upper: Array, start: float = 0.0) -> Array:
    """Return what lies between two bounds and moves only when one of them pushes it.

    That is dry friction without inertia: y stays where it is unless it leaves [lower, upper]
    (Krasnosel'skii and Pokrovskii 1989, the play operator with any bounds).

    Args:
        lower, upper: bounds at each row, shape (r, c), lower <= upper.
        start: of every column before the first row.
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
