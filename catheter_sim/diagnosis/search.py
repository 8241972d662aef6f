"""The search for causes: each has to pay for itself on stretches of the training data that are left out."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Stage
from catheter_sim.core.variation import MARK, Variation, number_varied, variation_of
from catheter_sim.diagnosis.comparison import (
    SETTLED_FACTOR,
    as_good,
    leaves_only_noise,
    leaves_only_noise_in_motion,
    may_replace,
    pays,
    rivals_of,
    within_model,
)
from catheter_sim.diagnosis.fit import Fit, fit, left_out_anew
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
    MOST_FIT_STEPS,
    NEAR_NOISE,
    PAYS_CHANCE,
    PAYS_SHARE,
)
from catheter_sim.diagnosis.variations import (
    Promise,
    VaryingWay,
    along_robot,
    along_rows,
    arguments_of,
    beside_fit,
    courses,
    courses_near,
    multiplied,
    part_names,
    promises,
    telling,
    unlike,
)
from catheter_sim.diagnosis.workers import (
    SERIAL,
    Foreseen,
    OutOfTime,
    Tangent,
    Workers,
    beside,
    foreseen,
    map_calls,
    misled,
    reached,
    secant,
    shortlist,
    tangent,
    values_at,
    without,
    work_out,
)
from catheter_sim.effects import EFFECTS
from catheter_sim.theory.twins import Prediction

MOST_SINGLES = 8
"""[hypotheses] Of a single cause, fitted where the robot moved: the best probed. Why: each is simulated, at
some hundred times what an analytic twin costs; a cause that does much alone is among the first."""
MOST_ROUGH_STEPS = 4
"""[steps] Of a fit that only says which sets of two are worth fitting well. Why: the first steps take most of
what there is to take."""
FIRST_IN_ALL_FORMS = 2
"""[single causes] The best ones are tried in all their forms before sets of two. Why: a hidden law of the
fifth power comes first or second as one of the third."""
HOPELESS_FACTOR = 1.2
"""[times the cross-validated error of the set beside] A set that errs by more on what it was fitted to is not
cross-validated well. Why: what is left out it tells worse still, and sets are equal within `EQUAL_FACTOR`."""
BEAM = 3
"""[sets of causes] To which another cause is added. Why: the best set of two need not hold the best single
cause; `tests/diagnosis/test_select.py` has pairs that a smaller one misses."""
PATIENCE = 1
"""[steps] That need not pay, if the next one does. Why: two causes may pay where neither does alone;
`tests/diagnosis/test_select.py` has such a pair."""
CHOICE_ROUNDS = 3
"""[rounds] Of choosing, if something better stands in a cause's place in the end. Why: assumed; it ends the
exchange of two causes for one another."""
FINALISTS = 3
"""[hypotheses] Fitted in one step; as many of few numbers, and as many beside the best set. Why: a probe is
one step of a fit, which ranks well but not surely."""
PAIRS = 24
"""[sets of two causes] Fitted roughly where those beside the best single causes leave structure. Why: one
step from a single cause tells little of a set whose numbers are both far from it."""
PAIRS_IN_MOTION = 6
"""[sets of two causes] The same where the robot moved. Why: assumed; twice the `FINALISTS`, as each robot is
simulated."""
RIVALS = 2
"""[hypotheses] Fitted in the place of each chosen cause. Why: assumed; what does as well ranks first among
the probes."""
NEAR_TERMS = 10
"""[variants of causes] The best probed ones, of which two at a time are tried in the place of one or two
chosen causes. Why: assumed; of ten there are forty-five pairs, each ranked in a millisecond."""
NEAR_SETS = 4
"""[hypotheses] Of each size, near the set at which a search ends, that are fitted. Why: assumed; ten or so in
all cost as much as one more step of the search."""
VARIED_BESIDE = 3
"""[causes] Beside more no number is asked whether it varies. Why: assumed; so many soak up what varies, and
each fit costs three robots for one."""
VARIED = 6
"""[hypotheses] In which a number varies, fitted beside each set where a search has come to. Why: assumed;
their derivatives rank them well, and each costs three robots for one."""
VARIED_WORTH = 1.5
"""[times the error of the set where the search has come to] A number that varies is not fitted where its
derivative promises more. Why: of three planted ones it promised at most 1.04 times what the fit left
(`tests/diagnosis/test_varying_planted.py`)."""
NEARER_ROUNDS = 4
"""[fits] One after the other in which a step, or a kink, is placed anew. Why: assumed; where a number varies
much each derivative leads a part of the way."""
VARIED_LEAVES = 0.8
"""[times the error of the set where the search has come to] Left at most by a number that varies beside
others. Why: of a lens with rings one took a seventh, as one of a hundred ways in which it might."""
VARIED_NEAR = 1.6
"""[times the error that the best of them promises] Of each further cause the best is fitted, too. Why: of a
zero that grows with level the derivative promised 1.5 times what the best did."""
PROMISED_ALONE = 0.5
"""[times the error without causes] One that is to explain all by itself is not fitted where its derivative
promises more. Why: of seven such ones it promised a third at most (tuning draws of the independent bench)."""
VARIED_EACH = 3
"""[hypotheses] The same, of one cause. Why: assumed; what a number varies with is told only after a fit."""
LEFT_OF_FEW = 2.0
"""[times the error's white part] Left at most by a number that varies by a step or a line, late in a search.
Why: coloured noise is up to 1.4 times its white part, and a step is placed to a row."""
LEFT_OF_FEW_SHARE = 0.25
"""[share of the error without causes] The same. Why: assumed; other causes imitate a half, hardly more."""
UNLISTED = "unlisted"  # the form of a cause whose number follows a curve
MOST_FORMS = 8
"""[hypotheses] Other variants of a set's causes, fitted where the search would end. Why: assumed; it bounds
the time."""

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
    return UNLISTED if _is_curve(term) else EFFECTS[term.effect].form_of(problem.robot, term.free).name


def _is_curve(term: Term) -> bool:
    hats = [name for name in term.free if MARK in name and variation_of(name).shape == "hat"]
    return len(hats) > 1


def _follows_curve(item: Fit) -> bool:
    """Return whether a number follows a curve, or two things at once."""
    varied = [variation_of(name) for term in item.terms for name in term.free if MARK in name]
    return any(_is_curve(term) for term in item.terms) or any(way.times for way in varied)


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
# What a search for causes has tried, and what it may try next: hypotheses probed first, few fitted well.

Known = Mapping[tuple[str, str], float]
Hypothesis = tuple[Fit, tuple[Term, ...]]  # where from, and where to


@dataclass
class Search:
    """What a selection has fitted and probed so far; nothing is worked out twice.

    Attributes:
        pool: where to fit.
        problem: the training trials.
        say: called with a line when a step is done.
        deadline: on the clock of `time.monotonic`, when nothing more is tried [s].
        fits: by hypothesis.
        tangents: of terms beside the fit of a hypothesis.
        secants: the same by changes that matter, of terms whose numbers may vary.
        lacking: what it does to take one of its terms from the fit of a hypothesis.
        steps: by the hypotheses from which and to which, what the step reaches with the full model.
    """

    pool: Workers
    problem: Problem
    say: Callable[[str], None]
    deadline: float = math.inf
    fits: dict[frozenset[Term], Fit] = field(default_factory=dict)
    tangents: dict[tuple[frozenset[Term], Term], Tangent] = field(default_factory=dict)
    secants: dict[tuple[frozenset[Term], Term], Tangent] = field(default_factory=dict)
    lacking: dict[tuple[frozenset[Term], Term], Tangent] = field(default_factory=dict)
    steps: dict[tuple[frozenset[Term], frozenset[Term]], tuple[float, Known]] = field(default_factory=dict)

    @property
    def late(self) -> bool:
        """Return whether time has run out."""
        return time.monotonic() >= self.deadline

    @property
    def tried(self) -> list[Fit]:
        """Every fit that has a cause."""
        return [item for item in self.fits.values() if item.terms]

    def fitted(
        self, hypotheses: Sequence[tuple[Sequence[Term], Known]], beside: Fit | None = None
    ) -> list[Fit]:
        """Return the fits of several hypotheses, each from its known values, in order.

        What errs far more (`HOPELESS_FACTOR`) than the fit `beside`, with which they compete, is rough, until
        it competes with one that errs as much.
        """
        worth = HOPELESS_FACTOR * beside.cross_validated_rms if beside else math.inf
        as_usual = True, False, True, MOST_FIT_STEPS, worth
        new = {
            frozenset(terms): (self.problem, tuple(terms), dict(known), *as_usual)
            for terms, known in hypotheses
        }
        missing = [key for key in new if key not in self.fits or self._too_rough(key, worth)]
        work_out(self.pool, self.deadline, self.fits, missing, fit, [new[key] for key in missing])
        return [self.fits[frozenset(terms)] for terms, _ in hypotheses]

    def _too_rough(self, key: frozenset[Term], worth: float) -> bool:
        """Return whether a fit is rough that need not be where `worth` is what matters."""
        return self.fits[key].rough and self.fits[key].fitted_rms <= worth

    def foreseen(self, hypotheses: Sequence[Hypothesis]) -> list[Foreseen]:
        """Return what one step from a fit promises toward a hypothesis near it, in order."""
        beyond: dict[tuple[frozenset[Term], Term], Fit] = {}
        lacking: dict[tuple[frozenset[Term], Term], Fit] = {}
        keys = []
        for start, terms in hypotheses:
            mine = frozenset(start.terms)
            come = [term for term in terms if term not in mine]
            changed = {term.effect for term in come}
            gone = [term for term in start.terms if term not in terms and term.effect not in changed]
            beyond |= {(mine, term): start for term in come}
            lacking |= {(mine, term): start for term in gone}
            keys.append(([(mine, term) for term in gone], [(mine, term) for term in come]))
        self._probed(self.tangents, beyond, tangent)
        self._probed(self.lacking, lacking, without)
        return [
            foreseen(
                self.problem,
                start,
                terms,
                [*(self.lacking[key] for key in gone), *(self.tangents[key] for key in come)],
            )
            for (start, terms), (gone, come) in zip(hypotheses, keys, strict=True)
        ]

    def probe(self, start: Fit, terms: Iterable[Term], largely: Iterable[Term] = ()) -> None:
        """Work out what terms do beside a fit (`tangents`), and what some do by a change that matters."""
        mine = frozenset(start.terms)
        self._probed(self.tangents, {(mine, term): start for term in terms}, tangent)
        self._probed(self.secants, {(mine, term): start for term in largely}, secant)

    def _probed(
        self,
        store: dict[tuple[frozenset[Term], Term], Tangent],
        wanted: Mapping[tuple[frozenset[Term], Term], Fit],
        probe: Callable[[Problem, Fit, Term], Tangent],
    ) -> None:
        """Put what `probe` says of terms beside fits into `store`, where it is not there yet."""
        missing = [key for key in wanted if key not in store]
        calls = [(self.problem, wanted[key], key[1]) for key in missing]
        work_out(self.pool, self.deadline, store, missing, probe, calls)

    def best(
        self,
        hypotheses: Sequence[Hypothesis],
        groups: Iterable[tuple[Sequence[int], int]],
    ) -> list[tuple[tuple[Term, ...], Known]]:
        """Return the hypotheses whose step reaches furthest, with the values there, group by group.

        A group has the indices of some of them, and how many of these to return.
        """
        forecast = self.foreseen(hypotheses)
        unknown = {index for index, item in enumerate(hypotheses) if misled(forecast[index], *item)}
        groups = [
            (shortlist(sorted(group, key=lambda index: forecast[index].cost), count, unknown), count)
            for group, count in groups
        ]
        keys = [(frozenset(start.terms), frozenset(terms)) for start, terms in hypotheses]
        asked = list(dict.fromkeys(index for group, _ in groups for index in group))
        missing = [index for index in asked if keys[index] not in self.steps]
        calls = [(self.problem, *hypotheses[index], forecast[index].points) for index in missing]
        work_out(self.pool, self.deadline, self.steps, [keys[index] for index in missing], reached, calls)
        picked = dict.fromkeys(
            index
            for group, count in groups
            for index in sorted(group, key=lambda index: self.steps[keys[index]][0])[:count]
        )
        return [(hypotheses[index][1], self.steps[keys[index]][1]) for index in picked]

    def promising(self, null: Fit, terms: Sequence[Term]) -> Sequence[Term]:
        """Return the terms to fit alone: of many variants of one effect the `FINALISTS` best probed."""
        if len(terms) <= FINALISTS:
            return terms
        hypotheses = [(null, (term,)) for term in terms]
        picked = self.best(hypotheses, [(range(len(terms)), FINALISTS)])
        chosen = {term for (term,), _ in picked}
        return [term for term in terms if term in chosen]

    def alone(self, null: Fit, terms: Sequence[Term]) -> list[Fit]:
        """Return the fits of single terms: of each effect's the most promising."""
        by_effect: dict[str, list[Term]] = {}
        for term in terms:
            by_effect.setdefault(term.effect, []).append(term)
        chosen = [term for own in by_effect.values() for term in self.promising(null, own)]
        if self.problem.moving:
            return self._alone_in_motion(null, chosen)
        return self.fitted([((term,), {}) for term in chosen])

    def beginning(self, null: Fit, singles: Sequence[Fit]) -> list[Fit]:
        """Return `null`, and one of the best single causes in another form where that settles the data.

        Of a robot in motion, where each fit costs minutes, other forms are not tried.
        """
        alone = in_order(singles)
        if self.problem.moving or not alone or any(leaves_only_noise(self.problem, item) for item in alone):
            return [null]
        best = [item.terms[0] for item in alone[:FIRST_IN_ALL_FORMS]]
        terms = [other for mine in best for _, other in in_other_forms(self.problem.robot, mine)]
        forms = in_order(self.fitted([((term,), {}) for term in terms]))[:1]
        return [
            null,
            *(item for item in forms if leaves_only_noise(self.problem, item) and pays(alone[0], item)),
        ]

    def _alone_in_motion(self, null: Fit, terms: Sequence[Term]) -> list[Fit]:
        """Return the fits of the best probed terms alone: of few where nothing or one of them settles it."""
        hypotheses = [(null, (term,)) for term in terms]
        picked = self.best(hypotheses, [(range(len(terms)), MOST_SINGLES)])
        first = self.fitted(picked[:FINALISTS])
        if any(leaves_only_noise(self.problem, item) for item in (null, *first)):
            return first
        return [*first, *self.fitted(picked[FINALISTS:])]

    def with_one_more_cause(
        self, beam: Sequence[Fit], variants: tuple[Sequence[Term], Sequence[Term]]
    ) -> list[Fit]:
        """Return the fits of the most promising hypotheses one step beyond any of `beam`, best first.

        `variants`: of all effects, those with few numbers and the others.
        """
        simple, detailed = variants
        new: dict[frozenset[Term], tuple[Fit, tuple[Term, ...], bool]] = {}
        for start in beam:
            for term in (*simple, *detailed):
                terms = beside(start.terms, term)
                if terms:
                    new.setdefault(frozenset(terms), (start, terms, term in simple))
        hypotheses = [(start, terms) for start, terms, _ in new.values()]
        every = range(len(hypotheses))
        few = [index for index, (_, _, is_simple) in enumerate(new.values()) if is_simple]
        first = [index for index in every if hypotheses[index][0] is beam[0]]
        return in_order(
            self.fitted(self.best(hypotheses, [(group, FINALISTS) for group in (every, few, first)]))
        )

    def pairs(self, singles: Sequence[Fit], variants: Sequence[Term]) -> list[Fit]:
        """Return the best fits of two causes each, of all sets of two `variants` that were fitted alone.

        One step from a single cause tells little of a set in which both numbers are far from it; so `PAIRS`
        sets are fitted roughly before the `FINALISTS` are chosen.
        """
        starts = [item for item in singles if item.terms[0] in variants]
        hypotheses = [
            (start, (*start.terms, *other.terms))
            for start in starts
            for other in starts
            if start.causes != other.causes
        ]
        forecast = self.foreseen(hypotheses)
        known: dict[frozenset[Term], tuple[tuple[Term, ...], Known]] = {}
        for index in sorted(range(len(hypotheses)), key=lambda index: forecast[index].cost):
            terms = hypotheses[index][1]
            known.setdefault(
                frozenset(terms), (terms, values_at(self.problem, terms, forecast[index].points[0]))
            )
        fits = map_calls(
            self.pool,
            fit,
            [
                (self.problem, terms, dict(values), False, False, True, MOST_ROUGH_STEPS)
                for terms, values in list(known.values())[: PAIRS_IN_MOTION if self.problem.moving else PAIRS]
            ],
            self.deadline,
        )
        best = sorted(fits, key=lambda item: float(item.residual @ item.residual))[:FINALISTS]
        return self.fitted([(item.terms, item.values) for item in best])

    def other_forms(self, best: Fit, variants: tuple[Sequence[Term], Sequence[Term]]) -> list[Fit]:
        """Return the fits in which one of the causes has another of its variants, best first."""
        hypotheses = [
            tuple(other if term is mine else term for term in best.terms)
            for mine in best.terms
            for other in (*variants[0], *variants[1])
            if other.effect == mine.effect and other != mine
        ]
        return in_order(self.fitted([(terms, best.values) for terms in hypotheses[:MOST_FORMS]], best))

    def fit_in_each_place(self, chosen: Fit, variants: Sequence[Term]) -> None:
        """Fit hypotheses in which another effect stands in the place of a chosen one.

        Every effect not chosen is probed in the place of each chosen one; the best `RIVALS` per place are
        fitted.
        """
        named = set(chosen.causes)
        hypotheses = [
            (term.effect, (*(item for item in chosen.terms if item is not term), rival))
            for term in chosen.terms
            for rival in variants
            if rival.effect not in named
        ]
        places = [
            ([index for index, (cause, _) in enumerate(hypotheses) if cause == name], RIVALS)
            for name in chosen.causes
        ]
        self.fitted(self.best([(chosen, terms) for _, terms in hypotheses], places), chosen)


def in_order(fits: Iterable[Fit]) -> list[Fit]:
    """Return fits by their error on the stretches left out, best first."""
    return sorted(fits, key=lambda item: item.cross_validated_rms)


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


# ----------------------------------------------------------------------------------------------------
# Numbers that vary: along the robot, over time, with inputs, with what came before.
#
# They are tried last, where no single cause settles the data. All that a number may vary with is ranked by
# derivatives, beside the model without causes and, where structure is left, beside the set where the search
# has come to. The best are fitted, and from the best of these all are ranked once more.


def vary(search: Search, path: list[Fit], terms: Sequence[Term], most: int, few: bool = False) -> None:
    """Lengthen `path` by the best hypothesis in which a number varies, where it pays.

    The chance is shared among all that numbers may vary with, and the gain must be large, since what varies
    soaks up much. Neither holds of what is seen in few stretches (`few`), of which more is asked elsewhere.
    """
    problem, best = search.problem, path[-1]
    rows = telling(problem, courses(problem))
    share = PROMISED_ALONE if few else VARIED_WORTH
    worth = (share * best.cross_validated_rms) ** 2 * len(best.left_out)
    found: list[Fit] = []
    ranked: list[Promise] = []
    for start in path[:1] if leaves_only_noise(problem, best) else _distinct([path[0], best]):
        if len(start.terms) > VARIED_BESIDE:
            continue
        asked = [*start.terms, *(term for term in terms if term not in start.terms)]
        ranked = _promised(search, start, asked, rows)
        allowed = [item for item in ranked if item.cost <= worth and len(item.terms) <= most]
        first = {item.effect: item for item in reversed(allowed)}  # the best of each effect
        near = [item for item in first.values() if item.cost <= VARIED_NEAR**2 * allowed[0].cost]
        picked = allowed[:VARIED] + [item for item in near if item not in allowed[:VARIED]]
        found += search.fitted([(item.terms, item.known) for item in picked])
    for number, leading in enumerate(_leading(found)):
        found += _nearer(search, leading, rows, all_kinds=number == 0)
    if few and not (found and leaves_only_noise(problem, in_order(found)[0])):
        likely = list(dict.fromkeys(item.effect for item in ranked))[:VARIED_EACH]
        found += _with_two(search, path[0], [term for term in terms if term.effect in likely], rows)
    if found:
        front = simplest(in_order(found)[0], found)
        search.say(f"{'+'.join(front.causes)}, varying: {front.cross_validated_rms:.4g}")
        kinds = {(items[0].along, items[0].channel) for items, _ in rows}
        shared = PAYS_CHANCE / (1 + len(kinds))  # one of many does well by chance
        gains = few or front.cross_validated_rms <= VARIED_LEAVES * best.cross_validated_rms
        if gains and pays(best, front, PAYS_CHANCE if few else shared):
            path.append(front)


def _with_two(
    search: Search,
    null: Fit,
    terms: Sequence[Term],
    rows: Sequence[tuple[tuple[Variation, ...], Array]],
) -> list[Fit]:
    """Return the best fits in which a number varies with two things at once: late, say, and far out."""
    worth = (PROMISED_ALONE * null.cross_validated_rms) ** 2 * len(null.left_out)
    likely = [item for item in _promised(search, null, terms, rows, two=True) if item.cost <= worth]
    found = search.fitted([(item.terms, item.known) for item in likely[:VARIED]])
    for leading in in_order(found)[:1]:
        found += _nearer(search, leading, [], all_kinds=False)
    return found


def _nearer(
    search: Search,
    leading: Fit,
    rows: Sequence[tuple[tuple[Variation, ...], Array]],
    all_kinds: bool,
) -> list[Fit]:
    """Return fits in which a number varies otherwise than in a leading one, where derivatives tell more.

    In the best of all, and in others than its kind, if `all_kinds` is asked; again, while that gains.
    """
    found: list[Fit] = []
    for _ in range(NEARER_ROUNDS):
        varied = [term for term in leading.terms if any(MARK in name for name in term.free)]
        steps = [variation_of(name) for term in varied for name in term.free if MARK in name]
        finer = [telling(search.problem, courses_near(search.problem, item)) for item in steps]
        likely = _promised(search, leading, varied, [*rows, *(way for ways in finer for way in ways)])
        asked = likely if all_kinds and not found else likely[:1]
        found += search.fitted([(item.terms, item.known) for item in asked])
        best = in_order([leading, *found])[0]
        if best.cross_validated_rms > (1.0 - PAYS_SHARE) * leading.cross_validated_rms:
            break
        leading = best
    return found


def _leading(found: Sequence[Fit]) -> list[Fit]:
    """Return the best fits of each set of causes that are near the best of all (`VARIED_NEAR`)."""
    first = _distinct(in_order(found))
    return [item for item in first if item.cross_validated_rms <= VARIED_NEAR * first[0].cross_validated_rms]


@dataclass(frozen=True)
class VariedAlone:
    """The best single cause of which a number varies, by pieces left out between others.

    A number that steps late in the longest trial shows in too few stretches to leave one of them out. What
    imitates a cause in few stretches does so in pieces of them, too; so it counts only where little but noise
    is left.

    Attributes:
        search: of such causes alone, with pieces left out.
        path: the model without causes, and the best such cause where it pays.
    """

    search: Search
    path: Sequence[Fit]

    def leaves(self, most: float) -> bool:
        """Return whether it leaves at most so many times the noise; a curve must leave nothing but noise."""
        null, found = self.path[0], self.path[-1]
        little = found.cross_validated_rms <= LEFT_OF_FEW_SHARE * null.cross_validated_rms
        most = SETTLED_FACTOR if _follows_curve(found) or not little else most
        return len(self.path) > 1 and leaves_only_noise(self.search.problem, found, most)

    def taken(self, search: Search, path: list[Fit], most: float) -> bool:
        """Return whether it leaves at most so many times the noise; `path` then leads to it.

        Where no stretch outside tells of it, pieces are left out of all fits from there on.
        """
        found, problem = self.path[-1], self.search.problem
        if not self.leaves(most) or not pays(left_out_anew(problem, path[-1]), found):
            return False
        plain = left_out_anew(search.problem, found)
        chance = PAYS_CHANCE / (1 + len(list(arguments_of(problem))))
        if pays(path[0], plain, chance):
            near = [item for item in _leading(self.search.tried) if item.terms != found.terms]
            search.fits |= {frozenset(item.terms): left_out_anew(search.problem, item) for item in near}
            search.fits[frozenset(found.terms)] = plain
            path.append(plain)
            return True
        kept = [key for key in search.fits if key not in self.search.fits]
        calls = [(problem, search.fits[key]) for key in kept]
        again = map_calls(search.pool, left_out_anew, calls, search.deadline)
        search.problem = problem
        search.fits = {**dict(zip(kept, again, strict=True)), **self.search.fits}
        path[:] = self.path
        return True


def varied_alone(search: Search, terms: Sequence[Term]) -> VariedAlone:
    """Return the best single cause of which a number varies."""
    other = replace(search, problem=replace(search.problem, interleaved=True), fits={})
    path = other.fitted([((), {})])
    vary(other, path, terms, most=1, few=True)
    return VariedAlone(other, path)


def _promised(
    search: Search,
    start: Fit,
    asked: Sequence[Term],
    rows: Sequence[tuple[tuple[Variation, ...], Array]],
    two: bool = False,
) -> list[Promise]:
    """Return the hypotheses beside a fit in which a number of an asked term varies, most promising first.

    `two`: with two things at once, from row to row.
    """
    robot, mine = search.problem.robot, frozenset(start.terms)
    forms = {term: EFFECTS[term.effect].form_of(robot, term.free) for term in asked}
    numbers = {term: tuple(dict.fromkeys(map(number_varied, term.free))) for term in asked}
    local = {term for term, form in forms.items() if form.local and not _varies_by_row(term)}
    wide: dict[Term, Term] = {}  # with all numbers that vary, and these in each part of the robot
    for term in forms:
        more = [name for name in numbers[term] if name not in term.free]
        more += [part for name in numbers[term] if term in local for part in part_names(name)]
        wide[term] = Term(term.effect, tuple(dict.fromkeys((*term.free, *more))))
    search.probe(start, [item for item in asked if item not in mine], largely={*wide.values()} - mine)
    found = []
    for term, form in forms.items():
        change = None if term in mine else search.tangents[mine, term]
        at = beside_fit(start, term, change, form.only_varies)
        columns = dict(at.own)
        if wide[term] not in mine:
            probe = search.secants[mine, wide[term]]
            columns |= {name: column for (_, name), column in zip(probe.keys, probe.columns.T, strict=True)}
        along = EFFECTS[term.effect].varies_with(form)
        usable = [(items, values) for items, values in rows if items[0].along in along]
        shaped = {item.name for item in form.parameters(robot) if item.of_shape}
        ways: list[VaryingWay] = []
        for name in (item for item in numbers[term] if item not in shaped):
            if two:
                pairs = multiplied(at, columns[name], rows, along)
                ways += along_rows(name, columns[name], pairs)
                continue
            ways += along_rows(name, columns[name], usable)
            if term in local:
                parts = [columns[part] for part in part_names(name)]
                ways += along_robot(name, np.stack(parts, axis=1))
        found += promises(start, at, ways, VARIED_EACH) if ways else []
    return unlike(found, VARIED_EACH)


def varying_singles(problem: Problem, candidates: Sequence[str], pool: Workers = SERIAL) -> tuple[Fit, ...]:
    """Return the best fit of a single effect of which a number varies, where it pays; () where none does.

    What acts on what is observed is not asked: whatever the tracker does, a number of it may follow.
    """
    problem = replace(with_fewer_rows(problem), interleaved=True)
    search = Search(pool, problem, lambda line: None)
    path = search.fitted([((), {})])
    if not isinstance(problem.twin, Prediction):
        return ()
    terms = [term for name in candidates for term in terms_for(problem.robot, name, problem.moving)]
    terms += _varying_terms(problem, candidates)
    forms = {term: EFFECTS[term.effect].form_of(problem.robot, term.free) for term in terms}
    vary(
        search, path, [term for term in terms if forms[term].stage is not Stage.OBSERVATION], most=1, few=True
    )
    return tuple(path[1:])


def _varies(item: Fit) -> bool:
    return any(MARK in name for term in item.terms for name in term.free)


def _varies_by_row(term: Term) -> bool:
    return any(variation_of(name).along != "place" for name in term.free if MARK in name)


def _varying_terms(problem: Problem, names: Sequence[str]) -> list[Term]:
    """Return terms of forms whose numbers do something of their own only where they vary."""
    return [
        Term(name, (item.name,))
        for name in names
        for form in EFFECTS[name].forms
        if form.only_varies
        for item in form.parameters(problem.robot)
    ]


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
    if not _varies(path[-1]):
        path = [item for item in path if not _varies(item)]
    tried = tuple(item for item in search.tried if _varies(path[-1]) or not _varies(item))
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
    numbers = (*simple, *detailed, *_varying_terms(problem, candidates))
    varied, singles = _varied_first(search, path, singles, numbers, [*detailed, *further])
    problem, null = search.problem, path[0]
    for left in reversed(range(CHOICE_ROUNDS)):
        beside_simple: list[list[Term]] = [[], detailed, [*detailed, *further]]
        for variants in ((simple, more) for more in beside_simple[begin:]):
            if _varies(path[-1]) or _ended(problem, null, path[-1], bool(variants[1])):
                break
            if len(variants[1]) > len(detailed):
                if leaves_only_noise(problem, path[-1], NEAR_NOISE):
                    break
                detailed = variants[1]
            if variants[1] and len(path) == 1:
                singles = _once([*singles, *search.alone(null, detailed)])
            _forward(search, singles, variants, path, most, PATIENCE if left == CHOICE_ROUNDS - 1 else 0)
        if left == CHOICE_ROUNDS - 1 and _may_vary(search, path):
            singles = _varied_last(search, path, singles, numbers, varied, most)
            problem, null = search.problem, path[0]
        done = search.late or within_model(problem, null, path[-1])
        if left == CHOICE_ROUNDS - 1 and not done and not leaves_only_noise(problem, path[-1]):
            singles = _once([*singles, *search.alone(null, detailed)])
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
        alone = len(current.terms) == 1 and leaves_only_noise(problem, current) and not _varies(current)
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


def _varied_first(
    search: Search, path: list[Fit], singles: list[Fit], numbers: Sequence[Term], listed: Sequence[Term]
) -> tuple[VariedAlone | None, list[Fit]]:
    """Return the best single cause of which a number varies, if asked, and the singles.

    `path` then leads to it where it leaves only noise, and no `listed` form of a cause does alone.
    """
    if len(path) > 1 or not _may_vary(search, path) or _settled(search.problem, singles):
        return None, singles
    varied = varied_alone(search, numbers)
    if varied.leaves(SETTLED_FACTOR):
        singles = _once([*singles, *search.alone(path[0], listed)])
        if not _settled(search.problem, singles) and varied.taken(search, path, SETTLED_FACTOR):
            singles = [search.fits[frozenset(item.terms)] for item in singles]
    return varied, singles


def _varied_last(
    search: Search,
    path: list[Fit],
    singles: Sequence[Fit],
    numbers: Sequence[Term],
    varied: VariedAlone | None,
    most: int,
) -> list[Fit]:
    """Lengthen `path` by a cause of which a number varies, alone or beside others; return the singles."""
    if not (varied and varied.taken(search, path, LEFT_OF_FEW)):
        vary(search, path, numbers, most)
    if not _varies(path[-1]):  # nor is one to come in by another way
        search.fits = {key: item for key, item in search.fits.items() if not _varies(item)}
    return [search.fits[frozenset(item.terms)] for item in singles]


def _settled(problem: Problem, fits: Sequence[Fit]) -> bool:
    return any(leaves_only_noise(problem, item) for item in fits)


def _may_vary(search: Search, path: Sequence[Fit]) -> bool:
    """Return whether it is asked whether a number varies: of held rows that no single cause settles."""
    problem, best = search.problem, path[-1]
    if problem.moving or problem.model_share or search.late or not isinstance(problem.twin, Prediction):
        return False
    return len(best.terms) > 1 or not leaves_only_noise(problem, best)


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
    singles = _once([*singles, *search.alone(null, detailed)])
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
