"""Numbers that vary: along the robot, over time, with inputs, with what came before.

A search asks for them where no single cause settles the data. All that a number may vary with is ranked by
derivatives, beside the model without causes and, where structure is left, beside the set where the search
has come to. The best are fitted, and from the best of these all are ranked once more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.core.effect import Stage
from catheter_sim.core.variation import MARK, number_varied, variation_of
from catheter_sim.diagnosis.comparison import (
    SETTLED_FACTOR,
    leaves_only_noise,
    noise_in_weights,
    pays,
)
from catheter_sim.diagnosis.fit import Fit, left_out_anew
from catheter_sim.diagnosis.fitted_sets import Search, distinct, in_order, once, simplest
from catheter_sim.diagnosis.problem import (
    Problem,
    Term,
    terms_for,
    with_fewer_rows,
)
from catheter_sim.diagnosis.thresholds import (
    PAYS_CHANCE,
    PAYS_SHARE,
)
from catheter_sim.diagnosis.variations import (
    Promise,
    VaryingCourse,
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
    Workers,
    map_calls,
)
from catheter_sim.effects import EFFECTS
from catheter_sim.theory.twins import Prediction

VARIED_BESIDE = 3
"""[causes] Beside more, no number is asked whether it varies. Why: assumed. So many soak up what varies, and
each fit costs three robots in place of one."""
VARIED = 6
"""[hypotheses] This many in which a number varies are fitted beside each set that the search has reached.
Why: assumed. Their derivatives rank them well, and each costs three robots in place of one."""
VARIED_WORTH = 1.5
"""[times the error of the set that the search has reached] A number that varies is not fitted if its
derivative promises to leave more. Why: for three planted ones it promised at most 1.04 times what the fit
left (`tests/diagnosis/test_varying_planted.py`)."""
NEARER_ROUNDS = 4
"""[fits] In this many, one after the other, a step or a kink is placed again. Why: assumed. Where a number
varies much, each derivative leads a part of the way."""
VARIED_LEAVES = 0.8
"""[times the error of the set that the search has reached] A number that varies beside others may leave at
most this. Why: for a lens with rings, one such number took a seventh, as one of a hundred ways in which it
might."""
VARIED_NEAR = 1.6
"""[times the error that the best variation promises] The best one of each further cause is fitted, too, if it
promises to leave at most this. Why: for a zero that grows with level, the derivative promised 1.5 times what
the best one did."""
PROMISED_ALONE = 0.5
"""[times the error without causes] A number that is to explain everything by itself is not fitted if its
derivative promises to leave more. Why: for seven such numbers it promised at most a third (tuning draws of
the independent bench)."""
VARIES_SHARE = 0.6
"""[times the error that the same cause promises where it does not vary] The same. Why: of six
planted ones, five promised 0.2 to 0.4, and one promised 0.7 and left only noise. Three pairs of other causes
promised 0.77 to 0.85, and no fit kept that."""
VARIED_EACH = 3
"""[hypotheses] At most this many of one cause are fitted. Why: assumed. A fit must come first to show what a
number varies with."""
LEFT_OF_FEW = 2.0
"""[times the error's white part] Late in a search, a number that varies by a step or a line may leave at most
this. Why: coloured noise is up to 1.4 times its white part, and a step is placed to a row."""
LEFT_OF_FEW_SHARE = 0.25
"""[share of the error without causes] The same. Why: assumed. Other causes imitate a half, hardly more."""


def vary(
    search: Search,
    path: list[Fit],
    terms: Sequence[Term],
    most: int,
    few: bool = False,
    fixed: Sequence[Fit] = (),
) -> None:
    """Lengthen `path` by the best hypothesis in which a number varies, where it pays.

    The chance is shared among all that numbers may vary with, and the gain must be large, since what varies
    soaks up much. Neither holds of what is seen in few stretches (`few`), of which more is asked elsewhere;
    `fixed` are fits of single causes that do not vary.
    """
    problem, best = search.problem, path[-1]
    if not few and noise_in_weights(problem, best) > VARIED_LEAVES * best.cross_validated_rms:
        return  # what left nothing but what is white would gain too little
    rows = telling(problem, courses(problem))
    share = PROMISED_ALONE if few else VARIED_WORTH
    worth = (share * best.cross_validated_rms) ** 2 * len(best.left_out)
    found: list[Fit] = []
    ranked: list[Promise] = []
    for start in path[:1] if leaves_only_noise(problem, best) else distinct([path[0], best]):
        if len(start.terms) > VARIED_BESIDE:
            continue
        asked = [*start.terms, *(term for term in terms if term not in start.terms)]
        ranked = _promised(search, start, asked, rows)
        allowed = [item for item in ranked if item.cost <= worth and len(item.terms) <= most]
        allowed = [item for item in allowed if not few or may_settle(problem, start, fixed, item)]
        first = {item.effect: item for item in reversed(allowed)}  # the best of each effect
        near = [item for item in first.values() if item.cost <= VARIED_NEAR**2 * allowed[0].cost]
        picked = allowed[:VARIED] + [item for item in near if item not in allowed[:VARIED]]
        found += search.fitted([(item.terms, item.known) for item in picked])
    for number, leading in enumerate(_leading(found)):
        found += _nearer(search, leading, rows, all_kinds=number == 0)
    if few and not (found and leaves_only_noise(problem, in_order(found)[0])):
        likely = list(dict.fromkeys(item.effect for item in ranked))[:VARIED_EACH]
        found += _with_two(search, path[0], [term for term in terms if term.effect in likely], rows, fixed)
    if found:
        front = simplest(in_order(found)[0], found)
        search.say(f"{'+'.join(front.causes)}, varying: {front.cross_validated_rms:.4g}")
        kinds = {(way.items[0].along, way.items[0].channel) for way in rows}
        shared = PAYS_CHANCE / (1 + len(kinds))  # one of many does well by chance
        gains = few or front.cross_validated_rms <= VARIED_LEAVES * best.cross_validated_rms
        if gains and pays(best, front, PAYS_CHANCE if few else shared):
            path.append(front)


def _with_two(
    search: Search,
    null: Fit,
    terms: Sequence[Term],
    rows: Sequence[VaryingCourse],
    fixed: Sequence[Fit],
) -> list[Fit]:
    """Return the best fits in which a number varies with two things at once: late, say, and far out."""
    worth = (PROMISED_ALONE * null.cross_validated_rms) ** 2 * len(null.left_out)
    likely = [item for item in _promised(search, null, terms, rows, two=True) if item.cost <= worth]
    likely = [item for item in likely if may_settle(search.problem, null, fixed, item)]
    found = search.fitted([(item.terms, item.known) for item in likely[:VARIED]])
    for leading in in_order(found)[:1]:
        found += _nearer(search, leading, [], all_kinds=False)
    return found


def may_settle(problem: Problem, null: Fit, fixed: Sequence[Fit], item: Promise) -> bool:
    """Return whether a single cause that varies may leave little more than noise.

    It promises much less than the same cause where that does not vary, or this leaves little already.
    """
    share = np.sqrt(item.cost / item.fixed)
    promised = np.sqrt(item.fixed / len(null.left_out)) / noise_in_weights(problem, null)
    mine = [
        one.cross_validated_rms / noise_in_weights(problem, one)
        for one in fixed
        if one.causes == (item.effect,)
    ]
    return bool(share <= VARIES_SHARE or share * min(mine, default=promised) <= LEFT_OF_FEW)


def _nearer(
    search: Search,
    leading: Fit,
    rows: Sequence[VaryingCourse],
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
    first = distinct(in_order(found))
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
    fixed = [item for item in search.fits.values() if len(item.terms) == 1]
    vary(other, path, terms, most=1, few=True, fixed=fixed)
    return VariedAlone(other, path)


def _promised(
    search: Search,
    start: Fit,
    asked: Sequence[Term],
    rows: Sequence[VaryingCourse],
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
        usable = [way for way in rows if way.items[0].along in along]
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
    terms += varying_terms(problem, candidates)
    forms = {term: EFFECTS[term.effect].form_of(problem.robot, term.free) for term in terms}
    vary(
        search, path, [term for term in terms if forms[term].stage is not Stage.OBSERVATION], most=1, few=True
    )
    return tuple(path[1:])


def varies(item: Fit) -> bool:
    return any(MARK in name for term in item.terms for name in term.free)


def _varies_by_row(term: Term) -> bool:
    return any(variation_of(name).along != "place" for name in term.free if MARK in name)


def varying_terms(problem: Problem, names: Sequence[str]) -> list[Term]:
    """Return terms of forms whose numbers do something of their own only where they vary."""
    return [
        Term(name, (item.name,))
        for name in names
        for form in EFFECTS[name].forms
        if form.only_varies
        for item in form.parameters(problem.robot)
    ]


def is_curve(term: Term) -> bool:
    hats = [name for name in term.free if MARK in name and variation_of(name).shape == "hat"]
    return len(hats) > 1


def _follows_curve(item: Fit) -> bool:
    """Return whether a number follows a curve, or two things at once."""
    varied = [variation_of(name) for term in item.terms for name in term.free if MARK in name]
    return any(is_curve(term) for term in item.terms) or any(way.times for way in varied)


def varied_first(
    search: Search, path: list[Fit], singles: list[Fit], numbers: Sequence[Term], listed: Sequence[Term]
) -> tuple[VariedAlone | None, list[Fit]]:
    """Return the best single cause of which a number varies, if asked, and the singles.

    `path` then leads to it where it leaves only noise, and no `listed` form of a cause does alone.
    """
    if len(path) > 1 or not may_vary(search, path) or settled(search.problem, singles):
        return None, singles
    varied = varied_alone(search, numbers)
    if varied.leaves(SETTLED_FACTOR):
        singles = once([*singles, *search.alone(path[0], listed)])
        if not settled(search.problem, singles) and varied.taken(search, path, SETTLED_FACTOR):
            singles = [search.fits[frozenset(item.terms)] for item in singles]
    return varied, singles


def varied_last(
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
    if not varies(path[-1]):  # nor is one to come in by another way
        search.fits = {key: item for key, item in search.fits.items() if not varies(item)}
    return [search.fits[frozenset(item.terms)] for item in singles]


def settled(problem: Problem, fits: Sequence[Fit]) -> bool:
    return any(leaves_only_noise(problem, item) for item in fits)


def may_vary(search: Search, path: Sequence[Fit]) -> bool:
    """Return whether it is asked whether a number varies: of held rows that no single cause settles."""
    problem, best = search.problem, path[-1]
    if problem.moving or problem.model_share or search.late or not isinstance(problem.twin, Prediction):
        return False
    return len(best.terms) > 1 or not leaves_only_noise(problem, best)
