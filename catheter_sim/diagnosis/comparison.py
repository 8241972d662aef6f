"""Which of two fitted hypotheses is better on data that neither was fitted to, by more than chance allows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.diagnosis.fit import Fit, blocks_of, fit, residuals
from catheter_sim.diagnosis.noise import chance_of_gain, residual_noise, residual_series
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.thresholds import EQUAL_FACTOR, PAYS_CHANCE, PAYS_SHARE
from catheter_sim.diagnosis.trials import unit_of
from catheter_sim.diagnosis.workers import SERIAL, Workers, map_calls

SETTLED_FACTOR = 1.1
"""[times the error's white part] An error within it is good enough. Then the search looks only for what one
step finds; for a robot in motion it stops. Why: what is white from row to row has no cause."""
WILD_ERROR = 3.0
"""[times the error's white part] In that comparison, a larger error of a row counts as this much. Why: one
row in a hundred at ten times the noise makes the whole error 1.4 times as large, and has no cause."""
MOST_WILD_SHARE = 0.03
"""[share of the values] If more values are so far off, they do not count as wild. Why: one row in a hundred
of a tracker may be wild. A jump late in a record is off in one row of ten."""
MENDING_NUMBERS = 1
"""[numbers] If the model is known to be wrong, a set with more extra numbers than this says nothing against a
chosen one. Why: measured on a trunk with a hung weight. There a gain and a coupling, of twelve and six
numbers, mend the bending better than a force of three explains it. One more number is assumed to be a
direction beside a size."""

# ----------------------------------------------------------------------------------------------------
# Which of two fitted hypotheses is better on stretches left out, by more than chance allows.


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


def leaves_only_noise(problem: Problem, best: Fit, factor: float = SETTLED_FACTOR) -> bool:
    """Return whether a hypothesis leaves no more than `factor` times what is white from row to row.

    A wild row counts as `WILD_ERROR`, where few are (`MOST_WILD_SHARE`); of a robot in motion all of it, as
    there a cause may show in few rows.
    """
    series = residual_series(problem, best)
    for unit, size in residual_noise(problem, best).items():
        errors = np.concatenate([part for name in series if unit_of(name) == unit for part in series[name]])
        most = WILD_ERROR * size
        if problem.moving or np.mean(np.abs(errors[np.isfinite(errors)]) > most) > MOST_WILD_SHARE:
            most = np.inf
        tame = np.clip(errors, -most, most)
        if np.sqrt(np.nanmean(tame**2)) > factor * size:
            return False
    return True


def leaves_only_noise_in_motion(problem: Problem, best: Fit) -> bool:
    """Return whether a hypothesis is good enough where a further step costs minutes: of a robot in motion."""
    return problem.moving and leaves_only_noise(problem, best)


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


# ----------------------------------------------------------------------------------------------------
# The held-out trials decide between hypotheses that do as well on the training trials.
#
# Two causes may do the same to the trials that both were fitted to, and differ on others. The held-out
# trials then choose between the few hypotheses that are left. The gain of the chosen one is a little larger
# than it would be on trials that had no part in the choice.


def choose_on_heldout(
    problem: Problem,
    test: Problem,
    chosen: Fit,
    equals: Sequence[Fit],
    thorough: bool = False,
    pool: Workers = SERIAL,
) -> tuple[Fit, tuple[Fit, ...]]:
    """Return the hypothesis that does best on the held-out trials, and those that do as well there too.

    `chosen` gives way only where another one is better by more than chance; the allowed chance is divided by
    the number of the others. `chosen` and what is returned are fitted to all training rows; `equals` explain
    the training trials as well, one other effect in each (`Selection`).
    """
    fits = [
        chosen,
        *map_calls(pool, fit, [(problem, item.terms, item.values, False, thorough) for item in equals]),
    ]
    seen = [with_heldout_residuals(test, item) for item in fits]
    chance = PAYS_CHANCE / max(len(equals), 1)
    better = [
        index
        for index in range(1, len(seen))
        if pays(seen[0], seen[index], chance) and may_replace(problem, chosen, seen[index])
    ]
    best = min(better, key=lambda index: seen[index].cross_validated_rms, default=0)
    still = [fits[index] for index, item in enumerate(seen) if index != best and as_good(seen[best], item)]
    return fits[best], tuple(item for item in still if rival_groups(fits[best], [item]))


def also_equal_on_heldout(
    problem: Problem,
    test: Problem,
    chosen: Fit,
    equals: Sequence[Fit],
    thorough: bool = False,
    pool: Workers = SERIAL,
) -> tuple[Fit, ...]:
    """Return those of `equals`, fitted to all training rows, that do as well on the held-out trials too.

    The arguments are those of `choose_on_heldout`; here `chosen` is not exchanged.
    """
    fits = map_calls(pool, fit, [(problem, item.terms, item.values, False, thorough) for item in equals])
    seen = with_heldout_residuals(test, chosen)
    return tuple(item for item in fits if as_good(seen, with_heldout_residuals(test, item)))


def heldout_choice_note(chosen: Fit, taken: Fit) -> Note:
    """Return what to say where the held-out trials took another hypothesis than the training trials."""
    gone, come = (
        ", ".join(term.effect.replace("_", " ") for term in first.terms if term not in second.terms)
        for first, second in ((chosen, taken), (taken, chosen))
    )
    return Note(
        "heldout_choice",
        f"On the training trials {gone} and {come} do equally well. The held-out trials favour {come}. They "
        "decided this choice, so the gain is slightly too good.",
    )


def with_heldout_residuals(test: Problem, item: Fit) -> Fit:
    """Return a fit whose `left_out` residuals are those of the held-out trials."""
    return replace(item, left_out=residuals(test, item.numbers, item.x[None])[0], block=blocks_of(test))
