"""What a report says: causes, numbers and verdicts in words, what to do next, and the rows of its tables."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from catheter_sim.arrays import Array
from catheter_sim.core.variation import MARK, variation_of, variation_words
from catheter_sim.diagnosis.document import tip_mm
from catheter_sim.diagnosis.residuals import STAGES, TESTS
from catheter_sim.diagnosis.result import (
    CAUSE_FOUND,
    DATA_SUSPECT,
    IMPROVED,
    NO_DISCREPANCY,
    UNEXPLAINED,
    Candidate,
    Cause,
    DiagnosisResult,
    FittedParameter,
    StructureTest,
    TrialFit,
    UnitResult,
)
from catheter_sim.diagnosis.thresholds import LEAST_SHOWN_PROBABILITY, NEAR_NOISE
from catheter_sim.diagnosis.trials import unit_of
from catheter_sim.effects import EFFECTS
from catheter_sim.units import SI_TO_FILE

# ----------------------------------------------------------------------------------------------------
# Numbers and names as a reader wants them: rounded to their uncertainty, with their unit.

_PLAIN_UNITS = {
    "_N_mm_per_rad": "N mm/rad",
    "_N_per_mm": "N/mm",
    "_N_mm2": "N mm²",
    "_deg_per_m": "deg/m",
    "_per_m": "1/m",
    "_mm2": "mm²",
    "_mm4": "mm⁴",
    "_percent": "%",
    "_m_per_s2": "m/s²",
    "_per_s": "1/s",
    "_mm_per_min": "mm/min",
    "_N_per_min": "N/min",
    "_s_per_mm": "s/mm",
    "_s_per_N": "s/N",
}
_UNITS = {suffix: suffix.removeprefix("_") for suffix, _ in SI_TO_FILE.values()} | _PLAIN_UNITS
_LONGEST_FIRST = sorted(_UNITS, key=len, reverse=True)


def name_and_unit(name: str) -> tuple[str, str]:
    """Return words and unit of a name that ends in its unit: "width_mm" is ("width", "mm")."""
    for suffix in _LONGEST_FIRST:
        if name.endswith(suffix):
            return name.removesuffix(suffix).replace("_", " "), _UNITS[suffix]
    return name.replace("_", " "), ""


def decimals(uncertainty: float, value: float = 0.0) -> int:
    """Return how many decimals leave two significant digits of `uncertainty`.

    Without an uncertainty (zero, or not finite) three significant digits of `value`.
    """
    if math.isfinite(uncertainty) and uncertainty > 0.0:
        return max(0, 1 - math.floor(math.log10(uncertainty)))
    if math.isfinite(value) and value != 0.0:
        return max(0, 2 - math.floor(math.log10(abs(value))))
    return 2


def rounded(value: float, uncertainty: float = math.nan) -> str:
    """Return `value` with the digits that `uncertainty` leaves; "undefined" if it is not finite."""
    return fixed(value, decimals(uncertainty, value))


def digits_to_tell(values: Iterable[float], digits: int = 2) -> int:
    """Return the decimals in which to show `values` side by side.

    Two at least, and so many that the smallest keeps `digits` significant digits; no more than five.
    """
    sizes = [abs(value) for value in values if math.isfinite(value) and value != 0.0]
    if not sizes:
        return 2
    return min(5, max(2, digits - 1 - math.floor(math.log10(min(sizes)))))


def fixed(value: float, places: int) -> str:
    """Return `value` with `places` decimals; "undefined" if it is not finite."""
    if not math.isfinite(value):
        return "∞" if value == math.inf else "undefined"
    text = f"{value:.{places}f}"
    return text.replace("-", "−") if float(text) != 0.0 else text.removeprefix("-")


def interval(value: float, ci95: tuple[float, float]) -> str:
    """Return a 95 % interval as "0.40 to 0.44", with the digits that its width leaves."""
    half = half_width(ci95)
    if not all(math.isfinite(end) for end in ci95):
        return "undefined" if math.isnan(half) else f"{rounded(ci95[0])} to {rounded(ci95[1])}"
    return f"{rounded(ci95[0], half)} to {rounded(ci95[1], half)}"


def half_width(ci95: tuple[float, float]) -> float:
    """Return half the width of an interval."""
    return (ci95[1] - ci95[0]) / 2.0


def words(name: str) -> str:
    """Return an effect's name in words."""
    return name.replace("_", " ")


def listed(items: list[str] | tuple[str, ...], last: str = "and") -> str:
    """Return "a, b and c"."""
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} {last} {items[-1]}"


def axis_label(name: str) -> str:
    """Return the words for a column or coordinate with its unit in brackets: "tip x [mm]"."""
    words, _, unit = name.rpartition("_")
    if unit not in ("mm", "deg", "N", "Nm", "s"):
        return name.replace("_", " ")
    return f"{words.replace('_', ' ')} [{unit}]"


# ----------------------------------------------------------------------------------------------------
# Keys as a reader says them: numbers of causes, further figures, columns, and keys inside sentences.
#
# The key itself stays in a title, which a browser shows on pointing; programs find it in `diagnosis.json`.

_WHOLE = {  # names that say less than they mean
    "mu": "coefficient of friction",
    "scale": "factor",
    "cubic": "cubic term",
    "zero": "wandering of the zero",
    "creep": "share that creeps",
    "creep time": "time constant of the creep",
    "lag": "time constant of the lag",
    "toe": "length by which tendons give way at first",
    "toe range": "pull over which they do",
    "hole width": "play of tendons in their holes",
    "hole range": "input over which they cross them",
    "servo": "least time of the drives",
    "servo width": "dead-band of the drives' controllers",
    "servo time": "time constant in which they close it",
    "log zero": "creep of the zero for each factor of e in time",
    "log time": "time constant of that creep",
    "creep share": "share of a pull by which tendons creep",
    "elastic constant": "factor on elastic constants",
    "moment arm": "factor on moment arms",
    "friction coefficient": "coefficient of friction",
}
_FIRST = {  # the first word of a name of several, and what it says of the rest
    "scale": "factor of",
    "offset": "offset of",
    "width": "width at",
    "slack": "slack at",
    "servo": "least time of the drive of",
    "zero": "wandering of the zero of",
    "curvature": "curvature,",
    "rotation": "turn about",
    "translation": "shift along",
    "force": "force along",
    "arm": "factor on the arm of",
    "radius": "factor on the radius of",
}
_FRAME_SHIFT = re.compile(r"frame (shift|turn) ([xyz])")
_FURTHER = re.compile(
    r"heldout_(?P<simulation>simulation_)?(?P<what>tip_distance_(?:rmse|mean)|rmse|minus_twin_rms)"
    r"(?P<aligned>_aligned)?(?:_(?P<stage>before|after))?(?:_(?P<unit>mm|deg|N))?(?P<first>_as_chosen_in_training)?"
)
_WHAT = {
    "tip_distance_rmse": "tip error in space, RMS",
    "tip_distance_mean": "tip error in space, mean",
    "rmse": "error of each output, RMS",
    "minus_twin_rms": "difference from the fast model, RMS",
}
_TOKEN = re.compile(r"[A-Za-z0-9_.<>/\\-]*[A-Za-z0-9>](?:[._/][A-Za-z0-9_.<>/-]*[A-Za-z0-9_>])")
_FILE = re.compile(r".*\.(csv|tsv|txt|json|toml|xml|html|png|dat)|.*/.*", re.IGNORECASE)


def number_words(name: str) -> tuple[str, str]:
    """Return words and unit of a cause's or a calibrated number: "width_mm" is ("width", "mm")."""
    if MARK in name:
        item = variation_of(name)
        text, unit = number_words(item.number)
        return f"{text}, more {variation_words(item)}", unit
    text, unit = name_and_unit(name)
    if text in _WHOLE:
        return _WHOLE[text], unit
    shift = _FRAME_SHIFT.fullmatch(text)
    if shift:
        way = "shift along" if shift[1] == "shift" else "turn about"
        return f"tracker's frame, {way} {shift[2]}", unit
    first, _, rest = text.partition(" ")
    return (f"{_FIRST[first]} {rest}" if rest and first in _FIRST else text), unit


def figure_words(name: str) -> tuple[str, str]:
    """Return words and unit of a further figure: "heldout_simulation_rmse_after_mm"."""
    found = _FURTHER.fullmatch(name)
    if found is None:
        return name_and_unit(name)
    who = "MuJoCo" if found["simulation"] else "fast model"
    stage = f", {found['stage']}" if found["stage"] else ""
    aligned = ", without its mean offset" if found["aligned"] else ""
    first = "; with the causes chosen in training" if found["first"] else ""
    return f"{who}{stage}: {_WHAT[found['what']]}{aligned}{first}", found["unit"] or ""


def column_words(name: str) -> str:
    """Return a column's name in words, its unit in brackets: "tension right [N]"."""
    text, unit = name_and_unit(name)
    return f"{text} [{unit}]" if unit else text


def titled(text: str, key: str) -> Markup:
    """Return words that show their key on pointing."""
    return Markup('<span title="{}">{}</span>').format(key, text)


def spoken(text: object) -> Markup:
    """Return a sentence as HTML: its keys in words, the names of its files as `<code>`, all else escaped.

    A `.` between digits, at the end of a sentence or in an abbreviation is none of a key.
    """
    said = str(text)
    parts: list[Markup] = []
    end = 0
    for match in _TOKEN.finditer(said):
        token = match[0]
        parts += [escape(said[end : match.start()]), _said(token)]
        end = match.end()
    return Markup("").join([*parts, escape(said[end:])])


def _said(token: str) -> Markup:
    if _FILE.fullmatch(token):
        # "N/mm" and "and/or" are no paths: a path has an ending or more than one step, or a key's sign in it.
        if "." in token or "_" in token:
            return Markup("<code>{}</code>").format(token)
        return escape(token)
    effect, dot, name = token.partition(".")
    if dot and effect in EFFECTS:
        return titled(f"{words(effect)}, {number_words(name)[0]}", token)
    if "_" in token or (dot and effect.isidentifier() and name.isidentifier() and len(effect) > 1):
        text, _ = name_and_unit(token.replace(".", " "))
        return titled(text, token)
    return escape(token)


# ----------------------------------------------------------------------------------------------------
# The rows of the report's tables, in words.


def errors_of(fit: TrialFit, columns: Sequence[str], stage: str) -> Array:
    """Return measured minus computed, shape (columns, r); NaN where nothing was measured."""
    table = fit.before if stage == "before" else fit.after
    return np.array([fit.measured.columns[name] - table.columns[name] for name in columns])


def test_rows(diagnosis: DiagnosisResult) -> list[dict[str, str]]:
    """Return the tests of residuals, before and after side by side."""
    stages = [{test.name: test for test in diagnosis.structure.get(stage, ())} for stage in STAGES]
    return [
        {"what": words, "before": _p_value(stages[0].get(name)), "after": _p_value(stages[1].get(name))}
        for name, words in TESTS.items()
        if name in stages[0]
    ]


def _p_value(test: StructureTest | None) -> str:
    return "-" if test is None else f"{test.p_value:.3f}"


def errors_and_noise(result: UnitResult) -> tuple[str, str, str]:
    """Return the error before, after, and the noise, to be shown side by side."""
    places = digits_to_tell((result.rmse_before, result.rmse_after))
    before, after, noise = result.rmse_before, result.rmse_after, result.noise_floor
    return fixed(before, places), fixed(after, places), fixed(noise, max(places, digits_to_tell([noise])))


def unit_row(diagnosis: DiagnosisResult, unit: str) -> dict[str, str]:
    result = diagnosis.by_unit[unit]
    before, after, noise = errors_and_noise(result)
    half = half_width(result.gain_percent_ci95)
    return {
        "unit": shown_unit(unit) or "quaternion",
        "noise": noise,
        "before": before,
        "after": after,
        "gain": rounded(result.gain_percent, half),
        "interval": interval(result.gain_percent, result.gain_percent_ci95),
    }


def ranking_row(
    diagnosis: DiagnosisResult, candidate: Candidate, ranking: Sequence[Candidate]
) -> dict[str, Any]:
    finite = [item.heldout_rmse for item in ranking if math.isfinite(item.heldout_rmse)]
    largest = max(finite, default=1.0) or 1.0
    width = 100.0 * candidate.heldout_rmse / largest if math.isfinite(candidate.heldout_rmse) else 0.0
    named = corrected_names(diagnosis)
    return {
        "causes": listed([words(name) for name in candidate.causes])
        or f"no effect ({before_model(diagnosis)})",
        "heldout": fixed(candidate.heldout_rmse, digits_to_tell(finite, digits=3)),
        "inside": fixed(candidate.cross_validated_rmse, digits_to_tell(finite, digits=3)),
        "width": f"{width:.1f}",
        "chosen": set(candidate.causes) == named,
        "mark": "reported",
    }


def corrected_names(diagnosis: DiagnosisResult) -> set[str]:
    """Return the names of the causes and corrections that the extended robot holds."""
    return {cause.name for cause in (*diagnosis.causes, *diagnosis.corrections)}


def cause_rows(causes: Sequence[Cause]) -> list[dict[str, Any]]:
    """Return causes or corrections in words."""
    return [
        {
            "name": listed([words(name) for name in cause.one_of], "or"),
            "first": words(cause.name),
            "members": listed([f"{words(name)} {value:.2f}" for name, value in cause.members.items()]),
            "summary": EFFECTS[cause.name].summary.replace("`", "") if cause.name in EFFECTS else "",
            **form_words(cause),
            "trace": EFFECTS[cause.name].trace if cause.name in EFFECTS else "",
            "share": f"It takes away {rounded(cause.gain_percent, 5.0)} % of the error."
            if cause.gain_percent > 0.0
            else "By itself it does not lower the error.",
            "probability": "" if math.isnan(cause.probability) else f"{cause.probability:.2f}",
            "parameters": [parameter_row(name, item) for name, item in cause.parameters.items()],
        }
        for cause in causes
    ]


def probability_rows(diagnosis: DiagnosisResult) -> list[dict[str, Any]]:
    """Return what is probably at work, most probable first; causes that the data do not tell apart are one.

    `widths` are those of a bar's parts [%]: of each member of such a group its own.
    """
    names = {"none": "no cause", "outside": "something outside the list"}
    groups = [cause for cause in (*diagnosis.causes, *diagnosis.corrections) if cause.members]
    grouped = {name for cause in groups for name in cause.members}
    found = [
        (value, names.get(name, words(name)), {name: value})
        for name, value in diagnosis.probabilities.items()
        if name not in grouped
    ]
    found += [
        (cause.probability, listed([words(name) for name in cause.members], "or"), dict(cause.members))
        for cause in groups
    ]
    return [
        {
            "name": said,
            "value": f"{value:.2f}",
            "members": listed([f"{words(name)} {own:.2f}" for name, own in members.items()])
            if len(members) > 1
            else "",
            "widths": [
                f"{100.0 * value * own / max(sum(members.values()), 1e-12):.1f}" for own in members.values()
            ],
        }
        for value, said, members in sorted(found, key=lambda item: -item[0])
        if value >= LEAST_SHOWN_PROBABILITY
    ]


def remainder_rows(diagnosis: DiagnosisResult) -> list[dict[str, str]]:
    """Return what the reported model leaves of each unit's error."""
    return [
        {
            "unit": f" [{shown_unit(unit)}]" if shown_unit(unit) else "",
            "times": f"{item.times_noise:.2g}",
            "on": f" It depends on {listed(on)}." if on else "",
        }
        for unit, item in diagnosis.residual.items()
        for on in [[TESTS[name] for name in item.structure]]
    ]


def parameter_row(name: str, parameter: FittedParameter) -> dict[str, Any]:
    text, unit = number_words(name)
    half = half_width(parameter.ci95)
    null = parameter.null
    return {
        "said": titled(text, name),
        "value": rounded(parameter.value, half),
        "interval": interval(parameter.value, parameter.ci95),
        "null": "" if null is None else rounded(null, half) if null else "0",
        "unit": unit,
        "open": null is not None and parameter.ci95[0] <= null <= parameter.ci95[1],
    }


def trial_row(diagnosis: DiagnosisResult, fit: TrialFit) -> dict[str, str]:
    columns = [name for name in fit.measured.columns if unit_of(name) == diagnosis.unit]
    measured = np.array([fit.measured.columns[name] for name in columns])

    def rmse(stage: str) -> float:
        errors = errors_of(fit, columns, stage)
        errors = errors[np.isfinite(errors)]
        return float(np.sqrt((errors**2).mean())) if len(errors) else math.nan

    before, after = rmse("before"), rmse("after")
    return {
        "file": fit.file,
        "role": {"heldout": "held out", "train": "training"}.get(fit.role, fit.role),
        "rows": str(int(np.isfinite(measured).any(axis=0).sum())) if len(columns) else "0",
        "before": fixed(before, digits_to_tell((before, after))),
        "after": fixed(after, digits_to_tell((before, after))),
    }


def extra_row(name: str, value: float) -> dict[str, str]:
    text, unit = figure_words(name)
    return {"name": titled(text, name), "value": rounded(float(value)), "unit": unit}


def key_rows(diagnosis: DiagnosisResult) -> list[dict[str, str]]:
    """Return what the keys of programs are called on the page: of causes, calibrated numbers and columns."""
    rows = [
        {"words": f"{words(cause.name)}, {number_words(name)[0]}", "key": f"{cause.name}.{name}"}
        for cause in (*diagnosis.causes, *diagnosis.corrections, *diagnosis.absorbs)
        for name in cause.parameters
    ]
    rows += [{"words": number_words(name)[0], "key": name} for name in diagnosis.calibrated]
    columns = (*diagnosis.dataset.input_channels, *diagnosis.dataset.output_channels)
    return rows + [{"words": column_words(name), "key": name} for name in columns]


def before_model(diagnosis: DiagnosisResult, noun: str = "model") -> str:
    """Return what the model before correction is called; "calibrated" only where something was calibrated."""
    return f"calibrated {noun}" if diagnosis.calibrated else f"{noun} as specified"


def shown_unit(unit: str) -> str:
    return "" if unit == "1" else unit


def shown_share(value: float) -> str:
    if not math.isfinite(value):
        return "undefined"
    return "none" if value < 0.5 else f"{value:.0f} %"


def sortable(value: float) -> float:
    return value if math.isfinite(value) else math.inf


def form_words(cause: Cause) -> dict[str, str]:
    """Return where a cause acts, its formula, and forms that do as well; "" where it has one form."""
    forms = {form.name: form for form in EFFECTS[cause.name].forms} if cause.name in EFFECTS else {}
    if len(forms) < 2 or cause.form not in forms:
        return {"form": "", "equation": "", "other_forms": ""}
    form = forms[cause.form]
    return {
        "form": f"It acts {form.stage.value}, in the form “{words(form.name)}”",
        "equation": form.equation,
        "other_forms": listed([f"“{words(name)}”" for name in cause.forms_as_good], "or"),
    }


# ----------------------------------------------------------------------------------------------------
# The figures at the head of the report: the error as a user meets it, the noise beside it, the gain.


@dataclass(frozen=True)
class HeldOutError:
    """The held-out error that a report speaks of, root mean square.

    Attributes:
        what: "tip error", the distance in space, where x, y and z of the tip are measured; else "error", of
            each output by itself.
        unit: as shown; "" for quaternions.
        before: of the fast model before correction.
        after: of the fast model as reported.
        simulated: of MuJoCo as reported; NaN: it was not run.
        noise: row-to-row noise of the same.
        repeatability: of the same; NaN: nothing was repeated.
        floor: what a flexible model of the inputs leaves of the same; NaN where that was not asked.
        learnable: whether that is less by more than chance.
    """

    what: str
    unit: str
    before: float
    after: float
    simulated: float
    noise: float
    repeatability: float
    floor: float
    learnable: bool

    def said(self, value: float) -> str:
        """Return one of its numbers with its unit, rounded as before and after are."""
        return f"{fixed(value, self._places)} {self.unit}".strip()

    @property
    def said_noise(self) -> str:
        """Return the noise with its unit, with two digits or more."""
        return f"{fixed(self.noise, max(self._places, digits_to_tell([self.noise])))} {self.unit}".strip()

    @property
    def course(self) -> str:
        """Return "falls from 6.10 to 0.90 mm", or what it does instead."""
        before, after = fixed(self.before, self._places), self.said(self.after)
        if before == fixed(self.after, self._places):
            return f"stays at {after}"
        return f"{'falls' if self.after < self.before else 'rises'} from {before} to {after}"

    @property
    def best_known(self) -> float:
        """Return MuJoCo's error, or the fast model's where MuJoCo was not run."""
        return self.after if math.isnan(self.simulated) else self.simulated

    @property
    def _places(self) -> int:
        return digits_to_tell((self.before, self.after))


def heldout_error(diagnosis: DiagnosisResult) -> HeldOutError:
    """Return the held-out error that a report speaks of.

    The tip's distance in space comes first, unless what was corrected helps another unit alone.
    """
    shown, tip = diagnosis.shown, tip_mm(diagnosis)
    helped = shown.unit == "mm" or not diagnosis.is_corrected
    if tip is not None and "mm" in diagnosis.by_unit:
        result = diagnosis.by_unit["mm"]
        if helped or result.gain_percent_ci95[0] > 0.0:
            simulated = diagnosis.extra.get("heldout_simulation_tip_distance_rmse_after_mm", math.nan)
            errors = (tip["before"], tip["after"], simulated)
            floor = math.nan if diagnosis.floor.tip_mm is None else diagnosis.floor.tip_mm
            return _error(diagnosis, result, "tip error", (*errors, floor), math.sqrt(3.0))
    errors = (shown.rmse_before, shown.rmse_after, simulated_error(diagnosis, shown.unit))
    return _error(diagnosis, shown, "error", (*errors, diagnosis.floor.rmse.get(shown.unit, math.nan)), 1.0)


def _error(
    diagnosis: DiagnosisResult,
    result: UnitResult,
    what: str,
    errors: tuple[float, float, float, float],
    scale: float,
) -> HeldOutError:
    """`scale`: from an output's root mean square to that of `what`; of three alike outputs the root of 3."""
    before, after, simulated, floor = errors
    return HeldOutError(
        what,
        shown_unit(result.unit),
        before,
        after if diagnosis.is_corrected else before,
        simulated,
        scale * result.noise_floor,
        scale * diagnosis.repeatability.get(result.unit, math.nan),
        floor,
        diagnosis.floor.gains(result.unit),
    )


def simulated_error(diagnosis: DiagnosisResult, unit: str) -> float:
    """Return MuJoCo's error of each output on held-out data; NaN: not simulated."""
    suffix = "" if unit == "1" else f"_{unit}"
    return float(diagnosis.extra.get(f"heldout_simulation_rmse_after{suffix}", math.nan))


def simulated_text(diagnosis: DiagnosisResult, unit: str) -> str:
    """Return that error with as many decimals as the fast model's; "-" where it was not simulated."""
    error = simulated_error(diagnosis, unit)
    result = diagnosis.by_unit[unit]
    places = digits_to_tell((result.rmse_before, result.rmse_after))
    return "-" if math.isnan(error) else fixed(error, places)


def reported_model(diagnosis: DiagnosisResult, noun: str = "model") -> str:
    """Return what the reported model is called: "corrected model", or as before correction."""
    return f"corrected {noun}" if diagnosis.is_corrected else before_model(diagnosis, noun)


def headline_numbers(diagnosis: DiagnosisResult) -> list[dict[str, str]]:
    """Return the figures at the head, the first the largest: look, value with unit, and words.

    MuJoCo's error comes first. Beside it stands that of the fast model (the analytic twin, by which causes
    are fitted), then the noise. Where no model was fitted there are none.
    """
    if not diagnosis.was_fitted:
        return []
    error, fast = heldout_error(diagnosis), reported_model(diagnosis, "fast model")
    corrected = diagnosis.is_corrected
    numbers = []
    if not math.isnan(error.simulated):
        numbers.append(
            (
                "",
                error.said(error.simulated),
                f"{error.what} on held-out data, {reported_model(diagnosis, 'simulation')} (MuJoCo)",
            )
        )
        numbers.append(
            ("", error.said(error.after), f"{error.what} of the {fast}, by which causes are fitted")
        )
    else:
        words = f"{error.what} on held-out data, {fast}; MuJoCo was not run"
        numbers.append(("", error.said(error.after), words))
    if corrected:
        words = f"{error.what} before correction: the {before_model(diagnosis, 'fast model')}"
        numbers.append(("before", error.said(error.before), words))
    distance = ", as a distance in space" if error.what == "tip error" else ""
    numbers.append(("", error.said_noise, f"row-to-row noise{distance}"))
    if not math.isnan(error.repeatability):
        numbers.append(("", error.said(error.repeatability), "repeatability: two runs of the same commands"))
    if error.learnable and floor_words(error):
        numbers.append(("", error.said(error.floor), f"left by {FLEXIBLE}"))
    if corrected:
        gain = diagnosis.shown
        half = half_width(gain.gain_percent_ci95)
        says = interval(gain.gain_percent, gain.gain_percent_ci95)
        words = f"less error over all outputs in {shown_unit(gain.unit)} (95 % interval {says} %)"
        numbers.append(("", f"{rounded(gain.gain_percent, half)} %", words.replace("  ", " ")))
    return [
        {"look": "first" if index == 0 else look, "value": value, "words": words}
        for index, (look, value, words) in enumerate(numbers)
    ]


# ----------------------------------------------------------------------------------------------------
# What a reader does after a diagnosis: what each verdict asks, where to look, what the model is good for.

ASKS: Mapping[str, str] = {
    CAUSE_FOUND: "Check the named cause on the robot. Repair it and measure again, or go on with robot.toml.",
    IMPROVED: "Use robot.toml to predict motions like these. Do not repair the robot by it: no cause is "
    "established.",
    NO_DISCREPANCY: "Use the model as it is. To find smaller faults, measure with less noise or over a "
    "larger range.",
    UNEXPLAINED: "Check the robot's file against the robot: lengths, tendons, gravity. Then measure what the "
    "report proposes.",
    DATA_SUSPECT: "Correct the data where the report says, or measure again. Then diagnose again.",
}
_MOST_CHECKS = 4


FLEXIBLE = "a flexible model of the inputs and their history, trained on the same trials"


def floor_words(error: HeldOutError) -> str:
    """Return how much of what is left the inputs tell; "" where little is left or that was not asked."""
    if math.isnan(error.floor) or error.after <= NEAR_NOISE * error.noise:
        return ""
    if error.learnable:
        return (
            f"On top of the reported model, {FLEXIBLE}, leaves {error.said(error.floor)}. So part of what is "
            "left follows from the inputs. The rest may not, or takes more data to learn."
        )
    return (
        f"On top of the reported model, {FLEXIBLE}, shows no sure gain. What is left may not follow from the "
        "inputs, or takes more data to learn."
    )


def asks_of(diagnosis: DiagnosisResult) -> str:
    """Return what the verdict asks of a reader."""
    if diagnosis.has_too_little:
        return "Record what is missing. Then diagnose again."
    return ASKS[diagnosis.verdict]


def bench_rows(diagnosis: DiagnosisResult) -> list[dict[str, str]]:
    """Return what to look at on the robot itself: named causes first, then the most probable others."""
    if diagnosis.verdict in (NO_DISCREPANCY, DATA_SUSPECT):
        return []
    likely = sorted(diagnosis.probabilities, key=lambda name: -diagnosis.probabilities[name])
    names = [name for cause in diagnosis.causes for name in cause.one_of]
    alike = {name for group in diagnosis.indistinguishable for name in group}
    others = {cause.name for cause in diagnosis.corrections} if names else set(likely)
    names += [name for name in likely if name in alike]
    names += [name for group in diagnosis.indistinguishable for name in group]
    names += [
        name for name in likely if name in others and diagnosis.probabilities[name] >= LEAST_SHOWN_PROBABILITY
    ]
    if not diagnosis.causes:
        names += [cause.name for cause in (*diagnosis.corrections, *diagnosis.absorbs)]
    known = [name for name in dict.fromkeys(names) if name in EFFECTS and EFFECTS[name].bench]
    return [{"name": words(name), "words": EFFECTS[name].bench} for name in known[:_MOST_CHECKS]]


def use_words(diagnosis: DiagnosisResult) -> str:
    """Return how far the model can be trusted now, in a sentence or two."""
    if diagnosis.has_too_little:
        return (
            "Record what is missing, and diagnose again. These data cannot say what is wrong with the robot."
        )
    error, model = heldout_error(diagnosis), reported_model(diagnosis)
    if diagnosis.verdict == DATA_SUSPECT:
        return "Until the data are right, no number on this page says anything about the robot."
    right = f"On held-out data the {error.what} of the {model} is {error.said(error.best_known)}."
    if diagnosis.verdict == CAUSE_FOUND:
        return f"{right} This holds while the robot stays as it was measured."
    if diagnosis.verdict == IMPROVED:
        fitted = "Its corrections are fitted numbers, not measured properties of the robot."
        return f"{right} {fitted} {floor_words(error)}".strip()
    if diagnosis.verdict == UNEXPLAINED:
        return (
            f"{right} Expect as much from it. What is missing may be a cause outside the list, or a wrong "
            f"number in the robot's file. {floor_words(error)}"
        ).strip()
    return right
