"""The static models of the spacer-disk robot beside those of their authors' program.

tdcr-modeling (Rao et al. 2021, doi 10.3389/frobt.2020.630245, in C++) is not on a registry. Its times are
medians of its solvers with tolerances of 1e-10 and 1e-8, at ten disks a segment, from a shared machine of two
cores; this package's tips are held to the same solutions by `validate spacer_disk`. A loop is timed too: the
ratio takes that machine to run it in `LOOP_THERE_S`, which is assumed (measured on another of its kind).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.core.inputs import Inputs
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.robots.continuum.published import spacer_disk
from catheter_sim.theory.static_models import STATIC_MODELS
from peers.rods import shortest

THEIRS_S = {"CC": 1.1e-6, "CC_sub": 10e-3, "PRB": 350e-3, "VC": 53e-3, "VC_ref": 160e-3}
LOOP_THERE_S = 0.0165  # assumed: see above
FULL_PULL_N = 5.55329741  # Rao 2021, Eq. 55
_LOOP = 10_000_000
_ROWS = 1000


@dataclass(frozen=True)
class Ratio:
    """A static model's time, and its authors'.

    Attributes:
        model: its name.
        one_s: of a configuration by itself here, median of the fifteen pulls of Rao 2021 [s].
        batch_s: of one in a batch of 1000, one thread [s].
        theirs_s: of the authors' program, on its machine [s].
        times: theirs over `one_s`, both on the machine at hand; see the module's text.
    """

    model: str
    one_s: float
    batch_s: float
    theirs_s: float
    times: float


@compiled
def _loop(count: int) -> float:
    """Do sums and products that wait for one another."""
    value = 0.5
    for _ in range(count):
        value = value * 0.999 + 0.001
    return value


def measure(turns: int) -> list[Ratio]:
    """Return a row for each model; times are the processor's, the shortest of `turns`."""
    robot, none = spacer_disk(), np.zeros(3)
    _loop(1)
    loop_s = shortest(lambda: _loop(_LOOP), turns)
    cases = [np.array([[case >> k & 1 for k in range(4)]]) * FULL_PULL_N for case in range(1, 16)]
    pulls = [_inputs(case) for case in cases]
    many = _inputs(np.random.default_rng(0).uniform(0.0, FULL_PULL_N, (_ROWS, 4)))
    rows = []
    for name, theirs in THEIRS_S.items():
        solve = STATIC_MODELS[name].solve
        solve(robot, many, none)
        solve(robot, pulls[0], none)
        ones = [
            shortest(lambda pull=pull, solve=solve: solve(robot, pull, none), turns)  # type: ignore[misc]
            for pull in pulls
        ]
        one = float(np.median(ones))
        batch = shortest(lambda solve=solve: solve(robot, many, none), turns) / _ROWS  # type: ignore[misc]
        rows.append(Ratio(name, one, batch, theirs, theirs * loop_s / LOOP_THERE_S / one))
    return rows


def text(rows: Sequence[Ratio]) -> str:
    """Return the rows as a table for people."""
    head = f"{'spacer_disk, ten disks':<27} {'one':>9} {'in batch':>9} {'tdcr-modeling':>14} {'over one':>9}"
    lines = [head, "-" * len(head)]
    lines += [
        f"{row.model:<27} {row.one_s * 1e6:>6.0f} us {row.batch_s * 1e6:>6.1f} us "
        f"{row.theirs_s * 1e6:>11.1f} us {row.times:>8.3g}x"
        for row in rows
    ]
    lines.append(
        "tdcr-modeling: its authors' C++, timed on another machine; the ratio by a loop timed here and\n"
        "               assumed there; its CC, a formula, is called from C++, ours from Python"
    )
    return "\n".join(lines)


def _inputs(tension: np.ndarray) -> Inputs:
    rows = len(tension)
    return Inputs(np.arange(float(rows)), "tension", tension, np.zeros((rows, 3)), np.zeros((rows, 3)))
