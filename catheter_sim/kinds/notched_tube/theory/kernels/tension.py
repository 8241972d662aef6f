"""The tendon's tension along the notches' edges: the capstan's law with history."""

from __future__ import annotations

import math

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled_in_place


@compiled_in_place
def tensions(
    axes: int,
    mu: float,
    tension: float,
    inside: bool,
    kept: Array,
    behind: Array,
    n: int,
    work: tuple[Array, ...],
) -> None:
    """Fill the tensions behind the edges, and the slope of each notch's tension by all unknowns.

    Behind an edge the tension keeps its value unless it would leave [T / E, T E], E = exp(mu turn), T the
    tension before the edge. `kept`, `behind`, shape (2 n,): a moment ago, and now. `inside`: `tension` is
    that behind the first edge.
    """
    span, edges2, grows, running = work[7], work[11], work[17], work[23]
    last = n * axes
    running[: last + 1] = 0.0
    running[last] = 1.0
    here = tension
    for i in range(n):
        for edge in range(2):
            factor = math.exp(mu * span[i, 2 + edge])
            held, sense = kept[2 * i + edge], 0.0
            if held <= here / factor:
                sense, factor = -1.0, 1.0 / factor
            elif held >= here * factor:
                sense = 1.0
            if inside and i + edge == 0:
                pass
            elif sense == 0.0:
                here = held
                running[: last + 1] = 0.0
            else:
                here *= factor
                for j in range(last + 1):
                    running[j] *= factor
                for a in range(axes):
                    running[i * axes + a] += sense * mu * here * edges2[i, a, edge]
            behind[2 * i + edge] = here
            if edge == 0:
                for j in range(last + 1):
                    grows[i, j] = running[j]
