"""Looks for numbers that vary, by derivatives alone: one solution of the robot tells of hundreds of courses.

A number's derivative, row by row, times a course is the derivative by how far the number varies so. Every
course of every number of every cause is ranked by the stretches left out; only the few best are fitted.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import input_channels
from catheter_sim.core.variation import MARK, OF_CHANNEL, OF_SIDES, SHAPES, Variation
from catheter_sim.diagnosis.fit import Fit, fold_of
from catheter_sim.diagnosis.problem import Problem, Term, prior_of
from catheter_sim.diagnosis.trials import measured_of
from catheter_sim.diagnosis.workers import Tangent, beside
from catheter_sim.effects.varying import argument

QUANTILES = tuple(share / 100.0 for share in range(6, 95, 4))
"""[shares of the rows, and of the largest value] A number may step at these places. Why: a step in time
should be known to a fifth of the record, and a derivative costs next to nothing."""
KNOTS = (0.2, 0.4, 0.6, 0.8)
"""[shares of the rows] Knots of a curve, besides zero and the largest value. Why: assumed. They are five
numbers, each of a fifth of the rows."""
PARTS = 8
"""[parts of the length] A number may differ between this many. Why: a place should be known to 15 % of the
length."""
RIDGE = 1e-6
"""[share of the diagonal] It keeps the matrix regular where two numbers do the same. Why: it is next to
none."""
MULTIPLIED = 8
"""[products] Of the products of two courses of a number, this many are tried, the best. Why: assumed. Each
begins at what one of the two says alone."""
BESIDE_EACH = 3
"""[courses] This many of different kinds are multiplied with each of these, which is then placed again. Why:
for a softening late and far out (`tests/diagnosis/test_varying_planted.py`), the best alone was the wrong
one."""
MULTIPLIED_BY = 1500
"""[values] The products are chosen by about this many. Why: assumed. All values then judge what was
chosen."""
RANKED_BY = 500
"""[values] Ways to vary are ranked by about this many. Why: assumed. All values then judge the best of
them."""
MOST_WEIGHED = 24
"""[ways] For each term, this many are judged on stretches left out, the best by what they were fitted to.
Why: a step has as many places, and the best of all kinds come first."""
NOTHING_NEW = 1e-2
"""[share of a derivative] If less of it lies beyond the numbers that are fitted, varying does nothing new.
Why: a hundredth of it is noise."""
FEWEST_ROWS = 8
"""[rows] A course must be above zero in this many, and not above zero in as many. Why: assumed. Fewer are a
few wild rows."""
FINER_SHARE = 0.05
"""[share of the rows] A step that was found is looked for again this far on either side. Why: it is a little
more than from one place of `QUANTILES` to the next."""
FINER_PLACES = 60
"""[places] Around that step, this many are tried. Why: of some 600 compared rows, each row there has its
place."""


@dataclass(frozen=True)
class Promise:
    """A hypothesis in which a number varies, and what its derivative promises.

    Attributes:
        terms: the hypothesis.
        known: where to start, by effect and parameter.
        cost: sum of squares on stretches left out, to first order.
        fixed: the same where the number does not vary.
        effect: of which a number varies.
        kind: number, what it varies with, channel and shape.
    """

    terms: tuple[Term, ...]
    known: Mapping[tuple[str, str], float]
    cost: float
    fixed: float
    effect: str
    kind: tuple[str, ...]


def courses(problem: Problem) -> Iterator[tuple[Variation, ...]]:
    """Yield how a number may vary along `problem`'s trials, but for the number: each with `number` empty.

    Several together are a curve: a hat at each of its knots but the first.
    """
    for along, channel in arguments_of(problem):
        levels = _levels(problem, along, channel)
        if along in OF_SIDES:
            if (levels > 0.0).any() and (levels < 0.0).any():
                yield (Variation("", along, "step", channel, (0.0,)),)
            continue
        most = _rounded(float(levels.max()))
        if most <= 0.0:
            continue
        ways: list[tuple[str, tuple[float, ...]]] = []
        if along != "largest":
            ways.append(("linear", (most,)))
        if along in ("time", "path", "turns"):
            ways += [("saturating", (_rounded(share * most),)) for share in (0.05, 0.3)]
        if along in ("time", "path"):
            ways.append(("logarithmic", (_rounded(0.01 * most),)))
        for place in _places(levels, most):
            ways.append(("step", (place,)))
            if along in ("time", "level"):
                ways.append(("ramp", (place, most)))
        for shape, at in ways:
            yield (Variation("", along, shape, channel, at),)
        knots = sorted(
            {0.0, most, *(_rounded(float(value)) for value in np.quantile(levels[levels > 0.0], KNOTS))}
        )
        if along in ("time", "level", "path") and len(knots) > 3:
            ends = zip(knots, knots[1:], [*knots[2:], knots[-1]], strict=False)
            yield tuple(Variation("", along, "hat", channel, at) for at in ends)


def _places(levels: Array, most: float) -> list[float]:
    """Return where a number may step: after shares of the rows, and of the way to the most.

    The longest of several trials may have few rows, whose times no share of all rows lies among.
    """
    found = [*np.quantile(levels[levels > 0.0], QUANTILES), *(share * most for share in QUANTILES)]
    return sorted({_rounded(float(value)) for value in found if value < most})


def courses_near(problem: Problem, item: Variation) -> Iterator[tuple[Variation, ...]]:
    """Yield courses like `item` that step, or kink, a little earlier or later; none of other shapes.

    Of two that are multiplied one is moved at a time.
    """
    if item.times is not None:
        for (first,) in courses_near(problem, replace(item, times=None)):
            yield (replace(first, times=item.times),)
        for (second,) in courses_near(problem, item.times):
            yield (replace(item, number="", times=second),)
        return
    if item.along in ("place", *OF_SIDES) or item.shape not in ("step", "ramp"):
        return
    levels = _levels(problem, item.along, item.channel)
    values, counts = np.unique(levels, return_counts=True)
    between = 0.5 * (values[:-1] + values[1:])
    share = np.cumsum(counts)[:-1] / len(levels)
    near = np.flatnonzero(np.abs(share - np.mean(levels <= item.at[0])) <= FINER_SHARE)
    picked = np.unique(np.linspace(0, max(len(near) - 1, 0), FINER_PLACES).round().astype(int))
    for place in between[near[picked[: len(near)]]].tolist():
        if place > 0.0:
            yield (replace(item, number="", at=(place, *item.at[1:])),)


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")


def arguments_of(problem: Problem) -> Iterator[tuple[str, str]]:
    """Yield what numbers may vary with from row to row, each with its channel."""
    yield "time", ""
    for channel in input_channels(problem.robot, problem.trials[0].inputs.actuation):
        for along in OF_CHANNEL:
            yield along, channel


def _levels(problem: Problem, along: str, channel: str) -> Array:
    """Return what numbers vary with at the rows compared, shape (r,), trial by trial."""
    every = problem.every
    return np.concatenate(
        [argument(problem.robot, trial.inputs, along, channel)[::every] for trial in problem.trials]
    )


def _row_of_residual(problem: Problem) -> np.ndarray:
    """Return the row of each residual, shape (n,), counted through all trials."""
    finite = [np.isfinite(measured_of(trial, problem.columns)[:: problem.every]) for trial in problem.trials]
    return np.nonzero(np.concatenate(finite))[0]


def places() -> Iterator[Variation]:
    """Yield the parts of a robot whose numbers may differ: up to half of it, by `PARTS`."""
    for width in range(1, PARTS // 2 + 1):
        for first in range(PARTS - width + 1):
            ends = first / PARTS, (first + width) / PARTS
            yield Variation("", "place", "between", "", (round(ends[0], 4), round(ends[1], 4)))


# ----------------------------------------------------------------------------------------------------
# What a course promises beside a fit: least squares with the derivatives, stretches left out.


@dataclass(frozen=True)
class Beside:
    """A term beside a fit, to first order.

    Attributes:
        effect: of the term whose numbers may vary.
        terms: the fit's hypothesis with it.
        error: the residual with its numbers where they start, shape (n,).
        columns: the derivative by every number that is fitted, by effect and parameter, shape (n,) each.
        own: the derivative by each number of the fit and the term, varying ones too, by parameter, (n,) each.
    """

    effect: str
    terms: tuple[Term, ...]
    error: Array
    columns: Mapping[tuple[str, str], Array]
    own: Mapping[str, Array]


def beside_fit(current: Fit, term: Term, change: Tangent | None, only: bool = False) -> Beside:
    """Return what a term is beside a fit.

    Args:
        current: the fit.
        term: whose numbers may vary; how they vary in the fit already is taken out, to first order.
        change: its tangent there; None: the fit has the term.
        only: its numbers are not fitted themselves, only by how much they vary.
    """
    columns = {item.key: column for item, column in zip(current.numbers, current.jacobian.T, strict=True)}
    terms, error = current.terms, current.residual
    if change is not None:
        terms, error = beside(current.terms, term), current.residual if only else change.error
        columns |= dict(zip(change.keys, change.columns.T, strict=True))
    for item, value in zip(current.numbers, current.x, strict=True) if change is None else ():
        if item.effect == term.effect and MARK in item.parameter.name:
            error = error - float(value) * columns[item.key]
    numbers = tuple(name for name in term.free if MARK not in name)
    own = {name: column for (effect, name), column in columns.items() if effect == term.effect}
    kept = () if only else numbers
    columns = {key: column for key, column in columns.items() if key[0] != term.effect or key[1] in kept}
    terms = tuple(replace(item, free=kept) if item.effect == term.effect else item for item in terms)
    return Beside(term.effect, terms, error, columns, own)


@dataclass(frozen=True)
class VaryingCourse:
    """How a number may vary, but for the number.

    Attributes:
        items: each with `number` empty; several together are a curve.
        values: how far each has come at each residual, shape (n, k).
        some: the same at those that stand for all (`RANKED_BY`), shape (r, k).
    """

    items: tuple[Variation, ...]
    values: Array
    some: Array


def _course(items: tuple[Variation, ...], values: Array) -> VaryingCourse:
    return VaryingCourse(items, values, values[_some(len(values), RANKED_BY)])


@dataclass(frozen=True)
class VaryingWay:
    """A number that varies by a course: `own` is the derivative by the number, shape (n,)."""

    number: str
    course: VaryingCourse
    own: Array

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(item.name_of(self.number) for item in self.course.items)

    @property
    def kind(self) -> tuple[str, ...]:
        """The number, and of each thing it varies with: what, its channel, the shape."""
        courses = self.course.items[0].courses
        return self.number, *(part for one in courses for part in (one.along, one.channel, one.shape))


@cache
def _some(count: int, most: int) -> np.ndarray:
    """Return which of so many values stand for all, at most so many: by chance, as neighbours are columns."""
    return np.sort(np.random.default_rng(0).permutation(count)[:most])


def multiplied(
    at: Beside, own: Array, found: Sequence[VaryingCourse], along: Sequence[str]
) -> list[VaryingCourse]:
    """Return products of two courses with different things, each the best beside the other.

    `own` is the derivative by the number, shape (n,), `along` what it may vary with alone: one of the two at
    least.
    """
    single = [(way.items[0], way.values[:, 0]) for way in found if len(way.items) == 1]
    if not single or not own.any():
        return []
    thin = _some(len(own), MULTIPLIED_BY)
    values = np.stack([values[thin] for _, values in single])
    kinds = [(item.along, item.channel) for item, _ in single]
    base = np.stack([*at.columns.values(), own], axis=1)[thin]
    within, _ = np.linalg.qr(base)
    left = at.error[thin] - within @ (within.T @ at.error[thin])

    squares, known = values**2, np.column_stack([within, left])

    def gains(course: Array) -> Array:
        mine = own[thin] * course  # times `values`: the derivative along each product
        whole = squares @ mine**2
        shares = values @ (mine[:, np.newaxis] * known)
        size = whole - (shares[:, :-1] ** 2).sum(axis=1)
        return np.asarray(shares[:, -1] ** 2 / np.maximum(size, 1e-3 * whole + 1e-12))

    def best_of_kinds(gain: Array, count: int) -> list[int]:
        first = {kinds[index]: int(index) for index in np.argsort(gain)}
        return sorted(first.values(), key=lambda index: -gain[index])[:count]

    pairs: dict[tuple[int, int], float] = {}
    for begun in best_of_kinds(gains(np.ones(values.shape[1])), MULTIPLIED):
        mine = np.array([kind == kinds[begun] for kind in kinds])
        for other in best_of_kinds(np.where(mine, -1.0, gains(values[begun])), BESIDE_EACH):
            gain = gains(values[other])
            one = int(np.argmax(np.where(mine, gain, -1.0)))
            if {kinds[one][0], kinds[other][0]} & set(along):
                pairs[min(one, other), max(one, other)] = float(gain[one])
    best = sorted(pairs, key=lambda pair: -pairs[pair])[:MULTIPLIED]
    ways: list[VaryingCourse] = []
    for one, other in best:
        (first, course), (second, further) = single[one], single[other]
        both = replace(first, times=second)
        ways.append(_course((both,), (course * further)[:, np.newaxis]))
        if second.along in OF_SIDES and first.along in along:  # on either side its own
            ways.append(_course((first, both), np.stack([course, course * further], axis=1)))
    return [way for way in ways if _tells(way.values[:, -1])]


def along_rows(number: str, own: Array, found: Sequence[VaryingCourse]) -> list[VaryingWay]:
    """Return how a number may vary from row to row; `own` is the derivative by it, shape (n,)."""
    return [VaryingWay(number, course, own) for course in found]


def along_robot(number: str, parts: Array) -> list[VaryingWay]:
    """Return how a number may vary along the robot, by its derivative in each part, (n, `PARTS`)."""
    middles, own = (np.arange(PARTS) + 0.5) / PARTS, np.ones(len(parts))
    shares = ((item, SHAPES[item.shape].of(middles, item.at)) for item in places())
    return [
        VaryingWay(number, _course((item,), (parts @ share)[:, np.newaxis]), own) for item, share in shares
    ]


def part_names(number: str) -> tuple[str, ...]:
    """Return the names by which a number varies in each part of the robot alone."""
    return tuple(item.name_of(number) for item in places() if round(PARTS * (item.at[1] - item.at[0])) == 1)


def telling(problem: Problem, asked: Iterable[tuple[Variation, ...]]) -> list[VaryingCourse]:
    """Return the courses that are more and less than a quarter of their most at enough rows."""
    row, levels = _row_of_residual(problem), cache(partial(_levels, problem))

    def course_of(item: Variation) -> Array:
        found: Array = np.ones(1)
        for each in item.courses:
            found = found * SHAPES[each.shape].of(levels(each.along, each.channel), each.at)
        return found[row]

    found = []
    for items in asked:
        values = np.stack([course_of(item) for item in items], axis=1)
        if all(_tells(column) for column in values.T):
            found.append(_course(items, values))
    return found


def _tells(values: Array) -> bool:
    more = values > 0.25 * values.max()
    return min(int(more.sum()), int((~more).sum())) >= FEWEST_ROWS


def promises(current: Fit, at: Beside, ways: Sequence[VaryingWay], each: int) -> list[Promise]:
    """Return what varying numbers of a term promise beside a fit, the `each` best of them, best first.

    What is known of calibrated numbers beforehand counts as further residuals, which are never left out.
    """
    base = np.stack(list(at.columns.values()), axis=1) if at.columns else np.zeros((len(at.error), 0))
    known = _known(current, at)
    base = np.concatenate([base, np.diag(known[0])])
    error = np.concatenate([at.error, known[1]])
    kept = np.concatenate([_some(len(at.error), RANKED_BY), np.arange(len(at.error), len(error))])
    within, _ = np.linalg.qr(base[kept])
    left = error[kept] - within @ (within.T @ error[kept])
    best = np.argsort(-_gains(ways, within, left))[:MOST_WEIGHED]
    fold = np.concatenate([fold_of(current.block), np.full(len(known[0]), -1)])
    picked = [ways[index] for index in best]
    costs = np.zeros(len(picked))
    fixed = _costs(error, base, fold, np.zeros((1, len(at.error), 0)))[0]
    for several in {len(way.course.items) for way in picked}:
        mine = [index for index, way in enumerate(picked) if len(way.course.items) == several]
        columns = [picked[index].course.values * picked[index].own[:, np.newaxis] for index in mine]
        costs[mine] = _costs(error, base, fold, np.stack(columns))
    found = [
        Promise(
            tuple(
                Term(one.effect, (*one.free, *way.names)) if one.effect == at.effect else one
                for one in at.terms
            ),
            current.values,
            float(cost),
            float(fixed),
            at.effect,
            way.kind,
        )
        for way, cost in zip(picked, costs, strict=True)
    ]
    return unlike(found, each)


def _gains(ways: Sequence[VaryingWay], within: Array, left: Array) -> Array:
    """Return by how much each way lowers the sum of squares, beside numbers that are fitted.

    `within` spans their derivatives by orthonormal columns, shape (n, p), and `left` (n,) is the residual
    beyond them, at the r residuals that stand for all; what is known beforehand stands in the last n - r
    rows, of which a way has none.
    """
    gains = np.zeros(len(ways))
    rows = len(ways[0].course.some)
    groups: dict[int, list[int]] = {}
    for index, way in enumerate(ways):
        if len(way.course.items) == 1:
            groups.setdefault(id(way.own), []).append(index)
    for some in groups.values():
        own = ways[some[0]].own
        thin = own[_some(len(own), RANKED_BY)]
        columns = np.concatenate([ways[index].course.some for index in some], axis=1) * thin[:, np.newaxis]
        whole = (columns**2).sum(axis=0)
        beyond = whole - ((within[:rows].T @ columns) ** 2).sum(axis=0)
        use = beyond > NOTHING_NEW**2 * whole
        gains[some] = np.where(use, (left[:rows] @ columns) ** 2 / np.where(use, beyond, 1.0), 0.0)
    for index, way in enumerate(ways):
        if len(way.course.items) > 1:
            padded = np.zeros((len(left), len(way.course.items)))
            padded[:rows] = way.course.some * way.own[_some(len(way.own), RANKED_BY), np.newaxis]
            turned, size, _ = np.linalg.svd(padded - within @ (within.T @ padded), full_matrices=False)
            use = size > NOTHING_NEW * np.linalg.norm(padded)
            gains[index] = float(((turned[:, use].T @ left) ** 2).sum())
    return gains


def _known(current: Fit, at: Beside) -> tuple[Array, Array]:
    """Return roots of the prior's precisions of the fitted numbers, and how far each is from its middle."""
    prior = prior_of(current.numbers)
    root = np.sqrt(prior.precision)
    away = root * (current.x - prior.middle)
    rows = {item.key: pair for item, *pair in zip(current.numbers, root, away, strict=True)}
    found = np.array([rows.get(key, (0.0, 0.0)) for key in at.columns]).reshape(-1, 2)
    return found[:, 0], found[:, 1]


def _costs(error: Array, base: Array, fold: np.ndarray, ways: Array) -> Array:
    """Return the sum of squares on stretches left out of several ways, shape (m,).

    Args:
        error: shape (n,); what is known beforehand stands last.
        base: the derivatives by the numbers that are fitted, shape (n, p).
        fold: of each residual, shape (n,); -1: never left out.
        ways: the derivatives by how far a number varies, shape (m, r, k), of the first r residuals.
    """
    columns = np.zeros((len(ways), len(error), base.shape[1] + ways.shape[2]))
    columns[:, :, : base.shape[1]] = base
    columns[:, : ways.shape[1], base.shape[1] :] = ways
    turned = columns.transpose(0, 2, 1)
    square, slope = turned @ columns, turned @ error
    each = np.arange(square.shape[1])
    damped = square.copy()
    damped[:, each, each] += RIDGE * square[:, each, each] + 1e-12
    cost = np.zeros(len(ways))
    for index in np.unique(fold[fold >= 0]):
        out = fold == index
        part, rest = columns[:, out], error[out]
        turned = part.transpose(0, 2, 1)
        step = np.linalg.solve(damped - turned @ part, (slope - turned @ rest)[:, :, np.newaxis])
        cost += ((rest - (part @ step)[:, :, 0]) ** 2).sum(axis=1)
    return cost


def unlike(found: Sequence[Promise], each: int) -> list[Promise]:
    """Return the most promising hypotheses, of each effect `each`, and of each kind one."""
    kept: list[Promise] = []
    for promise in sorted(found, key=lambda item: item.cost):
        own = [item for item in kept if item.effect == promise.effect]
        if len(own) < each and all(item.kind != promise.kind for item in own):
            kept.append(promise)
    return kept
