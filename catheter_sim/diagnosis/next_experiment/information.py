"""How much an experiment would tell: the information between "which hypothesis" and the data that it gives.

Each hypothesis h predicts the data of a programme as a normal distribution N(m_h, S_h): its mean with the
numbers fitted so far, and the covariance S_h = s^2 I + J C J^T + (t d)(t d)^T, of the noise s, of what the
fit leaves open of its numbers (covariance C, derivative J), and of a share t by which no correction of the
model, d = m_h - m_0, is trusted (`TRUSTED_SHARE`). The information I(h; y) of hypothesis and data (Lindley
1956) is what the best reader of the data would learn. Here it is what a diagnosis would learn, which is less:

    I(h; y) >= sum_h w_h E_(y|h) [ln q(h|y) - ln w_h]     [nat]

for any reader q (Barber and Agakov 2003), of weights w. Ours reads as the diagnosis does: every hypothesis g
is fitted anew to the data, so that it errs only by what it cannot follow,

    ln q(g|y) = ln w_g - sum_b min(e_gb - min_k e_kb, E) - (f_g + p_g) / 2 + const

with e_gb half the squared error left in stretch b over the noise, f_g the squares of how far its numbers
had to go from where they were, and p_g how many numbers the data then settle. Rows of one stretch err
together, so that no stretch tells more than E (`MOST_OF_STRETCH`), and hypotheses that follow one another
everywhere are never told apart, also where one of them has more numbers. The mean is taken over draws.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.thresholds import INFORMATION_DRAWS, MOST_OF_STRETCH, SURE_BELIEF


@dataclass(frozen=True)
class Predictive:
    """What a hypothesis says of an experiment's data, in units of the noise.

    Attributes:
        mean: shape (n,).
        spread: directions in which it is unsure, each times its standard deviation, shape (n, q).
    """

    mean: Array
    spread: Array


@dataclass(frozen=True)
class Information:
    """What an experiment is expected to tell.

    Attributes:
        nats: information between hypothesis and data, as a diagnosis would read them.
        settled: probability that one hypothesis then stands at `SURE_BELIEF` or more.
    """

    nats: float
    settled: float


def information(
    weights: Sequence[float],
    predicted: Sequence[Predictive],
    stretch: np.ndarray,
    seed: int = 0,
    draws: int = INFORMATION_DRAWS,
) -> Information:
    """Return what data would tell about hypotheses.

    Args:
        weights: their probabilities, shape (k,); they add up to one.
        predicted: what each says, k of them, all of the same n values.
        stretch: which stretch each value belongs to, shape (n,).
        seed: of the draws.
        draws: of data of each hypothesis.
    """
    prior = np.asarray(weights, dtype=float)
    readers = [_Reader(item, stretch) for item in predicted]
    generator = np.random.default_rng(seed)
    noise = generator.normal(size=(draws, len(stretch)))
    gain, settled = 0.0, 0.0
    for index, weight in enumerate(prior):
        own = predicted[index]
        unsure = generator.normal(size=(draws, own.spread.shape[1]))
        posterior = _posterior(prior, readers, own.mean + unsure @ own.spread.T + noise)
        gain += weight * float(np.mean(np.log(np.maximum(posterior[index], 1e-300)) - np.log(weight)))
        settled += weight * float(np.mean(posterior.max(axis=0) >= SURE_BELIEF))
    return Information(max(float(gain), 0.0), float(settled))


def from_refits(weights: Sequence[float], errors: Sequence[Sequence[Array]]) -> Information:
    """Return what data would tell, from how far each hypothesis errs that was fitted to another one's data.

    The noise is left out: where linear information says too much, since numbers go further than their
    derivatives hold, this says so.

    Args:
        weights: of the hypotheses, shape (k,).
        errors: of data of hypothesis h, fitted by g: half the squared errors by stretch over the noise,
            shape (b,), as `errors[h][g]`.
    """
    prior, gain, settled = np.asarray(weights, dtype=float), 0.0, 0.0
    for index, row in enumerate(errors):
        posterior = _weighed(prior, np.stack(row)[:, None, :], np.zeros(len(prior)))[:, 0]
        gain += prior[index] * float(np.log(max(posterior[index], 1e-300) / prior[index]))
        settled += prior[index] * float(posterior.max() >= SURE_BELIEF)
    return Information(max(float(gain), 0.0), float(settled))


class _Reader:
    """A hypothesis that is fitted anew to data."""

    def __init__(self, predicted: Predictive, stretch: np.ndarray) -> None:
        self._predicted = predicted
        labels = np.unique(stretch, return_inverse=True)[1]
        self._in_stretch = np.eye(int(labels.max()) + 1)[labels]
        square = predicted.spread.T @ predicted.spread
        self._solve = np.linalg.solve(np.eye(len(square)) + square, predicted.spread.T)
        self.settles = float(np.trace(self._solve @ predicted.spread))

    def __call__(self, data: Array) -> tuple[Array, Array]:
        """Return half the squared errors by stretch (d, b) and the squares of how far numbers went (d,)."""
        off = data - self._predicted.mean
        moved = off @ self._solve.T
        left = off - moved @ self._predicted.spread.T
        return 0.5 * left**2 @ self._in_stretch, (moved**2).sum(axis=1)


def _posterior(prior: Array, readers: Sequence[_Reader], data: Array) -> Array:
    """Return the probability of each hypothesis for rows of data, shape (k, d)."""
    read = [reader(data) for reader in readers]
    beside = np.stack([0.5 * (far + reader.settles) for (_, far), reader in zip(read, readers, strict=True)])
    return _weighed(prior, np.stack([errors for errors, _ in read]), beside)


def _weighed(prior: Array, errors: Array, beside: Array) -> Array:
    """Return probabilities, shape (k, d).

    Args:
        prior: shape (k,).
        errors: half the squared errors by stretch, shape (k, d, b).
        beside: what else speaks against each, shape (k, d) or (k,).
    """
    against = np.minimum(errors - errors.min(axis=0), MOST_OF_STRETCH).sum(axis=-1)
    beside = beside.reshape(len(prior), -1)
    against = against + np.minimum(beside - beside.min(axis=0), MOST_OF_STRETCH)
    logs = np.log(np.maximum(prior, 1e-300))[:, None] - against
    return np.asarray(np.exp(logs - logsumexp(logs, axis=0)))
