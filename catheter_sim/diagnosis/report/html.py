"""The report of a diagnosis: a page that a person reads in a minute, with the evidence folded below it.

One sentence, the figures, the paths in space, what is wrong, what to do now, what was tried, the doubts. One
HTML file that needs no network and is read on a telephone as on paper; its pictures are inlined.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from catheter_sim.diagnosis.report.fitted_series import fit_files
from catheter_sim.diagnosis.report.headline_numbers import headline_numbers, simulated_text
from catheter_sim.diagnosis.report.pictures import PATHS, Picture, judged
from catheter_sim.diagnosis.report.result import (
    CAUSE_FOUND,
    DATA_SUSPECT,
    NEXT_EXPERIMENT_FILE,
    Cause,
    Diagnosis,
)
from catheter_sim.diagnosis.report.rows import (
    cause_rows,
    errors_and_noise,
    extra_row,
    key_rows,
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
from catheter_sim.diagnosis.report.spoken import column_words, number_words, spoken
from catheter_sim.diagnosis.report.what_to_do import bench_rows, use_words
from catheter_sim.diagnosis.report.wording import axis_label, half_width, listed, rounded, words
from catheter_sim.diagnosis.residuals.coordinates import VIEWS
from catheter_sim.diagnosis.thresholds import LEAST_SHOWN_PROBABILITY, NEAR_NOISE, SIGNIFICANT_P
from catheter_sim.page.render import png_source, rendered

_TEMPLATE = "report_template.html"


_MOST_CANDIDATES = 6  # rows of the ranking; diagnosis.json holds all


def sentence(diagnosis: Diagnosis) -> str:
    """Return what was found, in one sentence."""
    head = diagnosis.told
    robot = diagnosis.extended_robot.name
    before, after, noise = (f"{text} {shown_unit(head.unit)}".strip() for text in errors_and_noise(head))
    if diagnosis.verdict == CAUSE_FOUND:
        causes = [_or_equals(cause.name, diagnosis.indistinguishable) for cause in diagnosis.causes]
        if any(note.code == "something_else_too" for note in diagnosis.notes):
            causes.append("something that is not named")
        return (
            f"The model of {robot} is wrong about {listed(causes)}: corrected, its error on data held out "
            f"falls from {before} to {after}."
        )
    if diagnosis.verdict == "no_discrepancy":
        return (
            f"The calibrated model of {robot} agrees with these measurements: its error on data held out "
            f"is {before}, the noise {noise}, and no cause is named."
        )
    if diagnosis.has_too_little:
        return too_little_sentence(diagnosis)
    if diagnosis.verdict == DATA_SUSPECT:
        return (
            f"These data of {robot} look wrong, so that no cause was looked for: "
            f"{listed([item.words for item in diagnosis.data_faults])}"
        )
    return (
        f"The model of {robot} is off by {before} on data held out, where the noise is {noise}, and no cause "
        "that was tried explains it."
    )


def too_little_sentence(diagnosis: Diagnosis) -> str:
    """Return what is missing, after what fits all the same where that was asked for."""
    robot, missing = diagnosis.extended_robot.name, " ".join(item.words for item in diagnosis.data_faults)
    found = diagnosis.unproved
    if found is None:
        return f"No cause can be named from these data of {robot}. {missing}"
    result = max(found.by_unit.values(), key=lambda item: item.gain_percent)
    before, after, noise = (f"{text} {shown_unit(result.unit)}".strip() for text in errors_and_noise(result))
    if not found.causes:
        fits = f"The search found nothing that fits these data of {robot} better than the calibrated model"
        return f"{fits}, which is off by {before} on data held out. That rules nothing out. {missing}"
    fits, s = listed([_with_numbers(cause) for cause in found.causes]), "s" * (len(found.causes) == 1)
    if found.times_noise <= NEAR_NOISE:
        fits += f" explain{s} training and held-out data of {robot} to the noise"
    else:
        fits += f" lower{s} the error of {robot} on data held out from {before} to {after} (noise: {noise})"
    return f"{fits[0].upper()}{fits[1:]}. That cannot be proved. {missing}"


def _with_numbers(cause: Cause) -> str:
    """Return a cause in words with its numbers: "actuation gain 1.30"."""
    shown = []
    for name, item in cause.parameters.items():
        text, unit = number_words(name)
        value = f"{rounded(item.value, half_width(item.ci95))} {unit}".strip()
        shown.append(value if len(cause.parameters) == 1 else f"{text} {value}")
    return f"{words(cause.name)} {shown[0]}" if len(shown) == 1 else f"{words(cause.name)} ({listed(shown)})"


def _or_equals(name: str, groups: Sequence[Sequence[str]]) -> str:
    """Return a cause in words, with those that these data cannot tell from it."""
    others = [words(other) for group in groups if name in group for other in group if other != name]
    return f"{words(name)} (or {listed(others, 'or')})" if others else words(name)


def report_html(diagnosis: Diagnosis, pictures: Sequence[Picture], head: str = "") -> str:
    """Return the report as one HTML text.

    Args:
        diagnosis: what was found.
        pictures: from `figures`.
        head: what was found, in one sentence; "": as `sentence` says it.
    """
    context = {
        "sentence": head or sentence(diagnosis),
        "dataset": diagnosis.dataset,
        "diagnosis": diagnosis,
        "unit": shown_unit(diagnosis.unit),
        **_summary(diagnosis),
        **_ranking(diagnosis),
        **_evidence(diagnosis, pictures),
    }
    return rendered("catheter_sim.diagnosis.report", _TEMPLATE, context, {"spoken": spoken})


def _summary(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return what stands before the evidence."""
    return {
        "numbers": headline_numbers(diagnosis),
        "verdict": diagnosis.verdict.replace("_", " "),
        "causes": cause_rows(diagnosis),
        "absorbs": listed([words(cause.name) for cause in diagnosis.absorbs]),
        "indistinguishable": [
            listed([words(name) for name in group]) for group in diagnosis.indistinguishable
        ],
        "bench": bench_rows(diagnosis),
        "next_words": diagnosis.next_experiment.words,
        "next_file": NEXT_EXPERIMENT_FILE if diagnosis.next_experiment.inputs is not None else "",
        "use_words": use_words(diagnosis),
        "remainder": remainder_rows(diagnosis),
    }


def _ranking(diagnosis: Diagnosis) -> dict[str, Any]:
    best = sorted(diagnosis.ranking, key=lambda item: sortable(item.heldout_rmse))
    named = {cause.name for cause in diagnosis.causes}
    shown = [
        item
        for index, item in enumerate(best)
        if index < _MOST_CANDIDATES or not item.causes or set(item.causes) == named
    ]
    return {
        "ranking": [ranking_row(diagnosis, item, best) for item in shown],
        "ranking_left_out": len(best) - len(shown),
        "ranking_words": _ranking_words(diagnosis),
        "noise": errors_and_noise(diagnosis.headline)[2],
    }


def _evidence(diagnosis: Diagnosis, pictures: Sequence[Picture]) -> dict[str, Any]:
    _, subject = judged(diagnosis)
    dataset = diagnosis.dataset
    not_computed = {} if diagnosis.was_fitted else {"before": "-", "after": "-"}
    return {
        "pictures": [
            {
                "name": picture.name,
                "caption": picture.caption,
                "alt": spoken(picture.caption).striptags(),
                "wide": picture.name != PATHS,
                "data": png_source(picture.png),
            }
            for picture in pictures
        ],
        "shown_first": sum(picture.score is None for picture in pictures),
        "units": [
            unit_row(diagnosis, unit) | {"simulated": simulated_text(diagnosis, unit)}
            for unit in (diagnosis.by_unit if diagnosis.was_fitted else ())
        ],
        "extra": [extra_row(name, value) for name, value in diagnosis.extra.items()],
        "probabilities": probability_rows(diagnosis),
        "least_probability": f"{LEAST_SHOWN_PROBABILITY:g}",
        "calibrated": [parameter_row(name, item) for name, item in diagnosis.calibrated.items()],
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
        "trials": [trial_row(diagnosis, fit) | not_computed for fit in diagnosis.fits],
        "gravity": listed([f"{value:g}" for value in dataset.gravity_mps2]),
        "inputs": listed([column_words(name) for name in dataset.input_channels]),
        "outputs": listed([column_words(name) for name in dataset.output_channels]),
        "fit_files": fit_files(diagnosis.fits),
        "keys": key_rows(diagnosis),
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
