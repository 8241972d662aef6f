"""The report of a diagnosis: one sentence, one number, one picture, then the evidence and the doubts.

One HTML file that needs no network and prints on A4; its pictures are inlined.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

import numpy as np
from jinja2 import Environment, StrictUndefined

from catheter_sim.diagnosis.pictures import Picture, errors_of, judged
from catheter_sim.diagnosis.residuals import STAGES, VIEWS
from catheter_sim.diagnosis.result import (
    CAUSE_FOUND,
    DATA_SUSPECT,
    NEXT_EXPERIMENT_FILE,
    SIGNIFICANT,
    Candidate,
    Diagnosis,
    FittedParameter,
    StructureTest,
    TrialFit,
    UnitResult,
    fit_files,
)
from catheter_sim.diagnosis.structure import TESTS
from catheter_sim.diagnosis.trials import unit_of
from catheter_sim.diagnosis.wording import (
    alike,
    axis_label,
    fixed,
    half_width,
    interval,
    listed,
    name_and_unit,
    rounded,
    words,
)
from catheter_sim.effects.registry import EFFECTS

_TEMPLATE = "report_template.html"
_MOST_CANDIDATES = 12  # rows of the ranking; diagnosis.json holds all


def sentence(diagnosis: Diagnosis) -> str:
    """Return what was found, in one sentence."""
    head = diagnosis.headline
    robot = diagnosis.extended_robot.name
    before, after, noise = (f"{text} {_unit(head.unit)}".strip() for text in _figures(head))
    if diagnosis.verdict == CAUSE_FOUND:
        causes = listed([words(cause.name) for cause in diagnosis.causes])
        return (
            f"The model of {robot} is wrong about {causes}: corrected, its error on data held out falls "
            f"from {before} to {after}."
        )
    if diagnosis.verdict == "no_discrepancy":
        return (
            f"The calibrated model of {robot} agrees with these measurements: its error on data held out "
            f"is {before}, the noise {noise}, and no cause is named."
        )
    if diagnosis.verdict == DATA_SUSPECT:
        return (
            f"These data of {robot} look wrong, so that no cause was looked for: "
            f"{listed([item.words for item in diagnosis.suspicions])}"
        )
    return (
        f"The model of {robot} is off by {before} on data held out, where the noise is {noise}, and no cause "
        "that was tried explains it."
    )


def report_html(diagnosis: Diagnosis, pictures: Sequence[Picture]) -> str:
    """Return the report as one HTML text.

    Args:
        diagnosis: what was found.
        pictures: from `figures`.
    """
    text = resources.files("catheter_sim.diagnosis").joinpath(_TEMPLATE).read_text(encoding="utf-8")
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    sources = [
        {
            "name": picture.name,
            "caption": picture.caption,
            "data": "data:image/png;base64," + base64.b64encode(picture.png).decode("ascii"),
        }
        for picture in pictures
    ]
    return environment.from_string(text).render(pictures=sources, **_context(diagnosis, pictures))


def _context(diagnosis: Diagnosis, pictures: Sequence[Picture]) -> dict[str, Any]:
    head = diagnosis.headline
    _, subject = judged(diagnosis)
    best = sorted(diagnosis.ranking, key=lambda item: _sortable(item.heldout_rmse))
    named = {cause.name for cause in diagnosis.causes}
    shown = [
        item
        for index, item in enumerate(best)
        if index < _MOST_CANDIDATES or not item.causes or set(item.causes) == named
    ]
    return {
        "diagnosis": diagnosis,
        "dataset": diagnosis.dataset,
        "sentence": sentence(diagnosis),
        "number": _number(diagnosis),
        "verdict": diagnosis.verdict.replace("_", " "),
        "unit": _unit(diagnosis.unit),
        "noise": _figures(head)[2],
        "units": [_unit_row(diagnosis, unit) for unit in diagnosis.by_unit],
        "ranking": [_ranking_row(diagnosis, item, best) for item in shown],
        "ranking_left_out": len(best) - len(shown),
        "ranking_words": _ranking_words(diagnosis),
        "causes": _cause_rows(diagnosis),
        "calibrated": [_parameter_row(name, item) for name, item in diagnosis.calibrated.items()],
        "indistinguishable": [
            listed([words(name) for name in group]) for group in diagnosis.indistinguishable
        ],
        "views": [
            {
                "view": VIEWS[score.view],
                "coordinate": "each output's own"
                if score.coordinate == "own"
                else axis_label(score.coordinate),
                "before": _share(score.before_percent),
                "after": _share(score.after_percent),
            }
            for score in (picture.score for picture in pictures)
            if score is not None
        ],
        "tests": _test_rows(diagnosis),
        "significant": f"{SIGNIFICANT:g}",
        "subject": subject,
        "trials": [_trial_row(diagnosis, fit) for fit in diagnosis.fits],
        "extra": [_extra_row(name, value) for name, value in diagnosis.extra.items()],
        "next_words": diagnosis.next_experiment.words,
        "next_file": NEXT_EXPERIMENT_FILE if diagnosis.next_experiment.inputs is not None else "",
        "gravity": listed([f"{value:g}" for value in diagnosis.dataset.gravity_mps2]),
        "fit_files": fit_files(diagnosis.fits),
    }


def _test_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Return the tests of residuals, before and after side by side."""
    stages = [{test.name: test for test in diagnosis.structure.get(stage, ())} for stage in STAGES]
    return [
        {"what": words, "before": _p_value(stages[0].get(name)), "after": _p_value(stages[1].get(name))}
        for name, words in TESTS.items()
        if name in stages[0]
    ]


def _p_value(test: StructureTest | None) -> str:
    return "-" if test is None else f"{test.p_value:.3f}"


def _number(diagnosis: Diagnosis) -> Mapping[str, str]:
    head = diagnosis.headline
    unit = _unit(head.unit)
    if diagnosis.verdict == CAUSE_FOUND:
        half = half_width(head.gain_percent_ci95)
        return {
            "value": f"{rounded(head.gain_percent, half)} %",
            "words": "less error on data held out "
            f"(95 % interval {interval(head.gain_percent, head.gain_percent_ci95)} %)",
        }
    before, _, noise = _figures(head)
    return {
        "value": f"{before} {unit}".strip(),
        "words": f"error on data held out; the noise is {noise} {unit}".strip(),
    }


def _figures(result: UnitResult) -> tuple[str, str, str]:
    """Return the error before, after, and the noise, to be shown side by side."""
    places = alike((result.rmse_before, result.rmse_after))
    before, after, noise = result.rmse_before, result.rmse_after, result.noise_floor
    return fixed(before, places), fixed(after, places), fixed(noise, max(places, alike([noise])))


def _unit_row(diagnosis: Diagnosis, unit: str) -> dict[str, str]:
    result = diagnosis.by_unit[unit]
    before, after, noise = _figures(result)
    half = half_width(result.gain_percent_ci95)
    return {
        "unit": _unit(unit) or "quaternion",
        "noise": noise,
        "before": before,
        "after": after,
        "gain": rounded(result.gain_percent, half),
        "interval": interval(result.gain_percent, result.gain_percent_ci95),
    }


def _ranking_row(diagnosis: Diagnosis, candidate: Candidate, ranking: Sequence[Candidate]) -> dict[str, Any]:
    finite = [item.heldout_rmse for item in ranking if math.isfinite(item.heldout_rmse)]
    largest = max(finite, default=1.0) or 1.0
    width = 100.0 * candidate.heldout_rmse / largest if math.isfinite(candidate.heldout_rmse) else 0.0
    named = {cause.name for cause in diagnosis.causes}
    return {
        "causes": listed([words(name) for name in candidate.causes]) or "no effect (calibration alone)",
        "heldout": fixed(candidate.heldout_rmse, alike(finite, digits=3)),
        "inside": fixed(candidate.cross_validated_rmse, alike(finite, digits=3)),
        "width": f"{width:.1f}",
        "chosen": set(candidate.causes) == named,
    }


def _ranking_words(diagnosis: Diagnosis) -> str:
    """Return what the highlighted row of the ranking is."""
    if diagnosis.verdict != CAUSE_FOUND:
        return "The highlighted row is the calibrated model, in which no cause is named."
    how = "by the error inside the training data (each part predicted from the others)"
    if set(diagnosis.chosen_in_training) == {cause.name for cause in diagnosis.causes}:
        return f"The highlighted set was chosen {how}; the held-out error took no part."
    first = listed([words(name) for name in diagnosis.chosen_in_training]) or "no cause"
    return (
        f"The highlighted set is the one that is named. What was chosen {how} is {first}; the held-out "
        "data, or the intervals of its numbers, changed it, as the notes say."
    )


def _cause_rows(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    return [
        {
            "name": words(cause.name),
            "summary": EFFECTS[cause.name].summary.replace("`", "") if cause.name in EFFECTS else "",
            "gain": rounded(cause.gain_percent, 5.0),
            "parameters": [_parameter_row(name, item) for name, item in cause.parameters.items()],
        }
        for cause in diagnosis.causes
    ]


def _parameter_row(name: str, parameter: FittedParameter) -> dict[str, Any]:
    text, unit = name_and_unit(name)
    half = half_width(parameter.ci95)
    null = parameter.null
    return {
        "name": text,
        "value": rounded(parameter.value, half),
        "interval": interval(parameter.value, parameter.ci95),
        "null": "" if null is None else rounded(null, half) if null else "0",
        "unit": unit,
        "open": null is not None and parameter.ci95[0] <= null <= parameter.ci95[1],
    }


def _trial_row(diagnosis: Diagnosis, fit: TrialFit) -> dict[str, str]:
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
        "before": fixed(before, alike((before, after))),
        "after": fixed(after, alike((before, after))),
    }


def _extra_row(name: str, value: float) -> dict[str, str]:
    text, unit = name_and_unit(name)
    return {"name": text, "value": rounded(float(value)), "unit": unit}


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


def _share(value: float) -> str:
    if not math.isfinite(value):
        return "undefined"
    return "none" if value < 0.5 else f"{value:.0f} %"


def _sortable(value: float) -> float:
    return value if math.isfinite(value) else math.inf
