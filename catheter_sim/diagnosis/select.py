"""Chooses causes inside the training data: each has to pay for itself on stretches left out.

Forward, one cause at a time: every remaining effect is probed beside those chosen so far,
the most promising few are fitted well, and the best of these is taken if the errors on the stretches left out
fall by more than chance allows (`PAYS_CHANCE`; stretches count, not rows) and by more than
`PAYS_SHARE`. What acts on the whole robot comes first: only when no more of that pays are values
per channel or segment tried, which are many, and fit what they see better than what they do not see.
Where an effect has several ways of as few numbers (a lag or a delay), one may take the other's place.
Last, backward: a cause whose loss costs nothing is dropped, and several causes that one alone
explains as well as they do give way to it. Nothing of the held-out data is seen.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.diagnosis.evidence import chance_of_gain
from catheter_sim.diagnosis.fit import Fit, fit, probe
from catheter_sim.diagnosis.hypothesis import Problem, Term, terms_for
from catheter_sim.diagnosis.workers import HERE, Workers, each
from catheter_sim.effects.registry import EFFECTS

PAYS_CHANCE = 0.023  # probability of a gain by chance, at most: two standard errors of a normal distribution
PAYS_SHARE = 0.03  # share of the root mean square by which it must lower it
FINALISTS = 3
RIVALS = 2  # fitted in the place of each chosen cause
_RIVAL_COST = 2.0  # a rival's squared error after one step, over that of the choice, still worth a fit
MOST_CAUSES = 8
_ROUNDS = 3  # of choosing, if something better stands in a cause's place in the end
_ROWS = 600  # rows compared in the fits that choose

Known = Mapping[tuple[str, str], float]


@dataclass(frozen=True)
class Selection:
    """What was tried inside the training data.

    Attributes:
        null: the calibrated model without causes.
        singles: every effect alone, one fit per variant.
        tried: further hypotheses that were fitted well.
        path: from `null` to the chosen hypothesis, a cause more (or another variant) each time.
        chosen: the chosen hypothesis.
        alike: groups of a chosen effect, first, and others that do as well in its place.
    """

    null: Fit
    singles: tuple[Fit, ...]
    tried: tuple[Fit, ...]
    path: tuple[Fit, ...]
    chosen: Fit
    alike: tuple[tuple[str, ...], ...]


def candidates_for(problem: Problem) -> tuple[str, ...]:
    """Return the effects that a diagnosis tries: those that make sense for the robot and its trials.

    Left out are those whose number is calibrated already, and `payload`, whose rivalry with precurvature and
    frame has not been tested.
    """
    left_out = {name for item in problem.nuisances for name in item.stands_for} | {"payload"}
    return tuple(
        name
        for name, effect in EFFECTS.items()
        if name not in left_out
        and effect.parameters(problem.robot)
        and len(problem.trials) >= effect.least_trials
    )


def pays(before: Fit, after: Fit) -> bool:
    """Return whether `after` explains left-out stretches better than `before` by more than chance."""
    share = 1.0 - after.cross_validated_rms / max(before.cross_validated_rms, 1e-300)
    labels = np.unique(before.block, return_inverse=True)[1]
    change = np.bincount(labels, weights=before.left_out**2 - after.left_out**2).astype(float)
    return share > PAYS_SHARE and chance_of_gain(change) <= PAYS_CHANCE


def as_good(best: Fit, other: Fit) -> bool:
    """Return whether `other` explains left-out stretches as well as `best`, to within chance."""
    return not pays(other, best)


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
    rows = sum(len(trial.inputs) for trial in problem.trials)
    problem = replace(problem, every=max(1, round(rows / _ROWS)))
    say = on_fit or (lambda line: None)
    (null,) = each(pool, fit, [(problem, ())])
    tiers = [terms_for(problem.robot, name) for name in candidates]
    simple = [term for terms in tiers for term in terms if len(term.free) <= len(terms[0].free)]
    detailed = [term for terms in tiers for term in terms if term not in simple]
    alone = [term for terms in tiers for term in _promising(pool, problem, null, terms)]
    singles = _fit_all(pool, problem, [((term,), {}) for term in alone])
    path = [null]
    tried: list[Fit] = []
    for left in reversed(range(_ROUNDS)):
        for variants in (simple, [*simple, *detailed]):
            _forward(pool, problem, singles, variants, path, tried, say)
        current = path[-1]
        current, dropped = _backward(pool, problem, current)
        tried += dropped
        if len(current.terms) > 1:
            # Causes of the whole robot come first; together they may stand for one of a channel or segment.
            equal = [item for item in singles if as_good(current, item)]
            current = min(
                equal, key=lambda item: (len(item.frees), item.cross_validated_rms), default=current
            )
        if current is not path[-1]:
            path.append(current)
        if len(current.terms) == 1:
            rivals = [(current.causes[0], item) for item in singles if item.causes != current.causes]
        else:
            rivals = _rivals(pool, problem, current, (*simple, *detailed))
            tried += [item for _, item in rivals]
        better = _in_order([item for _, item in rivals])[:1]
        if not left or not better or not pays(current, better[0]):
            break
        path.append(better[0])
    groups = _alike(current, rivals)
    return Selection(null, tuple(singles), tuple(tried), tuple(path), current, groups)


def _forward(
    pool: Workers,
    problem: Problem,
    singles: Sequence[Fit],
    variants: Sequence[Term],
    path: list[Fit],
    tried: list[Fit],
    say: Callable[[str], None],
) -> None:
    """Lengthen `path` by one of `variants` at a time while each pays; what was fitted goes to `tried`."""
    while len(path[-1].terms) < MOST_CAUSES:
        current = path[-1]
        if current.terms:
            finalists = _next_finalists(pool, problem, current, variants)
            tried += finalists
        else:
            finalists = _in_order([item for item in singles if item.terms[0] in variants])
        if not finalists:
            return
        best = finalists[0]
        say(
            f"{'+'.join(best.causes)}: {best.cross_validated_rms:.4g} (was {current.cross_validated_rms:.4g})"
        )
        if not pays(current, best):
            return
        path.append(best)


def _promising(pool: Workers, problem: Problem, null: Fit, terms: Sequence[Term]) -> Sequence[Term]:
    """Return the variants of one effect to fit alone: of many, the `FINALISTS` that a probe puts first."""
    if len(terms) <= FINALISTS:
        return terms
    probes = each(pool, probe, [(problem, null, (term,)) for term in terms])
    order = sorted(range(len(terms)), key=lambda index: probes[index][0])
    return [terms[index] for index in sorted(order[:FINALISTS])]


def _rivals(pool: Workers, problem: Problem, chosen: Fit, variants: Sequence[Term]) -> list[tuple[str, Fit]]:
    """Return fits in which another effect, the last term, stands in the place of a chosen one.

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
    probes = each(pool, probe, [(problem, chosen, terms) for _, terms in hypotheses])
    limit = _RIVAL_COST * float(chosen.residual @ chosen.residual)
    picked: list[int] = []
    for name in chosen.causes:
        mine = [i for i, (cause, _) in enumerate(hypotheses) if cause == name and probes[i][0] < limit]
        picked += sorted(mine, key=lambda i: probes[i][0])[:RIVALS]
    fits = _fit_all(pool, problem, [(hypotheses[i][1], probes[i][1]) for i in picked])
    return [(hypotheses[index][0], item) for index, item in zip(picked, fits, strict=True)]


def _alike(chosen: Fit, rivals: Sequence[tuple[str, Fit]]) -> tuple[tuple[str, ...], ...]:
    """Return each chosen effect with those that do as well in its place.

    Args:
        chosen: the chosen hypothesis.
        rivals: name of a chosen effect, and a fit whose last term stands in its place.
    """
    groups: dict[str, list[str]] = {}
    for name, item in rivals:
        rival = item.terms[-1].effect
        if as_good(chosen, item) and rival not in groups.get(name, []):
            groups.setdefault(name, [name]).append(rival)
    return tuple(tuple(group) for group in groups.values())


def _next_finalists(pool: Workers, problem: Problem, current: Fit, variants: Sequence[Term]) -> list[Fit]:
    """Return the fits of the most promising hypotheses one step beyond `current`, best first."""
    hypotheses = [terms for terms in (_beside(current.terms, term) for term in variants) if terms]
    probes = each(pool, probe, [(problem, current, terms) for terms in hypotheses])
    order = sorted(range(len(probes)), key=lambda index: probes[index][0])
    best = [(hypotheses[index], probes[index][1]) for index in order[:FINALISTS]]
    return _in_order(_fit_all(pool, problem, best))


def _beside(terms: tuple[Term, ...], extra: Term) -> tuple[Term, ...]:
    """Return `terms` with `extra`, in place of its effect's variant of no more numbers; () if not new."""
    if extra in terms:
        return ()
    for index, term in enumerate(terms):
        if term.effect == extra.effect:
            fewer = len(extra.free) < len(term.free)
            return () if fewer else (*terms[:index], extra, *terms[index + 1 :])
    return (*terms, extra)


def _backward(pool: Workers, problem: Problem, current: Fit) -> tuple[Fit, list[Fit]]:
    """Return `current` without the causes that do not pay, and the fits made to find out."""
    made: list[Fit] = []
    while len(current.terms) > 1:
        known = current.values
        without = [tuple(term for term in current.terms if term is not one) for one in current.terms]
        fits = _fit_all(pool, problem, [(terms, known) for terms in without])
        made += fits
        idle = [item for item in fits if not pays(item, current)]
        if not idle:
            break
        current = min(idle, key=lambda item: item.cross_validated_rms)
    return current, made


def _in_order(fits: Sequence[Fit]) -> list[Fit]:
    return sorted(fits, key=lambda item: item.cross_validated_rms)


def _fit_all(
    pool: Workers, problem: Problem, hypotheses: Sequence[tuple[Sequence[Term], Known]]
) -> list[Fit]:
    """Return the fits of several hypotheses, each from its known values, in order."""
    return each(pool, fit, [(problem, terms, dict(known)) for terms, known in hypotheses])
