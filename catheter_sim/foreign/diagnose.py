"""What is wrong with somebody's MJCF: which generic cause, how probable, the extended model, the report."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.document import cause_entries, with_undefined
from catheter_sim.diagnosis.noise import gain_percent, times_noise
from catheter_sim.diagnosis.notes import Attempts, Note
from catheter_sim.diagnosis.probabilities import probability_of
from catheter_sim.diagnosis.report import written
from catheter_sim.diagnosis.result import (
    CAUSE_FOUND,
    IMPROVED,
    NO_DISCREPANCY,
    NONE,
    OUTSIDE,
    UNEXPLAINED,
    Cause,
    FittedParameter,
    UnitResult,
)
from catheter_sim.diagnosis.thresholds import ESTABLISHED, LARGEST_GROUP, LEAST_MEMBER_SHARE, MOST_SURE
from catheter_sim.diagnosis.words import cause_rows, listed, spoken, words
from catheter_sim.files import check_output_folder
from catheter_sim.foreign.extended import extended_text
from catheter_sim.foreign.fit import BLOCK_S, Fitter, ForeignFit
from catheter_sim.foreign.model import (
    SUMMARIES,
    ForeignData,
    Number,
    Runner,
    Variant,
    noise_of,
    read_foreign,
    variants_of,
)
from catheter_sim.page.render import png_source, rendered
from catheter_sim.progress import Stages
from catheter_sim.tables import Table

# ----------------------------------------------------------------------------------------------------
# Constants of the search for causes, each with its reason.

NOISE_SHARE = 2e-4  # of a column's range: the least noise that is believed, where data are smoother than that
FAR_LESS_NOISE = 0.5  # of the noise that outputs show, below which that of the model's errors is taken
DRY = 1.25  # times the noise: a model that errs by no more is not contradicted
EXPLAINED_NOISE = 2.0  # times the noise: a model that errs by no more explains the data
EXPLAINED_SHARE = 0.25  # of the error before: neither does one that leaves more than that: real play rattles
LEAST_GAIN = 0.3  # of the error before that a cause must take away from held-out data
STEP_NOISE = 0.5  # times the noise: a step is halved until what is simulated changes by less
OWN_STEP_SHARE = 0.7  # of what a finer step leaves, at most, where the file's own step is taken instead
HALVINGS = 4  # of a step, at most
SECOND_GAIN = 0.15  # of the error after the first cause that a second one must take away,
SECOND_SHARE = 0.03  # and of the error before: small differences of any model are taken up by some cause
NATS = 5.0  # by which evidence must grow for a second cause; two causes within it are alike
FITTED = 2  # variants of a cause that are fitted, best first by what a straight line promises
FAR_WORSE = 4.0  # times the error that the best variant promises: what promises more is not fitted, but of
LEAST_CAUSES = 3  # so many causes
START_SIZES = (0.3, 1.0, 3.0)  # of what a straight line promises, at which a fit may start
START_FAR = 3.0  # times a number's start, for numbers that do nothing alone
LAST_STEPS = 20  # of the fit that is chosen
SHOWN = 12  # sets of causes in a report's ranking
EQUAL_ERROR = 1.1  # of the held-out errors of two causes that are told apart by neither
HARM_SHARE = 0.05  # by which an output's held-out error must rise to be worse,
HARM_NOISE = 1.3  # and above which [times the noise]

# ----------------------------------------------------------------------------------------------------
# How probable it is that a generic cause is at work in somebody's MJCF.
#
# The evidence of a cause is that of the chosen fit over the best one without it. Nats of one data set
# promise too much, since models are wrong in more ways than were tried: they are divided by `NATS`. And
# what is left on held-out data, beside what a right model leaves, speaks for something that was not tried:
# with the error at which a model no longer explains the data, a cause is as probable as not at best. The
# scales are assumed; docs/truth/foreign_models.md says how often names were right.


@dataclass(frozen=True)
class Tried:
    """A set of causes that was fitted: names, evidence [nat], and held-out error over the noise."""

    causes: tuple[str, ...]
    evidence: float
    times_noise: float


def likely(chosen: Tried, before: Tried, tried: Sequence[Tried]) -> tuple[Cause, ...]:
    """Return the causes of the chosen fit with their probabilities, likeliest first; no numbers yet."""
    share = 1.0 - outside(chosen, before)
    found = []
    for name in chosen.causes:
        weights = _group(name, chosen, tried)
        others = [item.evidence for item in tried if not set(weights) & set(item.causes)]
        whole = share * probability_of((chosen.evidence - max(others)) / NATS)
        total = sum(weights.values())
        members = {other: whole * weight / total for other, weight in weights.items()}
        ordered = dict(sorted(members.items(), key=lambda pair: -pair[1]))
        group = ordered if len(ordered) > 1 else {}
        found.append(Cause(name, {}, math.nan, probability=whole, members=group))
    return tuple(sorted(found, key=lambda item: -item.probability))


def outside(chosen: Tried, before: Tried) -> float:
    """Return the probability that something is at work that was not tried."""
    explained = max(EXPLAINED_NOISE, EXPLAINED_SHARE * before.times_noise)
    return min(max(1.0 - 1.0 / (1.0 + (chosen.times_noise / explained) ** 4), 1.0 - MOST_SURE), MOST_SURE)


def probabilities(found: Sequence[Cause], chosen: Tried, before: Tried) -> dict[str, float]:
    """Return the probability of each cause of the fit, of its groups, of none and of something else."""
    each = {
        name: value
        for item in found
        for name, value in (item.members or {item.name: item.probability}).items()
    }
    none = 1.0 - probability_of((chosen.evidence - before.evidence) / NATS)
    return {**each, NONE: MOST_SURE if not found else none, OUTSIDE: outside(chosen, before)}


def _group(name: str, chosen: Tried, tried: Sequence[Tried]) -> dict[str, float]:
    """Return a cause with those that the data cannot tell from it, by their weights; of single causes alone.

    A member has evidence within `NATS` of the cause's, and leaves as little on the held-out data.
    """
    weights = {name: 1.0}
    if len(chosen.causes) > 1:
        return weights
    near = [
        item
        for item in sorted(tried, key=lambda item: -item.evidence)
        if len(item.causes) == 1
        and item.causes[0] != name
        and chosen.evidence - item.evidence < NATS
        and item.times_noise <= EQUAL_ERROR * chosen.times_noise
    ]
    for item in near:
        weight = math.exp((item.evidence - chosen.evidence) / NATS)
        if len(weights) < LARGEST_GROUP and weight >= LEAST_MEMBER_SHARE * (sum(weights.values()) + weight):
            weights.setdefault(item.causes[0], weight)
    return weights


# ----------------------------------------------------------------------------------------------------
# What is wrong with somebody's MJCF, by measured data: which generic cause, how large, and what is gained.
#
# Every cause alone is tried in its variants, those first that a straight line promises most of; then a
# second one beside the best. Evidence of the training trials chooses (`fit`), trials that were held out say
# what was gained. A cause is named only where it is more probable than not (`likely`), which it is where
# little is left.

_SEED = 7
_BOOTSTRAPS = 400
_SIDES = 1.96


@dataclass(frozen=True)
class Judged:
    """A fit with what it leaves on trials that were held out.

    `outputs` are along each held-out trial, shape (r, o) each; `times_noise` is the root mean square of its
    errors there, in units of the noise.
    """

    fit: ForeignFit
    outputs: tuple[Array, ...]
    times_noise: float


@dataclass(frozen=True)
class ForeignDiagnosis:
    """What a diagnosis found.

    Attributes:
        data: the recordings.
        noise: of each output, shape (o,), in the columns' units.
        verdict: one of `diagnosis.result.VERDICTS`.
        before: the model as it is.
        best: the fit that was chosen; `before`, where none is better.
        ranking: the model as it is, each cause alone and the pairs that were tried, most evidence first.
        weights: share of the evidence of each single cause and of "none"; they add up to one.
        likely: the causes of the chosen fit with their probabilities, the most probable first.
        probabilities: of these and their groups, of "none", and of something that was not tried ("outside").
        notes: on parts that failed.
    """

    data: ForeignData
    noise: Array
    verdict: str
    before: Judged
    best: Judged
    ranking: tuple[Judged, ...]
    weights: Mapping[str, float]
    likely: tuple[Cause, ...]
    probabilities: Mapping[str, float]
    notes: tuple[Note, ...] = ()

    @property
    def named(self) -> tuple[Cause, ...]:
        """The established causes, the most probable first: none unless the verdict is `CAUSE_FOUND`."""
        chosen = self.likely if self.verdict == CAUSE_FOUND else ()
        return tuple(item for item in chosen if item.probability >= ESTABLISHED)

    @property
    def corrections(self) -> tuple[Cause, ...]:
        """What corrects the model beside them and is not established; none unless something does."""
        chosen = self.likely if self.verdict in (CAUSE_FOUND, IMPROVED) else ()
        return tuple(item for item in chosen if item not in self.named)

    @property
    def corrected(self) -> Mapping[Number, float]:
        """The numbers of the corrected model: none where nothing is established nor corrects it."""
        return self.best.fit.values if self.verdict in (CAUSE_FOUND, IMPROVED) else {}

    @property
    def causes(self) -> tuple[str, ...]:
        """Names of the established causes."""
        return tuple(item.name for item in self.named)

    @property
    def indistinguishable(self) -> tuple[tuple[str, ...], ...]:
        """Groups of causes and corrections that the data cannot tell apart."""
        return tuple(tuple(item.members) for item in (*self.named, *self.corrections) if item.members)

    @property
    def by_unit(self) -> dict[str, UnitResult]:
        """Held-out figures of each unit; the interval of a gain is worked out over all of them alone."""
        columns = self.data.model.columns
        found = {}
        for unit in dict.fromkeys(column.unit for column in columns):
            own = [column.unit == unit for column in columns]
            floor = float(np.sqrt(np.mean(self.noise[own] ** 2)))
            before, after = (self._rms(item, own) for item in (self.before, self.best))
            gain = gain_percent(before, after)
            found[unit] = UnitResult(unit, floor, before, after, gain, (math.nan, math.nan))
        return found

    def _rms(self, judged: Judged, columns: list[bool]) -> float:
        errors = np.concatenate(_heldout_errors(self.data, judged.outputs))[:, columns]
        return math.sqrt(float(np.mean(errors[np.isfinite(errors)] ** 2)))

    def gain_percent(self) -> tuple[float, float, float]:
        """Return by how much the held-out error fell, in units of the noise, and its 95 % interval [%].

        Stretches of `BLOCK_S` are drawn with replacement.
        """
        before, after = (self._block_squares(item) for item in (self.before, self.best))
        generator = np.random.default_rng(_SEED)
        drawn = generator.integers(len(before), size=(_BOOTSTRAPS, len(before)))
        with np.errstate(invalid="ignore", divide="ignore"):
            gains = 100.0 * (1.0 - np.sqrt(after[drawn].sum(axis=1) / before[drawn].sum(axis=1)))
        gain = 100.0 * (1.0 - math.sqrt(float(after.sum()) / max(float(before.sum()), 1e-30)))
        low, high = np.nanpercentile(gains, (2.5, 97.5))
        return gain, float(low), float(high)

    def gain_shares(self) -> dict[str, float]:
        """Return what each cause of the best fit has of the gain [%]; together they have all of it.

        Of two causes each counts by what the other one, best fitted alone, leaves more than both.
        """
        names, gain = self.best.fit.causes, self.gain_percent()[0]
        alone = {item.fit.causes: item.times_noise for item in self.ranking}
        lost = {
            name: max(alone.get(tuple(n for n in names if n != name), 0.0) - self.best.times_noise, 0.0)
            for name in names
        }
        total = sum(lost.values())
        return {name: gain * (own / total if total else 1.0 / len(names)) for name, own in lost.items()}

    def _block_squares(self, judged: Judged) -> Array:
        found = []
        errors = _heldout_errors(self.data, judged.outputs)
        for trial, own in zip(self.data.of("heldout"), errors, strict=True):
            squares = np.nan_to_num((own / self.noise) ** 2).sum(axis=1)
            found.append(np.bincount(np.floor(trial.time_s / BLOCK_S).astype(int), weights=squares))
        return np.concatenate(found)


def _heldout_errors(data: ForeignData, outputs: Sequence[Array]) -> list[Array]:
    """Return simulated less measured along each held-out trial, shape (r, o) each, in the columns' units."""
    return [own - trial.outputs for own, trial in zip(outputs, data.of("heldout"), strict=True)]


def diagnose_foreign(
    folder: str | os.PathLike[str], jobs: int = 1, progress: bool = False
) -> ForeignDiagnosis:
    """Return what is wrong with the MJCF of a data set.

    Raises:
        InputError: the folder, the model or a recording cannot be used.
    """
    return diagnosed(read_foreign(folder), jobs, progress)


def diagnosed(data: ForeignData, jobs: int = 1, progress: bool = False) -> ForeignDiagnosis:
    """Return what is wrong with the MJCF of recordings that were read.

    The model runs with a step that is fine enough (`_stepped`). Where that is not the file's own and what is
    found does not explain the data to their noise, the file's own step is tried, too: they may come from it.
    """
    with Stages("diagnose", progress) as stages:
        noise = _noise(data, jobs)
        stages.say("the time step")
        fine = _stepped(data, noise, jobs)
        found = _searched(fine, noise, jobs, stages)
        if fine is data or found.best.times_noise <= DRY:
            return found
        stages.say("again with the file's own time step")
        own = _searched(data, noise, jobs, stages)
        return own if own.best.times_noise < OWN_STEP_SHARE * found.best.times_noise else found


def _noise(data: ForeignData, jobs: int) -> Array:
    """Return the noise of each output: from the outputs, or from the model's errors where that is far less.

    Outputs that jump from row to row look noisy; what the model errs by jumps less.
    """
    played = Runner(data.model, data.settle_s, jobs).outputs([{}], data.trials)[0]
    errors = [replace(t, outputs=t.outputs - own) for t, own in zip(data.trials, played, strict=True)]
    plain, beside = noise_of(data.trials, NOISE_SHARE), noise_of(errors, NOISE_SHARE)
    return np.where(beside < FAR_LESS_NOISE * plain, beside, plain)


def _searched(data: ForeignData, noise: Array, jobs: int, stages: Stages) -> ForeignDiagnosis:
    """Return what is wrong with a model that runs with one step."""
    runner = Runner(data.model, data.settle_s, jobs)
    fitter = Fitter(runner, data.of("train"), noise)
    stages.say("the model as it is")
    judge = partial(_judged, data, runner, noise)
    before = judge(fitter.nothing())
    if max(before.times_noise, math.sqrt(before.fit.mean_square)) <= DRY:
        sure = probabilities((), _tried(before), _tried(before))
        return ForeignDiagnosis(
            data, noise, NO_DISCREPANCY, before, before, (before,), {"none": 1.0}, (), sure
        )
    stages.say("each cause alone")
    singles = [judge(fit) for fit in _singles(fitter, before.fit, variants_of(data.model))]
    best = max(singles, key=lambda item: item.fit.evidence)
    attempt, first = Attempts(), best
    best = attempt(
        "The last steps of the fit",
        lambda: judge(fitter.fit(first.fit.variants, first.fit.values, LAST_STEPS)),
        lambda: first,
    )
    singles[singles.index(first)] = best
    stages.say("a second cause")
    pairs: list[Judged] = attempt(
        "The search for a second cause",
        lambda: [judge(fit) for fit in _pairs(fitter, best.fit, variants_of(data.model))],
        list,
    )
    stages.say("the verdict")
    chosen = _chosen(before, best, pairs)
    ranking = sorted((before, *singles, *pairs), key=lambda item: -item.fit.evidence)
    shown = chosen if chosen.fit.evidence > before.fit.evidence else before
    held = [_tried(item) for item in ranking]
    found = likely(_tried(shown), _tried(before), held)
    named = any(item.probability >= ESTABLISHED for item in found)
    diagnosis = ForeignDiagnosis(
        data,
        noise,
        _verdict(before, shown, named, _harmful(data, noise, before, shown)),
        before,
        shown,
        tuple(ranking),
        _weights(before, singles),
        found,
        probabilities(found, _tried(shown), _tried(before)),
        tuple(attempt.notes),
    )
    shares = diagnosis.gain_shares()
    return replace(diagnosis, likely=tuple(_fitted(item, shown.fit, shares[item.name]) for item in found))


def _fitted(cause: Cause, fit: ForeignFit, gain_percent: float) -> Cause:
    """Return a cause of a fit with its numbers, their intervals, and its share of the gain."""
    variant = next(item for item in fit.variants if item.cause == cause.name)
    parameters = {}
    for number in variant.numbers:
        value, half = fit.values[number], _SIDES * fit.spread[number]
        parameters[number.name] = FittedParameter(value, (value - half, value + half), number.null)
    return replace(cause, parameters=parameters, gain_percent=gain_percent, form=variant.form)


def _tried(judged: Judged) -> Tried:
    return Tried(judged.fit.causes, judged.fit.evidence, judged.times_noise)


def _harmful(data: ForeignData, noise: Array, before: Judged, after: Judged) -> bool:
    """Return whether a fit makes an output worse on the held-out trials, by more than its noise."""
    rms = []
    for judged in (before, after):
        errors = np.concatenate(_heldout_errors(data, judged.outputs)) / noise
        rms.append(np.sqrt(np.nanmean(errors**2, axis=0)))
    return bool((rms[1] > np.maximum((1.0 + HARM_SHARE) * rms[0], HARM_NOISE)).any())


def _stepped(data: ForeignData, noise: Array, jobs: int) -> ForeignData:
    """Return the recordings with a model whose step is small enough for the noise.

    The file's own step is halved until that changes what is simulated by no more than `STEP_NOISE`: what a
    step leaves is no cause.
    """
    trials = data.of("train")

    def outputs(own: ForeignData) -> Array:
        return np.concatenate(Runner(own.model, own.settle_s, jobs).outputs([{}], trials)[0]) / noise

    coarse = outputs(data)
    for _ in range(HALVINGS):
        step_s = 0.5 * float(data.model.simulated.opt.timestep)
        finer = replace(data, model=replace(data.model, timestep_s=step_s))
        fine = outputs(finer)
        if math.sqrt(float(np.mean((fine - coarse) ** 2))) <= STEP_NOISE:
            return data
        data, coarse = finer, fine
    return data


def _judged(data: ForeignData, runner: Runner, noise: Array, fit: ForeignFit) -> Judged:
    """Return a fit with what it leaves on the held-out trials."""
    outputs = runner.outputs([fit.values], data.of("heldout"))[0]
    errors = [own / noise for own in _heldout_errors(data, outputs)]
    every = np.concatenate([item[np.isfinite(item)] for item in errors])
    return Judged(fit, tuple(outputs), math.sqrt(float(np.mean(every**2))))


def _singles(fitter: Fitter, nothing: ForeignFit, variants: Sequence[Variant]) -> list[ForeignFit]:
    """Return the best fit of each cause alone."""
    found: dict[str, ForeignFit] = {}
    for fit in _fits(fitter, nothing, variants, FITTED):
        known = found.get(fit.causes[0])
        if known is None or fit.evidence > known.evidence:
            found[fit.causes[0]] = fit
    return list(found.values())


def _pairs(fitter: Fitter, first: ForeignFit, variants: Sequence[Variant]) -> list[ForeignFit]:
    """Return fits of the best cause with the best promised variant of each other one."""
    others = [item for item in variants if item.cause not in first.causes]
    return _fits(fitter, first, others, 1)


def _fits(fitter: Fitter, base: ForeignFit, variants: Sequence[Variant], most: int) -> list[ForeignFit]:
    """Return fits of variants beside a base: of each cause those that a straight line promises most of."""
    promised = fitter.promised(base, variants)
    order = sorted(range(len(variants)), key=lambda k: -promised[k][0])
    causes = list(dict.fromkeys(variants[k].cause for k in order))
    least = promised[order[0]][0] - fitter.blocks * math.log(FAR_WORSE) if order else 0.0
    found = []
    for place, cause in enumerate(causes):
        for k in [k for k in order if variants[k].cause == cause][:most]:
            if promised[k][0] < least and place >= LEAST_CAUSES:
                continue
            starts = [dict(base.values) | own for own in _starts(variants[k].numbers, promised[k][1])]
            found.append(fitter.fit((*base.variants, variants[k]), fitter.best_of(starts)))
    return found


def _starts(numbers: Sequence[Number], share: Array) -> list[dict[Number, float]]:
    """Return where a fit may start: along a straight line's way, and numbers of no use alone to either side.

    A number that does nothing while the others do nothing (a mass's place) has no straight line: it starts at
    nothing, or far out.
    """
    first = [n for n, own in zip(numbers, share, strict=True) if own != 0.0]
    ways = {n: float(own) for n, own in zip(numbers, share, strict=True)}
    found = []
    for size in START_SIZES:
        found.append({n: _within(n, n.null + size * ways[n] * (n.start - n.null)) for n in numbers})
    for number in numbers:
        if number in first:
            continue
        for far in (-START_FAR, START_FAR):
            moved = _within(number, number.null + far * (number.start - number.null))
            found += [dict(own) | {number: moved} for own in found[: len(START_SIZES)]]
    return found


def _within(number: Number, value: float) -> float:
    return min(max(value, number.lower), number.upper)


def _chosen(before: Judged, best: Judged, pairs: Sequence[Judged]) -> Judged:
    """Return the best pair where evidence and held-out data both ask for a second cause, else the single."""
    strongest = max(pairs, key=lambda item: item.fit.evidence, default=best)
    asked = strongest.fit.evidence > best.fit.evidence + NATS
    least = max(SECOND_GAIN * best.times_noise, SECOND_SHARE * before.times_noise)
    return strongest if asked and best.times_noise - strongest.times_noise > least else best


def _verdict(before: Judged, chosen: Judged, named: bool, harmful: bool) -> str:
    gained = chosen.times_noise < (1.0 - LEAST_GAIN) * before.times_noise
    evident = chosen.fit.evidence > before.fit.evidence + NATS
    if not (gained and evident) or harmful:
        return UNEXPLAINED
    return CAUSE_FOUND if named else IMPROVED


def _weights(before: Judged, singles: Sequence[Judged]) -> dict[str, float]:
    """Return the share of the evidence of single causes and of none."""
    logs = {"none": before.fit.evidence} | {item.fit.causes[0]: item.fit.evidence for item in singles}
    most = max(logs.values())
    raw = {name: math.exp(value - most) for name, value in logs.items()}
    return {name: value / sum(raw.values()) for name, value in raw.items()}


# ----------------------------------------------------------------------------------------------------
# The files of a diagnosis of a foreign model: `diagnosis.json`, `report.html`, `model.xml`, the series.

_PANELS = 4  # rows of the picture


def write_foreign(found: ForeignDiagnosis, output: str | Path) -> tuple[str, ...]:
    """Write a diagnosis into a folder, which is made; return the names of what the model's file lacks."""
    folder = check_output_folder(output)
    folder.mkdir(parents=True, exist_ok=True)
    attempt = Attempts()
    text, left = attempt(
        "model.xml",
        lambda: extended_text(found.data.model, found.corrected),
        lambda: ("", tuple(number.name for number in found.corrected)),
    )
    if text:
        written(text, folder / "model.xml")
    for number, trial in enumerate(found.data.of("heldout")):
        name = f"fitted_{Path(trial.file).stem}.csv"
        attempt(name, partial(_write_series, found, number, folder / name), lambda: None)
    picture = attempt("The picture", lambda: _picture(found), bytes)

    def noted() -> ForeignDiagnosis:
        return replace(found, notes=(*found.notes, *attempt.notes))

    page = attempt(
        "Most of report.html",
        lambda: _page(noted(), document(noted(), left), picture),
        lambda: f"<!doctype html><meta charset='utf-8'><h1>{escape(sentence(found))}</h1>",
    )
    written(page, folder / "report.html")
    written(json.dumps(document(noted(), left), indent=1), folder / "diagnosis.json")
    return left


def _write_series(found: ForeignDiagnosis, number: int, path: Path) -> None:
    """Write what was measured and simulated of a held-out trial."""
    trial = found.data.of("heldout")[number]
    columns: dict[str, Any] = {}
    for k, column in enumerate(found.data.model.columns):
        columns |= {
            f"measured_{column.name}": trial.outputs[:, k],
            f"before_{column.name}": found.before.outputs[number][:, k],
            f"after_{column.name}": found.best.outputs[number][:, k],
        }
    written(Table(trial.time_s, columns), path)


def _page(found: ForeignDiagnosis, described: dict[str, Any], picture: bytes) -> str:
    """Return `report.html`; `picture` is a PNG, b"" where there is none."""
    unexplained = found.likely if found.verdict == UNEXPLAINED else ()
    sections = (
        ("What the model lacks", found.named),
        ("Corrections, none of them established", found.corrections),
        ("What a fit uses to soak up the error", unexplained),
    )
    return rendered(
        "catheter_sim.foreign",
        "report.html",
        {
            "found": {"name": found.data.name, "robot": found.data.robot, "verdict": found.verdict},
            "sentence": sentence(found),
            "sections": [(title, _cause_rows(causes)) for title, causes in sections if causes],
            "document": described,
            "picture": png_source(picture) if picture else "",
            "step_ms": 1e3 * described["timestep_s"],
        },
        {"short": lambda value: "-" if value is None else f"{value:.4g}", "spoken": spoken},
    )


def _cause_rows(causes: Sequence[Cause]) -> list[dict[str, Any]]:
    """Return causes in words, as any report has them, each with where it acts."""
    return [
        row | {"form": f"Fitted: {cause.form}"} for row, cause in zip(cause_rows(causes), causes, strict=True)
    ]


def _picture(found: ForeignDiagnosis) -> bytes:
    """Return the series of the first held-out trial, of the columns that err most at first, as a PNG."""
    from matplotlib.figure import Figure  # here, as the command line's help is to be there at once

    from catheter_sim.pictures.curves import COLOURS, png_of, tidy_axes

    trial, before, after = found.data.of("heldout")[0], found.before.outputs[0], found.best.outputs[0]
    squares = np.nan_to_num(((before - trial.outputs) / found.noise) ** 2).sum(axis=0)
    chosen = np.argsort(-squares)[:_PANELS]
    figure = Figure(figsize=(11.0, 1.0 + 1.7 * len(chosen)), layout="constrained")
    panels = figure.subplots(len(chosen), 2, sharex=True, squeeze=False)
    for (series, errors), k in zip(panels, chosen, strict=True):
        measured, noise = trial.outputs[:, k], float(found.noise[k])
        series.plot(trial.time_s, measured, ".", color=COLOURS["measured"], ms=3)
        for stage, values, style in (("before", before[:, k], "--"), ("after", after[:, k], "-")):
            series.plot(trial.time_s, values, style, color=COLOURS[stage])
            errors.plot(trial.time_s, values - measured, style, color=COLOURS[stage], lw=1.0)
        errors.axhspan(-2.0 * noise, 2.0 * noise, color="0.9", lw=0.0)
        series.set_ylabel(found.data.model.columns[int(k)].name, fontsize=8)
    panels[0, 1].set_title("simulated less measured; grey: twice the noise", fontsize=9)
    for panel in panels.flat:
        tidy_axes(panel)
    for panel in panels[-1]:
        panel.set_xlabel("time [s]")
    return png_of(figure)


def document(found: ForeignDiagnosis, left: tuple[str, ...]) -> dict[str, Any]:
    """Return the document of `diagnosis.json`; keys are those of other robots where they mean the same."""
    gain, low, high = found.gain_percent()
    by_unit = found.by_unit
    worst = max(by_unit.values(), key=lambda item: times_noise(item.rmse_before, item.noise_floor))
    return with_undefined(
        {
            "dataset": found.data.name,
            "robot": found.data.robot,
            "unit": worst.unit,
            "verdict": found.verdict,
            "noise_floor": worst.noise_floor,
            "heldout": {
                "rmse_before": worst.rmse_before,
                "rmse_after": worst.rmse_after,
                "gain_percent": gain,
                "gain_percent_ci95": [low, high],
            },
            "causes": cause_entries(found.named),
            "corrections": cause_entries(found.corrections),
            "absorbs": cause_entries(found.likely if found.verdict == UNEXPLAINED else ()),
            "probabilities": dict(found.probabilities),
            "evidence_shares": dict(found.weights),
            "ranking": [
                {
                    "causes": list(item.fit.causes),
                    "heldout_times_noise": item.times_noise,
                    "evidence": item.fit.evidence,
                }
                for item in found.ranking[:SHOWN]
            ],
            "indistinguishable": [list(group) for group in found.indistinguishable],
            "next_experiment": "none is planned for models from somebody's MJCF",
            "by_unit": {
                name: {
                    "noise_floor": item.noise_floor,
                    "rmse_before": item.rmse_before,
                    "rmse_after": item.rmse_after,
                }
                for name, item in by_unit.items()
            },
            "times_noise": {"before": found.before.times_noise, "after": found.best.times_noise},
            "timestep_s": float(found.data.model.simulated.opt.timestep),
            "not_in_model": list(left),
            "notes": [note.text for note in found.notes],
        }
    )


def lines(found: ForeignDiagnosis) -> list[str]:
    """Return what the command line says."""
    said = [sentence(found), f"verdict: {found.verdict}"]
    said += [
        f"held out, RMSE [{unit}]: {item.rmse_before:.3g} before, {item.rmse_after:.3g} after; "
        f"noise {item.noise_floor:.2g}"
        for unit, item in found.by_unit.items()
    ]
    for what, causes in (("cause", found.named), ("correction", found.corrections)):
        for cause in causes:
            said.append(f"{what}: {cause.name} ({cause.form}), probability {cause.probability:.2f}")
            for name, item in cause.parameters.items():
                low, high = item.ci95
                said.append(f"  {name} = {item.value:.4g} (95 %: {low:.4g} to {high:.4g})")
    said += [f"the data cannot tell apart: {', '.join(group)}" for group in found.indistinguishable]
    own, used = (
        float(model.opt.timestep) for model in (found.data.model.compiled, found.data.model.simulated)
    )
    if used < own:
        said.append(f"note: simulated with steps of {1e3 * used:g} ms: the file's {1e3 * own:g} ms change it")
    return said + [f"note: {note}" for note in found.notes]


def sentence(found: ForeignDiagnosis) -> str:
    """Return the verdict in words."""
    before, after = found.before.times_noise, found.best.times_noise
    if found.verdict == NO_DISCREPANCY:
        return f"The model agrees with the data to {before:.2g} times their noise."
    falls = f"held-out errors fall from {before:.3g} to {after:.3g} times the noise."
    if found.verdict == CAUSE_FOUND:
        groups = [
            listed([f"{words(name)} ({SUMMARIES[name]})" for name in cause.one_of], "or")
            for cause in found.named
        ]
        return f"The model lacks {listed(groups)}: {falls}"
    if found.verdict == IMPROVED:
        return (
            f"Corrections improve the model ({listed([words(item.name) for item in found.corrections])}): "
            f"{falls} None of them is established: something else is at work with probability "
            f"{found.probabilities[OUTSIDE]:.2f}."
        )
    return (
        f"The model errs by {before:.3g} times the noise, and no generic cause explains it: the best one "
        f"leaves {after:.3g}."
    )
