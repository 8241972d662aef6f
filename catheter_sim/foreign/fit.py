"""Numbers of causes fitted to recordings, and the evidence that a fit has.

Errors are counted in units of the noise. Those of rows within `BLOCK_S` are one error and not many, so that a
fit has the evidence (Schwarz 1978, with an unknown size of the errors)

    ln p(y|h) = - n / 2 ln S - p / 2 ln n + const

of n blocks of columns, their mean square S, and p numbers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares, lsq_linear

from catheter_sim.arrays import Array
from catheter_sim.foreign.model import ForeignTrial, Number, Runner, Values, Variant

BLOCK_S = 0.5  # rows closer than this err together, and count as one
STEPS = 6  # of a fit, of its Jacobian
_STEP = 0.05  # of a number's scale, for slopes
_FAR = 1e4  # times the noise: larger errors count as that


@dataclass(frozen=True)
class ForeignFit:
    """Numbers that were fitted.

    Attributes:
        variants: what was freed; (): nothing.
        values: of the numbers, in their units.
        spread: standard deviation of each number, in its unit; infinite where the data say nothing.
        mean_square: of the training errors in units of the noise.
        evidence: see the module's text.
    """

    variants: tuple[Variant, ...]
    values: Mapping[Number, float]
    spread: Mapping[Number, float]
    mean_square: float
    evidence: float

    @property
    def causes(self) -> tuple[str, ...]:
        """The names of its causes, in order."""
        return tuple(item.cause for item in self.variants)


class Fitter:
    """Fits numbers to trials."""

    def __init__(self, runner: Runner, trials: Sequence[ForeignTrial], noise: Array) -> None:
        """Take the training trials and the noise of each output, shape (o,)."""
        self._runner, self._trials, self._noise = runner, tuple(trials), noise
        self._there = [np.isfinite(trial.outputs) for trial in trials]
        self.blocks = sum(_blocks(trial) for trial in trials)

    def residuals(self, many: Sequence[Values]) -> Array:
        """Return the errors of many sets of numbers in units of the noise, shape (b, n)."""
        found = self._runner.outputs(many, self._trials)
        return np.stack([self._errors(outputs) for outputs in found])

    def _errors(self, outputs: Sequence[Array]) -> Array:
        parts = []
        for trial, there, own in zip(self._trials, self._there, outputs, strict=True):
            errors = (own - trial.outputs) / self._noise
            parts.append(np.clip(errors[there], -_FAR, _FAR))
        return np.concatenate(parts)

    def promised(self, base: ForeignFit, variants: Sequence[Variant]) -> list[tuple[float, Array]]:
        """Return of each variant beside a fit the evidence, and shares of its starts, by a straight line.

        Each number's change from nothing to its start is played once; what several do together is taken as
        their sum.
        """
        numbers = list(dict.fromkeys(number for item in variants for number in item.numbers))
        sets = [dict(base.values), *({**base.values, number: number.start} for number in numbers)]
        errors = self.residuals(sets)
        slopes = dict(zip(numbers, errors[1:] - errors[0], strict=True))
        found = []
        for item in variants:
            matrix = np.stack([slopes[number] for number in item.numbers], axis=1)
            low, high = zip(*(_ends(number) for number in item.numbers), strict=True)
            share = lsq_linear(matrix, -errors[0], (low, high)).x
            square = float(np.mean((errors[0] + matrix @ share) ** 2))
            found.append((self._evidence(square, len(base.values) + len(item.numbers)), share))
        return found

    def best_of(self, starts: Sequence[Values]) -> Values:
        """Return the one of several sets of numbers that leaves the least squares."""
        squares = (self.residuals(starts) ** 2).mean(axis=1)
        return starts[int(np.argmin(squares))]

    def nothing(self) -> ForeignFit:
        """Return the model as it is."""
        square = float(np.mean(self.residuals([{}])[0] ** 2))
        return ForeignFit((), {}, {}, square, self._evidence(square, 0))

    def fit(self, variants: Sequence[Variant], start: Values, steps: int = STEPS) -> ForeignFit:
        """Return the numbers of variants that leave the least squares, from a start, in so many steps.

        A number on which the data say nothing is drawn to nothing: half its range counts as one noise.
        """
        numbers = [number for item in variants for number in item.numbers]
        scale = np.array([number.scale for number in numbers])
        low = np.array([number.lower for number in numbers]) / scale
        high = np.array([number.upper for number in numbers]) / scale
        x = np.clip([start[n] for n in numbers] / scale, low + 1e-9, high - 1e-9)

        def values(at: Array) -> dict[Number, float]:
            return {number: float(v) for number, v in zip(numbers, at * scale, strict=True)}

        nothing = np.array([number.null for number in numbers]) / scale
        half = 0.5 * (high - low)
        known: dict[bytes, Array] = {}

        def errors(at: Array) -> Array:
            if at.tobytes() not in known:
                known.clear()
                own = self.residuals([values(at)])[0]
                known[at.tobytes()] = np.concatenate([own, (at - nothing) / half])
            return known[at.tobytes()]

        def slopes(at: Array) -> Array:
            here = errors(at)
            moves = np.where(at + _STEP <= high, _STEP, -_STEP)
            found = self.residuals([values(at + move * unit) for move, unit in _each(moves)])
            steep = (found - here[: -len(at)]) / moves[:, np.newaxis]
            return np.concatenate([steep.T, np.diag(1.0 / half)])

        end = least_squares(errors, x, jac=slopes, bounds=(low, high), max_nfev=steps, xtol=1e-4, ftol=1e-4)
        own = end.fun[: -len(numbers)]
        square = float(np.mean(own**2))
        spread = _spread(end.jac, square * len(own) / max(self.blocks, 1)) * scale
        return ForeignFit(
            tuple(variants),
            values(end.x),
            {number: float(s) for number, s in zip(numbers, spread, strict=True)},
            square,
            self._evidence(square, len(numbers)),
        )

    def _evidence(self, square: float, count: int) -> float:
        return -0.5 * self.blocks * math.log(max(square, 1e-12)) - 0.5 * count * math.log(max(self.blocks, 2))


def _each(steps: Array) -> list[tuple[float, Array]]:
    return [(float(step), unit) for step, unit in zip(steps, np.eye(len(steps)), strict=True)]


def _ends(number: Number) -> tuple[float, float]:
    """Return the bounds of a number as shares of the way from nothing to its start."""
    ends = sorted((end - number.null) / (number.start - number.null) for end in (number.lower, number.upper))
    return ends[0] - 1e-12, ends[1] + 1e-12


def _spread(jacobian: Array, variance: float) -> Array:
    """Return the standard deviations of numbers; infinite where data say nothing, shape (p,)."""
    square = jacobian.T @ jacobian
    values, vectors = np.linalg.eigh(square)
    known = values > 1e-12 * max(float(values.max(initial=0.0)), 1e-30)
    inverse = np.where(known, 1.0 / np.where(known, values, 1.0), np.inf)
    with np.errstate(invalid="ignore"):
        terms = np.where(vectors**2 > 1e-12, vectors**2 * inverse, 0.0)
    return np.sqrt(variance * terms.sum(axis=1))


def _blocks(trial: ForeignTrial) -> int:
    """Return of how many blocks of columns a trial's errors are."""
    block = np.floor(trial.time_s / BLOCK_S).astype(int)
    return sum(len(np.unique(block[there])) for there in np.isfinite(trial.outputs).T)
