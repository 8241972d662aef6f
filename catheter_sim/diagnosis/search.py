"""The search for causes: each has to pay for itself on stretches of the training data that are left out."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from catheter_sim.diagnosis.comparison import (
    as_good,
    leaves_only_noise,
    leaves_only_noise_in_motion,
    may_replace,
    pays,
    rivals_of,
    within_model,
)
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.fitted_sets import (
    MOST_FORMS,
    Search,
    distinct,
    in_order,
    may_end_at,
    once,
    simplest,
)
from catheter_sim.diagnosis.problem import (
    Problem,
    Term,
    further_terms,
    in_other_forms,
    terms_for,
    with_fewer_rows,
)
from catheter_sim.diagnosis.result import Cause
from catheter_sim.diagnosis.thresholds import (
    ANOTHER_FORM,
    MOST_CAUSES,
    NEAR_NOISE,
    PAYS_CHANCE,
)
from catheter_sim.diagnosis.varying import (
    is_curve,
    may_vary,
    varied_first,
    varied_last,
    varies,
    varying_terms,
)
from catheter_sim.diagnosis.workers import (
    SERIAL,
    OutOfTime,
    Workers,
    map_calls,
)
from catheter_sim.effects import EFFECTS

BEAM = 3
"""[sets of causes] Another cause is added to each of this many. Why: the best set of two need not hold the
best single cause. `tests/diagnosis/test_select.py` has pairs that a smaller number misses."""
PATIENCE = 1
"""[steps] This many need not pay, if the next one does. Why: two causes may pay where neither does alone.
`tests/diagnosis/test_select.py` has such a pair."""
CHOICE_ROUNDS = 3
"""[rounds] If something better stands in a cause's place in the end, the choice is made at most this many
times. Why: assumed. It ends the exchange of two causes for one another."""
NEAR_TERMS = 10
"""[variants of causes] This many of the best in a probe are tried, two at a time, in the place of one or two
chosen causes. Why: assumed. Of ten there are forty-five pairs, each ranked in a millisecond."""
NEAR_SETS = 4
"""[hypotheses] This many of each size are fitted near the set at which a search ends. Why: assumed. Ten or so
in all cost as much as one more step of the search."""
UNLISTED = "unlisted"  # the form of a cause whose number follows a curve

# ----------------------------------------------------------------------------------------------------
# In which of its forms a chosen cause acts: the forms compete on stretches left out.
#
# The search finds a cause by its simplest forms. Here each of its other forms stands in the place of the
# one that was found. It is taken if it does better on the stretches left out by more than chance allows,
# shared among the forms that are tried: with many forms one of them would often do a little better by
# chance. What the simplest form lacked, another cause may have taken on. So each form is tried without the
# other causes, too: with fewer numbers it need only do as well.


def in_best_forms(
    problem: Problem,
    chosen: Fit,
    thorough: bool = False,
    pool: Workers = SERIAL,
    deadline: float = math.inf,
) -> Fit:
    """Return the hypothesis with each of its causes in the form that explains left-out stretches best.

    Of a model in motion that is known to be wrong other forms would only mend the model, at minutes for each.
    No more forms are tried after `deadline`, on the clock of `time.monotonic` [s].
    """
    if problem.moving and problem.model_share:
        return chosen
    for _ in chosen.terms:  # one cause changes its form at a time, each once at most
        try:
            now, others = _fitted(problem, chosen, pool, fewer=True, deadline=deadline)
        except OutOfTime:
            break
        fits = [item for _, _, item in others]
        allowed = [item for item in fits if may_replace(problem, now, item)]
        better = [item for item in allowed if _taken(now, item, PAYS_CHANCE / len(fits))]
        if not better:
            break
        best = min(better, key=lambda item: item.cross_validated_rms)
        equal = [item for item in better if as_good(best, item)]
        best = min(equal, key=lambda item: (len(item.numbers), item.cross_validated_rms))
        chosen = fit(problem, best.terms, best.values, cross_validate=False, thorough=thorough)
    return chosen


def _taken(now: Fit, other: Fit, chance: float) -> bool:
    """Return whether `other` is taken: it pays, or does as well with fewer causes and numbers."""
    fewer = len(other.terms) < len(now.terms) and len(other.numbers) < len(now.numbers)
    return pays(now, other, chance) or (fewer and as_good(now, other))


def with_forms(
    problem: Problem, causes: Sequence[Cause], chosen: Fit, pool: Workers = SERIAL
) -> tuple[Cause, ...]:
    """Return the causes with the form of each, and with those of its other forms that do as well."""
    if not causes:
        return ()
    tried = not (problem.moving and problem.model_share)  # as of `in_best_forms`
    now, others = _fitted(problem, chosen, pool) if tried else (chosen, [])
    equal = [(cause, form) for cause, form, item in others if as_good(now, item)]
    own = {term.effect: _form_name(problem, term) for term in chosen.terms}
    return tuple(
        replace(
            cause,
            form=own[cause.name],
            forms_as_good=tuple(dict.fromkeys(form for name, form in equal if name == cause.name)),
        )
        for cause in causes
    )


def _form_name(problem: Problem, term: Term) -> str:
    """Return the form of a term, `UNLISTED` where a number follows a curve."""
    return UNLISTED if is_curve(term) else EFFECTS[term.effect].form_of(problem.robot, term.free).name


def _fitted(
    problem: Problem, chosen: Fit, pool: Workers, fewer: bool = False, deadline: float = math.inf
) -> tuple[Fit, list[tuple[str, str, Fit]]]:
    """Return the hypothesis fitted to rows to choose by, and the same with one cause in another form.

    Of these the cause, the form's name and the fit; of a form that is freed in several ways, one of each.
    Each starts where its form alone would lie: from the numbers of the one before a search may not get there.
    `fewer`: each also without the other causes.

    Raises:
        OutOfTime: before all are fitted.
    """
    few = with_fewer_rows(problem)
    others = list(_in_other_forms(problem, chosen))
    if not others:
        return chosen, []
    several = len(chosen.terms) > 1 and not problem.moving  # there each fit costs minutes
    alone = [(few, (term,), chosen.values, False, False, True) for _, _, term, _ in others if several]
    starts = [{**chosen.values, **item.values} for item in map_calls(pool, fit, alone, deadline)]
    calls, names = [(few, chosen.terms, chosen.values, True, False, True)], []
    for (cause, form, term, rest), start in zip(others, starts or [chosen.values] * len(others), strict=True):
        for kept in ((), rest) if fewer and several else (rest,):
            calls.append((few, (*kept, term), start, True, False, True))
            names.append((cause, form))
    fits = map_calls(pool, fit, calls, deadline)
    return fits[0], [(*name, item) for name, item in zip(names, fits[1:], strict=True)]


def _in_other_forms(problem: Problem, chosen: Fit) -> Iterator[tuple[str, str, Term, tuple[Term, ...]]]:
    """Yield a cause, another of its forms, the term for it and the terms of the other causes."""
    for term in chosen.terms:
        rest = tuple(item for item in chosen.terms if item is not term)
        for form, other in in_other_forms(problem.robot, term, problem.moving):
            yield term.effect, form, other, rest


# ----------------------------------------------------------------------------------------------------
# Sets of causes near the one at which a search ends, and which of them is to stand in its place.
#
# A search goes from set to set by one cause at a time, so that a first wrong step may never be left. At its
# end one or two causes are exchanged for one or two others, and rivals are tried in their other forms. A
# set of fewer causes and numbers that explains as much is taken in the place of the one that was found.


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
    if leaves_only_noise(search.problem, chosen):
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


# ----------------------------------------------------------------------------------------------------
# Chooses causes inside the training data: each has to pay for itself on stretches left out.
#
# Forward, one cause more at a time, beside each of the few best sets so far (`BEAM`): every remaining
# effect is probed, the most promising are fitted well, and the best of these is taken if the errors on the
# stretches left out fall by more than chance allows (`PAYS_CHANCE`; stretches count, not rows) and by more
# than `PAYS_SHARE`. Where one of the best causes alone settles the data in another of its forms, the search
# begins there. The best set of two need not hold a cause that does much alone: where the promising ones
# leave structure (`SETTLED_FACTOR`), all sets of two are probed, and the best (`PAIRS`) fitted. Two causes
# may pay where neither does alone, since each raises some errors that the other takes away, so that where
# structure is left the search ends only when two steps have not paid (`PATIENCE`); a further round, which
# begins at what stands in a cause's place, when one has not, since the sets around it are known. Values per
# channel or segment fit what they see better than what they do not see. So a set of fewer numbers is taken
# before a better one that it equals to within chance and `EQUAL_FACTOR`, and what acts on the whole robot
# comes first: only when no more of that pays are such values tried; of a robot in motion before sets of
# two, which cost more where each is simulated. Where what is left is not near the noise, so are the further
# forms of causes, and all together from the start, which is taken if it leaves none. Last, backward: a
# cause whose loss costs nothing is dropped, and the set gives way to any of fewer numbers that was tried
# and explains as much, unless causes that are tried beside it pay there. Nothing of the held-out data is
# seen.


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
        interleaved: what was left out of fits were pieces between others (`VariedAlone`).
    """

    null: Fit
    singles: tuple[Fit, ...]
    tried: tuple[Fit, ...]
    path: tuple[Fit, ...]
    chosen: Fit
    equals: tuple[Fit, ...]
    unfinished: bool = False
    interleaved: bool = False


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

    `on_fit` is called with a line when a step is done; the search ends with the best so far at `deadline`, on
    the clock of `time.monotonic` [s]; a set has at most `most` causes.
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
    # A number that varies fits much: what does so says something only against another that does.
    if not varies(path[-1]):
        path = [item for item in path if not varies(item)]
    tried = tuple(item for item in search.tried if varies(path[-1]) or not varies(item))
    late, pieces = search.late, search.problem.interleaved
    return Selection(path[0], tuple(singles), tried, tuple(path), path[-1], tuple(equals), late, pieces)


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
    numbers = (*simple, *detailed, *varying_terms(problem, candidates))
    varied, singles = varied_first(search, path, singles, numbers, [*detailed, *further])
    problem, null = search.problem, path[0]
    for left in reversed(range(CHOICE_ROUNDS)):
        beside_simple: list[list[Term]] = [[], detailed, [*detailed, *further]]
        for variants in ((simple, more) for more in beside_simple[begin:]):
            if varies(path[-1]) or _ended(problem, null, path[-1], bool(variants[1])):
                break
            if len(variants[1]) > len(detailed):
                if leaves_only_noise(problem, path[-1], NEAR_NOISE):
                    break
                detailed = variants[1]
            if variants[1] and len(path) == 1:
                singles = once([*singles, *search.alone(null, detailed)])
            _forward(search, singles, variants, path, most, PATIENCE if left == CHOICE_ROUNDS - 1 else 0)
        if left == CHOICE_ROUNDS - 1 and may_vary(search, path):
            singles = varied_last(search, path, singles, numbers, varied, most)
            problem, null = search.problem, path[0]
        done = search.late or within_model(problem, null, path[-1])
        if left == CHOICE_ROUNDS - 1 and not done and not leaves_only_noise(problem, path[-1]):
            singles = once([*singles, *search.alone(null, detailed)])
            other = [null]
            _forward(search, singles, (simple, detailed), other, most, PATIENCE)
            if pays(path[-1], other[-1]) and leaves_only_noise(problem, other[-1]):
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
        alone = len(current.terms) == 1 and leaves_only_noise(problem, current) and not varies(current)
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
    if not problem.moving or any(
        leaves_only_noise(problem, item) or within_model(problem, null, item) for item in singles
    ):
        return singles, 0
    singles = once([*singles, *search.alone(null, detailed)])
    return singles, int(any(leaves_only_noise(problem, item) for item in singles))


def _ended(problem: Problem, null: Fit, best: Fit, further: bool) -> bool:
    """Return whether nothing more is sought: `further`, after the first of the tiers."""
    return within_model(problem, null, best) or (further and leaves_only_noise_in_motion(problem, best))


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
            if leaves_only_noise_in_motion(search.problem, best):
                return
            level = search.with_one_more_cause(beam, variants)
            if len(beam[0].terms) == 1 and level and not leaves_only_noise(search.problem, level[0]):
                level = in_order(once([*level, *search.pairs(singles, variants[0])]))
        else:
            level = in_order([item for item in singles if item.terms[0] in (*variants[0], *variants[1])])
        if not level:
            return
        front = simplest(level[0], level)
        search.say(
            f"{'+'.join(front.causes)}: {front.cross_validated_rms:.4g} (was {best.cross_validated_rms:.4g})"
        )
        beam = distinct([front, *level])[:BEAM]
        if pays(best, front):
            path.append(front)
            if within_model(search.problem, path[0], front):
                return
            waited = 0
            if leaves_only_noise(search.problem, front):
                beam = [front]
        elif leaves_only_noise(search.problem, best):
            return
        elif waited < patience:
            waited += 1
        else:
            forms = search.other_forms(best, variants)
            if not forms or not pays(best, forms[0]):
                return
            path.append(forms[0])
            beam, waited = forms[:1], 0


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


# ----------------------------------------------------------------------------------------------------
# What a choice of causes asks once more: every cause alone, and what does as well as one that was chosen.


def singles_of(problem: Problem, candidates: Sequence[str], pool: Workers = SERIAL) -> tuple[Fit, ...]:
    """Return the fits of single effects, of each in its most promising variants, best first."""
    problem = with_fewer_rows(problem)
    search = Search(pool, problem, lambda line: None)
    (null,) = search.fitted([((), {})])
    terms = [term for name in candidates for term in terms_for(problem.robot, name, problem.moving)]
    return tuple(in_order(search.alone(null, terms)))


def equals_of(
    problem: Problem, chosen: Fit, candidates: Sequence[str], pool: Workers = SERIAL
) -> tuple[Fit, ...]:
    """Return the hypotheses that do as well on the training data as one at which the search did not end."""
    problem = with_fewer_rows(problem)
    search = Search(pool, problem, lambda line: None)
    (current,) = search.fitted([(chosen.terms, chosen.values)])
    simple, detailed = by_size([terms_for(problem.robot, name, problem.moving) for name in candidates])
    search.fit_in_each_place(current, (*simple, *detailed))
    return tuple(item for _, _, item in rivals_of(current, search.tried) if as_good(current, item))
