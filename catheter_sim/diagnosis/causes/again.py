"""What a choice of causes asks once more: every cause alone, and what does as well as one that was chosen."""

from __future__ import annotations

from collections.abc import Sequence

from catheter_sim.diagnosis.causes.choose import by_size
from catheter_sim.diagnosis.causes.comparison import as_good, rivals_of
from catheter_sim.diagnosis.causes.search import Search, in_order
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.problem import Problem, terms_for, with_fewer_rows
from catheter_sim.diagnosis.fitting.workers import SERIAL, Workers


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
    """Return the hypotheses that do as well on the training data as one at which the search did not end.

    Args:
        problem: the training trials.
        chosen: the hypothesis.
        candidates: names of the effects that may stand in a chosen one's place.
        pool: where to fit.
    """
    problem = with_fewer_rows(problem)
    search = Search(pool, problem, lambda line: None)
    (current,) = search.fitted([(chosen.terms, chosen.values)])
    simple, detailed = by_size([terms_for(problem.robot, name, problem.moving) for name in candidates])
    search.fit_in_each_place(current, (*simple, *detailed))
    return tuple(item for _, _, item in rivals_of(current, search.tried) if as_good(current, item))
