"""The report of a diagnosis: one sentence, one number, one picture, then the evidence and the doubts.

One HTML file that needs no network and prints on A4; its pictures are inlined.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

from jinja2 import Environment, StrictUndefined

from catheter_sim.diagnosis.report.fitted_series import fit_files
from catheter_sim.diagnosis.report.pictures import Picture, judged
from catheter_sim.diagnosis.report.result import (
    CAUSE_FOUND,
    DATA_SUSPECT,
    NEXT_EXPERIMENT_FILE,
    Diagnosis,
)
from catheter_sim.diagnosis.report.rows import (
    cause_rows,
    errors_and_noise,
    extra_row,
    parameter_row,
    probability_rows,
    ranking_row,
    remainder_rows,
    shown_share,
    shown_unit,
    sortable,
    test_rows,
    trial_row,
    unit_row,
)
from catheter_sim.diagnosis.report.wording import (
    axis_label,
    half_width,
    interval,
    listed,
    rounded,
    words,
)
from catheter_sim.diagnosis.residuals.coordinates import VIEWS
from catheter_sim.diagnosis.thresholds import LEAST_SHOWN_PROBABILITY, SIGNIFICANT_P

_TEMPLATE = "report_template.html"


_MOST_CANDIDATES = 12  # rows of the ranking; diagnosis.json holds all


def sentence(diagnosis: Diagnosis) -> str:
    """Return what was found, in one sentence."""
    head = diagnosis.headline
    robot = diagnosis.extended_robot.name
    before, after, noise = (f"{text} {shown_unit(head.unit)}".strip() for text in errors_and_noise(head))
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
            f"{listed([item.words for item in diagnosis.data_faults])}"
        )
    return (
        f"The model of {robot} is off by {before} on data held out, where the noise is {noise}, and no cause "
        "that was tried explains it."
    )


def report_html(diagnosis: Diagnosis, pictures: Sequence[Picture], head: str = "") -> str:
    """Return the report as one HTML text.

    Args:
        diagnosis: what was found.
        pictures: from `figures`.
        head: what was found, in one sentence; "": as `sentence` says it.
    """
    text = resources.files("catheter_sim.diagnosis.report").joinpath(_TEMPLATE).read_text(encoding="utf-8")
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
    return environment.from_string(text).render(
        pictures=sources, **_context(diagnosis, pictures), sentence=head or sentence(diagnosis)
    )


def _context(diagnosis: Diagnosis, pictures: Sequence[Picture]) -> dict[str, Any]:
    head = diagnosis.headline
    _, subject = judged(diagnosis)
    best = sorted(diagnosis.ranking, key=lambda item: sortable(item.heldout_rmse))
    named = {cause.name for cause in diagnosis.causes}
    shown = [
        item
        for index, item in enumerate(best)
        if index < _MOST_CANDIDATES or not item.causes or set(item.causes) == named
    ]
    return {
        "diagnosis": diagnosis,
        "dataset": diagnosis.dataset,
        "number": _number(diagnosis),
        "verdict": diagnosis.verdict.replace("_", " "),
        "unit": shown_unit(diagnosis.unit),
        "noise": errors_and_noise(head)[2],
        "units": [unit_row(diagnosis, unit) for unit in diagnosis.by_unit],
        "ranking": [ranking_row(diagnosis, item, best) for item in shown],
        "ranking_left_out": len(best) - len(shown),
        "ranking_words": _ranking_words(diagnosis),
        "causes": cause_rows(diagnosis),
        "absorbs": listed([words(cause.name) for cause in diagnosis.absorbs]),
        "probabilities": probability_rows(diagnosis),
        "least_probability": f"{LEAST_SHOWN_PROBABILITY:g}",
        "remainder": remainder_rows(diagnosis),
        "calibrated": [parameter_row(name, item) for name, item in diagnosis.calibrated.items()],
        "indistinguishable": [
            listed([words(name) for name in group]) for group in diagnosis.indistinguishable
        ],
        "views": [
            {
                "view": VIEWS[score.view],
                "coordinate": "each output's own"
                if score.coordinate == "own"
                else axis_label(score.coordinate),
                "before": shown_share(score.before_percent),
                "after": shown_share(score.after_percent),
            }
            for score in (picture.score for picture in pictures)
            if score is not None
        ],
        "tests": test_rows(diagnosis),
        "significant": f"{SIGNIFICANT_P:g}",
        "subject": subject,
        "trials": [trial_row(diagnosis, fit) for fit in diagnosis.fits],
        "extra": [extra_row(name, value) for name, value in diagnosis.extra.items()],
        "next_words": diagnosis.next_experiment.words,
        "next_file": NEXT_EXPERIMENT_FILE if diagnosis.next_experiment.inputs is not None else "",
        "gravity": listed([f"{value:g}" for value in diagnosis.dataset.gravity_mps2]),
        "fit_files": fit_files(diagnosis.fits),
    }


def _number(diagnosis: Diagnosis) -> Mapping[str, str]:
    head = diagnosis.headline
    unit = shown_unit(head.unit)
    if diagnosis.verdict == CAUSE_FOUND:
        half = half_width(head.gain_percent_ci95)
        return {
            "value": f"{rounded(head.gain_percent, half)} %",
            "words": "less error on data held out "
            f"(95 % interval {interval(head.gain_percent, head.gain_percent_ci95)} %)",
        }
    before, _, noise = errors_and_noise(head)
    return {
        "value": f"{before} {unit}".strip(),
        "words": f"error on data held out; the noise is {noise} {unit}".strip(),
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
