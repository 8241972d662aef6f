"""The rows of the report's tables, in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.report.drawing import errors_of
from catheter_sim.diagnosis.report.result import (
    Candidate,
    Cause,
    Diagnosis,
    FittedParameter,
    StructureTest,
    TrialFit,
    UnitResult,
)
from catheter_sim.diagnosis.report.spoken import column_words, figure_words, number_words, titled
from catheter_sim.diagnosis.report.wording import (
    digits_to_tell,
    fixed,
    half_width,
    interval,
    listed,
    rounded,
    words,
)
from catheter_sim.diagnosis.residuals.coordinates import STAGES
from catheter_sim.diagnosis.residuals.structure import TESTS
from catheter_sim.diagnosis.thresholds import LEAST_SHOWN_PROBABILITY
from catheter_sim.effects import EFFECTS


def test_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
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


def unit_row(diagnosis: Diagnosis, unit: str) -> dict[str, str]:
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


def ranking_row(diagnosis: Diagnosis, candidate: Candidate, ranking: Sequence[Candidate]) -> dict[str, Any]:
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


def corrected_names(diagnosis: Diagnosis) -> set[str]:
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


def probability_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Return what is probably at work, most probable first."""
    names = {"none": "no cause", "outside": "something outside the list"}
    return [
        {"name": names.get(name, words(name)), "value": f"{value:.2f}"}
        for name, value in sorted(diagnosis.probabilities.items(), key=lambda item: -item[1])
        if value >= LEAST_SHOWN_PROBABILITY
    ]


def remainder_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
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


def trial_row(diagnosis: Diagnosis, fit: TrialFit) -> dict[str, str]:
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


def key_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Return what the keys of programs are called on the page: of causes, calibrated numbers and columns."""
    rows = [
        {"words": f"{words(cause.name)}, {number_words(name)[0]}", "key": f"{cause.name}.{name}"}
        for cause in (*diagnosis.causes, *diagnosis.corrections, *diagnosis.absorbs)
        for name in cause.parameters
    ]
    rows += [{"words": number_words(name)[0], "key": name} for name in diagnosis.calibrated]
    columns = (*diagnosis.dataset.input_channels, *diagnosis.dataset.output_channels)
    return rows + [{"words": column_words(name), "key": name} for name in columns]


def before_model(diagnosis: Diagnosis, noun: str = "model") -> str:
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
