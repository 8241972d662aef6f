"""The figures at the head of the report: what the simulation is off by first, beside it what was fitted."""

from __future__ import annotations

import math

from catheter_sim.diagnosis.report.result import CAUSE_FOUND, Diagnosis
from catheter_sim.diagnosis.report.rows import errors_and_noise, shown_unit
from catheter_sim.diagnosis.report.wording import digits_to_tell, fixed, half_width, interval, rounded


def simulated_error(diagnosis: Diagnosis, unit: str) -> float:
    """Return MuJoCo's error on data held out, with what is reported in it; NaN: not simulated."""
    suffix = "" if unit == "1" else f"_{unit}"
    return float(diagnosis.extra.get(f"heldout_simulation_rmse_after{suffix}", math.nan))


def simulated_text(diagnosis: Diagnosis, unit: str) -> str:
    """Return that error with as many decimals as the fast model's; "-" where it was not simulated."""
    error = simulated_error(diagnosis, unit)
    result = diagnosis.by_unit[unit]
    places = digits_to_tell((result.rmse_before, result.rmse_after))
    return "-" if math.isnan(error) else fixed(error, places)


def headline_numbers(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Return the figures at the head, the first the largest: look, value with unit, and words.

    MuJoCo's error comes first, with what is reported in it; the fast model's (the analytic twin, by which
    causes are fitted and chosen) stands beside it, then the noise. Where nothing was simulated, the fast
    model's comes first. Where no model was fitted there are none.
    """
    if not diagnosis.was_fitted:
        return []
    head = diagnosis.told
    unit = shown_unit(head.unit)
    before, after, noise = errors_and_noise(head)
    found = diagnosis.verdict == CAUSE_FOUND
    model, error = ("corrected", after) if found else ("calibrated", before)
    simulated = simulated_text(diagnosis, head.unit)
    shown = []
    if simulated != "-":
        shown.append((simulated, f"error of the {model} simulation (MuJoCo) on data held out"))
        shown.append((error, f"error of the {model} fast model, by which causes were fitted"))
    else:
        shown.append((error, f"error of the {model} fast model on data held out; MuJoCo was not run"))
    numbers = [("", value, unit, words) for value, words in shown]
    if found:
        numbers.append(("before", before, unit, "error before: the calibrated fast model without causes"))
    numbers.append(("", noise, unit, "noise of the measurement"))
    if found:
        half = half_width(head.gain_percent_ci95)
        says = interval(head.gain_percent, head.gain_percent_ci95)
        gain = rounded(head.gain_percent, half)
        numbers.append(("", gain, "%", f"less error, by the fast model (95 % interval {says} %)"))
    return [
        {"look": "first" if index == 0 else look, "value": f"{value} {of}".strip(), "words": words}
        for index, (look, value, of, words) in enumerate(numbers)
    ]
