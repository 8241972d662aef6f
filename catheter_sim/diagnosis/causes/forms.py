"""In which of its forms a chosen cause acts: the forms compete on stretches left out.

The search finds a cause by its simplest forms. Here each of its other forms stands in the place of the one
that was found. It is taken if it does better on the stretches left out by more than chance allows, shared
among the forms that are tried: with many forms one of them would often do a little better by chance. What the
simplest form lacked, another cause may have taken on. So each form is tried without the other causes, too:
with fewer numbers it need only do as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from catheter_sim.diagnosis.causes.comparison import as_good, may_replace, pays
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.problem import Problem, Term, in_other_forms, with_fewer_rows
from catheter_sim.diagnosis.fitting.workers import SERIAL, OutOfTime, Workers, map_calls
from catheter_sim.diagnosis.report.result import Cause
from catheter_sim.diagnosis.thresholds import PAYS_CHANCE
from catheter_sim.effects import EFFECTS


def in_best_forms(
    problem: Problem,
    chosen: Fit,
    thorough: bool = False,
    pool: Workers = SERIAL,
    deadline: float = math.inf,
) -> Fit:
    """Return the hypothesis with each of its causes in the form that explains left-out stretches best.

    Args:
        problem: the training trials.
        chosen: the hypothesis, fitted to all training rows.
        thorough: as for `fit`.
        pool: where to fit.
        deadline: on the clock of `time.monotonic`, after which no more forms are tried [s].

    Of a model in motion that is known to be wrong other forms would only mend the model, at minutes for each.
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
    """Return the causes with the form of each, and with those of its other forms that do as well.

    Args:
        problem: the training trials.
        causes: of `chosen`.
        chosen: the hypothesis.
        pool: where to fit.
    """
    if not causes:
        return ()
    tried = not (problem.moving and problem.model_share)  # as of `in_best_forms`
    now, others = _fitted(problem, chosen, pool) if tried else (chosen, [])
    equal = [(cause, form) for cause, form, item in others if as_good(now, item)]
    own = {term.effect: EFFECTS[term.effect].form_of(problem.robot, term.free).name for term in chosen.terms}
    return tuple(
        replace(
            cause,
            form=own[cause.name],
            forms_as_good=tuple(dict.fromkeys(form for name, form in equal if name == cause.name)),
        )
        for cause in causes
    )


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
