"""What the training trials cannot tell apart, the held-out ones may: other conditions, other consequences.

A cause and another in its place may do the same to the trials that both were fitted to, and not to others.
The held-out trials then decide between the few that are left; the gain of the one that they choose is a
little better than it would be on trials that nothing was chosen by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.hypothesis import Problem, blocks_of, residuals
from catheter_sim.diagnosis.select import PAYS_CHANCE, alike, as_good, pays
from catheter_sim.diagnosis.workers import HERE, Workers, each


def told_apart(
    problem: Problem,
    test: Problem,
    chosen: Fit,
    equals: Sequence[Fit],
    thorough: bool = False,
    pool: Workers = HERE,
) -> tuple[Fit, tuple[Fit, ...]]:
    """Return the one of several hypotheses that the held-out trials want, and what stays alike there too.

    `chosen` gives way only where another one is better by more than chance, allowing for how many there are.

    Args:
        problem: the training trials.
        test: the held-out trials.
        chosen: fitted to all training rows.
        equals: hypotheses that explain the training trials as well, one other effect in each (`Selection`).
        thorough: as for `fit`.
        pool: where to fit.

    Returns:
        The hypothesis fitted to all training rows, and those that do as well on both parts (`select.alike`).
    """
    fits = [
        chosen,
        *each(pool, fit, [(problem, item.terms, item.values, False, thorough) for item in equals]),
    ]
    seen = [_elsewhere(test, item) for item in fits]
    chance = PAYS_CHANCE / max(len(equals), 1)
    better = [index for index in range(1, len(seen)) if pays(seen[0], seen[index], chance)]
    best = min(better, key=lambda index: seen[index].cross_validated_rms, default=0)
    still = [fits[index] for index, item in enumerate(seen) if index != best and as_good(seen[best], item)]
    return fits[best], tuple(item for item in still if alike(fits[best], [item]))


def as_good_elsewhere(
    problem: Problem,
    test: Problem,
    chosen: Fit,
    equals: Sequence[Fit],
    thorough: bool = False,
    pool: Workers = HERE,
) -> tuple[Fit, ...]:
    """Return those of `equals`, fitted to all training rows, that do as well on the held-out trials too.

    Arguments as of `told_apart`; here `chosen` stands.
    """
    fits = each(pool, fit, [(problem, item.terms, item.values, False, thorough) for item in equals])
    seen = _elsewhere(test, chosen)
    return tuple(item for item in fits if as_good(seen, _elsewhere(test, item)))


def told_apart_note(chosen: Fit, taken: Fit) -> str:
    """Return what to say where the held-out trials took another hypothesis than the training trials."""
    gone, come = (
        ", ".join(term.effect.replace("_", " ") for term in first.terms if term not in second.terms)
        for first, second in ((chosen, taken), (taken, chosen))
    )
    return (
        f"On the training trials {gone} does as well as {come}; the held-out trials tell them apart, for "
        f"{come}. So the gain is the better one of both, a little above that on trials that decide nothing."
    )


def _elsewhere(test: Problem, item: Fit) -> Fit:
    """Return a fit with its errors on the held-out trials in the place of those on rows left out."""
    return replace(item, left_out=residuals(test, item.frees, item.x[None])[0], block=blocks_of(test))
