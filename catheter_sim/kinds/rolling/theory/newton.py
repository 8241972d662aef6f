"""Newton's method for a batch of configurations whose joints must not close their gaps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.static_run import NoEquilibrium

ANGLE_TOLERANCE_RAD = 1e-11
_MOST_ROUNDS = 60
_MOST_HALVINGS = 12
_TOWARD_LIMIT = 0.9  # of the way to a closing gap that one step may go


class NotBalanced(NoEquilibrium):
    """No posture was found for one configuration of a batch: `index` says which."""

    def __init__(self, index: int) -> None:
        """Say which configuration."""
        super().__init__("no posture close by balances the rods and the loads")
        self.index = index


# Bend angles (b, n) -> moment left at each joint (b, n) [N m] and its derivative (b, n, n) [N m/rad].
Balance = Callable[[Array], tuple[Array, Array]]


def balanced(balance: Balance, start: Array, low: Array, high: Array) -> Array:
    """Return the bend angles near `start` that leave no moment, shape (b, n) [rad].

    `balance` is called last with the angles that are returned. A step stops short of a closing gap,
    and is halved while it makes the balance worse.

    Args:
        balance: moments left and their derivative.
        start: shape (b, n) [rad].
        low, high: where the gaps close, shape (n,) [rad].

    Raises:
        NotBalanced: none was found for one configuration or more.
    """
    theta = np.array(start, dtype=float)
    value, jacobian = balance(theta)
    small = np.zeros(theta.shape[:-1], dtype=bool)
    for _ in range(_MOST_ROUNDS):
        try:
            step = -np.linalg.solve(jacobian, value[..., None])[..., 0]
        except np.linalg.LinAlgError:
            break
        room = np.where(step > 0.0, high - theta, theta - low)
        share = np.min(_TOWARD_LIMIT * room / np.maximum(np.abs(step), 1e-300), axis=-1, initial=1.0)
        before = np.abs(value).max(axis=-1)
        small = np.abs(step).max(axis=-1) < ANGLE_TOLERANCE_RAD
        for _ in range(_MOST_HALVINGS):
            following = theta + share[..., None] * step
            value, jacobian = balance(following)
            worse = (np.abs(value).max(axis=-1) > before) & ~small
            if not worse.any():
                break
            share = np.where(worse, 0.5 * share, share)
        theta = following
        if small.all():
            return theta
    raise NotBalanced(int(np.argmax(np.atleast_1d(~small))))
