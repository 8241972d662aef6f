"""Count what the static models of the spacer-disk robot compute, and compare it with what the processor can.

    python scripts/bound_statics.py

For every compiled model: the floating-point operations of one configuration, the time of one configuration by
itself and in a batch of 1000 (`benchmark_statics.py`), and the rate of operations of both. Above the table
stand the rates that the same processor reaches where nothing waits: eight independent sums of products in the
processor's vectors, and the same with single numbers. "At the peak" is how long a configuration would take
at the vectors' rate.

The operations are counted, not estimated: the solvers' own source runs once without compilation, on numbers
that count each sum, difference, product, quotient and root; so a sine counts as the 38 operations of
`eight.sine_cosine`. Where a tendon is slack the source leaves work out; the rows counted have none.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

COUNT = "--count"  # run in a process of its own, without compilation
COUNTED_ROWS = 3
if COUNT in sys.argv:
    os.environ["NUMBA_DISABLE_JIT"] = "1"

import numpy as np
from benchmark_statics import FULL_PULL_N, LUMPED, RODS, ROWS, best_s, solver_of

from catheter_sim.mechanics import eight
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.robots.continuum import (
    lumped,
    lumped_kernels,
    rod_balance,
    rod_sections,
    rods,
)
from catheter_sim.robots.continuum.published import spacer_disk
from catheter_sim.robots.continuum.rod_sections import TENDONS
from catheter_sim.robots.continuum.rods import RodLoad, load, problem
from catheter_sim.validation.lines import given

SINE_COSINE = 38  # operations of both together: `eight.sine_cosine`
_PEAK_ROUNDS = 20_000


class Counted:
    """A number that counts what is done with it."""

    total = 0

    def __init__(self, value: float) -> None:
        self.value = float(value)

    def __float__(self) -> float:
        return self.value

    def __int__(self) -> int:
        return int(self.value)

    def __abs__(self) -> Counted:
        return Counted(abs(self.value))

    def __neg__(self) -> Counted:
        return Counted(-self.value)

    def __lt__(self, other: Any) -> bool:
        return self.value < float(other)

    def __le__(self, other: Any) -> bool:
        return self.value <= float(other)

    def __gt__(self, other: Any) -> bool:
        return self.value > float(other)

    def __eq__(self, other: object) -> bool:
        return self.value == float(other)  # type: ignore[arg-type]

    __hash__ = None  # type: ignore[assignment]


def _counting(name: str) -> Callable[[Any, Any], Counted]:
    """Return an operator of `Counted` that counts itself."""
    plain = getattr(float, name)

    def operator(self: Any, other: Any) -> Counted:
        Counted.total += 1
        return Counted(plain(float(self), float(other)))

    return operator


for _name in ("add", "sub", "mul", "truediv", "pow"):
    setattr(Counted, f"__{_name}__", _counting(f"__{_name}__"))
    setattr(Counted, f"__r{_name}__", _counting(f"__r{_name}__"))


def _root(x: Any, plain: Callable[[float], float] = math.sqrt) -> Counted:
    Counted.total += 1
    return Counted(plain(float(x)))


def _sine_cosine(x: Any, sine: Any = math.sin, cosine: Any = math.cos) -> tuple[Counted, Counted]:
    Counted.total += SINE_COSINE
    return Counted(sine(float(x))), Counted(cosine(float(x)))


def counted(values: Any) -> Any:
    """Return an array of numbers as one of `Counted`."""
    result = np.empty(np.shape(values), dtype=object)
    for place, value in np.ndenumerate(values):
        result[place] = Counted(value)
    return result


def all_counted(value: Any) -> Any:
    """Return arrays of numbers, in named tuples too, as those of `Counted`."""
    if isinstance(value, tuple):
        return type(value)(*map(all_counted, value))
    return counted(value) if isinstance(value, np.ndarray) and value.dtype == float else value


def hand_on(answers: Sequence[Any], given_arrays: Sequence[Any]) -> None:
    """Fill arrays with the numbers of those that `all_counted` made of them."""
    for answer, given_array in zip(answers, given_arrays, strict=True):
        if isinstance(answer, tuple):
            hand_on(answer, given_array)
        elif given_array is not answer:
            given_array[...] = answer.astype(float)


def rows_of(rows: int) -> tuple[Any, RodLoad]:
    """Return the robot and the first rows of the batch of `benchmark_statics`."""
    robot = problem(spacer_disk())
    batch = given(np.random.default_rng(0).uniform(0.0, FULL_PULL_N, (ROWS, 4))[:rows])
    return robot, load(robot, batch, np.zeros(3))


def count(name: str) -> float:
    """Return the operations of one row from rest; a model's guess by CC_sub is included."""
    body, rows = rows_of(COUNTED_ROWS)
    where, solver = (lumped, "solve_rows") if name in LUMPED else (rods, "follow")
    plain = getattr(where, solver)

    def solve(*arguments: Any) -> None:
        """Solve with numbers that count, and hand on the answers."""
        numbers = [all_counted(argument) for argument in arguments]
        plain(*numbers)
        hand_on(numbers, arguments)

    setattr(where, solver, solve)
    Counted.total = 0
    for k in range(COUNTED_ROWS):
        row = RodLoad(*(values[k : k + 1] for values in (rows.tension_N, rows.force_N, rows.moment_N_m)))
        if name in LUMPED:
            lumped.equilibria(body, row, LUMPED[name])
        else:
            rods.equilibria(body, row, RODS[name])
    setattr(where, solver, plain)
    return Counted.total / COUNTED_ROWS


def _one_by_one(*arguments: Any) -> None:
    """Stand in for `sections.sections`, which fills eight lanes: section after section, on plain numbers."""
    workspace = counted(np.zeros(TENDONS + 3 * len(arguments[2])))
    rod_sections.sections_of_eights(*arguments[:7], workspace, *arguments[8:])


def count_all() -> None:
    """Print every model's operations as JSON; without compilation."""
    math.sqrt = _root  # type: ignore[assignment]
    lumped_kernels.sine_cosine = _sine_cosine
    rod_balance.sections = _one_by_one
    print(json.dumps({name: count(name) for name in (*LUMPED, *RODS)}))


@compiled
def _peak(a: Any, rounds: int) -> float:
    """Do 2 x 8 x 12 operations a round, none of which waits for another one of its round."""
    v = eight.eights(a)
    x0, x1, x2, x3, x4, x5 = v[0], v[1], v[2], v[3], v[4], v[5]
    x6, x7, x8, x9, xa, xb = v[6], v[7], v[8], v[9], v[10], v[11]
    b, c = v[12], v[13]
    for _ in range(rounds):
        x0, x1, x2, x3 = x0 * b + c, x1 * b + c, x2 * b + c, x3 * b + c
        x4, x5, x6, x7 = x4 * b + c, x5 * b + c, x6 * b + c, x7 * b + c
        x8, x9, xa, xb = x8 * b + c, x9 * b + c, xa * b + c, xb * b + c
    total = x0 + x1 + x2 + x3 + x4 + x5 + x6 + x7 + x8 + x9 + xa + xb
    return float(eight.lane(total, 0))


def main() -> int:
    """Print the table; return the exit status."""
    if COUNT in sys.argv:
        count_all()
        return 0
    counts = json.loads(
        subprocess.run(
            [sys.executable, str(Path(__file__)), COUNT], check=True, capture_output=True, text=True
        ).stdout
    )
    numbers = np.full((14, eight.LANES), 0.5)
    peak = 2 * 12 * eight.LANES * _PEAK_ROUNDS / best_s(lambda: _peak(numbers, _PEAK_ROUNDS), 20)
    body = problem(spacer_disk())
    draws = np.random.default_rng(0).uniform(0.0, FULL_PULL_N, (ROWS, 4))
    print(f"peak of sums of products in vectors of {eight.LANES}: {peak / 1e9:.1f} Gflop/s, this processor")
    _, rows = rows_of(ROWS)
    print(f"{1.0 - rods.far_from_before(body, rows).mean():.0%} of the batch's rows follow the row before")
    print(
        f"{'':14}{'kflop':>7}{'one: us':>9}{'compiled':>10}{'Gflop/s':>9}{'batch: us':>11}{'Gflop/s':>9}"
        f"{'at the peak':>13}{'ratio':>7}{'compiled':>10}"
    )
    for name in (*LUMPED, *RODS):
        one = float(np.median([best_s(solver_of(name, body, given(draws[[k]]), 1), 30) for k in range(8)]))
        few = best_s(solver_of(name, body, given(draws[: eight.LANES - 1]), 1), 30)
        first = best_s(solver_of(name, body, given(draws[:1]), 1), 30)
        compiled_part = (few - first) / (eight.LANES - 2)
        batch = best_s(solver_of(name, body, given(draws), 1), 7) / ROWS
        flop = counts[name]
        print(
            f"{name:14}{flop / 1e3:7.0f}{one * 1e6:9.1f}{compiled_part * 1e6:10.1f}"
            f"{flop / compiled_part / 1e9:9.1f}{batch * 1e6:11.1f}{flop / batch / 1e9:9.1f}"
            f"{flop / peak * 1e6:13.1f}{one / batch:7.1f}{compiled_part / batch:10.1f}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
