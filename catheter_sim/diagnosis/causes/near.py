"""Sets of causes near the one at which a search ends, and which of them is to stand in its place.

A search goes from set to set by one cause at a time, so that a first wrong step may never be left. At its end
one or two causes are exchanged for one or two others, and rivals are tried in their other forms. A set of
fewer causes and numbers that explains as much is taken in the place of the one that was found.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

from catheter_sim.diagnosis.causes.comparison import as_good, may_replace, pays, rivals_of, settled
from catheter_sim.diagnosis.causes.search import Search, in_order
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.problem import Term, in_other_forms
from catheter_sim.diagnosis.thresholds import ANOTHER_FORM, MOST_FORMS, NEAR_SETS, NEAR_TERMS


def fit_rivals_in_other_forms(search: Search, chosen: Fit) -> None:
    """Fit the nearest misses among the rivals of a chosen set's causes in their other forms.

    A rival that is fitted in its simplest form alone may do worse for its form (`ANOTHER_FORM`).
    """
    most = ANOTHER_FORM * chosen.cross_validated_rms
    near = [
        (come, item)
        for gone, come, item in rivals_of(chosen, in_order(search.tried))
        if gone != come and item.cross_validated_rms <= most
    ]
    hypotheses = [
        (tuple(other if term.effect == come else term for term in item.terms), item.values)
        for come, item in near
        for mine in item.terms
        if mine.effect == come
        for _, other in in_other_forms(search.problem.robot, mine)
    ]
    search.fitted(hypotheses[:MOST_FORMS], chosen)


def fit_near(search: Search, chosen: Fit, variants: Sequence[Term]) -> None:
    """Fit the most promising sets near a chosen one: one or two of its causes exchanged for one or two.

    All of them are ranked by derivatives. The `NEAR_SETS` best of each size are fitted: of fewer causes,
    of as many, and of more, where what the chosen one leaves asks for more.
    """
    mine = set(chosen.causes)
    others = [term for term in variants if term.effect not in mine]
    gone = [set(some) for count in (1, 2) for some in combinations(chosen.terms, count)]
    kept = [tuple(term for term in chosen.terms if term not in some) for some in gone]
    single = [(chosen, (*rest, term)) for rest in kept for term in others]
    forecast = search.foreseen(single)
    likely: dict[Term, float] = {}
    for (_, terms), ahead in zip(single, forecast, strict=True):
        likely[terms[-1]] = min(ahead.cost, likely.get(terms[-1], math.inf))
    first = sorted(likely, key=lambda term: likely[term])[:NEAR_TERMS]
    double = [
        (chosen, (*rest, one, other))
        for rest in kept
        for one, other in combinations(first, 2)
        if one.effect != other.effect
    ]
    hypotheses = [*single, *double]
    by_size: dict[int, list[int]] = {}
    for index, (_, terms) in enumerate(hypotheses):
        by_size.setdefault(len(terms) - len(chosen.terms), []).append(index)
    if settled(search.problem, chosen):
        by_size.pop(1, None)
    search.fitted(search.best(hypotheses, [(own, NEAR_SETS) for own in by_size.values()]), chosen)


def better_near(search: Search, current: Fit, most: int) -> Fit:
    """Return the set, of all that were tried, that is to stand in the place of `current`; itself if none.

    It is one that pays over it, the simplest of those as good as the best of these; else one as good as
    `current` with fewer causes and fewer numbers.
    """
    problem = search.problem
    tried = [item for item in search.tried if len(item.terms) <= most]
    other = [item for item in tried if may_replace(problem, current, item)]
    better = in_order([item for item in other if pays(current, item)])[:1]
    if better:
        return simplest(better[0], [item for item in other if pays(current, item)])
    fewer = [
        item
        for item in other
        if len(item.terms) < len(current.terms) and len(item.numbers) < len(current.numbers)
    ]
    return simplest(current, [item for item in fewer if may_end_at(current, item, search.tried)])


def simplest(best: Fit, others: Sequence[Fit]) -> Fit:
    """Return the fit of fewest numbers among those as good as `best`; `best` itself if none has fewer."""
    equal = [best, *(item for item in others if as_good(best, item))]
    return min(equal, key=lambda item: (len(item.numbers), item.cross_validated_rms))


def may_end_at(current: Fit, reduced: Fit, tried: Sequence[Fit]) -> bool:
    """Return whether the search may end at `reduced` as well as at `current`.

    It may not where some larger set of causes pays over `reduced` and does not pay over `current`: to lose
    one cause may cost little, to lose several much.
    """
    beyond = (item for item in tried if set(item.causes) > set(reduced.causes))
    return not any(pays(reduced, item) and not pays(current, item) for item in beyond)
