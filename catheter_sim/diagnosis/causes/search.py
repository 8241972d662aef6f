"""What a search for causes has tried, and what it may try next: hypotheses probed first, few fitted well."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.probe import probe
from catheter_sim.diagnosis.fitting.problem import Problem, Term
from catheter_sim.diagnosis.fitting.workers import Workers, map_calls
from catheter_sim.diagnosis.thresholds import FINALISTS, MOST_FORMS, PAIRS, RIVALS

Known = Mapping[tuple[str, str], float]


Probe = tuple[float, dict[tuple[str, str], float]]  # as `probe.probe` returns it


@dataclass
class Search:
    """What a selection has fitted and probed so far; nothing is worked out twice.

    Attributes:
        pool: where to fit.
        problem: the training trials.
        say: called with a line when a step is done.
        fits: by hypothesis.
        probes: by the hypotheses from which and to which.
    """

    pool: Workers
    problem: Problem
    say: Callable[[str], None]
    fits: dict[frozenset[Term], Fit] = field(default_factory=dict)
    probes: dict[tuple[frozenset[Term], frozenset[Term]], Probe] = field(default_factory=dict)

    @property
    def tried(self) -> list[Fit]:
        """Every fit that has a cause."""
        return [item for item in self.fits.values() if item.terms]

    def fitted(self, hypotheses: Sequence[tuple[Sequence[Term], Known]]) -> list[Fit]:
        """Return the fits of several hypotheses, each from its known values, in order."""
        new = {
            frozenset(terms): (self.problem, tuple(terms), dict(known), True, False, True)
            for terms, known in hypotheses
        }
        missing = [key for key in new if key not in self.fits]
        found = map_calls(self.pool, fit, [new[key] for key in missing])
        self.fits |= dict(zip(missing, found, strict=True))
        return [self.fits[frozenset(terms)] for terms, _ in hypotheses]

    def probed(self, hypotheses: Sequence[tuple[Fit, tuple[Term, ...]]]) -> list[Probe]:
        """Return what one step from a fit reaches toward a hypothesis, for several pairs of them, in
        order."""
        keys = [(frozenset(start.terms), frozenset(terms)) for start, terms in hypotheses]
        missing = [index for index, key in enumerate(keys) if key not in self.probes]
        found = map_calls(self.pool, probe, [(self.problem, *hypotheses[index]) for index in missing])
        self.probes |= {keys[index]: item for index, item in zip(missing, found, strict=True)}
        return [self.probes[key] for key in keys]

    def promising(self, null: Fit, terms: Sequence[Term]) -> Sequence[Term]:
        """Return the variants of one effect to fit alone: of many, the `FINALISTS` best probed."""
        if len(terms) <= FINALISTS:
            return terms
        probes = self.probed([(null, (term,)) for term in terms])
        order = sorted(range(len(terms)), key=lambda index: probes[index][0])
        return [terms[index] for index in sorted(order[:FINALISTS])]

    def with_one_more_cause(
        self, beam: Sequence[Fit], variants: tuple[Sequence[Term], Sequence[Term]]
    ) -> list[Fit]:
        """Return the fits of the most promising hypotheses one step beyond any of `beam`, best first.

        Args:
            beam: where from.
            variants: of all effects, those with few numbers and the others.
        """
        simple, detailed = variants
        new: dict[frozenset[Term], tuple[Fit, tuple[Term, ...], bool]] = {}
        for start in beam:
            for term in (*simple, *detailed):
                terms = beside(start.terms, term)
                if terms:
                    new.setdefault(frozenset(terms), (start, terms, term in simple))
        hypotheses = list(new.values())
        probes = self.probed([(start, terms) for start, terms, _ in hypotheses])
        order = sorted(range(len(probes)), key=lambda index: probes[index][0])
        few = [index for index in order if hypotheses[index][2]]
        first = [index for index in order if hypotheses[index][0] is beam[0]]
        picked = dict.fromkeys(index for ranked in (order, few, first) for index in ranked[:FINALISTS])
        return in_order(self.fitted([(hypotheses[i][1], probes[i][1]) for i in picked]))

    def pairs(self, singles: Sequence[Fit], variants: Sequence[Term]) -> list[Fit]:
        """Return the best fits of two causes each, of all sets of two `variants` that were fitted alone.

        One step from a single cause tells little of a set in which both numbers are far from it; so `PAIRS`
        sets are fitted before the `FINALISTS` are chosen.
        """
        starts = [item for item in singles if item.terms[0] in variants]
        hypotheses = [
            (start, (*start.terms, *other.terms))
            for start in starts
            for other in starts
            if start.causes != other.causes
        ]
        probes = self.probed(hypotheses)
        known: dict[frozenset[Term], tuple[tuple[Term, ...], Known]] = {}
        for index in sorted(range(len(probes)), key=lambda index: probes[index][0]):
            terms = hypotheses[index][1]
            known.setdefault(frozenset(terms), (terms, probes[index][1]))
        sets = list(known.values())[:PAIRS]
        fits = map_calls(
            self.pool,
            fit,
            [(self.problem, terms, dict(values), False, False, True) for terms, values in sets],
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
        return in_order(self.fitted([(terms, best.values) for terms in hypotheses[:MOST_FORMS]]))

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
        probes = self.probed([(chosen, terms) for _, terms in hypotheses])
        picked: list[int] = []
        for name in chosen.causes:
            mine = [index for index, (cause, _) in enumerate(hypotheses) if cause == name]
            picked += sorted(mine, key=lambda index: probes[index][0])[:RIVALS]
        self.fitted([(hypotheses[index][1], probes[index][1]) for index in picked])


def beside(terms: tuple[Term, ...], extra: Term) -> tuple[Term, ...]:
    """Return `terms` with `extra`, in the place of another variant of its effect; () if not new."""
    if extra in terms:
        return ()
    return (*(term for term in terms if term.effect != extra.effect), extra)


def in_order(fits: Iterable[Fit]) -> list[Fit]:
    """Return fits by their error on the stretches left out, best first."""
    return sorted(fits, key=lambda item: item.cross_validated_rms)
