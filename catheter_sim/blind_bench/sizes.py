"""How large an effect is: by the change that it makes in the outputs, over their noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Parameter
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects import EFFECTS

SMALLEST, LARGEST = 5.0, 30.0  # times the noise, of an effect that is to be found
_TOLERANCE = 0.03
_MOST_TRIALS = 24
_FACTOR = 2.0
_INSIDE = 0.9  # of the way from the value that does nothing to a bound
_SIMPLEST = 0.6  # share of the draws that take an effect's first variant

Values = dict[str, float]
# Root mean square change of the outputs over their noise at an amplitude; NaN: not possible.
Trace = Callable[[float], float]


@dataclass(frozen=True)
class Direction:
    """A way to turn an effect on: its parameters move from what does nothing, in fixed proportions.

    Attributes:
        effect: its name.
        parameters: those that move.
        share: of each one's scale per unit of amplitude, shape (p,).
    """

    effect: str
    parameters: tuple[Parameter, ...]
    share: Array

    def values(self, amplitude: float) -> Values | None:
        """Return the parameters' values at an amplitude; None at or near a bound, where no interval is."""
        found = {}
        for item, share in zip(self.parameters, self.share, strict=True):
            null = item.to_fit(item.null)
            low, high = (null + _INSIDE * (bound - null) for bound in item.fit_bounds)
            coordinate = null + amplitude * float(share) * item.scale
            if not low <= coordinate <= high:
                return None
            found[item.name] = item.from_fit(coordinate)
        return found


def drawn_direction(robot: RobotSpec, effect: str, generator: np.random.Generator) -> Direction:
    """Return a direction in one of the effect's variants, often the first, inside the bounds near zero."""
    variants = EFFECTS[effect].variants(robot)
    simplest = len(variants) == 1 or generator.random() < _SIMPLEST
    names = variants[0 if simplest else int(generator.integers(1, len(variants)))]
    by_name = {item.name: item for item in EFFECTS[effect].parameters(robot)}
    parameters = tuple(by_name[name] for name in (names or tuple(by_name)))
    share = generator.choice((-1.0, 1.0), len(parameters)) * generator.uniform(0.3, 1.0, len(parameters))
    for index, item in enumerate(parameters):
        low, high = item.fit_bounds
        null = item.to_fit(item.null)
        if null <= low:
            share[index] = abs(share[index])
        elif null >= high:
            share[index] = -abs(share[index])
    return Direction(effect, parameters, share / np.abs(share).max())


def amplitude_for(trace: Trace, target: float) -> tuple[float, float] | None:
    """Return the amplitude at which `trace` is `target`, and the trace there, by doubling and secants.

    Where the trace ends before it reaches `target`, the largest amplitude tried that gives at least
    `SMALLEST` is returned; None if there is none.
    """
    low = high = None
    amplitude, value = 1.0, trace(1.0)
    for _ in range(_MOST_TRIALS):
        if abs(value - target) <= _TOLERANCE * target:
            return amplitude, value
        if value < target:  # False where it is NaN
            low = (amplitude, value)
        else:
            high = (amplitude, value)
        if high is None:
            amplitude *= _FACTOR
        elif low is None or low[1] <= 0.0:
            amplitude = high[0] / _FACTOR if low is None else 0.5 * (low[0] + high[0])
        else:
            amplitude = _between(low, high, target)
        if low is not None and high is not None and high[0] - low[0] < 1e-3 * high[0]:
            break
        value = trace(amplitude)
    return low if low is not None and low[1] >= SMALLEST else None


def _between(low: tuple[float, float], high: tuple[float, float], target: float) -> float:
    """Return where a line in logarithms meets `target`, kept off the ends; the middle if one end is not."""
    middle = float(np.sqrt(low[0] * high[0]))
    if not np.isfinite(high[1]) or high[1] <= low[1]:
        return middle
    share = float(np.log(target / low[1]) / np.log(high[1] / low[1]))
    return float(low[0] * (high[0] / low[0]) ** min(max(share, 0.1), 0.9))


def over_noise(outputs: Sequence[Array], others: Sequence[Array], noise: Array) -> float:
    """Return the root mean square of the difference of two sets of outputs over their columns' noise."""
    squares = [((one - other) / noise) ** 2 for one, other in zip(outputs, others, strict=True)]
    return float(np.sqrt(np.mean(np.concatenate([item.ravel() for item in squares]))))
