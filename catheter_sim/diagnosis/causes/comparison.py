"""Which of two fitted hypotheses is better on stretches left out, by more than chance allows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.fitting.evidence import chance_of_gain, residual_series
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.noise import residual_noise
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.thresholds import (
    EQUAL_FACTOR,
    MENDING_NUMBERS,
    PAYS_CHANCE,
    PAYS_SHARE,
    SETTLED_FACTOR,
    WILD_ERROR,
)


def pays(before: Fit, after: Fit, chance: float = PAYS_CHANCE) -> bool:
    """Return whether `after` explains left-out stretches better than `before` by more than chance.

    Of a rough fit (`Fit.rough`) the errors on them are known from below alone: it never pays, and what is
    better than it pays.
    """
    share = 1.0 - after.cross_validated_rms / max(before.cross_validated_rms, 1e-300)
    if before.rough or after.rough:
        return share > PAYS_SHARE and not after.rough
    labels = np.unique(before.block, return_inverse=True)[1]
    change = np.bincount(labels, weights=before.left_out**2 - after.left_out**2).astype(float)
    return share > PAYS_SHARE and chance_of_gain(change) <= chance


def as_good(best: Fit, other: Fit) -> bool:
    """Return whether `other` does as well as `best` on stretches left out (by chance and `EQUAL_FACTOR`)."""
    near = other.cross_validated_rms <= EQUAL_FACTOR * best.cross_validated_rms
    return near and not other.rough and not pays(other, best)


def settled(problem: Problem, best: Fit, factor: float = SETTLED_FACTOR) -> bool:
    """Return whether a hypothesis leaves no more than `factor` times what is white from row to row.

    A wild row counts as `WILD_ERROR`; of a robot in motion all of it, as there a cause may show in few rows.
    """
    series = residual_series(problem, best)
    for unit, size in residual_noise(problem, best).items():
        errors = np.concatenate([part for name in series if unit_of(name) == unit for part in series[name]])
        most = np.inf if problem.moving else WILD_ERROR * size
        tame = np.clip(errors, -most, most)
        if np.sqrt(np.nanmean(tame**2)) > factor * size:
            return False
    return True


def settled_in_motion(problem: Problem, best: Fit) -> bool:
    """Return whether a hypothesis is settled where a further step costs minutes: of a robot in motion."""
    return problem.moving and settled(problem, best)


def within_model(problem: Problem, null: Fit, best: Fit) -> bool:
    """Return whether what a hypothesis leaves is no more than a model as wrong as this one may leave."""
    if not problem.model_share:
        return False
    noise = noise_in_weights(problem, best)
    return best.cross_validated_rms**2 <= noise**2 + (problem.model_share * null.cross_validated_rms) ** 2


def noise_in_weights(problem: Problem, best: Fit) -> float:
    """Return the white part of what a hypothesis leaves, of all outputs together, in weights."""
    white = residual_noise(problem, best)
    pairs = zip(problem.columns, problem.weight, strict=True)
    sizes = [white[unit_of(name)] / weight for name, weight in pairs]
    return float(np.sqrt(np.mean(np.square(sizes))))


def may_replace(problem: Problem, chosen: Fit, other: Fit) -> bool:
    """Return whether a better hypothesis may stand in a chosen one's place.

    Of a model that is known to be wrong, more numbers only mend the model (`Problem.model_share`).
    """
    return not problem.model_share or len(other.numbers) <= len(chosen.numbers)


def only_mends(problem: Problem, chosen: Fit, other: Fit) -> bool:
    """Return whether a hypothesis says nothing against a chosen one, since its numbers only mend the model.

    It has more than `MENDING_NUMBERS` more, of a model that is known to be wrong (`Problem.model_share`).
    """
    more = len(other.numbers) - len(chosen.numbers)
    return bool(problem.model_share) and more > MENDING_NUMBERS


def rivals_of(chosen: Fit, fits: Sequence[Fit]) -> list[tuple[str, str, Fit]]:
    """Return the fits in which another effect stands in the place of a chosen one. Each with the name of the
    chosen effect and of the other. The other effect may be chosen too, with other numbers: offsets of all
    channels, say, in the place of a bent joint and a common offset.
    """
    named = set(chosen.causes)
    found = []
    for item in fits:
        gone = named - set(item.causes)
        come = set(item.causes) - named or {term.effect for term in item.terms if term not in chosen.terms}
        if len(gone) == len(come) == 1:
            found.append((gone.pop(), come.pop(), item))
    return found


def rival_groups(chosen: Fit, equals: Sequence[Fit]) -> tuple[tuple[str, ...], ...]:
    """Return each chosen effect with those that stand in its place in `equals`."""
    groups: dict[str, list[str]] = {}
    for name, rival, _ in rivals_of(chosen, equals):
        group = groups.setdefault(name, [name])
        if rival not in group:
            group.append(rival)
    return tuple(tuple(group) for group in groups.values())
