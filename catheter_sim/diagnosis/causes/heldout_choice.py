"""The held-out trials decide between hypotheses that do as well on the training trials.

Two causes may do the same to the trials that both were fitted to, and differ on others. The held-out trials
then choose between the few hypotheses that are left. The gain of the chosen one is a little larger than it
would be on trials that had no part in the choice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from catheter_sim.diagnosis.causes.comparison import as_good, may_replace, pays, rival_groups
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.fitting.residuals import residuals
from catheter_sim.diagnosis.fitting.stretches import blocks_of
from catheter_sim.diagnosis.fitting.workers import SERIAL, Workers, map_calls
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.thresholds import PAYS_CHANCE


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
    the number of the others.

    Args:
        problem: the training trials.
        test: the held-out trials.
        chosen: fitted to all training rows.
        equals: hypotheses that explain the training trials as well, one other effect in each (`Selection`).
        thorough: as for `fit`.
        pool: where to fit.

    Returns:
        The hypothesis fitted to all training rows, and those that do as well on both parts
        (`comparison.rival_groups`).
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
