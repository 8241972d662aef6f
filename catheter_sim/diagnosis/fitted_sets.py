"""What a search for causes has tried: hypotheses probed first, few fitted well, nothing worked out twice."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from catheter_sim.diagnosis.comparison import (
    as_good,
    leaves_only_noise,
    pays,
)
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.problem import (
    Problem,
    Term,
    in_other_forms,
)
from catheter_sim.diagnosis.thresholds import (
    MOST_FIT_STEPS,
)
from catheter_sim.diagnosis.workers import (
    Foreseen,
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

MOST_SINGLES = 8
"""[hypotheses] Where the robot moved, this many single causes are fitted, the best in a probe. Why: each is
simulated, at some hundred times the cost of a fast model. A cause that does much alone is among the first."""
MOST_ROUGH_STEPS = 4
"""[steps] A fit that only says which sets of two are worth fitting well makes this many. Why: the first steps
take most of what there is to take."""
FIRST_IN_ALL_FORMS = 2
"""[single causes] This many of the best are tried in all their forms before sets of two. Why: a hidden law of
the fifth power comes first or second as one of the third."""
HOPELESS_FACTOR = 1.2
"""[times the cross-validated error of the competing set] A set that errs by more on what it was fitted to is
not cross-validated well. Why: it predicts what is left out even worse, and sets are equal within
`EQUAL_FACTOR`."""
FINALISTS = 3
"""[hypotheses] One step fits this many, as many again of few numbers, and as many beside the best set. Why: a
probe is one step of a fit, which ranks well but not surely."""
PAIRS = 24
"""[sets of two causes] If the sets beside the best single causes leave structure, this many are fitted
roughly. Why: one step from a single cause says little about a set whose numbers are both far from it."""
PAIRS_IN_MOTION = 6
"""[sets of two causes] The same where the robot moved. Why: assumed. It is twice `FINALISTS`, because each
robot is simulated."""
RIVALS = 2
"""[hypotheses] This many are fitted in the place of each chosen cause. Why: assumed. What does as well ranks
first among the probes."""
MOST_FORMS = 8
"""[hypotheses] Where the search would end, this many other variants of a set's causes are fitted. Why:
assumed. It bounds the time."""

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


def once(fits: Sequence[Fit]) -> list[Fit]:
    """Return one fit of each hypothesis."""
    return list({frozenset(item.terms): item for item in fits}.values())


def distinct(fits: Sequence[Fit]) -> list[Fit]:
    """Return the first fit of each set of causes."""
    first: dict[frozenset[str], Fit] = {}
    for item in fits:
        first.setdefault(frozenset(item.causes), item)
    return list(first.values())
