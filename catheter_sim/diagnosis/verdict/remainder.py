"""What is left of the error: how many times the noise, and what it depends on, unit by unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from catheter_sim.diagnosis.data.trials import Dataset
from catheter_sim.diagnosis.fitting.noise import times_noise
from catheter_sim.diagnosis.report.result import Remainder, TrialFit, UnitResult
from catheter_sim.diagnosis.residuals.structure import structure_tests


def remainders(
    dataset: Dataset, fits: Sequence[TrialFit], by_unit: Mapping[str, UnitResult]
) -> dict[str, Remainder]:
    """Return what is left of each unit's error.

    Args:
        dataset: what was diagnosed.
        fits: every trial, computed by the model that is reported.
        by_unit: its held-out figures.
    """
    found = {}
    for unit, result in by_unit.items():
        tests = structure_tests(dataset, fits, unit, "after")
        strong = sorted((item for item in tests if item.significant), key=lambda item: -item.share_percent)
        times = times_noise(result.rmse_after, result.noise_floor)
        found[unit] = Remainder(times, tuple(item.name for item in strong))
    return found
