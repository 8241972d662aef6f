"""By which factor a tension may change over a hole: the capstan's exponential."""

from __future__ import annotations

import math

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled_in_place

SMALL = 0.1  # of x in exp(x): the first term that its series leaves out, x^10 / 10!, is below 3e-17


@compiled_in_place
def capstan_factors(mu: float, turn: Array, count: int, factor: Array, shrink: Array) -> None:
    """Write exp(mu turn) and one over it into `factor` and `shrink`, shape (n,), of the first `count` turns.

    Where all are small, as nearly always, by the even and odd parts of the series, several at once.
    """
    large = 0
    for k in range(count):
        large += mu * turn[k] > SMALL
    if large > 0:
        for k in range(count):
            factor[k] = math.exp(mu * turn[k])
            shrink[k] = 1.0 / factor[k]
        return
    for k in range(count):
        x = mu * turn[k]
        s = x * x
        even = 1.0 + s * (1 / 2 + s * (1 / 24 + s * (1 / 720 + s / 40320)))
        odd = x * (1.0 + s * (1 / 6 + s * (1 / 120 + s * (1 / 5040 + s / 362880))))
        factor[k], shrink[k] = even + odd, even - odd
