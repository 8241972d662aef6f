"""Chooses causes inside the training data: each has to pay for itself on stretches left out.

Forward, one cause more at a time, beside each of the few best sets so far (`BEAM`): every remaining effect
is probed, the most promising are fitted well, and the best of these is taken if the errors on the stretches
left out fall by more than chance allows (`PAYS_CHANCE`; stretches count, not rows) and by more than
`PAYS_SHARE`. The best set of two need not hold a cause that does much alone: where the promising ones leave
structure (`SETTLED`), all sets of two are probed, and the best (`PAIRS`) fitted. Two causes may pay where
neither does alone, since each raises some errors that the other takes away, so that where structure is left
the search ends only when two steps have not paid (`PATIENCE`). Values per channel or segment fit what they
see better than what they do not see. So a set of fewer numbers is taken before a better one that it equals
to within chance and `EQUAL`, and what acts on the whole robot comes first: only when no more of that pays
are such values tried; where that ends with structure left, both are tried together from the start, and
taken if that leaves none.
Last, backward: a cause whose loss costs nothing is dropped, and the set gives way to any of fewer numbers
that was tried and explains as much, unless causes tried beside it pay there. Nothing of the held-out data is
seen.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from catheter_sim.diagnosis.evidence import chance_of_gain, residual_series
from catheter_sim.diagnosis.fit import Fit, fit, probe
from catheter_sim.diagnosis.hypothesis import Problem, Term, terms_for, thinned
from catheter_sim.diagnosis.noise import white_noise
from catheter_sim.diagnosis.trials import unit_of
from catheter_sim.diagnosis.workers import HERE, Workers, each
from catheter_sim.effects.registry import EFFECTS

PAYS_CHANCE = 0.023  # probability of a gain by chance, at most: two standard errors of a normal distribution
PAYS_SHARE = 0.03  # share of the root mean square by which it must lower it
FINALISTS = 3  # fitted of the hypotheses of one step; as many of few numbers; as many beside the best set
BEAM = 3  # sets of causes to which another one is added
EQUAL = 1.1  # times the error of the best, of a set that may be taken in its place for its fewer numbers
PAIRS = 24  # sets of two causes fitted, where those beside the best single causes leave structure
PATIENCE = 1  # steps that need not pay, if the next one does
RIVALS = 2  # fitted in the place of each chosen cause
SETTLED = 1.1  # times its white part, of an error in which nothing more is looked for than one step finds
MOST_CAUSES = 6
_MOST_FORMS = 8  # of the causes of a set, fitted where the search would end
_ROUNDS = 3  # of choosing, if something better stands in a cause's place in the end

Known = Mapping[tuple[str, str], float]
Probe = tuple[float, dict[tuple[str, str], float]]  # as `fit.probe` returns it


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
    """

    null: Fit
    singles: tuple[Fit, ...]
    tried: tuple[Fit, ...]
    path: tuple[Fit, ...]
    chosen: Fit
    equals: tuple[Fit, ...]


def candidates_for(problem: Problem) -> tuple[str, ...]:
    """Return the effects that a diagnosis tries: those that make sense for the robot and its trials.

    Left out are those whose number is calibrated already.
    """
    left_out = {name for item in problem.nuisances for name in item.stands_for}
    return tuple(
        name
        for name, effect in EFFECTS.items()
        if name not in left_out
        and effect.parameters(problem.robot)
        and len(problem.trials) >= effect.least_trials
    )


def pays(before: Fit, after: Fit, chance: float = PAYS_CHANCE) -> bool:
    """Return whether `after` explains left-out stretches better than `before` by more than chance."""
    share = 1.0 - after.cross_validated_rms / max(before.cross_validated_rms, 1e-300)
    labels = np.unique(before.block, return_inverse=True)[1]
    change = np.bincount(labels, weights=before.left_out**2 - after.left_out**2).astype(float)
    return share > PAYS_SHARE and chance_of_gain(change) <= chance


def alike(chosen: Fit, equals: Sequence[Fit]) -> tuple[tuple[str, ...], ...]:
    """Return each chosen effect with those that stand in its place in `equals`."""
    groups: dict[str, list[str]] = {}
    for name, rival, _ in rivals_of(chosen, equals):
        group = groups.setdefault(name, [name])
        if rival not in group:
            group.append(rival)
    return tuple(tuple(group) for group in groups.values())


def as_good(best: Fit, other: Fit) -> bool:
    """Return whether `other` explains left-out stretches as well as `best`, to within chance and `EQUAL`."""
    return other.cross_validated_rms <= EQUAL * best.cross_validated_rms and not pays(other, best)


def select(
    problem: Problem,
    candidates: Sequence[str],
    pool: Workers = HERE,
    on_fit: Callable[[str], None] | None = None,
) -> Selection:
    """Return which of the effects `candidates` explain the training data, and what else was tried.

    Args:
        problem: the training trials.
        candidates: names of effects.
        pool: where to fit.
        on_fit: called with a line when a step is done.
    """
    problem = thinned(problem)
    search = _Search(pool, problem, on_fit or (lambda line: None))
    (null,) = search.fitted([((), {})])
    tiers = [terms_for(problem.robot, name) for name in candidates]
    simple, detailed = _by_size(tiers)
    alone = [term for terms in tiers for term in _promising(search, null, terms)]
    singles = search.fitted([((term,), {}) for term in alone])
    path = [null]
    for left in reversed(range(_ROUNDS)):
        for variants in ((simple, []), (simple, detailed)):
            _forward(search, singles, variants, path)
        if left == _ROUNDS - 1 and not _settled(problem, path[-1]):
            other = [null]
            _forward(search, singles, (simple, detailed), other)
            if pays(path[-1], other[-1]) and _settled(problem, other[-1]):
                path = other
        current = _backward(search, path[-1])
        tried = search.tried
        current = _simplest(current, [item for item in tried if may_end_at(current, item, tried)])
        if current is not path[-1]:
            path.append(current)
        if len(current.terms) > 1:
            _fit_in_each_place(search, current, (*simple, *detailed))
        rivals = [item for _, _, item in rivals_of(current, search.tried)]
        better = _in_order(rivals)[:1]
        if not left or not better or not pays(current, better[0]):
            break
        path.append(better[0])
    equals = tuple(item for item in rivals if as_good(current, item))
    return Selection(null, tuple(singles), tuple(search.tried), tuple(path), current, equals)


def equals_of(
    problem: Problem, chosen: Fit, candidates: Sequence[str], pool: Workers = HERE
) -> tuple[Fit, ...]:
    """Return what does as well on the training data as a hypothesis that the search did not end at.

    Args:
        problem: the training trials.
        chosen: the hypothesis.
        candidates: names of the effects that may stand in a chosen one's place.
        pool: where to fit.
    """
    problem = thinned(problem)
    search = _Search(pool, problem, lambda line: None)
    (current,) = search.fitted([(chosen.terms, chosen.values)])
    simple, detailed = _by_size([terms_for(problem.robot, name) for name in candidates])
    _fit_in_each_place(search, current, (*simple, *detailed))
    return tuple(item for _, _, item in rivals_of(current, search.tried) if as_good(current, item))


@dataclass
class _Search:
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
        found = each(self.pool, fit, [new[key] for key in missing])
        self.fits |= dict(zip(missing, found, strict=True))
        return [self.fits[frozenset(terms)] for terms, _ in hypotheses]

    def probed(self, hypotheses: Sequence[tuple[Fit, tuple[Term, ...]]]) -> list[Probe]:
        """Return what one step from a fit to a hypothesis reaches, of several, in order."""
        keys = [(frozenset(start.terms), frozenset(terms)) for start, terms in hypotheses]
        missing = [index for index, key in enumerate(keys) if key not in self.probes]
        found = each(self.pool, probe, [(self.problem, *hypotheses[index]) for index in missing])
        self.probes |= {keys[index]: item for index, item in zip(missing, found, strict=True)}
        return [self.probes[key] for key in keys]


def _by_size(tiers: Sequence[tuple[Term, ...]]) -> tuple[list[Term], list[Term]]:
    """Return the effects' variants of few numbers, and those of more, by value or channel or segment."""
    simple = [term for terms in tiers for term in terms if len(term.free) <= len(terms[0].free)]
    return simple, [term for terms in tiers for term in terms if term not in simple]


def _forward(
    search: _Search,
    singles: Sequence[Fit],
    variants: tuple[Sequence[Term], Sequence[Term]],
    path: list[Fit],
) -> None:
    """Lengthen `path` by hypotheses that pay, best sets first."""
    beam: Sequence[Fit] = path[-1:]
    waited = 0
    while len(beam[0].terms) < MOST_CAUSES:
        best = path[-1]
        if beam[0].terms:
            level = _grown(search, beam, variants)
            if len(beam[0].terms) == 1 and level and not _settled(search.problem, level[0]):
                level = _in_order(
                    {id(item): item for item in (*level, *_pairs(search, singles, variants[0]))}.values()
                )
        else:
            level = _in_order([item for item in singles if item.terms[0] in (*variants[0], *variants[1])])
        if not level:
            return
        front = _simplest(level[0], level)
        search.say(
            f"{'+'.join(front.causes)}: {front.cross_validated_rms:.4g} (was {best.cross_validated_rms:.4g})"
        )
        beam = _distinct([front, *level])[:BEAM]
        if pays(best, front):
            path.append(front)
            waited = 0
            if _settled(search.problem, front):
                beam = [front]
        elif _settled(search.problem, best):
            return
        elif waited < PATIENCE:
            waited += 1
        else:
            forms = _other_forms(search, best, variants)
            if not forms or not pays(best, forms[0]):
                return
            path.append(forms[0])
            beam, waited = forms[:1], 0


def _other_forms(search: _Search, best: Fit, variants: tuple[Sequence[Term], Sequence[Term]]) -> list[Fit]:
    """Return the fits in which one of the causes has another of its variants, best first."""
    hypotheses = [
        tuple(other if term is mine else term for term in best.terms)
        for mine in best.terms
        for other in (*variants[0], *variants[1])
        if other.effect == mine.effect and other != mine
    ]
    return _in_order(search.fitted([(terms, best.values) for terms in hypotheses[:_MOST_FORMS]]))


def _simplest(best: Fit, others: Sequence[Fit]) -> Fit:
    """Return the fit of fewest numbers among those as good as `best`; `best` itself if none has fewer."""
    equal = [best, *(item for item in others if as_good(best, item))]
    return min(equal, key=lambda item: (len(item.frees), item.cross_validated_rms))


def _settled(problem: Problem, best: Fit) -> bool:
    """Return whether a hypothesis leaves little more than what is white from row to row."""
    series = residual_series(problem, best)
    white = white_noise(series)
    for unit, size in white.items():
        errors = np.concatenate([part for name in series if unit_of(name) == unit for part in series[name]])
        if np.sqrt(np.nanmean(errors**2)) > SETTLED * size:
            return False
    return True


def _distinct(fits: Sequence[Fit]) -> list[Fit]:
    """Return the first fit of each set of causes."""
    first: dict[frozenset[str], Fit] = {}
    for item in fits:
        first.setdefault(frozenset(item.causes), item)
    return list(first.values())


def _promising(search: _Search, null: Fit, terms: Sequence[Term]) -> Sequence[Term]:
    """Return the variants of one effect to fit alone: of many, the `FINALISTS` that a probe puts first."""
    if len(terms) <= FINALISTS:
        return terms
    probes = search.probed([(null, (term,)) for term in terms])
    order = sorted(range(len(terms)), key=lambda index: probes[index][0])
    return [terms[index] for index in sorted(order[:FINALISTS])]


def _fit_in_each_place(search: _Search, chosen: Fit, variants: Sequence[Term]) -> None:
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
    probes = search.probed([(chosen, terms) for _, terms in hypotheses])
    picked: list[int] = []
    for name in chosen.causes:
        mine = [index for index, (cause, _) in enumerate(hypotheses) if cause == name]
        picked += sorted(mine, key=lambda index: probes[index][0])[:RIVALS]
    search.fitted([(hypotheses[index][1], probes[index][1]) for index in picked])


def rivals_of(chosen: Fit, fits: Sequence[Fit]) -> list[tuple[str, str, Fit]]:
    """Return those of `fits` with another effect in a chosen one's place: its name, the other's, the fit."""
    named = set(chosen.causes)
    found = []
    for item in fits:
        gone, come = named - set(item.causes), set(item.causes) - named
        if len(gone) == len(come) == 1:
            found.append((gone.pop(), come.pop(), item))
    return found


def _grown(
    search: _Search, beam: Sequence[Fit], variants: tuple[Sequence[Term], Sequence[Term]]
) -> list[Fit]:
    """Return the fits of the most promising hypotheses one step beyond any of `beam`, best first.

    Args:
        search: what was fitted already.
        beam: where from.
        variants: of all effects, those with few numbers and the others.
    """
    simple, detailed = variants
    new: dict[frozenset[Term], tuple[Fit, tuple[Term, ...], bool]] = {}
    for start in beam:
        for term in (*simple, *detailed):
            terms = _beside(start.terms, term)
            if terms:
                new.setdefault(frozenset(terms), (start, terms, term in simple))
    hypotheses = list(new.values())
    probes = search.probed([(start, terms) for start, terms, _ in hypotheses])
    order = sorted(range(len(probes)), key=lambda index: probes[index][0])
    few = [index for index in order if hypotheses[index][2]]
    first = [index for index in order if hypotheses[index][0] is beam[0]]
    picked = dict.fromkeys(index for ranked in (order, few, first) for index in ranked[:FINALISTS])
    return _in_order(search.fitted([(hypotheses[i][1], probes[i][1]) for i in picked]))


def _pairs(search: _Search, singles: Sequence[Fit], variants: Sequence[Term]) -> list[Fit]:
    """Return the best fits of two causes each, of all sets of two `variants` that were fitted alone.

    One step from a single cause tells little of a set in which both numbers are far from it; so `PAIRS` sets
    are fitted before the `FINALISTS` are chosen.
    """
    starts = [item for item in singles if item.terms[0] in variants]
    hypotheses = [
        (start, (*start.terms, *other.terms))
        for start in starts
        for other in starts
        if start.causes != other.causes
    ]
    probes = search.probed(hypotheses)
    known: dict[frozenset[Term], tuple[tuple[Term, ...], Known]] = {}
    for index in sorted(range(len(probes)), key=lambda index: probes[index][0]):
        terms = hypotheses[index][1]
        known.setdefault(frozenset(terms), (terms, probes[index][1]))
    sets = list(known.values())[:PAIRS]
    fits = each(
        search.pool,
        fit,
        [(search.problem, terms, dict(values), False, False, True) for terms, values in sets],
    )
    best = sorted(fits, key=lambda item: float(item.residual @ item.residual))[:FINALISTS]
    return search.fitted([(item.terms, item.values) for item in best])


def _beside(terms: tuple[Term, ...], extra: Term) -> tuple[Term, ...]:
    """Return `terms` with `extra`, in the place of another variant of its effect; () if not new."""
    if extra in terms:
        return ()
    return (*(term for term in terms if term.effect != extra.effect), extra)


def _backward(search: _Search, current: Fit) -> Fit:
    """Return `current` without the causes that do not pay."""
    while len(current.terms) > 1:
        known = current.values
        without = [tuple(term for term in current.terms if term is not one) for one in current.terms]
        fits = search.fitted([(terms, known) for terms in without])
        idle = [item for item in fits if not pays(item, current) and may_end_at(current, item, search.tried)]
        if not idle:
            break
        current = min(idle, key=lambda item: item.cross_validated_rms)
    return current


def may_end_at(current: Fit, reduced: Fit, tried: Sequence[Fit]) -> bool:
    """Return whether the search may end at `reduced` as well as at `current`.

    Not where causes were tried beside it that together pay over it, and not over `current`: each one's loss
    may cost little, and that of several much.
    """
    beyond = (item for item in tried if set(item.causes) > set(reduced.causes))
    return not any(pays(reduced, item) and not pays(current, item) for item in beyond)


def _in_order(fits: Sequence[Fit]) -> list[Fit]:
    return sorted(fits, key=lambda item: item.cross_validated_rms)
