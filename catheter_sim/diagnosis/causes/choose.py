"""Chooses causes inside the training data: each has to pay for itself on stretches left out.

Forward, one cause more at a time, beside each of the few best sets so far (`BEAM`): every remaining effect
is probed, the most promising are fitted well, and the best of these is taken if the errors on the stretches
left out fall by more than chance allows (`PAYS_CHANCE`; stretches count, not rows) and by more than
`PAYS_SHARE`. Where one of the best causes alone settles the data in another of its forms, the search begins
there. The best set of two need not hold a cause that does much alone: where the promising ones leave
structure (`SETTLED_FACTOR`), all sets of two are probed, and the best (`PAIRS`) fitted. Two causes may pay
where neither does alone, since each raises some errors that the other takes away, so that where structure is
left the search ends only when two steps have not paid (`PATIENCE`); a further round, which begins at what
stands in a cause's place, when one has not, since the sets around it are known. Values per channel or
segment fit what they see better than what they do not see. So a set of fewer numbers is taken before a
better one that it equals to within chance and `EQUAL_FACTOR`, and what acts on the whole robot comes first:
only when no more of that pays are such values tried; of a robot in motion before sets of two, which cost
more where each is simulated. Where what is left is not near the noise, so are the further forms of causes,
and all together from the start, which is taken if it leaves none. Last, backward: a cause whose loss costs
nothing is dropped, and the set gives way to any of fewer numbers that was tried and explains as much, unless
causes that are tried beside it pay there. Nothing of the held-out data is seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from catheter_sim.diagnosis.causes.comparison import (
    as_good,
    pays,
    rivals_of,
    settled,
    settled_in_motion,
    within_model,
)
from catheter_sim.diagnosis.causes.near import (
    better_near,
    fit_near,
    fit_rivals_in_other_forms,
    may_end_at,
    simplest,
)
from catheter_sim.diagnosis.causes.search import Search, in_order
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.problem import (
    Problem,
    Term,
    further_terms,
    terms_for,
    with_fewer_rows,
)
from catheter_sim.diagnosis.fitting.workers import SERIAL, OutOfTime, Workers
from catheter_sim.diagnosis.thresholds import BEAM, CHOICE_ROUNDS, MOST_CAUSES, NEAR_NOISE, PATIENCE
from catheter_sim.effects import EFFECTS


@dataclass(frozen=True)
class Selection:
    """What was tried inside the training data.

    Attributes:
        null: the calibrated model without causes.
        singles: every effect alone, one fit per variant.
        tried: further hypotheses that were fitted well.
        path: from `null` to the chosen hypothesis, each better than the one before.
        chosen: the chosen hypothesis.
        equals: those of `tried` that do as well with another effect in the place of a chosen one.
        unfinished: time ran out, so that the chosen hypothesis is the best so far.
    """

    null: Fit
    singles: tuple[Fit, ...]
    tried: tuple[Fit, ...]
    path: tuple[Fit, ...]
    chosen: Fit
    equals: tuple[Fit, ...]
    unfinished: bool = False


def candidates_for(problem: Problem) -> tuple[str, ...]:
    """Return the effects that a diagnosis tries: those that make sense for the robot and its trials.

    Left out are those whose number is calibrated already, and those that are set and never fitted.
    """
    left_out = {name for item in problem.nuisances for name in item.stands_for}
    return tuple(
        name
        for name, effect in EFFECTS.items()
        if name not in left_out
        and terms_for(problem.robot, name, problem.moving)
        and len(problem.trials) >= effect.least_trials
    )


def select(
    problem: Problem,
    candidates: Sequence[str],
    pool: Workers = SERIAL,
    on_fit: Callable[[str], None] | None = None,
    deadline: float = math.inf,
    most: int = MOST_CAUSES,
) -> Selection:
    """Return which of the effects `candidates` explain the training data, and what else was tried.

    Args:
        problem: the training trials.
        candidates: names of effects.
        pool: where to fit.
        on_fit: called with a line when a step is done.
        deadline: on the clock of `time.monotonic`, when the search ends with the best so far [s].
        most: causes in a set.
    """
    problem = with_fewer_rows(problem)
    search = Search(pool, problem, on_fit or (lambda line: None), deadline)
    (null,) = search.fitted([((), {})])
    path = [null]
    try:
        singles, equals = _searched(search, candidates, path, most)
    except OutOfTime:
        singles = in_order([item for item in search.tried if len(item.terms) == 1])
        equals = []
        best = in_order(search.tried)[:1]
        if best and pays(path[-1], best[0]):
            path.append(best[0])
    tried = tuple(search.tried)
    return Selection(null, tuple(singles), tried, tuple(path), path[-1], tuple(equals), search.late)


def _searched(
    search: Search, candidates: Sequence[str], path: list[Fit], most: int
) -> tuple[list[Fit], list[Fit]]:
    """Return the fits of single causes, and those that do as well as the last of `path`, to which it leads.

    Raises:
        OutOfTime: before the end; `path` is what it has come to.
    """
    problem, null = search.problem, path[0]
    simple, detailed = by_size([terms_for(problem.robot, name, problem.moving) for name in candidates])
    further = _further(problem, candidates)
    singles, begin = _singles(search, null, simple, detailed)
    path[:] = search.beginning(null, singles)
    for left in reversed(range(CHOICE_ROUNDS)):
        beside_simple: list[list[Term]] = [[], detailed, [*detailed, *further]]
        for variants in ((simple, more) for more in beside_simple[begin:]):
            if _ended(problem, null, path[-1], bool(variants[1])):
                break
            if len(variants[1]) > len(detailed):
                if settled(problem, path[-1], NEAR_NOISE):
                    break
                detailed = variants[1]
            if variants[1] and len(path) == 1:
                singles = _once([*singles, *search.alone(null, detailed)])
            _forward(search, singles, variants, path, most, PATIENCE if left == CHOICE_ROUNDS - 1 else 0)
        done = search.late or within_model(problem, null, path[-1])
        if left == CHOICE_ROUNDS - 1 and not done and not settled(problem, path[-1]):
            singles = _once([*singles, *search.alone(null, detailed)])
            other = [null]
            _forward(search, singles, (simple, detailed), other, most, PATIENCE)
            if pays(path[-1], other[-1]) and settled(problem, other[-1]):
                path[:] = other
        current = _backward(search, path[-1])
        tried = search.tried
        current = simplest(current, [item for item in tried if may_end_at(current, item, tried)])
        if current is not path[-1]:
            path.append(current)
        if len(current.terms) > 1 and not search.late:
            search.fit_in_each_place(current, (*simple, *detailed))
        elif current.terms and not done:
            search.alone(null, detailed)
        alone = len(current.terms) == 1 and settled(problem, current)
        if current.terms and not (alone or search.late or problem.moving):
            fit_near(search, current, (*simple, *detailed))
        if not (search.late or problem.moving):
            fit_rivals_in_other_forms(search, current)
        nearer = better_near(search, current, most)
        if not left or search.late or nearer is current:
            break
        path.append(nearer)
    rivals = [item for _, _, item in rivals_of(current, search.tried)]
    return singles, [item for item in rivals if as_good(current, item)]


def _further(problem: Problem, candidates: Sequence[str]) -> list[Term]:
    """Return the further forms of causes; none of a model known to be wrong, which they would only mend."""
    names = () if problem.model_share else candidates
    return [term for name in names for term in further_terms(problem.robot, name, problem.moving)]


def _singles(
    search: Search, null: Fit, simple: Sequence[Term], detailed: Sequence[Term]
) -> tuple[list[Fit], int]:
    """Return the fits of single causes, and 1 where values per channel or segment come at once, else 0.

    Such values are tried at once only of a robot in motion that nothing simpler settles.
    """
    singles = search.alone(null, simple)
    problem = search.problem
    if not problem.moving or any(_enough(problem, null, item) for item in singles):
        return singles, 0
    singles = _once([*singles, *search.alone(null, detailed)])
    return singles, int(any(settled(problem, item) for item in singles))


def _enough(problem: Problem, null: Fit, single: Fit) -> bool:
    """Return whether a single cause leaves as little as any may."""
    return settled(problem, single) or within_model(problem, null, single)


def _ended(problem: Problem, null: Fit, best: Fit, further: bool) -> bool:
    """Return whether nothing more is sought: `further`, after the first of the tiers."""
    return within_model(problem, null, best) or (further and settled_in_motion(problem, best))


def by_size(tiers: Sequence[tuple[Term, ...]]) -> tuple[list[Term], list[Term]]:
    """Return the effects' variants of few numbers, and those of more, by value or channel or segment."""
    simple = [term for terms in tiers for term in terms if len(term.free) <= len(terms[0].free)]
    return simple, [term for terms in tiers for term in terms if term not in simple]


def _forward(
    search: Search,
    singles: Sequence[Fit],
    variants: tuple[Sequence[Term], Sequence[Term]],
    path: list[Fit],
    most: int,
    patience: int,
) -> None:
    """Lengthen `path` by hypotheses that pay, best sets first, until more than `patience` steps do not."""
    beam: Sequence[Fit] = path[-1:]
    waited = 0
    while len(beam[0].terms) < most and not search.late:
        best = path[-1]
        if beam[0].terms:
            if settled_in_motion(search.problem, best):
                return
            level = search.with_one_more_cause(beam, variants)
            if len(beam[0].terms) == 1 and level and not settled(search.problem, level[0]):
                level = in_order(_once([*level, *search.pairs(singles, variants[0])]))
        else:
            level = in_order([item for item in singles if item.terms[0] in (*variants[0], *variants[1])])
        if not level:
            return
        front = simplest(level[0], level)
        search.say(
            f"{'+'.join(front.causes)}: {front.cross_validated_rms:.4g} (was {best.cross_validated_rms:.4g})"
        )
        beam = _distinct([front, *level])[:BEAM]
        if pays(best, front):
            path.append(front)
            if within_model(search.problem, path[0], front):
                return
            waited = 0
            if settled(search.problem, front):
                beam = [front]
        elif settled(search.problem, best):
            return
        elif waited < patience:
            waited += 1
        else:
            forms = search.other_forms(best, variants)
            if not forms or not pays(best, forms[0]):
                return
            path.append(forms[0])
            beam, waited = forms[:1], 0


def _once(fits: Sequence[Fit]) -> list[Fit]:
    """Return one fit of each hypothesis."""
    return list({frozenset(item.terms): item for item in fits}.values())


def _distinct(fits: Sequence[Fit]) -> list[Fit]:
    """Return the first fit of each set of causes."""
    first: dict[frozenset[str], Fit] = {}
    for item in fits:
        first.setdefault(frozenset(item.causes), item)
    return list(first.values())


def _backward(search: Search, current: Fit) -> Fit:
    """Return `current` without the causes that do not pay."""
    while len(current.terms) > 1:
        known = current.values
        without = [tuple(term for term in current.terms if term is not one) for one in current.terms]
        fits = search.fitted([(terms, known) for terms in without], current)
        idle = [item for item in fits if not pays(item, current) and may_end_at(current, item, search.tried)]
        if not idle:
            break
        current = min(idle, key=lambda item: item.cross_validated_rms)
    return current
