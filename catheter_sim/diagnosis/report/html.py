"""The report of a diagnosis: a page that takes a minute to read, with the evidence folded below it.

What was found, the figures, the paths in space, what is wrong, what to do now, what was tried, the doubts.
One HTML file with its pictures in it: it needs no network and fits a telephone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from catheter_sim.diagnosis.report.fitted_series import fit_files
from catheter_sim.diagnosis.report.headline_numbers import (
    headline_numbers,
    heldout_error,
    simulated_text,
)
from catheter_sim.diagnosis.report.next_experiment import NEXT_EXPERIMENT_FILE
from catheter_sim.diagnosis.report.pictures import PATHS, Picture, judged
from catheter_sim.diagnosis.report.result import (
    CAUSE_FOUND,
    DATA_SUSPECT,
    IMPROVED,
    NO_DISCREPANCY,
    Cause,
    Diagnosis,
)
from catheter_sim.diagnosis.report.rows import (
    before_model,
    cause_rows,
    corrected_names,
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
from catheter_sim.diagnosis.report.what_to_do import asks_of, bench_rows, use_words
from catheter_sim.diagnosis.report.wording import axis_label, half_width, listed, rounded, words
from catheter_sim.diagnosis.residuals.coordinates import VIEWS
from catheter_sim.diagnosis.thresholds import ESTABLISHED, LEAST_SHOWN_PROBABILITY, NEAR_NOISE, SIGNIFICANT_P
from catheter_sim.page.render import png_source, rendered

_TEMPLATE = "report_template.html"


_MOST_CANDIDATES = 6  # rows of the ranking; diagnosis.json holds all


def sentence(diagnosis: Diagnosis) -> str:
    """Return what was found, in one to three sentences."""
    robot, error = diagnosis.extended_robot.name, heldout_error(diagnosis)
    if diagnosis.verdict == CAUSE_FOUND:
        names = [listed([words(name) for name in cause.one_of], "or") for cause in diagnosis.causes]
        return " ".join(
            [
                f"The model of {robot} is wrong about {listed(names)}.",
                f"Corrected, its {error.what} on held-out data {error.course}.",
                *_beside(diagnosis),
            ]
        )
    if diagnosis.verdict == IMPROVED:
        several = len(diagnosis.corrections) != 1
        what, none = ("corrections", "None of them is") if several else ("a correction", "It is not")
        return (
            f"With {what}, the {error.what} of {robot} on held-out data {error.course}. {none} established: "
            f"{_why_not(diagnosis)}."
        )
    if diagnosis.verdict == NO_DISCREPANCY:
        model = "calibrated model" if diagnosis.calibrated else "model"
        as_is = "" if diagnosis.calibrated else ", as specified,"
        return (
            f"The {model} of {robot}{as_is} agrees with these data. Its {error.what} on held-out data is "
            f"{error.said(error.before)}; row-to-row noise is {error.said_noise}."
        )
    if diagnosis.has_too_little:
        return too_little_sentence(diagnosis)
    if diagnosis.verdict == DATA_SUSPECT:
        first, *others = [item.words for item in diagnosis.data_faults] or ["the report does not say where."]
        more = f" There {'is' if len(others) == 1 else 'are'} {len(others)} more below." if others else ""
        return f"These data of {robot} look wrong, so no cause was looked for. {first}{more}"
    return (
        f"The {error.what} of {robot} on held-out data is {error.said(error.before)}; row-to-row noise is "
        f"{error.said_noise}. No cause is established: {_why_not(diagnosis)}."
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


def _beside(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield what is said beside named causes: further corrections, and something else at work."""
    count = len(diagnosis.corrections)
    if count:
        number = "One further correction lowers" if count == 1 else f"{count} further corrections lower"
        yield f"{number} the error; {'it is not' if count == 1 else 'none is'} established."
    outside = diagnosis.probabilities.get("outside", 0.0)
    if outside >= ESTABLISHED:
        yield f"Something outside the list is at work too, with probability {outside:.2f}."
    elif any(note.code == "something_else_too" for note in diagnosis.notes):
        yield "Something else is at work too."


def _why_not(diagnosis: Diagnosis) -> str:
    """Return why no cause is established, by the probabilities."""
    outside = diagnosis.probabilities.get("outside", 0.0)
    if outside >= ESTABLISHED:
        return f"something outside the list is at work with probability {outside:.2f}"
    likely = {
        name: value
        for name, value in diagnosis.probabilities.items()
        if name not in ("none", "outside") and value >= LEAST_SHOWN_PROBABILITY
    }
    if not likely:
        return "these data do not show what is wrong"
    name = max(likely, key=lambda item: likely[item])
    said = f"the most probable one, {words(name)}, has probability {likely[name]:.2f}"
    return f"{said} and does not pass every check" if likely[name] >= ESTABLISHED else said


@dataclass(frozen=True)
class Head:
    """What a report says that is not of one recording, but of a comparison of two.

    Attributes:
        sentence: what was found.
        verdict: of diagnosis.json.
        asks: what the verdict asks a reader to do.
        title: above the causes.
        null: what a number's value without the cause is.
    """

    sentence: str
    verdict: str
    asks: str
    title: str = "What is wrong"
    null: str = "without the effect"


def report_html(diagnosis: Diagnosis, pictures: Sequence[Picture], head: Head | None = None) -> str:
    """Return the report as one HTML text.

    Args:
        diagnosis: what was found.
        pictures: from `figures`.
        head: of a comparison; None: the diagnosis's own.
    """
    context = {
        "head": head or Head(sentence(diagnosis), diagnosis.verdict, asks_of(diagnosis)),
        "dataset": diagnosis.dataset,
        "diagnosis": diagnosis,
        "unit": shown_unit(diagnosis.unit),
        "before_model": before_model(diagnosis),
        "provenance": diagnosis.provenance,
        **_summary(diagnosis),
        **_ranking(diagnosis),
        **_evidence(diagnosis, pictures),
    }
    return rendered("catheter_sim.diagnosis", _TEMPLATE, context, {"spoken": spoken})


def _summary(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return what stands before the evidence."""
    return {
        "numbers": headline_numbers(diagnosis),
        "causes": cause_rows(diagnosis.causes),
        "corrections": cause_rows(diagnosis.corrections),
        "absorbs": [words(cause.name) for cause in diagnosis.absorbs],
        "indistinguishable": [
            listed([words(name) for name in group], "or") for group in diagnosis.indistinguishable
        ],
        "why_not": _why_not(diagnosis),
        "bench": bench_rows(diagnosis),
        "next_words": diagnosis.next_experiment.words,
        "next_file": NEXT_EXPERIMENT_FILE if diagnosis.next_experiment.inputs is not None else "",
        "use_words": use_words(diagnosis),
        "remainder": remainder_rows(diagnosis),
    }


def _ranking(diagnosis: Diagnosis) -> dict[str, Any]:
    best = sorted(diagnosis.ranking, key=lambda item: sortable(item.heldout_rmse))
    named = corrected_names(diagnosis)
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
    named = corrected_names(diagnosis)
    if not named:
        return f"The highlighted row is the {before_model(diagnosis)}, without any cause."
    if set(diagnosis.chosen_in_training) == named:
        return "The highlighted set was chosen inside the training data. The held-out error took no part."
    first = listed([words(name) for name in diagnosis.chosen_in_training]) or "no cause"
    return (
        f"The highlighted set is in robot.toml. Inside the training data {first} was chosen. The notes say "
        "what changed it."
    )
