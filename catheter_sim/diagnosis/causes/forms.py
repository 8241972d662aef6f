"""In which of its forms a chosen cause acts: the forms compete on stretches left out.

The search finds a cause by its simplest forms. Here each of its other forms stands in the place of the one
that was found. It is taken if it does better on the stretches left out by more than chance allows, shared
among the forms that are tried: with many forms one of them would often do a little better by chance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from catheter_sim.diagnosis.causes.comparison import as_good, pays
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.problem import Problem, Term, with_fewer_rows
from catheter_sim.diagnosis.fitting.workers import SERIAL, Workers, map_calls
from catheter_sim.diagnosis.report.result import Cause
from catheter_sim.diagnosis.thresholds import PAYS_CHANCE
from catheter_sim.effects import EFFECTS


def in_best_forms(problem: Problem, chosen: Fit, thorough: bool = False, pool: Workers = SERIAL) -> Fit:
    """Return the hypothesis with each of its causes in the form that explains left-out stretches best.

    Args:
        problem: the training trials.
        chosen: the hypothesis, fitted to all training rows.
        thorough: as for `fit`.
        pool: where to fit.
    """
    for _ in chosen.terms:  # one cause changes its form at a time, each once at most
        now, others = _fitted(problem, chosen, pool)
        better = [item for _, _, item in others if pays(now, item, PAYS_CHANCE / len(others))]
        if not better:
            break
        best = min(better, key=lambda item: item.cross_validated_rms)
        chosen = fit(problem, best.terms, best.values, cross_validate=False, thorough=thorough)
    return chosen


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
    now, others = _fitted(problem, chosen, pool)
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


def _fitted(problem: Problem, chosen: Fit, pool: Workers) -> tuple[Fit, list[tuple[str, str, Fit]]]:
    """Return the hypothesis fitted to rows to choose by, and the same with one cause in another form.

    Of these the cause, the form's name and the fit; of a form that is freed in several ways, one of each.
    """
    few = with_fewer_rows(problem)
    others = list(_in_other_forms(problem, chosen))
    if not others:
        return chosen, []
    hypotheses = [chosen.terms, *(terms for _, _, terms in others)]
    fits = map_calls(pool, fit, [(few, terms, chosen.values, True, False, True) for terms in hypotheses])
    return fits[0], [(cause, form, item) for (cause, form, _), item in zip(others, fits[1:], strict=True)]


def _in_other_forms(problem: Problem, chosen: Fit) -> Iterator[tuple[str, str, tuple[Term, ...]]]:
    for term in chosen.terms:
        effect = EFFECTS[term.effect]
        mine = effect.form_of(problem.robot, term.free)
        for form in effect.forms:
            if form.in_motion and not problem.moving:
                continue
            for names in () if form is mine else form.freed(problem.robot):
                other = Term(term.effect, names)
                yield effect.name, form.name, tuple(other if item is term else item for item in chosen.terms)
