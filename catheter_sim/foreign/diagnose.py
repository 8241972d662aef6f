"""What is wrong with somebody's MJCF, by measured data: which generic cause, how large, and what is gained.

Every cause alone is tried in its variants, those first that a straight line promises most of; then a second
one beside the best. Evidence of the training trials chooses (`fit`), trials that were held out say what was
gained. A cause is named only where it is more probable than not (`likely`), which it is where little is left.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.notes import Attempts, Note
from catheter_sim.diagnosis.result import CAUSE_FOUND, IMPROVED, NO_DISCREPANCY, UNEXPLAINED
from catheter_sim.foreign.causes import Number, Variant, variants_of
from catheter_sim.foreign.data import ForeignData, noise_of, read_foreign
from catheter_sim.foreign.fit import Fit, Fitter
from catheter_sim.foreign.likely import Likely, Tried, likely, probabilities
from catheter_sim.foreign.thresholds import (
    BLOCK_S,
    DRY,
    ESTABLISHED,
    FAR_LESS_NOISE,
    FAR_WORSE,
    FITTED,
    HALVINGS,
    HARM_NOISE,
    HARM_SHARE,
    LAST_STEPS,
    LEAST_CAUSES,
    LEAST_GAIN,
    NATS,
    NOISE_SHARE,
    OWN_STEP_SHARE,
    SECOND_GAIN,
    SECOND_SHARE,
    START_FAR,
    START_SIZES,
    STEP_NOISE,
)
from catheter_sim.foreign.twin import Runner
from catheter_sim.progress import Stages

_SEED = 7
_BOOTSTRAPS = 400


@dataclass(frozen=True)
class Judged:
    """A fit with what it leaves on trials that were held out.

    Attributes:
        fit: the numbers.
        outputs: along each held-out trial, shape (r, o) each.
        times_noise: root mean square of its errors there, in units of the noise.
    """

    fit: Fit
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
    likely: tuple[Likely, ...]
    probabilities: Mapping[str, float]
    notes: tuple[Note, ...] = ()

    @property
    def named(self) -> tuple[Likely, ...]:
        """The established causes, the most probable first: none unless the verdict is `CAUSE_FOUND`."""
        chosen = self.likely if self.verdict == CAUSE_FOUND else ()
        return tuple(item for item in chosen if item.probability >= ESTABLISHED)

    @property
    def corrections(self) -> tuple[Likely, ...]:
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

    def heldout_rms(self, judged: Judged) -> Mapping[str, float]:
        """Return a fit's root mean square error on held-out trials by unit."""
        squares: dict[str, list[Array]] = {}
        for trial, outputs in zip(self.data.of("heldout"), judged.outputs, strict=True):
            for k, column in enumerate(self.data.model.columns):
                errors = outputs[:, k] - trial.outputs[:, k]
                squares.setdefault(column.unit, []).append(errors[np.isfinite(errors)] ** 2)
        return {unit: math.sqrt(float(np.mean(np.concatenate(parts)))) for unit, parts in squares.items()}

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
        for trial, outputs in zip(self.data.of("heldout"), judged.outputs, strict=True):
            squares = np.nan_to_num(((outputs - trial.outputs) / self.noise) ** 2).sum(axis=1)
            found.append(np.bincount(np.floor(trial.time_s / BLOCK_S).astype(int), weights=squares))
        return np.concatenate(found)


def diagnose_foreign(
    folder: str | os.PathLike[str], jobs: int = 1, progress: bool = False
) -> ForeignDiagnosis:
    """Return what is wrong with the MJCF of a data set.

    Args:
        folder: of the data set.
        jobs: simulations at a time.
        progress: write stages to standard error.

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
    judge = _Judge(data, runner, noise)
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
    return ForeignDiagnosis(
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


def _tried(judged: Judged) -> Tried:
    return Tried(judged.fit.causes, judged.fit.evidence, judged.times_noise)


def _harmful(data: ForeignData, noise: Array, before: Judged, after: Judged) -> bool:
    """Return whether a fit makes an output worse on the held-out trials, by more than its noise."""
    rms = []
    for judged in (before, after):
        pairs = zip(judged.outputs, data.of("heldout"), strict=True)
        errors = np.concatenate([(own - trial.outputs) / noise for own, trial in pairs])
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


class _Judge:
    """Plays fits along the trials that were held out."""

    def __init__(self, data: ForeignData, runner: Runner, noise: Array) -> None:
        self._trials, self._runner, self._noise = data.of("heldout"), runner, noise

    def __call__(self, fit: Fit) -> Judged:
        outputs = self._runner.outputs([fit.values], self._trials)[0]
        errors = [(own - t.outputs) / self._noise for own, t in zip(outputs, self._trials, strict=True)]
        every = np.concatenate([item[np.isfinite(item)] for item in errors])
        return Judged(fit, tuple(outputs), math.sqrt(float(np.mean(every**2))))


def _singles(fitter: Fitter, nothing: Fit, variants: Sequence[Variant]) -> list[Fit]:
    """Return the best fit of each cause alone."""
    found: dict[str, Fit] = {}
    for fit in _fits(fitter, nothing, variants, FITTED):
        known = found.get(fit.causes[0])
        if known is None or fit.evidence > known.evidence:
            found[fit.causes[0]] = fit
    return list(found.values())


def _pairs(fitter: Fitter, first: Fit, variants: Sequence[Variant]) -> list[Fit]:
    """Return fits of the best cause with the best promised variant of each other one."""
    others = [item for item in variants if item.cause not in first.causes]
    return _fits(fitter, first, others, 1)


def _fits(fitter: Fitter, base: Fit, variants: Sequence[Variant], most: int) -> list[Fit]:
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
