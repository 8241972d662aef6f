"""The figures at the head of the report: the error as a user meets it, the noise beside it, the gain."""

from __future__ import annotations

import math
from dataclasses import dataclass

from catheter_sim.diagnosis.report.result import Diagnosis, UnitResult
from catheter_sim.diagnosis.report.rows import before_model, shown_unit
from catheter_sim.diagnosis.report.to_json import tip_mm
from catheter_sim.diagnosis.report.wording import digits_to_tell, fixed, half_width, interval, rounded


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
    """

    what: str
    unit: str
    before: float
    after: float
    simulated: float
    noise: float
    repeatability: float

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


def heldout_error(diagnosis: Diagnosis) -> HeldOutError:
    """Return the held-out error that a report speaks of.

    The tip's distance in space comes first, unless what was corrected helps another unit alone.
    """
    told, tip = diagnosis.told, tip_mm(diagnosis)
    helped = told.unit == "mm" or not diagnosis.is_corrected
    if tip is not None and "mm" in diagnosis.by_unit:
        result = diagnosis.by_unit["mm"]
        if helped or result.gain_percent_ci95[0] > 0.0:
            simulated = diagnosis.extra.get("heldout_simulation_tip_distance_rmse_after_mm", math.nan)
            errors = (tip["before"], tip["after"], simulated)
            return _error(diagnosis, result, "tip error", errors, math.sqrt(3.0))
    errors = (told.rmse_before, told.rmse_after, simulated_error(diagnosis, told.unit))
    return _error(diagnosis, told, "error", errors, 1.0)


def _error(
    diagnosis: Diagnosis, result: UnitResult, what: str, errors: tuple[float, float, float], scale: float
) -> HeldOutError:
    """`scale`: from an output's root mean square to that of `what`; of three alike outputs the root of 3."""
    before, after, simulated = errors
    return HeldOutError(
        what,
        shown_unit(result.unit),
        before,
        after if diagnosis.is_corrected else before,
        simulated,
        scale * result.noise_floor,
        scale * diagnosis.repeatability.get(result.unit, math.nan),
    )


def simulated_error(diagnosis: Diagnosis, unit: str) -> float:
    """Return MuJoCo's error of each output on held-out data; NaN: not simulated."""
    suffix = "" if unit == "1" else f"_{unit}"
    return float(diagnosis.extra.get(f"heldout_simulation_rmse_after{suffix}", math.nan))


def simulated_text(diagnosis: Diagnosis, unit: str) -> str:
    """Return that error with as many decimals as the fast model's; "-" where it was not simulated."""
    error = simulated_error(diagnosis, unit)
    result = diagnosis.by_unit[unit]
    places = digits_to_tell((result.rmse_before, result.rmse_after))
    return "-" if math.isnan(error) else fixed(error, places)


def reported_model(diagnosis: Diagnosis, noun: str = "model") -> str:
    """Return what the reported model is called: "corrected model", or as before correction."""
    return f"corrected {noun}" if diagnosis.is_corrected else before_model(diagnosis, noun)


def headline_numbers(diagnosis: Diagnosis) -> list[dict[str, str]]:
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
    numbers.append(("", error.said_noise, "row-to-row noise"))
    if not math.isnan(error.repeatability):
        numbers.append(("", error.said(error.repeatability), "repeatability: two runs of the same commands"))
    if corrected:
        gain = diagnosis.told
        half = half_width(gain.gain_percent_ci95)
        says = interval(gain.gain_percent, gain.gain_percent_ci95)
        words = f"less error over all outputs in {shown_unit(gain.unit)} (95 % interval {says} %)"
        numbers.append(("", f"{rounded(gain.gain_percent, half)} %", words.replace("  ", " ")))
    return [
        {"look": "first" if index == 0 else look, "value": value, "words": words}
        for index, (look, value, words) in enumerate(numbers)
    ]
